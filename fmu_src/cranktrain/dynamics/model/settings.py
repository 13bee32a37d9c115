"""Settings of one run, their defaults for an engine, and checks of the chosen levels."""

import math
from dataclasses import dataclass, replace
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.mains import check_mains, mains_kind
from cranktrain.dynamics.model.numbers import LEAST_TOLERANCE, MOST_DELAY, MOST_TOLERANCE
from cranktrain.dynamics.time.integrators import INTEGRATORS, amplification, integrator, settles_films
from cranktrain.dynamics.topology.bearings import film_parts
from cranktrain.engine.articulated_rod import ARTICULATED
from cranktrain.engine.checks.mounts import need_constant_mounts
from cranktrain.engine.levels import BLOCKS, CRANKS, DAMPERS, ENCODERS, PISTONS
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import BIG_END, MAINS, Law, bearing_law, bearing_levels, usual_level
from cranktrain.loads.damper import required_damper

# Numbers of the gas source and of the input reconstruction.
GAS_SOURCES = {"auto": 0, "builtin": 1, "input": 2}
RECONSTRUCTIONS = {"hold": 0, "linear": 1, "interpolate": 2, "polytropic": 3, "stages": 4}
CONTROLS = ("fixed", "adaptive")
DENSE_OUTPUTS = {"off": 0, "on": 1}
"""With "on" internal steps pass over communication points, where outputs are interpolated; else a step ends at each."""
BOUNDARIES = {"speed": 1.0, "torque": 0.0}
"""Quantity given at the dynamometer: its speed, or the load torque on it."""
FOR_HELD_INPUTS = {"esdirk47": "sdirk4", "esdirk4": "sdirk4", "esdirk3": "sdirk3"}
"""Default integrators with an explicit first stage, and their replacements, with implicit stages only, for held inputs.
An explicit first stage is taken from the step before, so it misses a jump of the inputs."""
ROW, RECORDED = math.radians(3.0), math.radians(2.5)
"""Largest crank angles between two rows of a run over cycles. Rows give largest values, orders and orbits; RECORDED is
for stresses and tangents, which are evaluated at the end of a step, so that no row may lie within one."""
ADDED = math.radians(2.5)
"""Longest default step with added connections; with 5 degrees teeth of balancers at twice crank speed would ring."""
TEMPERATURES = ("engine", "heat-balance")
"""Source of the damper's temperature: the engine's table over speed, or the damper's own heat balance."""
FILM_TEMPERATURES = (*TEMPERATURES, "adiabatic")
"""Source of the films' temperature; "adiabatic" leaves all friction heat in the oil, which warms along the film."""


@dataclass(frozen=True)
class Settings:
    """Choices of one run; angles rad, pressures Pa, temperatures K (0: from the engine's tables at the first speed).

    Open settings (auto, 0 or None) get defaults from the level, see :func:`resolved`. ``step`` is in rad of crank
    angle. ``newton_tolerance`` of the ports is in units of clearance; elastic films are solved in double precision from
    1e-6 on. ``film_change`` is the fraction of its thickness by which a film may close in a step. With ``control``
    adaptive, steps are parts of ``step``, short enough for an error of ``tolerance`` per step
    (:mod:`cranktrain.dynamics.time.error_estimate`). With ``dense_output`` on, steps pass over communication points
    that are finer (:mod:`cranktrain.dynamics.time.communication`). ``film_temperature`` is one of
    ``FILM_TEMPERATURES``. ``encoder``, one of ``ENCODERS``, is where the angle of a gas trace was measured.
    ``gas_delay`` is the number of communication steps by which given pressures are late
    (:mod:`cranktrain.dynamics.time.reconstruction`). ``work_limit`` is the most Newton iterations of a communication
    step, 0 for no limit (:mod:`cranktrain.dynamics.time.work_limit`). ``axial_force`` (N) on the flywheel is the start
    value of that input; None takes the force of the engine's axial path.
    """

    crank: str = "solid"
    bearings: str = "auto"
    big_ends: str = "rigid"
    block: str = "auto"
    pistons: str = "auto"
    damper: str = "none"
    boundary: str = "speed"
    integrator: str = "auto"
    step: float = 0.0
    control: str = "fixed"
    dense_output: str = "on"
    tolerance: float = 1.0e-3
    gas_source: str = "auto"
    gas_load: float = 1.0
    reconstruction: str = "polytropic"
    gas_delay: float = 0.0
    crankcase_pressure: float = at.AMBIENT
    oil_temperature: float = 0.0
    film_temperature: str = "engine"
    damper_temperature: float = 0.0
    gravity: float = 9.80665
    work_limit: float = 0.0
    newton_tolerance: float | None = None
    film_change: float | None = None
    axial_force: float | None = None
    encoder: str = "pin"


def axial_force(settings: Settings, engine: Engine) -> float:
    """Start value of the input for axial force on the flywheel, N: from the settings, else from the engine file."""
    if settings.axial_force is not None:
        return settings.axial_force
    return engine.axial_path.force if engine.axial_path is not None else 0.0


def resolved(settings: Settings, engine: Engine) -> Settings:
    """Resolved settings: every open choice replaced by its default for this engine.

    Journals of a crank that only twists are locked on their axis. Otherwise mains are rollers if the engine has them,
    else films without tilt. With rollers the block is flexible if engine and crank allow it, because a rigid ground
    would be the largest error. Films have errors of that size themselves, so they run on ground. Integrator, step and
    tolerances are those of the bearings with the shortest step. Pistons are guided by a flexible block's liners.
    """
    bearings = settings.bearings
    if bearings == "auto":
        bearings = usual_level(settings.crank, mains_kind(engine))
    law = bearing_law(bearings)
    block = settings.block
    if block == "auto":
        described = None not in (engine.block, engine.mounts, engine.piston_guidance)
        hung = any(engine.articulations)  # engines with articulated rods have rigid pistons
        deforms = settings.crank in CRANKS and CRANKS[settings.crank].elastic
        block = law.block if described and deforms and settings.pistons != "rigid" and not hung else "ground"
    law = ruling_law(bearings, settings.big_ends, engine)
    pistons = settings.pistons
    if pistons == "auto":
        pistons = "guided" if block == "flexible" else "rigid"
    integrator = settings.integrator
    if integrator == "auto":
        held = settings.reconstruction == "hold"
        integrator = FOR_HELD_INPUTS.get(law.integrator, law.integrator) if held else law.integrator
    usual = law.tolerance / amplification(integrator)
    chosen: dict[str, Any] = {
        "bearings": bearings,
        "block": block,
        "pistons": pistons,
        "integrator": integrator,
        "step": settings.step or usual_step(law, engine),
        "newton_tolerance": settings.newton_tolerance or usual,
        "film_change": settings.film_change or usual_film_change(law, engine),
    }
    return replace(settings, **chosen)


def step_each_row(settings: Settings) -> Settings:
    """Resolved settings of a run whose steps end at every row, because forces and tangents are read there."""
    return replace(settings, step=min(settings.step, RECORDED))


def ruling_law(bearings: str, big_ends: str, engine: Engine) -> Law:
    """Force law with the shortest step of mains, big ends and added bearings, which sets integrator and tolerances.

    If several laws have that step, the mains' law is taken.
    """
    laws = [bearing_law(bearings)]
    big_end = bearing_law(big_ends, "big-end level")
    if big_end.carries:
        laws.append(big_end)
    for table in engine.additions.connection:
        laws += [bearing_law(table.film.level)] if table.film is not None else []
        laws += [bearing_law("roller")] if table.roller is not None else []
    return min(laws, key=lambda law: law.step_deg)


def usual_step(law: Law, engine: Engine) -> float:
    """Default step (rad) of a run under a ruling law, limited to ADDED with added connections."""
    return min(math.radians(law.step_deg), ADDED if engine.additions.connection else math.inf)


def usual_film_change(law: Law, engine: Engine) -> float:
    """Default fraction by which a film may close in a step: the least value of the ruling law and all added films."""
    films = [bearing_law(table.film.level) for table in engine.additions.connection if table.film is not None]
    return min(row.film_change for row in (law, *films))


def needed_parts(engine: Engine, settings: Settings) -> tuple[str, ...]:
    """Fields of ``Parts`` that a run with resolved ``settings`` needs."""
    mains = bearing_law(settings.bearings).forms[mains_kind(engine)]
    block = ("block",) if settings.block == "flexible" else ()
    films = [film_parts(table.film, table.ends) for table in engine.additions.connection if table.film is not None]
    bores = [part for part in ("bore", "big_end_bore") if any(part in own for own in films)]
    return (*block, *mains.parts, *bores, *bearing_law(settings.big_ends).forms[BIG_END].parts)


def keeps_peaks(name: str, settings: Settings, engine: Engine) -> bool:
    """True if the largest film pressures converge as the step of an integrator shrinks; elastic films may prevent this.

    ``settings`` are resolved except for the integrator.
    """
    elastic = any(part in ("bore", "big_end_bore") for part in needed_parts(engine, settings))
    return not elastic or settles_films(name)


def check_levels(settings: Settings, engine: Engine) -> None:
    """Raise ``InputError`` for a level that does not exist, that the engine lacks, or that contradicts another level.

    ``settings`` are resolved.
    """
    for value, valid, what in (
        (settings.crank, CRANKS, "crank level"),
        (settings.bearings, bearing_levels(*MAINS), "bearing level"),
        (settings.big_ends, bearing_levels(BIG_END), "big-end level"),
        (settings.block, BLOCKS, "block level"),
        (settings.pistons, ("auto", *PISTONS), "piston level"),
        (settings.damper, DAMPERS, "damper level"),
        (settings.boundary, BOUNDARIES, "boundary"),
        (settings.control, CONTROLS, "step control"),
        (settings.dense_output, DENSE_OUTPUTS, "dense output"),
        (settings.gas_source, GAS_SOURCES, "gas source"),
        (settings.encoder, ENCODERS, "encoder"),
        (settings.reconstruction, RECONSTRUCTIONS, "input reconstruction"),
        (settings.film_temperature, FILM_TEMPERATURES, "film temperature"),
    ):
        if value not in valid:
            raise InputError(f"{what} '{value}' does not exist; {nearest(value, valid)}")
    if not bearing_law(settings.bearings).carries:
        _check_locked(settings)
    if settings.control == "adaptive":
        if not integrator(settings.integrator).embedded:
            raise InputError(
                f"integrator '{settings.integrator}' has no error estimate, which adaptive control needs; "
                f"use one of {', '.join(row.name for row in INTEGRATORS.values() if row.embedded)}"
            )
        if not LEAST_TOLERANCE <= settings.tolerance <= MOST_TOLERANCE:
            raise InputError(f"tolerance of adaptive control must be 1e-10 to 1, got {settings.tolerance:g}")
    if not 0.0 <= settings.gas_delay <= MOST_DELAY:
        raise InputError(
            f"given pressures may be 0 to {MOST_DELAY:g} communication steps late, not {settings.gas_delay:g}; 1 is "
            "that of a master whose units step at the same time"
        )
    if not 0.0 <= settings.work_limit < math.inf:
        raise InputError(f"work_limit must be 0 (no limit) or a number of iterations, not {settings.work_limit:g}")
    if settings.block == "flexible" and settings.pistons == "rigid":
        raise InputError(
            "rigid pistons run on an axis at rest and cannot follow a flexible block, which leans on its mounts; "
            "use guided pistons, or block ground"
        )
    check_mains(engine, settings.bearings)
    if settings.big_ends != "rigid" and engine.big_end_bearing is None:
        raise InputError(f"engine '{engine.name}' has no [big_end_bearing]; add it, or leave big ends rigid")
    on_rods = {"fork-and-blade": "a blade runs on its fork", ARTICULATED: "an articulated rod hangs on its master"}
    if engine.cylinders.rods_on_pin in on_rods and settings.big_ends != "rigid":
        raise InputError(
            f"big-end level '{settings.big_ends}' has a film between each rod and its pin, and "
            f"{on_rods[engine.cylinders.rods_on_pin]}; leave big ends rigid"
        )
    if any(engine.articulations) and settings.pistons == "guided":
        raise InputError(
            f"guided pistons and block '{settings.block}' do not take the side force of rods that hang on a master "
            "rod; use rigid pistons and block ground"
        )
    if settings.pistons == "guided" and engine.piston_guidance is None:
        raise InputError(f"engine '{engine.name}' has no [piston_guidance]; add it, or leave pistons rigid")
    if settings.block == "flexible" and (engine.block is None or engine.mounts is None):
        lacking = "block" if engine.block is None else "mounts"
        raise InputError(f"engine '{engine.name}' has no [{lacking}]; add it, or leave the block ground")
    if settings.block == "flexible":
        need_constant_mounts(engine)
    if settings.damper == "fitted":
        required_damper(engine)
    if not keeps_peaks(settings.integrator, settings, engine):
        raise InputError(
            f"the largest pressures of elastic films do not converge with integrator '{settings.integrator}'; use "
            f"auto, or one of {', '.join(name for name in INTEGRATORS if settles_films(name))}"
        )


def _check_locked(settings: Settings) -> None:
    """Refuse levels that cannot be combined with journals locked on their axis; ``InputError``."""
    level = settings.bearings
    if CRANKS[settings.crank].bends:
        raise InputError(
            f"bearing level '{level}' locks the axis of a crank that cannot bend, not of crank level "
            f"'{settings.crank}'; use linear or impedance, or crank torsional"
        )
    if bearing_law(settings.big_ends).carries:
        raise InputError(f"pins run in no film at bearing level '{level}'; use rigid big ends, or bearing films")
    if settings.block == "flexible":
        raise InputError(f"bearing level '{level}' does not meet a flexible block; use bearings impedance")
