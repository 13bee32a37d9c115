"""Journals against moving bores: kinematics against positions in space, forces and compliance against dense algebra."""

import math
from dataclasses import replace
from typing import NamedTuple

import bodies
import numpy as np
import pytest
from bodies import rigid_crank
from standing import rigid_block

from cranktrain.dynamics.motion.relative import reactions, relative_compliance, relative_motion, relative_step
from cranktrain.dynamics.simulation import Parts, Settings, simulate
from cranktrain.engine.file import load_engine

SIX = load_engine("diesel_i6")
SPEED = 2000 * math.pi / 30


class Model(NamedTuple):
    """What the kernels read of a model: two bores across and along, one journal without a bore between them."""

    scales: np.ndarray
    pairs: np.ndarray
    axial: np.ndarray
    ports: np.ndarray


NEWTON, TURNING, STANDING = 8, 10, 6
MODEL = Model(np.ones(NEWTON), np.array([[0.0, 10.0], [4.0, 12.0]]), np.array([[7.0, 15.0]]), np.zeros((TURNING, 3)))


def difference(theta):
    """Matrix (n_newton, m) from the displacement of all ports to the relative motion in the frame's axes."""
    c, s = math.cos(theta), math.sin(theta)
    a = np.eye(NEWTON, TURNING + STANDING)
    for turning, standing in MODEL.pairs.astype(int):
        a[turning : turning + 2, standing : standing + 2] = [[-c, -s], [s, -c]]
    for turning, standing in MODEL.axial.astype(int):
        a[turning, standing] = -1.0
    return a


@pytest.mark.parametrize("theta", [0.0, 0.7, 2.5, 4.0])
def test_forces_and_compliance_are_those_of_the_dense_algebra(theta):
    random = np.random.default_rng(3)
    c, s = math.cos(theta), math.sin(theta)
    a = difference(theta)
    u = random.normal(size=TURNING + STANDING)
    d, dd = np.zeros(TURNING + STANDING), np.zeros(TURNING + STANDING)
    relative_motion(MODEL, c, s, 0.0, u, u, d, dd)
    assert d[:NEWTON] == pytest.approx(a @ u, abs=1e-14)
    assert dd[:NEWTON] == pytest.approx(a @ u, abs=1e-14)
    step = u.copy()
    relative_step(MODEL, c, s, step)
    assert step[:NEWTON] == pytest.approx(a @ u, abs=1e-14)
    # Work of the forces on the relative motion is that of all forces on all ports.
    f = random.normal(size=TURNING + STANDING)
    f[TURNING:] = 0.0
    dense = a.T @ f[:NEWTON]
    reactions(MODEL, c, s, f)
    assert f[TURNING:] == pytest.approx(dense[TURNING:], abs=1e-14)
    # Not symmetric, as gyroscopic terms make it; kept transposed.
    h, h_b = random.normal(size=(TURNING, TURNING)), random.normal(size=(STANDING, STANDING))
    both = np.zeros((TURNING + STANDING, TURNING + STANDING))
    both[:TURNING, :TURNING], both[TURNING:, TURNING:] = h, h_b
    out = np.zeros((NEWTON, NEWTON))
    relative_compliance(MODEL, c, s, np.ascontiguousarray(h.T), np.ascontiguousarray(h_b.T), out)
    assert pytest.approx(a @ both @ a.T, abs=1e-13) == out.T


@pytest.mark.parametrize("t", np.linspace(0.0, 0.02, 5))
def test_film_velocity_is_that_of_positions_in_space(t):
    omega, omega_dot = 210.0, 900.0

    def angle(time):
        return 0.3 + omega * time + 0.5 * omega_dot * time**2

    def journal(time):
        return 1e-4 * complex(math.sin(300 * time), math.cos(170 * time))

    def bore(time):
        return 1e-3 * complex(math.cos(60 * time), math.sin(85 * time + 1.0))

    h = 1e-6

    def rate(function):
        return (8 * (function(t + h) - function(t - h)) - (function(t + 2 * h) - function(t - 2 * h))) / (12 * h)

    def apart(time):
        """Distance of the journal from the bore, in space."""
        return np.exp(1j * angle(time)) * journal(time) - bore(time)

    u, ud, d, dd = (np.zeros(TURNING + STANDING) for _ in range(4))
    for (turning, standing), sign in zip(MODEL.pairs.astype(int), (1, -1), strict=True):
        for values, moving, still in ((u, journal(t), bore(t)), (ud, rate(journal), rate(bore))):
            values[turning : turning + 2] = sign * moving.real, sign * moving.imag
            values[standing : standing + 2] = sign * still.real, sign * still.imag
    whirl = omega + omega_dot * t
    relative_motion(MODEL, math.cos(angle(t)), math.sin(angle(t)), whirl, u, ud, d, dd)
    back = np.exp(-1j * angle(t))
    for (turning, _), sign in zip(MODEL.pairs.astype(int), (1, -1), strict=True):
        place, velocity = complex(*d[turning : turning + 2]), complex(*dd[turning : turning + 2])
        assert sign * place == pytest.approx(back * apart(t), abs=1e-15)
        # 1e-3 m differenced over 1e-6 s
        assert sign * (velocity + 1j * whirl * place) == pytest.approx(back * rate(apart), abs=1e-9)


def started(engine, block=None, **choices):
    block = block or rigid_block(engine, rigid_crank(engine))
    return bodies.started(SPEED, engine, Parts(block=block), block="flexible", **choices)


def stepped(simulation, count):
    h = math.radians(2.5) / SPEED
    begin = simulation.time
    for k in range(1, count + 1):
        simulation.step(begin + k * h)
    return simulation.outputs.copy()


@pytest.mark.parametrize("choices", [{}, {"damper": "fitted", "boundary": "torque", "big_ends": "impedance"}])
def test_a_restored_state_runs_on_bit_for_bit(choices):
    simulation = started(SIX, **choices)
    if choices:
        simulation.load_torque = 800.0
    stepped(simulation, 30)
    kept, time = simulation.state, simulation.time
    there = stepped(simulation, 40)
    end = simulation.state
    simulation.state = kept
    assert simulation.time == time
    assert np.array_equal(stepped(simulation, 40), there)
    assert np.array_equal(simulation.state, end)
    # In another object, whose memory holds other things.
    other = started(SIX, **choices)
    other.inputs[:] = simulation.inputs
    stepped(other, 5)
    other.state = kept
    assert np.array_equal(stepped(other, 40), there)


def stiff(factor):
    """The six without friction, on mounts ``factor`` times as stiff as its own and damped as much."""
    axes = ("x", "y", "z", "rx", "ry", "rz")
    stiffness = {f"stiffness_{a}": tuple(factor * k for k in getattr(SIX.mounts, f"stiffness_{a}")) for a in axes}
    share = 5.0 * math.sqrt(factor)
    damping = {f"damping_{a}": tuple(share * c for c in getattr(SIX.mounts, f"damping_{a}")) for a in axes}
    guidance = replace(SIX.piston_guidance, friction=0.0)
    return replace(SIX, mounts=replace(SIX.mounts, **stiffness, **damping), piston_guidance=guidance)


def test_a_held_block_is_ground():
    """Differences from ground fall as mounts stiffen, to nothing."""
    crank = rigid_crank(SIX)
    closed = replace(
        stiff(1.0), thrust=replace(SIX.thrust, block_stiffness=math.inf), main_bearing=SIX.main_bearing.in_rigid_bores
    )
    ground = simulate(closed, crank, Settings(crank="rigid", pistons="guided"), SPEED, 3)
    names = ("pulley.torsion", "shaft.torque", "bearing[4].force.x", "bearing[4].force.y", "piston[1].side_force",
             "piston[1].lateral", "piston[1].tilt")  # fmt: skip
    errors = []
    for factor in (1e4, 1e7):
        engine = stiff(factor)
        parts = Parts(block=rigid_block(engine, crank))
        held = simulate(engine, crank, Settings(crank="rigid", block="flexible"), SPEED, 3, parts=parts)
        both = [(held.last_cycle(name)[1], ground.last_cycle(name)[1]) for name in names]
        errors.append([np.sqrt(np.mean((ours - theirs) ** 2)) / np.std(theirs) for ours, theirs in both])
    errors = np.array(errors)
    # A piston tilts by micro-radians only; an engine on these mounts still leans by a hundredth of one.
    assert (errors[1] < [1e-5, 1e-5, 2e-4, 2e-4, 2e-4, 2e-4, 1e-2]).all()
    assert (errors[1] < 0.2 * errors[0]).all()
