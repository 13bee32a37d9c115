"""Modes in motion: exact where laws are linear, and where the run has its peaks where they are not."""

import math
from dataclasses import replace
from functools import cache

import entry
import numpy as np
import pytest
from benchmarks._forced_torsion import gas_forces
from bodies import six
from small_block import single
from started import at_speed

from cranktrain.core.units import RPM
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.model.arrays import build_model, structural_damping
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.tangents import SAMPLES
from cranktrain.engine.file import load_engine
from cranktrain.engine.parts import AxialPath
from cranktrain.film.laws.thrust import closed_stiffness
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.slider_crank import remainder_inertia, rod_force
from cranktrain.structure.assembly import assemble
from cranktrain.structure.crank.level import crank_body
from cranktrain.structure.in_motion.cycle_means import main_tangents, mean_law, plain_means, tangents_over_cycle
from cranktrain.structure.in_motion.eigenproblem import equations_in_motion, modes_in_motion, settled_means
from cranktrain.structure.in_motion.joint import fading, mean_answer
from cranktrain.studies.in_motion.report import SPRING_LEVELS, film_springs
from cranktrain.studies.run_up.free_decay import torsional_mode
from cranktrain.studies.torsion.damped_modes import damped_modes

ON_SPRINGS = {"crank": "beam", "bearings": "linear", "block": "ground"}


def settled(engine, body, rpm, **levels):
    """A simulation at the start of its settled cycle."""
    simulation = at_speed(rpm * RPM, engine, body, Settings(**levels))
    run_cycles(simulation, None, 1e-4, None, None)
    return simulation


def even(engine):
    """The engine with linear bearings that are the same in all directions: their law is one of the turning frame."""
    bearing = replace(engine.main_bearing, stiffness_x=3e8, stiffness_y=3e8, damping_x=2e4, damping_y=2e4,
                      block_stiffness_x=3e9, block_stiffness_y=3e9)  # fmt: skip
    return replace(engine, main_bearing=bearing)


@cache
def short():
    """A single-cylinder engine and its beam crank."""
    engine = even(single())
    return engine, crank_body(engine, "beam")


def linear_matrices(engine, body, speed, gas):
    """K, C, M of a single whose bearings are the same in all directions; the rod's by differences of its force."""
    turn, n = np.array([[0.0, -1.0], [1.0, 0.0]]), body.n_modes
    pin = body.index("pin[1]")
    place, shape, rod = body.positions[pin, :2], body.shapes[pin], engine.rod
    oscillating, out = rod.small_end_mass + engine.cylinders.piston_mass, np.zeros(16)

    def on_pin(angle, u, v, a):
        """Force of the rod on its displaced pin and moment u × f, in axes of the crank."""
        at, own = place + u, angle - engine.cylinders.bank_angles[0]
        axes = np.array([[math.cos(own), -math.sin(own)], [math.sin(own), math.cos(own)]])
        ahead = math.atan2(place[0] * at[1] - place[1] * at[0], place @ at)
        push = gas_forces(engine, speed, np.array([angle + ahead]), gas, 1.0)[0, 0]
        motion = at, v + speed * turn @ at, a + 2.0 * speed * turn @ v - speed**2 * at
        rod_force(*np.concatenate([axes @ part for part in motion]), push, rod.length, rod.big_end_mass, oscillating,
                  remainder_inertia(rod), engine.cylinders.pin_offset, 0.0, 0.0, out)  # fmt: skip
        force = axes.T @ out[:2]
        return np.array([*force, u[0] * force[1] - u[1] * force[0]])

    tangents = np.zeros((3, 3, 3))
    for angle in np.arange(SAMPLES) * 4.0 * math.pi / SAMPLES:
        for k, step in enumerate((1e-7, 1e-4, 1e-1)):
            for way in range(2):
                change = np.zeros((3, 2))
                change[k, way] = step
                tangents[k, :, way] += (on_pin(angle, *change) - on_pin(angle, *-change)) / (2.0 * step * SAMPLES)
    rows = shape[[0, 1, 5]]
    matrices = [
        np.diag(body.omega**2) + speed**2 * (body.stress_stiffness - body.centrifugal),
        np.diag(structural_damping(engine, body)) + 2.0 * speed * body.gyroscopic, np.eye(n),
    ]  # fmt: skip
    for matrix, tangent in zip(matrices, tangents, strict=True):
        matrix -= rows.T @ tangent @ rows
    bearing, line = engine.main_bearing, engine.drive_line
    for i in range(len(engine.crankshaft.main_widths)):
        main = body.shapes[body.index(f"main[{i + 1}]"), :2]
        matrices[0] += main.T @ (bearing.ground_stiffness[0] * np.eye(2) + speed * bearing.damping_x * turn) @ main
        matrices[1] += bearing.damping_x * main.T @ main
    for name, k, spring, damper in (
        ("thrust", 2, closed_stiffness(engine.thrust), engine.thrust.damping),
        ("flywheel", 5, line.stiffness, line.damping),
    ):
        row = body.shapes[body.index(name), k]
        matrices[0] += spring * np.outer(row, row)
        matrices[1] += damper * np.outer(row, row)
    return matrices


def test_on_linear_bearings_matrices_and_modes_are_those_of_the_linear_model():
    """A short crank: one cylinder, a beam."""
    engine, body = short()
    simulation = settled(engine, body, 2000.0, **ON_SPRINGS)
    means = plain_means(tangents_over_cycle(simulation), 300.0)
    # The bearings' loads move their displaced points, which a linear model about the undeformed crank leaves out.
    own = means.laws
    means = means._replace(laws=own._replace(forces=0.0 * own.forces, displaced=0.0 * own.displaced))
    found = equations_in_motion(simulation, means)
    wanted = linear_matrices(engine, body, 2000.0 * RPM, GasTrace.from_engine(engine))
    for name, theirs in zip(("stiffness", "damping", "mass"), wanted, strict=True):
        assert np.abs(getattr(found, name) - theirs).max() <= 1e-6 * np.abs(theirs).max()
    modes = damped_modes(*wanted)
    theirs = modes.hz[(modes.hz > 60.0) & (modes.damping_ratios < 0.5)]
    assert modes_in_motion(simulation).hz[: theirs.size] == pytest.approx(theirs, rel=2e-4)


def test_a_floating_big_end_takes_only_its_own_mass_from_its_rod():
    engine, speed, masses = load_engine("diesel_i6"), 170.0, []
    body, gas = crank_body(engine, "rigid"), GasTrace.from_engine(engine)
    for big_ends in ("rigid", "impedance"):
        settings = Settings(crank="rigid", bearings="linear", block="ground", big_ends=big_ends)
        laws = entry.rods_in_rotation(build_model(engine, body, settings, speed, gas), speed, 36)[0].mean()
        masses.append(-laws.acceleration[np.abs(laws.acceleration).any(axis=(1, 2)), :2, :2])
    own = engine.rod.big_end_mass * np.eye(2)
    np.testing.assert_allclose(masses[0] - masses[1], np.broadcast_to(own, (6, 2, 2)), atol=1e-9)


@pytest.mark.parametrize(("rpm", "films"), [(1650.0, False), (1250.0, True), (1650.0, True)])
def test_torsion_decays_as_the_mode_in_motion_does(rpm, films):
    """Free decay of a running crank that only twists: frequency to 0.2 %; on films to 0.6 %, damping to a quarter."""
    engine, body = six()
    levels = {"bearings": "impedance", "block": "ground"} if films else {"crank": "torsional"}
    if not films:
        engine = replace(engine, reduction=replace(engine.reduction, torsional_source="ker-wilson"))
        body = crank_body(engine, "torsional")
    simulation = settled(engine, body, rpm, **levels)
    mode, found = torsional_mode(simulation), modes_in_motion(simulation)
    assert mode is not None
    hz, ratio = mode.decay.imag / (2.0 * math.pi), -mode.decay.real / abs(mode.decay)
    assert found.torsional_hz == pytest.approx(hz, rel=6e-3 if films else 2e-3)
    assert not films or found.damping_ratios[found.torsional] == pytest.approx(ratio, rel=0.25)


def test_the_mean_law_of_films_lies_between_the_means_of_stiffness_and_of_compliance():
    rng = np.random.default_rng(1)
    laws = 0.3 * rng.normal(size=(5, 2, 2)) + (4.0 + 1.0j) * np.eye(2)
    structure = rng.normal(size=(2, 2)) + 3.0 * np.eye(2) + 0.0j
    assert np.allclose(mean_law(laws[:1], structure), laws[0])
    assert np.allclose(mean_law(laws, 1e-9 * structure), laws.mean(axis=0))
    assert np.allclose(mean_law(laws, 1e6 * structure), np.linalg.inv(np.linalg.inv(laws).mean(axis=0)))


def test_tangents_in_axes_at_rest_are_the_springs_of_linear_bearings():
    engine, body = short()
    uneven = replace(engine, main_bearing=replace(engine.main_bearing, stiffness_x=2e8, damping_y=5e4))
    simulation = settled(uneven, body, 2000.0, **ON_SPRINGS)
    stiffness, damping = main_tangents(simulation.model, tangents_over_cycle(simulation))
    own = np.diag(uneven.main_bearing.ground_stiffness)
    assert np.abs(stiffness - own).max() <= 1e-6 * own.max()
    assert np.abs(damping - np.diag([2e4, 5e4])).max() <= 1e-6 * 5e4


def test_teeth_that_stick_answer_as_a_spring_and_sliding_ones_not_at_all():
    stuck = np.column_stack((np.zeros(50), np.ones(50)))
    sliding = np.column_stack((np.full(50, 1e4), np.zeros(50)))
    assert mean_answer(stuck, 0.05, 1500.0) == pytest.approx(1.0)
    assert mean_answer(sliding, 0.05, 1500.0) == pytest.approx(0.0)
    # Teeth that fade at a steady rate are a spring and a damper in series.
    fading_teeth = np.column_stack((np.full(50, 900.0), np.ones(50)))
    assert mean_answer(fading_teeth, 0.05, 1500.0) == pytest.approx(1500j / (900.0 + 1500j))


def test_the_mean_answer_of_a_sliding_joint_is_that_of_its_law():
    """The law itself, stepped over periods of a slip that sticks and slides, with a small vibration and without."""
    path = AxialPath(joint="spline", mass=15.0, stiffness=1.4e8, damping=5e3, joint_stiffness=2e8,
                     spline_radius=0.0215, friction=0.05)  # fmt: skip
    torque, period, count, small = 800.0, 0.05, 20000, 1e-9
    limit, t = path.friction * torque / path.spline_radius, np.arange(count) * period / count
    omega = 2.0 * math.pi * 12.0 / period  # a whole number of vibrations in a period
    slip_velocity = 5e-3 * np.cos(2.0 * math.pi * t / period) + 2e-2 * np.sin(6.0 * math.pi * t / period)

    def teeth(velocity):
        """Deflections over the last of five periods, by the law's own rule of a step."""
        z, step, found = 0.0, period / count, np.zeros(count)
        for _ in range(5):
            for k, v in enumerate(velocity):
                z = (z + step * v) / (1.0 + step * path.joint_stiffness * abs(v) / limit)
                found[k] = z
        return found

    still = teeth(slip_velocity)
    swings = -np.sin(omega * t), np.cos(omega * t)  # the real and the imaginary part of i exp(iωt)
    by_cos, by_sin = ((teeth(slip_velocity + small * omega * swing) - still) / small for swing in swings)
    answer = np.mean((by_cos + 1j * by_sin) * np.exp(-1j * omega * t))
    joint = [fading(path, z, v, torque) for z, v in zip(still.tolist(), slip_velocity.tolist(), strict=True)]
    assert 0.1 < abs(answer) < 0.9
    assert abs(mean_answer(np.array(joint), period, omega) - answer) < 0.01 * abs(answer)


@pytest.mark.parametrize("friction", [1e3, 1e-9])
def test_a_stuck_joint_holds_the_crank_and_a_free_one_lets_it_go(friction):
    """A single-cylinder engine's mode along its axis, the shaft far stiffer than its teeth."""
    engine, body = short()
    path = AxialPath(joint="spline", mass=15.0, stiffness=1e11, damping=1e4, joint_stiffness=4e8, joint_damping=0.0,
                     spline_radius=0.02, friction=friction)  # fmt: skip
    simulation = settled(replace(engine, axial_path=path), body, 2000.0, **ON_SPRINGS)
    means, _ = settled_means(simulation)
    k = entry.rows(simulation.model)["axial_joint"]
    assert -means.laws.place[k, 0, 0] == pytest.approx(4e8 if friction > 1.0 else 0.0, abs=4e6)
    assert abs(means.laws.velocity[k, 0, 0]) < 4e4


@pytest.mark.slow
def test_the_six_has_the_stand_in_springs_of_its_films():
    """Springs of level ``linear`` are those that `cranktrain modal` derives from the films, to 2 %."""
    engine = load_engine("diesel_i6")
    found = film_springs(assemble(engine, SPRING_LEVELS))
    own = engine.plain_mains
    assert own.stiffness_x == pytest.approx(found["film_stiffness_x"], rel=0.02)
    assert own.stiffness_y == pytest.approx(found["film_stiffness_y"], rel=0.02)
