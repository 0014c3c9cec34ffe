"""What a run depends on besides its inputs: the sources that it executes, the libraries, and the machine."""

from __future__ import annotations

import hashlib
import importlib
import importlib.metadata
import os
import platform
from pathlib import Path
from typing import Any

import bcut
from bcut.errors import InputError

# Parts of the package that no result depends on; of the experiments, these do the work of a run.
_ASIDE = ("cli", "plotting", "experiments")
_AT_WORK = (
    "__init__.py", "execute.py", "interruption.py", "ledger.py", "measuring.py", "outcome.py", "presets.py",
    "process.py", "recording.py", "scip_names.py", "sizes.py", "versions.py",
)  # fmt: skip
# By the names that records have for them.
_LIBRARIES = {
    "pyscipopt": "pyscipopt",
    "highs": "highspy",
    "numpy": "numpy",
    "scipy": "scipy",
    "networkx": "networkx",
    "flint": "python-flint",
    "numba": "numba",
}


def code_version() -> dict[str, str]:
    """Return what a result depends on besides its inputs: this package's sources, and the libraries that compute.

    The version of SCIP is that of the library itself, which has to be loaded for it: PySCIPOpt may have been built
    with any.
    """
    from bcut.scip.host import scip_version

    libraries = {name: importlib.metadata.version(package) for name, package in _LIBRARIES.items()}
    return {
        "bcut": bcut.__version__,
        "sources": sources_digest(),
        "scip": scip_version(),
        **libraries,
    }


def source_files() -> dict[str, Path]:
    """Return all sources that a run executes, the separators included, by their names within the package."""
    folder = Path(os.path.dirname(bcut.__file__))
    files = {
        path.relative_to(folder).as_posix(): path
        for path in folder.rglob("*.py")
        if path.relative_to(folder).parts[0] not in _ASIDE
    }
    files |= {f"experiments/{name}": folder / "experiments" / name for name in _AT_WORK}
    separators = importlib.import_module("bcut.separators")
    for place in separators.__path__:
        files |= {f"separators/{path.name}": path for path in Path(place).glob("*.py")}
    return files


def sources_digest() -> str:
    """Return the SHA-256 of all sources that a run executes."""
    files = source_files()
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(f"{name}\0".encode() + hashlib.sha256(files[name].read_bytes()).digest())
    return digest.hexdigest()


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file.

    Raises
    ------
    InputError
        It cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None


def machine() -> dict[str, Any]:
    """Describe the machine, without its name."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
    }


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"
