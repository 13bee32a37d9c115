"""The verb ``simulate``: cycles at constant speed, at any level of detail."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain import __version__
from cranktrain.cli.bodies import add_block_options, bare_crankshaft, wants_flexible_block
from cranktrain.cli.console import bar, one_of, say, show, stages, within
from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine

if TYPE_CHECKING:
    from cranktrain.dynamics.model.settings import Settings
    from cranktrain.loads.gas_pressure import GasTrace

RPM = math.pi / 30.0


def add_options(run: argparse.ArgumentParser) -> None:
    """Add the verb's options to those that all verbs have."""
    run.add_argument("--speed", type=float, required=True, metavar="RPM", help="rev/min, at least 100")
    run.add_argument(
        "--cycles", type=int, default=6, help="cycles of 720 degrees (default 6); the last one is evaluated"
    )
    run.add_argument("--crank", default="solid", metavar="LEVEL", help="rigid, torsional, beam or solid (default)")
    run.add_argument(
        "--bearings",
        default="auto",
        metavar="LEVEL",
        help="linear, impedance (default), table, reynolds, ehd; roller (default where the mains are rollers); held "
        "(default of --crank torsional): the crank only turns and twists",
    )
    run.add_argument("--big-ends", default="rigid", metavar="LEVEL", help="rigid (default); films: impedance, table")
    add_block_options(run)
    run.add_argument(
        "--pistons",
        default="auto",
        metavar="LEVEL",
        help="rigid on their axes (default on ground) or guided by springs on the skirt (default in a flexible block)",
    )
    run.add_argument("--damper", action="store_true", help="with the engine's torsional damper on the pulley")
    run.add_argument(
        "--damper-temperature",
        default="engine",
        metavar="SOURCE",
        help="engine (default), by its speed; or heat-balance, as warm as its own losses make it",
    )
    run.add_argument(
        "--load-torque-nm",
        type=float,
        metavar="TORQUE",
        help="free the dynamometer and load it with this torque; --speed is where the run starts",
    )
    run.add_argument(
        "--film-temperature",
        default="engine",
        metavar="SOURCE",
        help="of the main bearings' oil: engine (default), by its speed; or heat-balance, each film warmer than that "
        "by its own friction (the run repeats, at most 6 times; big ends and thrust bearing stay with the engine's)",
    )
    run.add_argument("--integrator", metavar="NAME", help="e.g. esdirk5 (default esdirk4; at level ehd sdirk2)")
    run.add_argument("--step-deg", type=float, metavar="DEG", help="internal step in degrees of crank angle")
    run.add_argument(
        "--tolerance", type=float, metavar="ERROR",
        help="adaptive steps: parts of --step-deg as short as this error of a step asks, e.g. 1e-4",
    )  # fmt: skip
    run.add_argument("--load", type=float, default=1.0, metavar="SHARE", help="share of the full-load burn (default 1)")
    run.add_argument("--pressure", metavar="FILE.csv", help="measured trace: angle in degrees; pressure")
    run.add_argument("--pressure-unit", metavar="UNIT", help="Pa, kPa, bar or MPa; else by header or size of the peak")
    run.add_argument(
        "--pressure-tdc-deg", type=float, metavar="DEG", help="angle in the file that is firing dead centre"
    )
    run.add_argument("--plots", metavar="FOLDER", help="also draw journal orbits and least films as pictures there")
    run.add_argument(
        "--steady",
        action="store_true",
        help="also the steady state in the frequency domain; needs --crank torsional on held bearings, no damper",
    )
    run.add_argument("--output", metavar="FILE.h5", help="result file (default: ENGINE_SPEEDrpm.h5)")


def simulate(options: argparse.Namespace) -> dict[str, Any]:
    """Run cycles at constant speed, write the result, summarise the last cycle."""
    from cranktrain.assembly import level_parts
    from cranktrain.dynamics import simulation
    from cranktrain.loads.gas_pressure import GasTrace
    from cranktrain.results.figures import check_folder, save_film_pictures
    from cranktrain.results.files import check_target, save_run
    from cranktrain.results.summary import online_films, run_summary
    from cranktrain.results.tables import online_text, run_tables
    from cranktrain.structure.crank.level import crank_body, needs_solid

    # everything that can be refused is refused before the minute that a crankshaft may take
    engine = load_engine(options.engine)
    settings = _settings(engine, options)
    wants_flexible_block(engine, options)
    gas = _gas(engine, options)
    if options.steady and not (settings.crank == "torsional" and settings.bearings == "held" and not options.damper):
        raise InputError(
            "--steady solves a torsional crank on held bearings without damper; use --crank torsional, or leave it out"
        )
    if options.steady and settings.boundary == "torque":
        raise InputError("--steady needs a given speed; leave out --load-torque-nm")
    output = Path(options.output or f"{engine.name}_{options.speed:g}rpm.h5")
    check_target(output)
    if options.plots is not None:
        if settings.bearings == "held":
            raise InputError("--plots draws journals in their bearings, which level 'held' has not; use impedance")
        check_folder(Path(options.plots))

    # A user's own mesh counts at every level that is not made of dimensions alone.
    solid = None
    if needs_solid(engine, settings.crank) or (options.mesh is not None and settings.crank == "rigid"):
        solid, _ = bare_crankshaft(engine, options)
    body = crank_body(simulation.fitted_engine(engine, settings), settings.crank, solid)
    with stages(f"{engine.name}: films and block") as tell:
        parts = level_parts(engine, settings, tell, block_mesh=options.block_mesh)
    with bar(f"{options.speed:g} rev/min, {options.cycles} cycles") as advance:
        run = simulation.simulate(
            engine, body, settings, options.speed * RPM, options.cycles, gas, advance, parts,
            heat_balance=options.film_temperature == "heat-balance",
            damper_balance=options.damper_temperature == "heat-balance",
            load_torque=options.load_torque_nm,
        )  # fmt: skip
    attributes = {
        "engine": engine.name,
        "body_digest": body.digest,
        "speed": options.speed * RPM,
        "cycles": options.cycles,
        **{key: getattr(settings, key) for key in ("crank", "bearings", "big_ends", "block", "pistons", "boundary")},
        "damper": settings.damper,
        "film_temperature": options.film_temperature,
        "damper_temperature": options.damper_temperature,
        "integrator": settings.integrator,
        "step": settings.step,
        "control": settings.control,
        "tolerance": settings.tolerance if settings.control == "adaptive" else 0.0,
        "gas": gas.source if gas else "built-in Wiebe cycle",
        "version": __version__,
    }
    save_run(output, run, attributes)
    summary = run_summary(run, str(output))
    summary["film_temperature"] = {"source": options.film_temperature, "passes": run.passes}
    used = gas or GasTrace.from_engine(engine)
    summary["gas"] = {"source": used.source, "peak_mpa": 1e-6 * used.peak, "imep_mpa": 1e-6 * used.imep}
    if options.steady:
        from cranktrain.studies.torsion.torsional_response import steady_orders, torsional_response

        steady = torsional_response(engine, body, options.speed * RPM, used, options.load)
        summary["pulley"]["steady_torsion_deg"] = {"orders": steady_orders(steady)}
    if settings.bearings == "table":
        summary["online_films"] = online_films(run.angle, run.outputs)
    if options.plots is not None:
        level = settings.bearings + (f", big ends {settings.big_ends}" if settings.big_ends != "rigid" else "")
        title = f"{engine.title}, {options.speed:g} rev/min, {settings.crank} crank, films by {level}"
        pictures = save_film_pictures(Path(options.plots), run, engine, title)
        summary["plots"] = [str(path) for path in pictures]
    if not options.json:
        print(f"Gas trace at full load: {used.source}; {_pressures(used)}")
        for table in run_tables(summary):
            show(table)
        if run.passes > 1:
            print(f"Temperatures by heat balance: {run.passes} runs of {options.cycles} cycles; the last is shown")
        if "online_films" in summary:
            print(online_text(summary["online_films"]))
        print(
            f"{summary['steps']} steps, {summary['newton_iterations']} Newton iterations, {summary['rejected_steps']} "
            f"rejected; real-time factor {summary['real_time_factor']:.2f} ({settings.integrator}, "
            f"{math.degrees(settings.step):g} deg)"
        )
        print(f"Result: {output}")
        if options.plots is not None:
            print("Pictures: " + ", ".join(summary["plots"]))
    return summary


def _settings(engine: Engine, options: argparse.Namespace) -> Settings:
    """Settings that the options ask for, with nothing left open; refuses what the engine cannot do."""
    from cranktrain.dynamics.model.settings import CRANK_LEVELS, PISTON_LEVELS, Settings, check_levels, resolved
    from cranktrain.dynamics.time.integrator_tables import integrator_table
    from cranktrain.dynamics.warm_films import TEMPERATURES, check_level
    from cranktrain.film.laws.register import BIG_END, MAINS, bearing_levels

    within("--speed", options.speed, 100.0, 20000.0, "rev/min; for less use the FMU, which takes any speed from 0")
    within("--cycles", options.cycles, 1, 10000, "cycles")
    within("--load", options.load, 0.0, 2.0, "of the full-load burn")
    one_of("--crank", options.crank, CRANK_LEVELS)
    one_of("--bearings", options.bearings, ("auto", *bearing_levels(*MAINS)))
    one_of("--big-ends", options.big_ends, bearing_levels(BIG_END))
    one_of("--pistons", options.pistons, PISTON_LEVELS)
    one_of("--film-temperature", options.film_temperature, TEMPERATURES)
    one_of("--damper-temperature", options.damper_temperature, TEMPERATURES)
    if options.damper_temperature != "engine" and not options.damper:
        raise InputError("--damper-temperature needs --damper; without it there is nothing to warm")
    choices: dict[str, Any] = {
        "crank": options.crank,
        "bearings": options.bearings,
        "big_ends": options.big_ends,
        "block": options.block,
        "pistons": options.pistons,
        "damper": "fitted" if options.damper else "none",
        "boundary": "speed" if options.load_torque_nm is None else "torque",
        "gas_load": options.load,
    }
    if options.load_torque_nm is not None:
        within("--load-torque-nm", options.load_torque_nm, -1e6, 1e6, "N m")
    if options.integrator is not None:
        integrator_table(options.integrator)
        choices["integrator"] = options.integrator
    if options.step_deg is not None:
        within("--step-deg", options.step_deg, 0.001, 30.0, "deg of crank angle")
        choices["step"] = math.radians(options.step_deg)
    if options.tolerance is not None:
        choices |= {"control": "adaptive", "tolerance": options.tolerance}
    settings = resolved(Settings(**choices), engine)
    check_levels(settings, engine)
    if options.film_temperature == "heat-balance":
        if settings.bearings == "held":
            raise InputError("--film-temperature heat-balance needs films, which bearing level 'held' has not")
        check_level(settings.bearings)
    return settings


def _gas(engine: Engine, options: argparse.Namespace) -> GasTrace | None:
    """Measured pressure trace, where one is given."""
    from cranktrain.loads.gas_pressure import GasTrace

    if options.pressure is None:
        if options.pressure_unit or options.pressure_tdc_deg is not None:
            raise InputError("--pressure-unit and --pressure-tdc-deg need --pressure FILE.csv")
        return None
    gas = GasTrace.from_csv(options.pressure, engine, options.pressure_unit, options.pressure_tdc_deg)
    say(f"{gas.source}; {_pressures(gas)}")
    return gas


def _pressures(gas: Any) -> str:
    return (
        f"peak {1e-6 * gas.peak:.2f} MPa at {math.degrees(gas.peak_angle):.1f} deg, "
        f"mean effective pressure {1e-6 * gas.imep:.2f} MPa"
    )
