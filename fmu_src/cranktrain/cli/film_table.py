"""The verb ``cranktrain film-table``: make the film table of one L/D, or say what the kept one is worth."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from cranktrain.core.errors import InputError
from cranktrain.film.table.database import GROOVES, RESOLUTIONS, TableSettings
from cranktrain.store.film_tables import film_table

DESCRIPTION = """\
Table of a rigid plain journal bearing's film: force, moments and damping over eccentricity, direction of squeeze and
tilt (two components), dimensionless, for one L/D and groove; every bearing that shares them reads the same file.
Finished parts are kept: an interrupted build goes on where it stopped.

Error of the interpolation: measured against the solver at the centre of every cell, stored per cell. Forces are
compared over |F|, moments over |F| L/2; the larger of the two counts. max_interpolation_error is the largest of all
cells of both tables; the keys ending in _to_0.95 leave out cells beyond eccentricity 0.95.
"""


def register(verbs: Any) -> None:
    """Add the verb to the command line's ``verbs``."""
    sub = verbs.add_parser(
        "film-table",
        help="Make the film table of bearings with one width-to-diameter ratio; it is kept in the cache.",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    sub.add_argument("--length-ratio", type=float, required=True, metavar="L/D", help="width over diameter, 0.05 to 4")
    sub.add_argument("--groove", default="none", metavar="KIND", help=f"{' or '.join(GROOVES)} (fully round); none")
    sub.add_argument("--no-tilt", action="store_true", help="only the table of the aligned journal")
    sub.add_argument(
        "--tilt-range",
        type=float,
        default=TableSettings.tilt_range,
        metavar="SHARE",
        help=f"share of the possible tilt (default {TableSettings.tilt_range:g})",
    )
    sub.add_argument("--resolution", default="default", metavar="NAME", help=", ".join(RESOLUTIONS))
    sub.add_argument("--rebuild", action="store_true", help="compute even where a stored table exists")
    sub.add_argument("--jobs", type=int, metavar="N", help="processes (default: as many as processors)")
    sub.add_argument("--output", metavar="FILE.h5", help="where the table is kept (default: the cache)")
    sub.add_argument("--json", action="store_true", help="print one JSON object")
    sub.set_defaults(verb=run)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Make or read the table; report its path, size and error."""
    settings = TableSettings(
        options.length_ratio, options.groove, options.resolution, not options.no_tilt, options.tilt_range
    )
    if options.jobs is not None and not 1 <= options.jobs <= 256:
        raise InputError(f"--jobs {options.jobs} is not within 1 to 256 processes")
    start = time.perf_counter()
    try:
        with _bar(f"film table, L/D {settings.length_ratio:g}") as advance:
            table, path, solved = film_table(
                settings, options.output, rebuild=options.rebuild, workers=options.jobs, progress=advance, say=_say
            )
    except KeyboardInterrupt:
        _say("interrupted; finished slabs are kept, the same command goes on with them")
        raise SystemExit(130) from None
    seconds = time.perf_counter() - start
    errors, usual = table.worst(), table.worst(0.95)
    result: dict[str, Any] = {
        "path": str(path),
        "cells": table.cells,
        "max_interpolation_error": max(value for key, value in errors.items() if key.endswith("_max")),
        "seconds": seconds,
        "slabs_solved": solved,
        "file_bytes": path.stat().st_size,
        "length_ratio": settings.length_ratio,
        "groove": settings.groove,
        "tilt": settings.tilt,
        "resolution": settings.resolution,
        **{f"{key}_error": value for key, value in errors.items()},
        **{f"{key}_error_to_0.95": value for key, value in usual.items()},
    }
    if not options.json:
        print(f"{'Solved' if solved else 'Kept'}: {path} ({result['file_bytes'] / 1e6:.1f} MB, {table.cells} cells)")
        print(f"largest interpolation error of all cells: {100.0 * result['max_interpolation_error']:.2g} %")
        for name in ("aligned", "tilted"):
            if f"{name}_max" in usual and math.isfinite(usual[f"{name}_max"]):
                print(
                    f"{name}, to eccentricity 0.95: {100.0 * usual[f'{name}_max']:.2g} % at most, "
                    f"{100.0 * usual[f'{name}_p95']:.2g} % at the 95th percentile"
                )
        print(f"{seconds:.1f} s")
    return result


def _say(text: str) -> None:
    print(f"cranktrain: {text}", file=sys.stderr, flush=True)


@contextmanager
def _bar(title: str) -> Iterator[Callable[[int, int], None] | None]:
    """Show a bar of slabs on stderr; nothing where stderr is no terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        task = progress.add_task(title, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)
