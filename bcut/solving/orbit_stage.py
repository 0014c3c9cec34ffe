"""The bound of a symmetric configuration from the orbits of its simplices, and what is left to be searched.

Nothing here lists all simplices: it is the way to instances that are far too large to be written down.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.orbit_cuts import OrbitCut, orbit_root_with_cuts
from bcut.bounds.orbit_root import OrbitRoot, orbit_root
from bcut.bounds.root import Round
from bcut.errors import TooLargeError
from bcut.formulations.formulation import Formulation
from bcut.formulations.orbit_cocircuits import OrbitFormulation, orbit_formulation
from bcut.formulations.partial_cocircuits import partial_cocircuit_formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.orbits import simplex_orbits
from bcut.geometry.permutations import PermutationGroup
from bcut.geometry.symmetry import symmetry_group
from bcut.geometry.volumes import pulling_triangulation
from bcut.objectives.objective import Objective, make_objective

# Columns of a program that is written down for SCIP, at most.
MAX_COLUMNS = 1_000_000
# A larger group is replaced by a subgroup whose elements can be gone through.
MAX_ORDER = 20_000_000


@dataclass(frozen=True, eq=False)
class OrbitStage:
    """Orbits, the averaged relaxation with duals that fix the most, and its exact bound.

    Attributes
    ----------
    configuration : PointConfiguration
    group : PermutationGroup
        Leaves the configuration and the objective invariant.
    formulation : OrbitFormulation
    objective : Objective
        Of the representatives.
    root : OrbitRoot
    cuts : tuple of OrbitCut
        Those in the formulation.
    rounds : tuple of Round
        Of the cutting-plane loop.
    separating : float
        Seconds that it spent on finding cuts.
    """

    configuration: PointConfiguration
    group: PermutationGroup
    formulation: OrbitFormulation
    objective: Objective
    root: OrbitRoot
    cuts: tuple[OrbitCut, ...] = ()
    rounds: tuple[Round, ...] = ()
    separating: float = 0.0

    @property
    def flag(self) -> NDArray[np.int64]:
        """An affine basis: the vertices of any simplex."""
        return self.formulation.simplices[0]

    def columns_within(self, target: Fraction) -> int:
        """Count the simplices that a triangulation with ``sign * objective <= target`` may use."""
        assert self.root.bound is not None
        return int(self.formulation.sizes[self.root.bound.orbits_within(target)].sum())

    def target_for(self, columns: int) -> Fraction:
        """Return the largest target within which at most so many simplices are; below the bound if there is none."""
        bound = self.root.bound
        assert bound is not None
        order = np.argsort(bound.reduced_costs, kind="stable")
        within = np.flatnonzero(np.cumsum(self.formulation.sizes[order]) > columns)
        if not len(within):
            return bound.value + Fraction(int(bound.reduced_costs[order[-1]]), bound.denominator)
        # Anything below the reduced cost of the first orbit that is too much.
        return bound.value + Fraction(int(bound.reduced_costs[order[within[0]]]) - 1, bound.denominator)

    def with_link_cuts(self, *, rounds: int = 200, seconds: Callable[[], float] | None = None) -> OrbitStage:
        """Return the same stage after a cutting-plane loop with averaged link cuts.

        Parameters
        ----------
        rounds : int
            Relaxations with cuts, at most.
        seconds : callable, optional
            Returns the seconds that are left.
        """
        found = orbit_root_with_cuts(self.formulation, self.objective, rounds=rounds, seconds=seconds)
        if (
            found.root.bound is None
            or self.root.bound is None
            or found.root.bound.value <= self.root.bound.value
        ):
            return replace(self, rounds=tuple(found.rounds), separating=found.separating)
        return replace(
            self,
            formulation=found.formulation,
            root=found.root,
            cuts=tuple(found.cuts),
            rounds=tuple(found.rounds),
            separating=found.separating,
        )

    def residual(self, target: Fraction, *, limit: int = MAX_COLUMNS) -> tuple[Formulation, Objective]:
        """Write down the program on the simplices that a triangulation within the target may use.

        Raises
        ------
        TooLargeError
            If there are more than `limit` of them.
        """
        assert self.root.bound is not None
        count = self.columns_within(target)
        if count > limit:
            raise TooLargeError(
                f"{self.configuration.name}: {count:,} simplices may be in a triangulation of value "
                f"{self.objective.sign * target}; at most {limit:,} are written down"
            )
        simplices, orbit_of = self.formulation.expanded(self.root.bound.orbits_within(target))
        formulation = partial_cocircuit_formulation(
            self.configuration,
            simplices,
            self.formulation.orbits.hull_facets,
            spanning=self.formulation.spanning,
        )
        return formulation, self.objective.restricted_to(orbit_of)

    def pulled(self) -> NDArray[np.int64] | None:
        """Return a triangulation that takes no search; None where it misses points that it must use."""
        simplices = pulling_triangulation(self.formulation.orbits.hull_facets, self.configuration.n)
        if self.formulation.spanning and len(np.unique(simplices)) < self.configuration.n:
            return None
        return simplices


def orbit_stage(
    configuration: PointConfiguration,
    objective: str = "cardinality",
    *,
    sense: str = "min",
    spanning: bool = False,
    group: PermutationGroup | None = None,
    seconds: float | None = None,
) -> OrbitStage:
    """Bound the optimum by the averaged relaxation.

    Parameters
    ----------
    configuration : PointConfiguration
    objective : str
        A measure that all symmetries in the group leave invariant, such as "cardinality".
    sense : {"min", "max"}
    spanning : bool
        Only triangulations that use every point.
    group : PermutationGroup, optional
        Of symmetries of the configuration and of the objective; all symmetries of the configuration if left out.
    seconds : float, optional
        Time limit of the linear program.
    """
    group = (symmetry_group(configuration) if group is None else group).reduced(MAX_ORDER)
    formulation = orbit_formulation(simplex_orbits(configuration, group), spanning=spanning)
    measured = make_objective(objective, formulation, sense=sense)
    root = orbit_root(formulation, measured, method="interior", seconds=seconds)
    return OrbitStage(configuration, group, formulation, measured, root)
