"""The verb ``bearing table``: make the film table of one L/D, or report the error of the stored one."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from cranktrain.cli.console import Interrupted, bar, say
from cranktrain.cli.functions import verb_alone
from cranktrain.film.contact.gap import SMOOTH, STRAIGHT
from cranktrain.film.table.database import GROOVES, RESOLUTIONS, TableSettings
from cranktrain.film.table.law import SHARE_MARGIN
from cranktrain.results.views.found import VerbResult
from cranktrain.store import film_tables
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question

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


@dataclass(frozen=True, kw_only=True)
class FilmTable(Question):
    """Question of :func:`film_table`."""

    length_ratio: Annotated[float, Option("L/D", "width over diameter, 0.05 to 4")]
    groove: Annotated[
        Literal["none", "circumferential"],
        Option("KIND", f"{' or '.join(GROOVES)} (fully round); none", words=GROOVES),
    ] = "none"
    tilt: Annotated[bool, Option(help="only the table of the aligned journal")] = True
    tilt_range: Annotated[float, Option("SHARE", "over the possible tilt (default {default})")] = (
        TableSettings.tilt_range
    )
    relief: Annotated[
        Sequence[float],
        Option(
            ("DEPTH", "SHARE", "EXPONENT"),
            "axial profile of the shell, its depth over the clearance (default: straight)",
            count=3,
        ),
    ] = STRAIGHT
    roughness: Annotated[float, Option("SIGMA", "of both surfaces, over the clearance")] = SMOOTH
    resolution: Annotated[
        Literal["coarse", "default", "fine"], Option("NAME", ", ".join(RESOLUTIONS), words=RESOLUTIONS.keys)
    ] = "default"
    anew: Annotated[bool, Option(help="compute even where a stored table exists", was="--rebuild")] = False
    workers: words.Workers | None = None
    output: Annotated[words.File | None, Option("FILE.h5", "where the table is kept (default: the cache)")] = None


@verb_alone(FilmTable, DESCRIPTION)
def film_table(ask: FilmTable) -> VerbResult:
    """Make or read the table; report its path, size and error."""
    settings = TableSettings(
        ask.length_ratio, ask.groove, ask.resolution, ask.tilt, ask.tilt_range,
        ask.relief[0], ask.relief[1], ask.relief[2], ask.roughness,
    )  # fmt: skip
    start = time.perf_counter()
    try:
        with bar(f"film table, L/D {settings.length_ratio:g}") as advance:
            table, path, solved = film_tables.film_table(
                settings, ask.output, rebuild=ask.anew, workers=ask.workers,
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
    return VerbResult.of(result, "bearing table", usual=usual)


def show(result: VerbResult) -> None:
    """Print path, size and interpolation error of the table."""
    usual = result.beside["usual"]
    kept = "Solved" if result["slabs_solved"] else "Kept"
    print(f"{kept}: {result['path']} ({result['file_bytes'] / 1e6:.1f} MB, {result['cells']} cells)")
    print(f"largest interpolation error of all cells: {100.0 * result['max_interpolation_error']:.2g} %")
    for name in ("aligned", "tilted"):
        if f"{name}_max" in usual and math.isfinite(usual[f"{name}_max"]):
            most, often = (100.0 * usual[f"{name}_{what}"] for what in ("max", "p95"))
            where = f"{name}, to eccentricity 0.95 where the table alone is read"
            print(f"{where}: {most:.2g} % at most, {often:.2g} % at the 95th percentile")
    print(f"{result['seconds']:.1f} s")
