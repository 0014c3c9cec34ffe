"""Bounds from linear relaxations: the cutting-plane loop at the root, and exact bounds from floating-point duals."""
