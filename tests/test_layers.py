"""What the import linter cannot see: packages that live outside `bcut/`, and what is installed."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SEPARATORS = sorted((ROOT / "separators").glob("*.py"))

# What a separator may import: the seam, the geometry, algorithms on graphs, and small linear programs.
ALLOWED = (
    "bcut.separation.seam",
    "bcut.separation.graphs",
    "bcut.separation.small_lp",
    "bcut.geometry",
    "bcut.separators",
)
# A solver is none of its business.
FORBIDDEN = {"pyscipopt", "highspy"}


def imported(file: Path) -> set[str]:
    modules: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{file.name}: a relative import"
            modules.add(str(node.module))
    return modules


@pytest.mark.parametrize("file", SEPARATORS, ids=lambda file: file.stem)
def test_a_built_in_separator_imports_the_seam_and_the_geometry_only(file: Path) -> None:
    modules = imported(file)
    assert not {module.partition(".")[0] for module in modules} & FORBIDDEN
    own = {module for module in modules if module.partition(".")[0] == "bcut"}
    assert {module for module in own if not module.startswith(ALLOWED)} == set()


def test_every_package_is_installed() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    found = {".".join(file.parent.relative_to(ROOT).parts) for file in (ROOT / "bcut").rglob("__init__.py")}
    mapped = settings["package-dir"]
    assert set(settings["packages"]) == found | set(mapped)
    assert all((ROOT / folder / "__init__.py").exists() for folder in mapped.values())


def test_the_version_is_told_once() -> None:
    import bcut

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["version"] == bcut.__version__
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [{bcut.__version__}]" in changes
