"""The result of a run: one object, one JSON file, the same names in both."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from bcut.files.atomic import write_text

SCHEMA = 1

Status = Literal["optimal", "infeasible", "limit", "interrupted", "bound"]


@dataclass
class Instance:
    """The point configuration, exact, so that a result can be run and verified again."""

    name: str
    dimension: int
    points: list[list[str]]
    digest: str


@dataclass
class Question:
    """What was asked: the entry ``problem`` of a result file."""

    objective: str
    sense: str
    spanning: bool
    formulation: str
    separators: list[str]
    seed: int
    limits: dict[str, Any]
    method: str
    costs: dict[str, Any] | None = None


@dataclass
class RoundRecord:
    """One root relaxation: its unrounded value, and the cuts then added, by family."""

    lp: float
    cuts: dict[str, int]
    stage: str


@dataclass
class Root:
    """The root bound: LP values, unrounded, before and after cuts, and whether the last LP point was integral."""

    lp: float | None = None
    lp_after_cuts: float | None = None
    integral: bool | None = None
    rounds: list[RoundRecord] = field(default_factory=list)


@dataclass
class Size:
    """Columns and rows of the formulation; columns that survived reduced-cost fixing."""

    columns: int = 0
    rows: int = 0
    columns_after_fixing: int | None = None


@dataclass
class Certificate:
    """Exact dual multipliers and the bound that they prove, or the reason why there are none.

    Attributes
    ----------
    bound : str or None
        Rational; no triangulation is better.
    flag : list of int or None
        Ordered vertices that define the generic point of the coverage row.
    multipliers : list of [row, rational] or None
        Row is "coverage", "volume" or the vertices of an interior (d-1)-simplex. For minimising ``sign * costs``.
    cuts : list of dict
        Family, simplices, coefficients, rhs, multiplier and proof of each cut that takes part.
    symmetries : list of list of int, or None
        Permutations of the points, as the images of 0, 1, ... Then a row stands for all its images, which have the same
        multiplier, and a cut for the mean of its images.
    volume_coefficient : int or None
        Which coefficient of the volumes, on the basis of their number field, the volume row takes.
    reason : str or None
    """

    bound: str | None = None
    flag: list[int] | None = None
    multipliers: list[list[Any]] | None = None
    cuts: list[Any] = field(default_factory=list)
    symmetries: list[list[int]] | None = None
    volume_coefficient: int | None = None
    reason: str | None = None


@dataclass
class Result:
    """Everything about a run.

    Attributes
    ----------
    status : {"optimal", "infeasible", "limit", "interrupted", "bound"}
        "bound" only from `bcut.bound`, which looks for no triangulation.
    value : int, float or None
        Of the best triangulation found.
    bound : int, float or None
        No triangulation is better.
    gap : float or None
        ``|value - bound| / max(1, |value|)``.
    separators : dict
        Per family: calls, found, added, seconds.
    seconds : dict
        Total and per stage.
    triangulation : list of list of int, or None
        Ascending vertex indices.
    """

    instance: Instance
    problem: Question
    status: Status
    value: int | float | None = None
    bound: int | float | None = None
    gap: float | None = None
    root: Root = field(default_factory=Root)
    size: Size = field(default_factory=Size)
    nodes: int = 0
    separators: dict[str, dict[str, Any]] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    triangulation: list[list[int]] | None = None
    certificate: Certificate = field(default_factory=Certificate)
    versions: dict[str, str] = field(default_factory=dict)
    schema: int = SCHEMA

    @property
    def optimal(self) -> bool:
        """Whether optimality was proven."""
        return self.status == "optimal"

    def to_dict(self) -> dict[str, Any]:
        """Return the result file as plain data, in the documented order."""
        data = asdict(self)
        return {"schema": data.pop("schema"), **data}

    def to_json(self) -> str:
        """Return the result file as text."""
        return json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n"

    def save(self, path: str | Path) -> None:
        """Write the result file, whole or not at all."""
        write_text(Path(path), self.to_json())
