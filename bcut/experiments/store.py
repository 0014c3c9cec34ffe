"""Where the results of an experiment lie: one file for each run, whole or not at all.

- ``DIR/experiment.json``: the runs that the plan asked for last, with the plan's text;
- ``DIR/runs/FINGERPRINT.json``: the record of a run;
- ``DIR/runs/FINGERPRINT.cuts.jsonl.gz``: its ledger, written first;
- ``DIR/failed/FINGERPRINT.json``: the error of a run that failed, which is tried again the next time.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Container, Iterator, Mapping
from pathlib import Path
from typing import Any

from bcut.errors import ExperimentError, InputError
from bcut.experiments.ledger import SUFFIX
from bcut.files.atomic import replacing, write_text

_MANIFEST = "experiment.json"


class Store:
    """The folder of an experiment.

    Parameters
    ----------
    folder : Path
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.runs, self.failed = folder / "runs", folder / "failed"

    def prepare(self) -> None:
        """Make the folders.

        Raises
        ------
        InputError
            They cannot be made.
        """
        try:
            self.runs.mkdir(parents=True, exist_ok=True)
            self.failed.mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{self.folder}: cannot be made a folder ({error.strerror}); choose another place"
            ) from None

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other processes from running the same experiment while the block runs.

        Raises
        ------
        ExperimentError
            One is at it.
        """
        try:
            import fcntl
        except ImportError:  # not on this system
            yield
            return
        with (self.folder / ".lock").open("a") as stream:
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise ExperimentError(
                    f"{self.folder}: another process is running an experiment here; "
                    "wait for it, or choose another folder"
                ) from None
            yield

    def has(self, fingerprint: str) -> bool:
        """Tell whether a run has been stored."""
        return self._record(fingerprint).exists()

    def save(self, fingerprint: str, record: Mapping[str, Any], ledger: bytes | None) -> None:
        """Store a run. The record comes last: where it is, the run is complete."""
        if ledger is not None:
            with replacing(self.ledger(fingerprint)) as temporary:
                temporary.write_bytes(ledger)
        text = json.dumps({"fingerprint": fingerprint, **record}, indent=1, allow_nan=False)
        write_text(self._record(fingerprint), text + "\n")
        self._error(fingerprint).unlink(missing_ok=True)

    def save_error(self, fingerprint: str, about: Mapping[str, Any], error: Mapping[str, str]) -> None:
        """Store why a run failed."""
        text = json.dumps({"fingerprint": fingerprint, **about, "error": error}, indent=1, allow_nan=False)
        write_text(self._error(fingerprint), text + "\n")

    def forget_errors(self, but: Container[str]) -> None:
        """Remove errors of runs that nobody asks for any more, such as those of an older version."""
        for path in self.failed.glob("*.json"):
            if path.stem not in but:
                path.unlink(missing_ok=True)

    def load(self, fingerprint: str) -> dict[str, Any] | None:
        """Return the record of a run; None if it is not stored."""
        return _read(self._record(fingerprint))

    def load_error(self, fingerprint: str) -> dict[str, Any] | None:
        """Return the error of a run; None if it did not fail."""
        return _read(self._error(fingerprint))

    def ledger(self, fingerprint: str) -> Path:
        """Return where the ledger of a run lies."""
        return self.runs / f"{fingerprint}{SUFFIX}"

    def save_manifest(self, manifest: Mapping[str, Any]) -> None:
        """Store what the plan asked for."""
        write_text(self.folder / _MANIFEST, json.dumps(manifest, indent=1, allow_nan=False) + "\n")

    def load_manifest(self) -> dict[str, Any]:
        """Return what the plan asked for.

        Raises
        ------
        ExperimentError
            There is no experiment in this folder.
        """
        found = _read(self.folder / _MANIFEST)
        if found is None:
            raise ExperimentError(
                f"{self.folder}: holds no experiment; make one by: bcut experiment run PLAN --output {self.folder}"
            )
        return found

    def _record(self, fingerprint: str) -> Path:
        return self.runs / f"{fingerprint}.json"

    def _error(self, fingerprint: str) -> Path:
        return self.failed / f"{fingerprint}.json"


def _read(path: Path) -> dict[str, Any] | None:
    try:
        data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except NotADirectoryError:
        return None
    except (OSError, ValueError) as error:
        raise ExperimentError(
            f"{path}: cannot be read ({error}); remove it, and run the experiment again"
        ) from None
    return data


def default_workers() -> int:
    """Return how many runs this machine carries out side by side."""
    if hasattr(os, "sched_getaffinity"):
        return max(1, len(os.sched_getaffinity(0)))
    return max(1, os.cpu_count() or 1)
