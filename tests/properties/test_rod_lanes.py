"""Rods side by side do what one rod after the other does, to the bit."""

import numpy as np
import pytest

from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.model.slots import FORCES, PIN_ROTATIONS, UD, UDD, U
from cranktrain.dynamics.motion.rod_lanes import SMALL, go_side_by_side, rods_side_by_side
from cranktrain.dynamics.motion.rods import rod_forces
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import assemble


def run(engine, **levels):
    made = assemble(load_engine(engine), Settings(**levels))
    simulation = Simulation(made.engine, made.body, made.settings, None, made.parts)
    simulation.inputs[0] = 200.0
    simulation.initialize()
    return simulation.model, simulation.work


@pytest.mark.parametrize("engine", ["diesel_i6", "diesel_v8"])
@pytest.mark.parametrize("levels", [{"crank": "torsional"}, {"crank": "beam", "bearings": "linear"}])
def test_they_give_the_bits_of_one_after_the_other(engine, levels):
    model, work = run(engine, **levels)
    rng = np.random.default_rng(5)
    first, count = int(model.layout[PIN_ROTATIONS]), len(model.cylinders)
    for row, size in ((U, 1e-4), (UD, 0.1), (UDD, 300.0)):
        work.port[row] = size * rng.uniform(-1.0, 1.0, work.port.shape[1])
    work.port[U, first : first + count] *= 100.0
    pressures, c_q, c_v = rng.uniform(1e5, 1e7, count), 3e-9, 5e-5
    found = []
    for act in (rods_side_by_side, rod_forces):
        work.port[FORCES] = 1.0
        work.blocks[:] = 0.0
        act(model, work, work.frames[0], pressures, c_q, c_v)
        found.append((work.port[FORCES].copy(), work.blocks.copy()))
    (force, blocks), (expected, tangents) = found
    assert np.abs(expected).max() > 1e3
    assert np.array_equal(force, expected)
    if first < len(model.scales):  # one port a pin
        blocks, tangents = blocks[:, 0], tangents[:, 0]
    assert np.array_equal(blocks, tangents)


def test_pins_that_wind_up_far_go_one_after_the_other():
    model, work = run("diesel_i6", crank="torsional")
    u = np.zeros(work.port.shape[1])
    assert go_side_by_side(model, u)
    u[int(model.layout[PIN_ROTATIONS]) + 2] = 1.01 * SMALL
    assert not go_side_by_side(model, u)
