"""The drive line's axial joint: a spring that sticks, a force that slides, its loss, its tangent, and runs with it."""

import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from bodies import rigid_crank
from started import at_speed

from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.file import load_engine
from cranktrain.engine.parts import AxialPath
from cranktrain.film.laws.bearings import axial_joint_film
from cranktrain.structure.assembly import assemble

RPM = math.pi / 30.0
PATH = AxialPath(
    joint="spline", mass=15.0, stiffness=1.4e8, damping=5e3, joint_stiffness=2e8, joint_damping=2e3,
    spline_radius=0.0215, friction=0.05,
)  # fmt: skip
TORQUE = 800.0
LIMIT = PATH.friction * TORQUE / PATH.spline_radius


class Joint:
    """The law alone, stepped by backward Euler."""

    def __init__(self, path=PATH, torque=TORQUE):
        self.law, self.torque = entry.Law(axial_joint_film(path)), torque
        self.start, self.length = 0.0, 0.0

    def open(self, step):
        self.length = step
        self.law.begin(step)

    def force(self, velocity):
        """Force and its tangent at a slip velocity over the step under way."""
        found = self.law((self.start + self.length * velocity, self.torque), (velocity,))
        return found.force[0], found.by_velocity[0, 0]

    def step(self, velocity, step):
        """Force at the end of a step with a slip velocity."""
        self.open(step)
        force, _ = self.force(velocity)
        self.start += step * velocity
        self.law.end()
        return force


def test_a_small_displacement_meets_a_spring():
    joint = Joint(replace(PATH, joint_damping=0.0))
    moved = 0.01 * LIMIT / PATH.joint_stiffness
    for _ in range(100):
        force = joint.step(0.01 * moved / 1e-5, 1e-5)
    assert force == pytest.approx(-PATH.joint_stiffness * moved, rel=0.01)


@pytest.mark.parametrize("torque", [800.0, -800.0, 100.0])
def test_a_joint_that_slides_pulls_with_its_friction(torque):
    """μ |T| / r against the slip, whatever the sense of the torque."""
    joint = Joint(torque=torque)
    for _ in range(1000):
        force = joint.step(0.1, 1e-5)
    assert force == pytest.approx(-PATH.friction * abs(torque) / PATH.spline_radius, rel=1e-3)
    assert joint.law(action="OBSERVE").force[0] == pytest.approx(force)


def test_a_torque_that_vanishes_lets_go():
    joint = Joint(replace(PATH, joint_damping=0.0))
    for _ in range(1000):
        joint.step(0.1, 1e-5)
    joint.torque = 0.0
    for _ in range(10):
        force = joint.step(0.1, 1e-5)
    assert abs(force) < 0.01


def test_a_loop_costs_the_work_of_friction():
    """A slip of amplitude X far beyond the elastic deflection costs 4 F_max X a cycle."""
    joint, amplitude, omega = Joint(replace(PATH, joint_damping=0.0)), 2e-3, 300.0
    steps, work = 20000, 0.0
    h = 2.0 * math.pi / omega / steps
    for _ in range(2):
        work = 0.0
        for k in range(1, steps + 1):
            velocity = amplitude * omega * math.cos(omega * k * h)
            work -= joint.step(velocity, h) * velocity * h
    elastic = LIMIT / PATH.joint_stiffness
    assert work == pytest.approx(4.0 * LIMIT * amplitude, rel=2.0 * elastic / amplitude)


@pytest.mark.parametrize("joint", ["spline", "bolted"])
@pytest.mark.parametrize("velocity", [0.3, 0.01, -0.02, -0.4])
def test_tangents_are_derivatives(joint, velocity):
    law = Joint(replace(PATH, joint=joint))
    for v in (0.05, 0.2, -0.1):
        law.step(v, 1e-4)
    law.open(1e-4)
    d = 1e-7
    difference = (law.force(velocity + d)[0] - law.force(velocity - d)[0]) / (2.0 * d)
    assert law.force(velocity)[1] == pytest.approx(difference, rel=1e-5)


def four():
    """Four cylinders in line of the six's parts, on its plain bearings."""
    six = load_engine("diesel_i6")
    crank = replace(
        six.crankshaft, throw_angles=(0.0, math.pi, math.pi, 0.0), main_widths=six.crankshaft.main_widths[:5],
        counterweights=(True,) * 8,
    )  # fmt: skip
    cylinders = replace(six.cylinders, firing_order=(1, 3, 4, 2), pins=(1, 2, 3, 4), bank_angles=(0.0,) * 4)
    return replace(
        six, name="four", crankshaft=crank, cylinders=cylinders, thrust=replace(six.thrust, main=3), block=None,
        mounts=None, piston_guidance=None,
    )  # fmt: skip


ENGINES = {"four": four, "six": lambda: load_engine("diesel_i6")}


def run_of(path, force=None, rpm=1500, engine="six", cycles=None, **levels):
    own = replace(ENGINES[engine](), axial_path=path)
    made = assemble(own, Settings(crank="beam", axial_force=force, **levels))
    simulation = at_speed(rpm * RPM, made.engine, made.body, made.settings, parts=made.parts)
    return simulation, run_cycles(simulation, cycles, 1e-4, None, None)


def means(result):
    return {name: result.outputs[name][1:].mean() for name in ("thrust.force", "axial_path.force")}


@pytest.mark.parametrize("engine", ENGINES)
def test_forces_along_the_axis_balance_over_a_cycle(engine):
    """Thrust bearing, joint and given force: their mean is zero once the motion repeats."""
    for force in (None, 800.0):
        _, result = run_of(PATH, force, engine=engine)
        assert result.settling.repeats == 1
        found = means(result)
        scale = np.abs(result.outputs["axial_path.force"]).max()
        assert sum(found.values()) + (force or 0.0) == pytest.approx(0.0, abs=2e-3 * scale)


def test_no_force_exceeds_the_friction_of_the_torque():
    simulation, result = run_of(replace(PATH, joint_damping=0.0), rpm=2000)
    line, slip = simulation.engine.drive_line, result.outputs["axial_path.slip"]
    assert np.ptp(slip) > 2.0 * LIMIT / PATH.joint_stiffness
    force = np.abs(result.outputs["axial_path.force"])
    # What the shaft's damper carries presses no teeth together.
    twist = np.gradient(result.outputs["flywheel.torsion"], result.time)
    torque = np.abs(result.outputs["shaft.torque"] - line.damping * twist)
    assert force.max() <= 1.02 * PATH.friction * torque.max() / PATH.spline_radius
    assert force.max() >= 0.9 * PATH.friction * torque.min() / PATH.spline_radius


@pytest.mark.parametrize(
    ("integrator", "order", "coarsest"), [("sdirk2", 1.8, 1.0), ("sdirk3", 2.6, 1.0), ("generalised-alpha", 0.9, 0.5)]
)
def test_runs_converge_in_the_step(integrator, order, coarsest):
    """The slip over a cycle in which the joint slides and sticks; its memory follows generalised-α by Euler's rule."""
    found = []
    for step in (coarsest, coarsest / 4.0, coarsest / 16.0):
        _, result = run_of(PATH, rpm=2000, step=math.radians(step), integrator=integrator, cycles=1)
        found.append(result.outputs["axial_path.slip"][:: round(coarsest / step)])
    coarse, fine = (float(np.sqrt(np.mean((slip - found[2]) ** 2))) for slip in found[:2])
    assert math.log2(coarse / fine) / 2.0 > order


def test_an_engine_without_axial_motion_takes_no_notice():
    engine = replace(load_engine("diesel_i6"), axial_path=PATH)
    simulation = at_speed(100.0, engine, rigid_crank(engine), Settings(crank="rigid", bearings="held"))
    simulation.step(1e-3)
    assert simulation.outputs[simulation.output_names.index("axial_path.force")] == 0.0


def test_a_bolted_joint_needs_no_data_of_a_spline():
    bolted = replace(PATH, joint="bolted", spline_radius=0.0, friction=0.0)
    check_engine(replace(load_engine("diesel_i6"), axial_path=bolted))
