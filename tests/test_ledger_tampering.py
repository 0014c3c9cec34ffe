"""Ledgers that were changed or broken are refused, and what is wrong is told with its file."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from laboratory import edited
from ledgers import Entries, Made, made_in

from bcut.cli.main import run
from bcut.errors import LedgerError
from bcut.experiments.ledger import read_ledger
from bcut.experiments.replay import UncheckedCutsError, check_ledger, replay
from bcut.verification import heavy_sets

Captured = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    return made_in(tmp_path_factory)


def first(entries: Entries, family: str) -> dict[str, Any]:
    return next(entry for entry in entries if entry["record"] == "cut" and entry["family"] == family)


def shift_rhs(family: str, by: int) -> Callable[[Entries], None]:
    def change(entries: Entries) -> None:
        first(entries, family)["rhs"] += by

    return change


def raise_coefficient(family: str) -> Callable[[Entries], None]:
    def change(entries: Entries) -> None:
        cut = first(entries, family)
        cut["coefficients"] = [c + 1 for c in cut["coefficients"]]

    return change


def lighter_wedge(entries: Entries) -> None:
    wedges = first(entries, "link")["proof"]["wedges"]
    for wedge in wedges:
        wedge[2] = 0


def other_face(entries: Entries) -> None:
    cut = first(entries, "link")
    cut["proof"]["face"] = [v for v in range(16) if v not in cut["proof"]["face"]][:2]


def swapped_cycle(entries: Entries) -> None:
    for entry in entries:
        if entry["record"] == "cut" and entry["family"] == "odd-cycle":
            cycle = entry["proof"]["cycle"]
            if len(cycle) >= 5:
                cycle[1], cycle[2] = cycle[2], cycle[1]
                return
    raise AssertionError("there is no long cycle")


def shorter_cycle(entries: Entries) -> None:
    first(entries, "odd-cycle")["proof"]["cycle"].pop()


def no_proof(entries: Entries) -> None:
    first(entries, "link")["proof"] = {}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (shift_rhs("link", 1), "its right-hand side is 1, but its proof gives 0"),
        (shift_rhs("link", -1), "reach 0 on its left side, but its right-hand side is -1"),
        (shift_rhs("odd-cycle", 1), "but its proof gives"),
        (shift_rhs("odd-cycle", -1), "is all that follows"),
        (raise_coefficient("link"), "wind around it once"),
        (raise_coefficient("odd-cycle"), "above 1"),
        (lighter_wedge, "but one weighs 0"),
        (other_face, "does not contain the face"),
        (no_proof, "names no face"),
        (swapped_cycle, "do not cross"),
        (shorter_cycle, "not an odd number"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_ledger_with_one_thing_changed_is_refused(
    made: Made, change: Callable[[Entries], None], reason: str
) -> None:
    (refusal,) = check_ledger(read_ledger(edited(made("loop")[0], change))).refused
    assert reason in refusal[1]


def test_the_command_refuses_a_changed_right_hand_side(made: Made, capsys: Captured) -> None:
    path = str(edited(made("zero-half and link")[0], shift_rhs("link", 1)))
    assert run(["cuts", "verify", path, "--quiet"]) == 2
    captured = capsys.readouterr()
    assert "its right-hand side is 1, but its proof gives 0" in captured.err
    assert not captured.out
    assert run(["cuts", "verify", path, "--json"]) == 2
    assert '"reason": "link cut' in capsys.readouterr().out


@pytest.mark.parametrize("by", [1, -1])
def test_a_clique_with_another_right_hand_side_is_refused(made: Made, by: int) -> None:
    path = edited(made("loop in the plane")[0], shift_rhs("clique", by))
    assert len(check_ledger(read_ledger(path)).refused) == 1


def test_a_bound_that_the_cuts_do_not_give_is_refused(made: Made, capsys: Captured) -> None:
    def change(entries: Entries) -> None:
        entries[-1]["lp"] += 1e-7

    path = edited(made("loop")[0], change)
    assert not replay(read_ledger(path)).agrees
    assert run(["cuts", "replay", str(path)]) == 2
    assert "as recorded" in capsys.readouterr().err
    fewer = edited(made("loop")[0], lambda entries: entries[-1].update(final=[]))
    assert replay(read_ledger(fewer)).found == pytest.approx(28.5)


def test_points_that_were_changed_are_refused(made: Made) -> None:
    def change(entries: Entries) -> None:
        entries[0]["instance"]["points"][0][0] = "7"

    with pytest.raises(LedgerError, match="digest"):
        check_ledger(read_ledger(edited(made("loop")[0], change)))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda entries: entries.pop(), "is cut short"),
        (lambda entries: entries[0].update(schema=99), "no ledger of schema"),
        (lambda entries: entries.append(entries[-1]), "goes on after its end"),
        (lambda entries: entries[1].pop("record"), "line 2: is no entry"),
        (lambda entries: first(entries, "link").pop("rhs"), "has no entry 'rhs'"),
    ],
)
def test_a_broken_ledger_is_refused(
    made: Made, change: Callable[[Entries], None], says: str, capsys: Captured
) -> None:
    path = edited(made("loop")[0], change)
    with pytest.raises(LedgerError, match=says):
        read_ledger(path)
    for command in ("show", "replay", "verify"):
        assert run(["cuts", command, str(path)]) == 2
        assert capsys.readouterr().err.startswith(f"Error: {path}")


@pytest.mark.parametrize(
    "content",
    [b"", b"no gzip", gzip.compress(b"no json\n", mtime=0), gzip.compress(b"{}\n", mtime=0)[:20]],
    ids=["empty", "no gzip", "no JSON", "cut off"],
)
def test_other_files_are_no_ledgers(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other.gz"
    path.write_bytes(content)
    with pytest.raises(LedgerError, match=r"other\.gz"):
        read_ledger(path)
    with pytest.raises(LedgerError, match="there is no such file"):
        read_ledger(tmp_path / "none.gz")


@pytest.mark.parametrize("entry", [[[0, 1, 2, 99]], [[0, 1, 2]], [[3, 2, 1, 0]], "x", []])
def test_a_cut_of_no_simplices_is_refused(made: Made, entry: Any) -> None:
    path = edited(made("loop")[0], lambda entries: first(entries, "link").update(simplices=entry))
    with pytest.raises(LedgerError, match=r"is malformed|the 'simplices' of cut 1 is ") as caught:
        check_ledger(read_ledger(path))
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"proof": None}, "line 3: the 'proof' of cut 1 is null, where an object belongs"),
        ({"taken": 1}, "line 3: the 'taken' of cut 1 is 1, where true or false belongs"),
        ({"node": True}, "line 3: the 'node' of cut 1 is true, where an integer belongs"),
        ({"lp_after": "x"}, "line 3: the 'lp_after' of cut 1 is \"x\", where a number or null belongs"),
        ({"rhs": 0.5}, "cut 1 is malformed: its right-hand side is 0.5, where an integer belongs"),
        ({"coefficients": [1]}, "cut 1 is malformed: it has 1 coefficients for"),
    ],
)
def test_what_is_wrong_with_a_cut_is_told_with_its_file(
    made: Made, change: dict[str, Any], says: str, capsys: Captured
) -> None:
    path = edited(made("loop")[0], lambda entries: first(entries, "link").update(change))
    assert run(["cuts", "verify", str(path), "--json"]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith(f"Error: {path}")
    assert says in captured.err
    (told,) = json.loads(captured.out)["ledgers"]
    assert told == {"ledger": str(path), "error": captured.err.removeprefix("Error: ").rstrip()}


def test_a_ledger_about_other_points_is_told_with_its_file(made: Made, capsys: Captured) -> None:
    def digest(entries: Entries) -> None:
        entries[0]["instance"]["points"][0][0] = "7"

    def simplex(entries: Entries) -> None:
        entries[-1]["at_zero"] = [[0, 1, 99]]

    for change, says in ((digest, "do not have the digest"), (simplex, "speaks of [0, 1, 99]")):
        path = edited(made("loop")[0], change)
        assert run(["cuts", "replay", str(path)]) == 2
        said = capsys.readouterr().err
        assert said.startswith(f"Error: {path}: ")
        assert says in said


def test_several_ledgers_are_verified_and_the_worst_counts(
    made: Made, tmp_path: Path, capsys: Captured
) -> None:
    good, none = str(made("root with cutoff")[0]), tmp_path / "none.gz"
    broken = tmp_path / "broken.gz"
    broken.write_bytes(gzip.compress(b"hi\n"))
    assert run(["cuts", "verify", good, str(made("loop")[0])]) == 0
    assert capsys.readouterr().out.count("proven again") == 2
    assert run(["cuts", "verify", str(none), good, str(broken), "--json"]) == 2
    captured = capsys.readouterr()
    told = json.loads(captured.out)["ledgers"]
    assert [Path(one["ledger"]) for one in told] == [none, Path(good), broken]
    assert ["error" in one for one in told] == [True, False, True]
    assert f"{none}: there is no such file" in captured.err
    assert f"{broken}, line 1: is no JSON" in captured.err


@pytest.mark.parametrize(
    ("name", "drop", "says"),
    [("zero-half", "scip:", "the run found no cuts"), ("zero-half", "link", "nobody knows how to check ")],
)
def test_ledgers_with_nothing_to_prove_are_no_failures(
    made: Made, name: str, drop: str, says: str, capsys: Captured
) -> None:
    def change(entries: Entries) -> None:
        entries[:] = [one for one in entries if not one.get("family", "").startswith(drop)]
        entries[-1]["final"] = []

    path = edited(made(name)[0], change)
    assert run(["cuts", "verify", str(path)]) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith(f"{path}: nothing to prove: {says}")
    assert not captured.err


def test_cuts_that_take_too_long_are_named_and_not_refused(
    made: Made, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    path = made("loop in the plane")[0]
    everything = check_ledger(read_ledger(path))
    monkeypatch.setattr(heavy_sets, "_MOST_STEPS", 10)
    with pytest.raises(UncheckedCutsError) as caught:
        check_ledger(read_ledger(path))
    checks = caught.value.checks
    assert not checks.refused
    assert checks.proven["clique"] == everything.proven["clique"]
    tired = dict(checks.unchecked)
    assert len(tired) + checks.proven.get("odd-cycle", 0) == everything.proven["odd-cycle"]
    assert run(["cuts", "verify", str(path)]) == 3
    said = capsys.readouterr().err
    number, reason = next(iter(tired.items()))
    assert said.startswith(
        f"Error: {path}: {len(tired)} of the cuts were not checked (cut {number}: {reason}"
    )
    assert "it takes more than 10 steps to check a cut over" in reason
    assert f"none is refused, {checks.proven['clique']} clique" in said
    assert run(["cuts", "verify", str(path), "--json"]) == 3
    (told,) = json.loads(capsys.readouterr().out)["ledgers"]
    assert told["proven"] == checks.proven
    assert {cut["number"]: cut["reason"] for cut in told["unchecked"]} == tired
    # A refusal is the graver thing.
    other = edited(path, shift_rhs("clique", 1))
    checks = check_ledger(read_ledger(other))
    assert len(checks.refused) == 1
    assert dict(checks.unchecked) == tired
    assert run(["cuts", "verify", str(other)]) == 2
    for order in ([path, other], [other, path]):
        assert run(["cuts", "verify", *map(str, order)]) == 2
