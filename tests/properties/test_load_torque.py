"""A dynamometer that is free to turn under a load torque: J Ω̇ is the sum of torques, and energy is kept."""

import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from bodies import rigid_crank
from one_line import one_line
from started import shown

import cranktrain as ct
from cranktrain.core.errors import SolverError
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.load_torque import LoadFollower, LoadTorque, loaded_end
from cranktrain.dynamics.simulation import Settings, Simulation, simulate
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.mean_load import mean_torque
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
    pins, banks = np.array(engine.cylinders.pins), np.array(engine.cylinders.bank_angles)
    angle = np.asarray(theta)[..., None] + np.array(engine.crankshaft.throw_angles)[pins - 1] - banks
    x, y = -throw * np.sin(angle), throw * np.cos(angle)
    high = np.sqrt(rod.length**2 - x**2)
    of_each = rod.big_end_mass * throw**2 + m_o * (x + x / high * y) ** 2 + remainder_inertia(rod) * (y / high) ** 2
    return of_each.sum(axis=-1)


TURN = np.linspace(0.0, 4.0 * math.pi, 720, endpoint=False)
INERTIA = CRANK_INERTIA + float(np.mean(rods_inertia(SIX, TURN))) + SIX.drive_line.dynamometer_inertia
TIMES = 4.0 * math.pi / SPEED * np.arange(10)
"""Of cycles, s."""


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


def test_an_excess_of_load_slows_everything_that_turns_and_the_frame_keeps_up():
    """Modes are small motions in the frame: a frame that fell behind would bend the crank in a wrong direction."""
    excess, cycles = 60.0, 10
    held, slowed = (cycle_means(run(load, cycles, gas_load=0.0), "crank.speed") for load in (0.0, excess))
    lost = np.polyfit(TIMES[2:cycles], (held - slowed)[2:], 1)[0]
    assert lost == pytest.approx(excess / INERTIA, rel=5e-3)
    turned = cycle_means(run(200.0, 20, gas_load=0.0), "flywheel.torsion")
    assert np.abs(turned).max() < 0.02 and np.abs(turned[12:]).max() < 2e-3


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


class Undamped:
    """A run without gas, weight and damping of the shaft, and what it has stored."""

    def __init__(self, **load):
        self.engine = replace(SIX, drive_line=replace(SIX.drive_line, damping=0.0))
        settings = replace(FREE, gas_source="input", gravity=0.0, step=math.radians(1.0))
        self.run = Simulation(self.engine, rigid_crank(self.engine), settings)
        for name, value in load.items():
            setattr(self.run, name, value)
        self.run.inputs[0] = SPEED
        self.run.initialize()

    def stored(self):
        """Energy (J) of what turns and of the wound-up shaft, turn (rad) and speed (rad/s) of the dynamometer."""
        line, out = self.engine.drive_line, shown(self.run)
        (q, v, _), (theta, omega, _) = entry.motion(self.run), entry.frame(self.run)
        rotor = entry.dynamometer(self.run.model)
        energy = 0.5 * (CRANK_INERTIA + rods_inertia(self.engine, out["crank.angle"])) * out["crank.speed"] ** 2
        energy += 0.5 * line.dynamometer_inertia * (omega + rotor @ v) ** 2
        return energy + 0.5 * out["shaft.torque"] ** 2 / line.stiffness, theta + rotor @ q, omega + rotor @ v

    def spent(self, torque, steps=3600):
        """Energy that was lost over the load's work ∫ T dψ after each step."""
        h, work, shares = communication_step(SPEED, self.run.settings.step), 0.0, []
        begin, angle, speed = self.stored()
        before = torque(angle, speed)
        for k in range(steps):
            self.run.step((k + 1) * h)
            energy, turned, speed = self.stored()
            now = torque(turned, speed)
            work, angle, before = work + 0.5 * (before + now) * (turned - angle), turned, now
            shares.append((begin - energy) / work)
        return shares


@pytest.mark.parametrize("bearings", ["linear", "impedance"])
def test_an_engine_runs_up_from_a_hundred_revolutions(bearings):
    speed = 100 * math.pi / 30
    result = run(0.0, 4, speed=speed, bearings=bearings)
    speeds = result.outputs["crank.speed"]
    assert np.isfinite(speeds).all()
    gained = cycle_means(result, "crank.speed")
    assert (np.diff(gained) > 0.0).all() and gained[-1] > 3 * speed
    # So slow, each burn throws the crank by as much as 2000 N m turn 2 kg m² in a third of a turn at 10 rad/s.
    assert np.abs(result.outputs["flywheel.torsion"]).max() < 2.0


def test_a_load_that_stalls_the_engine_is_refused_where_it_stands():
    simulation = Simulation(SIX, rigid_crank(SIX), FREE)
    simulation.inputs[0], simulation.load_torque = 300 * math.pi / 30, 3e4
    simulation.initialize()
    time = 0.0
    with pytest.raises(SolverError, match="stalls the engine"):
        while time < 0.1:
            time = simulation.time
            simulation.step(time + 5e-4)
    assert simulation.time == time and shown(simulation)["crank.speed"] > 0.0


# Over angle and speed -------------------------------------------------------------------------------------------------

LIGHT = {"crank": "torsional", "bearings": "held", "inherit": False, "load": 1.0}


def test_energy_of_rotation_is_spent_on_the_load():
    """By a constant torque, and by one of two orders that grows with the speed: what turns pays ∫ T dψ.

    Bearings on springs take and give a little, the dampers beside them keep some.
    """
    lost = Undamped(load_torque=150.0).spent(lambda angle, speed: 150.0)
    assert np.array(lost[809::90]) == pytest.approx(1.0, abs=2e-2)
    assert lost[-1] == pytest.approx(1.0, abs=5e-3)

    def torque(angle, speed):
        return (100.0 + 80.0 * math.cos(1.5 * angle) + 40.0 * math.sin(3.0 * angle)) * (speed / SPEED) ** 2

    undamped = Undamped(load_law=LoadFollower(LoadTorque(torque)))
    assert undamped.spent(torque)[-1] == pytest.approx(1.0, abs=5e-3)
    _, *motion = undamped.stored()
    assert loaded_end(undamped.run.model, undamped.run.state, 1.0) == pytest.approx(motion, rel=1e-12)


def test_a_fan_slows_an_engine_without_gas_along_a_hyperbola():
    """J Ω̇ = −c Ω² − f, so 1/Ω grows by c/J + f/(J Ω²) a second; the run without load tells f, that of the gas."""
    drag, cycles = 3e-3, 10
    held = cycle_means(run(0.0, cycles, gas_load=0.0), "crank.speed")
    load = LoadTorque(lambda angle, speed: drag * speed**2)
    slowed = cycle_means(run(load, cycles, gas_load=0.0), "crank.speed")
    grown, motored = (np.polyfit(TIMES[2:cycles], one[2:], 1)[0] for one in (1.0 / slowed, -held))
    assert grown - motored * float(np.mean(slowed[2:] ** -2)) == pytest.approx(drag / INERTIA, rel=5e-3)


@pytest.mark.parametrize(("name", "rpm"), [("single_petrol", 4000), ("four_petrol", 3000), ("v12_petrol", 5000)])
def test_a_load_as_number_array_and_function_is_one(name, rpm):
    engine, speed = ct.load_engine(name), rpm * math.pi / 30
    mean = mean_torque(engine, GasTrace.from_engine(engine), speed)
    same = (mean, np.full(720, mean), lambda angle: mean, lambda angle, speed: mean)
    first, *others = (ct.simulate(engine, speed_rpm=rpm, load_torque_nm=one, cycles=4, **LIGHT) for one in same)
    for other in others:
        np.testing.assert_allclose(other["crank.speed"], first["crank.speed"], rtol=1e-9)
    swung = mean * (1.0 + 0.5 * np.cos(1.5 * TURN))

    def straight(angle):
        return np.interp(angle % (4.0 * math.pi), np.append(TURN, 4.0 * math.pi), np.append(swung, swung[0]))

    by_array, by_function = (
        ct.simulate(engine, speed_rpm=rpm, load_torque_nm=one, cycles=4, **LIGHT) for one in (swung, straight)
    )
    np.testing.assert_allclose(by_array["shaft.torque"], by_function["shaft.torque"], rtol=0, atol=1e-6 * mean)
    order = by_array.orders("crank.speed")[1.5] - first.orders("crank.speed")[1.5]
    assert abs(order) > 0.0


WRONG_LOADS = [
    ([1.0], "give at least 2 values"),
    ([1.0, math.nan], r": value \[1\] is nan"),
    (np.ones((3, 3)), r"has the shape \(3, 3\)"),
    ("heavy", " is 'heavy', of type str"),
    (object(), "a object; give a number, an array over 720 deg or a function"),
    (lambda angle: "x", "the function returns 'x'; return one number, N m"),
    (lambda angle: 1 / 0, "the function raises ZeroDivisionError"),
    (lambda angle: math.nan, "the function returns nan"),
    (lambda angle, speed: 1e9, "returns 1e.09 N m; at most 1e.06 N m"),
]


@pytest.mark.parametrize(("load", "said"), WRONG_LOADS)
def test_wrong_loads_are_told_in_one_line(load, said):
    with one_line(match=f"^load_torque_nm.*{said}"):
        ct.simulate("single_petrol", speed_rpm=4000, load_torque_nm=load, cycles=1, **LIGHT)
