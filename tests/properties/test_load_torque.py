"""A dynamometer that is free to turn under a load torque: J Ω̇ is the sum of torques, and energy is kept."""

import math
from dataclasses import replace

import numpy as np
import pytest
from bodies import rigid_crank

from cranktrain.core.errors import SolverError
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model.state import offset
from cranktrain.dynamics.simulation import Settings, Simulation, simulate
from cranktrain.engine.file import load_engine
from cranktrain.loads.slider_crank import remainder_inertia

SIX = load_engine("diesel_i6")
SPEED = 2000 * math.pi / 30
# Springs without friction: what the gas does reaches the shaft.
FREE = Settings(crank="rigid", bearings="linear", boundary="torque")
CRANK_INERTIA = 1.4


def rods_inertia(engine, theta):
    """Inertia of rods and pistons against rotation of a rigid crank at ``theta``, kg m²."""
    rod, throw = engine.rod, engine.crankshaft.throw
    m_o = rod.small_end_mass + engine.cylinders.piston_mass
    total = 0.0
    for k, pin in enumerate(engine.cylinders.pins):
        angle = theta + engine.crankshaft.throw_angles[pin - 1] - engine.cylinders.bank_angles[k]
        x, y = -throw * np.sin(angle), throw * np.cos(angle)
        high = np.sqrt(rod.length**2 - x**2)
        total = total + rod.big_end_mass * throw**2 + m_o * (x + x / high * y) ** 2
        total = total + remainder_inertia(rod) * (y / high) ** 2
    return total


MEAN_INERTIA = float(np.mean(rods_inertia(SIX, np.linspace(0.0, 4 * np.pi, 720, endpoint=False))))


def run(torque, cycles, engine=SIX, speed=SPEED, **changes):
    settings = replace(FREE, **changes)
    return simulate(engine, rigid_crank(engine), settings, speed, cycles, load_torque=torque)


def cycle_means(result, name):
    values, n = result.outputs[name], result.per_cycle
    return np.array([values[k * n : (k + 1) * n].mean() for k in range((values.size - 1) // n)])


def test_the_steady_torque_holds_the_speed():
    speeds = cycle_means(run(None, 20), "crank.speed")
    # Found for a crank that turns evenly; the real one swings by some per cent.
    assert speeds[-1] == pytest.approx(SPEED, rel=2e-3)


def test_an_excess_of_load_slows_everything_that_turns():
    excess, cycles = 60.0, 10
    held, slowed = (cycle_means(run(load, cycles, gas_load=0.0), "crank.speed") for load in (0.0, excess))
    time = 4 * math.pi / SPEED * np.arange(cycles)
    inertia = CRANK_INERTIA + MEAN_INERTIA + SIX.drive_line.dynamometer_inertia
    lost = np.polyfit(time[2:], (held - slowed)[2:], 1)[0]
    assert lost == pytest.approx(excess / inertia, rel=5e-3)


def test_a_heavy_dynamometer_is_a_given_speed():
    heavy = replace(SIX, drive_line=replace(SIX.drive_line, dynamometer_inertia=1e6))
    # A crank that swings little: gas follows the crank where it is free, the shaft where its speed is given.
    crank = rigid_crank(SIX, inertia=(6.0, 6.0, 5.0))
    given = simulate(SIX, crank, replace(FREE, boundary="speed"), SPEED, 12)
    free = simulate(heavy, crank, FREE, SPEED, 12)
    for name in ("shaft.torque", "bearing[4].force.x", "bearing[4].force.y"):
        ours, theirs = (run.last_cycle(name)[1] for run in (free, given))
        assert np.std(ours - theirs) < 4e-3 * np.std(theirs), name
        assert ours.mean() == pytest.approx(theirs.mean(), rel=1e-3)


def test_energy_of_rotation_is_spent_on_the_load():
    """No gas, no weight, an undamped shaft: what turns and the wound-up shaft pay for the load's work."""
    engine = replace(SIX, drive_line=replace(SIX.drive_line, damping=0.0))
    settings = replace(FREE, gas_source="input", gravity=0.0, step=math.radians(1.0))
    simulation = Simulation(engine, rigid_crank(engine), settings)
    load = 150.0
    simulation.inputs[0], simulation.load_torque = SPEED, load
    simulation.initialize()
    h = communication_step(SPEED, settings.step)
    rotor = simulation.model.rotor

    def stored():
        """Energy (J), and how far the dynamometer has turned (rad)."""
        n, state = simulation.model.omega2.size, simulation.state
        q, v = (state[offset(k, n) : offset(k + 1, n)][: rotor.size] for k in range(2))
        out = dict(zip(simulation.output_names, simulation.outputs, strict=True))
        theta, omega = simulation.work.frames[0][:2]
        energy = 0.5 * (CRANK_INERTIA + rods_inertia(engine, out["crank.angle"])) * out["crank.speed"] ** 2
        energy += 0.5 * engine.drive_line.dynamometer_inertia * (omega + rotor @ v) ** 2
        return energy + 0.5 * out["shaft.torque"] ** 2 / engine.drive_line.stiffness, theta + rotor @ q

    before, begin = stored()
    lost = []
    for k in range(1, 3601):
        simulation.step(k * h)
        if k % 90 == 0:
            energy, angle = stored()
            lost.append((before - energy) / (load * (angle - begin)))
    # Bearings on springs take and give a little, the dampers beside them keep some.
    assert np.array(lost[8:]) == pytest.approx(1.0, abs=2e-2)
    assert lost[-1] == pytest.approx(1.0, abs=5e-3)


@pytest.mark.parametrize("bearings", ["linear", "impedance"])
def test_an_engine_runs_up_from_a_hundred_revolutions(bearings):
    speed = 100 * math.pi / 30
    result = run(0.0, 4, speed=speed, bearings=bearings)
    speeds = result.outputs["crank.speed"]
    assert np.isfinite(speeds).all()
    gained = cycle_means(result, "crank.speed")
    assert (np.diff(gained) > 0.0).all()
    assert gained[-1] > 3 * speed
    # So slow, each burn throws the crank by as much as 2000 N m turn 2 kg m² in a third of a turn at 10 rad/s.
    assert np.abs(result.outputs["flywheel.torsion"]).max() < 2.0


def test_the_frame_keeps_up_with_a_crank_that_slows_down():
    """Modes are small motions in the frame: a frame that fell behind would bend the crank in a wrong direction."""
    turned = cycle_means(run(200.0, 20, gas_load=0.0), "flywheel.torsion")
    assert np.abs(turned).max() < 0.02
    assert np.abs(turned[12:]).max() < 2e-3


def test_a_load_that_stalls_the_engine_is_refused_where_it_stands():
    simulation = Simulation(SIX, rigid_crank(SIX), FREE)
    simulation.inputs[0], simulation.load_torque = 300 * math.pi / 30, 3e4
    simulation.initialize()
    time = 0.0
    with pytest.raises(SolverError, match="stalls the engine"):
        while time < 0.1:
            time = simulation.time
            simulation.step(time + 5e-4)
    assert simulation.time == time
    assert dict(zip(simulation.output_names, simulation.outputs, strict=True))["crank.speed"] > 0.0
