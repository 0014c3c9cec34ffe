"""The relaxation on some simplices, averaged over a group that takes them to each other.

Where triangulations with some faces and without others are looked for, few symmetries are left, and few simplices:
so these are listed, unlike in `bcut.formulations.orbit_cocircuits`, and their orbits are put together from the list.
With X_o the sum of x over orbit o, the program is the one described there, but for the coverage row. It says of a
generic point and of all its images under the group that they are covered once,

    sum over o of  X_o * (images of the point in a simplex of o)  =  order of the group.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import gcd
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.orbit_root import OrbitRoot, orbit_root
from bcut.formulations.formulation import Formulation
from bcut.formulations.invariant import set_orbits
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.permutations import PermutationGroup
from bcut.objectives.objective import Objective

if TYPE_CHECKING:
    import scipy.sparse as sp


@dataclass(frozen=True, eq=False)
class AveragedProgram:
    """``matrix @ X = 0``, ``volumes @ X = volume``, ``cuts @ X <= 0``, 0 <= X <= sizes, for `orbit_root`.

    Attributes
    ----------
    simplices : ndarray of int64, shape (m, d + 1)
        One of each orbit.
    sizes : ndarray of int64, shape (m,)
    matrix : scipy.sparse.csr_matrix of int64, shape (rows, m)
        Sums of the cocircuit rows in an orbit of rows.
    row_faces : ndarray of int64, shape (rows, d)
        One of each orbit of (d-1)-simplices.
    volumes : ndarray of int64, shape (m,)
        The coverage row, in the place of a volume row.
    volume : int
    cuts : scipy.sparse.csr_matrix of int64, shape (cuts, m), or None
    """

    simplices: NDArray[np.int64]
    sizes: NDArray[np.int64]
    matrix: sp.csr_matrix
    row_faces: NDArray[np.int64]
    volumes: NDArray[Any]
    volume: int
    cuts: sp.csr_matrix | None = None

    def with_way_out(self) -> AveragedProgram:
        """Return the program with one more variable, behind the others, that can cover everything alone."""
        import scipy.sparse as sp

        def widened(matrix: sp.csr_matrix) -> sp.csr_matrix:
            return sp.hstack((matrix, sp.csr_matrix((matrix.shape[0], 1), dtype=matrix.dtype)), format="csr")

        return replace(
            self,
            simplices=np.concatenate(
                (self.simplices, np.zeros((1, self.simplices.shape[1]), dtype=np.int64))
            ),
            sizes=np.append(self.sizes, 1),
            matrix=widened(self.matrix),
            volumes=np.append(self.volumes, self.volume),
            cuts=None if self.cuts is None else widened(self.cuts),
        )


@dataclass(frozen=True, eq=False)
class AveragedCut:
    """A link cut, and the mean of its images under a group.

    Attributes
    ----------
    face : tuple of int
        The (d-2)-face.
    simplices : ndarray of int64, shape (k, d + 1)
        The cut itself: ``coefficients @ x[simplices] <= 0``.
    coefficients : ndarray of int64, shape (k,)
    columns : ndarray of int64
        The columns, of the whole formulation, that the mean is about.
    values : ndarray of int64
        Coprime; the mean itself is this times `factor`.
    factor : Fraction
    level : int
        Which of the groups on the way to a part it is averaged over; see `AveragedPart`.
    """

    face: tuple[int, ...]
    simplices: NDArray[np.int64]
    coefficients: NDArray[np.int64]
    columns: NDArray[np.int64]
    values: NDArray[np.int64]
    factor: Fraction
    level: int


@dataclass(frozen=True, eq=False)
class AveragedPart:
    """Some simplices of a formulation, closed under a group of symmetries.

    Attributes
    ----------
    whole : Formulation
        Formulation 2, on simplices that are closed under all groups in question, with a chirotope that has all signs.
    objective : Objective
        Of all of these; invariant under the groups.
    flag : ndarray of int64, shape (d + 1,)
        Of the generic point.
    group : PermutationGroup
    columns : ndarray of int64
        Ascending; the others are not used.
    level : int
        How many groups came before this one: each is contained in the one before.
    """

    whole: Formulation
    objective: Objective
    flag: NDArray[np.int64]
    group: PermutationGroup
    columns: NDArray[np.int64]
    level: int = 0

    @property
    def simplices(self) -> NDArray[np.int64]:
        """The simplices, ascending vertices."""
        return self.whole.simplices[self.columns]

    @cached_property
    def orbit_of(self) -> NDArray[np.int64]:
        """The orbit of each column, shape (len(columns),)."""
        if not len(self.columns):
            return self.columns
        return set_orbits(self.simplices, self.group, self.whole.configuration.n)

    @cached_property
    def sizes(self) -> NDArray[np.int64]:
        """Lengths of the orbits."""
        return np.bincount(self.orbit_of).astype(np.int64)

    @cached_property
    def representatives(self) -> NDArray[np.int64]:
        """A column of the whole for each orbit."""
        return self.columns[np.unique(self.orbit_of, return_index=True)[1]]

    @cached_property
    def orbit_objective(self) -> Objective:
        """The costs of the representatives."""
        return self.objective.restricted_to(self.representatives)

    def restricted_to(self, kept: NDArray[np.bool_]) -> AveragedPart:
        """Return the part with some of its columns; they must be whole orbits."""
        return replace(self, columns=self.columns[kept])

    def spread(self, point: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return x on the columns, from the sums over orbits."""
        return np.maximum(point / self.sizes, 0.0)[self.orbit_of]

    @cached_property
    def bare(self) -> AveragedProgram:
        """The averaged program, without cuts."""
        import scipy.sparse as sp

        d = self.whole.chirotope.dimension
        count = len(self.sizes)
        gather = sp.csr_matrix(
            (np.ones(len(self.columns), dtype=np.int64), (np.arange(len(self.columns)), self.orbit_of)),
            shape=(len(self.columns), count),
        )
        # The row of the generic point is made anew: its images must be known.
        rows = np.flatnonzero(np.array([face is not None for face in self.whole.row_faces]))
        faces = np.array([self.whole.row_faces[row] for row in rows], dtype=np.int64).reshape(-1, d)
        orbit_of_row = set_orbits(faces, self.group, self.whole.configuration.n)
        chosen = np.unique(orbit_of_row, return_index=True)[1]
        matrix = (self.whole.matrix[rows[chosen]][:, self.columns].astype(np.int64) @ gather).tocsr()
        matrix.data *= np.repeat(np.bincount(orbit_of_row), np.diff(matrix.indptr))
        matrix.data //= self.sizes[matrix.indices]
        matrix.eliminate_zeros()
        kept = np.flatnonzero(np.diff(matrix.indptr))
        covering = simplices_containing_generic_point(self.whole.chirotope, self.simplices, self.flag)
        covered = np.bincount(self.orbit_of[covering], minlength=count).astype(np.int64)
        return AveragedProgram(
            simplices=self.whole.simplices[self.representatives],
            sizes=self.sizes,
            matrix=matrix[kept],
            row_faces=faces[chosen[kept]],
            volumes=covered * (self.group.order // self.sizes),
            volume=self.group.order,
        )

    def about(self, cuts: Sequence[AveragedCut]) -> list[AveragedCut]:
        """Return those of some cuts that say anything of the columns."""
        present = np.zeros(len(self.whole.simplices), dtype=bool)
        present[self.columns] = True
        return [cut for cut in cuts if present[cut.columns].any()]

    def program(self, cuts: Sequence[AveragedCut]) -> AveragedProgram:
        """Return the averaged program with some cuts, each of which says something of the columns."""
        if not cuts:
            return self.bare
        import scipy.sparse as sp

        place = np.full(len(self.whole.simplices), -1, dtype=np.int64)
        place[self.representatives] = np.arange(len(self.representatives))
        rows, columns, values = [], [], []
        for number, cut in enumerate(cuts):
            orbits = place[cut.columns]
            present = orbits >= 0
            columns.append(orbits[present])
            values.append(cut.values[present])
            rows.append(np.full(int(present.sum()), number, dtype=np.int64))
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return replace(self.bare, cuts=sp.csr_matrix(entries, shape=(len(cuts), len(self.sizes))))

    def relaxed(
        self,
        cuts: Sequence[AveragedCut],
        method: Literal["simplex", "interior"],
        *,
        seconds: float | None = None,
    ) -> OrbitRoot:
        """Solve the averaged relaxation with some cuts, each of which says something of the columns."""
        program = self.program(cuts)
        if not program.volumes.any():
            return OrbitRoot("infeasible")  # nothing covers the generic point
        return orbit_root(program, self.orbit_objective, method=method, seconds=seconds)

    def averaged(
        self, face: NDArray[np.int64], local: NDArray[np.int64], coefficients: NDArray[np.int64]
    ) -> AveragedCut:
        """Return the mean of the images of a link cut, which speaks of some of the columns (by their places)."""
        # An orbit has no more simplices in the cut than in all: no sum exceeds the group's order times the largest
        # coefficient, and a link cut's stay far below 2**32.
        sums = np.zeros(len(self.sizes), dtype=np.int64)
        np.add.at(sums, self.orbit_of[local], coefficients)
        sums *= self.group.order // self.sizes
        divisor = max(1, gcd(*sums.tolist()))
        row = (sums // divisor)[self.orbit_of]
        about = np.flatnonzero(row)
        return AveragedCut(
            face=tuple(face.tolist()),
            simplices=self.simplices[local],
            coefficients=coefficients,
            columns=self.columns[about],
            values=row[about],
            factor=Fraction(divisor, self.group.order),
            level=self.level,
        )
