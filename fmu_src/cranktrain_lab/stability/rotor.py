"""Rotor for comparison with hand calculation, as a cranktrain of the running model.

The rotor is a disc on a shaft in two or three plain bearings, with massless rod and piston and without gas forces. It
uses the running model like any crank: reduced body, film laws, stage solver, integrators. The frame's origin is the
mass centre. Bearings are at equal distances on both sides (and at the disc if there are three).
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.dynamics.model.state import (
    CONTRACTION,
    INPUTS_NOW,
    OMEGA_REFERENCE,
    SHAFT_SPEED,
    STEP_LAST,
    STEP_REFERENCE,
    offset,
)
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.time.stage import FIRST_CONTRACTION
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.film.laws.impedance import MapFilm, impedance_map, journal_force
from cranktrain.film.laws.parameters import CLEARANCE, CONTACT_HEIGHT, CONTACT_LOAD, FACTOR, KAPPA2

NOTHING = 1.0e-7
"""Mass (kg) and inertia (kg m²) of nominally massless parts, because zero cannot be inverted."""
SPAN = 0.064
"""Distance of the outer bearings from the mass centre, m."""
SPEED = 2000.0 * RPM
"""Reference speed for steps in degrees of crank angle, rad/s."""


def rotor_engine(bearings: int = 2) -> Engine:
    """Return an engine with oil and main bearings of the shipped in-line six, and with a massless rod."""
    engine = load_engine("diesel_i6")
    width = engine.crankshaft.main_widths[0]
    return replace(
        engine,
        crankshaft=replace(engine.crankshaft, throw_angles=(0.0,), main_widths=(width,) * bearings),
        cylinders=replace(engine.cylinders, pins=(1,), bank_angles=(0.0,), firing_order=(1,), piston_mass=NOTHING),
        rod=replace(engine.rod, big_end_mass=NOTHING, small_end_mass=NOTHING, inertia=NOTHING),
        thrust=replace(engine.thrust, main=1),
    )


def default_method() -> str:
    """Return the default integrator of the running model."""
    return resolved(Settings(bearings="impedance"), rotor_engine()).integrator


def default_step() -> float:
    """Return the default step of the running model, degrees."""
    return math.degrees(resolved(Settings(bearings="impedance"), rotor_engine()).step)


def rotor_body(engine: Engine, mass: float, journals: float = 0.0, stiffness: float = 0.0) -> ReducedBody:
    """Return a rotor of ``mass`` (kg); with a ``stiffness`` (N/m) its shaft bends between disc and outer journals.

    ``journals`` (kg) is then the mass of both outer journals together; the disc has the rest.
    """
    polar, diametral = 0.5, 0.4
    count = len(engine.crankshaft.main_widths)
    z = SPAN * np.linspace(-1.0, 1.0, count)
    throw = engine.crankshaft.throw
    places = [(f"main[{i + 1}]", (0.0, 0.0, z[i])) for i in range(count)]
    places += [("pin[1]", (0.0, throw, 0.0)), ("pulley", (0.0, 0.0, -2.0 * SPAN)), ("flywheel", (0.0, 0.0, 2.0 * SPAN))]
    places += [("thrust", (0.0, 0.0, 0.0))]
    names, at = tuple(name for name, _ in places), np.array([place for _, place in places])
    n = 8 if stiffness > 0.0 else 6
    unit = np.array([mass, mass, mass, diametral, diametral, polar]) ** -0.5
    shapes = np.zeros((len(names), 6, n))
    for k, (x, y, along) in enumerate(at):
        motion = np.eye(6)
        motion[:3, 3:] = [[0.0, along, -y], [-along, 0.0, x], [y, -x, 0.0]]
        shapes[k, :, :6] = motion * unit
    # Second moments of an axisymmetric rotor: ∫ρ z² and ∫ρ x² = ∫ρ y².
    along2, across2 = diametral - 0.5 * polar, 0.5 * polar
    gyroscopic, centrifugal, stress = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    gyroscopic[0, 1], gyroscopic[1, 0] = -1.0, 1.0
    gyroscopic[3, 4], gyroscopic[4, 3] = -along2 / diametral, along2 / diametral
    centrifugal[range(6), range(6)] = [1.0, 1.0, 0.0, along2 / diametral, along2 / diametral, 1.0]
    stress[range(3, 6), range(3, 6)] = [across2 / diametral, across2 / diametral, 1.0]
    omega, translation = np.zeros(n), np.zeros((3, n))
    translation[range(3), range(3)] = math.sqrt(mass)
    if n > 6:
        # In the bending mode disc and journals have zero total momentum and unit modal mass.
        disc = mass - journals
        omega[6:] = math.sqrt(stiffness * mass / (disc * journals))
        here, there = math.sqrt(journals / (disc * mass)), -math.sqrt(disc / (journals * mass))
        for k, (_, _, along) in enumerate(at):
            shapes[k, 0, 6] = shapes[k, 1, 7] = here if along == 0.0 else there
        gyroscopic[6, 7], gyroscopic[7, 6] = -1.0, 1.0
        centrifugal[6, 6] = centrifugal[7, 7] = 1.0
    euler = np.zeros(n)
    euler[5] = math.sqrt(polar)
    return ReducedBody(
        name="rotor", omega=omega, interfaces=names, positions=at, shapes=shapes, gyroscopic=gyroscopic,
        centrifugal=centrifugal, stress_stiffness=stress, centrifugal_load=np.zeros(n), euler_load=euler,
        translation=translation, mass=mass, centre=np.zeros(3), inertia=np.diag([diametral, diametral, polar]),
    )  # fmt: skip


def film_rotor(mass: float, load: float, speed: float = SPEED, **choices: Any) -> Simulation:
    """Return a started simulation of a rigid rotor on two films, with mass (kg) and load (N) per bearing."""
    engine = rotor_engine()
    settings = Settings(crank="rigid", bearings="impedance", gas_source="input", gravity=load / mass, **choices)
    simulation = Simulation(engine, rotor_body(engine, 2.0 * mass), settings)
    simulation.inputs[0] = speed
    simulation.initialize()
    return simulation


@dataclass(frozen=True, eq=False)
class LinearFilm:
    """Film linearised about a journal's equilibrium, axes at rest, y up, with force −K u − C u̇ on the journal.

    ``place`` (2,) m, ``stiffness`` and ``damping`` (2, 2) N/m and N s/m, ``load`` N downwards.
    """

    place: Array
    stiffness: Array
    damping: Array
    load: float


def film_law(bearing: Array) -> MapFilm:
    """Return the film's force law, with its map, for a bearing's parameters."""
    clearance, factor, height, load = (float(bearing[k]) for k in (CLEARANCE, FACTOR, CONTACT_HEIGHT, CONTACT_LOAD))
    return MapFilm(clearance, factor, height, load, impedance_map(float(bearing[KAPPA2])))


def film_at(eccentricity: float, law: MapFilm) -> LinearFilm:
    """Return the film's equilibrium at an eccentricity (fraction of the clearance), with exact tangents."""
    out = np.zeros(16)
    journal_force(eccentricity * law.clearance, 0.0, 0.0, 0.0, 0.5 * SPEED, law, out)
    # Rotate so that the force points up.
    angle = 0.5 * math.pi - math.atan2(out[1], out[0])
    cos, sin = math.cos(angle), math.sin(angle)
    turn = np.array([[cos, -sin], [sin, cos]])
    return LinearFilm(
        turn @ np.array([eccentricity * law.clearance, 0.0]),
        -turn @ out[2:6].reshape(2, 2) @ turn.T,
        -turn @ out[6:10].reshape(2, 2) @ turn.T,
        math.hypot(out[0], out[1]),
    )


def resting_state(simulation: Simulation, speed: float) -> Array:
    """Return the state of a body that rests in a frame turning at a speed (rad/s), for a first step without history."""
    state, inputs = np.zeros_like(simulation.state), simulation.inputs
    state[SHAFT_SPEED] = state[OMEGA_REFERENCE] = speed
    state[INPUTS_NOW : INPUTS_NOW + inputs.size] = inputs
    state[CONTRACTION] = FIRST_CONTRACTION
    state[STEP_REFERENCE] = state[STEP_LAST] = -1.0
    return state


def modal_places(simulation: Simulation, modes: list[int], blocks: list[int]) -> NDArray[np.intp]:
    """Return state indices (blocks, modes) of some modes in some blocks, such as positions and velocities."""
    n = simulation.model.omega2.size
    return np.array([[offset(block, n) + k for k in modes] for block in blocks])
