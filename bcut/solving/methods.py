"""Which way a problem is solved: one decision, made from its size, its symmetries and what is asked.

Measured on two cores with one process, in seconds of the whole run:

- *listing against fixing.* Loading the compiled kernels takes about 0.6 s, however small the problem is. Minimum
  weight of random points, all used: 4,176 columns (n = 20, 3D) 0.3 by listing and 1.2 by fixing; 10,673 (n = 25) 1.0
  and 1.3; 11,008 (n = 80, 2D) 0.8 and 1.3. They meet at about 15,000 columns.
- *orbits.* Where symmetries divide the number of columns by eight or more, a program over their orbits is small
  enough for any size that can be listed; beyond, any symmetry helps.
- *elimination* is for minimum weight in the plane, all points used, and from about the same size on: n = 160 takes 0.1
  without the kernels' loading, 10,000 takes 3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import comb

from bcut.errors import InputError
from bcut.geometry.configuration import PointConfiguration
from bcut.objectives.syntax import ObjectiveName

METHODS = ("auto", "listing", "orbits", "fixing", "elimination", "scip")

# From so many (d+1)-subsets on, the symmetries of a configuration are used where it has at least so many; with more
# subsets than can be listed, where it has any.
_ORBITS_FROM, _SYMMETRIES = 10_000, 8
_LISTED = 20_000_000
# From so many columns on, fixing is faster than listing.
_FIXING_FROM = 15_000
# Random points have about so many empty simplices: a factor of n**d, for d = 2 and 3.
_EMPTY = {2: 2.0, 3: 0.8}


@dataclass(frozen=True)
class Traits:
    """What the decision depends on.

    Attributes
    ----------
    configuration : PointConfiguration
    name : ObjectiveName
    spanning : bool
    whole_question : bool
        Whether it is about Formulation 2, with no required or forbidden faces and no star.
    only_link : bool
        Whether no other cut family is asked for.
    following : bool
        Whether further objectives decide among the best.
    symmetries : callable
        Returns the number of symmetries; asked for only where it matters.
    only_bound : bool
        Whether the relaxation is what is asked for.
    """

    configuration: PointConfiguration
    name: ObjectiveName
    spanning: bool
    whole_question: bool
    only_link: bool
    following: bool
    symmetries: Callable[[], int]
    only_bound: bool = False

    @property
    def is_plane_weight(self) -> bool:
        """Whether a minimum weight triangulation of the plane is wanted, with all points."""
        plain = self.whole_question and self.spanning and not self.following and not self.only_bound
        minimum = (self.name.text, self.name.sense) == ("weight", "min")
        return plain and minimum and self.configuration.dimension == 2


def choose_method(asked: str, traits: Traits) -> str:
    """Return the method that is meant.

    Parameters
    ----------
    asked : str
        One of `METHODS`.
    traits : Traits

    Raises
    ------
    InputError
        If the method asked for does not know problems of this kind.
    """
    if asked == "auto":
        return _chosen(traits)
    if asked == "orbits":
        _check_orbits(traits)
    if asked == "fixing":
        _check_fixing(traits)
    if asked == "elimination":
        _check_elimination(traits)
    return asked


def check_method(method: str, name: ObjectiveName, following: Sequence[ObjectiveName]) -> None:
    """Refuse an unknown method, and those that know sums of one objective only where others are wanted.

    Raises
    ------
    InputError
    """
    if method not in METHODS:
        raise InputError(f"unknown method '{method}': known are {', '.join(METHODS)}")
    if method in ("orbits", "fixing", "elimination", "scip") and (name.is_bottleneck or following):
        what = f"a bottleneck such as '{name.text}'" if name.is_bottleneck else "one objective after another"
        raise InputError(f"method '{method}' does not work with {what}; use the method listing")


def expected_columns(configuration: PointConfiguration, *, spanning: bool) -> float:
    """Return about how many columns the program has; no fewer than it has where points may be left out."""
    n, d = configuration.n, configuration.dimension
    subsets = comb(n, d + 1)
    return min(subsets, _EMPTY[d] * n**d) if spanning and d in _EMPTY else subsets


def _chosen(traits: Traits) -> str:
    configuration = traits.configuration
    if traits.following or traits.name.is_bottleneck or not traits.whole_question:
        return "listing"
    subsets = comb(configuration.n, configuration.dimension + 1)
    # Other families than link are at work in the tree only, over orbits: who asks for them does not want orbits.
    if traits.name.text == "cardinality" and traits.only_link and subsets >= _ORBITS_FROM:
        fewest = _SYMMETRIES if subsets <= _LISTED else 2
        if traits.symmetries() >= fewest:
            return "orbits"
    large = expected_columns(configuration, spanning=traits.spanning) >= _FIXING_FROM
    if large and traits.is_plane_weight and traits.only_link:
        return "elimination"
    return "fixing" if large else "listing"


def _check_orbits(traits: Traits) -> None:
    objective = traits.name.text
    if not traits.whole_question:
        raise InputError(
            "method 'orbits': it works with formulation 2, and without required or forbidden faces and stars; use "
            "the method listing"
        )
    if objective != "cardinality" and not objective.startswith("costs:"):
        raise InputError(
            f"method 'orbits': objective '{objective}' is not known to be invariant; use cardinality or costs:FILE"
        )


def _check_fixing(traits: Traits) -> None:
    if not traits.whole_question:
        raise InputError(
            "method 'fixing': it works with formulation 2, and without required or forbidden faces and stars; use "
            "the method listing"
        )


def _check_elimination(traits: Traits) -> None:
    if not traits.is_plane_weight:
        raise InputError(
            "method 'elimination': it is for triangulations of least weight that use all points of the plane "
            "(--objective weight --spanning in dimension 2), without required or forbidden faces and stars, and for "
            "solve only; use the method listing"
        )
