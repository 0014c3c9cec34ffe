"""The SCIP host at limits and interrupts, what it reports on the way, and the model it writes."""

from __future__ import annotations

import json
import signal
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from oracles import BARE, incidence, with_depth, with_gap
from processes import finished, started
from pyscipopt import Model

from bcut.bounds.root import root_bound
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.instance import load_instance
from bcut.objectives.objective import Objective, from_fractions, make_objective
from bcut.scip.host import TreeOptions, branch_and_cut, scip_version
from bcut.scip.model import build_model, write_model


def hard() -> tuple[Formulation, Objective]:
    """Takes SCIP alone some ten seconds; an incumbent comes late."""
    formulation = cocircuit_formulation(load_instance("dodecahedron"))
    return formulation, make_objective("cardinality", formulation, sense="max")


def test_a_time_limit_is_kept_and_so_is_the_start() -> None:
    formulation, objective = hard()
    start = np.flatnonzero(root_bound(formulation, make_objective("random-costs:1", formulation)).point > 0.5)
    result = branch_and_cut(formulation, objective, options=TreeOptions(seconds=0.7, **BARE), start=start)
    assert result.status == "limit"
    assert result.columns is not None
    assert len(result.columns) >= len(start)
    assert result.bound is None or result.bound >= 36 - 1e-6


@pytest.mark.parametrize("seconds", [0.0, -1.0])
def test_a_time_limit_of_nothing(seconds: float) -> None:
    formulation, objective, _ = with_gap(0)
    start = np.flatnonzero(incidence(formulation)[0])
    result = branch_and_cut(formulation, objective, options=TreeOptions(seconds=seconds), start=start)
    assert result.status == "limit"
    assert result.columns is not None
    assert result.columns.tolist() == start.tolist()


def test_a_time_limit_beyond_what_scip_accepts() -> None:
    formulation, objective, optimum = with_gap(0)
    result = branch_and_cut(formulation, objective, options=TreeOptions(seconds=1e300))
    assert result.bound == pytest.approx(optimum)


def test_a_node_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    formulation, objective = with_depth(monkeypatch)
    result = branch_and_cut(formulation, objective, options=TreeOptions(nodes=2, **BARE))
    assert result.status == "limit"
    assert result.nodes == 2


@pytest.mark.parametrize("sense", ["min", "max"])
def test_a_cutoff_leaves_strictly_better_solutions_only(sense: str) -> None:
    formulation, objective, optimum = with_gap(3, sense)
    worse = optimum + objective.sign * 0.5
    result = branch_and_cut(formulation, objective, options=TreeOptions(cutoff=worse))
    assert result.status == "optimal"
    assert result.columns is not None
    assert objective.value(result.columns) == optimum
    refuted = branch_and_cut(formulation, objective, options=TreeOptions(cutoff=float(optimum)))
    assert refuted.status == "infeasible"
    # SCIP may have come across a solution, but none that is better.
    value = None if refuted.columns is None else objective.value(refuted.columns)
    assert value is None or objective.sign * value >= objective.sign * optimum


@pytest.mark.parametrize("sense", ["min", "max"])
def test_progress_tells_bounds_and_incumbents(sense: str) -> None:
    formulation, objective, optimum = with_gap(2, sense)
    seen: list[dict[str, Any]] = []
    branch_and_cut(formulation, objective, on_progress=seen.append)
    assert {"stage", "value", "bound", "nodes"} == set(seen[0])
    assert any(facts["value"] == pytest.approx(optimum) for facts in seen)
    bounds = [facts["bound"] for facts in seen if facts["bound"] is not None]
    assert bounds
    assert all(abs(bound) < 1e20 for bound in bounds)


@pytest.mark.parametrize("scale", [Fraction(1, 10**12), Fraction(1, 3), Fraction(10**15)])
def test_values_at_any_scale_of_costs(scale: Fraction) -> None:
    formulation, plain, optimum = with_gap(5)
    objective = from_fractions("scaled", "max", [-int(cost) * scale for cost in plain.numerators])
    seen: list[dict[str, Any]] = []
    result = branch_and_cut(
        formulation,
        objective,
        options=TreeOptions(cutoff=float(-(optimum + 1) * scale)),
        on_progress=seen.append,
    )
    assert result.status == "optimal"
    assert result.columns is not None
    assert objective.value(result.columns) == -optimum * scale
    assert result.bound == pytest.approx(float(-optimum * scale), rel=1e-6)
    assert result.rounds[0].lp == pytest.approx(float(Fraction(-15, 2) * scale), rel=1e-6)
    values = [float(facts["value"] / scale) for facts in seen if facts["value"] is not None]
    assert max(values) == pytest.approx(-optimum)
    bounds = [float(facts["bound"] / scale) for facts in seen if facts["bound"] is not None]
    assert min(bounds) == pytest.approx(-optimum, rel=0.1)


INTERRUPTED = """
import json, pathlib, sys, bcut

def tell(facts):
    if facts["stage"] == "tree" and facts["bound"] is not None:
        pathlib.Path(sys.argv[1]).touch()

result = bcut.solve("dodecahedron", sense="max", method="scip", separators=[], on_progress=tell)
print(json.dumps([result.status, result.value, result.bound, len(result.triangulation)]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT for one process")
def test_ctrl_c_keeps_the_incumbent_and_standard_output_clean(tmp_path: Path) -> None:
    with started([sys.executable, "-c", INTERRUPTED, str(tmp_path / "bounded")]) as program:
        program.until((tmp_path / "bounded").exists)
        program.signal(signal.SIGINT)
        ended = program.end()
    assert ended.status == 0
    status, value, bound, size = json.loads(ended.out)
    assert status == "interrupted"
    assert value == size
    assert 20 <= value <= 36 <= bound


NATIVE = """
import os, sys
from bcut.scip.console import native_output_to_stderr
print("before")
with native_output_to_stderr():
    with native_output_to_stderr():
        os.write(1, b"inner ")
    os.write(1, b"outer")
os.write(1, b"after")
"""

CLOSED = """
import os, sys
os.close(1)
from bcut.scip.console import native_output_to_stderr
with native_output_to_stderr():
    sys.stderr.write("inside")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="file descriptors are not redirected there")
def test_native_output_goes_to_standard_error_and_comes_back() -> None:
    assert finished([sys.executable, "-c", NATIVE]) == (0, "before\nafter", "inner outer")


@pytest.mark.skipif(sys.platform == "win32", reason="file descriptors are not redirected there")
def test_a_closed_standard_output_does_no_harm() -> None:
    ended = finished([sys.executable, "-c", CLOSED])
    assert ended.err.startswith("inside")
    assert "Traceback" not in ended.err


def test_the_same_seed_gives_the_same_run() -> None:
    formulation, objective, _ = with_gap(2)
    runs = [branch_and_cut(formulation, objective, options=TreeOptions(seed=2**31 + 5)) for _ in range(2)]
    assert [r.lp for r in runs[0].rounds] == [r.lp for r in runs[1].rounds]
    assert runs[0].columns is not None
    assert runs[1].columns is not None
    assert runs[0].columns.tolist() == runs[1].columns.tolist()


# The model.


def test_no_columns_are_infeasible() -> None:
    part = cocircuit_formulation(load_instance("cube:3")).restricted_to(np.array([], dtype=np.int64))
    assert branch_and_cut(part, make_objective("cardinality", part)).status == "infeasible"


@pytest.mark.parametrize("sense", ["min", "max"])
@pytest.mark.parametrize("suffix", [".lp", ".mps", ".cip"])
def test_a_written_model_has_the_same_optimum(tmp_path: Path, suffix: str, sense: str) -> None:
    formulation, objective, optimum = with_gap(1, sense)
    path = tmp_path / f"model{suffix}"
    write_model(formulation, objective, path)
    model = Model()
    model.hideOutput()
    model.readProblem(str(path))
    assert (model.getNVars(), model.getNConss()) == formulation.size
    assert model.getObjectiveSense() == f"{sense}imize"
    model.optimize()
    assert model.getObjVal() == pytest.approx(optimum)


def test_variables_and_rows_carry_the_names_of_their_simplices() -> None:
    formulation = cocircuit_formulation(load_instance("cube:3"))
    model, variables = build_model(formulation, make_objective("cardinality", formulation))
    names = ["x_" + "_".join(map(str, simplex)) for simplex in formulation.simplices.tolist()]
    assert [variable.name for variable in variables] == names
    faces = [
        "coverage" if face is None else "cocircuit_" + "_".join(map(str, face))
        for face in formulation.row_faces
    ]
    assert [constraint.name for constraint in model.getConss()] == faces


def test_the_version_is_that_of_the_library() -> None:
    assert scip_version().split(".")[0] == "10"
