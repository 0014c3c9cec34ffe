"""`region`: triangulate what a closed surface bounds, or prove that it cannot be done and cover as much as possible."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from fractions import Fraction
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import bcut
from bcut.bounds.proof_tree import ExactProgram, Leaf, OutOfTimeError, ProofTree, least
from bcut.errors import InputError, SolverError, VerificationError
from bcut.families import is_family
from bcut.families.parameters import Parameters
from bcut.families.registry import FAMILIES
from bcut.families.surfaces import SURFACES
from bcut.files.atomic import write_text
from bcut.files.surfaces import read_surface
from bcut.formulations.region import RegionProgram, covering_program, packing_program, tetrahedra_crossing
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.surface import Region
from bcut.records import load_record
from bcut.solving.arguments import read_argument
from bcut.summary import table

SCHEMA = 1


@dataclass
class RegionResult:
    """What is known of a region; numbers that need not be integers are exact texts.

    Attributes
    ----------
    instance : dict
        Name, points (exact, as texts), faces and the digest of the points.
    status : {"optimal", "infeasible", "limit", "interrupted"}
        "optimal": the region has a triangulation, and `triangulation` has the fewest tetrahedra; "infeasible": there
        is no triangulation without new points, and `triangulation` covers the largest volume.
    volume, covered : str
        Of the region; of the tetrahedra in `triangulation`.
    value, bound : int or None
        Number of tetrahedra of the triangulation of the whole region, and what is proven about it.
    triangulation : list of list of int, or None
    tetrahedra : int
        How many lie inside and fit to the surface.
    certificate : dict
        Trees whose leaves carry multipliers: ``infeasible`` proves that there is no triangulation, ``covered`` that no
        more can be covered, ``cardinality`` that no triangulation has fewer tetrahedra; None for what is not claimed.
    """

    instance: dict[str, Any]
    status: Literal["optimal", "infeasible", "limit", "interrupted"]
    volume: str
    covered: str | None = None
    value: int | None = None
    bound: int | None = None
    triangulation: list[list[int]] | None = None
    tetrahedra: int = 0
    nodes: int = 0
    seconds: float = 0.0
    certificate: dict[str, Any] = field(
        default_factory=lambda: {"infeasible": None, "covered": None, "cardinality": None}
    )
    versions: dict[str, str] = field(default_factory=dict)
    kind: str = "region"
    schema: int = SCHEMA

    def __repr__(self) -> str:
        covered = self.covered or "nothing so far"
        text = f"{self.instance['name']}: volume {self.volume}, covered {covered}, {self.status}"
        return f"<RegionResult {text}>"

    def __str__(self) -> str:
        texts = {
            "optimal": f"triangulable, with {self.value} tetrahedra and no fewer (proven)",
            "infeasible": "not triangulable without new points (proven)",
        }
        rows = [
            ("region", str(self.instance["name"])),
            ("status", texts.get(self.status, self.status)),
            ("volume", self.volume),
            ("covered", self.covered or "nothing so far"),
            ("tetrahedra", f"{len(self.triangulation or ())} of {self.tetrahedra} inside"),
            ("seconds", f"{self.seconds:.2f}"),
        ]
        return table(rows, indent="").rstrip("\n")

    @classmethod
    def load(cls, source: str | os.PathLike[str] | Mapping[str, Any]) -> RegionResult:
        """Make a result of a result file, or of its data, as `to_dict` returns them; see `bcut.Result.load`.

        Raises
        ------
        ResultError
            It cannot be read, belongs to another schema, lacks an entry, has one of the wrong type or an unknown one.
        """
        return load_record(cls, source, schema=SCHEMA, about="region")

    def to_dict(self) -> dict[str, Any]:
        """Return the result file as plain data."""
        data = asdict(self)
        return {"schema": data.pop("schema"), "kind": data.pop("kind"), **data}

    def to_json(self) -> str:
        """Return the result file as text, with a line for each entry."""
        lines = [f" {json.dumps(key)}: {json.dumps(value)}" for key, value in self.to_dict().items()]
        return "{\n" + ",\n".join(lines) + "\n}\n"

    def save(self, path: str | Path) -> None:
        """Write the result file, whole or not at all."""
        write_text(Path(path), self.to_json())


def load_surface(
    text: str | os.PathLike[str],
) -> tuple[PointConfiguration, Sequence[Sequence[int]]]:
    """Load points and faces from a file, or build a member of a family of surfaces.

    Parameters
    ----------
    text : str or path
        An OFF, PLY or JSON file with faces, or for instance "schoenhardt" or "twisted-prism:5,twist=20".

    Raises
    ------
    InputError
        There is nothing of that name, or it has no faces.
    """
    name = os.fspath(text).strip()
    head, _, tail = name.partition(":")
    head = head.strip()
    if isinstance(text, os.PathLike) or (not is_family(name) and (os.path.exists(name) or "." in name)):
        return read_surface(text)
    if head not in SURFACES:
        what = "is a configuration of points, without a surface" if is_family(name) else "is unknown"
        raise InputError(
            f"'{name[:80]}' {what}; give a file with faces (.off, .ply, .json) or one of {', '.join(SURFACES)}"
        )
    parameters = Parameters(head, FAMILIES[head].form, FAMILIES[head].example, tail)
    points, faces = SURFACES[head](parameters)
    return PointConfiguration.from_values(points, name=parameters.name), faces


def region(
    instance: str | os.PathLike[str] | tuple[Any, Sequence[Sequence[int]]],
    *,
    time_limit: float | None = None,
) -> RegionResult:
    """Triangulate the region that a closed surface bounds, without new points, or prove that there is no way.

    Parameters
    ----------
    instance : str, path or (points, triangles)
        A file with faces, a member of a family of surfaces, or points (a `PointConfiguration` or what
        `PointConfiguration.from_values` takes) with triangles, counterclockwise as seen from outside.
    time_limit : float, optional
        Seconds.

    Returns
    -------
    RegionResult
        Where the region has no triangulation, its `triangulation` is one of the largest volume that can be covered by
        tetrahedra which meet each other and the surface in common faces.

    Raises
    ------
    InputError
        The instance cannot be read, or its triangles bound no region.
    SolverError
        What was found did not survive exact verification.

    Examples
    --------
    >>> import bcut
    >>> bcut.region("schoenhardt").status
    'infeasible'
    """
    time_limit = read_argument("time_limit", time_limit)
    if time_limit is not None and not time_limit > 0:
        raise InputError(f"a time limit of {time_limit} seconds is no positive number; leave it out for none")
    if isinstance(instance, str | os.PathLike):
        points, faces = load_surface(instance)
    elif isinstance(instance, tuple) and len(instance) == 2:
        points, faces = instance
        if not isinstance(points, PointConfiguration):
            points = PointConfiguration.from_values(points)
    else:
        raise InputError(
            "a region is a file with faces, a family of surfaces such as 'schoenhardt', or a pair (points, triangles), "
            f"not {type(instance).__name__}"
        )
    return _Work(Region.of(points, faces), time_limit).run()


class _Work:
    """One run: what was found and proven so far."""

    def __init__(self, region: Region, time_limit: float | None) -> None:
        self.region, self.started = region, time.perf_counter()
        self.deadline = None if time_limit is None else time.monotonic() + time_limit
        self.unit = Fraction(1, 6 * region.configuration.denominator**3)
        self.columns: list[int] | None = None
        self.programs: list[ExactProgram] = []
        configuration = region.configuration
        self.result = RegionResult(
            instance={
                "name": configuration.name,
                "points": [list(point) for point in configuration.exact_points()],
                "faces": [list(triangle) for triangle in region.triangles],
                "digest": configuration.digest,
            },
            status="limit",
            volume=str(region.volume * self.unit),
        )

    def run(self) -> RegionResult:
        """Settle both questions, or stop when the time is up."""
        result = self.result
        try:
            self._settle()
        except OutOfTimeError:
            pass
        except KeyboardInterrupt:
            result.status = "interrupted"
        tetrahedra = self.region.tetrahedra
        result.tetrahedra = len(tetrahedra)
        if self.columns is not None:
            result.triangulation = tetrahedra[np.sort(np.array(self.columns, dtype=np.int64))].tolist()
            covered = sum(self.region.volumes[column] for column in self.columns)
            result.covered = str(covered * self.unit)
            result.value = len(self.columns) if covered == self.region.volume else None
        result.nodes = sum(program.nodes for program in self.programs)
        result.versions = {
            "bcut": bcut.__version__,
            "highs": version("highspy"),
            "python": platform.python_version(),
        }
        self._verify()
        result.seconds = time.perf_counter() - self.started
        return result

    def _settle(self) -> None:
        region, result = self.region, self.result
        crossing = tetrahedra_crossing(region)
        covering = covering_program(region)
        self.columns = self._greedy(crossing)
        is_whole = sum(region.volumes[column] for column in self.columns) == region.volume
        best, tree = self._least(covering, crossing, [1] * len(crossing), self.columns if is_whole else None)
        if best is not None:
            result.status, result.bound = "optimal", len(best)
            result.certificate["cardinality"] = self._written(tree, covering)
            return
        result.certificate["infeasible"] = self._written(tree, covering)
        packing = packing_program(region, crossing)
        best, tree = self._least(packing, crossing, [-volume for volume in region.volumes], self.columns)
        result.certificate["covered"] = self._written(tree, packing)
        result.status = "infeasible"

    def _least(
        self,
        rows: RegionProgram,
        crossing: NDArray[np.bool_],
        costs: list[int],
        best: list[int] | None = None,
    ) -> tuple[list[int] | None, ProofTree]:
        program = ExactProgram(rows.matrix, rows.right, rows.equations, crossing, costs)
        self.programs.append(program)
        return least(program, best=best, offer=self._offer, deadline=self.deadline)

    def _offer(self, columns: list[int]) -> None:
        self.columns = columns

    def _greedy(self, crossing: NDArray[np.bool_]) -> list[int]:
        """Take the largest tetrahedron that crosses none taken so far, as long as there is one."""
        chosen: list[int] = []
        for column in sorted(range(len(crossing)), key=lambda column: -self.region.volumes[column]):
            if not crossing[column, chosen].any():
                chosen.append(column)
        return sorted(chosen)

    def _written(self, tree: ProofTree, rows: RegionProgram) -> dict[str, Any]:
        """Return a proof as plain data, in terms of points."""
        tetrahedra = self.region.tetrahedra
        if isinstance(tree, Leaf):
            return {
                "multipliers": [
                    [
                        list(rows.names[row])
                        if rows.equations
                        else tetrahedra[list(rows.names[row])].tolist(),
                        str(value),
                    ]
                    for row, value in tree.multipliers
                ]
            }
        return {
            "branch": tetrahedra[tree.column].tolist(),
            "with": self._written(tree.chosen, rows),
            "without": self._written(tree.excluded, rows),
        }

    def _verify(self) -> None:
        from bcut.verification.region import verify_region

        try:
            verify_region(self.result.to_dict(), "the result")
        except VerificationError as error:
            raise SolverError(
                f"{self.region.configuration.name}: what was found did not survive exact verification: {error}"
            ) from error
