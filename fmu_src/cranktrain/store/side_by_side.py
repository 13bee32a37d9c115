"""Tasks on all processors: one pool of worker processes, which ends with its parent."""

from __future__ import annotations

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
"""Seconds between two checks of the workers' reports, and of a worker whether its parent still lives."""

BEFORE_PROCESSES: list[Callable[[], None]] = []
"""Called before processes are started: those that keep a thread end it."""

_reports: Any = None
"""In a worker process: where its progress goes."""


def side_by_side(
    function: Callable[..., Any],
    tasks: Sequence[tuple[Any, ...]],
    workers: int | None = None,
    heard: Callable[..., None] | None = None,
) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Each task, the arguments of ``function``, with its result as soon as that is there; in this process where alone.

    Parameters
    ----------
    function : of a module, so that worker processes find it
    workers : processes; as many as processors where not given, none beside this one for 1
    heard : told what a task says of its progress; ``function`` then takes as last argument the function to tell
    """
    left = list(tasks)
    count = min(workers or processors(), len(left))
    if count > 1:
        try:
            for task, result in _pooled(function, left, count, heard):
                left = [other for other in left if other is not task]
                yield task, result
        except BrokenProcessPool:
            pass  # no processes to be had here (a script without a main guard, no memory): this one does the rest
    for task in left:
        yield task, function(*task, *([heard] if heard else []))


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _pooled(
    function: Callable[..., Any], tasks: Sequence[tuple[Any, ...]], count: int, heard: Callable[..., None] | None
) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Tasks with their results from a pool of ``count`` processes."""
    context = process_context()
    reports = context.SimpleQueue()
    with _pool(count, context, _hear, (reports,)) as pool:
        running = {pool.submit(_work, function, task, heard is not None): task for task in tasks}
        while running:
            finished, _ = wait(running, timeout=LOOK_EVERY, return_when=FIRST_COMPLETED)
            while heard and not reports.empty():
                heard(*reports.get())
            for future in finished:
                yield running.pop(future), future.result()


@contextmanager
def worker_pool(count: int, begin: Callable[..., None], arguments: tuple[Any, ...]) -> Iterator[ProcessPoolExecutor]:
    """Pool of so many processes, each of which calls ``begin`` first; they end with this one, or with the block.

    Tasks that are still running at the end of the block are not waited for.
    """
    with _pool(count, process_context(), begin, arguments) as pool:
        yield pool


def process_context() -> Any:
    """Start method of processes: a fork needs nothing from the caller's script, but a process without threads."""
    for notice in list(BEFORE_PROCESSES):
        notice()
    alone = "fork" in multiprocessing.get_all_start_methods() and threading.active_count() == 1
    return multiprocessing.get_context("fork" if alone else "spawn")


@contextmanager
def _pool(
    count: int, context: Any, begin: Callable[..., None], arguments: tuple[Any, ...]
) -> Iterator[ProcessPoolExecutor]:
    pool = ProcessPoolExecutor(count, context, _begin_work, (os.getpid(), begin, arguments))
    ended = False
    try:
        yield pool
        ended = True
    finally:
        # Running tasks are not waited for: an interruption ends here.
        for process in () if ended else list((pool._processes or {}).values()):
            process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)


def _work(function: Callable[..., Any], task: tuple[Any, ...], tells: bool) -> Any:
    """One task in a worker process."""
    return function(*task, lambda *report: _reports.put(report)) if tells else function(*task)


def _hear(reports: Any) -> None:
    """Set the receiver of a task's progress."""
    global _reports
    _reports = reports


def _begin_work(parent: int, begin: Callable[..., None], arguments: tuple[Any, ...]) -> None:
    """Begin as a pool's process: left to itself it would wait for ever, and a thread a processor would take turns."""
    leave_to_parent(parent)
    threadpool_limits(limits=1, user_api="blas")
    begin(*arguments)


def leave_to_parent(parent: int) -> None:
    """In a child process: leave an interruption to the parent, and end with it, were it killed, or when it says so."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a fork has the parent's, which tells of it

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(LOOK_EVERY)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def cluster(address: str) -> Iterator[tuple[Any, int]]:
    """Client of the Dask cluster whose scheduler is at ``address``, and how many threads its workers have.

    Raises ``InputError`` where there is no Dask, no such cluster, or no worker in it.
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
        with suppress(Exception):  # a lost cluster does not say good-bye
            client.close(timeout=2)
