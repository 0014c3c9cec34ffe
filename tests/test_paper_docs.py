"""The pages about the paper and about regions: their commands run, and what they say of results is so."""

from __future__ import annotations

import re
import shlex
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import bcut
from bcut.cli.main import run
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance

ROOT = Path(__file__).resolve().parent.parent
PAGES = {name: (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") for name in ("paper", "regions")}
README = (ROOT / "README.md").read_text(encoding="utf-8")
Captured = pytest.CaptureFixture[str]


def commands(text: str) -> list[list[str]]:
    found = []
    for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL):
        found += [shlex.split(line) for line in block.splitlines() if line.strip()]
    return found


@pytest.mark.parametrize("name", sorted(PAGES))
def test_the_commands_run(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    (tmp_path / "instances").symlink_to(ROOT / "instances")
    monkeypatch.chdir(tmp_path)
    listed = commands(PAGES[name])
    assert listed
    for program, *arguments in listed:
        assert program == "bcut"
        assert run(arguments) == 0, arguments
    assert "not triangulable" in capsys.readouterr().out


def test_the_commands_of_the_readme_about_regions_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.chdir(tmp_path)
    listed = [arguments[1:] for arguments in commands(README) if "region" in " ".join(arguments)]
    assert [arguments[0] for arguments in listed] == ["region", "verify"]
    assert [run(arguments) for arguments in listed] == [0, 0]
    assert "infeasible, proven exactly" in capsys.readouterr().out


def test_the_python_about_regions_prints_what_it_says(capsys: Captured) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGES["regions"], re.DOTALL)
    exec(compile(code, "regions.md", "exec"), {})
    assert capsys.readouterr().out.splitlines() == re.findall(r"\)  # (.*)", code)


def test_the_table_of_regions_is_right() -> None:
    rows = re.findall(r"^\| `(\S+)` \| (\d+) \| (\d+) \| (\S+) \| (\S+) % \|", PAGES["regions"], re.MULTILINE)
    assert len(rows) == 9
    for name, points, inside, covered, share in rows:
        if int(points) > 12:
            continue
        found = bcut.region(name)
        assert found.status == "infeasible"
        assert (len(found.instance["points"]), found.tetrahedra) == (int(points), int(inside))
        assert Fraction(found.covered or 0) == Fraction(covered)
        assert float(Fraction(covered) / Fraction(found.volume)) == pytest.approx(
            float(share) / 100, abs=5e-4
        )


def test_the_conjecture_has_no_counterpart_in_space() -> None:
    assert bcut.bound("random:12,3,seed=3", sense="max", separators=[]).root.lp == pytest.approx(33.5)
    found = bcut.solve("random:12,3,seed=3", sense="max")
    assert (found.status, found.value) == ("optimal", 33)


@pytest.mark.parametrize("dimension", [2, 3, 4])
@pytest.mark.parametrize("seed", [1, 2])
def test_every_simplex_is_missed_by_two_triangulations_without_common_simplices(
    dimension: int, seed: int
) -> None:
    chirotope = Chirotope.of(load_instance(f"random:{dimension + 3},{dimension},seed={seed}"))
    found = [set(triangulation) for triangulation in triangulations(chirotope)]
    apart = [(one, two) for i, one in enumerate(found) for two in found[i + 1 :] if not one & two]
    for simplex in range(len(chirotope.bases)):
        assert any(simplex not in one | two for one, two in apart)


def test_grams_relation_counts_tetrahedra() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        points = rng.normal(size=(4, 3))
        normals = []
        for apex in range(4):
            a, b, c = points[[v for v in range(4) if v != apex]]
            normal = np.cross(b - a, c - a)
            normals.append(normal / np.linalg.norm(normal) * np.sign(normal @ (points[apex] - a)))
        dihedral = {
            (i, j): np.pi - np.arccos(np.clip(normals[i] @ normals[j], -1, 1))
            for i in range(4)
            for j in range(i)
        }
        edges = sum(dihedral.values()) / (2 * np.pi)
        solid = sum(
            sum(angle for pair, angle in dihedral.items() if apex not in pair) - np.pi for apex in range(4)
        ) / (4 * np.pi)
        assert edges - solid == pytest.approx(1)
        assert 0 < solid < 0.5
