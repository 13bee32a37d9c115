"""Rotation and orders from pulses of known motions: teeth, gaps, lost and double pulses, twist, vibrometers, ramps.

The chain of the precise tests: an inductive pick-up with noise of 0.1 % of its amplitude (60 dB), sampled at 200 or
400 kHz; teeth are wrong by 3 % of a pitch (standard deviation). The noise moves a crossing by 0.06 % of a pitch at a
time: 0.5 mdeg with 120 teeth.
"""

import json
import math

import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st
from pulse_signals import RPM, channel, crossing_times, motion, sine_signal

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.results.orders.measured import band_of, phases_of, read_measured_orders
from cranktrain.results.run_up.run_up import TORSION
from cranktrain_lab.measured.channels import Measurement
from cranktrain_lab.measured.filtered import envelopes, filtered_orders
from cranktrain_lab.measured.pulses import pulse_times
from cranktrain_lab.measured.rotation import rotation, tachos
from cranktrain_lab.measured.tracking import channel_points, torsion_points, track
from cranktrain_lab.measured.wheel import Wheel, number_teeth


@pytest.mark.parametrize("learn", [False, True])
def test_an_eccentric_wheel_is_order_one_and_learning_removes_what_recurs(learn):
    """Order 1 stays unless eccentricity is removed, which is learned apart; half orders stay."""
    _, _, theta = motion(1e5, 6.0, (1000, 2000), {0.5: (0.1, 0.3), 3.0: (0.1, 0.5), 4.5: (0.05, -1.0)})
    errors = np.radians(0.4) * np.cos(np.arange(120) * math.tau / 120 + 0.7)
    wave = channel(sine_signal(theta, 120, errors=errors), 1e5)
    for eccentricity, first in (("keep", 0.4), ("remove", 0.0)):
        turning = rotation(wave, Wheel(120), learn=learn, eccentricity=eccentricity)
        found = track(torsion_points(turning), turning, np.array([0.5, 1.0, 3.0, 4.5]))
        wanted = np.tile([0.1, first, 0.0 if learn else 0.1, 0.05], (len(found.speeds), 1))
        np.testing.assert_allclose(np.degrees(np.abs(found.amplitudes)), wanted, atol=2e-3)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 10_000), st.sampled_from([(60, 2), (36, 1), (60, 0), (120, 0)]), st.integers(0, 6), st.integers(0, 6)
)
def test_lost_and_double_pulses_leave_no_slip(seed, wheel, lost, doubled):
    """Single pulses that are lost or doubled change neither number nor place of the others."""
    rng = np.random.default_rng(seed)
    teeth, missing = wheel
    t, _, theta = motion(2e4, 4.0, (800, 1600), {2.0: (1.0, 0.3), 0.5: (0.5, 0.0)})
    times = crossing_times(t, theta, teeth, missing)
    numbered = number_teeth(times, Wheel(teeth, missing), "bench")
    places = np.sort(rng.choice(np.arange(50, times.size - 50, 20), lost + doubled, replace=False))
    rng.shuffle(places)
    gone, twice = places[:lost], places[lost:]
    echo = times[twice] + 0.2 * np.minimum(times[twice + 1] - times[twice], times[twice] - times[twice - 1])
    broken = np.sort(np.append(np.delete(times, gone), echo))
    mended = number_teeth(broken, Wheel(teeth, missing), "bench")
    assert mended.lost == lost and mended.doubled == doubled
    _, ours, theirs = np.intersect1d(mended.times, numbered.times, return_indices=True)
    assert ours.size >= times.size - lost - doubled
    apart = np.unique(mended.teeth[ours] - numbered.teeth[theirs])
    assert apart.size == 1 and apart[0] % teeth == 0


def test_a_gap_is_found_and_says_the_teeth():
    _, _, theta = motion(5e4, 3.0, (900, 900), {})
    wave = channel(sine_signal(theta, 60, 2), 5e4)
    (told,) = tachos(Measurement((wave, channel(np.zeros(1000), 5e4, "off"))))
    assert (told["channel"], told["teeth"], told["missing"]) == ("tacho", 60, 2)
    with pytest.raises(InputError, match="are 60 teeth apart, not 36"):
        rotation(wave, Wheel(36, 2))


@pytest.mark.parametrize(("order", "amplitude"), [(0.5, 0.3), (6.0, 0.1)])
def test_twist_between_places_with_their_own_pulses(order, amplitude):
    """Front 60−2, rear 90 teeth: the twist is the difference of both motions; the common one drops out."""
    _, phi, common = motion(1e5, 10.0, (1000, 2000), {1.5: (0.4, 0.2), 3.0: (0.5, 0.1)})
    front = common + math.radians(amplitude) * np.cos(order * phi + 0.4)
    one = rotation(channel(sine_signal(front, 60, 2), 1e5, "front"), Wheel(60, 2))
    two = rotation(channel(sine_signal(common, 90), 1e5, "rear"), Wheel(90)).against(one)
    orders = np.array([1.5, 3.0, order])
    found = [track(torsion_points(place), one, orders, cycles=10, step_rpm=1000.0) for place in (one, two)]
    twist = np.degrees(np.abs(np.mean(found[0].amplitudes, axis=0) - np.mean(found[1].amplitudes, axis=0)))
    np.testing.assert_allclose(twist, [0.0, 0.0, amplitude], atol=0.01 * amplitude + 5e-4)


@pytest.mark.parametrize("integrals", [0, 1, 2])
def test_a_vibrometer_s_velocity_or_an_acceleration_is_integrated(integrals):
    """Displacement, velocity and acceleration of one motion give the same orders, over a ramp and with half orders."""
    rate = 5e4
    _, phi, theta = motion(rate, 12.0, (800, 1600), {})
    x = sum(a * np.cos(n * phi + p) for n, a, p in ((0.5, 2.0, 0.3), (3.0, 1.0, -0.6), (12.0, 0.2, 1.0)))
    for _ in range(integrals):
        x = np.gradient(x) * rate
    turning = rotation(channel(sine_signal(theta, 60), rate), Wheel(60))
    points = channel_points(channel(x, rate, "vibrometer"), turning, 13.0, integrals)
    found = track(points, turning, np.array([0.5, 3.0, 12.0]), step_rpm=100.0)
    np.testing.assert_allclose(np.abs(found.amplitudes), np.tile([2.0, 1.0, 0.2], (len(found.speeds), 1)), rtol=0.01)


def test_vold_kalman_has_its_bandwidth():
    """An envelope that beats at the bandwidth comes out at −3 dB; well below it comes out whole."""
    rate, band = 1000.0, 2.0
    t = np.arange(8000) / rate
    phi = math.tau * 100.0 * t
    for beat, gain in ((band, math.sqrt(0.5)), (0.1 * band, 1.0)):
        values = np.cos(math.tau * beat * t) * np.cos(phi)
        found = envelopes(phi, values, 1.0 / rate, np.array([1.0]), band)[3000:5000, 0]
        assert np.abs(found.real).max() == pytest.approx(gain, rel=0.02)


def test_a_standstill_within_a_recording_is_told():
    _, _, theta = motion(5e3, 3.0, (3000, 3000), {})
    theta = np.concatenate((theta, np.full(30_000, theta[-1]), theta[-1] + theta[:4000]))
    stopped = rotation(channel(sine_signal(theta, 20), 5e3), Wheel(20))
    assert any("stands still from" in text for text in stopped.remarks)
    assert stopped.speed_range[0] / RPM == pytest.approx(3000.0, rel=1e-3)


def test_milliseconds_under_a_unit_of_seconds_are_told_by_the_speed(tmp_path, capsys):
    """1200 rev/min become 1.2; a ship's 60 rev/min are a speed. An angle of dead centre lies within two revolutions."""
    _, _, theta = motion(5e3, 4.0, (1200, 1200), {})
    slow = rotation(channel(sine_signal(theta, 20), 5.0), Wheel(20))
    (line,) = [text for text in slow.remarks if "rev/min" in text]
    assert "turns at 1.2 rev/min, and engines run at 15 or more; check the unit of the times (ms against s)" in line
    ship = rotation(channel(sine_signal(theta, 20), 250.0), Wheel(20))
    assert not any("engines run at" in text for text in ship.remarks)
    command = ["measured", str(tmp_path / "run.mat"), "--rotation", "pulley", "--teeth", "60"]
    assert main([*command, "--dead-centre-deg", "1e9"]) == 2
    assert "1e+09 is not within -720 to 720 deg" in capsys.readouterr().err


def test_level_edge_and_drifting_signals():
    """A square wave with an offset, its two edges, and a signal whose amplitude grows with the speed."""
    t, _, theta = motion(1e5, 2.0, (600, 3000), {})
    square = np.where(np.sin(30.0 * theta) > 0.0, 4.8, 0.2)
    wave = channel(square, 1e5)
    rising, falling = (pulse_times(wave, edge=edge, cubic=False).times for edge in ("rising", "falling"))
    true = crossing_times(t, theta, 30)
    assert abs(rising.size - true.size) <= 1 and np.abs(rising[-50:] - true[-50:]).max() < 1e-5
    assert np.interp(falling[50], t, 30.0 * theta / math.tau) % 1.0 == pytest.approx(0.5, abs=0.02)
    growing = pulse_times(channel(np.sin(30.0 * theta) * np.gradient(theta) * 1e5, 1e5))
    assert abs(growing.times.size - true.size) <= 1 and growing.level == 0.0
    with pytest.raises(InputError, match="give another level"):
        pulse_times(channel(square, 1e5), level=9.0)


def test_blocks_of_a_long_channel_join_without_a_seam(monkeypatch):
    _, _, theta = motion(1e5, 1.0, (1000, 1100), {})
    whole = pulse_times(channel(sine_signal(theta, 60), 1e5)).times
    monkeypatch.setattr("cranktrain_lab.measured.channels.BLOCK", 997)
    pieces = channel(sine_signal(theta, 60), 1e5)
    monkeypatch.setattr(type(pieces), "blocks", lambda self, size=997: (
        (first, self.read(first, min(first + 997, self.size))) for first in range(0, self.size, 997)))  # fmt: skip
    np.testing.assert_allclose(pulse_times(pieces).times, whole, atol=2e-8)


def test_the_command_writes_orders_that_the_run_up_reads(tmp_path, capsys):
    t, _, theta = motion(5e4, 8.0, (1000, 1500), {3.0: (0.5, 0.0), 1.5: (0.2, 0.4)})
    scipy.io.savemat(tmp_path / "run.mat", {"time": t, "pulley": sine_signal(theta, 60, 2)})
    out = tmp_path / "orders.csv"
    asked = ["--rotation", "pulley", "--orders", "1.5,3", "--output", str(out), "--json"]
    assert main(["measured", str(tmp_path / "run.mat"), *asked]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["rotation"][0]["teeth"] == 60 and told["rotation"][0]["missing"] == 2
    assert np.array(told["orders"][0]["amplitudes"])[:, 1] == pytest.approx(0.5, rel=0.01)
    measured = read_measured_orders(out)
    assert measured.wheels == {TORSION: "60-2"}
    speeds, sizes = measured[TORSION][3.0]
    assert np.degrees(sizes) == pytest.approx(0.5, rel=0.01) and speeds[0] / RPM == pytest.approx(1012, abs=15)
    assert phases_of(measured, TORSION, 3.0).size == band_of(measured, TORSION, 3.0).size == sizes.size


def test_the_filter_and_the_fits_give_the_same_orders():
    _, _, theta = motion(5e4, 12.0, (1000, 1600), {1.5: (0.2, 0.4), 3.0: (0.5, -1.0)})
    turning = rotation(channel(sine_signal(theta, 120), 5e4), Wheel(120))
    orders = np.array([1.5, 3.0, 4.5])
    filtered = filtered_orders(turning, turning, orders, 1.0, step_rpm=50.0)
    fitted = track(torsion_points(turning), turning, orders, step_rpm=50.0)
    sizes = np.degrees(np.abs(filtered.amplitudes))
    np.testing.assert_allclose(sizes, np.tile([0.2, 0.5, 0.0], (len(sizes), 1)), atol=2e-3)
    same = [int(np.argmin(np.abs(fitted.speeds - speed))) for speed in filtered.speeds]
    np.testing.assert_allclose(filtered.amplitudes, fitted.amplitudes[same], atol=math.radians(5e-3))


def test_equal_firing_pressures_do_not_say_which_revolution_it_is():
    _, phi, theta = motion(2e4, 4.0, (1000, 1200), {})
    turning = rotation(channel(sine_signal(theta, 60), 2e4), Wheel(60))
    zero = phi - np.interp(0.0, turning.angle, np.interp(turning.times, np.arange(phi.size) / 2e4, phi))
    both = channel(1.0 + 60.0 * np.cos(0.5 * zero) ** 40, 2e4, "p1", "bar")
    with pytest.raises(InputError, match="does not say which one fires"):
        turning.with_firing(both)
