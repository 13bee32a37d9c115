"""The verb ``film-table``: make the film table of one L/D, or say what the kept one is worth."""

from __future__ import annotations

import argparse
import math
import time
from typing import Any

from cranktrain.cli.console import Interrupted, bar, number, of_words, say
from cranktrain.film.contact.gap import SMOOTH, STRAIGHT
from cranktrain.film.table.database import GROOVES, RESOLUTIONS, TableSettings
from cranktrain.film.table.law import SHARE_MARGIN
from cranktrain.store.film_tables import film_table

DESCRIPTION = """\
Make the film table of bearings with one width-to-diameter ratio; it is kept in the cache.

The table holds force, moments and damping of a rigid plain journal bearing, dimensionless, over eccentricity, direction
of squeeze and the two components of tilt. It is for one L/D, groove, relief of the shell's edges and roughness; all
bearings that share these use the same file. A run makes the table of its engine by itself. Finished parts are kept, so
an interrupted build can be continued.

The interpolation error is measured against the solver at the centre of every cell, and stored for each cell. Errors of
forces are relative to |F|, those of moments to |F| L/2; the larger of the two counts. max_interpolation_error is the
largest of all cells of both tables. Keys that end in _to_0.95 leave out the cells beyond eccentricity 0.95 and those
next to the largest tilt, where runs also solve the film.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add, share = parser.add_argument, TableSettings.tilt_range
    add("--length-ratio", type=float, required=True, metavar="L/D", help="width over diameter, 0.05 to 4")
    groove = add("--groove", default="none", metavar="KIND", help=f"{' or '.join(GROOVES)} (fully round); none")
    of_words(groove, GROOVES)
    add("--no-tilt", dest="tilt", action="store_false", help="only the table of the aligned journal")
    add("--tilt-range", type=float, default=share, metavar="SHARE", help=f"over the possible tilt (default {share:g})")
    add("--relief", type=float, nargs=3, default=STRAIGHT, metavar=("DEPTH", "SHARE", "EXPONENT"),
        help="axial profile of the shell, its depth over the clearance (default: straight)")  # fmt: skip
    add("--roughness", type=float, default=SMOOTH, metavar="SIGMA", help="of both surfaces, over the clearance")
    of_words(add("--resolution", default="default", metavar="NAME", help=", ".join(RESOLUTIONS)), RESOLUTIONS)
    add("--rebuild", action="store_true", help="compute even where a stored table exists")
    add("--jobs", type=number(1, 256, "processes", int), metavar="N", help="processes (default: as many as processors)")
    add("--output", metavar="FILE.h5", help="where the table is kept (default: the cache)")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Make or read the table; report its path, size and error."""
    settings = TableSettings(
        options.length_ratio, options.groove, options.resolution, options.tilt, options.tilt_range,
        options.relief[0], options.relief[1], options.relief[2], options.roughness,
    )  # fmt: skip
    start = time.perf_counter()
    try:
        with bar(f"film table, L/D {settings.length_ratio:g}") as advance:
            table, path, solved = film_table(
                settings, options.output, rebuild=options.rebuild, workers=options.jobs,
                progress=lambda done, total: advance(done / total) if advance else None,
                say=lambda text: say(f"cranktrain: {text}"),
            )  # fmt: skip
    except KeyboardInterrupt:
        raise Interrupted("interrupted; finished slabs are kept, repeat the command to continue") from None
    seconds = time.perf_counter() - start
    errors, usual = table.worst(), table.worst(0.95, 1.0 - SHARE_MARGIN)
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
                most, often = (100.0 * usual[f"{name}_{what}"] for what in ("max", "p95"))
                where = f"{name}, to eccentricity 0.95 where the table alone is read"
                print(f"{where}: {most:.2g} % at most, {often:.2g} % at the 95th percentile")
        print(f"{seconds:.1f} s")
    return result
