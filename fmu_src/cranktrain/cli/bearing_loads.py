"""The verb ``bearing-loads``: the plain bearings of an engine over a cycle, and over speed."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import labelled_bar, number, say, show
from cranktrain.cli.run_options import add_run_options, add_settle_option, asked_of, assembled, engine_of, loaded
from cranktrain.core.errors import InputError
from cranktrain.engine.articulated_rod import articulated_text
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.bearings.cycle import BearingReport

    Named = Iterator[tuple[str, Mapping[str, Any], BearingReport]]
    """Reports, each with the name that its pictures have and the attributes of the run."""

DESCRIPTION = "Bearings over a cycle at one speed or several: loads, films, friction, oil flow, held against limits."


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options to those that all verbs of an engine have."""
    add, of = parser.add_argument, parser.add_mutually_exclusive_group(required=True)
    speed = number(SLOWEST_RPM, FASTEST_RPM, "rev/min")
    of.add_argument(
        "--speed", dest="speeds_rpm", type=speed, nargs="+", metavar="RPM",
        help="speeds, rev/min; each runs until its cycles repeat",
    )  # fmt: skip
    of.add_argument("--result", nargs="+", metavar="FILE.h5", help="results of 'cranktrain simulate' instead of runs")
    of.add_argument(
        "--run-up", metavar="FILE.h5", help="result of 'cranktrain runup --outputs bearings': all its speeds"
    )
    add("--cycles", type=int, metavar="N", help="exactly this many cycles a speed (default: until the outputs repeat)")
    add_settle_option(parser)
    add(
        "--plots",
        metavar="FOLDER",
        help="folder for polar load diagrams and, with several speeds, a picture of the worst bearing over speed",
    )
    add_run_options(parser, big_ends="impedance")
    parser.set_defaults(big_ends=None)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Report on each speed as it comes; an interrupt keeps the speeds that are finished."""
    from cranktrain.results.bearings.figures import save_over_speed, save_polar_pictures
    from cranktrain.results.bearings.tables import bearing_tables, bearings_dict, speed_table, total_text
    from cranktrain.results.tables import grid_text

    engine = engine_of(options)
    if options.big_ends is None:
        options.big_ends = "impedance" if engine.rods_float else "rigid"
        if not engine.rods_float:
            say(f"big ends are rigid: rods of '{engine.name}' run or hang on others, and have no films of their own")
    folder = _folder(options)
    if options.run_up is not None:
        return _over_speed(engine, options, folder)
    plots: list[Path] = []
    found: list[dict[str, Any]] = []
    interrupted = False
    try:
        for name, levels, report in _stored(engine, options.result) if options.result else _run(engine, options):
            found.append(bearings_dict(report, levels))
            if not options.json:
                for table in bearing_tables(found[-1]):
                    show(table)
                print("\n".join((*articulated_text(engine), total_text(found[-1]))), flush=True)
                if errors := found[-1]["grid_errors"]:
                    print(grid_text(errors))
            if folder is not None:
                plots += save_polar_pictures(folder, report, name)
            for violation in found[-1]["violations"]:
                say(f"warning: {found[-1]['speed_rpm']:.0f} rev/min, {violation['text']}")
    except KeyboardInterrupt:
        if not found:
            raise
        interrupted = True
        say(f"interrupted; {len(found)} speeds are finished")
    _tell_missing(engine, found)
    found.sort(key=lambda speed: float(speed["speed_rpm"]))
    if len(found) > 1 and not options.json:
        show(speed_table(found))
    if folder is not None and len(found) > 1:
        plots.append(save_over_speed(folder, engine.title, found, engine.bearing_limits))
    if plots and not options.json:
        print("Pictures: " + ", ".join(map(str, plots)))
    return {"engine": engine.name, "speeds": found, "plots": list(map(str, plots)), "interrupted": interrupted}


def _over_speed(engine: Engine, options: argparse.Namespace, folder: Path | None) -> dict[str, Any]:
    """Report on all speeds of a run-up at once, in one table; polar load diagrams where a load is largest."""
    from cranktrain.results.bearings.figures import save_over_speed, save_polar_pictures, speed_name
    from cranktrain.results.bearings.run_up_cycles import run_up_bearings
    from cranktrain.results.bearings.tables import bearings_dict, main_films, speed_table
    from cranktrain.results.run_up.run_up import RunUp
    from cranktrain.results.summary import grid_errors
    from cranktrain.results.tables import grid_text

    run_up = RunUp.load(options.run_up)
    _check_engine(engine, options.run_up, run_up.attributes.get("engine"))
    try:
        reports = list(run_up_bearings(run_up, engine))
    except InputError as error:
        raise InputError(f"{options.run_up}: {error}") from None
    gaps = run_up.speeds_rpm[~run_up.with_result].tolist()
    if gaps:
        said = ", ".join(f"{rpm:.0f}" for rpm in gaps)
        if not reports:
            raise InputError(f"{options.run_up}: none of its speeds has a result ({said} rev/min)")
        say(f"no result at {said} rev/min, so no bearing loads there")
    found = [bearings_dict(report, run_up.attributes) for report in reports]
    if not options.json:
        show(speed_table(found))
        if errors := grid_errors(run_up.attributes, [film for report in reports for film in main_films(report)]):
            print(grid_text(errors))
    for text in _gathered(found):
        say(f"warning: {text}")
    if unsteady := int(((run_up.repeats != 1) & (run_up.cycles > 0)).sum()):
        say(f"at {unsteady} of {len(found)} speeds no cycle repeats the one before, so loads are those of a mean cycle")
    _tell_missing(engine, found)
    plots: list[Path] = []
    if folder is not None:
        worst = max(reports, key=lambda report: max(bearing.load.value for bearing in report.bearings))
        plots = save_polar_pictures(folder, worst, speed_name(bearings_dict(worst, run_up.attributes)["speed_rpm"]))
        plots.append(save_over_speed(folder, engine.title, found, engine.bearing_limits, gaps))
        if not options.json:
            print("Pictures: " + ", ".join(map(str, plots)))
    return {"engine": engine.name, "speeds": found, "plots": list(map(str, plots)), "interrupted": False}


def _gathered(found: list[dict[str, Any]]) -> list[str]:
    """Limits that are not kept, one line for a bearing and limit: how often, and the first speed's text."""
    kept: dict[tuple[str, str], list[tuple[float, str]]] = {}
    for speed in found:
        for one in speed["violations"]:
            kept.setdefault((one["bearing"], one["limit"]), []).append((speed["speed_rpm"], one["text"]))
    return [
        f"{at[0][1]} at {at[0][0]:.0f} rev/min"
        + (f", the first of {len(at)} such speeds up to {at[-1][0]:.0f} rev/min" if len(at) > 1 else "")
        for at in kept.values()
    ]


def _tell_missing(engine: Engine, found: list[dict[str, Any]]) -> None:
    """Say which limits the engine file lacks."""
    missing = list(dict.fromkeys(key for speed in found for key in speed["missing_limits"]))
    if missing:
        say(f"{engine.name}: no limits for {len(missing)} quantities; add to [bearing_limits]: {', '.join(missing)}")


def _folder(options: argparse.Namespace) -> Path | None:
    """Folder of the pictures, where any are wanted; ``InputError`` where they cannot be written, before any run."""
    if options.plots is None:
        return None
    from cranktrain.results.bearings.figures import OVER_SPEED, polar_names, speed_name
    from cranktrain.results.figures import check_folder

    runs = _names(options.result) if options.result else map(speed_name, options.speeds_rpm or ())
    check_folder(Path(options.plots), pictures=[*(name for run in runs for name in polar_names(run)), OVER_SPEED])
    return Path(options.plots)


def _names(paths: list[str]) -> list[str]:
    """Names of results, by their files; numbered where two files of different folders are called the same."""
    stems = [Path(path).stem for path in paths]
    return [stem if stem not in stems[:k] else f"{stem}_{stems[:k].count(stem) + 1}" for k, stem in enumerate(stems)]


def _check_engine(engine: Engine, path: str, of: object) -> None:
    if of != engine.name:
        raise InputError(f"{path}: the run is of engine '{of}', not of '{engine.name}'; give its own engine")


def _stored(engine: Engine, paths: list[str]) -> Named:
    """Reports on result files, all of which are read before the first is told of."""
    from cranktrain.results.bearings.cycle import bearing_report
    from cranktrain.results.files import StoredRun

    reports = []
    for path in paths:
        stored = StoredRun.load(Path(path))
        _check_engine(engine, path, stored.attributes.get("engine"))
        try:
            reports.append((stored.attributes, bearing_report(stored, engine)))
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    for name, report in zip(_names(paths), reports, strict=True):
        yield name, *report


def _run(engine: Engine, options: argparse.Namespace) -> Named:
    """Reports on runs, one after the other, of one assembly."""
    from cranktrain.results.bearings.cycle import bearing_report
    from cranktrain.results.bearings.figures import speed_name

    asked = asked_of(options, *options.speeds_rpm)
    made = assembled(asked, options.inherit)
    for speed in dict.fromkeys(options.speeds_rpm):
        request = replace(asked.request, speed_rpm=speed)
        with labelled_bar(f"{speed:g} rev/min") as (tell, advance):
            found = request.run(loaded(options, made, asked.gas, request.speed), asked.gas, advance, tell)
        if not found.complete:
            raise KeyboardInterrupt
        yield speed_name(speed), found.attributes, bearing_report(found, engine)
