"""All built-in cut families: cuts that are violated and say why, parameters, loading, and what points tell them."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from cut_families import problem, ready

from bcut.errors import SeparatorLoadError
from bcut.separation.driver import to_integers
from bcut.separation.resolve import resolve
from bcut.separation.seam import FractionalPoint


@pytest.mark.parametrize("name", ["clique", "odd-cycle", "convex-polygon"])
def test_every_cut_is_violated_and_says_why(name: str) -> None:
    given = problem("grid:3,3")
    separator = ready(resolve(name), given)
    point = FractionalPoint(given, np.where(np.arange(len(given.simplices)) % 3 == 0, 0.6, 0.1))
    cuts = list(separator.separate(point))
    assert cuts
    for cut in cuts:
        assert to_integers(cut, name, len(given.simplices)).violation(point.x) > 0
        assert cut.proof


@pytest.mark.parametrize(
    "text",
    [
        "clique:max_cuts=0",
        "clique:lift=-1",
        "clique:effort=0",
        "odd-cycle:max_cuts=0",
        "odd-cycle:backend=scip",
        "odd-cycle:max_nodes=0",
        "convex-polygon:effort=0",
        "convex-polygon:depth=3",
    ],
)
def test_bad_parameters_are_refused(text: str) -> None:
    with pytest.raises(SeparatorLoadError, match=text.split(":")[0]):
        resolve(text)


def test_families_load_without_heavy_imports() -> None:
    code = (
        "import sys; from bcut.separation.resolve import available; available();"
        "print([name for name in ('scipy', 'networkx', 'highspy', 'pyscipopt') if name in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_remembered_rows_are_those_of_the_crossing_graph(monkeypatch: pytest.MonkeyPatch) -> None:
    from bcut.separation import seam

    whole = problem("cube:3")
    columns = np.array([7, 3, 50, 3])
    expected = whole.crossings(columns, np.arange(58))
    monkeypatch.setattr(seam, "_SMALL", 0)
    monkeypatch.setattr(seam, "_ROW_CACHE", 16)
    given = problem("cube:3")
    for _ in range(2):
        assert (given.crossing_rows(columns) == expected).all()
    assert (given.crossings(columns, np.arange(58)) == expected).all()
    assert given.crossing_rows(np.empty(0, dtype=np.int64)).shape == (0, 58)


def test_near_simplices_come_first() -> None:
    given = problem("random:8,3,seed=1")
    columns = np.array([0, 1])
    ordered = given.nearest_first(np.arange(len(given.simplices)), columns)
    occurrences = np.bincount(given.simplices[columns].ravel(), minlength=8)
    shared = occurrences[given.simplices[ordered]].sum(axis=1)
    assert (np.diff(shared) <= 0).all()
    assert sorted(ordered.tolist()) == list(range(len(given.simplices)))


def test_the_heaviest_columns_and_their_crossings() -> None:
    given = problem("cube:3")
    x = np.linspace(0, 1, 58)
    point = FractionalPoint(given, x)
    assert point.heaviest(3).tolist() == [54, 55, 56]
    assert (point.crossings_among(point.heaviest(3)) == given.crossings(np.array([54, 55, 56]))).all()
    assert point.crossings_among(point.heaviest(100)) is point.crossings
