"""Common options of all verbs that run an engine: levels, steps, gas."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from cranktrain.cli.console import say, stages
from cranktrain.engine.drive_line_chain import read_drive_line
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import LAWS, OIL_LAWS, bearing_law
from cranktrain.studies.requests import words

if TYPE_CHECKING:
    from cranktrain.dynamics.model.settings import Settings
    from cranktrain.loads.gas_pressure import Gas, GasTrace
    from cranktrain.structure.assembly import Assembly
    from cranktrain.studies.constant_speed import Request


SPEEDS = ("speed_rpm", "from_rpm", "to_rpm")
"""Fields whose names end with a unit that the options' names lack."""


class Asked(NamedTuple):
    """Run that a verb requests: engine, (first) run, complete settings, and measured pressures."""

    engine: Engine
    request: Request
    settings: Settings
    gas: Gas | None


def balances(options: Any, engine: Engine) -> bool:
    """True if the burn is scaled to balance the engine's ``[load]``."""
    given = getattr(options, "load_torque_nm", None) is not None
    return options.load == words.BALANCED or (options.load is None and engine.load is not None and not given)


def own_data(options: Any) -> str:
    """Line for runs with the user's own pressures or meshes, for which level errors are unknown; else empty."""
    from cranktrain.studies.planning.level_error import OWN_DATA

    own = options.pressure is not None or options.mesh is not None or options.block_mesh is not None
    return OWN_DATA if own else ""


def loaded(options: Any, made: Assembly, gas: Gas | None, speed: float) -> Assembly:
    """Assembly with the burn that balances the engine's load at a speed (rad/s), if requested; ``InputError``."""
    from cranktrain.loads.gas_pressure import GasTrace
    from cranktrain.loads.mean_load import balancing_load

    if not balances(options, made.engine):
        return made
    load = balancing_load(made.engine, gas or GasTrace.from_engine(made.engine), speed)
    return replace(made, settings=replace(made.settings, gas_load=load))


def asked_of(named: str | Path | Engine, ask: Any, *speeds_rpm: float) -> Asked:
    """Requested run at a speed. Checks it before the crankshaft, which may take a minute, is made; ``InputError``.

    ``speeds_rpm`` are all speeds that will run, or the ends of their range.
    """
    engine, request = engine_of(named, ask), request_of(ask, speeds_rpm[0])
    return Asked(engine, request, request.settings(engine, option_of), gas_of(request, engine, speeds_rpm))


def request_of(options: Any, speed_rpm: float) -> Request:
    """Request of a run at a speed, with the options of a verb; ``InputError``."""
    from cranktrain.studies.constant_speed import Request

    given = {field.name: getattr(options, field.name) for field in fields(Request) if hasattr(options, field.name)}
    if not isinstance(given.get("load", 1.0), float):
        given["load"] = 1.0  # :func:`loaded` finds it
    return Request(**{**given, "speed_rpm": speed_rpm})


def assembled(asked: Asked, inherit: bool) -> Assembly:
    """Assembly of engine and settings; bodies and parts are made or read from the cache, with the stages shown."""
    from cranktrain.structure.assembly import assemble

    # Warn of laws of the oil under pressure that the bearing level of the run ignores.
    for key in OIL_LAWS:
        law = getattr(asked.engine.oil, key)
        if law != "none" and key not in bearing_law(asked.settings.bearings).oil:
            able = ", ".join(name for name, row in LAWS.items() if key in row.oil)
            say(
                f"warning: main bearings of level '{asked.settings.bearings}' ignore oil.{key} '{law}' "
                f"and take the oil at ambient pressure; to follow it use {able}"
            )
    mesh, block_mesh = asked.request.mesh, asked.request.block_mesh
    with stages(asked.engine.name) as tell:
        return assemble(asked.engine, asked.settings, say=tell, crank_mesh=mesh, block_mesh=block_mesh, inherit=inherit)


def engine_of(named: str | Path | Engine, ask: Any) -> Engine:
    """Engine from its name, path or an object, with the requested drive line."""
    engine = load_engine(named)
    if ask.drive_line is not None:
        engine = replace(engine, drive_line_chain=read_drive_line(ask.drive_line))
    return engine


def gas_of(request: Request, engine: Engine, speeds_rpm: Sequence[float] = ()) -> Gas | None:
    """Measured pressures, or None for the built-in trace; prints their values at the request's speed."""
    gas = request.gas(engine, option_of, speeds_rpm)
    if gas is not None:
        trace = gas.at(request.speed, request.load)
        say(f"{trace.source}; {pressures_text(trace)}")
    return gas


def option_of(field: str) -> str:
    """Option of the command line for a field of a request."""
    return "--" + (field.removesuffix("_rpm") if field in SPEEDS else field.replace("_", "-"))


def pressures_text(gas: GasTrace) -> str:
    """Text with the peak and the mean effective pressure of a trace."""
    return (
        f"peak {1e-6 * gas.peak:.2f} MPa at {math.degrees(gas.peak_angle):.1f} deg, "
        f"mean effective pressure {1e-6 * gas.imep:.2f} MPa"
    )


def note_axial_path(engine: Engine, settings: Settings, repeats: bool) -> None:
    """Print a note on a missing axial path if cycles do not repeat; ``repeats``: True if all cycles repeat."""
    if engine.axial_path is not None or repeats or settings.crank == "torsional":
        return
    say(
        f"note: nothing holds the crank of '{engine.name}' along its axis, so the thrust collar may bounce between its "
        "films and no cycle repeats; give the drive line's [axial_path] in the engine file (mass, stiffness, spline)"
    )
