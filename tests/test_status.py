"""What a status rests on, what is refused because it contradicts itself, and limits before there is a program."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from oracles import Scripted
from processes import BCUT, TIME_IS_UP, Started, started

import bcut
from bcut.errors import SolverError
from bcut.formulations.orbit_cocircuits import orbit_formulation
from bcut.geometry.orbits import simplex_orbits
from bcut.geometry.symmetry import symmetry_group
from bcut.instance import load_instance
from bcut.separation.seam import Cut, FractionalPoint
from bcut.summary import summary
from bcut.verification.verify import verify

FRACTIONAL = {"instance": "random:12,3,seed=1000", "spanning": True}


def status_line(result: bcut.Result) -> str:
    (line,) = [line for line in summary(result).splitlines() if line.strip().startswith("status")]
    return line.partition("status")[2].strip()


# What a status rests on.


@pytest.mark.parametrize(
    "options",
    [
        {"instance": "cube:4"},
        {"instance": "cube:3", "sense": "max"},
        {"instance": "dodecahedron", "method": "orbits"},
        {"instance": "random:9,3,seed=1", "objective": "min-max:aspect-ratio"},
        {"instance": "cube:3", "require": [[0, 7]], "forbid": [[0, 7]]},
        {"instance": "cube:3", "then": ["max:cardinality"]},
    ],
    ids=str,
)
def test_what_a_certificate_settles_is_proven_exactly(options: dict[str, Any]) -> None:
    result = bcut.solve(**options)
    assert result.certificate.settles == "exactly"
    assert status_line(result).endswith("(proven exactly)")
    found = verify(result)
    assert found.proven_optimal or "infeasible, proven exactly" in found.statement


@pytest.mark.parametrize("options", [{"objective": "weight"}, {"then": ["max:volume"]}], ids=str)
def test_what_is_proven_but_for_rounding_is_called_so(options: dict[str, Any]) -> None:
    result = bcut.solve("cube:3", **options)
    assert status_line(result) == "optimal (proven within a relative gap of 1e-9)"
    assert "up to a relative gap" in verify(result).statement


def test_what_scip_alone_says_is_not_called_proven() -> None:
    result = bcut.solve(**FRACTIONAL, method="scip")
    assert result.status == "optimal"
    assert result.certificate.settles is None
    assert status_line(result) == "optimal (no relaxation was solved to optimality outside SCIP)"


def test_cuts_that_nobody_can_check_are_named() -> None:
    def nothing_fractional(point: FractionalPoint) -> Iterator[Cut]:
        yield Cut(point.fractional, 0)

    result = bcut.solve(**FRACTIONAL, separators=[Scripted(nothing_fractional, "mine")])
    assert result.status == "optimal"
    assert result.certificate.settles is None
    assert status_line(result) == "optimal (if the cuts of mine are valid: they were not checked)"
    assert not verify(result).proven_optimal


# Contradictions.


def everything(point: FractionalPoint) -> Iterator[Cut]:
    yield Cut(np.arange(len(point.x)), 0)


@pytest.mark.parametrize("call", [bcut.bound, bcut.solve])
def test_no_triangulation_at_all_is_an_error(call: Callable[..., bcut.Result]) -> None:
    with pytest.raises(
        SolverError, match=r"there is always one: cuts of mine are not valid .* or a solver erred"
    ):
        call(
            "random:30,2,seed=2",
            objective="random-costs:2",
            spanning=True,
            separators=[Scripted(everything, "mine")],
        )


def test_cuts_that_refute_every_target_end_at_a_triangulation() -> None:
    result = bcut.solve(**FRACTIONAL, separators=[Scripted(everything, "mine")])
    assert result.triangulation is not None
    assert status_line(result) == "optimal (if the cuts of mine are valid: they were not checked)"


def test_a_bound_that_a_triangulation_refutes_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(search: Any) -> None:
        search.offer(np.flatnonzero(np.isin(np.arange(len(search.whole.columns)), known)))
        search.raise_bound(Fraction(len(known) + 1))
        search.status = "optimal"

    best = bcut.solve("cube:3").triangulation
    simplices = bcut.solving.programs.make_formulation("2", load_instance("cube:3")).simplices.tolist()
    known = [simplices.index(simplex) for simplex in best or []]
    monkeypatch.setattr("bcut.solving.levels.solve_by_targets", wrong)
    with pytest.raises(
        SolverError, match="the bound 6 is refuted by a triangulation of the value 5: a solver erred"
    ):
        bcut.solve("cube:3")


# Rounding.


@pytest.mark.parametrize("sense", ["min", "max"])
@pytest.mark.parametrize("costs", [(3, 9, 2, 4), (2, 6, 6, 9), (9, 2, 4, 2), (6, 9, 2, 3), (9, 9, 9, 6)])
def test_bounds_over_orbits_are_rounded_by_the_unit_of_all_costs(
    costs: tuple[int, ...], sense: str, tmp_path: Path
) -> None:
    # The triangulation that takes no search has simplices of two kinds, whose costs have larger common divisors.
    cube = load_instance("cube:3")
    orbits = orbit_formulation(simplex_orbits(cube, symmetry_group(cube)))
    assert len(orbits.simplices) == len(costs)
    table = []
    for number, cost in enumerate(costs):
        images, _ = orbits.expanded(np.array([number]))
        table += [[simplex, cost] for simplex in images.tolist()]
    file = tmp_path / "costs.json"
    file.write_text(json.dumps({"default": 0, "costs": table}))
    question = {"objective": f"costs:{file}", "sense": sense}
    best = bcut.solve(cube, **question, method="listing")
    bound = bcut.bound(cube, **question, method="orbits", separators=[])
    assert best.value is not None
    assert bound.bound is not None
    assert bound.bound <= best.value if sense == "min" else bound.bound >= best.value


# Limits before there is a program.


@pytest.fixture
def _no_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C while simplices are listed."""

    def interrupted(*args: Any, **options: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr("bcut.solving.run.make_formulation", interrupted)
    monkeypatch.setattr("bcut.solving.run.orbit_stage", interrupted)


@pytest.mark.usefixtures("_no_program")
@pytest.mark.parametrize(
    ("method", "objective"),
    [
        ("listing", "cardinality"),
        ("listing", "min-max:volume"),
        ("scip", "cardinality"),
        ("orbits", "cardinality"),
    ],
)
def test_ctrl_c_while_simplices_are_listed_leaves_a_triangulation(method: str, objective: str) -> None:
    result = bcut.solve("cuboctahedron", method=method, objective=objective, spanning=True)
    assert (result.status, result.bound, result.size.columns) == ("interrupted", None, 0)
    assert result.triangulation is not None
    assert verify(result.to_dict()).value == pytest.approx(result.value)


@pytest.mark.usefixtures("_no_program")
def test_ctrl_c_while_simplices_are_listed_leaves_further_objectives_undone() -> None:
    result = bcut.solve("cube:3", then=["max:volume"])
    assert result.status == "interrupted"
    assert [level.status for level in result.then] == [None]
    verify(result.to_dict())


@pytest.mark.usefixtures("_no_program")
@pytest.mark.parametrize("asked", [{"forbid": [[0, 15]]}, {"invariant_under": 4}], ids=str)
def test_ctrl_c_while_simplices_are_listed_promises_nothing_that_was_asked_for(asked: dict[str, Any]) -> None:
    result = bcut.solve("cube:4", **asked)
    assert (result.status, result.triangulation, result.bound) == ("interrupted", None, None)
    verify(result.to_dict())


@pytest.mark.usefixtures("_no_program")
@pytest.mark.parametrize("method", ["listing", "orbits"])
def test_ctrl_c_while_a_bound_has_no_program_yet(method: str) -> None:
    result = bcut.bound("cube:4", method=method)
    assert (result.status, result.bound, result.triangulation) == ("interrupted", None, None)


def test_ctrl_c_in_the_first_separation_keeps_the_relaxation() -> None:
    def interrupt(point: FractionalPoint) -> Iterator[Cut]:
        raise KeyboardInterrupt
        yield

    result = bcut.bound(**FRACTIONAL, separators=[Scripted(interrupt, "mine")])
    assert (result.status, result.bound) == ("interrupted", 17)
    assert result.root.lp == pytest.approx(16.5)
    assert verify(result.to_dict()).rounded_bound == 17


@contextmanager
def slow_solve(
    folder: Path, *options: str, ignoring: bool = False, then: str = "time.sleep(600)"
) -> Iterator[Started]:
    """A solve whose first separation takes longer than anybody waits for."""
    (folder / "slow.py").write_text(
        "import pathlib, signal, time\n"
        "from bcut import Separator\n\n\n"
        "class Slow(Separator):\n"
        "    name = 'slow'\n\n"
        "    def separate(self, point):\n"
        "        pathlib.Path('asked').touch()\n"
        f"        {then}\n"
        "        return []\n"
    )
    # Its bound is below its optimum, 46: no lucky start spares the separation.
    command = [*BCUT, "solve", "random:22,3,seed=9", "--spanning"]
    command += ["--separator", "./slow.py", "--output", "found.json", *options]
    # As a shell does without job control, for what it starts in the background.
    ignore = (lambda: signal.signal(signal.SIGINT, signal.SIG_IGN)) if ignoring else None
    with started(command, cwd=folder, preexec_fn=ignore) as program:
        program.until((folder / "asked").exists)
        yield program


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals")
@pytest.mark.parametrize("ignoring", [False, True])
def test_a_request_to_end_keeps_what_was_found(tmp_path: Path, ignoring: bool) -> None:
    with slow_solve(tmp_path, ignoring=ignoring) as program:
        program.signal(signal.SIGTERM)
        assert program.end().status == 130
    result = json.loads((tmp_path / "found.json").read_text())
    assert (result["status"], result["bound"]) == ("interrupted", 45)
    verify(result)


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals")
def test_a_time_limit_holds_in_the_background_of_a_script(tmp_path: Path) -> None:
    # Ctrl-C is for others there; the time is up then.
    then = f"signal.raise_signal(signal.SIGINT); {TIME_IS_UP}; time.sleep(600)"
    with slow_solve(tmp_path, "--time-limit", "900", ignoring=True, then=then) as program:
        assert program.end().status == 3
    result = json.loads((tmp_path / "found.json").read_text())
    assert (result["status"], result["bound"]) == ("limit", 45)
