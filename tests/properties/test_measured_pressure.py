"""Dead centre, zero, averages and resonance of pressures that our combustion module makes, with noise and drift added.

Stated chain: noise of 30 mbar at each sample, 100 cycles, zero wrong by -0.4 bar and drifting by 0.6 bar, samples each
half degree. Engines: the six and the eight, boosted, a small petrol engine's cylinder at full and part load, motored
and fired. Fit and module have heat transfer by Woschni in common; a case runs the module with 1.4 times the heat.
"""

import json
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from combustion_cycles import RPM, output, running, single, six, turn
from pulse_signals import channel, motion, sine_signal

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain_lab.measured.cylinder import Cylinder
from cranktrain_lab.measured.pressure import cycles_by_encoder, cycles_by_rotation, pegged, resonance, statistics
from cranktrain_lab.measured.rotation import rotation
from cranktrain_lab.measured.wheel import Wheel

STEP = 0.5
SMALL = {
    "bore": 0.076, "stroke": 0.0807, "rod_length": 0.137, "compression_ratio": 10.5, "exhaust_pressure": 1.05e5,
    "intake_diameter": 0.030, "exhaust_diameter": 0.026,
}  # fmt: skip
EIGHT = {"bore": 0.120, "stroke": 0.139, "rod_length": 0.231, "compression_ratio": 17.0, "fuel_mass": 124e-6}
CASES = {
    "six, motored": ({}, 2000.0, 0.0),
    "six, motored slowly": ({}, 800.0, 0.0),
    "six, fired": ({}, 2000.0, None),
    "eight, fired": (EIGHT, 1500.0, None),
    "small, motored": (SMALL | {"intake_pressure": 1.0e5}, 3000.0, 0.0),
    "small, fired": (SMALL | {"intake_pressure": 1.0e5, "fuel_mass": 16e-6}, 3000.0, None),
    "small, part load motored": (SMALL | {"intake_pressure": 0.6e5}, 1500.0, 0.0),
    "six, motored, 1.4 times the heat": ({"wall_factor": 1.4}, 1500.0, 0.0),
    "six, fired at half load": ({}, 1000.0, 0.5 * six().fuel_mass),
    "six, fired at a fifth of the load": ({}, 1000.0, 0.2 * six().fuel_mass),
    "six, fired at a twentieth of the load": ({}, 2000.0, 0.05 * six().fuel_mass),
    "eight, fired at a fifth of the load": (EIGHT | {"wall_factor": 1.4}, 1800.0, 0.2 * EIGHT["fuel_mass"]),
    "eight, fired at a tenth of the load": (EIGHT, 900.0, 0.1 * EIGHT["fuel_mass"]),
}


@cache
def cycle(name):
    """Settings, speed (rad/s) and one settled cycle (1440,) Pa from 0.5 to 720 deg after firing dead centre."""
    changes, rpm, fuel = CASES[name]
    settings = single(**changes)
    simulation = running(settings, rpm, **({} if fuel is None else {"fuel_mass": fuel}))
    turn(simulation, 720.0, 1.0)
    return settings, rpm * RPM, output(simulation, turn(simulation, 720.0, STEP), "cylinder[1].pressure")


def peg(made, settings, **more):
    """Cycles with their zeros and the fit, gas and walls of the temperatures that the module has."""
    return pegged(made, cylinder_of(settings), intake_temperature=settings.intake_temperature,
                  wall_temperature=settings.wall_temperature, **more)  # fmt: skip


def cylinder_of(settings):
    return Cylinder(settings.bore, settings.stroke, settings.rod_length, settings.compression_ratio)


def encoded(values, speed, first=STEP, unit="Pa", samples=1440):
    """Cycles of samples each half degree."""
    return cycles_by_encoder(channel(values, 1.0, "p", unit), samples, first, speed)


def recorded(name, shift_deg, cycles=100, seed=0):
    """Cycles of an encoder whose dead centre is wrong, and the true zero (c,) Pa of each cycle."""
    _, speed, pressure = cycle(name)
    rng = np.random.default_rng(seed)
    n = cycles * pressure.size
    drift = -0.4e5 + 0.3e5 * np.sin(math.tau * np.arange(n) / n)
    values = np.tile(pressure, cycles) + drift + rng.normal(0.0, 0.03e5, n)
    made = encoded(1e-5 * values, speed, STEP - shift_deg, "bar")
    middles = (np.arange(len(made.pressure)) + 1.0) * pressure.size
    zeros = 0.4e5 - 0.3e5 * np.sin(math.tau * middles / n)
    return made, zeros


@pytest.mark.parametrize("shift_deg", [0.0, 0.8, -1.3])
@pytest.mark.parametrize("name", CASES)
def test_dead_centre_within_a_tenth_of_a_degree_and_zero_within_5_mbar(name, shift_deg):
    settings, _, pressure = cycle(name)
    made, zeros = recorded(name, shift_deg)
    found, fit = peg(made, settings, correct_shift=True)
    assert fit.motored == ("motored" in name)
    assert math.degrees(fit.shift) == pytest.approx(shift_deg, abs=0.1)
    assert fit.shift_interval[0] < math.radians(shift_deg) < fit.shift_interval[1]
    assert 1e-2 * abs(np.mean(found.zeros - zeros)) < 5.0
    true = np.interp(np.degrees(found.angle), np.arange(1, 1441) * STEP, pressure, period=720.0)
    low = np.abs(np.degrees(found.angle) + 100.0) < 15.0
    assert 1e-2 * abs(np.mean(found.mean[low] - true[low])) < 7.0


@pytest.mark.parametrize("method", ["compression", "polytropic", "intake", "keep"])
def test_cycles_read_some_at_a_time_are_those_read_at_once(method, monkeypatch):
    """Blocks of three cycles, and cycles with missing values left out, against all at once."""
    settings, speed, pressure = cycle("six, fired")
    rng = np.random.default_rng(3)
    values = 1e-5 * np.tile(pressure, 40) * np.repeat(rng.normal(1.0, 0.01, 40), pressure.size)
    values[[1000, 20000]] = np.nan

    def told():
        made = encoded(values, speed, unit="bar")
        found, fit = pegged(made, cylinder_of(settings), method=method, intake_pressure=2e5, correct_shift=True)
        passed = found.low_passed(math.radians(3.0))
        return passed, statistics(passed, cylinder_of(settings), fit)

    whole, at_once = told()
    monkeypatch.setattr("cranktrain_lab.measured.cycles.BLOCK", 3 * pressure.size)
    parts, in_turn = told()
    assert at_once.keys() == in_turn.keys() and at_once["cycles"] == 37
    for key, value in at_once.items():
        # An error is estimated by differences.
        close = 1e-3 if "error" in key or "interval" in key else 1e-6
        number = isinstance(value, float) or "interval" in key
        assert in_turn[key] == (pytest.approx(value, rel=close, abs=1e-7, nan_ok=True) if number else value), key
    assert np.asarray(parts.pressure) == pytest.approx(np.asarray(whole.pressure), rel=1e-6)
    assert parts.scatter == pytest.approx(whole.scatter, rel=1e-6, abs=1.0)


def test_the_drift_of_single_cycles_is_followed_and_the_loss_angle_is_that_of_the_module():
    """Zeros of single cycles scatter by the noise over the root of the samples that tell them: a few mbar."""
    settings, _, pressure = cycle("six, motored")
    made, zeros = recorded("six, motored", 0.0)
    found, fit = peg(made, settings)
    off = 1e-2 * (found.zeros - zeros)
    assert np.ptp(1e-2 * zeros) > 500.0 and np.std(off) < 25.0
    told = statistics(found, cylinder_of(settings), None)
    assert told["zero_scatter_bar"] == pytest.approx(1e-5 * np.std(zeros, ddof=1), rel=0.1)
    # A motored peak lies before dead centre by the heat to the walls: the module's loss angle.
    angle = (np.arange(1, 1441) * STEP + 360.0) % 720.0 - 360.0
    order = np.argsort(angle)
    angle, pressure = angle[order], pressure[order]
    k = int(np.argmax(pressure))
    a, b, c = pressure[k - 1 : k + 2]
    true = -(angle[k] + 0.5 * STEP * (a - c) / (a - 2.0 * b + c))
    assert math.degrees(fit.loss) == pytest.approx(true, abs=0.05) and true > 0.15
    _, hot = peg(recorded("six, motored, 1.4 times the heat", 0.0)[0], settings)
    assert hot.loss > fit.loss and hot.heat / fit.heat == pytest.approx(1.4, rel=0.15)


def test_pegging_by_two_points_and_by_the_intake():
    """A polytrope is exact where the gas is one; the intake's pressure is where the piston stands low."""
    cylinder = Cylinder(0.1, 0.12, 0.19, 17.0)
    angle = np.radians(np.arange(-360.0, 360.0, 0.5))
    pressure = 2.0e5 * (cylinder.volume(np.array([-math.pi]))[0] / cylinder.volume(angle)[0]) ** 1.33
    made = encoded(np.tile(pressure - 0.7e5, 5), 100.0, -360.0)
    found, _ = pegged(made, cylinder, method="polytropic", exponent=1.33)
    np.testing.assert_allclose(found.zeros, 0.7e5, atol=20.0)
    found, _ = pegged(made, cylinder, method="intake", intake_pressure=2.0e5)
    np.testing.assert_allclose(found.zeros, 0.7e5, rtol=0.02)
    for wrong, said in (({"method": "intake"}, "needs its pressure"), ({"method": "two"}, "'two' does not exist")):
        with pytest.raises(InputError, match=said):
            pegged(made, cylinder, **wrong)


def test_scatter_averages_and_mean_effective_pressure():
    """Cycles of 10 % more and less pressure above the compression: known mean, scatter and work."""
    settings, speed, pressure = cycle("six, fired")
    cylinder = cylinder_of(settings)
    factors = np.array([0.9, 1.0, 1.1, 1.0, 0.95, 1.05])
    values = np.concatenate([factor * pressure for factor in np.append(factors, 1.0)])
    made = encoded(values, speed)
    told = statistics(made, cylinder, None)
    assert told["cycles"] == 6 and told["speed_rpm"] == pytest.approx(2000.0)
    # Cycles begin at -360 deg: each has one half of two neighbours; its peak is of the later one.
    assert told["peak_bar"] == pytest.approx(1e-5 * pressure.max() * np.mean(np.append(factors[1:], 1.0)), rel=1e-4)
    volume, slope = cylinder.volume(np.radians(np.arange(1, 1441) * STEP))
    one = pressure @ slope * math.radians(STEP) / np.ptp(volume)
    assert 1e5 * told["imep_bar"] == pytest.approx(one * np.mean(np.append(factors[1:], 1.0)), rel=0.02)
    # Halves of two cycles: the expansion's work, which scatters as the factors do, less a compression's.
    assert 100.0 * np.std(factors, ddof=1) < told["imep_cov_percent"] < 200.0 * np.std(factors, ddof=1)


def test_a_time_sampled_trace_is_taken_over_the_measured_rotation():
    """50 kHz, a speed that swings and rises, cylinder 2 fires 240 deg later, a wheel that starts a revolution off."""
    settings, _, pressure = cycle("six, fired")
    _, _, theta = motion(5e4, 4.0, (1900, 2100), {3.0: (1.0, 0.4)})
    firing = math.radians(240.0)
    later = np.degrees(theta - firing) % 720.0
    values = 1e-5 * np.interp(later, np.arange(1, 1441) * STEP, pressure, period=720.0)
    turning = rotation(channel(sine_signal(theta, 120), 5e4), Wheel(120)).turned(-math.radians(3.0))
    made = cycles_by_rotation(channel(values, 5e4, "p2", "bar"), turning, firing=firing)
    true = np.interp(np.degrees(made.angle), np.arange(1, 1441) * STEP, pressure, period=720.0)
    assert np.abs(made.mean - true).max() < 0.01 * pressure.max()
    _, fit = pegged(made, cylinder_of(settings), intake_temperature=settings.intake_temperature)
    assert abs(math.degrees(fit.shift)) < 0.1


def test_the_resonance_of_an_indicating_channel_is_told():
    settings, speed, pressure = cycle("six, fired")
    cylinder = cylinder_of(settings)
    t = np.arange(pressure.size * 20) * math.radians(STEP) / speed
    k = np.arange(1440)
    ringing = np.tile(np.where((k > 10) & (k < 160), np.exp(-k / 80.0), 0.0), 20) * np.sin(math.tau * 4200.0 * t)
    for amplitude in (0.0, 2.0e5):
        values = np.tile(pressure, 20) + amplitude * ringing + np.random.default_rng(1).normal(0, 2e3, t.size)
        made = encoded(values, speed)
        found = resonance(made, cylinder)
        assert (found is None) == (amplitude == 0.0)
    assert found["hz"] == pytest.approx(4200.0, abs=250.0) and 0.3e5 < found["amplitude"] < 2.0e5
    smooth = made.low_passed(math.radians(8.0))
    assert resonance(smooth, cylinder) is None
    assert np.abs(smooth.mean - made.mean).max() < 6e5 and smooth.angle is made.angle


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"unit": "bar"}, r"pressure swings by .* bar over a cycle; check its unit"),
        ({"samples": 144_000}, r"hold no whole cycle of 144000"),
        ({}, r"low-pass of 0\.5 deg is finer than two samples, 1 deg"),
    ],
)
def test_wrong_pressures_are_told(change, says):
    _, speed, pressure = cycle("six, motored")
    with pytest.raises(InputError, match=says):
        encoded(np.tile(pressure, 5), speed, **change).low_passed(math.radians(0.5))


def test_a_trace_of_another_engine_is_told():
    settings, speed, pressure = cycle("six, motored")
    other = replace(cylinder_of(settings), compression_ratio=9.0)
    made = encoded(np.tile(pressure, 5), speed)
    with pytest.raises(InputError, match=r"compression fits the trace only with .*another engine"):
        pegged(made, other)
    near = replace(other, compression_ratio=16.4)
    found, _ = pegged(made, near, intake_temperature=settings.intake_temperature)
    assert any("check compression ratio (16.4)" in text for text in found.remarks)


def test_geometry_is_that_of_the_engine():
    for name in ("diesel_i6", "single_petrol", "v12_petrol"):
        engine = load_engine(name)
        cylinder = Cylinder.of(engine, engine.n_cylinders)
        volume, slope = cylinder.volume(np.radians(np.arange(0.0, 720.0, 0.25)))
        ratio = engine.cylinders.compression_ratio
        assert volume.argmin() in (0, 1440) and volume.max() / volume.min() == pytest.approx(ratio, rel=1e-5)
        assert np.ptp(volume) * engine.n_cylinders == pytest.approx(engine.displacement, rel=2e-3)
        np.testing.assert_allclose(np.gradient(volume, math.radians(0.25))[9:-9], slope[9:-9], atol=1e-4 * slope.max())
    with pytest.raises(InputError, match="has no cylinder 7; it has 1 to 6"):
        Cylinder.of(load_engine("diesel_i6"), 7)


def test_the_command_writes_a_trace_that_simulate_reads(tmp_path, capsys):
    import scipy.io

    from cranktrain.loads.pressure_file import read_pressure

    _, _, pressure = cycle("six, fired")
    scipy.io.savemat(tmp_path / "p.mat", {"pcyl1": {"data": 1e-5 * np.tile(pressure, 4) - 0.5, "unit": "bar"}})
    out = tmp_path / "mean.csv"
    command = ["measured", str(tmp_path / "p.mat"), "--pressure", "pcyl1/data", "--engine", "diesel_i6", "--json"]
    further = ["--samples-per-cycle", "1440", "--first-deg", "0.5", "--speed", "2000", "--output", str(out)]
    assert main(command) == 2 and "crank angle is not known" in capsys.readouterr().err
    assert main([*command, *further]) == 0
    told = json.loads(capsys.readouterr().out)["pressure"][0]
    assert told["zero_bar"] == pytest.approx(0.5, abs=0.02) and abs(told["dead_centre_shift_deg"]) < 0.1
    assert out.read_text().splitlines()[1] == "deg;bar"
    (read,), _ = read_pressure(out, None, None, 1440, load_engine("diesel_i6"))
    # Two of the two samples' half steps lie between those of the module.
    np.testing.assert_allclose(read[1:], pressure[:-1] - 0.5e5 + 1e5 * told["zero_bar"], atol=0.5e5)


def test_what_one_flank_leaves_open_is_told_with_its_interval():
    """Fired: the interval of the dead centre in the remark, in the JSON's numbers and around the shift found."""
    settings, _, _ = cycle("six, fired")
    made, _ = recorded("six, fired", 0.8)
    found, fit = pegged(made, cylinder_of(settings), intake_temperature=settings.intake_temperature)
    told = statistics(found, cylinder_of(settings), fit)
    low, high = told["dead_centre_interval_deg"]
    assert low < 0.8 < high and high - low == pytest.approx(2 * 1.96 * told["dead_centre_error_deg"])
    low, high = told["zero_interval_bar"]
    assert high - low == pytest.approx(2 * 1.96 * told["zero_error_bar"]) and low < told["zero_bar"] < high
    assert any("of a fired trace alone tells the dead centre within 0.1" in text for text in found.remarks)
    motored, _ = pegged(recorded("six, motored", 0.0)[0], cylinder_of(settings))
    assert not any("the dead centre within" in text for text in motored.remarks)
