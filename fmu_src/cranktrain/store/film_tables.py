"""Film tables in the cache: read if present, otherwise built slab by slab on all processors and resumed if interrupted.

A table depends only on its settings, so all bearings with the same L/D, groove and tilt range use the same file. During
a build finished slabs are kept in a part file next to the table. An interrupted build continues from there and gives
bit-identical numbers, because slabs are independent of each other.
"""

import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

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
    slab_shape,
    what_is_wrong,
)
from cranktrain.film.table.interpolation import TableArrays
from cranktrain.store.hdf5 import PART, TABLE, read_film_table, write_film_table
from cranktrain.store.side_by_side import side_by_side
from cranktrain.store.whole_file import check_kept, check_place

DATASETS = ("aligned", "tilted", "pressure", "axes", "aligned_error", "tilted_error")
REMEDY = "delete it, or build it anew by 'cranktrain bearing table --anew'"
KEEP_EVERY = 2.0
"""Seconds between two writings of the part file of a film table; a killed build loses at most this much work."""


def table_path(settings: TableSettings) -> Path:
    """Path of the film table for ``settings`` in the cache."""
    kind = "tilt" if settings.tilt else "aligned"
    name = f"{settings.length_ratio:g}_{settings.groove}_{kind}_{settings.resolution}_{settings.digest[:12]}.h5"
    return cache_folder() / "films" / f"film_{name}"


def load_film_table(path: str | Path, settings: TableSettings) -> FilmTable:
    """Read a stored film table.

    Raises ``StoreError`` if it is missing, corrupt, foreign, of another schema, made for another geometry, groove, tilt
    range or resolution, or if arrays have another shape or values that are not finite.
    """
    data, _ = read_film_table(path, SCHEMA, settings.digest, _said(settings))
    if missing := sorted(set(DATASETS) - set(data)):
        raise StoreError(f"{path}: '{missing[0]}' is missing; {REMEDY}")
    arrays = TableArrays(data["aligned"], data["tilted"], data["axes"], data["pressure"])
    table = FilmTable(settings, arrays, data["aligned_error"], data["tilted_error"])
    if wrong := what_is_wrong(table):
        raise StoreError(f"{path}: {wrong}; {REMEDY}")
    return table


def save_film_table(path: str | Path, table: FilmTable, own: bool = False) -> Path:
    """Write a film table; equal content gives equal bytes. With ``own`` (path in the cache) it may replace any file."""
    arrays = {**table.arrays._asdict(), "aligned_error": table.aligned_error, "tilted_error": table.tilted_error}
    datasets = {name: (arrays[name], "1") for name in DATASETS}
    digest, said = table.settings.digest, _said(table.settings)
    kind = None if own else TABLE
    attributes = {**asdict(table.settings), **{f"error_{name}": value for name, value in table.worst().items()}}
    return write_film_table(path, SCHEMA, digest, said, datasets, attributes, kind=kind)


def film_table(
    settings: TableSettings,
    path: str | Path | None = None,
    *,
    rebuild: bool = False,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    say: Callable[[str], None] | None = None,
) -> tuple[FilmTable, Path, int]:
    """Film table for ``settings``, read if it exists, otherwise built.

    Raises ``StoreError`` for a file at ``path`` that is not this table, or a path that cannot be written, and
    ``SolverError`` for a film that did not converge.

    Parameters
    ----------
    path : path of the table; in the cache if not given
    rebuild : build the table even if it exists (an interrupted build is continued all the same)
    workers : number of processes; as many as processors if not given, only this process for 1
    progress : called with the numbers of finished slabs and of all slabs
    say : receives messages for the user (a resumed build, an unusable part file)

    Returns
    -------
    table, its path, and the number of slabs solved in this call (0 if the table was read)
    """
    target = Path(path) if path is not None else table_path(settings)
    if target.is_file() and not rebuild:
        return load_film_table(target, settings), target, 0
    part = target.with_name(target.name + ".part")
    own = path is None
    if own:
        check_kept(target)
    else:
        check_place(target, TABLE)
        check_place(part, PART)
    slabs = _kept(part, settings, say)
    names = slab_names(settings)
    missing = [name for name in names if name not in slabs]
    _keep(part, settings, slabs, own)  # written already here, so that an unwritable path is refused before the work
    copied = time.monotonic()
    try:
        if missing:
            compile_sampling()
        # The slabs at high eccentricity take longest, so they start first.
        tasks = [(settings, name) for name in reversed(missing)]
        for (_, name), values in side_by_side(sample_slab, tasks, workers):
            slabs[name] = values
            if progress is not None:
                progress(len(slabs), len(names))
            if time.monotonic() - copied > KEEP_EVERY:
                _keep(part, settings, slabs, own)
                copied = time.monotonic()
    finally:
        _keep(part, settings, slabs, own)
    table = assemble(settings, slabs)
    save_film_table(target, table, own)
    part.unlink(missing_ok=True)
    return table, target, len(missing)


def _said(settings: TableSettings) -> str:
    """Settings of a table in words, for messages."""
    tilt = f"tilt to {settings.tilt_range:g}" if settings.tilt else "no tilt"
    return f"L/D {settings.length_ratio:g}, groove {settings.groove}, {tilt}, resolution {settings.resolution}"


def _keep(part: Path, settings: TableSettings, slabs: dict[str, Array], own: bool) -> None:
    """Write the finished slabs to the part file; with ``own`` (path in the cache) it may replace any file."""
    datasets = {f"slab/{name}": (slabs[name], "1") for name in sorted(slabs)}
    write_film_table(
        part, SCHEMA, settings.digest, _said(settings), datasets, asdict(settings), unfinished=True,
        kind=None if own else PART,
    )  # fmt: skip


def _kept(part: Path, settings: TableSettings, say: Callable[[str], None] | None) -> dict[str, Array]:
    """Finished slabs of an interrupted build, by name; empty, with a message, if the part file is of another table."""
    if not part.is_file():
        return {}
    try:
        data, _ = read_film_table(part, SCHEMA, settings.digest, _said(settings), unfinished=True)
    except StoreError as error:
        if say is not None:
            say(f"the unfinished table cannot be used, so all slabs are solved again ({error})")
        return {}
    wanted = set(slab_names(settings))
    slabs = {
        name[5:]: values
        for name, values in data.items()
        if name[5:] in wanted and values.shape == slab_shape(settings, name[5:]) and np.isfinite(values).all()
    }
    if slabs and say is not None:
        say(f"continues with {len(slabs)} of {len(wanted)} slabs from {part}")
    return slabs
