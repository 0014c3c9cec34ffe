"""Surfaces that are read, from files and on the command line, and surfaces that are refused."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from polyhedra import CUBE, EVEN, Faces, boundary, settled

import bcut
from bcut.cli.main import run
from bcut.errors import BcutError, SurfaceError, TooLargeError, VerificationError
from bcut.solving.region import region
from bcut.verification.surface import SurfaceCheck

Captured = pytest.CaptureFixture[str]

BROKEN: list[tuple[Any, Faces, str]] = [
    (CUBE, EVEN[1:], "not closed"),
    (CUBE, [*EVEN, EVEN[0]], "share the edge"),
    (CUBE, [EVEN[0][::-1], *EVEN[1:]], "same direction"),
    (CUBE, [face[::-1] for face in EVEN], "wrongly oriented"),
    (CUBE, [], "no faces"),
    (CUBE, [[0, 1, 3, 2], *EVEN[2:]], "4 vertices"),
    (CUBE, [[0, 1, 8], *EVEN[1:]], "no set of three"),
    (CUBE, [[0, 1, 1], *EVEN[1:]], "no set of three"),
    (CUBE, [["a", 1, 1], *EVEN[1:]], "not three point numbers"),
    ([*CUBE, [2, 0, 0]], [[0, 4, 8], *EVEN[1:]], "on a line"),
    ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], "dimension 3"),
    ([["sqrt(2)", 0, 0], *CUBE[1:]], EVEN, "rational"),
    (CUBE, [[0, 1, 2], [0, 2, 1]], "wrongly oriented"),
]


@pytest.mark.parametrize(("points", "faces", "message"), BROKEN)
def test_what_bounds_no_region_is_refused(points: Any, faces: Faces, message: str) -> None:
    with pytest.raises(SurfaceError, match=message):
        bcut.region((points, faces))


TETRAHEDRON = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]]
CROSSING = {
    "edges through triangles": [[1, 1, 1], [5, 1, 1], [1, 5, 1], [1, 1, 5]],
    "a vertex on an edge": [[2, 0, 0], [2, -3, 1], [2, -3, -5], [5, -4, 0]],
    "a vertex on a triangle": [[1, 1, 0], [1, 1, -3], [2, 1, -3], [1, 2, -3]],
    "edges that cross": [[2, 1, 0], [2, -1, 0], [2, 0, -3], [3, 0, -3]],
}


@pytest.mark.parametrize("second", CROSSING.values(), ids=CROSSING)
def test_a_surface_that_crosses_itself_is_refused(second: list[list[int]]) -> None:
    points = TETRAHEDRON + second
    faces = boundary([[0, 1, 2, 3]], points) + boundary([[4, 5, 6, 7]], points)
    with pytest.raises(SurfaceError, match="crosses itself"):
        bcut.region((points, faces))
    check = SurfaceCheck([[Fraction(x) for x in point] for point in points], list(map(tuple, faces)))
    with pytest.raises(VerificationError, match="cross"):
        check.check()


def test_too_many_points_are_refused() -> None:
    points = np.random.default_rng(1).random((41, 3))
    with pytest.raises(TooLargeError, match="41 points"):
        bcut.region((points, [[0, 1, 2]]))


# Files and the command line.


def test_a_family_goes_through_files(tmp_path: Path, capsys: Captured) -> None:
    surface, result = tmp_path / "s.off", tmp_path / "s.json"
    assert run(["generate", "twisted-prism:4", "--output", str(surface)]) == 0
    assert run(["region", str(surface), "--output", str(result), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads(result.read_text())
    assert (printed["status"], printed["covered"]) == ("infeasible", bcut.region("twisted-prism:4").covered)
    assert run(["verify", str(result)]) == 0
    assert "infeasible, proven exactly" in capsys.readouterr().out
    assert run(["region", str(surface)]) == 0
    assert "not triangulable" in capsys.readouterr().out
    assert run(["region", "twisted-prism:5", "--time-limit", "1e-9", "--quiet"]) == 3


def test_surfaces_are_read_from_json_and_ply(tmp_path: Path) -> None:
    native = tmp_path / "cube.json"
    native.write_text(json.dumps({"schema": 1, "name": "block", "points": CUBE, "faces": EVEN}))
    assert settled(region(native)).instance["name"] == "block"
    head = ["ply", "format ascii 1.0", "element vertex 8", *(f"property float {c}" for c in "xyz")]
    head += ["element face 12", "property list uchar int vertex_indices", "end_header"]
    rows = [" ".join(map(str, point)) for point in CUBE] + [f"3 {a} {b} {c}" for a, b, c in EVEN]
    ply = tmp_path / "cube.ply"
    ply.write_text("\n".join([*head, *rows]) + "\n")
    assert settled(region(ply)).value == 5


def test_unusable_files_are_told(tmp_path: Path) -> None:
    quads = tmp_path / "quads.off"
    rows = [" ".join(map(str, point)) for point in CUBE]
    quads.write_text("\n".join(["OFF", "8 2 0", *rows, "4 0 1 3 2", "3 0 1 2"]) + "\n")
    cloud = tmp_path / "cloud.off"
    cloud.write_text("\n".join(["OFF", "8 0 0", *rows]) + "\n")
    native = tmp_path / "points.json"
    native.write_text(json.dumps(CUBE))
    for source, message in (
        (quads, "not all triangles"),
        (cloud, "only points"),
        (native, "faces"),
        (tmp_path / "missing.off", "no such file"),
        (tmp_path / "points.csv", "no such file"),
        ("cube:3", "without a surface"),
        ("schonhardt", "is unknown"),
        ("twisted-prism:5,twist=36", "twist"),
        ("chazelle:0", "K must"),
    ):
        with pytest.raises(BcutError, match=message):
            bcut.region(source)
    assert run(["generate", "cube:3", "--format", "off"]) == 2


def test_off_refuses_what_it_cannot_hold(tmp_path: Path) -> None:
    native = tmp_path / "thirds.json"
    points = [["1/3", 0, 0], *CUBE[1:]]
    native.write_text(json.dumps({"points": points, "faces": EVEN}))
    assert run(["generate", str(native), "--format", "off"]) == 2
    assert settled(bcut.region(native)).status in ("optimal", "infeasible")
