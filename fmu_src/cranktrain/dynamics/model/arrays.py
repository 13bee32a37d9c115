"""The running model as flat arrays: what an engine, a reduced body and the chosen levels amount to.

Where force laws act, and on which components of motion, is laid out in :mod:`cranktrain.dynamics.model.ports`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.model.block import BlockArrays, block_arrays
from cranktrain.dynamics.model.bodies import held, standing_body, with_big_ends, with_rotor
from cranktrain.dynamics.model.mains import HELD, check_mains, main_bearings
from cranktrain.dynamics.model.ports import PORTS, TURNING_MODES, lay_ports
from cranktrain.dynamics.time.integrator_tables import EMBEDDED, ORDERS, amplification, integrator_table
from cranktrain.engine.lubricant import oil_temperature, viscosity
from cranktrain.engine.model import Engine
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.laws.bearings import floating_films
from cranktrain.film.laws.films import Films
from cranktrain.film.laws.impedance import impedance_map
from cranktrain.film.laws.parameters import KAPPA2
from cranktrain.film.laws.plane import bearing_parameters
from cranktrain.film.laws.register import BIG_END, MAINS, PLAIN, ROLLER, bearing_law, bearing_levels, usual_level
from cranktrain.film.laws.thrust import thrust_parameters
from cranktrain.film.table.database import FilmTable
from cranktrain.loads.damper import PARAMETERS, damper_parameters, damper_temperature, required_damper
from cranktrain.loads.gas_pressure import GasTrace, kinks, spline_coefficients
from cranktrain.loads.slider_crank import remainder_inertia

# Columns of a cylinder's parameters.
M_SMALL, BANK, PHASE, AREA, ROD, M_BIG, M_OSC, DELTA_J, OFFSET, CLEARANCE_VOLUME, STROKE_TOP = range(11)
# Scalars of the model; ``DRIVEN`` is 1 where the shaft's speed is given, 0 where a torque loads it.
GRAVITY, CRANKCASE, GAS_LOAD, BEST_SPEED, FALLOFF, SHAFT_K, SHAFT_C, FILTER, RIGID_ROTATION, STEP = range(10)
DRIVEN, DAMPER_TEMPERATURE, SCALARS = 10, 11, 12
# Gas source and input reconstruction.
GAS_SOURCES = {"auto": 0, "builtin": 1, "input": 2}
RECONSTRUCTIONS = {"hold": 0, "linear": 1, "interpolate": 2}
CRANK_LEVELS = ("rigid", "torsional", "beam", "solid")
BLOCK_LEVELS = ("ground", "flexible")
PISTON_LEVELS = ("auto", "rigid", "guided")
DAMPER_LEVELS = ("none", "fitted")
CONTROLS = ("fixed", "adaptive")
BOUNDARIES = {"speed": 1.0, "torque": 0.0}
"""What is given at the dynamometer."""
AMBIENT = 101325.0
LEVELS = 7
"""Step sizes whose factors are kept at once: the whole step, its half, quarter, … ."""


@dataclass(frozen=True)
class Settings:
    """Choices of one run; angles rad, pressures Pa, temperatures K (0: from the engine's tables at the first speed).

    What is left open follows the level, see :func:`resolved`: ``integrator`` auto; ``newton_tolerance`` of the ports in
    units of clearance; ``film_change``, the share of itself by which a film may close over a step. With ``control``
    adaptive steps are parts of ``step``, as short as an error per step of ``tolerance`` asks
    (:mod:`cranktrain.dynamics.time.error_estimate`).
    """

    crank: str = "solid"
    bearings: str = "auto"
    big_ends: str = "rigid"
    block: str = "ground"
    pistons: str = "auto"
    damper: str = "none"
    boundary: str = "speed"
    integrator: str = "auto"
    step: float = math.radians(2.5)
    control: str = "fixed"
    tolerance: float = 1.0e-3
    gas_source: str = "auto"
    gas_load: float = 1.0
    reconstruction: str = "linear"
    crankcase_pressure: float = AMBIENT
    oil_temperature: float = 0.0
    damper_temperature: float = 0.0
    gravity: float = 9.80665
    newton_tolerance: float | None = None
    film_change: float | None = None


def resolved(settings: Settings, engine: Engine) -> Settings:
    """The settings with nothing left open for this engine.

    A crank that only twists is held in its main bearings; else they are rollers where the engine has them, else films
    without tilt. Elastic films: what they do as they
    close, and their voids, leave no use for an order above two; their least gap asks for shorter steps. Films that feel
    tilt cost more than what a tighter tolerance would gain. Pistons are guided by a flexible block's liners.
    """
    bearings = settings.bearings
    if bearings == "auto" and settings.crank == "torsional":
        bearings = HELD
    if bearings == "auto":
        bearings = usual_level(PLAIN if engine.main_roller is None else ROLLER)
    pistons = settings.pistons
    if pistons == "auto":
        pistons = "guided" if settings.block == "flexible" else "rigid"
    law = bearing_law(bearings)
    integrator = law.integrator if settings.integrator == "auto" else settings.integrator
    usual = law.tolerance / amplification(integrator)
    chosen: dict[str, Any] = {
        "bearings": bearings,
        "pistons": pistons,
        "integrator": integrator,
        "newton_tolerance": settings.newton_tolerance or usual,
        "film_change": settings.film_change or law.film_change,
    }
    return replace(settings, **chosen)


class ModelArrays(NamedTuple):
    """Contiguous float64 arrays of the running model (SI).

    n modes: n_t of bodies that turn, n_b of the block, two of each guided piston; m ports likewise; b main bearings, c
    cylinders.
    """

    omega2: Array  # (n,)
    damping: Array  # (n,) modal damping, 1/s
    gyroscopic: Array  # (n_t, n_t) G transposed
    spin: Array  # (n_t, n_t) (K_σ − C) transposed
    centrifugal_load: Array  # (n_t,)
    euler_load: Array  # (n_t,)
    gravity: Array  # (3, n) modal projection of a unit acceleration field
    ports: Array  # (m_t, n_t) shapes
    ports_transposed: Array  # (n_t, m_t)
    block_ports: Array  # (m_b, n_b) shapes
    block_ports_transposed: Array  # (n_b, m_b)
    pairs: Array  # (r, 2) see dynamics.ports
    axial: Array  # (0 or 1, 2)
    shaft: Array  # (n_t,) twist of the connecting shaft: flywheel's rotation, less the rotor's where that is free
    rotor: Array  # (n_t,) the free rotor's rotation, else 0
    block: BlockArrays
    ends: Array  # (3, n_t): flywheel z-rotation, pulley z-rotation, pulley z
    tilts: Array  # (2b, n_t): rotation about x and y of each main journal
    bearings: Array  # (b, 13) see film.laws
    thrust: Array  # see film.thrust
    pins: Array  # (c, 2) undeformed x, y of each rod's pin
    big_ends: Array  # (c, 13) like ``bearings``: the film between pin and rod, where the big end is not rigid
    floating: Films  # of the big ends where they are read from a table
    connections: Array  # (k, 5) force laws: number of Newton ports that each couples, then those ports
    scales: Array  # (n_newton,) displacement of a Newton port that counts as much as a clearance
    layout: Array  # (12,) see dynamics.ports
    damper: Array  # see loads.damper
    cylinders: Array  # (c, 11)
    gas: Array  # (2, k, 4) periodic splines over a cycle: motored, rise by combustion
    impedance: Array  # film.impedance map of the main bearings
    big_end_impedance: Array  # likewise of the big ends
    films: Films  # of the main bearings where they feel tilt, with their memory of a step
    scalars: Array  # (12,)
    kinks: Array  # (k,) angles after firing dead centre at which the built-in trace is least smooth
    choices: Array  # (7,) gas source, reconstruction, Newton tolerance, largest change of a film over a step, tolerance
    # of adaptive control (0: fixed steps), order of its embedded method, order of the method
    stages: Array  # integrator table, see integrators


class Dimensions(NamedTuple):
    """Sizes that follow from the arrays."""

    modes: int
    turning_modes: int
    bearings: int
    cylinders: int
    newton: int
    ports: int
    turning_ports: int
    films: int  # values of elastic films in the state


def dimensions(model: ModelArrays) -> Dimensions:
    """Sizes of a model."""
    b = model.bearings.shape[0]
    films = b * int(model.films.values[0])
    turning = int(model.layout[TURNING_MODES])
    return Dimensions(
        model.omega2.size, turning, b, model.cylinders.shape[0], model.scales.size, int(model.layout[PORTS]),
        model.ports.shape[0], films,
    )  # fmt: skip


def structural_damping(engine: Engine, body: ReducedBody) -> Array:
    """Damping of each mode, (n,) 1/s: 2ζω, or α + βω² on the elastic modes only (a rigid body has none inside)."""
    d = engine.damping
    elastic = body.omega > 0.0
    if d.kind == "modal":
        return np.asarray(2.0 * d.ratio * body.omega)
    return np.asarray(np.where(elastic, d.alpha + d.beta * body.omega**2, 0.0))


class Parts(NamedTuple):
    """What a run may need besides the crankshaft: each serves the level that asks for it."""

    table: FilmTable | None = None  # films of the main bearings, level ``table``
    bore: BoreCompliance | None = None  # elastic main bores, level ``ehd``
    big_end_table: FilmTable | None = None  # films of the big ends, level ``table``
    block: ReducedBody | None = None  # the block, level ``flexible``


def check_levels(settings: Settings, engine: Engine) -> None:
    """Refuse a level that does not exist, that the engine lacks, or that makes no sense beside another; ``InputError``.

    ``settings`` have nothing left open.
    """
    for value, valid, what in (
        (settings.crank, CRANK_LEVELS, "crank level"),
        (settings.bearings, bearing_levels(*MAINS), "bearing level"),
        (settings.big_ends, bearing_levels(BIG_END), "big-end level"),
        (settings.block, BLOCK_LEVELS, "block level"),
        (settings.pistons, PISTON_LEVELS, "piston level"),
        (settings.damper, DAMPER_LEVELS, "damper level"),
        (settings.boundary, BOUNDARIES, "boundary"),
        (settings.control, CONTROLS, "step control"),
        (settings.gas_source, GAS_SOURCES, "gas source"),
        (settings.reconstruction, RECONSTRUCTIONS, "input reconstruction"),
    ):
        if value not in valid:
            raise InputError(f"{what} '{value}' does not exist; {nearest(value, valid)}")
    if settings.bearings == HELD and settings.crank not in ("rigid", "torsional"):
        raise InputError(
            f"bearing level 'held' holds the axis of a crank that cannot bend, not of crank level '{settings.crank}'; "
            "use linear or impedance, or crank torsional"
        )
    if settings.bearings == HELD and settings.big_ends != "rigid":
        raise InputError("pins of a crank whose journals are held run in no film; use rigid big ends, or bearing films")
    if settings.bearings == HELD and settings.block == "flexible":
        raise InputError("a crank whose journals are held does not meet a flexible block; use bearings impedance")
    if settings.control == "adaptive":
        base = settings.integrator.partition(":")[0]
        integrator_table(settings.integrator)
        if base not in EMBEDDED:
            raise InputError(
                f"integrator '{settings.integrator}' has no error estimate, which adaptive control needs; "
                f"use one of {', '.join(EMBEDDED)}"
            )
        if not 1.0e-10 <= settings.tolerance <= 1.0:
            raise InputError(f"tolerance of adaptive control must be 1e-10 to 1, got {settings.tolerance:g}")
    if settings.block == "flexible" and settings.pistons == "rigid":
        raise InputError(
            "rigid pistons run on an axis at rest and cannot follow a flexible block, which leans on its mounts; "
            "use guided pistons, or block ground"
        )
    check_mains(engine, settings.bearings)
    if settings.big_ends != "rigid" and engine.big_end_bearing is None:
        raise InputError(f"engine '{engine.name}' has no [big_end_bearing]; add it, or leave big ends rigid")
    if settings.pistons == "guided" and engine.piston_guidance is None:
        raise InputError(f"engine '{engine.name}' has no [piston_guidance]; add it, or leave pistons rigid")
    if settings.block == "flexible" and (engine.block is None or engine.mounts is None):
        lacking = "block" if engine.block is None else "mounts"
        raise InputError(f"engine '{engine.name}' has no [{lacking}]; add it, or leave the block ground")
    if settings.damper == "fitted":
        required_damper(engine)


def build_model(
    engine: Engine,
    body: ReducedBody,
    settings: Settings,
    speed: float,
    gas: GasTrace,
    stages: Array,
    parts: Parts | None = None,
    temperatures: Array | None = None,
) -> ModelArrays:
    """Arrays of the running model at the oil temperature of ``speed`` (rad/s).

    ``body`` is the crankshaft with flywheel and pulley attached, and with the damper's housing where there is one.
    ``temperatures`` (b,), K, gives each main bearing's film its own; without them, and at the thrust bearing and the
    big ends, all oil is as warm as the engine's.
    ``InputError`` for a level that does not exist, or that lacks what it needs.
    """
    settings, parts = resolved(settings, engine), parts or Parts()
    check_levels(settings, engine)
    flywheel, pulley = body.index("flywheel"), body.index("pulley")
    eta = viscosity(engine.oil, supply_temperature(engine, settings, speed))
    flexible = settings.block == "flexible"
    journals, mains, films = main_bearings(engine, settings.bearings, eta, temperatures, parts.table, parts.bore)
    # Rigid big ends have no film, but kernels want one of the same form.
    floating = engine.big_end_bearing or engine.main_bearing
    big_ends = np.zeros((engine.n_cylinders, 13))
    if floating is not None:
        big_ends[:] = bearing_parameters(floating, eta, "table" if settings.big_ends == "table" else "impedance")
    if settings.bearings == HELD:
        body = held(body)
    linear = not bearing_law(settings.bearings).clearance
    thrust = replace(engine.thrust, block_stiffness=math.inf) if flexible else engine.thrust
    crank_modes, crank_mass, crank_centre = body.n_modes, body.mass, body.centre
    if settings.big_ends != "rigid":
        body = with_big_ends(body, engine)
    damper, scalars = np.zeros(PARAMETERS), np.zeros(SCALARS)
    if settings.damper == "fitted":
        fitted = required_damper(engine)
        warmth = settings.damper_temperature or damper_temperature(fitted, speed)
        damper, scalars[DAMPER_TEMPERATURE] = damper_parameters(fitted, warmth), warmth
        body = with_rotor(body, "ring", "pulley", fitted.ring_inertia)
    driven = BOUNDARIES[settings.boundary]
    if not driven:
        body = with_rotor(body, "rotor", "flywheel", engine.drive_line.dynamometer_inertia)
    if flexible and parts.block is None:
        raise InputError("block level 'flexible' needs the reduced block; make it by structure.block")
    block = parts.block if flexible else None
    standing = standing_body(engine, block, settings.pistons == "guided")
    ports = lay_ports(
        engine, body, crank_modes, journals,
        free_big_ends=settings.big_ends != "rigid", ring=settings.damper == "fitted",
        block=block, pistons=settings.pistons == "guided",
    )  # fmt: skip
    shapes = body.shapes
    n_standing = standing.n_modes if standing is not None else 0
    rotor = np.zeros(body.n_modes) if driven else shapes[body.index("rotor"), 5]
    scalars[GRAVITY] = settings.gravity
    scalars[CRANKCASE] = settings.crankcase_pressure
    scalars[GAS_LOAD] = settings.gas_load
    scalars[BEST_SPEED] = gas.best_speed
    scalars[FALLOFF] = gas.falloff
    scalars[SHAFT_K] = engine.drive_line.stiffness
    scalars[SHAFT_C] = engine.drive_line.damping
    tau = engine.drive_line.speed_filter_time
    scalars[FILTER] = 1.0 / tau if tau > 0.0 else 0.0
    scalars[RIGID_ROTATION] = shapes[pulley, 5, 5]
    scalars[STEP] = settings.step
    scalars[DRIVEN] = driven
    rise = gas.fired - gas.motored
    contiguous = np.ascontiguousarray
    omega = np.concatenate((body.omega, standing.omega if standing is not None else np.zeros(0)))
    still_damping = np.zeros(n_standing)
    if engine.block is not None and standing is not None:
        still_damping = 2.0 * engine.block.damping_ratio * standing.omega
    translation = np.zeros((3, n_standing)) if standing is None else standing.translation
    tilts = np.zeros((0, body.n_modes))
    if len(mains):
        tilts = np.concatenate([shapes[body.index(f"main[{i + 1}]"), 3:5] for i in range(len(mains))])
    pins = [body.positions[body.index(f"pin[{pin}]"), :2] for pin in engine.cylinders.pins]
    return ModelArrays(
        omega2=contiguous(omega**2),
        damping=np.concatenate((structural_damping(engine, body), still_damping)),
        gyroscopic=contiguous(body.gyroscopic.T),
        spin=contiguous((body.stress_stiffness - body.centrifugal).T),
        centrifugal_load=contiguous(body.centrifugal_load),
        euler_load=contiguous(body.euler_load),
        gravity=np.concatenate((body.translation, translation), axis=1),
        ports=ports.turning,
        ports_transposed=contiguous(ports.turning.T),
        block_ports=ports.block,
        block_ports_transposed=contiguous(ports.block.T),
        pairs=ports.pairs,
        axial=ports.axial,
        shaft=contiguous(shapes[flywheel, 5] - rotor),
        rotor=contiguous(rotor),
        block=block_arrays(engine, standing, block, crank_mass, crank_centre, settings.gravity),
        ends=contiguous(np.array([shapes[flywheel, 5], shapes[pulley, 5], shapes[pulley, 2]])),
        tilts=contiguous(tilts),
        bearings=mains,
        thrust=thrust_parameters(thrust, eta, linear),
        pins=contiguous(pins),
        big_ends=big_ends,
        floating=floating_films(floating, settings.big_ends, big_ends, parts.big_end_table),
        connections=ports.connections,
        scales=ports.scales,
        layout=ports.layout,
        damper=damper,
        cylinders=cylinder_parameters(engine, settings.big_ends != "rigid"),
        gas=contiguous(np.array([spline_coefficients(gas.motored), spline_coefficients(rise)])),
        impedance=_impedance(mains),
        big_end_impedance=_impedance(big_ends),
        films=films,
        scalars=scalars,
        kinks=kinks(gas.fired),
        choices=np.array(
            [
                float(GAS_SOURCES[settings.gas_source]),
                float(RECONSTRUCTIONS[settings.reconstruction]),
                settings.newton_tolerance,
                settings.film_change,
                settings.tolerance if settings.control == "adaptive" else 0.0,
                EMBEDDED.get(settings.integrator.partition(":")[0], 0),
                max(2, ORDERS[settings.integrator.partition(":")[0]]),
            ],
            dtype=np.float64,
        ),
        stages=contiguous(stages),
    )


def _impedance(bearings: Array) -> Array:
    """Impedance map of bearings alike, or of none: rollers and held journals have no film."""
    return impedance_map(float(bearings[0, KAPPA2] if len(bearings) else 0.0) or 1.0)


def supply_temperature(engine: Engine, settings: Settings, speed: float) -> float:
    """Temperature of the engine's oil at ``speed`` (rad/s), K: that of all films, or of the oil supplied to them."""
    return settings.oil_temperature or oil_temperature(engine.oil, speed)


def cylinder_parameters(engine: Engine, free_big_ends: bool) -> Array:
    """Pack rods, pistons and phases, (c, 11); the mass of a free big end is a body of its own."""
    cylinders, rod = engine.cylinders, engine.rod
    area = 0.25 * math.pi * cylinders.bore**2
    throw, e = engine.crankshaft.throw, cylinders.pin_offset
    # Highest piston-pin position: rod and throw in line.
    top = math.sqrt((rod.length + throw) ** 2 - e * e)
    bottom = math.sqrt((rod.length - throw) ** 2 - e * e)
    clearance = area * (top - bottom) / (cylinders.compression_ratio - 1.0)
    rows = [
        [
            rod.small_end_mass,
            cylinders.bank_angles[k],
            engine.firing_angles[k],
            area,
            rod.length,
            0.0 if free_big_ends else rod.big_end_mass,
            rod.small_end_mass + cylinders.piston_mass,
            remainder_inertia(rod),
            e,
            clearance,
            top,
        ]
        for k in range(engine.n_cylinders)
    ]
    return np.array(rows, dtype=np.float64)
