"""Film tables in the cache: read if present, otherwise built slab by slab on all processors and resumed if interrupted.

A table depends only on its settings, so all bearings with the same L/D, groove and tilt range use the same file. During
a build finished slabs are kept in a part file next to the table. An interrupted build continues from there and gives
bit-identical numbers, because slabs are independent of each other.
"""

import time
from collections.abc import Callable, Mapping
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
from cranktrain.store.hdf5 import PART, PART_FORMAT, TABLE, TABLE_FORMAT, opened, read_data, write_data
from cranktrain.store.side_by_side import side_by_side
from cranktrain.store.whole_file import Kind, check_kept, check_place

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
    data = _read(path, settings, TABLE_FORMAT)
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
    errors = {f"error_{name}": value for name, value in table.worst().items()}
    kind = None if own else TABLE
    return _write(path, table.settings, TABLE_FORMAT, {name: arrays[name] for name in DATASETS}, kind, errors)


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


def _write(
    path: str | Path,
    settings: TableSettings,
    mark: str,
    arrays: Mapping[str, Array],
    kind: Kind | None,
    errors: Mapping[str, float] | None = None,
) -> Path:
    """Write the arrays of a table, or of its finished slabs; ``kind`` of file to replace, None: any, in the cache."""
    header = {"format": mark, "schema": SCHEMA, "digest": settings.digest, "made_for": _said(settings)}
    datasets = {name: (array, "1") for name, array in arrays.items()}
    return write_data(path, header, "table", datasets, {**asdict(settings), **(errors or {})}, kind)


def _read(path: str | Path, settings: TableSettings, mark: str) -> dict[str, Array]:
    """Arrays of a table, or of its finished slabs; ``StoreError`` if the file is not of these settings, or unusable."""
    with opened(path, mark, SCHEMA, REMEDY) as file:
        if str(file.attrs["digest"]) != settings.digest:
            made_for, wanted = str(file.attrs["made_for"]), _said(settings)
            differs = f"made for {made_for}" if made_for != wanted else "made by another version"
            raise StoreError(f"{path}: {differs}, wanted {wanted}; {REMEDY}")
        datasets, _ = read_data(file, "table", may_be_empty=mark == PART_FORMAT)
    return {name: array for name, (array, _) in datasets.items()}


def _keep(part: Path, settings: TableSettings, slabs: dict[str, Array], own: bool) -> None:
    """Write the finished slabs to the part file; with ``own`` (path in the cache) it may replace any file."""
    arrays = {f"slab/{name}": slabs[name] for name in sorted(slabs)}
    _write(part, settings, PART_FORMAT, arrays, None if own else PART)


def _kept(part: Path, settings: TableSettings, say: Callable[[str], None] | None) -> dict[str, Array]:
    """Finished slabs of an interrupted build, by name; empty, with a message, if the part file is of another table."""
    if not part.is_file():
        return {}
    try:
        data = _read(part, settings, PART_FORMAT)
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
