"""The result of a run: one object, one JSON file, the same names in both."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from bcut.files.atomic import write_text
from bcut.records import Record, load_record

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

SCHEMA = 1

Status = Literal["optimal", "infeasible", "limit", "interrupted", "bound"]


@dataclass(repr=False)
class Instance(Record):
    """The point configuration, exact, so that a result can be run and verified again."""

    name: str
    dimension: int
    points: list[list[str]]
    digest: str


@dataclass(repr=False)
class LevelQuestion(Record):
    """A further objective of a lexicographic combination; attributes as in `Question`."""

    objective: str
    sense: str
    costs: dict[str, Any] | None = None


@dataclass(repr=False)
class Question(Record):
    """What was asked: the entry ``problem`` of a result file.

    Where `invariant_under` is not None, only triangulations count that one of these groups, each given by generators,
    leaves invariant. `require` and `forbid` are faces as vertex lists, `star` is a point that all simplices must have.
    """

    objective: str
    sense: str
    spanning: bool
    formulation: str
    separators: list[str]
    seed: int
    limits: dict[str, Any]
    method: str
    costs: dict[str, Any] | None = None
    then: list[LevelQuestion] = field(default_factory=list)
    invariant_under: list[list[list[int]]] | None = None
    dissection: bool = False
    require: list[list[int]] = field(default_factory=list)
    forbid: list[list[int]] = field(default_factory=list)
    star: int | None = None


@dataclass(repr=False)
class RoundRecord(Record):
    """One root relaxation: its unrounded value, and the cuts then added, by family."""

    lp: float
    cuts: dict[str, int]
    stage: str


@dataclass(repr=False)
class Root(Record):
    """The root bound: LP values, unrounded, before and after cuts, and whether the last LP point was integral."""

    lp: float | None = None
    lp_after_cuts: float | None = None
    integral: bool | None = None
    rounds: list[RoundRecord] = field(default_factory=list)


@dataclass(repr=False)
class Size(Record):
    """Columns and rows of the formulation; columns that survived reduced-cost fixing."""

    columns: int = 0
    rows: int = 0
    columns_after_fixing: int | None = None


@dataclass(repr=False)
class Certificate(Record):
    """Exact dual multipliers and the bound that they prove, or the reason why there are none.

    Attributes
    ----------
    bound : str or None
        Rational; no triangulation is better.
    flag : list of int or None
        Ordered vertices that define the generic point of the coverage row.
    multipliers : list of [row, rational] or None
        Row is "coverage", "volume", ``{"flag": vertices}`` for the coverage of another generic point, or the vertices
        of an interior (d-1)-simplex. For minimising ``sign * costs``.
    cuts : list of dict
        Family, simplices, coefficients, rhs, multiplier and proof of each cut that takes part.
    symmetries : list of list of int, or None
        Permutations of the points, as the images of 0, 1, ... Then a row stands for all its images, which have the same
        multiplier, and a cut for the mean of its images.
    volume_coefficient : int or None
        Which coefficient of the volumes, on the basis of their number field, the volume row takes.
    infeasible : bool
        Whether the multipliers prove that there is no triangulation: a positive bound where all costs are 0.
    threshold : str or None
        Of a bottleneck: rational; no triangulation is better. The multipliers then prove it by a positive bound on the
        number of simplices that are no better than the threshold.
    earlier : list of str
        Of a further objective of a lexicographic combination: the multiplier of each earlier objective's value.
    refutes : dict or None
        ``{"target": rational, "stages": [{"multipliers": ..., "cuts": ...}, ...]}``: no triangulation reaches the
        target. Each stage speaks of the simplices whose reduced costs in the one before (first: in this certificate) a
        triangulation within the target may have; the last one's bound is beyond the target.
        With symmetries, ``{"target": rational, "case": {"stages": ..., "face": vertices, "chosen": case, "excluded":
        case}}``: the triangulations that have the face, and those that have none of its images. The stages' multipliers
        belong to all images of a row, or to the mean of the images of a cut and of the coverage row, under the
        symmetries that are left: those that take all faces chosen so far to themselves. For a cut, "group" counts the
        faces that matter.
    reason : str or None
        Why there are no multipliers.
    settles : {"exactly", "within 1e-9"} or None
        Whether all this proves the status, as far as the run knows; `bcut verify` finds out. The second, where values
        are no integers, means a relative gap; None that the status rests on more than the certificate.
    """

    bound: str | None = None
    flag: list[int] | None = None
    multipliers: list[list[Any]] | None = None
    cuts: list[Any] = field(default_factory=list)
    symmetries: list[list[int]] | None = None
    volume_coefficient: int | None = None
    infeasible: bool = False
    threshold: str | None = None
    earlier: list[str] = field(default_factory=list)
    refutes: dict[str, Any] | None = None
    reason: str | None = None
    settles: str | None = None


@dataclass(repr=False)
class LevelRecord(Record):
    """What was found by a further objective of a lexicographic combination, among the best by those before it.

    Attributes are those of `Result`; status is None where it was not begun.
    """

    status: Status | None = None
    value: int | float | None = None
    bound: int | float | None = None
    gap: float | None = None
    certificate: Certificate = field(default_factory=Certificate)


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
    then : list of LevelRecord
        One for each of the further objectives, ``problem.then``; `value`, `bound` and `certificate` are those of the
        first, and `status` is that of all.
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
    then: list[LevelRecord] = field(default_factory=list)
    versions: dict[str, str] = field(default_factory=dict)
    schema: int = SCHEMA

    def __repr__(self) -> str:
        from bcut.summary import headline

        return f"<Result {headline(self)}>"

    def __str__(self) -> str:
        from bcut.summary import summary

        return summary(self).rstrip("\n")

    @property
    def optimal(self) -> bool:
        """Whether optimality was proven."""
        return self.status == "optimal"

    @classmethod
    def load(cls, source: str | os.PathLike[str] | Mapping[str, Any]) -> Result:
        """Make a result of a result file, or of its data, as `to_dict` returns them.

        Nothing is checked but the types of the entries; `bcut.verify` checks what they say.

        Raises
        ------
        ResultError
            It cannot be read, belongs to another schema, lacks an entry, has one of the wrong type or an unknown one.
        """
        return load_record(cls, source, schema=SCHEMA)

    def to_dict(self) -> dict[str, Any]:
        """Return the result file as plain data, in the documented order."""
        data = asdict(self)
        return {"schema": data.pop("schema"), **data}

    def to_json(self) -> str:
        """Return the result file as text."""
        return _readable(self.to_dict()) + "\n"

    def save(self, path: str | Path) -> None:
        """Write the result file, whole or not at all."""
        write_text(Path(path), self.to_json())


def _readable(value: Any, depth: int = 0) -> str:
    """Return JSON with a line for each entry; lists of plain values, and what is nested deeper, stay on one line."""
    parts = list(value.values()) if isinstance(value, dict) else value if isinstance(value, list) else []
    is_nested = any(isinstance(part, dict | list) for part in parts)
    is_section = isinstance(value, dict) and depth < 2
    if not parts or depth == 3 or not (is_nested or is_section):
        return json.dumps(value, allow_nan=False)
    indent = " " * (depth + 1)
    texts = [_readable(part, depth + 1) for part in parts]
    if isinstance(value, dict):
        texts = [f"{json.dumps(key)}: {text}" for key, text in zip(value, texts, strict=True)]
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    return f"{opening}\n" + ",\n".join(indent + text for text in texts) + f"\n{' ' * depth}{closing}"
