"""The verb ``run-in``: the relief that an engine's shells wear, as a limit or over time."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cranktrain.cli.console import Interrupted, labelled_bar, number, positive, say, show_rows
from cranktrain.core.errors import InputError, SolverError
from cranktrain.engine.file import load_engine

DESCRIPTION = """\
Axial profile that the shells of the main bearings wear to at the lowest speed of full load.

Straight shells are run at level reynolds. Wherever the least gap over a cycle and all mains stays below half the
roughness, the shell is worn away; this is repeated. The relief of an engine file is fitted to the worn shape, and a new
engine file is written.

relief_depth_um     depth at the edge
relief_share        width of the relief, as a share of each half width
relief_exponent     exponent of the rise
fit_error_um        RMS difference of fitted and worn shape (zeta, worn_um)
least_gap_um        least gap of each pass, negative where an edge lies in the shell

With --hours or --schedule the shells wear over time, each main by its own contact: Archard's wear of the asperities'
pressure and the sliding speed over a cycle, on maps over circumference and width, while the roughness runs in. Wear
ends where the gap reaches half the roughness of new surfaces (--end-gap): the shape goes to that of the passes above.
A schedule is a text table with the columns hours, speed_rpm and load (fraction of the full-load burn); it is repeated
until --hours. The history is kept in --output after each increment, and the same command, with the same or more hours,
goes on where it ends. Only the product of --wear-coefficient and time counts: calibrate it by a measured depth.

mains, depth_um, roughness_um, volume_mm3, contact_work_j     of each main at the end
contact_share, friction_power_w, contact_pressure_mpa, least_gap_um     of each main at the start and at the end
settled             whether wear has ended
"""
OVER_TIME = (
    "output", "table", "plots", "wear_coefficient", "end_gap", "run_in_roughness", "run_in_depth", "increment",
    "alike", "start",
)  # fmt: skip
"""Options of wear over time alone."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    from cranktrain.film.contact.wear import COEFFICIENT, END_GAP, RUN_IN_DEPTH, RUN_IN_ROUGHNESS
    from cranktrain_lab.wear.history import INCREMENT
    from cranktrain_lab.wear.run_in import CYCLES, PASSES

    add = parser.add_argument
    add("engine", metavar="ENGINE", help="name of a shipped engine or path of a .toml file")
    add("--out", metavar="FILE", help="engine file to write; an existing file is not overwritten")
    add("--speed", dest="speed_rpm", type=number(1.0, 20_000.0, "rev/min"), metavar="N",
        help="rev/min (default: lowest at full load)")  # fmt: skip
    add("--crank", default="solid", metavar="LEVEL", help="solid (default) or beam")
    add("--passes", type=number(1, 100, "", int), metavar="N", help=f"wear passes (default {PASSES})")
    add(
        "--cycles", type=number(1, 100, "", int), metavar="N",
        help=f"cycles a pass (default {CYCLES}) or an increment (default 2), of which the last is read",
    )  # fmt: skip
    add = parser.add_argument_group("wear over time").add_argument
    add("--hours", type=positive, metavar="H", help="hours of running")
    add("--schedule", metavar="FILE", help="table of hours, speed_rpm, load")
    add("--output", metavar="FILE.h5", help="history, which is kept and continued (default ENGINE_wear.h5)")
    add("--table", metavar="FILE.csv", help="table of the history to write")
    add("--plots", metavar="DIR", help="folder for pictures of profiles and of the history")
    add(
        "--wear-coefficient",
        type=positive,
        metavar="K",
        help=f"Archard's k (default {COEFFICIENT:g}, to be calibrated)",
    )
    add("--end-gap", type=float, metavar="X", help=f"gap over roughness at which wear ends; inf: never ({END_GAP:g})")
    add(
        "--run-in-roughness",
        type=positive,
        metavar="X",
        help=f"run-in over new roughness (default {RUN_IN_ROUGHNESS:g})",
    )
    add("--run-in-depth", type=positive, metavar="X", help=f"wear that smooths, over the roughness ({RUN_IN_DEPTH:g})")
    add(
        "--increment",
        type=positive,
        metavar="X",
        help=f"wear of an increment over the roughness (default {INCREMENT:g})",
    )
    add("--alike", action="store_true", default=None, help="all shells have the deepest profile, as one ordered set")
    add(
        "--start",
        choices=("straight", "engine"),
        help="new shells: straight (default) or with the engine file's relief",
    )


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Wear, write the engine file, and print the figures unless JSON is wanted."""
    if options.hours is not None or options.schedule is not None:
        return _over_time(options)
    given = [name for name in OVER_TIME if getattr(options, name) is not None]
    if given:
        raise InputError(f"--{given[0].replace('_', '-')} is of wear over time; give --hours or --schedule as well")
    from cranktrain_lab.wear.run_in import CYCLES, PASSES, run_in

    with labelled_bar("run-in") as (tell, follow):
        found = run_in(
            options.engine, options.out, speed_rpm=options.speed_rpm, crank=options.crank,
            passes=options.passes or PASSES, cycles=options.cycles or CYCLES, say=tell, follow=follow,
        )  # fmt: skip
    if not options.json:
        print(
            f"{found['engine']}, {found['speed_rpm']:g} rev/min: relief {found['relief_depth_um']:.2f} um over "
            f"{found['relief_share']:.2f} of each half width, exponent {found['relief_exponent']:.2f} "
            f"(fitted within {found['fit_error_um']:.2f} um)"
        )
        print("Least gap by pass: " + ", ".join(f"{gap:.2f}" for gap in found["least_gap_um"]) + " um")
        if found["file"]:
            say(f"{found['file']} written")
    return found


def _over_time(options: argparse.Namespace) -> dict[str, Any]:
    """Wear over time."""
    from cranktrain.film.contact.wear import WearLaw
    from cranktrain.results.figures import check_folder
    from cranktrain.store.whole_file import check_place
    from cranktrain_lab.wear.history import Choices
    from cranktrain_lab.wear.pictures import PICTURES, save_wear_pictures
    from cranktrain_lab.wear.records import TABLE
    from cranktrain_lab.wear.result import run_in_over_time

    if options.passes is not None:
        raise InputError("--passes does not go with --hours or --schedule; leave it out")
    law = {"coefficient": options.wear_coefficient, "end_gap": options.end_gap,
           "run_in_roughness": options.run_in_roughness, "run_in_depth": options.run_in_depth}  # fmt: skip
    chosen = {"increment": options.increment, "alike": options.alike, "cycles": options.cycles}
    choices = Choices(
        law=WearLaw(**{name: value for name, value in law.items() if value is not None}),
        crank=options.crank, straight=options.start != "engine",
        **{name: value for name, value in chosen.items() if value is not None},
    )  # fmt: skip
    output = options.output or f"{load_engine(options.engine).name}_wear.h5"
    if options.table:
        check_place(options.table, TABLE)
    if options.plots:
        check_folder(Path(options.plots), "--plots", PICTURES)
    kept = f"{output} keeps the increments that were finished; run the same command again to go on from there"
    try:
        with labelled_bar("run-in") as (tell, follow):
            history, found = run_in_over_time(
                options.engine, options.hours, options.schedule, speed_rpm=options.speed_rpm, choices=choices,
                output=output, out=options.out, say=tell, follow=follow,
            )  # fmt: skip
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted; {kept}") from None
    except SolverError as error:
        raise SolverError(f"{error}; {kept}") from None
    written = [output]
    if options.table:
        written.append(str(history.write_table(options.table)))
    if options.plots:
        title = f"{found['engine']}, {found['hours']:.4g} h"
        written += map(str, save_wear_pictures(Path(options.plots), history, title))
    if not options.json:
        _show(found)
        for name in [*written, *([found["file"]] if found["file"] else [])]:
            say(f"{name} written")
    return found


def _show(found: dict[str, Any]) -> None:
    """Print the figures of a history."""
    columns = (
        "main",
        "depth / um",
        "roughness / um",
        "volume / mm3",
        "load in contact / %",
        "friction / W",
        "least gap / um",
    )
    rows = []
    for k, main in enumerate(found["mains"]):
        pairs = [
            [found[name][side][k] for side in (0, 1)] for name in ("contact_share", "friction_power_w", "least_gap_um")
        ]
        (share, share_end), (friction, friction_end), (gap, gap_end) = pairs
        rows.append((
            f"{main}", *(f"{found[name][k]:.3g}" for name in ("depth_um", "roughness_um", "volume_mm3")),
            f"{100 * share:.2g} -> {100 * share_end:.2g}", f"{friction:.4g} -> {friction_end:.4g}",
            f"{gap:.3f} -> {gap_end:.3f}",
        ))  # fmt: skip
    ended = "wear has ended" if found["settled"] else "still wearing"
    show_rows(f"{found['engine']}: {found['hours']:.4g} h, {found['increments']} increments, {ended}", columns, rows)
    print(
        f"Deepest profile of all shells: relief {found['relief_depth_um']:.2f} um over {found['relief_share']:.2f} of "
        f"each half width, exponent {found['relief_exponent']:.2f} (fitted within {found['fit_error_um']:.2f} um)"
    )
