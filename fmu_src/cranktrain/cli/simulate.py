"""The verb ``simulate``: cycles at constant speed, at any level of detail."""

from __future__ import annotations

import argparse
import math
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import Interrupted, labelled_bar, show
from cranktrain.cli.result_names import result_name
from cranktrain.cli.run_options import (
    add_run_options,
    add_settle_option,
    asked_of,
    assembled,
    loaded,
    note_axial_path,
    own_data,
    pressures_text,
)
from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.dynamics.settled.judging import FREE_CYCLES, MOST_CYCLES
from cranktrain.engine.articulated_rod import articulated_text
from cranktrain.engine.firing import firing_text
from cranktrain.film.laws.register import bearing_law

if TYPE_CHECKING:
    from cranktrain.dynamics.model.settings import Settings
    from cranktrain.engine.model import Engine
    from cranktrain.loads.gas_pressure import Gas
    from cranktrain.results.run import Run
    from cranktrain.structure.assembly import Assembly
    from cranktrain.studies.constant_speed import Request

DESCRIPTION = "Run at constant speed until cycles repeat; write an HDF5 result and print a summary."


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options to those that all verbs have."""
    add = parser.add_argument
    add("--speed", dest="speed_rpm", type=float, required=True, metavar="RPM", help="rev/min, at least 20")
    add(
        "--cycles", type=int, metavar="N",
        help=f"exactly this many cycles of 720 degrees (default: until the outputs repeat, at most {MOST_CYCLES}; "
        f"{FREE_CYCLES} with --load-torque-nm); the last one is evaluated",
    )  # fmt: skip
    add_settle_option(parser)
    add_run_options(parser)
    add(
        "--load-torque-nm", type=float, metavar="TORQUE",
        help="load the dynamometer with this torque instead of holding its speed; --speed is the initial speed",
    )  # fmt: skip
    add("--plots", metavar="FOLDER", help="folder for pictures: torsion, main loads, orbits, least films")
    add(
        "--steady", action="store_true",
        help="also the steady state in the frequency domain; needs --crank torsional, bearings held, no damper",
    )  # fmt: skip
    add(
        "--output",
        metavar="FILE.h5",
        help="result file (default: ENGINE_SPEEDrpm.h5, with options other than the default in its name)",
    )


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Run cycles at constant speed, write the result, summarise the last cycle."""
    found, settings, output, plots = _found(options, in_file=True)
    summary = found.summary(output)
    if plots is not None:
        summary["plots"] = plots
    if not options.json:
        _show(found, settings, summary)
    return summary


def answer(options: argparse.Namespace) -> Run:
    """The run itself, for the library; its samples go into a file only where one is named."""
    from cranktrain.structure.assembly import Assembly

    if isinstance(options.engine, Assembly):
        return _of_assembly(options, options.engine)
    return _found(options, in_file=options.output is not None)[0]


def _of_assembly(options: argparse.Namespace, made: Assembly) -> Run:
    """A run of an assembly, which has settled the levels."""
    from cranktrain.studies.constant_speed import Request, simulate

    for name, usual in {"drive_line": None, "inherit": True, "plots": None, "steady": False, "output": None}.items():
        if getattr(options, name) != usual:
            raise InputError(f"{name} belongs to an engine, not to an assembly; leave it out, or pass the engine")
    known = {field.name: field.default for field in fields(Request) if hasattr(options, field.name)}
    given = {name: getattr(options, name) for name in known}
    # Arrays and functions stand for no default, and arrays are no truth value.
    choices = {name: one for name, one in given.items() if not (one is known[name] or _equal(one, known[name]))}
    if not isinstance(choices.get("load", 1.0), float):
        del choices["load"]  # :func:`loaded` finds it
    request = Request(**choices)
    return simulate(loaded(options, made, request.gas(made.engine), request.speed), **choices)


def _equal(given: Any, usual: Any) -> bool:
    """Whether a choice is the usual one."""
    return isinstance(given, str | int | float | Path) and bool(given == usual)


def _found(options: argparse.Namespace, in_file: bool) -> tuple[Run, Settings, Path, list[str] | None]:
    """The run, its settings, its file where it has one, and its pictures."""
    from cranktrain.results.files import check_target
    from cranktrain.studies.planning.level_error import level_error

    asked = engine, request, settings, gas = asked_of(options, options.speed_rpm)
    _check(options, engine, settings)
    output = Path(options.output or result_name(engine.name, options, add_options))
    if in_file:
        check_target(output)
    made = loaded(options, assembled(asked, options.inherit), gas, request.speed)
    if in_file:
        found = _run_into(output, request, made, gas)
    else:
        with labelled_bar(f"{request.speed_rpm:g} rev/min") as (tell, advance):
            found = request.run(made, gas, advance, tell)
        if not found.complete:
            raise Interrupted(f"interrupted after {found.settling.cycles} cycles; nothing was kept")
    said = level_error(engine, settings, request.speed_rpm, unlike=own_data(options))
    found = replace(found, level_error=said)
    if options.steady:
        from cranktrain.studies.torsion.frequency_run_up import steady_orders

        orders = steady_orders(engine, made.body, made.settings, request.speed, found.gas)
        found = replace(found, steady_orders=orders)
    plots = None if options.plots is None else _draw(Path(options.plots), found, settings, request.speed_rpm)
    settled = found.settling
    note_axial_path(engine, settled.repeats == 1 or not settled.steady or len(settled.left) == 0)
    return found, settings, output, plots


def _run_into(output: Path, request: Request, made: Assembly, gas: Gas | None) -> Run:
    """Run with the samples going to a file, which keeps what there is of them however the run ends."""
    from cranktrain.loads.gas_pressure import GasTrace
    from cranktrain.results.files import result_file
    from cranktrain.results.run import file_attributes

    used = (gas or GasTrace.from_engine(made.engine)).at(request.speed, request.load)
    ended: BaseException | None = None
    with result_file(output) as file:
        try:
            with labelled_bar(f"{request.speed_rpm:g} rev/min") as (tell, advance):
                found = request.run(made, gas, advance, tell, file)
            file.finish(found.file_attributes, found.film_temperatures)
        except (CranktrainError, KeyboardInterrupt) as error:
            if file.seconds is None:
                raise
            ended = error
            text = "interrupted" if isinstance(error, KeyboardInterrupt) else f"failed: {error}"
            file.finish(file_attributes(made.engine, used, request.attributes(made)) | {"ended": text})
    if ended is None and found.complete:
        return found
    kept = f"{output} keeps {(file.seconds or 0.0) * request.speed / (4.0 * math.pi):.2f} cycles"
    if ended is not None and not isinstance(ended, KeyboardInterrupt):
        raise type(ended)(f"{ended}; {kept}")
    after = f" after {found.settling.cycles} cycles" if ended is None else ""
    raise Interrupted(f"interrupted{after}; {kept}")


def _check(options: argparse.Namespace, engine: Engine, settings: Settings) -> None:
    """Refuse what is asked for besides the run and cannot be had."""
    from cranktrain.dynamics.simulation import check_far_end
    from cranktrain.results.figures import FILM_PICTURES, MOTION_PICTURES, check_folder

    check_far_end(engine)
    locked = not bearing_law(settings.bearings).carries
    if options.steady and not (settings.crank == "torsional" and locked and not options.damper):
        raise InputError(
            "--steady solves a torsional crank on held bearings without damper; use --crank torsional, or leave it out"
        )
    if options.steady:
        engine.refuse_additions("steady states in the frequency domain")
    if options.steady and settings.boundary == "torque":
        raise InputError("--steady needs a given speed; leave out --load-torque-nm")
    if options.plots is not None:
        check_folder(Path(options.plots), pictures=MOTION_PICTURES if locked else MOTION_PICTURES + FILM_PICTURES)


def _draw(folder: Path, run: Run, settings: Settings, speed_rpm: float) -> list[str]:
    """Write the pictures; returns their paths."""
    from cranktrain.results.figures import save_run_pictures

    level = settings.bearings + (f", big ends {settings.big_ends}" if settings.big_ends != "rigid" else "")
    title = f"{run.engine.title}, {speed_rpm:g} rev/min, {settings.crank} crank, films by {level}"
    films = bearing_law(settings.bearings).carries
    return [str(path) for path in save_run_pictures(folder, run, run.engine, title, films)]


def _show(run: Run, settings: Settings, summary: dict[str, Any]) -> None:
    """Print the summary for people."""
    from cranktrain.results.tables import closing_text, grid_text, online_text, resolution_text, run_tables

    print(firing_text(run.engine))
    for line in articulated_text(run.engine):
        print(line)
    print(f"Gas trace at full load: {run.gas.source}; {pressures_text(run.gas)}")
    for table in run_tables(summary):
        show(table)
    if run.passes > 1:
        print(f"Temperatures by heat balance: {run.passes} runs; the last is shown")
    if summary.get("closing_edges"):
        print(closing_text(summary["closing_edges"]))
    if "grid_errors" in summary:
        print(grid_text(summary["grid_errors"]))
    if summary.get("films_not_resolved"):
        print(resolution_text(summary["films_not_resolved"]))
    if "online_films" in summary:
        print(online_text(summary["online_films"]))
    print(
        f"{summary['steps']} steps, {summary['newton_iterations']} Newton iterations, {summary['rejected_steps']} "
        f"rejected; real-time factor {summary['real_time_factor']:.2f} ({settings.integrator}, "
        f"{math.degrees(settings.step):g} deg)"
    )
    print(run.settling.text)
    print(summary["level_error"]["text"])
    print(f"Result: {summary['result']}")
    if "plots" in summary:
        print("Pictures: " + ", ".join(summary["plots"]))
