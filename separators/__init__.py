"""The built-in cut families, one file each, written against the same seam as a user's own."""
