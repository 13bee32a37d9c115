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
    """Over a cycle the mean forces of mains are the weight and the mean of gas and inertia, whatever carries the rods."""
    rigid, free = (
        simulate(ENGINE, BODY, Settings(crank="rigid", big_ends=level), SPEED, 4) for level in ("rigid", "impedance")
    )

    def mean(run, axis):
        total = sum(run.outputs[f"bearing[{i + 1}].force.{axis}"] for i in range(7))
        return total[-1 - run.per_cycle : -1].mean()

    peak = max(np.abs(rigid.outputs[f"bearing[{i + 1}].force.y"]).max() for i in range(7))
    for axis in "xy":
        assert mean(free, axis) == pytest.approx(mean(rigid, axis), abs=2e-4 * peak)


def test_tighter_big_ends_come_nearer_to_rigid_ones():
    """A pin in half the clearance moves less against its rod: the crank's motion tends to that with rigid big ends."""

    def torque(engine, level):
        run = simulate(engine, BODY, Settings(crank="rigid", big_ends=level), SPEED, 2)
        return run.outputs["bearing[4].force.y"][-1 - run.per_cycle :]

    rigid = torque(ENGINE, "rigid")
    away = []
    for share in (1.0, 0.5):
        big_end = replace(ENGINE.big_end_bearing, clearance=share * ENGINE.big_end_bearing.clearance)
        away.append(np.sqrt(np.mean((torque(replace(ENGINE, big_end_bearing=big_end), "impedance") - rigid) ** 2)))
    assert away[1] < 0.8 * away[0]


def test_refusals():
    with pytest.raises(InputError, match="film-table"):
        started(bearings="table")
    with pytest.raises(InputError, match="big_end_bearing"):
        simulation = Simulation(replace(ENGINE, big_end_bearing=None), BODY, Settings(big_ends="impedance"))
        simulation.initialize()
    with pytest.raises(InputError, match="did you mean 'reynolds'"):
        started(bearings="reynold")
