"""The running model as flat arrays: what an engine, a reduced body and the chosen levels amount to.

Where force laws act, and on which components of motion, is laid out in :mod:`cranktrain.dynamics.ports`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from cranktrain.dynamics.big_ends import with_big_ends
from cranktrain.dynamics.ports import lay_ports
from cranktrain.engine import Engine
from cranktrain.errors import InputError, nearest
from cranktrain.film.bore_compliance import BoreCompliance
from cranktrain.film.database import FilmTable
from cranktrain.film.impedance import impedance_map
from cranktrain.film.laws import BIG_END_LEVELS, LAWS, TILTED, bearing_parameters
from cranktrain.film.parameters import KAPPA2
from cranktrain.film.thrust import thrust_parameters
from cranktrain.film.tilted import Films
from cranktrain.film.tilted_levels import floating_films, tilted_films
from cranktrain.loads.gas_pressure import GasTrace, spline_coefficients
from cranktrain.loads.slider_crank import remainder_inertia
from cranktrain.lubricant import oil_temperature, viscosity
from cranktrain.reduced_body import Array, ReducedBody

# Columns of a cylinder's parameters.
PIN, BANK, PHASE, AREA, ROD, M_BIG, M_OSC, DELTA_J, OFFSET, CLEARANCE_VOLUME, STROKE_TOP = range(11)
# Scalars of the model.
GRAVITY, CRANKCASE, GAS_LOAD, BEST_SPEED, FALLOFF, SHAFT_K, SHAFT_C, FILTER, RIGID_ROTATION, STEP = range(10)
# Gas source and input reconstruction.
GAS_SOURCES = {"auto": 0, "builtin": 1, "input": 2}
RECONSTRUCTIONS = {"hold": 0, "linear": 1, "interpolate": 2}
CRANK_LEVELS = ("rigid", "solid")
AMBIENT = 101325.0
LEVELS = 4
"""Step sizes whose factors are kept at once: the whole step, its half, quarter and eighth."""


@dataclass(frozen=True)
class Settings:
    """Choices of one run; angles rad, pressures Pa, temperature K (0: from the engine's table at the first speed).

    What is left open follows the level, see :func:`resolved`: ``integrator`` auto; ``newton_tolerance`` of the ports in
    units of clearance; ``film_change``, the share of itself by which a film may close over a step.
    """

    crank: str = "solid"
    bearings: str = "impedance"
    big_ends: str = "rigid"
    integrator: str = "auto"
    step: float = math.radians(2.5)
    gas_source: str = "auto"
    gas_load: float = 1.0
    reconstruction: str = "linear"
    crankcase_pressure: float = AMBIENT
    oil_temperature: float = 0.0
    gravity: float = 9.80665
    newton_tolerance: float | None = None
    film_change: float | None = None


def resolved(settings: Settings) -> Settings:
    """The settings with nothing left open.

    Elastic films: what they do as they close, and their voids, leave no use for an order above two; their least gap
    asks for shorter steps. Films that feel tilt cost more than what a tighter tolerance would gain.
    """
    elastic = settings.bearings == "ehd"
    chosen: dict[str, Any] = {
        "integrator": ("sdirk2" if elastic else "sdirk4") if settings.integrator == "auto" else settings.integrator,
        "newton_tolerance": settings.newton_tolerance or (1.0e-5 if settings.bearings in TILTED else 3.0e-7),
        "film_change": settings.film_change or (0.15 if elastic else 0.25),
    }
    return replace(settings, **chosen)


class ModelArrays(NamedTuple):
    """Contiguous float64 arrays of the running model (SI); n modes, b main bearings, p pins, c cylinders, m ports."""

    omega2: Array  # (n,)
    damping: Array  # (n,) modal damping, 1/s
    gyroscopic: Array  # (n, n) G transposed
    spin: Array  # (n, n) (K_σ − C) transposed
    centrifugal_load: Array  # (n,)
    euler_load: Array  # (n,)
    gravity: Array  # (3, n) modal projection of a unit acceleration field
    ports: Array  # (m, n) shapes
    ports_transposed: Array  # (n, m)
    ends: Array  # (3, n): flywheel z-rotation, pulley z-rotation, pulley z
    tilts: Array  # (2b, n): rotation about x and y of each main journal
    bearings: Array  # (b, 13) see film.laws
    thrust: Array  # see film.thrust
    pins: Array  # (p, 2) undeformed x, y
    big_ends: Array  # (c, 13) like ``bearings``: the film between pin and rod, where the big end is not rigid
    floating: Films  # of the big ends where they are read from a table
    connections: Array  # (k, 5) force laws: number of Newton ports that each couples, then those ports
    scales: Array  # (n_newton,) displacement of a Newton port that counts as much as a clearance
    layout: Array  # (6,) see dynamics.ports
    cylinders: Array  # (c, 11)
    gas: Array  # (2, k, 4) periodic splines over a cycle: motored, rise by combustion
    impedance: Array  # film.impedance map of the main bearings
    big_end_impedance: Array  # likewise of the big ends
    films: Films  # of the main bearings where they feel tilt, with their memory of a step
    scalars: Array  # (10,)
    choices: Array  # (4,) gas source, reconstruction, Newton tolerance, largest change of a film over a step
    stages: Array  # integrator table, see integrators


class Dimensions(NamedTuple):
    """Sizes that follow from the arrays."""

    modes: int
    bearings: int
    pins: int
    cylinders: int
    newton: int
    ports: int
    films: int  # values of elastic films in the state


def dimensions(model: ModelArrays) -> Dimensions:
    """Sizes of a model."""
    b, p = model.bearings.shape[0], model.pins.shape[0]
    films = b * int(model.films.values[0])
    return Dimensions(model.omega2.size, b, p, model.cylinders.shape[0], model.scales.size, model.ports.shape[0], films)


def structural_damping(engine: Engine, body: ReducedBody) -> Array:
    """Damping of each mode, (n,) 1/s: 2ζω, or α + βω² on the elastic modes only (a rigid body has none inside)."""
    d = engine.damping
    elastic = body.omega > 0.0
    if d.kind == "modal":
        return np.asarray(2.0 * d.ratio * body.omega)
    return np.asarray(np.where(elastic, d.alpha + d.beta * body.omega**2, 0.0))


def build_model(
    engine: Engine,
    body: ReducedBody,
    settings: Settings,
    speed: float,
    gas: GasTrace,
    stages: Array,
    table: FilmTable | None = None,
    bore: BoreCompliance | None = None,
    temperatures: Array | None = None,
    big_end_table: FilmTable | None = None,
) -> ModelArrays:
    """Arrays of the running model at the oil temperature of ``speed`` (rad/s).

    ``body`` is the crankshaft with flywheel and pulley attached, ``table`` the films of level ``table``, ``bore`` the
    elastic main bores of level ``ehd``, ``big_end_table`` the films of big ends. ``temperatures`` (b,), K, gives each
    main bearing's film its own; without them, and at the thrust bearing and the big ends, all oil is as warm as the
    engine's.
    ``InputError`` for a level that does not exist, or that lacks what it needs.
    """
    settings = resolved(settings)
    for value, valid, what in (
        (settings.crank, CRANK_LEVELS, "crank level"),
        (settings.bearings, LAWS, "bearing level"),
        (settings.big_ends, BIG_END_LEVELS, "big-end level"),
        (settings.gas_source, GAS_SOURCES, "gas source"),
        (settings.reconstruction, RECONSTRUCTIONS, "input reconstruction"),
    ):
        if value not in valid:
            raise InputError(f"{what} '{value}' does not exist; {nearest(value, valid)}")
    flywheel, pulley = body.index("flywheel"), body.index("pulley")
    eta = viscosity(engine.oil, supply_temperature(engine, settings, speed))
    linear = settings.bearings == "linear"
    mains = _main_bearings(engine, settings.bearings, eta, temperatures)
    # Rigid big ends have no film, but kernels want one of the same form.
    floating = engine.big_end_bearing or engine.main_bearing
    big_end = bearing_parameters(floating, eta, "table" if settings.big_ends == "table" else "impedance")
    thrust_law = thrust_parameters(engine.thrust, eta, linear)
    n_mains, n_pins = len(engine.crankshaft.main_widths), len(engine.crankshaft.throw_angles)
    crank_modes = body.n_modes
    if settings.big_ends != "rigid":
        if engine.big_end_bearing is None:
            raise InputError(f"engine '{engine.name}' has no [big_end_bearing]; add it, or leave big ends rigid")
        body = with_big_ends(body, engine)
    shapes = body.shapes
    ports = lay_ports(engine, body, crank_modes, settings.bearings in TILTED, settings.big_ends != "rigid")
    scalars = np.zeros(10)
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
    rise = gas.fired - gas.motored
    contiguous = np.ascontiguousarray
    return ModelArrays(
        omega2=contiguous(body.omega**2),
        damping=contiguous(structural_damping(engine, body)),
        gyroscopic=contiguous(body.gyroscopic.T),
        spin=contiguous((body.stress_stiffness - body.centrifugal).T),
        centrifugal_load=contiguous(body.centrifugal_load),
        euler_load=contiguous(body.euler_load),
        gravity=contiguous(body.translation),
        ports=contiguous(ports.shapes),
        ports_transposed=contiguous(ports.shapes.T),
        ends=contiguous(np.array([shapes[flywheel, 5], shapes[pulley, 5], shapes[pulley, 2]])),
        tilts=contiguous(np.concatenate([shapes[body.index(f"main[{i + 1}]"), 3:5] for i in range(n_mains)])),
        bearings=mains,
        thrust=thrust_law,
        pins=contiguous([body.positions[body.index(f"pin[{i + 1}]"), :2] for i in range(n_pins)]),
        big_ends=contiguous(np.tile(big_end, (engine.n_cylinders, 1))),
        floating=floating_films(
            floating, settings.big_ends, np.tile(big_end, (engine.n_cylinders, 1)), big_end_table
        ),
        connections=ports.connections,
        scales=ports.scales,
        layout=ports.layout,
        cylinders=cylinder_parameters(engine, settings.big_ends != "rigid"),
        gas=contiguous(np.array([spline_coefficients(gas.motored), spline_coefficients(rise)])),
        impedance=impedance_map(float(mains[0, KAPPA2])),
        big_end_impedance=impedance_map(float(big_end[KAPPA2])),
        films=tilted_films(engine.main_bearing, settings.bearings, mains, table, bore),
        scalars=scalars,
        choices=np.array(
            [
                float(GAS_SOURCES[settings.gas_source]),
                float(RECONSTRUCTIONS[settings.reconstruction]),
                settings.newton_tolerance,
                settings.film_change,
            ],
            dtype=np.float64,
        ),
        stages=contiguous(stages),
    )


def supply_temperature(engine: Engine, settings: Settings, speed: float) -> float:
    """Temperature of the engine's oil at ``speed`` (rad/s), K: that of all films, or of the oil supplied to them."""
    return settings.oil_temperature or oil_temperature(engine.oil, speed)


def _main_bearings(engine: Engine, level: str, eta: float, temperatures: Array | None) -> Array:
    """Parameters of the main bearings, (b, 13), at viscosity ``eta``, or each at that of its own temperature."""
    count = len(engine.crankshaft.main_widths)
    if temperatures is None:
        return np.tile(bearing_parameters(engine.main_bearing, eta, level), (count, 1))
    if np.shape(temperatures) != (count,):
        raise InputError(f"film temperatures of the form {np.shape(temperatures)}; give one for each of {count} mains")
    etas = [viscosity(engine.oil, float(temperature)) for temperature in temperatures]
    return np.array([bearing_parameters(engine.main_bearing, own, level) for own in etas])


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
            cylinders.pins[k] - 1,
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


class Work(NamedTuple):
    """Memory that the caller owns: factors, matrices and vectors of a stage. Results never depend on what it holds."""

    key: Array  # (levels, 2) step and speed that the factors of each level below were made for
    factors: Array  # (n, n) scratch
    inverse: Array  # (levels, n, n) S⁻¹ transposed
    damping: Array  # (levels, n, n) D + 2Ω₀G + drive line, transposed
    response: Array  # (levels, m, n) S⁻¹Φᵀ, row per port
    compliance: Array  # (levels, m, m) Φ S⁻¹ Φᵀ, transposed
    jacobian: Array  # (n_newton, n_newton)
    blocks: Array  # (k, 16) force tangents of each connection, 4 × 4 row-major
    held: Array  # (k, 16) the tangents that the Newton matrix was made from
    modal: Array  # (12, n) vectors
    port: Array  # (15, m) vectors
    stage: Array  # (stages, 3, n) q, v, a of each stage
    known: Array  # (stages, 3, m) the ports' u, u̇, ü at each stage
    scratch: Array  # (64,)
    counters: Array  # (6,) steps, stages, Newton iterations, rejected steps, factorisations, worst residual
    frames: Array  # (8, 8) the frame's motion at each stage
    pressures: Array  # (8, c) cylinder pressures at each stage
    inputs: Array  # (2, 1 + c) value and rate of the reconstructed inputs
    backup: Array  # (2, state) state at the start of a communication step and of a sub-step


def make_work(model: ModelArrays, state_size: int) -> Work:
    """Allocate the workspace of one model."""
    d = dimensions(model)
    n, m = d.modes, d.ports
    z = np.zeros
    return Work(
        key=z((LEVELS, 2)),
        factors=z((n, n)),
        inverse=z((LEVELS, n, n)),
        damping=z((LEVELS, n, n)),
        response=z((LEVELS, m, n)),
        compliance=z((LEVELS, m, m)),
        jacobian=z((d.newton, d.newton)),
        blocks=z((model.connections.shape[0], 16)),
        held=z((model.connections.shape[0], 16)),
        modal=z((12, n)),
        port=z((15, m)),
        stage=z((8, 3, n)),
        known=z((8, 3, m)),
        scratch=z(64),
        counters=z(6),
        frames=z((8, 8)),
        pressures=z((8, d.cylinders)),
        inputs=z((2, 1 + d.cylinders)),
        backup=z((2, state_size)),
    )
