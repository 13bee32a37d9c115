"""Pulses that are sampled too slowly: refused, or told with the speeds that look alike; timing of crossings.

A wheel of N teeth at f revolutions a second, sampled at R, looks exactly like one with |N f - k R| pulses a second. The
engines' torsion, a stated speed, an index pulse or a second wheel tell them apart.
"""

import math

import numpy as np
import pytest
from pulse_signals import RPM, channel, motion, pitch_errors, sine_signal

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain_lab.measured.aliasing import check_aliasing, held, likely_alias
from cranktrain_lab.measured.analysis import rotations_of
from cranktrain_lab.measured.channels import Measurement
from cranktrain_lab.measured.pulses import pulse_times, timing_error
from cranktrain_lab.measured.rotation import rotation
from cranktrain_lab.measured.wheel import Wheel

# Torsion, deg at orders, of engines with 1, 3, 4, 6, 8 and 12 cylinders.
TORSION = {
    "single": {0.5: (0.8, 0.0), 1.0: (0.5, 1.0), 1.5: (0.3, 2.0), 2.0: (0.2, 1.0)},
    "three": {1.5: (0.3, 0.0), 3.0: (0.1, 1.0), 4.5: (0.03, 1.0)},
    "four": {2.0: (0.5, 0.3), 4.0: (0.1, 1.0), 6.0: (0.03, 2.0)},
    "six": {3.0: (0.2, 0.3), 6.0: (0.05, 1.0), 4.5: (0.02, 1.0)},
    "eight": {4.0: (0.1, 1.0), 1.5: (0.03, 1.0), 2.5: (0.03, 1.0)},
    "twelve": {6.0: (0.03, 0.3), 3.0: (0.01, 1.0)},
}
# Teeth, rev/min at begin and end, sampling rate.
TOO_SLOW = {
    "above the rate": (360, (2000.0, 2030.0), 10e3),
    "below the rate": (180, (2900.0, 2930.0), 10.24e3),
    "above twice the rate": (240, (3000.0, 3020.0), 5.4e3),
}


@pytest.mark.parametrize("case", TOO_SLOW)
@pytest.mark.parametrize("engine", TORSION)
def test_an_engine_s_torsion_tells_pulses_of_another_speed(engine, case):
    """The speed named is the true one, unless another fits as well; at four times the rate the same shaft passes."""
    teeth, rpm, rate = TOO_SLOW[case]
    _, _, theta = motion(rate, 12.0, rpm, TORSION[engine])
    slow = channel(sine_signal(theta, teeth, noise=2e-3), rate)
    turning = rotation(slow, Wheel(teeth))
    assert turning.speed_range[1] < 0.5 * rpm[0] * RPM  # it looks like pulses all the same
    alias = likely_alias(turning, rate)
    assert alias is not None and alias.share > 0.9 > 0.5 > alias.share_as_read
    times = turning.times - turning.times[0]
    number = turning.numbered.teeth - turning.numbered.teeth[0]
    fraction = (theta[-1] - theta[0]) * teeth / math.tau / (12.0 * rate)
    k = round(fraction)
    angle = (k * rate * times + math.copysign(1.0, fraction - k) * number) * math.tau / teeth
    assert angle[-1] / times[-1] == pytest.approx(np.mean(rpm) * RPM, rel=2e-3)
    assert held(times, angle)[0] > 0.85
    with pytest.raises(InputError, match=r"orders up to 6 hold .* \(aliasing\); sample at .* state it: --speed"):
        check_aliasing(turning, slow)
    assert check_aliasing(turning, slow, np.mean(turning.speed_range)) is turning  # as a stated speed confirms
    fast = 4.5 * teeth * rpm[1] / 60.0
    _, _, theta = motion(fast, 3.0, rpm, TORSION[engine])
    good = channel(sine_signal(theta, teeth, noise=2e-3), fast)
    assert likely_alias(rotation(good, Wheel(teeth)), fast) is None


@pytest.mark.parametrize("kind", ["even", "uneven", "square", "hum"])
@pytest.mark.parametrize(
    ("teeth", "rpm", "samples"), [(24, (900, 1400), 30), (60, (3000, 3000), 9), (135, (6000, 5500), 14)]
)
@pytest.mark.parametrize("torsion", [{}, TORSION["twelve"], TORSION["four"]], ids=["none", "twelve", "four"])
def test_pulses_that_are_sampled_well_are_not_refused(kind, teeth, rpm, samples, torsion):
    """Nor where teeth are wrong, pulses are square, 50 Hz hum shakes the sensor, or there is no torsion at all."""
    rate = samples * teeth * max(rpm) / 60.0
    t, _, theta = motion(rate, min(6.0, 1e6 / rate), rpm, torsion)
    theta = theta + (kind == "hum") * math.radians(0.05) * np.cos(math.tau * 50.0 * t)
    wave = sine_signal(theta, teeth, errors=pitch_errors(teeth, 3.0) if kind == "uneven" else None, noise=5e-3)
    wave = np.where(wave > 0.0, 4.8, 0.2) if kind == "square" else wave
    turning = rotation(channel(wave, rate), Wheel(teeth))
    told = check_aliasing(turning, channel(wave, rate)).remarks[len(turning.remarks) :]
    assert not told or kind == "hum"


def test_torsion_that_does_not_recur_is_told_with_the_speeds_that_look_the_same():
    """Aliased pulses of so few a cycle that orders cannot be told: 60 teeth at 9900 rev/min, sampled at 10 kHz."""
    _, _, theta = motion(1e4, 30.0, (9900, 9890), TORSION["single"])
    slow = channel(sine_signal(theta, 60, noise=2e-3), 1e4)
    turning = rotation(slow, Wheel(60))
    assert turning.speed_range[1] < 250.0 * RPM
    (told,) = check_aliasing(turning, slow).remarks[len(turning.remarks) :]
    assert "do not recur from cycle to cycle" in told and "rev/min, which look the same at 10000 Hz (aliasing)" in told


def test_a_stated_speed_an_index_and_a_second_wheel_tell_aliasing():
    """90 teeth at 6000 rev/min are 9 kHz; at 10 kHz they look like 1 kHz, 667 rev/min."""
    rate = 1e4
    _, _, theta = motion(rate, 5.0, (6000, 6000), {})
    slow = channel(sine_signal(theta, 90), rate)
    run = Measurement(
        (slow, channel(sine_signal(theta, 1), rate, "index"), channel(sine_signal(theta, 8), rate, "rear"))
    )
    (turning,) = rotations_of(run, ct.AnalyseMeasured((), rotation="tacho", teeth=90))
    assert turning.speed_range[1] / RPM == pytest.approx(666.7, abs=0.1)  # a shaft without torsion cannot tell
    (right,) = rotations_of(run, ct.AnalyseMeasured((), rotation="rear", teeth=8, speed=6000.0))
    assert right.speed_range[0] / RPM == pytest.approx(6000.0, abs=0.1)
    alike = "9000 pulses a second sampled at 10000 Hz look like 1000"
    for asked, said in (
        (
            ct.AnalyseMeasured((), rotation="tacho", teeth=90, speed=6000.0),
            rf"not at the stated 6000; {alike} \(aliasing\); sample at",
        ),
        (
            ct.AnalyseMeasured((), rotation="tacho", teeth=90, index="index"),
            r"counts 10\.0 teeth from index to index of index, not 90; .*\(alia",
        ),
        (ct.AnalyseMeasured((), rotation="rear", teeth=8, second="tacho", second_teeth=90), rf"a ratio of .*; {alike}"),
        (
            ct.AnalyseMeasured((), rotation="rear", teeth=8, speed=3000.0),
            r"not at the stated 3000; check the pulses a revolution",
        ),
    ):
        with pytest.raises(InputError, match=said):
            rotations_of(run, asked)


def test_a_run_up_that_ends_too_fast_for_the_rate_is_refused_with_the_time():
    """60 teeth at 20 kHz have four samples a pulse at 5000 rev/min, which 1000 to 6000 in 5 s pass after 4 s."""
    _, _, theta = motion(2e4, 5.0, (1000, 6000), TORSION["four"])
    with pytest.raises(InputError, match=r"3\.[34] samples a pulse from 4\.9\d* to .* s, below the 4 .*aliasing"):
        pulse_times(channel(sine_signal(theta, 60), 2e4))
    assert pulse_times(channel(sine_signal(theta[: round(3.9 * 2e4)], 60), 2e4)).spacing[1] > 4.0


@pytest.mark.parametrize("samples", [4.1, 4.6, 5.3, 6.3, 8.3, 10.3, 15.7])
@pytest.mark.parametrize("square", [False, True])
def test_the_stated_error_of_crossings_is_that_of_the_sampling(samples, square):
    """A sine by the cubic through four samples, and steps between two levels, at all phases of the samples."""
    rate = 1e4
    t = np.arange(40_000) / rate
    turned = rate / samples * t * (1.0 + 1e-3 * t)
    wave = np.sin(math.tau * turned)
    found = pulse_times(channel(np.where(wave > 0.0, 4.8, 0.2) if square else wave, rate))
    places = np.interp(found.times, t, turned)
    off = places - np.rint(places)
    made, stated = float(np.std(off)), timing_error(samples, square)
    assert found.two_levels is square and 0.4 * stated < made < 1.6 * stated
    assert any("a crossing is off by" in text for text in found.remarks) == (square or samples < 8.0)
