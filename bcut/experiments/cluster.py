"""Runs on the workers of a dask scheduler: an existing one, or one of our own within this process."""

from __future__ import annotations

import contextlib
import logging
import uuid
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Any

from distributed import Client, KilledWorker, LocalCluster, as_completed

from bcut.errors import ExperimentError
from bcut.experiments.pools import Tasks
from bcut.experiments.process import Outcome, run_in_process

_CONNECT_SECONDS = 20
_LOGGER = "distributed"

# On a worker: experiments whose runs are to be ended.
_STOPPED: set[str] = set()


def carry_out_on_worker(task: Mapping[str, Any], experiment: str) -> Outcome:
    """Carry out a run on this worker, as a process, until its experiment is stopped."""
    return run_in_process(task, lambda: experiment in _STOPPED)


def stop_on_worker(experiment: str) -> None:
    """End the runs of an experiment on this worker."""
    _STOPPED.add(experiment)


class DaskPool(AbstractContextManager["DaskPool"]):
    """A dask scheduler with its workers; it hands the runs of a lost worker to another one.

    Only this process stores results, so no run can be stored twice.

    Parameters
    ----------
    address : str, optional
        Of an existing scheduler.
    workers : int
        Runs at once in a cluster of our own.

    Raises
    ------
    ExperimentError
        No scheduler answers.
    """

    def __init__(self, address: str | None, workers: int) -> None:
        self.workers = workers
        self._cluster: Any = None
        self._experiment = uuid.uuid4().hex
        # What workers that come and go make dask say would drown the progress bar.
        logging.getLogger(_LOGGER).setLevel(logging.ERROR)
        if address is None:
            self._cluster = LocalCluster(
                n_workers=1,
                threads_per_worker=workers,
                processes=False,
                # No dashboard; what is left of its server takes any free port of this machine alone.
                dashboard_address="127.0.0.1:0",
                scheduler_kwargs={"dashboard": False},
                memory_limit=0,
                silence_logs=logging.ERROR,
            )
            self._client = Client(self._cluster)
            return
        try:
            self._client = Client(address, timeout=_CONNECT_SECONDS)
        except (OSError, TimeoutError, ValueError) as error:
            raise ExperimentError(
                f"no dask scheduler answers at {address} ({str(error).splitlines()[0]}); start one by: dask scheduler"
            ) from None
        self.workers = max(1, sum(self._client.nthreads().values()))

    def carry_out(self, tasks: Tasks) -> Iterator[tuple[str, Outcome]]:
        """Yield the fingerprint and the outcome of each run as it ends."""
        names = {}
        for fingerprint, data in tasks:
            future = self._client.submit(
                carry_out_on_worker,
                data,
                self._experiment,
                key=f"bcut-{self._experiment}-{fingerprint}",
                pure=False,
            )
            names[future] = fingerprint
        for future in as_completed(list(names)):
            if future.status == "finished":
                yield names[future], future.result()
            elif future.status == "error":
                error = future.exception()
                lost = isinstance(error, KilledWorker)
                message = f"the run was lost with its workers: {error}" if lost else ""
                yield names[future], Outcome.of_exception(error, message)
            else:
                raise ExperimentError(
                    "the connection to the scheduler was lost; what had ended is stored, start the experiment again"
                )
            # Its memory on the cluster is free now.
            future.release()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is not None:
            # Runs on workers do not end by themselves when their result is not wanted any more.
            with contextlib.suppress(Exception):
                self._client.run(stop_on_worker, self._experiment)
        with contextlib.suppress(Exception):
            self._client.close()
        if self._cluster is not None:
            self._cluster.close()
