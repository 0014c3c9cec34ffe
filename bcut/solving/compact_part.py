"""Problems whose simplices are flat arrays: how one begins, and its first triangulations."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from math import inf
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.compact import CompactProgram, compact_program
from bcut.formulations.formulation import Formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.delaunay import first_triangulation
from bcut.geometry.flips import anneal_by_flips, improve_by_flips
from bcut.geometry.partial_chirotope import PartialChirotope
from bcut.objectives.objective import Bottleneck, Candidates, Objective, objective_of
from bcut.objectives.syntax import ObjectiveName
from bcut.solving.memory import used_memory
from bcut.solving.search import Part, Search

# Seconds of local search, at most, and its share of what is left.
_SECONDS_OF_FLIPS, _SHARE_OF_FLIPS = 20.0, 0.2
_COLUMNS_PER_SECOND = 5000
# Descents with disturbed costs: 400 take one to three seconds for 30 to 40 points in space. They lead from 20 %
# above the optimal weight or 50 % above the least cardinality to 2 % above.
_STEPS, _SLOWER = 400, 4
# With fewer columns than this, relaxations with cuts find the optimum faster than slow cooling does.
_RELAXED_QUICKLY = 15_000
_NOISE = 1 << 16


@dataclass(frozen=True, eq=False)
class CompactPart(Part):
    """All columns, as flat arrays; its formulation has the simplices, but not the rows.

    Attributes
    ----------
    program : CompactProgram
    """

    program: CompactProgram

    @classmethod
    def of(cls, program: CompactProgram, objective: Objective) -> CompactPart:
        """Return the part that is everything."""
        formulation = _without_rows(
            program.configuration, program.chirotope, program.simplices, program.spanning
        )
        return cls(formulation, objective, np.arange(len(program.simplices)), program)

    def restricted_to(self, columns: NDArray[np.intp]) -> Part:
        """Return an ordinary part on some columns, ascending."""
        return Part(self.program.formulation(columns), self.objective.restricted_to(columns), columns)


def _without_rows(
    configuration: PointConfiguration,
    chirotope: Chirotope,
    simplices: NDArray[np.integer[Any]],
    spanning: bool,
) -> Formulation:
    import scipy.sparse as sp

    none = np.empty(0, dtype=np.int64)
    return Formulation(
        name="2",
        configuration=configuration,
        chirotope=chirotope,
        # Of few bits, which whoever reads them may widen.
        simplices=cast("NDArray[np.int64]", simplices),
        spanning=spanning,
        matrix=sp.csr_matrix((0, len(simplices)), dtype=np.int8),
        lower=none,
        upper=none,
        row_faces=(),
    )


def without_columns(configuration: PointConfiguration, name: ObjectiveName, *, spanning: bool) -> Part:
    """Return a part without any column: what a search knows before simplices are listed."""
    none = np.empty((0, configuration.dimension + 1), dtype=np.int64)
    formulation = _without_rows(configuration, PartialChirotope(configuration, ()), none, spanning)
    kind = Bottleneck if name.is_bottleneck else Objective
    return Part.whole(formulation, kind(name.text, name.sense, np.empty(0, dtype=np.int64)))


def begin_fixing(configuration: PointConfiguration, name: ObjectiveName, *, spanning: bool) -> Part:
    """Return a triangulation that takes no search, as a part whose only columns are its simplices.

    It is what a search knows until its program is made.
    """
    chirotope = PartialChirotope(configuration, ())
    simplices = first_triangulation(configuration, chirotope)
    formulation = _without_rows(configuration, chirotope, simplices, spanning)
    return Part.whole(formulation, objective_of(name, formulation))


def make_program(search: Search, name: ObjectiveName, *, only_link: bool) -> tuple[int, int]:
    """List all simplices and evaluate their costs; the search goes on with them.

    Parameters
    ----------
    search : Search
        Its whole is what `begin_fixing` returned.
    name : ObjectiveName
    only_link : bool
        Whether no cut family is at work that asks for more than orientations.

    Returns
    -------
    (int, int)
        Numbers of columns and rows.
    """
    known = search.whole.formulation
    search.offer(search.whole.columns)
    search.report("listing", memory=used_memory())
    with search.timed("model"):
        program = compact_program(known.configuration, spanning=known.spanning)
        if not only_link and isinstance(program.chirotope, PartialChirotope):
            program = replace(program, chirotope=Chirotope.of(known.configuration))
        part = CompactPart.of(program, objective_of(name, cast(Candidates, program)))
        columns = program.columns_of(known.simplices)
        search.whole, search.columns = part, columns
    return program.size


def improve_incumbent(search: Search) -> None:
    """Find a triangulation and improve it by flips; one that is not made of the columns at hand is not kept."""
    whole = search.whole
    assert isinstance(whole, CompactPart)
    program, objective = whole.program, whole.objective

    def costs_of(simplices: NDArray[np.integer[Any]]) -> NDArray[np.float64]:
        columns = program.columns_of(simplices)
        return np.where(columns >= 0, objective.sign * objective.costs[columns], inf)

    with search.timed("incumbent"):
        budget = Budget(search, _SECONDS_OF_FLIPS)
        if search.columns is None:
            simplices = first_triangulation(program.configuration, program.chirotope)
            _offer(search, program.columns_of(simplices))
        else:
            simplices = program.simplices[search.columns].astype(np.int64)
        improved = improve_by_flips(
            simplices,
            program.chirotope,
            costs_of,
            spanning=program.spanning,
            is_over=budget.is_over,
        )
        _offer(search, program.columns_of(improved))


def anneal_incumbent(search: Search, reduced_costs: NDArray[np.floating[Any]]) -> None:
    """Improve the triangulation by flips that reduced costs guide.

    Their sum tells no more than that of the costs. But the sum of their roots makes few large ones better than many
    small ones, and simplices that an optimum may have are worth almost nothing.

    Parameters
    ----------
    search : Search
    reduced_costs : ndarray of float, shape (m,)
    """
    whole = search.whole
    assert isinstance(whole, CompactPart)
    assert search.columns is not None
    program, objective = whole.program, whole.objective
    costs = objective.sign * objective.costs
    scale = float(np.median(np.abs(costs))) or 1.0
    noise = scale * np.random.default_rng(search.seed).standard_normal(_NOISE)

    def looked_up(table: NDArray[np.float64], simplices: NDArray[np.integer[Any]]) -> NDArray[np.float64]:
        columns = program.columns_of(simplices)
        return np.where(columns >= 0, table[columns], inf)

    def noise_of(simplices: NDArray[np.integer[Any]], step: int) -> NDArray[np.float64]:
        # Fibonacci hashing scatters the columns over the table, in each step otherwise.
        places = (program.columns_of(simplices) + step * 7919) * 2654435769 >> 8
        return noise[places % _NOISE]

    guide = np.sqrt(np.maximum(reduced_costs, 0.0) * scale)
    # In proportion to what the relaxations of so many columns are going to take.
    budget = Budget(search, min(_SECONDS_OF_FLIPS, len(costs) / _COLUMNS_PER_SECOND))
    enough = -inf if search.bound is None else float(search.bound)
    steps = _STEPS
    with search.timed("incumbent"):
        while float(search.sign * search.whole.objective.value(search.columns)) > enough:
            before = budget.left
            found = anneal_by_flips(
                program.simplices[search.columns].astype(np.int64),
                program.chirotope,
                lambda simplices: looked_up(costs, simplices),
                lambda simplices: looked_up(guide, simplices),
                noise_of,
                spanning=program.spanning,
                steps=steps,
                enough=enough,
                is_over=budget.is_over,
            )
            _offer(search, program.columns_of(found))
            search.report("incumbent", memory=used_memory())
            # Slower cooling ends lower, but a cooling that is cut off ends nowhere.
            fitting = budget.left / max(1e-3, before - budget.left) * steps
            steps = int(min(_SLOWER * steps, fitting))
            if steps < _STEPS or len(program.simplices) < _RELAXED_QUICKLY:
                break


class Budget:
    """Seconds for local search: of processor time, so that a busy machine gets triangulations as good as an idle one.

    Parameters
    ----------
    search : Search
        Its deadline holds as well, of which local search gets a share.
    seconds : float
    """

    def __init__(self, search: Search, seconds: float) -> None:
        self._end = time.process_time() + seconds
        left = search.seconds_left
        self._deadline = inf if left is None else time.monotonic() + _SHARE_OF_FLIPS * left

    @property
    def left(self) -> float:
        """Seconds that are left."""
        return min(self._end - time.process_time(), self._deadline - time.monotonic())

    def is_over(self) -> bool:
        """Tell whether none are left."""
        return self.left <= 0


def _offer(search: Search, columns: NDArray[np.int64]) -> None:
    if (columns >= 0).all():
        search.offer(np.sort(columns))
