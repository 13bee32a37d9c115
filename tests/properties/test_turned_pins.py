"""Cranks that have turned against their frame: Newton's iteration and corrected starts follow pins on their circles."""

import math
from functools import cache

import numpy as np
import pytest

from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.settled.motion import correct_motion, motion_of
from cranktrain.dynamics.settled.slow_modes import DriveLine
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import assemble

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
