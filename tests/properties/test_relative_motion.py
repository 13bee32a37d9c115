"""Journals against moving bores: kinematics against positions in space, forces and compliance against dense algebra."""

import math
from dataclasses import replace

import bodies
import entry
import numpy as np
import pytest
from bodies import free_six, rigid_crank
from standing import rigid_block

from cranktrain.core.reduced_body import turning_stiffness
from cranktrain.dynamics.simulation import Parts, Settings, simulate
from cranktrain.engine.file import load_engine

SIX = load_engine("diesel_i6")
SPEED = 2000 * math.pi / 30


C_V_C_Q, PER_C_Q = entry.C_V / entry.C_Q, 1.0 / entry.C_Q


@pytest.fixture(scope="module")
def run():
    """A rigid crank on films that feel tilt, in a rigid block on its mounts."""
    return started(free_six(), bearings="reynolds")


def own_shapes(run, name, bore):
    """Motion of a journal or collar, and of its bore or faces, by the modes of crank and block; across it alike."""
    crank, block, half = run.body, run.parts.block, 0.5 * run.engine.main_bearing.width
    both = crank.shapes[crank.index(name)], block.shapes[block.index(bore)]
    if name == "thrust":
        return [shape[2:5] for shape in both]
    return [np.array([shape[0], shape[1], half * shape[4], -half * shape[3]]) for shape in both]


def difference(run, theta):
    """Matrices (size, n) by connection: motion of journals in bores, along the frame's axes, by modal coordinates."""
    back = np.array([[math.cos(theta), math.sin(theta)], [-math.sin(theta), math.cos(theta)]])
    found = {}
    for name, bore in [("thrust", "thrust"), *((f"main[{i}]", f"bore[{i}]") for i in range(1, 8))]:
        turning, standing = own_shapes(run, name, bore)
        turn = np.eye(len(standing))
        for first in (1,) if name == "thrust" else (0, 2):
            turn[first : first + 2, first : first + 2] = back
        found[name] = np.zeros((len(turning), entry.motion(run).shape[1]))
        found[name][:, entry.modes(run, "crank")] = turning
        found[name][:, entry.modes(run, "block")] = -turn @ standing
    return found


def inverse(run):
    """S⁻¹ (n, n) of crank and block at the speed of the run: inertia, turning, drive line and mounts of a stage."""
    crank, block, engine = run.body, run.parts.block, run.engine
    found, twist = np.zeros((entry.motion(run).shape[1],) * 2), crank.shapes[crank.index("flywheel"), 5]
    twist = np.outer(twist, twist)
    matrix = PER_C_Q * np.eye(crank.n_modes) + SPEED**2 * turning_stiffness(crank)
    matrix += C_V_C_Q * (2.0 * SPEED * crank.gyroscopic + engine.drive_line.damping * twist)
    matrix += engine.drive_line.stiffness * twist
    found[entry.modes(run, "crank"), entry.modes(run, "crank")] = np.linalg.inv(matrix)
    matrix = PER_C_Q * np.eye(block.n_modes)
    mounts = [block.shapes[block.index(f"mount[{i + 1}]")] for i in range(len(engine.mounts.x))]
    for shape, k, c in zip(mounts, engine.mounts.stiffness, engine.mounts.damping, strict=True):
        matrix += shape.T @ np.diag(np.array(k) + C_V_C_Q * np.array(c)) @ shape
    found[entry.modes(run, "block"), entry.modes(run, "block")] = np.linalg.inv(matrix)
    return found


@pytest.mark.parametrize("theta", [0.0, 0.7, 2.5, 4.0])
def test_forces_and_compliance_are_those_of_the_dense_algebra(run, theta):
    """Of crank and block as packed: relative motion A q, forces Aᵀ f on all modes, compliance A S⁻¹ Aᵀ."""
    random, parts = np.random.default_rng(3), difference(run, theta)
    q = 1e-4 * random.normal(size=entry.motion(run).shape[1])
    found = entry.openings(run, q, q, theta)
    for name, matrix in parts.items():
        for values in found[name]:
            assert values == pytest.approx(matrix @ q, abs=1e-16), name
    places = np.concatenate([entry.components(run.model, name) for name in parts])
    matrix = np.vstack([*parts.values()])
    assert entry.steps_at(run, q, theta)[places] == pytest.approx(matrix @ q, abs=1e-16)
    # Work of the forces on the relative motion is that of all forces on all bodies.
    f = np.zeros(entry.scales(run.model).size)
    f[places] = random.normal(size=places.size)
    assert entry.modal_forces(run, f, theta) == pytest.approx(matrix.T @ f[places], abs=1e-14)
    # Not symmetric, as gyroscopic terms make it.
    dense, ours = matrix @ inverse(run) @ matrix.T, entry.compliance_at(run, theta, SPEED)[np.ix_(places, places)]
    assert np.abs(dense - dense.T).max() > 1e-6 * np.abs(dense).max()
    assert ours == pytest.approx(dense, abs=1e-12 * np.abs(dense).max())


@pytest.mark.parametrize("t", np.linspace(0.0, 0.02, 5))
def test_film_velocity_is_that_of_positions_in_space(run, t):
    """Journals and bores on paths of their own, crank and block each moved by all their modes."""
    omega, omega_dot = 210.0, 900.0
    crank, block = entry.modes(run, "crank"), entry.modes(run, "block")
    random, n = np.random.default_rng(5), entry.motion(run).shape[1]
    ways = random.normal(size=(4, n))  # modes of unit mass: some 0.1 mm for the crank and 1 mm for the block
    ways[:2] *= 1e-3
    ways[2:] *= 2e-2

    def angle(time):
        return 0.3 + omega * time + 0.5 * omega_dot * time**2

    def modal(time):
        q = np.zeros(n)
        q[crank] = (math.sin(300 * time) * ways[0] + math.cos(170 * time) * ways[1])[crank]
        q[block] = (math.cos(60 * time) * ways[2] + math.sin(85 * time + 1.0) * ways[3])[block]
        return q

    h = 1e-6

    def rate(function):
        return (8 * (function(t + h) - function(t - h)) - (function(t + 2 * h) - function(t - 2 * h))) / (12 * h)

    whirl, back = omega + omega_dot * t, np.exp(-1j * angle(t))
    found = entry.openings(run, modal(t), rate(modal), angle(t), whirl)
    for i in range(1, 8):
        turning, standing = own_shapes(run, f"main[{i}]", f"bore[{i}]")
        for first in (0, 2):

            def apart(time, turning=turning[first : first + 2], standing=standing[first : first + 2]):
                """Distance of journal from bore, or of its end's slope from the bore's, in space."""
                q = modal(time)
                journal, bore = complex(*(turning @ q[crank])), complex(*(standing @ q[block]))
                return np.exp(1j * angle(time)) * journal - bore

            place, velocity = (complex(*part[first : first + 2]) for part in found[f"main[{i}]"])
            assert place == pytest.approx(back * apart(t), abs=1e-15)
            # 1e-3 m differenced over 1e-6 s
            assert velocity == pytest.approx(back * rate(apart), abs=1e-9)


def started(engine, block=None, **choices):
    block = block or rigid_block(engine, rigid_crank(engine))
    return bodies.started(SPEED, engine, Parts(block=block), block="flexible", **choices)


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
