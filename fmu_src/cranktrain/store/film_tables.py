"""Film tables in the cache: read where one is kept, else built slab by slab on all processors, resumably.

A table depends on nothing but its settings, so every bearing with the same L/D, groove and tilt range reads the same
file. While one is built, finished slabs are kept in a part file beside it; a build that was interrupted goes on from
there, and ends with the same numbers to the last bit, because slabs know nothing of each other.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import Any

from cranktrain.core.cache import cache_folder
from cranktrain.core.errors import StoreError
from cranktrain.core.reduced_body import Array
from cranktrain.film.table.database import (
    SCHEMA,
    FilmTable,
    TableSettings,
    assemble,
    compile_sampling,
    sample_slab,
    slab_names,
)
from cranktrain.film.table.interpolation import TableArrays
from cranktrain.store.hdf5 import read_film_table, write_film_table

KEEP_EVERY = 2.0
"""Seconds between two copies of the part file: the most that a killed build loses."""
WATCH_EVERY = 1.0
"""Seconds between two looks of a worker at whether its parent still lives."""


def table_path(settings: TableSettings) -> Path:
    """Where the table of ``settings`` is kept."""
    kind = "tilt" if settings.tilt else "aligned"
    name = f"{settings.length_ratio:g}_{settings.groove}_{kind}_{settings.resolution}_{settings.digest[:12]}.h5"
    return cache_folder() / "films" / f"film_{name}"


def load_film_table(path: str | Path, settings: TableSettings) -> FilmTable:
    """Read a table.

    Raises
    ------
    StoreError
        missing, corrupt, foreign, of another schema, or made for another geometry, groove, tilt range or resolution
    """
    data, _ = read_film_table(path, SCHEMA, settings.digest, _said(settings))
    arrays = TableArrays(data["aligned"], data["tilted"], data["axes"], data["pressure"])
    return FilmTable(settings, arrays, data["aligned_error"], data["tilted_error"])


def save_film_table(path: str | Path, table: FilmTable) -> Path:
    """Write a table; equal content gives equal bytes."""
    datasets = {
        "aligned": (table.arrays.aligned, "1"),
        "tilted": (table.arrays.tilted, "1"),
        "pressure": (table.arrays.pressure, "1"),
        "axes": (table.arrays.axes, "1"),
        "aligned_error": (table.aligned_error, "1"),
        "tilted_error": (table.tilted_error, "1"),
    }
    return write_film_table(path, SCHEMA, table.settings.digest, _said(table.settings), datasets, _attributes(table))


def film_table(
    settings: TableSettings,
    path: str | Path | None = None,
    *,
    rebuild: bool = False,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    say: Callable[[str], None] | None = None,
) -> tuple[FilmTable, Path, int]:
    """Table of ``settings``, read where it is kept, else built.

    Parameters
    ----------
    path : where it is kept; in the cache where not given
    rebuild : build it even so (an interrupted build goes on all the same)
    workers : processes; as many as there are processors where not given, none beside this one for 1
    progress : called with slabs done and slabs in all
    say : told what a user should know (a build resumed, a part file of another table put aside)

    Returns
    -------
    table, its path, and the number of slabs solved now (0: read)

    Raises
    ------
    StoreError
        a file at ``path`` that is not this table, or a place that cannot be written
    SolverError
        a film that did not converge
    """
    target = Path(path) if path is not None else table_path(settings)
    if target.is_file() and not rebuild:
        return load_film_table(target, settings), target, 0
    part = target.with_name(target.name + ".part")
    slabs = _kept(part, settings, say)
    names = slab_names(settings)
    missing = [name for name in names if name not in slabs]
    _keep(part, settings, slabs)  # a place that cannot be written is refused before the work, not after it
    copied = time.monotonic()
    try:
        for name, values in _solve(settings, missing, workers):
            slabs[name] = values
            if progress is not None:
                progress(len(slabs), len(names))
            if time.monotonic() - copied > KEEP_EVERY:
                _keep(part, settings, slabs)
                copied = time.monotonic()
    finally:
        _keep(part, settings, slabs)
    table = assemble(settings, slabs)
    save_film_table(target, table)
    part.unlink(missing_ok=True)
    return table, target, len(missing)


def _said(settings: TableSettings) -> str:
    tilt = f"tilt to {settings.tilt_range:g}" if settings.tilt else "no tilt"
    return f"L/D {settings.length_ratio:g}, groove {settings.groove}, {tilt}, resolution {settings.resolution}"


def _attributes(table: FilmTable) -> dict[str, Any]:
    return {**asdict(table.settings), **{f"error_{name}": value for name, value in table.worst().items()}}


def _keep(part: Path, settings: TableSettings, slabs: dict[str, Array]) -> None:
    datasets = {f"slab/{name}": (slabs[name], "1") for name in sorted(slabs)}
    write_film_table(part, SCHEMA, settings.digest, _said(settings), datasets, asdict(settings), unfinished=True)


def _kept(part: Path, settings: TableSettings, say: Callable[[str], None] | None) -> dict[str, Array]:
    """Slabs of an interrupted build; none, said aloud, where the part file is not of this table."""
    if not part.is_file():
        return {}
    try:
        data, _ = read_film_table(part, SCHEMA, settings.digest, _said(settings), unfinished=True)
    except StoreError as error:
        if say is not None:
            say(f"the unfinished table is not used, all slabs are solved anew ({error})")
        return {}
    wanted = set(slab_names(settings))
    slabs = {name[5:]: values for name, values in data.items() if name[5:] in wanted}
    if slabs and say is not None:
        say(f"goes on with {len(slabs)} of {len(wanted)} slabs from {part}")
    return slabs


def _processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _solve(settings: TableSettings, names: list[str], workers: int | None) -> Iterator[tuple[str, Array]]:
    count = workers or _processors()
    solved = set()
    if count > 1 and len(names) > 1:
        compile_sampling()
        try:
            for name, values in _solve_side_by_side(settings, names, count):
                solved.add(name)
                yield name, values
        except BrokenProcessPool:
            pass  # no processes to be had here (a script without a main guard, no memory): this one does the rest
    for name in names:
        if name not in solved:
            yield name, sample_slab(settings, name)


def _solve_side_by_side(settings: TableSettings, names: list[str], count: int) -> Iterator[tuple[str, Array]]:
    # A fork asks nothing of the caller's script, but only a process without threads can be forked safely.
    alone = "fork" in multiprocessing.get_all_start_methods() and threading.active_count() == 1
    pool = ProcessPoolExecutor(
        count,
        mp_context=multiprocessing.get_context("fork" if alone else "spawn"),
        initializer=_begin_work,
        initargs=(os.getpid(),),
    )
    # The slabs at high eccentricity take longest: they start first.
    waiting = iter(reversed(names))
    try:
        running = {pool.submit(sample_slab, settings, name): name for name in islice(waiting, 2 * count)}
        while running:
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in finished:
                name = running.pop(future)
                values = future.result()
                following = next(waiting, None)
                if following is not None:
                    running[pool.submit(sample_slab, settings, following)] = following
                yield name, values
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _begin_work(parent: int) -> None:
    """Leave an interruption to the parent; end with it, were it killed: a pool's processes would wait for ever."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WATCH_EVERY)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
