"""Options that the verbs share which run an engine: levels, steps, gas."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, NamedTuple

from cranktrain.cli.bodies import add_block_options
from cranktrain.cli.console import of_words, say, stages, taking
from cranktrain.dynamics.model.settings import FILM_TEMPERATURES, TEMPERATURES
from cranktrain.dynamics.settled.judging import TOLERANCE
from cranktrain.dynamics.time.integrators import INTEGRATORS, settles_films
from cranktrain.engine.drive_line_chain import read_drive_line
from cranktrain.engine.file import load_engine
from cranktrain.engine.levels import CRANKS, ENCODERS, PISTONS, described
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import BIG_END, LAWS, MAINS, OIL_LAWS, bearing_law, bearing_levels

if TYPE_CHECKING:
    from cranktrain.dynamics.model.settings import Settings
    from cranktrain.loads.gas_pressure import Gas, GasTrace
    from cranktrain.structure.assembly import Assembly
    from cranktrain.studies.constant_speed import Request

BALANCED = "balanced"
"""Load for which the burn balances the engine file's ``[load]``."""
_SOURCES = "engine (default), by its speed; or heat-balance"


class Asked(NamedTuple):
    """What a verb is asked to run: an engine, its (first) run, settings with nothing left open, measured pressures."""

    engine: Engine
    request: Request
    settings: Settings
    gas: Gas | None


def _laws(*kinds: str) -> str:
    return described(LAWS[name] for name in bearing_levels(*kinds))


def add_level_options(
    parser: argparse.ArgumentParser, big_ends: str = "rigid", without: str = "", balances: bool = False
) -> None:  # fmt: skip
    """Add the levels, the damper and the load.

    ``big_ends`` is the default level of these; ``without`` names an option that the verb does not have; ``balances``
    says whether the load may be that of the engine file.
    """
    add = parser.add_argument
    if without != "--crank":
        level = add("--crank", default="solid", metavar="LEVEL", help=f"{described(CRANKS.values())}; default solid")
        of_words(level, CRANKS)
    mains = add(
        "--bearings", default="auto", metavar="LEVEL",
        help=f"{_laws(*MAINS)}; default impedance, roller where the mains are rollers, held at --crank torsional",
    )  # fmt: skip
    of_words(mains, ("auto", *bearing_levels(*MAINS)))
    pins = add("--big-ends", default=big_ends, metavar="LEVEL", help=f"{_laws(BIG_END)}; default {big_ends}")
    of_words(pins, bearing_levels(BIG_END))
    add_block_options(parser)
    if without != "--pistons":
        pistons = add(
            "--pistons", default="auto", metavar="LEVEL",
            help=f"{described(PISTONS.values())}; default rigid, in a flexible block guided",
        )  # fmt: skip
        of_words(pistons, ("auto", *PISTONS))
    add("--damper", action="store_true", help="with the engine's torsional damper on the pulley")
    if balances:
        add(
            "--load", type=_load, metavar="SHARE",
            help=f"fraction of the full-load burn, or '{BALANCED}': the burn whose mean torque is that of the engine "
            f"file's [load] (default: {BALANCED} where the file has [load], else 1)",
        )  # fmt: skip
    else:
        add("--load", type=float, default=1.0, metavar="SHARE", help="fraction of the full-load burn (default 1)")


@taking("float | Literal['balanced']")
def _load(text: str) -> float | str:
    """A number, or the word for a balanced load."""
    return text if text == BALANCED else float(text)


def balances(options: argparse.Namespace, engine: Engine) -> bool:
    """Whether the burn is to balance the engine's ``[load]``."""
    given = getattr(options, "load_torque_nm", None) is not None
    return options.load == BALANCED or (options.load is None and engine.load is not None and not given)


def own_data(options: argparse.Namespace) -> str:
    """One line where a run has pressures or meshes of its own, for which no level errors are measured; else none."""
    from cranktrain.studies.planning.level_error import OWN_DATA

    own = options.pressure is not None or options.mesh is not None or options.block_mesh is not None
    return OWN_DATA if own else ""


def loaded(options: argparse.Namespace, made: Assembly, gas: Gas | None, speed: float) -> Assembly:
    """The assembly with the burn that balances the engine's load at a speed (rad/s), if that is asked; InputError."""
    from cranktrain.loads.gas_pressure import GasTrace
    from cranktrain.loads.mean_load import balancing_load

    if not balances(options, made.engine):
        return made
    load = balancing_load(made.engine, gas or GasTrace.from_engine(made.engine), speed)
    return replace(made, settings=replace(made.settings, gas_load=load))


def add_settle_option(parser: argparse.ArgumentParser, default: float = TOLERANCE) -> None:
    """Add the settling error at which a run ends."""
    parser.add_argument(
        "--settle", type=float, default=default, metavar="TOL",
        help=f"run until the settling error of every output family is below this (default {default:g})",
    )  # fmt: skip


def add_run_options(parser: argparse.ArgumentParser, big_ends: str = "rigid") -> None:
    """Add the options of a run but for its speeds, its length and what is written; ``big_ends``: their usual level."""
    add = parser.add_argument
    add_level_options(parser, big_ends, balances=True)
    add(
        "--no-inherit", dest="inherit", action="store_false",
        help="torsional crank with its structural damping alone, without damping inherited from the level above",
    )  # fmt: skip
    add_source_options(parser)
    add_encoder_option(parser)
    add(
        "--axial-force-n", type=float, metavar="N",
        help="steady axial force on the flywheel, positive away from the pulley (default: the engine file's)",
    )  # fmt: skip
    damper = add(
        "--damper-temperature", default="engine", metavar="SOURCE", help=f"{_SOURCES}, from the damper's own losses"
    )  # fmt: skip
    of_words(damper, TEMPERATURES)
    films = add(
        "--film-temperature", default="engine", metavar="SOURCE",
        help=f"temperature of the main bearings' oil: {_SOURCES} or adiabatic, each film warmed by its own "
        "friction (the run repeats, at most 6 times; big ends and thrust bearing stay at the engine's)",
    )  # fmt: skip
    of_words(films, FILM_TEMPERATURES)
    of_words(add("--integrator", metavar="NAME", help=_integrators()), INTEGRATORS)
    add("--step-deg", type=float, metavar="DEG", help=_steps())
    add(
        "--tolerance", type=float, metavar="ERROR",
        help="adaptive steps: --step-deg is divided until the error of a step is below this, e.g. 1e-4",
    )  # fmt: skip


def add_source_options(parser: argparse.ArgumentParser, maps: bool = True) -> None:
    """Add what drives and loads the crank in place of the engine file's gas and drive line.

    ``maps``: whether pressures may be traces over speed and load.
    """
    add = parser.add_argument
    more = "; or a folder of such files named by speed (1500.csv), or an index file of speed_rpm, load, file"
    add(
        "--drive-line", metavar="TABLE",
        help="discs and shafts (TOML or CSV) from 'flywheel' to 'dynamometer' in place of the connecting shaft",
    )  # fmt: skip
    add(
        "--pressure", metavar="FILE",
        help="measured pressures: a .csv file of crank angle in degrees and pressure, one column or one for each "
        f"cylinder{more if maps else ''}",
    )  # fmt: skip
    add("--pressure-unit", metavar="UNIT", help="Pa, kPa, bar or MPa (default: from header or size of the peak)")
    add(
        "--pressure-tdc-deg", type=float, metavar="DEG",
        help="angle of the firing dead centre in the pressure file (of cylinder 1)",
    )  # fmt: skip


def add_encoder_option(parser: argparse.ArgumentParser) -> None:
    """Add where the encoder sat that gave the angles of measured pressures."""
    option = parser.add_argument(
        "--encoder", default="pin", metavar="PLACE",
        help="place whose angle the pressures of --pressure belong to: pulley or flywheel, where the encoder of the "
        "measurement sat, or pin (default), each cylinder's own crank pin",
    )  # fmt: skip
    of_words(option, ENCODERS)


def _integrators() -> str:
    from cranktrain.film.laws.register import LAWS, Law

    usual = Law.integrator
    others = [f"at level {law.name} {law.integrator}" for law in LAWS.values() if law.integrator != usual]
    lost = ", ".join(name for name in INTEGRATORS if not settles_films(name))
    return f"{', '.join(INTEGRATORS)}; default {', '.join((usual, *others))}; elastic films refuse {lost}"


def _steps() -> str:
    from cranktrain.film.laws.register import LAWS, Law

    others = [f"at level {law.name} {law.step_deg:g}" for law in LAWS.values() if law.step_deg != Law.step_deg]
    return f"internal step in degrees of crank angle; default {', '.join((f'{Law.step_deg:g}', *others))}"


def asked_of(options: argparse.Namespace, *speeds_rpm: float) -> Asked:
    """What the options ask for, at a speed, refused before the minute that a crankshaft may take; ``InputError``.

    ``speeds_rpm`` are all speeds that will run, or the ends of their range.
    """
    engine, request = engine_of(options), request_of(options, speeds_rpm[0])
    return Asked(engine, request, request.settings(engine, option_of), gas_of(request, engine, speeds_rpm))


def request_of(options: argparse.Namespace, speed_rpm: float) -> Request:
    """Run at a speed with the choices that a verb has options for; ``InputError``."""
    from cranktrain.studies.constant_speed import Request

    given = {field.name: getattr(options, field.name) for field in fields(Request) if hasattr(options, field.name)}
    if not isinstance(given.get("load", 1.0), float):
        given["load"] = 1.0  # :func:`loaded` finds it
    return Request(**{**given, "speed_rpm": speed_rpm})


def assembled(asked: Asked, inherit: bool) -> Assembly:
    """Engine and settings with their bodies and parts, made or from the cache, with the stages shown."""
    from cranktrain.structure.assembly import assemble

    tell_unread(asked.engine, asked.settings)
    mesh, block_mesh = asked.request.mesh, asked.request.block_mesh
    with stages(asked.engine.name) as tell:
        return assemble(asked.engine, asked.settings, say=tell, crank_mesh=mesh, block_mesh=block_mesh, inherit=inherit)


def engine_of(options: argparse.Namespace) -> Engine:
    """Engine that the options name, with its drive line."""
    engine = load_engine(options.engine)
    if options.drive_line is not None:
        engine = replace(engine, drive_line_chain=read_drive_line(options.drive_line))
    return engine


def gas_of(request: Request, engine: Engine, speeds_rpm: Sequence[float] = ()) -> Gas | None:
    """Measured pressures, told of at the request's speed, or None for the built-in trace."""
    gas = request.gas(engine, option_of, speeds_rpm)
    if gas is not None:
        trace = gas.at(request.speed, request.load)
        say(f"{trace.source}; {pressures_text(trace)}")
    return gas


def option_of(field: str) -> str:
    """What the command line calls a field of a request."""
    return "--speed" if field == "speed_rpm" else "--" + field.replace("_", "-")


def tell_unread(engine: Engine, settings: Settings) -> None:
    """Say which laws of the oil under pressure no film of the run follows."""
    for key in OIL_LAWS:
        law = getattr(engine.oil, key)
        if law != "none" and key not in bearing_law(settings.bearings).oil:
            able = ", ".join(name for name, row in LAWS.items() if key in row.oil)
            say(
                f"warning: main bearings of level '{settings.bearings}' ignore oil.{key} '{law}' "
                f"and take the oil at ambient pressure; to follow it use {able}"
            )


def pressures_text(gas: GasTrace) -> str:
    """A trace's peak and mean effective pressure, for people."""
    return (
        f"peak {1e-6 * gas.peak:.2f} MPa at {math.degrees(gas.peak_angle):.1f} deg, "
        f"mean effective pressure {1e-6 * gas.imep:.2f} MPa"
    )


def note_axial_path(engine: Engine, repeats: bool) -> None:
    """Tell of a missing axial path beside cycles that do not repeat; ``repeats``: whether all of them do."""
    if engine.axial_path is not None or repeats:
        return
    say(
        f"note: nothing holds the crank of '{engine.name}' along its axis, so the thrust collar may bounce between its "
        "films and no cycle repeats; give the drive line's [axial_path] in the engine file (mass, stiffness, spline)"
    )
