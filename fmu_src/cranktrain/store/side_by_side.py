"""Parallel tasks on all processors, in a pool of worker processes that ends with its parent."""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from typing import Any

from threadpoolctl import threadpool_limits

from cranktrain.core.errors import InputError

LOOK_EVERY = 0.5
"""Seconds between two checks of the workers' reports, and between a worker's checks that its parent lives."""

BEFORE_PROCESSES: list[Callable[[], None]] = []
"""Functions called before worker processes are started; they end threads, with which a fork would be unsafe."""

_reports: Any = None
"""Queue for progress reports, set in worker processes."""


def side_by_side(
    function: Callable[..., Any],
    tasks: Sequence[tuple[Any, ...]],
    workers: int | None = None,
    heard: Callable[..., None] | None = None,
) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Yield each task (arguments of ``function``) with its result when it is finished; one worker means this process.

    Parameters
    ----------
    function : function of a module, so that worker processes can import it
    workers : number of processes; as many as processors if not given, only this process for 1
    heard : called with the progress reports of tasks; ``function`` then takes a reporting function as last argument
    """
    left = list(tasks)
    count = min(workers or processors(), len(left))
    if count > 1:
        try:
            for task, result in _pooled(function, left, count, heard):
                left = [other for other in left if other is not task]
                yield task, result
        except BrokenProcessPool:
            pass  # if no processes can be started (script without main guard, no memory), this process does the rest
    for task in left:
        yield task, function(*task, *([heard] if heard else []))


def processors() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _pooled(
    function: Callable[..., Any], tasks: Sequence[tuple[Any, ...]], count: int, heard: Callable[..., None] | None
) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Yield tasks with their results from a pool of ``count`` processes."""
    context = process_context()
    reports = context.SimpleQueue()
    with worker_pool(count, _hear, (reports,), context) as pool:
        running = {pool.submit(_work, function, task, heard is not None): task for task in tasks}
        while running:
            finished, _ = wait(running, timeout=LOOK_EVERY, return_when=FIRST_COMPLETED)
            while heard and not reports.empty():
                heard(*reports.get())
            for future in finished:
                yield running.pop(future), future.result()


def process_context() -> Any:
    """Start method of worker processes: fork (needs no main guard) if this process has no other threads, else spawn."""
    for notice in list(BEFORE_PROCESSES):
        notice()
    alone = "fork" in multiprocessing.get_all_start_methods() and threading.active_count() == 1
    return multiprocessing.get_context("fork" if alone else "spawn")


@contextmanager
def worker_pool(
    count: int, begin: Callable[..., None], arguments: tuple[Any, ...], context: Any = None
) -> Iterator[ProcessPoolExecutor]:
    """Pool of ``count`` processes that each call ``begin`` first; they end with this process or with the block.

    Tasks that still run at the end of the block are not awaited. ``context`` is that of :func:`process_context` if the
    caller has one already.
    """
    context = context or process_context()
    pool = ProcessPoolExecutor(count, context, _begin_work, (os.getpid(), begin, arguments))
    ended = False
    try:
        yield pool
        ended = True
    finally:
        # An interruption takes effect at once, because running tasks are not awaited.
        for process in () if ended else list((pool._processes or {}).values()):
            process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)


def _work(function: Callable[..., Any], task: tuple[Any, ...], tells: bool) -> Any:
    """Run one task in a worker process."""
    return function(*task, lambda *report: _reports.put(report)) if tells else function(*task)


def _hear(reports: Any) -> None:
    """Set the queue to which tasks of this worker process send progress reports."""
    global _reports
    _reports = reports


def _begin_work(parent: int, begin: Callable[..., None], arguments: tuple[Any, ...]) -> None:
    """Prepare a process of a pool: it ends with its parent, and uses one thread since the pool uses all processors."""
    leave_to_parent(parent)
    threadpool_limits(limits=1, user_api="blas")
    begin(*arguments)


def leave_to_parent(parent: int) -> None:
    """Prepare a child process: interruptions are left to the parent, and the child ends with it or on termination."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a forked process inherits the parent's handler, which prints

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(LOOK_EVERY)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def cluster(address: str) -> Iterator[tuple[Any, int]]:
    """Client of the Dask cluster with its scheduler at ``address``, and the number of threads of its workers.

    Raises ``InputError`` if Dask is not installed, no such cluster answers, or it has no worker.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler needs Dask; pip install distributed, or cranktrain[dask]") from None
    try:
        client = Client(address, timeout=5, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = str(error).partition("\n")[0] or type(error).__name__
        raise InputError(
            f"--scheduler {address}: no Dask scheduler answers ({reason}); start one by 'dask scheduler'"
        ) from None
    try:
        count = sum(client.nthreads().values())
        if count == 0:
            raise InputError(
                f"--scheduler {address}: the cluster has no workers; start some by 'dask worker {address}'"
            )
        yield client, count
    finally:
        with suppress(Exception):  # a lost cluster cannot be closed properly
            client.close(timeout=2)
