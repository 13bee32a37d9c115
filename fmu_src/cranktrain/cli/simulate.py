"""The verb ``simulate``: cycles at constant speed, at any level of detail."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cranktrain.cli import console
from cranktrain.cli.console import Interrupted, labelled_bar
from cranktrain.cli.functions import ENGINE, verb
from cranktrain.cli.result_names import result_name
from cranktrain.cli.run_options import (
    asked_of,
    assembled,
    loaded,
    note_axial_path,
    own_data,
    pressures_text,
    request_of,
)
from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.engine.articulated_rod import articulated_text
from cranktrain.engine.file import load_engine
from cranktrain.engine.firing import firing_text
from cranktrain.film.laws.register import bearing_law
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option

if TYPE_CHECKING:
    from cranktrain.dynamics.model.settings import Settings
    from cranktrain.engine.model import Engine
    from cranktrain.loads.gas_pressure import Gas
    from cranktrain.results.run import Run
    from cranktrain.structure.assembly import Assembly
    from cranktrain.studies.constant_speed import Request

RUNNABLE = ENGINE._replace(objects=("Engine", "Assembly"))
DESCRIPTION = "Run at constant speed until cycles repeat; write an HDF5 result and print a summary."

OF_THE_ENGINE = ("drive_line", "inherit", "plots", "steady", "output")
"""Fields of the question that do not apply to an assembly."""
OF_THE_ASSEMBLY = ("crank", "bearings", "big_ends", "block", "pistons", "damper", "mesh", "block_mesh", "mesh_unit")
"""Choices that are already fixed in an assembly."""


@dataclass(frozen=True, kw_only=True)
class Simulate(words.Settled, words.Running):
    """Question of :func:`simulate`."""

    speed_rpm: words.Speed
    cycles: words.Cycles | None = None
    load_torque_nm: words.LoadTorque | None = None
    plots: Annotated[
        words.File | None, Option("FOLDER", "folder for pictures: torsion, main loads, orbits, least films")
    ] = None
    steady: Annotated[
        bool,
        Option(help="also the steady state in the frequency domain; needs --crank torsional, bearings held, no damper"),
    ] = False
    output: Annotated[
        words.File | None,
        Option("FILE.h5", "result file (default: ENGINE_SPEEDrpm.h5, with options other than the default in its name)"),
    ] = None


@verb(Simulate, DESCRIPTION, RUNNABLE)
def simulate(engine: str | Path | Engine | Assembly, ask: Simulate) -> Run:
    """Run cycles at constant speed; samples are written to a file only if one is named."""
    from cranktrain.structure.assembly import Assembly

    if isinstance(engine, Assembly):
        return _of_assembly(engine, ask)
    return _found(engine, ask)[0]


def answer(engine: str, ask: Simulate) -> VerbResult:
    """Summary of the run, whose samples are in a file; without a given name it is named after the options."""
    usual = ask.output or result_name(load_engine(engine).name, ask)
    run, plots = _found(engine, replace(ask, output=usual))
    summary = run.summary(usual)
    if plots is not None:
        summary["plots"] = plots
    return VerbResult.of(summary, "simulate", run=run)


def _of_assembly(made: Assembly, ask: Simulate) -> Run:
    """Run of an assembly, whose levels are fixed."""
    from cranktrain.structure.assembly import checked

    for name in (*OF_THE_ENGINE, *OF_THE_ASSEMBLY):
        if getattr(ask, name) != getattr(Simulate, name):
            if name in OF_THE_ENGINE:
                raise InputError(f"{name} belongs to an engine, not to an assembly; leave it out, or pass the engine")
            raise InputError(f"simulate: '{name}' is fixed by the assembly; leave it out, or pass the engine")
    request = request_of(ask, ask.speed_rpm)
    request.check()
    settings = checked(made.engine, request.of_a_run(made.settings))
    request.check_heat(settings)
    gas = request.gas(made.engine)
    return request.run(loaded(ask, replace(made, settings=settings), gas, request.speed), gas)


def _found(named: str | Path | Engine, ask: Simulate) -> tuple[Run, list[str] | None]:
    """Run, and the paths of its pictures if requested."""
    from cranktrain.results.files import check_target
    from cranktrain.studies.planning.level_error import level_error

    asked = engine, request, settings, gas = asked_of(named, ask, ask.speed_rpm)
    _check(ask, engine, settings)
    if ask.output is not None:
        check_target(Path(ask.output))
    made = loaded(ask, assembled(asked, ask.inherit), gas, request.speed)
    if ask.output is not None:
        found = _run_into(Path(ask.output), request, made, gas)
    else:
        with labelled_bar(f"{request.speed_rpm:g} rev/min") as (tell, advance):
            found = request.run(made, gas, advance, tell)
        if not found.complete:
            raise Interrupted(f"interrupted after {found.settling.cycles} cycles; nothing was kept")
    said = level_error(engine, settings, request.speed_rpm, unlike=own_data(ask))
    found = replace(found, level_error=said)
    if ask.steady:
        from cranktrain.studies.torsion.frequency_run_up import steady_orders

        orders = steady_orders(engine, made.body, made.settings, request.speed, found.gas)
        found = replace(found, steady_orders=orders)
    plots = None
    if ask.plots is not None:
        from cranktrain.results.figures import save_run_pictures

        run = made.settings
        level = run.bearings + (f", big ends {run.big_ends}" if run.big_ends != "rigid" else "")
        title = f"{engine.title}, {request.speed_rpm:g} rev/min, {run.crank} crank, films by {level}"
        films = bearing_law(run.bearings).carries
        plots = [str(path) for path in save_run_pictures(Path(ask.plots), found, made.engine, title, films)]
    settled = found.settling
    note_axial_path(engine, made.settings, settled.repeats == 1 or not settled.steady or len(settled.left) == 0)
    return found, plots


def _run_into(output: Path, request: Request, made: Assembly, gas: Gas | None) -> Run:
    """Run with the samples written to a file, which keeps the samples so far, however the run ends."""
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


def _check(ask: Simulate, engine: Engine, settings: Settings) -> None:
    """Refuse requested results that the run cannot give, before it begins; ``InputError``."""
    from cranktrain.dynamics.simulation import check_far_end

    check_far_end(engine)
    locked = not bearing_law(settings.bearings).carries
    if ask.steady and not (settings.crank == "torsional" and locked and not ask.damper):
        raise InputError(
            "--steady solves a torsional crank on held bearings without damper; use --crank torsional, or leave it out"
        )
    if ask.steady and settings.boundary == "torque":
        raise InputError("--steady needs a given speed; leave out --load-torque-nm")
    if ask.plots is not None:
        from cranktrain.results.figures import FILM_PICTURES, MOTION_PICTURES, check_folder

        check_folder(Path(ask.plots), pictures=MOTION_PICTURES if locked else MOTION_PICTURES + FILM_PICTURES)


def show(summary: VerbResult) -> None:
    """Print the summary."""
    from cranktrain.results.tables import closing_text, grid_text, online_text, resolution_text, run_tables

    run: Run = summary.beside["run"]
    print(firing_text(run.engine))
    for line in articulated_text(run.engine):
        print(line)
    print(f"Gas trace at full load: {run.gas.source}; {pressures_text(run.gas)}")
    for table in run_tables(summary):
        console.show(table)
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
        f"rejected; real-time factor {summary['real_time_factor']:.2f} ({run.attributes['integrator']}, "
        f"{math.degrees(float(run.attributes['step'])):g} deg)"
    )
    print(run.settling.text)
    print(summary["level_error"]["text"])
    print(f"Result: {summary['result']}")
    if "plots" in summary:
        print("Pictures: " + ", ".join(summary["plots"]))
