"""Where runs are carried out: on this machine, or on the workers of a dask scheduler."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Any, Protocol

from bcut.errors import ExperimentError
from bcut.experiments.process import Outcome, run_in_process

Tasks = Sequence[tuple[str, Mapping[str, Any]]]


class Pool(AbstractContextManager["Pool"], Protocol):
    """Carries out runs, several at once; leaving the context ends those that are still going on."""

    workers: int

    def carry_out(self, tasks: Tasks) -> Iterator[tuple[str, Outcome]]:
        """Yield the fingerprint and the outcome of each run as it ends."""
        ...


class LocalPool(AbstractContextManager["LocalPool"]):
    """Threads of this process, each of which waits for the process of one run.

    Parameters
    ----------
    workers : int
        Runs at once.
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._stopped = threading.Event()
        self._threads = ThreadPoolExecutor(workers, thread_name_prefix="bcut-run")

    def carry_out(self, tasks: Tasks) -> Iterator[tuple[str, Outcome]]:
        """Yield the fingerprint and the outcome of each run as it ends."""
        waiting: dict[Future[Outcome], str] = {
            self._threads.submit(run_in_process, data, self._stopped.is_set): fingerprint
            for fingerprint, data in tasks
        }
        while waiting:
            # In short steps, so that Ctrl-C is heard on every system.
            done, _ = wait(waiting, timeout=0.5, return_when=FIRST_COMPLETED)
            for future in done:
                fingerprint = waiting.pop(future)
                # What went wrong around the process of one run is no matter of the others.
                try:
                    outcome = future.result()
                except Exception as error:
                    outcome = Outcome.of_exception(error)
                yield fingerprint, outcome

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stopped.set()
        self._threads.shutdown(wait=True, cancel_futures=True)


def make_pool(scheduler: str | None, workers: int) -> Pool:
    """Return the pool that a user asked for.

    Parameters
    ----------
    scheduler : str, optional
        Address of a running dask scheduler, such as "tcp://10.0.0.1:8786". Without it the runs stay on this
        machine: in a dask cluster of its own where dask.distributed is installed, else in plain threads. Either
        way each run is a process.
    workers : int
        Runs at once on this machine.

    Raises
    ------
    ExperimentError
        There is no scheduler at the address, or dask.distributed is not installed.
    """
    try:
        from bcut.experiments.cluster import DaskPool
    except ImportError:
        if scheduler is not None:
            raise ExperimentError(
                "--scheduler needs dask.distributed; install it by pip install 'bcut[experiments]'"
            ) from None
        return LocalPool(workers)
    return DaskPool(scheduler, workers)
