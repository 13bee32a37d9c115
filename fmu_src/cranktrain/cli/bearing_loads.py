"""The verb ``bearing-loads``: the plain bearings of an engine over a cycle, and over speed."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import labelled_bar, number, say, show
from cranktrain.cli.run_options import add_run_options, asked_of, assembled, engine_of
from cranktrain.core.errors import InputError
from cranktrain.dynamics.settled.judging import TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cranktrain.engine.model import Engine
    from cranktrain.results.bearings.cycle import BearingReport

DESCRIPTION = "Bearings over a cycle at one speed or several: loads, films, friction, oil flow, held against limits."


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options to those that all verbs of an engine have."""
    add, of = parser.add_argument, parser.add_mutually_exclusive_group(required=True)
    speed = number(100.0, 20000.0, "rev/min")
    of.add_argument(
        "--speed", type=speed, nargs="+", metavar="RPM", help="speeds to run, rev/min, each until it repeats"
    )
    of.add_argument("--result", nargs="+", metavar="FILE.h5", help="results of 'cranktrain simulate' instead of runs")
    add("--cycles", type=int, metavar="N", help="exactly so many cycles a speed (default: until the outputs repeat)")
    add("--settle", type=float, default=TOLERANCE, metavar="TOL", help=f"what may be left of settling ({TOLERANCE:g})")
    add(
        "--plots",
        metavar="FOLDER",
        help="also draw polar load diagrams and, of several speeds, the worst bearing there",
    )
    add_run_options(parser, big_ends="impedance")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Report on each speed as it comes; an interrupt keeps the speeds that are finished."""
    from cranktrain.results.bearings.figures import save_over_speed, save_polar_pictures
    from cranktrain.results.bearings.tables import bearing_tables, bearings_dict, speed_table, total_text

    engine = engine_of(options)
    folder = _folder(options)
    plots: list[Path] = []
    found: list[dict[str, Any]] = []
    interrupted = False
    try:
        for report in _stored(engine, options.result) if options.result else _run(engine, options):
            found.append(bearings_dict(report))
            if not options.json:
                for table in bearing_tables(found[-1]):
                    show(table)
                print(total_text(found[-1]), flush=True)
            if folder is not None:
                plots += save_polar_pictures(folder, report)
            for violation in found[-1]["violations"]:
                say(f"warning: {found[-1]['speed_rpm']:.0f} rev/min, {violation['text']}")
    except KeyboardInterrupt:
        if not found:
            raise
        interrupted = True
        say(f"interrupted; {len(found)} speeds are finished")
    missing = list(dict.fromkeys(key for speed in found for key in speed["missing_limits"]))
    if missing:
        say(f"{engine.name}: no limits for {len(missing)} quantities; add to [bearing_limits]: {', '.join(missing)}")
    found.sort(key=lambda speed: float(speed["speed_rpm"]))
    if len(found) > 1 and not options.json:
        show(speed_table(found))
    if folder is not None and len(found) > 1:
        plots.append(save_over_speed(folder, engine.title, found, engine.bearing_limits))
    if plots and not options.json:
        print("Pictures: " + ", ".join(map(str, plots)))
    return {"engine": engine.name, "speeds": found, "plots": list(map(str, plots)), "interrupted": interrupted}


def _folder(options: argparse.Namespace) -> Path | None:
    """Folder of the pictures, where any are wanted; ``InputError`` where they cannot be written, before any run."""
    if options.plots is None:
        return None
    from cranktrain.results.bearings.figures import OVER_SPEED, polar_names
    from cranktrain.results.figures import check_folder

    names = [name for speed in options.speed or () for name in polar_names(speed)]
    check_folder(Path(options.plots), pictures=[*names, OVER_SPEED])
    return Path(options.plots)


def _stored(engine: Engine, paths: list[str]) -> Iterator[BearingReport]:
    """Reports on result files, all of which are read before the first is told of."""
    from cranktrain.results.bearings.cycle import bearing_report
    from cranktrain.results.files import StoredRun

    reports = []
    for path in paths:
        stored = StoredRun.load(Path(path))
        if stored.attributes.get("engine") != engine.name:
            raise InputError(
                f"{path}: a run of engine '{stored.attributes.get('engine')}', not of '{engine.name}'; name its engine"
            )
        try:
            reports.append(bearing_report(stored, engine))
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    yield from reports


def _run(engine: Engine, options: argparse.Namespace) -> Iterator[BearingReport]:
    """Reports on runs, one after the other, of one assembly."""
    from cranktrain.results.bearings.cycle import bearing_report

    asked = asked_of(options, options.speed[0])
    made = assembled(asked, not options.no_inherit)
    for speed in options.speed:
        request = replace(asked.request, speed_rpm=speed)
        with labelled_bar(f"{speed:g} rev/min") as (tell, advance):
            found = request.run(made, asked.gas, advance, tell)
        if not found.complete:
            raise KeyboardInterrupt
        yield bearing_report(found, asked.engine)
