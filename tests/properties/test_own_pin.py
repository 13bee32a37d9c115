"""A pressure belongs to the volume of its own cylinder: the gas does the indicated work, however the crank twists."""

import math
from dataclasses import replace
from pathlib import Path

import entry
import numpy as np
import pytest
from designed import designed
from scipy.interpolate import CubicSpline
from some import some
from standing import rigid_block
from started import at_speed, shown

from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Parts, Simulation, simulate
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import CYCLE, GasTrace
from cranktrain.structure.assembly import running_crank
from cranktrain.studies.torsion.frequency_run_up import frequency_run_up

EXAMPLES = Path(__file__).parents[2] / "examples"
SPEED = 2000.0 * math.pi / 30.0
TWISTS = Settings(crank="torsional", bearings="held", step=math.radians(2.5))
"""Nothing rubs on journals that are locked on their axis."""


def started(made, **choices):
    """A torsional crank at its start."""
    return at_speed(SPEED, made, running_crank(made, "torsional"), replace(TWISTS, **choices))


def volume_of(made, angle, c):
    """Volume of cylinder c (m³) at its crank angle after firing dead centre, the piston pin by a right triangle."""
    throw, offset, rod = made.crankshaft.throw, made.offsets[c], made.rods[c].length
    area = 0.25 * math.pi * made.cylinders.bore**2
    high = throw * np.cos(angle) + np.sqrt(rod**2 - (throw * np.sin(angle) + offset) ** 2)
    clearance = 2.0 * throw / (made.cylinders.compression_ratio - 1.0)
    return area * (clearance + math.sqrt((throw + rod) ** 2 - offset**2) - high)


def indicated_work(made, gas, speed):
    """∮ p dV of all cylinders (J) at the samples of the trace, whose mean over a period is exact, in closed form."""
    share = max(0.0, 1.0 - gas.falloff * (speed / gas.best_speed - 1.0) ** 2)
    pressure = gas.motored + share * (gas.fired - gas.motored)
    area, throw = 0.25 * math.pi * made.cylinders.bore**2, made.crankshaft.throw
    sin, cos = np.sin(gas.angles), np.cos(gas.angles)
    work = 0.0
    for rod, offset in zip(made.rods, made.offsets, strict=True):
        across = throw * sin + offset
        falls = throw * sin + across * throw * cos / np.sqrt(rod.length**2 - across**2)
        work += area * CYCLE * float(np.mean(pressure * falls))
    return work


@pytest.mark.parametrize("name", ["diesel_i6", "i5", "single"])
def test_the_gas_does_the_indicated_work_of_its_trace(name, tmp_path):
    """The six's pins twist by 0.1 degrees; at the crank's mean angle the gas did 0.7 % more."""
    made = load_engine(name) if name == "diesel_i6" else designed(tmp_path, name)[0]
    gas = GasTrace.from_engine(made)
    run = simulate(made, running_crank(made, "torsional"), TWISTS, SPEED, gas=gas, settle=1e-5)
    expected = indicated_work(made, gas, SPEED)
    works = np.trapezoid(run.powers, dx=run.step, axis=0)
    assert entry.power(works, "gas_power") == pytest.approx(expected, rel=1e-4)
    # Without friction all but the heat of the dampings reaches the dynamometer.
    torque = float(np.mean(run.last_cycle("shaft.torque")[1][:-1]))
    damped = entry.power(works, "shafts_loss") + entry.power(works, "crank_loss")
    assert torque * CYCLE == pytest.approx(expected - damped, rel=1e-4)


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_each_cylinder_tells_the_angle_of_its_own_pin(name):
    """By the volume, which a torsional crank changes through that angle alone."""
    made = load_engine(name)
    simulation = started(made)
    simulation.step(math.radians(37.0) / SPEED)
    found = shown(simulation)
    turns = []
    for c in range(made.n_cylinders):
        angle = found[f"cylinder[{c + 1}].angle"]
        assert 0.0 <= angle < CYCLE
        volume = volume_of(made, angle, c)
        assert found[f"cylinder[{c + 1}].volume"] == pytest.approx(volume, rel=1e-9)
        turns.append((angle + made.firing_angles[c] - found["crank.angle"] + math.pi) % CYCLE - math.pi)
    assert np.ptp(turns) > math.radians(0.02)


@pytest.mark.parametrize(("name", "rpm"), [("diesel_i6", 700.0), ("four_with_balancers", 900.0)])
def test_angles_are_against_cylinders_that_pitch_and_roll_with_the_engine(name, rpm):
    """By the volumes at half stroke, off by what an angle misses of roll, pitch and yaw."""
    made = load_engine(name if name == "diesel_i6" else EXAMPLES / f"{name}.toml")
    made = replace(made, connection=())
    body = running_crank(made, "beam")
    settings = replace(TWISTS, crank="beam", bearings="impedance", block="flexible")
    run = simulate(made, body, settings, rpm * math.pi / 30.0, 8, parts=Parts(block=rigid_block(made, body)))
    found = {output: run.last_cycle(output)[1] for output in run.outputs}
    step = 1e-5
    for c in some(range(made.n_cylinders)):
        angle = found[f"cylinder[{c + 1}].angle"]
        off = found[f"cylinder[{c + 1}].volume"] - volume_of(made, angle, c)
        off /= (volume_of(made, angle + step, c) - volume_of(made, angle - step, c)) / (2.0 * step)
        half = np.abs(np.sin(angle)) > 0.9
        roll = found["engine.rotation.z"][half]
        assert np.linalg.norm(off[half]) < 0.1 * np.linalg.norm(roll)


@pytest.mark.parametrize("encoder", ["pin", "pulley", "flywheel"])
def test_time_and_frequency_agree_wherever_the_encoder_sits(encoder):
    made = load_engine("diesel_i6")
    body, settings = running_crank(made, "torsional"), replace(TWISTS, encoder=encoder)
    run = simulate(made, body, settings, SPEED, settle=1e-5)
    steady = frequency_run_up(made, body, settings, np.array([SPEED]), [1.5, 4.5, 6.0], "harmonic-balance")
    torsion = run.last_cycle("pulley.torsion")[1][:-1]
    lines = np.abs(np.fft.rfft(torsion))[[3, 9, 12]] * 2.0 / torsion.size
    assert lines == pytest.approx(np.abs(steady.torsion[0]), abs=2e-4 * np.abs(steady.torsion).max())


@pytest.mark.parametrize("encoder", ["pulley", "flywheel"])
def test_an_encoder_shifts_the_trace_by_the_twist_between_it_and_the_pins(encoder):
    """The work changes by ∮ [p(φ_e) − p(φ)] dV of all cylinders, with both angles from the run."""
    made = load_engine("diesel_i6")
    gas = GasTrace.from_engine(made)
    share = 1.0 - gas.falloff * (SPEED / gas.best_speed - 1.0) ** 2
    samples = gas.motored + share * (gas.fired - gas.motored)
    pressure = CubicSpline(np.append(gas.angles, CYCLE), np.append(samples, samples[0]), bc_type="periodic")
    simulation = started(made, encoder=encoder)
    cylinders = range(made.n_cylinders)
    names = [f"{encoder}.torsion"]
    names += [f"cylinder[{c + 1}].{what}" for c in cylinders for what in ("angle", "volume_rate")]
    places = [simulation.output_names.index(name) for name in names]
    per_cycle, cycles = 288, 30
    changed = worked = 0.0
    for k in range(per_cycle * cycles):
        simulation.step((k + 1) * CYCLE / per_cycle / SPEED)
        if k < per_cycle * (cycles - 1):
            continue
        torsion, *each = simulation.outputs[places]
        place = entry.frame(simulation)[0] + torsion
        worked += entry.power(simulation, "gas_power")
        for c in cylinders:
            own, rate = each[2 * c : 2 * c + 2]
            changed += (pressure(place - made.firing_angles[c]) - pressure(own)) * rate
    h = CYCLE / per_cycle / SPEED
    expected = indicated_work(made, gas, SPEED)
    assert abs(changed * h) > 1e-3 * expected
    assert worked * h - expected == pytest.approx(changed * h, rel=0.02)


def test_given_pressures_of_one_crank_angle_do_their_work():
    """A partner that knows the crank's angle alone gives p(θ); each piston takes p at its own pin's angle."""
    made = load_engine("diesel_i6")
    gas = GasTrace.from_engine(made)
    settings = replace(TWISTS, gas_source="input", step=math.radians(1.0))
    simulation = Simulation(made, running_crank(made, "torsional"), settings, gas)
    angles = np.append(gas.angles, CYCLE)
    pressure = np.append(gas.fired, gas.fired[0])

    def given(angle):
        return [np.interp((angle - phase) % CYCLE, angles, pressure) for phase in made.firing_angles]

    simulation.inputs[0] = SPEED
    simulation.pressures[:] = given(0.0)
    simulation.initialize()
    h, cycles, per_cycle = math.radians(1.0) / SPEED, 30, 720
    powers = []
    for k in range(cycles * per_cycle):
        theta = simulation.outputs[0]
        simulation.pressures[:] = given(theta)
        simulation.inputs[simulation.input_names.index("pressure.angle")] = theta
        simulation.step((k + 1) * h)
        powers.append(entry.power(simulation, "gas_power"))
    taken = float(np.mean(powers[-per_cycle:])) * CYCLE / SPEED
    assert taken == pytest.approx(indicated_work(made, replace(gas, falloff=0.0), SPEED), rel=1e-4)
