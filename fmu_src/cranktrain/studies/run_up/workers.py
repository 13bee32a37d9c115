"""Workers for the speeds of a run-up: this process, other processes, or the workers of a Dask cluster."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, Protocol

from cranktrain.core.errors import InputError, SolverError
from cranktrain.store.side_by_side import cluster, worker_pool
from cranktrain.studies.run_up.steady import CycleStart, Job, SteadyRuns, SteadySpeed

PATIENCE = 5.0
"""Time, s, for which a cluster may have no workers (while one is replaced) before the run-up ends."""
_here = threading.local()
"""Data of a worker's thread: the model of its last job."""


class Workers(Protocol):
    """Runs speeds of a run-up; ``apart`` is true if they run in other processes, so that ``submit`` returns at once."""

    count: int
    apart: bool

    def submit(self, speed: float, near: Sequence[CycleStart]) -> Future[SteadySpeed]:
        """Start the run of a speed, rad/s, from motions of neighbouring speeds ``near``."""

    def check(self) -> None:
        """Raise ``SolverError`` if running tasks cannot end any more."""


class _Here(Executor):
    """Runs each speed immediately in this process."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments, **named))
        except (InputError, SolverError) as error:
            future.set_exception(error)
        return future


class _Pool:
    """Workers of an executor; ``job`` is passed to each task, or is None if the workers have it already."""

    def __init__(self, executor: Any, count: int, job: Any, check: Callable[[], None] = lambda: None) -> None:
        self.count, self.check, self.apart = count, check, not isinstance(executor, _Here)
        self._executor, self._job = executor, job

    def submit(self, speed: float, near: Sequence[CycleStart]) -> Future[SteadySpeed]:
        found: Future[SteadySpeed] = self._executor.submit(_run_speed, self._job, speed, list(near))
        return found


@contextmanager
def local_workers(job: Job, count: int) -> Iterator[Workers]:
    """Workers in ``count`` processes, or in this process for 1. Raises ``SolverError`` if a process dies."""
    _begin(job)  # made before the fork, so that workers inherit the model and its machine code
    if count == 1:
        yield _Pool(_Here(), 1, None)
        return
    try:
        with worker_pool(count, _begin, (job,)) as pool:
            yield _Pool(pool, count, None)
    except BrokenProcessPool:
        raise SolverError("a worker process ended, killed or out of memory; use fewer --workers") from None


@contextmanager
def cluster_workers(job: Job, address: str) -> Iterator[Workers]:
    """Workers of the Dask cluster whose scheduler is at ``address``.

    A task of a worker that is lost runs on another. Raises ``InputError`` if the cluster or Dask is missing,
    ``SolverError`` if the cluster has lost its workers.
    """
    alone_since: float | None = None

    def check() -> None:
        nonlocal alone_since
        if client.status == "running" and client.scheduler_info(n_workers=-1)["workers"]:
            alone_since = None
        elif alone_since is None:
            alone_since = time.monotonic()
        elif time.monotonic() - alone_since > PATIENCE:
            raise SolverError(f"the cluster at {address} has no workers left")

    with cluster(address) as (client, count):
        from distributed.scheduler import KilledWorker

        try:
            yield _Pool(client.get_executor(pure=False), count, client.scatter(job, broadcast=True, hash=False), check)
        except KilledWorker:
            raise SolverError(f"the cluster at {address} lost several workers over one speed, see their logs") from None
        except CancelledError:
            raise SolverError(f"the cluster at {address} has no workers left that know the engine") from None


def runs_here(job: Job) -> SteadyRuns:
    """Model of a job in this process, made if it does not exist yet."""
    _begin(job)
    runs: SteadyRuns = _here.runs
    return runs


def _begin(job: Job) -> None:
    """Make the model of a job, unless it exists."""
    if getattr(_here, "job", None) is not job:
        _here.job, _here.runs = job, SteadyRuns(job)


def _run_speed(job: Job | None, speed: float, near: Sequence[CycleStart]) -> SteadySpeed:
    """Run one speed with the model of this worker's thread."""
    if job is not None:
        _begin(job)
    runs: SteadyRuns = _here.runs
    return runs.at(speed, near)
