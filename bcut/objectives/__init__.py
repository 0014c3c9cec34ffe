"""Objectives: a cost for every d-simplex, exact where it can be, and a sense."""
