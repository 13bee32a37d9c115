"""Rotation in the real stepping: a body that no shaft holds is neutral about z, torque is right at any wind-up.

The crank is let go at its flywheel: no shaft, no gravity, no gas, no pistons. Undamped isotropic bearings hold the
axis, for an unbalanced body would fly off; they brake nothing. Then the crank's angle in space, its rotation in the
frame plus the frame's lead, must run on at the speed it was given, from any wind-up.
"""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bodies import free_six, rigid_crank, six

from cranktrain.core.reduced_body import truncate
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model import state as layout
from cranktrain.dynamics.model.workspace import make_work
from cranktrain.dynamics.settled.motion import correct_motion, motion_of
from cranktrain.dynamics.settled.slow_modes import DriveLine
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.dynamics.time.integrators import integrator_table
from cranktrain.engine.file import load_engine
from cranktrain.loads.drive_line import RECENTRING_REVOLUTIONS
from cranktrain.structure.assembly import assemble

SPEED = 250.0
TURN = 2 * math.pi / SPEED


def released(body, big_ends):
    """Started simulation of a crank without shaft and pistons that carries ``big_ends`` (kg) on its pins."""
    engine = free_six()
    springs = replace(engine.plain_mains.in_rigid_bores, stiffness_x=4e8, stiffness_y=4e8, damping_x=0.0, damping_y=0.0)
    engine = replace(engine, main_bearing=springs, damping=replace(engine.damping, kind="modal", ratio=0.01))
    settings = Settings(bearings="linear", integrator="generalised-alpha", step=math.radians(5.0), gravity=0.0)
    settings = replace(settings, gas_source="input", newton_tolerance=1e-10)
    simulation = Simulation(engine, body, settings)
    simulation.inputs[0] = SPEED
    simulation.initialize()
    model = simulation.model
    cylinders, scalars = model.cylinders.copy(), model.scalars.copy()
    cylinders[:, slots.M_BIG] = big_ends
    cylinders[:, [slots.M_OSC, slots.DELTA_J]] = 0.0
    scalars[[slots.SHAFT_K, slots.SHAFT_C]] = 0.0
    simulation.model = model._replace(cylinders=cylinders, scalars=scalars, shaft_laws=0.0 * model.shaft_laws)
    simulation.work.key[0] = -1.0
    return simulation


def set_rotation(simulation, rotation=0.0, rate=0.0, lead=0.0):
    """Give the crank a rotation about z in the frame (rad), the rate of that, and the frame a lead."""
    n, unit = simulation.body.n_modes, simulation.model.scalars[slots.RIGID_ROTATION]
    state = simulation.state
    state[layout.offset(4, n) :] = 0.0
    # The frame sets out after the crank, τ₂ ẇ = φ/τ_c: free, the crank falls back in it at that rate.
    fallback = 4 * (SPEED / (2 * math.pi * RECENTRING_REVOLUTIONS)) ** 2 * rotation
    for block, value in enumerate((rotation, rate, -fallback, -fallback)):
        state[layout.offset(block, n) + 5] = value / unit
    state[[layout.LEAD_ANGLE, layout.LEAD_SPEED]] = lead, 0.0
    simulation.state = state


def at_rest_in_the_frame(simulation):
    """Let the body find the place where its unbalance and the bearings agree, by steps that damp all motion."""
    model = simulation.model
    work = simulation.work
    simulation.model = model._replace(stages=integrator_table("backward-euler"))
    simulation.work = make_work(simulation.model, simulation.state.size)
    run(simulation, 40)
    simulation.model, simulation.work = model, work
    simulation.work.key[0] = -1.0
    # What the other method keeps beside the acceleration is as large at rest.
    state, n = simulation.state, model.omega2.size
    first, own = (layout.offset(block, n) for block in (layout.AUXILIARY, layout.ACCELERATION))
    state[first : first + n] = state[own : own + n]
    simulation.state = state
    return simulation


def angle_and_rate(simulation):
    """Of the crank in space, against a shaft at constant speed."""
    n, unit = simulation.body.n_modes, simulation.model.scalars[slots.RIGID_ROTATION]
    state = simulation.state
    at = layout.offset(0, n) + 5, layout.offset(1, n) + 5
    return state[layout.LEAD_ANGLE] + unit * state[at[0]], state[layout.LEAD_SPEED] + unit * state[at[1]]


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
    angle, rate = angle_and_rate(simulation)
    assert angle == pytest.approx(0.1 * 10 * TURN, rel=1e-4)
    assert rate == pytest.approx(0.1, rel=1e-4)


@pytest.mark.parametrize("crank_angle", np.radians([5, 30, 75, 130, 200, 290, 365, 400, 610]))
def test_torque_of_a_wound_up_crank_is_the_exact_one(crank_angle):
    # The same crank in the same place, once turned by 0.02 rad against the frame, once with the frame: the second is
    # the exact slider-crank. Acceleration of a rigid crank on bearings is its torque over its inertia.
    windup = 0.02
    engine = free_six()
    simulation = Simulation(
        engine, rigid_crank(engine), Settings(bearings="linear", integrator="sdirk2", dense_output="off")
    )
    simulation.inputs[:7] = SPEED, *np.linspace(1e5, 6e6, 6)
    simulation.initialize()
    scalars = simulation.model.scalars.copy()
    scalars[[slots.SHAFT_K, slots.SHAFT_C]] = 0.0
    simulation.model = simulation.model._replace(scalars=scalars, shaft_laws=0.0 * simulation.model.shaft_laws)
    rates = []
    for rotation, lead in ((windup, -windup), (0.0, 0.0)):
        state = simulation.state
        state[layout.offset(0, simulation.body.n_modes) :] = 0.0
        state[layout.SHAFT_ANGLE] = crank_angle
        simulation.state = state
        set_rotation(simulation, rotation, lead=lead)
        simulation.work.key[0] = -1.0
        begin = simulation.time
        simulation.step(begin + 1e-6)
        rates.append(angle_and_rate(simulation)[1] / 1e-6)
    # Off by the angle itself, the torque would be a few per cent wrong.
    assert rates[0] == pytest.approx(rates[1], rel=1e-3)


RPM = math.pi / 30.0


@cache
def made(name):
    engine = load_engine(name)
    settings = Settings(crank="beam", block="ground", bearings="impedance", big_ends="impedance", dense_output="off")
    return engine, assemble(engine, settings)


def simulation_of(name, rpm):
    engine, parts = made(name)
    simulation = Simulation(engine, parts.body, parts.settings, parts=parts.parts)
    simulation.inputs[0] = rpm * RPM
    simulation.initialize()
    return simulation


@pytest.mark.parametrize(
    ("name", "rpm"),
    [("two_stroke_six", 60.0), ("two_stroke_six", 25.0), ("five_petrol", 1200.0), ("single_petrol", 900.0)],
)
def test_the_iteration_converges_at_once_where_the_crank_is_far_ahead_of_its_frame(name, rpm):
    """Its matrix without the turn takes 2.7 iterations a stage for the five, and diverges for the six."""
    simulation = simulation_of(name, rpm)
    step, rows = 4.0 * math.pi / (720.0 * rpm * RPM), np.zeros((720, simulation.outputs.size))
    assert simulation.series(step, 1, rows) == 720
    work = simulation.work
    assert abs(work.turned).max() > 0.0
    assert work.counters[at.N_ITERATIONS] < 1.5 * work.counters[at.N_STAGES]


def off_pins(model, state):
    """Place and velocity (2, c, 2) of pins against their floating big ends, in axes of the frame."""
    motion = motion_of(state, model.omega2.size)
    t = model.ports.shape[1]
    u, ud = (model.ports @ part[:t] for part in motion[:2])
    found = []
    for row, (x, y) in zip(model.cylinders, model.pins, strict=True):
        pin, turn, end = (int(row[key]) for key in (at.PIN_PORT, at.PIN_TURN, at.END_PORT))
        cos, sin = math.cos(u[turn]), math.sin(u[turn])
        place = np.array([cos * x - sin * y - x + u[turn] * y, sin * x + cos * y - y - u[turn] * x])
        rate = ud[turn] * np.array([-sin * x - cos * y + y, cos * x - sin * y - x])
        found.append((place + u[pin : pin + 2] - u[end : end + 2], rate + ud[pin : pin + 2] - ud[end : end + 2]))
    return np.array(found).transpose(1, 0, 2)


def test_a_corrected_start_leaves_big_ends_where_they_were_on_their_pins():
    simulation = simulation_of("two_stroke_six", 60.0)
    model, state = simulation.model, simulation.state
    before = off_pins(model, state)
    change = DriveLine(model, 60.0 * RPM).lift(np.array([0.03, 0.05, 0.0, 0.0]))
    moved = state.copy()
    correct_motion(model, moved, change)
    after = off_pins(model, moved)
    clearance = model.scales[int(model.cylinders[0, at.PIN_PORT])]
    assert after[0] == pytest.approx(before[0], abs=1e-9 * clearance)
    assert after[1] == pytest.approx(before[1], abs=1e-9 * clearance * 60.0 * RPM)
    n = model.omega2.size
    linear = motion_of(state, n).plus(change).place
    besides = np.abs(model.ports @ (motion_of(moved, n).place - linear)[: model.ports.shape[1]]).max()
    assert besides > 0.1 * clearance  # what the modes' tangents would have moved the pins off their ends
