"""Rotation in the real stepping: a body that no shaft holds is neutral about z, torque is right at any wind-up.

The crank is let go at its flywheel, without gravity, gas and pistons; undamped isotropic bearings hold its axis. Its
angle in space, its rotation in the frame plus the frame's lead, must run on at the speed that it was given.
"""

import math
from dataclasses import replace
from functools import cache

import entry
import numpy as np
import pytest
from bodies import free_six, rigid_crank, six
from started import at_speed

import cranktrain as ct
from cranktrain.core.reduced_body import truncate
from cranktrain.dynamics.model.state import LEAD_ANGLE, LEAD_SPEED, SHAFT_ANGLE
from cranktrain.dynamics.settled.motion import correct_motion
from cranktrain.dynamics.settled.slow_modes import DriveLine
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.engine.file import load_engine
from cranktrain.loads.drive_line import RECENTRING_REVOLUTIONS
from cranktrain.structure.assembly import assemble

SPEED = 250.0
TURN = 2 * math.pi / SPEED
RPM = math.pi / 30.0
FAR = 2e-3
"""Rotation (rad) of a pin in its frame from which on the iteration counts it."""


def released(body, big_ends):
    """Started simulation of a crank without shaft and pistons that carries ``big_ends`` (kg) on its pins."""
    engine = free_six()
    springs = replace(engine.plain_mains.in_rigid_bores, stiffness_x=4e8, stiffness_y=4e8, damping_x=0.0, damping_y=0.0)
    engine = replace(engine, main_bearing=springs, damping=replace(engine.damping, kind="modal", ratio=0.01))
    settings = Settings(bearings="linear", integrator="generalised-alpha", step=math.radians(5.0), gravity=0.0)
    settings = replace(settings, gas_source="input", newton_tolerance=1e-10)
    simulation = at_speed(SPEED, engine, body, settings)
    entry.let_go(simulation, big_ends)
    return simulation


def unit_of(simulation):
    """Rotation of the crank by its rigid mode of rotation, rad."""
    return simulation.body.shapes[simulation.body.index("flywheel"), 5, 5]


def set_rotation(simulation, rotation=0.0, rate=0.0, lead=0.0):
    """Give the crank a rotation about z in the frame (rad), the rate of that, and the frame a lead."""
    unit, state = unit_of(simulation), simulation.state
    entry.forget(simulation, state)
    # The frame sets out after the crank, τ₂ ẇ = φ/τ_c: free, the crank falls back in it at that rate.
    fallback = 4 * (SPEED / (2 * math.pi * RECENTRING_REVOLUTIONS)) ** 2 * rotation
    entry.motion(simulation, state)[:, 5] = np.array([rotation, rate, -fallback]) / unit
    entry.settle_method(simulation, state)
    state[[LEAD_ANGLE, LEAD_SPEED]] = lead, 0.0
    simulation.state = state


def at_rest_in_the_frame(simulation):
    """Let the body find the place where its unbalance and the bearings agree, by steps that damp all motion."""
    kept = entry.take_method(simulation, "backward-euler")
    run(simulation, 40)
    entry.take_back(simulation, kept)
    # What the other method keeps beside the acceleration is as large at rest.
    state = simulation.state
    entry.settle_method(simulation, state)
    simulation.state = state
    return simulation


def angle_and_rate(simulation):
    """Of the crank in space, against a shaft at constant speed."""
    state = simulation.state
    angle, rate, _ = unit_of(simulation) * entry.motion(simulation, state)[:, 5]
    return state[LEAD_ANGLE] + angle, state[LEAD_SPEED] + rate


def run(simulation, turns):
    h = TURN / 72
    begin = simulation.time
    for k in range(1, 72 * turns + 1):
        simulation.step(begin + k * h)


BALANCED = {"centre": (0.0, 0.0, 0.35)}
UNBALANCED = {"centre": (0.002, -0.001, 0.3), "inertia": ((6.0, 0.1, 0.2), (0.1, 6.0, -0.1), (0.2, -0.1, 1.4))}


def drift(simulation):
    """Angle (rad) by which the crank is off after a thousand revolutions, from a wind-up of 0.01 rad at the start."""
    at_rest_in_the_frame(simulation)
    set_rotation(simulation, rotation=0.01)
    run(simulation, 1000)
    return angle_and_rate(simulation)[0] - 0.01


# While the frame follows the crank, steps of 5 degrees leave a rate of the order h² ẅ / 12 = 1e-5 rad/s, which for 25 s
# makes 3e-4 rad. A false stiffness of m_b Ω² r² would make radians of it.
DRIFT = 1e-3
NONE, ALL, ONE = (0.0,) * 6, (1.5,) * 6, (1.5, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("big_ends", [NONE, ALL, ONE], ids=["no m_b", "m_b", "m_b on one pin"])
@pytest.mark.parametrize("shape", [BALANCED, UNBALANCED], ids=["balanced", "unbalanced"])
def test_a_released_crank_does_not_drift_over_a_thousand_revolutions(shape, big_ends):
    assert abs(drift(released(rigid_crank(free_six(), **shape), big_ends))) < DRIFT


@pytest.mark.parametrize("big_ends", [NONE, ALL, ONE], ids=["no m_b", "m_b", "m_b on one pin"])
def test_an_elastic_crank_does_not_drift_either(big_ends):
    assert abs(drift(released(truncate(six()[1], 1000.0), big_ends))) < DRIFT


def test_a_pushed_crank_turns_on_at_its_own_rate():
    simulation = released(rigid_crank(free_six()), ALL)
    set_rotation(simulation, rate=0.1)
    run(simulation, 10)
    assert angle_and_rate(simulation) == pytest.approx((0.1 * 10 * TURN, 0.1), rel=1e-4)


@pytest.mark.parametrize("crank_angle", np.radians([5, 30, 75, 130, 200, 290, 365, 400, 610]))
def test_torque_of_a_wound_up_crank_is_the_exact_one(crank_angle):
    # The same crank in the same place, once turned by 0.02 rad against the frame, once with the frame: the second is
    # the exact slider-crank. Acceleration of a rigid crank on bearings is its torque over its inertia.
    windup = 0.02
    engine = free_six()
    settings = Settings(bearings="linear", integrator="sdirk2", dense_output="off")
    simulation = Simulation(engine, rigid_crank(engine), settings)
    simulation.inputs[:7] = SPEED, *np.linspace(1e5, 6e6, 6)
    simulation.initialize()
    entry.let_go(simulation)
    rates = []
    for rotation, lead in ((windup, -windup), (0.0, 0.0)):
        state = simulation.state
        entry.motion(simulation, state)[:] = 0.0
        entry.forget(simulation, state)
        state[SHAFT_ANGLE] = crank_angle
        simulation.state = state
        set_rotation(simulation, rotation, lead=lead)
        entry.make_anew(simulation)
        begin = simulation.time
        simulation.step(begin + 1e-6)
        rates.append(angle_and_rate(simulation)[1] / 1e-6)
    # Off by the angle itself, the torque would be a few per cent wrong.
    assert rates[0] == pytest.approx(rates[1], rel=1e-3)


@cache
def made(name):
    engine = load_engine(name)
    settings = Settings(crank="beam", block="ground", bearings="impedance", big_ends="impedance", dense_output="off")
    return engine, assemble(engine, settings)


def simulation_of(name, rpm):
    engine, parts = made(name)
    return at_speed(rpm * RPM, engine, parts.body, parts.settings, parts=parts.parts)


@pytest.mark.parametrize(
    ("name", "rpm"),
    [("two_stroke_six", 60.0), ("two_stroke_six", 25.0), ("five_petrol", 1200.0), ("single_petrol", 900.0)],
)
def test_the_iteration_converges_at_once_where_the_crank_is_far_ahead_of_its_frame(name, rpm):
    """Its matrix without the turn takes 2.7 iterations a stage for the five, and diverges for the six."""
    simulation = simulation_of(name, rpm)
    step, rows = 4.0 * math.pi / (720.0 * rpm * RPM), np.zeros((720, simulation.outputs.size))
    assert simulation.series(step, 1, rows) == 720
    pins, _ = on_pins(simulation)
    assert np.abs(pins[:, 5] @ entry.motion(simulation)[0, entry.modes(simulation, "crank")]).max() > FAR
    assert entry.count(simulation, "iterations") < 1.5 * entry.count(simulation, "stages")


def on_pins(simulation):
    """Shapes (c, 6, n) of the crank at the pins under the rods, and their places across, (c, 2)."""
    body, pins = simulation.body, [f"pin[{pin}]" for pin in simulation.engine.cylinders.pins]
    at = [body.index(pin) for pin in pins]
    assert not any(simulation.engine.rod_offsets)
    return body.shapes[at], body.positions[at, :2]


def ends(simulation, q):
    """Displacement (c, 2) of floating big ends, points of the rods' mass there, by modal coordinates of all bodies."""
    return np.array([q[entry.modes(simulation, f"rod[{c + 1}]")] / math.sqrt(rod.big_end_mass)
                     for c, rod in enumerate(simulation.engine.rods)])  # fmt: skip


def off_pins(simulation, state):
    """Place and velocity (2, c, 2) of pins against their floating big ends, in axes of the frame."""
    (q, v, _), own = entry.motion(simulation, state), entry.modes(simulation, "crank")
    shapes, places = on_pins(simulation)
    found = []
    for shape, (x, y), end, end_rate in zip(shapes, places, ends(simulation, q), ends(simulation, v), strict=True):
        u, ud, turn, rate = shape[:2] @ q[own], shape[:2] @ v[own], shape[5] @ q[own], shape[5] @ v[own]
        cos, sin = math.cos(turn), math.sin(turn)
        place = np.array([cos * x - sin * y - x + turn * y, sin * x + cos * y - y - turn * x])
        speed = rate * np.array([-sin * x - cos * y + y, cos * x - sin * y - x])
        found.append((place + u - end, speed + ud - end_rate))
    return np.array(found).transpose(1, 0, 2)


def test_a_corrected_start_leaves_big_ends_where_they_were_on_their_pins():
    simulation = simulation_of("two_stroke_six", 60.0)
    state = simulation.state
    before = off_pins(simulation, state)
    line = DriveLine(simulation.model, 60.0 * RPM)
    turned = np.ones(len(line.matrix) // 2 - 1)
    change = line.lift(np.concatenate((0.03 * turned, 0.05 * turned, [0.0, 0.0])))
    moved = state.copy()
    correct_motion(simulation.model, moved, change)
    after = off_pins(simulation, moved)
    clearance = simulation.engine.big_end_bearing.clearance
    assert after[0] == pytest.approx(before[0], abs=1e-9 * clearance)
    assert after[1] == pytest.approx(before[1], abs=1e-9 * clearance * 60.0 * RPM)
    linear = entry.motion(simulation, state)[0] + change.place
    besides = np.abs(ends(simulation, entry.motion(simulation, moved)[0] - linear)).max()
    assert besides > 0.4 * clearance  # what the modes' tangents would have moved the pins off their ends


@pytest.mark.parametrize(("name", "rpm"), [("single_petrol", 2000.0), ("diesel_i6", 2000.0)])
def test_floating_big_ends_start_on_the_circles_of_their_pins(name, rpm):
    """Beside them by half the square of the crank's turn against its frame a pin would cross its film in a step."""
    engine = load_engine(name)
    levels = {"crank": "rigid", "block": "ground", "bearings": "linear", "big_ends": "impedance"}
    run = ct.simulate(engine, speed_rpm=rpm, cycles=1, **levels)
    places = np.array([run[f"big_end[{c + 1}].eccentricity"][:4] for c in range(engine.n_cylinders)])
    assert np.abs(np.diff(places)).max() < 1e-2
