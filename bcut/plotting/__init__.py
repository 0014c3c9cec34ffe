"""Pictures of triangulations, in the plane and in space. Needs matplotlib, the extra `plot`."""

from bcut.plotting.plot import PICTURE_SUFFIXES, plot

__all__ = ["PICTURE_SUFFIXES", "plot"]
