"""The separator seam: what a separator sees, what it yields, and what a host does with it."""
