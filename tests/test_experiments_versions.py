"""The fingerprint of a run: whatever the process of a run may import, of ours or of others, is part of it."""

from __future__ import annotations

import ast
import importlib.metadata
import importlib.util
import pkgutil
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from laboratory import plan_file

import bcut.separators
from bcut.experiments.plan import read_plan
from bcut.experiments.tasks import tasks_of
from bcut.experiments.versions import code_version, source_files

# Where the process of a run begins, and what it loads by name.
ENTRIES = ["bcut.experiments.execute"]
ENTRIES += [f"bcut.separators.{found.name}" for found in pkgutil.iter_modules(bcut.separators.__path__)]
PLAN = """
[[instances]]
instance = "random:8,3,seed=1"
[[variants]]
name = "LP"
"""
# Points are read from files before a run begins, and travel with it; `import bcut` offers drawing, which no run does.
ASIDE = ("trimesh", "matplotlib")
OURS_ASIDE = "bcut.plotting"


def file_of(name: str) -> Path | None:
    """Return the source of a module; None where the name is not that of a module."""
    try:
        found = importlib.util.find_spec(name)
    except ModuleNotFoundError:
        return None
    return None if found is None or found.origin is None else Path(found.origin).resolve()


def imported(source: Path) -> Iterator[str]:
    """Yield all names that a module imports, anywhere in it: those within functions too."""
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.module is not None
            assert not node.level, f"{source}: a relative import"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def reached(entries: list[str]) -> tuple[dict[str, Path], set[str]]:
    """Return our modules that an import of these may lead to, and the libraries of others."""
    ours: dict[str, Path] = {}
    theirs: set[str] = set()
    waiting = list(entries)
    while waiting:
        name = waiting.pop()
        top, _, rest = name.partition(".")
        if top != "bcut":
            if top not in sys.stdlib_module_names:
                theirs.add(top)
        elif name not in ours and (source := file_of(name)) is not None:
            ours[name] = source
            # The packages around a module are imported before it.
            waiting += [*imported(source), *([name.rpartition(".")[0]] if rest else [])]
    return ours, theirs


def test_the_walk_through_imports_finds_those_within_functions() -> None:
    ours, theirs = reached(ENTRIES)
    assert {"bcut.experiments.presets", "bcut.experiments.sizes", "bcut.scip.host", "bcut"} <= set(ours)
    assert {"pyscipopt", "highspy", "numpy", "scipy", "networkx", "numba", "flint"} <= theirs


def test_what_a_run_may_import_of_ours_is_in_its_fingerprint() -> None:
    known = {path.resolve() for path in source_files().values()}
    ours, _ = reached(ENTRIES)
    missing = {name for name, source in ours.items() if source not in known}
    assert {name for name in missing if not name.startswith(OURS_ASIDE)} == set()


def test_what_a_run_may_import_of_others_is_in_its_fingerprint() -> None:
    _, theirs = reached(ENTRIES)
    packages = importlib.metadata.packages_distributions()
    code = code_version()
    names = {"highspy": "highs", "python-flint": "flint"}
    needed = {package.lower() for module in theirs.difference(ASIDE) for package in packages[module]}
    for package in needed:
        assert code[names.get(package, package)] == importlib.metadata.version(package)


def test_the_starter_of_runs_is_in_their_fingerprint() -> None:
    # It sets the number of threads, though no run imports it.
    assert "experiments/process.py" in source_files()


@pytest.mark.parametrize(
    "package", ["scipy", "networkx", "python-flint", "numba", "numpy", "highspy", "pyscipopt"]
)
def test_another_version_of_a_library_makes_other_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str
) -> None:
    plan = read_plan(plan_file(tmp_path, PLAN))
    (before,) = tasks_of(plan)
    version = importlib.metadata.version
    monkeypatch.setattr(
        importlib.metadata, "version", lambda name: "0.0.0" if name == package else version(name)
    )
    (after,) = tasks_of(plan)
    assert after.fingerprint != before.fingerprint
