"""Named families of point configurations."""

from bcut.families.registry import FAMILIES, Family, build, families, is_family

__all__ = ["FAMILIES", "Family", "build", "families", "is_family"]
