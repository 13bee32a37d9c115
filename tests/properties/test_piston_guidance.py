"""Pistons between springs: the springs' law, statics, the limit of stiff springs, energy, order, and impacts."""

import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from bodies import rigid_crank
from momentum import energy_on_ground, layer_energy
from some import some

from cranktrain.dynamics.model.state import METHOD
from cranktrain.dynamics.simulation import Settings, Simulation, simulate
from cranktrain.engine.file import load_engine
from cranktrain.loads.piston_guidance import guidance_parameters, layer_force, liner_friction

SIX = load_engine("diesel_i6")
SPEED = 2000 * math.pi / 30
GUIDED = replace(SIX.piston_guidance, friction=0.0)
PLAY = 8e-5


def guided(**changes):
    return replace(SIX, piston_guidance=replace(GUIDED, **changes))


def layer(gap, rate=0.0, clearance=PLAY, number=0):
    out = np.zeros(3)
    layer_force(guidance_parameters(replace(GUIDED, clearance=clearance), 1.9), number, gap, rate, out)
    return out


@pytest.mark.parametrize("clearance", [0.0, PLAY])
@pytest.mark.parametrize("number", [0, 1])
def test_tangents_of_a_layer_are_derivatives_and_its_force_that_of_its_energy(clearance, number):
    stiffness = (GUIDED.upper_stiffness, GUIDED.lower_stiffness)[number]
    # Free play, both sides of its edges at 0.9 and 1.1 clearances, and contact.
    for gap in some(np.outer([1, -1], [1e-6, 0.89, 0.91, 0.99, 1.09, 1.11, 2.5]).ravel() * PLAY):
        h = 1e-10
        there, back = layer(gap + h, 0.0, clearance, number)[0], layer(gap - h, 0.0, clearance, number)[0]
        force, by_gap, by_rate = layer(gap, 0.0, clearance, number)
        assert (there - back) / (2 * h) == pytest.approx(by_gap, rel=1e-5, abs=1e-3)
        faster = layer(gap, 0.1, clearance, number)[0]
        assert faster - force == pytest.approx(0.1 * by_rate, rel=1e-9)
        spring = replace(GUIDED, clearance=clearance)
        slope = (layer_energy(spring, stiffness, gap + 1e-9) - layer_energy(spring, stiffness, gap - 1e-9)) / 2e-9
        assert force == pytest.approx(-slope, rel=1e-4, abs=1e-3)


def test_friction_brakes_with_the_coefficient_on_both_layers():
    law = guidance_parameters(SIX.piston_guidance, 1.9)
    mu = SIX.piston_guidance.friction
    assert mu > 0.0
    for velocity in (8.0, -8.0):
        found = liner_friction(law, 5e3, -3e3, velocity)
        assert found == pytest.approx(-math.copysign(mu * 8e3, velocity), rel=3e-3)
    assert liner_friction(law, 5e3, -3e3, 0.0) == 0.0


def read(simulation, name):
    return float(simulation.outputs[simulation.output_names.index(name)])


@pytest.mark.parametrize("offset", [0.0, 0.002])
def test_a_piston_at_rest_stands_where_its_springs_put_it(offset):
    """At standstill: N from the rod's angle, shared by the layers as a lever on two springs."""
    engine = guided(upper_damping=2e4, lower_damping=2e4)
    engine = replace(engine, cylinders=replace(SIX.cylinders, pin_offset=offset))
    settings = Settings(crank="rigid", bearings="linear", pistons="guided", gas_source="input", gravity=0.0)
    simulation = Simulation(engine, rigid_crank(engine), settings)
    simulation.inputs[2:5] += 2e6, 1e6, 3e6
    simulation.initialize()
    for k in range(1, 201):
        simulation.step(0.005 * k)
    area = 0.25 * math.pi * SIX.cylinders.bore**2
    throw, length = SIX.crankshaft.throw, SIX.rod.length
    theta = entry.frame(simulation)[0] + read(simulation, "flywheel.torsion")
    g = GUIDED
    for k, pressure in ((2, 2e6), (3, 1e6), (4, 3e6)):
        lateral = read(simulation, f"piston[{k}].lateral")
        x = -throw * math.sin(theta + SIX.crankshaft.throw_angles[SIX.cylinders.pins[k - 1] - 1]) - lateral - offset
        gas = pressure * area
        side = -gas * x / math.sqrt(length**2 - x**2)
        # The journals give way by a few micrometres in their springs.
        assert read(simulation, f"piston[{k}].side_force") == pytest.approx(side, rel=2e-3)
        # F = −k (x − τ y) of both layers against the side force and the pin's moment, e times the gas.
        k_u, k_l, y_u, y_l = g.upper_stiffness, g.lower_stiffness, g.upper_height, g.lower_height
        arm = -k_u * y_u - k_l * y_l
        stiffness = np.array([[k_u + k_l, arm], [arm, k_u * y_u**2 + k_l * y_l**2]])
        place = np.linalg.solve(stiffness, [read(simulation, f"piston[{k}].side_force"), offset * gas])
        assert [lateral, read(simulation, f"piston[{k}].tilt")] == pytest.approx(place, rel=1e-5)


def test_stiff_springs_are_rigid_pistons():
    step = math.radians(2.5)
    rigid = simulate(SIX, rigid_crank(SIX), Settings(crank="rigid", pistons="rigid", step=step), SPEED, 2).outputs
    errors = []
    for factor in (10.0, 100.0):
        engine = guided(
            **{f"{end}_stiffness": factor * getattr(GUIDED, f"{end}_stiffness") for end in ("upper", "lower")},
            **{f"{end}_damping": math.sqrt(factor) * getattr(GUIDED, f"{end}_damping") for end in ("upper", "lower")},
        )
        chosen = Settings(crank="rigid", pistons="guided", step=step)
        soft = simulate(engine, rigid_crank(engine), chosen, SPEED, 2).outputs
        errors.append([
            np.sqrt(np.mean((soft[name] - rigid[name]) ** 2)) / np.std(rigid[name])
            for name in ("pulley.torsion", "shaft.torque", "bearing[3].force.y", "piston[2].side_force")
        ])  # fmt: skip
        assert np.abs(soft["piston[2].lateral"]).max() < 3e-4 / factor
    errors = np.array(errors)
    # What is left is the working step's: springs ten times as stiff as the others are quicker than it.
    assert errors[1].max() < 3e-3
    assert (errors[1] < np.maximum(0.3 * errors[0], [1e-4, 1e-4, 1e-4, 2e-3])).all()


def released(engine, step_deg, integrator="sdirk4", tolerance=1e-12):
    """Started simulation of a crank that no shaft holds, on springs that keep energy; no gas and no weight."""
    bearing = replace(
        engine.main_bearing.in_rigid_bores, stiffness_x=4e8, stiffness_y=4e8, damping_x=0.0, damping_y=0.0
    )
    engine = replace(engine, main_bearing=bearing, thrust=replace(engine.thrust, damping=0.0))
    settings = Settings(
        crank="rigid", bearings="linear", pistons="guided", gas_source="input", gravity=0.0,
        integrator=integrator, step=math.radians(step_deg), newton_tolerance=tolerance,
    )  # fmt: skip
    simulation = Simulation(engine, rigid_crank(engine), settings)
    simulation.inputs[0] = SPEED
    simulation.initialize()
    entry.let_go(simulation)
    return simulation


def carry(simulation, degrees, step_deg):
    h = math.radians(step_deg) / SPEED
    begin = simulation.time
    for k in range(1, round(degrees / step_deg) + 1):
        simulation.step(begin + k * h)
        yield k


UNDAMPED = {"upper_damping": 0.0, "lower_damping": 0.0}


@pytest.mark.parametrize("clearance", [0.0, PLAY])
def test_energy_is_kept_over_a_cycle(clearance):
    """Pistons shuttle between their springs, with play they hit the liner; crank and pistons trade their energy."""
    engine = guided(**UNDAMPED, clearance=clearance)
    simulation = released(engine, 0.25)
    before, swing = energy_on_ground(simulation), []
    pistons = [i for i, name in enumerate(simulation.output_names) if name.endswith(".lateral")]
    reach = 0.0
    for k in carry(simulation, 720, 0.25):
        reach = max(reach, np.abs(simulation.outputs[pistons]).max())
        if k % 40 == 0:
            swing.append(energy_on_ground(simulation) - before)
    # Of what pistons and crank exchange, half of m_o (r Ω)² for each piston.
    exchanged = 0.5 * (SIX.rod.small_end_mass + SIX.cylinders.piston_mass) * (SIX.crankshaft.throw * SPEED) ** 2
    assert np.abs(swing).max() < 2e-3 * exchanged
    assert reach > clearance


@pytest.mark.parametrize("step_deg", [2.5, 1.0])
def test_impacts_at_working_steps_neither_fail_nor_add_energy(step_deg):
    engine = guided(**UNDAMPED, clearance=PLAY)
    simulation = released(engine, step_deg, tolerance=None)
    before, gained = energy_on_ground(simulation), []
    for k in carry(simulation, 4 * 720, step_deg):
        if k % 24 == 0:
            gained.append(energy_on_ground(simulation) - before)
    exchanged = 0.5 * (SIX.rod.small_end_mass + SIX.cylinders.piston_mass) * (SIX.crankshaft.throw * SPEED) ** 2
    assert max(gained) < 0.01 * exchanged
    assert entry.count(simulation, "rejected") < 0.05 * entry.count(simulation, "steps")


def test_impacts_of_a_fired_engine():
    engine = guided(clearance=PLAY, friction=0.05)
    result = simulate(engine, rigid_crank(engine), Settings(crank="rigid", pistons="guided"), SPEED, 3)
    g = engine.piston_guidance
    for k in range(1, 7):
        lateral, tilt = (result.last_cycle(f"piston[{k}].{name}")[1] for name in ("lateral", "tilt"))
        ends = np.array([lateral - tilt * g.upper_height, lateral - tilt * g.lower_height])
        # It crosses the cylinder from side to side, and springs give way by what they carry.
        assert ends.max() > PLAY and ends.min() < -PLAY
        assert np.abs(ends).max() < PLAY + 20e3 / g.lower_stiffness


@pytest.mark.parametrize(("integrator", "order"), [("sdirk4", 4), ("sdirk3", 3), ("generalised-alpha", 2)])
def test_order_of_the_integrators_with_guided_pistons(integrator, order):
    def end(step_deg, method=integrator):
        engine = guided()
        simulation = released(engine, step_deg, method, 1e-13)
        simulation.state = start
        for _ in carry(simulation, 30, step_deg):
            pass
        return np.array([read(simulation, name) for name in NAMES])

    # An auxiliary acceleration belongs to its method and is set by running it.
    begin = released(guided(), 0.125, integrator, 1e-13)
    for _ in carry(begin, 30, 0.125):
        pass
    start = begin.state
    start[METHOD] = 0.0  # the reference's method reads no auxiliary acceleration
    reference = end(0.05, "sdirk4")
    steps = {4: (2.0, 1.0), 3: (0.5, 0.25), 2: (0.25, 0.125)}[order]
    coarse, fine = (np.abs(end(step) - reference).max() for step in steps)
    assert math.log2(coarse / fine) > order - 0.4
    assert fine < 1e-3 * np.abs(reference).max()


NAMES = tuple(f"piston[{k}].lateral" for k in range(1, 7))
