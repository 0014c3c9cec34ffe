"""Ledgers: every cut is there, the cuts of the end give the bound again, and each follows from its proof, exactly."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from laboratory import ledger_file
from ledgers import MADE, PLAN, SPANNING, Made, cuts_of, made_in

from bcut.cli.main import run
from bcut.errors import LedgerError
from bcut.experiments.ledger import read_ledger
from bcut.experiments.replay import check_ledger, replay

Captured = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    return made_in(tmp_path_factory)


@pytest.mark.parametrize("name", [name for name in MADE if name != "solve"])
def test_the_cuts_of_the_end_give_the_bound_again(made: Made, name: str) -> None:
    path, record = made(name)
    found = replay(read_ledger(path))
    assert found.recorded == record["outcome"]["lp_after_cuts"]
    assert found.found == pytest.approx(found.recorded, abs=1e-9, rel=1e-9)
    assert found.agrees
    expected = MADE[name][3]
    if expected is not None:
        assert found.found == pytest.approx(expected, abs=1e-6)
        assert found.cuts > 0
        assert found.before < found.found


@pytest.mark.parametrize("name", MADE)
def test_every_right_hand_side_follows_from_its_proof(made: Made, name: str) -> None:
    ledger = read_ledger(made(name)[0])
    checks = check_ledger(ledger)
    assert not checks.refused
    families = Counter(cut["family"] for cut in ledger.cuts)
    assert checks.proven == {f: n for f, n in families.items() if not f.startswith("scip:")}
    assert checks.without_checker == {f: n for f, n in families.items() if f.startswith("scip:")}


def test_the_ledgers_of_these_tests_hold_all_families(made: Made) -> None:
    families = {cut["family"] for name in MADE for cut in read_ledger(made(name)[0]).cuts}
    assert families == {"link", "clique", "odd-cycle", "scip:zerohalf"}
    fixed = read_ledger(made("loop with cutoff")[0]).end["at_zero"]
    assert fixed


@pytest.mark.parametrize("name", ["loop", "root", "zero-half"])
def test_every_cut_is_there_with_what_became_of_it(made: Made, name: str) -> None:
    path, record = made(name)
    ledger, counts = read_ledger(path), record["cuts"]
    assert [cut["number"] for cut in sorted(ledger.cuts, key=lambda cut: cut["number"])] == list(
        range(1, len(ledger.cuts) + 1)
    )
    for family, count in counts.items():
        own = cuts_of(ledger, family=family)
        assert len(own) == count["found"]
        assert len([cut for cut in own if cut["taken"]]) == count["taken"]
        assert len([cut for cut in own if cut["final"]]) == count["final"] >= count["active"]
    for family, statistics in record["outcome"]["separators"].items():
        if not family.startswith("scip:"):
            assert statistics["added"] == (counts[family]["taken"] if family in counts else 0)
    assert all(cut["taken"] for cut in ledger.cuts if cut["final"])
    lps = [lp for lp, _ in record["outcome"]["rounds"]]
    for cut in ledger.cuts:
        assert len(cut["simplices"]) == len(cut["coefficients"])
        assert min(abs(lp - cut["lp_before"]) for lp in lps) <= 1e-9
        assert min(abs(lp - cut["lp_after"]) for lp in lps) <= 1e-9
        if not cut["family"].startswith("scip:"):
            assert cut["violation"] > 0
            assert cut["efficacy"] == pytest.approx(
                cut["violation"] / sum(c * c for c in cut["coefficients"]) ** 0.5
            )


def test_points_violate_the_cuts_that_were_found_for_them(made: Made) -> None:
    ledger = read_ledger(made("loop")[0])
    points = {(point["node"], point["round"]): point for point in ledger.points}
    for cut in ledger.cuts:
        point = points[cut["node"], cut["round"]]
        values = {tuple(s): x for s, x in zip(point["simplices"], point["values"], strict=True)}
        left = sum(
            c * values.get(tuple(s), 0.0) for s, c in zip(cut["simplices"], cut["coefficients"], strict=True)
        )
        assert left - cut["rhs"] == pytest.approx(cut["violation"], abs=1e-6)
        assert point["lp"] == cut["lp_before"]


def test_what_was_fixed_before_a_cut_was_found_is_written_down(made: Made) -> None:
    ledger = read_ledger(made("solve")[0])
    assert ledger.end["lp"] is None
    assert {cut["part"] for cut in ledger.cuts} == set(ledger.parts)
    for cut in ledger.cuts:
        left = {tuple(simplex) for simplex in ledger.parts[cut["part"]]}
        assert {tuple(simplex) for simplex in cut["simplices"]} <= left
    with pytest.raises(LedgerError, match="no last relaxation"):
        replay(ledger)
    # On all simplices, the same inequalities need not hold: weights of what had been fixed are missing.
    ledger.parts = {}
    assert check_ledger(ledger).refused


def test_cuts_that_no_relaxation_was_solved_with_are_not_in_the_last_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from bcut.bounds.relaxation import Relaxation

    solve, calls = Relaxation.solve, Counter[str]()

    def limited(self: Relaxation) -> Any:
        calls["solve"] += 1
        return None if calls["solve"] == 3 else solve(self)

    monkeypatch.setattr(Relaxation, "solve", limited)
    text = PLAN.format(instance="random:16,3,seed=22", case=SPANNING, variant='separators = ["link"]')
    path, record = ledger_file(tmp_path, text)
    assert record["outcome"]["status"] == "limit"
    ledger = read_ledger(path)
    assert {cut["round"] for cut in ledger.cuts if cut["taken"]} == {1, 2}
    assert {cut["round"] for cut in ledger.cuts if cut["final"]} == {1}
    assert {cut["lp_after"] for cut in ledger.cuts if cut["round"] == 2} == {None}
    assert replay(ledger).agrees


# The commands.


def test_the_table_shows_what_is_asked_for(made: Made, capsys: Captured) -> None:
    path = str(made("loop")[0])
    ledger = read_ledger(path)
    assert run(["cuts", "show", path, "--limit", "0"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"random:16,3,seed=20: min cardinality, {len(ledger.cuts)} cuts"
    assert lines[1].split()[:4] == ["cut", "family", "node", "round"]
    assert len(lines) == 2 + len(ledger.cuts)
    assert run(["cuts", "show", path, "--family", "link", "--final", "--limit", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    shown = cuts_of(ledger, family="link", final=True)
    assert len(lines) == 3 + (len(shown) > 1)
    assert lines[2].split()[1] == "link"
    assert run(["cuts", "show", path, "--json", "--limit", "2", "--family", "link"]) == 0
    printed = capsys.readouterr().out
    told = json.loads(printed)
    assert told["instance"] == "random:16,3,seed=20"
    assert told["problem"]["sense"] == "min"
    assert (told["recorded"], told["chosen"]) == (len(ledger.cuts), len(cuts_of(ledger, family="link")))
    assert told["cuts"] == cuts_of(ledger, family="link")[:2]
    # A line for each cut.
    assert sum('"record": "cut"' in line for line in printed.splitlines()) == 2
    assert run(["cuts", "show", path, "--json", "--family", "none"]) == 0
    assert json.loads(capsys.readouterr().out)["cuts"] == []


def test_the_commands_say_what_they_did(made: Made, capsys: Captured) -> None:
    path = str(made("root with cutoff")[0])
    assert run(["cuts", "replay", path]) == 0
    assert "cuts move the bound from 28.5 to 29; recorded was 29" in capsys.readouterr().out
    assert run(["cuts", "verify", path]) == 0
    said = capsys.readouterr().out
    assert " link" in said
    assert "proven again" in said
    for command in ("replay", "verify"):
        assert run(["cuts", command, path, "--json"]) == 0
        assert capsys.readouterr().out.startswith("{")
        assert run(["cuts", command, path, "--quiet"]) == 0
        assert not capsys.readouterr().out
