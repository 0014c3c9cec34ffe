"""A chirotope that computes signs when they are asked for: for configurations with too many subsets for tables."""

from __future__ import annotations

from math import prod
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from bcut.errors import TooLargeError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import orientation_signs


class PartialChirotope(Chirotope):
    """Orientations on demand, and the facets of the hull where they are known from elsewhere.

    Everything that lists all subsets (`bases`, `facets`, `sides`, `facet_is_interior`) raises
    `TooLargeError`.

    Parameters
    ----------
    configuration : PointConfiguration
    hull_facets : sequence of tuple of int
        All points on each facet of the hull, ascending.
    """

    configuration: PointConfiguration

    def __init__(self, configuration: PointConfiguration, hull_facets: tuple[tuple[int, ...], ...]) -> None:
        super().__init__(configuration.n, configuration.dimension, np.empty(0, dtype=np.int8))
        # The base class is a frozen data class.
        object.__setattr__(self, "configuration", configuration)
        object.__setattr__(self, "_hull_facets", hull_facets)

    @property
    def hull_facets(self) -> tuple[tuple[int, ...], ...]:
        """Facets of the convex hull, each as the ascending tuple of all configuration points on it."""
        facets: tuple[tuple[int, ...], ...] = self.__dict__["_hull_facets"]
        return facets

    def orientations(self, subsets: NDArray[np.integer]) -> NDArray[np.int8]:
        """Compute the orientations of (d+1)-tuples, shape (..., d + 1) to (...)."""
        shape = subsets.shape[:-1]
        flat = subsets.reshape(prod(shape), subsets.shape[-1])
        return orientation_signs(self.configuration, flat).reshape(shape)

    def _refuse(self) -> NoReturn:
        raise TooLargeError(
            f"{self.configuration.name}: a table of all its simplices is wanted where only some were made; "
            "take fewer points, or leave out what needs the table"
        )

    @property
    def bases(self) -> NoReturn:
        """Refuse: there are too many."""
        self._refuse()

    @property
    def facets(self) -> NoReturn:
        """Refuse: there are too many."""
        self._refuse()

    @property
    def sides(self) -> NoReturn:
        """Refuse: there are too many."""
        self._refuse()

    @property
    def facet_is_interior(self) -> NoReturn:
        """Refuse: there are too many."""
        self._refuse()

    @property
    def is_general(self) -> NoReturn:
        """Refuse: it takes all signs to tell."""
        self._refuse()
