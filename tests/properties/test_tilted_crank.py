"""Crank on films that feel tilt, and with big ends on films of their own: tangents, balances, limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from bodies import rigid_crank

from cranktrain.dynamics.equations_of_motion import port_forces
from cranktrain.dynamics.model import Settings
from cranktrain.dynamics.simulation import Simulation, simulate
from cranktrain.engine import load_engine
from cranktrain.errors import InputError

SPEED = 2000 * math.pi / 30
ENGINE = load_engine("diesel_i6")
BODY = rigid_crank(ENGINE)
CHOICES = [{"bearings": "reynolds"}, {"big_ends": "impedance"}, {"bearings": "reynolds", "big_ends": "impedance"}]


def started(**choices):
    simulation = Simulation(ENGINE, BODY, Settings(crank="rigid", **choices))
    simulation.inputs[0] = SPEED
    simulation.initialize()
    return simulation


@pytest.mark.parametrize("choices", CHOICES)
def test_blocks_are_the_derivatives_of_the_forces(choices):
    """At the Newton ports, by central differences with u̇ and ü following u as they do in a stage."""
    simulation = started(**choices)
    simulation.step(math.radians(3) / SPEED)
    model, work = simulation.model, simulation.work
    c_q, c_v = 1e-9, 3e-5
    frame, pressures = work.frames[0].copy(), work.pressures[0].copy()
    u, ud, udd = (work.port[10 + k].copy() for k in range(3))
    forces = np.zeros_like(u)

    def at(port, change):
        moved = [a.copy() for a in (u, ud, udd)]
        moved[0][port] += change
        moved[1][port] += c_v / c_q * change
        moved[2][port] += change / c_q
        port_forces(model, frame, pressures, *moved, c_q, c_v, forces, work)
        return forces.copy()

    at(0, 0.0)
    newton = model.scales.size
    tangent = np.zeros((newton, newton))
    for law, block in zip(model.connections, work.blocks, strict=True):
        ports = law[1 : 1 + int(law[0])].astype(int)
        tangent[np.ix_(ports, ports)] += block.reshape(4, 4)[: len(ports), : len(ports)]
    scale = np.abs(tangent).max(axis=1)
    for port in range(newton):
        h = 1e-6 * model.scales[port]
        slope = (at(port, h) - at(port, -h))[:newton] / (2 * h)
        # A rod's own moment on its pin and the film's friction go without tangent; rods and films are here.
        assert np.abs(slope - tangent[:, port]).max() <= 2e-4 * np.abs(tangent[:, port]).max(), port
        assert np.all(np.abs(slope - tangent[:, port]) <= 2e-3 * scale), port


def test_free_big_ends_carry_what_rods_need():
    """Upward forces of all mains have the same mean whatever carries the rods; each load stays what rods make it.

    Sideways the means differ by what holds the films' friction on the rods.
    """
    rigid, free = (
        simulate(ENGINE, BODY, Settings(crank="rigid", big_ends=level), SPEED, 4) for level in ("rigid", "impedance")
    )

    def upward(run):
        return np.array([run.outputs[f"bearing[{i + 1}].force.y"][-1 - run.per_cycle : -1] for i in range(7)])

    peak = np.abs(upward(rigid)).max()
    assert upward(free).sum(axis=0).mean() == pytest.approx(upward(rigid).sum(axis=0).mean(), abs=2e-4 * peak)
    # Journals give way by their clearance of a throw of 60 mm: 6e-4 of any load.
    assert np.sqrt(np.mean((upward(free) - upward(rigid)) ** 2)) < 1e-3 * peak


def test_refusals():
    with pytest.raises(InputError, match="film-table"):
        started(bearings="table")
    with pytest.raises(InputError, match="big_end_bearing"):
        simulation = Simulation(replace(ENGINE, big_end_bearing=None), BODY, Settings(big_ends="impedance"))
        simulation.initialize()
    with pytest.raises(InputError, match="did you mean 'reynolds'"):
        started(bearings="reynold")
