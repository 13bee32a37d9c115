"""The running model as flat arrays: what an engine, a reduced body and the chosen levels amount to.

Where force laws act, and on which components of motion, is laid out in :mod:`cranktrain.dynamics.model.ports`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.model.block import BlockArrays, block_arrays
from cranktrain.dynamics.model.bodies import held, standing_body, with_big_ends, with_rotor
from cranktrain.dynamics.model.mains import main_bearings
from cranktrain.dynamics.model.ports import lay_ports
from cranktrain.dynamics.model.settings import (
    BOUNDARIES,
    GAS_SOURCES,
    RECONSTRUCTIONS,
    Settings,
    check_levels,
    resolved,
)
from cranktrain.dynamics.model.slots import (
    BEST_SPEED,
    CRANKCASE,
    DAMPER_TEMPERATURE,
    DRIVEN,
    FALLOFF,
    FILTER,
    GAS_LOAD,
    GRAVITY,
    PORTS,
    RIGID_ROTATION,
    SCALARS,
    SHAFT_C,
    SHAFT_K,
    STEP,
    TURNING_MODES,
)
from cranktrain.dynamics.time.integrator_tables import EMBEDDED, ORDERS
from cranktrain.engine.lubricant import oil_temperature, viscosity
from cranktrain.engine.model import Engine
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.laws.bearings import Bearings, bearing_parameters, law_films, thrust_bearing
from cranktrain.film.laws.films import MEMORY, Films
from cranktrain.film.laws.parameters import COLUMNS
from cranktrain.film.laws.register import BIG_END, bearing_law
from cranktrain.film.table.database import FilmTable
from cranktrain.loads.damper import PARAMETERS, damper_parameters, damper_temperature, required_damper
from cranktrain.loads.gas_pressure import GasTrace, kinks, spline_coefficients
from cranktrain.loads.slider_crank import remainder_inertia


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
    bearings: Array  # (b, COLUMNS) see film.laws.parameters
    films: Films  # of the main bearings, with their memory of a step
    thrust: Films  # the thrust bearing, see film.laws.thrust
    pins: Array  # (c, 2) undeformed x, y of each rod's pin
    big_ends: Array  # (c, COLUMNS) like ``bearings``: the film between pin and rod, where the big end is not rigid
    floating: Films  # of the big ends
    connections: Array  # (k, 5) force laws: number of Newton ports that each couples, then those ports
    scales: Array  # (n_newton,) displacement of a Newton port that counts as much as a clearance
    layout: Array  # (12,) see dynamics.ports
    damper: Array  # see loads.damper
    cylinders: Array  # (c, 11)
    gas: Array  # (2, k, 4) periodic splines over a cycle: motored, rise by combustion
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
    films = b * int(model.films.traits[MEMORY])
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
    big_ends = np.zeros((engine.n_cylinders, COLUMNS))
    if engine.big_end_bearing is not None:
        big_ends[:] = bearing_parameters(engine.big_end_bearing, eta)
    pin_films = Bearings(big_ends, engine.big_end_bearing, parts={"big_end_table": parts.big_end_table})
    law = bearing_law(settings.bearings)
    if not law.carries:
        body = held(body)
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
        thrust=thrust_bearing(thrust, eta, law.clearance, journals.tilted),
        pins=contiguous(pins),
        big_ends=big_ends,
        floating=law_films(bearing_law(settings.big_ends), BIG_END, pin_films),
        connections=ports.connections,
        scales=ports.scales,
        layout=ports.layout,
        damper=damper,
        cylinders=cylinder_parameters(engine, settings.big_ends != "rigid"),
        gas=contiguous(np.array([spline_coefficients(gas.motored), spline_coefficients(rise)])),
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
