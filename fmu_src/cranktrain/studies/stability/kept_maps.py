"""Maps computed once and kept: an interrupted run goes on with those that are missing.

A kept map belongs to the code that made it: its digest covers all that its module imports, and the shipped engines.
"""

from __future__ import annotations

import inspect
import json
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from hashlib import sha256
from pathlib import Path
from typing import Any

from cranktrain.core.cache import cache_folder
from cranktrain.core.errors import StoreError
from cranktrain.core.sources import source_digest
from cranktrain.engine.file import engine_folder
from cranktrain.studies.stability import MAPS
from cranktrain.studies.stability.stability_map import StabilityMap, as_record, from_record

SCHEMA = 1
UNDER_WAY = 0.999
"""Share of a map at most that its own progress may report; it is done when it is kept."""
LOOK_EVERY = 0.5
"""s between looks at what the processes report."""


def maps(
    names: Sequence[str],
    quick: bool,
    *,
    rebuild: bool = False,
    workers: int | None = None,
    progress: Callable[[str, str, float], None] | None = None,
) -> Iterator[tuple[StabilityMap, float]]:
    """Each map by name, read where it is kept, else computed and kept, with the seconds it took (0: read).

    Parameters
    ----------
    names : keys of ``MAPS``
    quick : coarse maps
    rebuild : compute even those that are kept
    workers : processes; as many as processors where not given, none beside this one for 1
    progress : told the map, its stage and the share of it that is done

    Raises
    ------
    StoreError
        a cache that cannot be written
    """
    missing = []
    # Of the sources that the maps are computed from, should these change meanwhile.
    paths = {name: _path(name, quick) for name in names}
    for name in names:
        found = None if rebuild else _read(name, paths[name])
        if found is None:
            missing.append(name)
        else:
            yield found, 0.0
    for name, seconds, record in _computed(missing, quick, workers or _processors(), progress or _nobody):
        _keep(paths[name], record)
        yield from_record(name, record), seconds


def map_digest(name: str) -> str:
    """Digest of all that a map can depend on: the sources that its computation rests on, and the shipped engines."""
    own = Path(__file__).with_name(f"{name}.py")
    file = own if own.is_file() else Path(inspect.getfile(MAPS[name]))
    digest = sha256(f"{SCHEMA} {source_digest(file, deferred=True)}".encode())
    for path in sorted(engine_folder().glob("*.toml")):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def _path(name: str, quick: bool) -> Path:
    return cache_folder() / "stability" / f"{name}-{'quick' if quick else 'full'}-{map_digest(name)}.json"


def _read(name: str, path: Path) -> StabilityMap | None:
    try:
        return from_record(name, json.loads(path.read_text()))
    except (OSError, KeyError, TypeError, ValueError):
        return None  # not there, or not whole: computed anew


def _keep(path: Path, record: dict[str, Any]) -> None:
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_text(json.dumps(record))
        os.replace(temporary, path)
    except OSError as error:
        raise StoreError(f"{path}: the map cannot be kept ({error.strerror}); set CRANKTRAIN_CACHE") from None


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _nobody(name: str, stage: str, share: float) -> None:
    """Nobody follows."""


def _compute(name: str, quick: bool, tell: Callable[[str, str, float], None]) -> tuple[float, dict[str, Any]]:
    start = time.perf_counter()
    record = as_record(MAPS[name](quick, lambda stage, share: tell(name, stage, min(share, UNDER_WAY))))
    return time.perf_counter() - start, record


def _computed(
    names: list[str], quick: bool, workers: int, tell: Callable[[str, str, float], None]
) -> Iterator[tuple[str, float, dict[str, Any]]]:
    done = set()
    if workers > 1 and len(names) > 1:
        try:
            for name, seconds, record in _side_by_side(names, quick, workers, tell):
                done.add(name)
                yield name, seconds, record
        except BrokenProcessPool:
            pass  # no processes to be had here: this one does the rest
    for name in names:
        if name not in done:
            yield (name, *_compute(name, quick, tell))


_reports: Any = None
"""In a worker process: where its progress goes."""


def _side_by_side(
    names: list[str], quick: bool, workers: int, tell: Callable[[str, str, float], None]
) -> Iterator[tuple[str, float, dict[str, Any]]]:
    context = multiprocessing.get_context("spawn")
    reports = context.Queue()
    pool = ProcessPoolExecutor(
        min(workers, len(names)), mp_context=context, initializer=_begin_work, initargs=(os.getpid(), reports)
    )
    try:
        running = {pool.submit(_work, name, quick): name for name in names}
        while running:
            finished, _ = wait(running, timeout=LOOK_EVERY, return_when=FIRST_COMPLETED)
            while not reports.empty():
                tell(*reports.get())
            for future in finished:
                yield (running.pop(future), *future.result())
    finally:
        # What is under way is not waited for: an interruption ends here.
        for process in list((pool._processes or {}).values()):
            process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)


def _work(name: str, quick: bool) -> tuple[float, dict[str, Any]]:
    return _compute(name, quick, lambda *report: _reports.put(report))


def _begin_work(parent: int, reports: Any) -> None:
    """Leave an interruption to the parent; end with it, were it killed."""
    global _reports
    _reports = reports
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(LOOK_EVERY)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
