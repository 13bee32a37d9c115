"""Order spectra: pure tones, Parseval's identity, and resampling where the speed varies."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cranktrain.core.errors import InputError
from cranktrain.results.orders.harmonics import CYCLE, last_cycle, order_amplitudes, order_spectrum
from cranktrain.results.orders.tracking import tracked_orders
from cranktrain.results.summary import bearing_rows, big_end_rows, closing_edges, online_films, vibration
from cranktrain.results.tables import closing_text, online_text


@given(
    order=st.integers(1, 40).map(lambda k: 0.5 * k),
    amplitude=st.floats(1e-6, 1e6),
    phase=st.floats(0.0, 6.3),
    mean=st.floats(-1e3, 1e3),
)
def test_a_pure_tone_has_one_line_of_its_zero_to_peak_amplitude(order, amplitude, phase, mean):
    angle = np.arange(360) * CYCLE / 360
    orders, amplitudes = order_spectrum(mean + amplitude * np.cos(order * angle + phase))
    at = int(np.argmin(np.abs(orders - order)))
    rounding = 1e-12 * (amplitude + abs(mean))
    assert orders[at] == order
    assert amplitudes[at] == pytest.approx(amplitude, rel=1e-12, abs=rounding)
    assert np.all(np.delete(amplitudes, at) < 10.0 * rounding)


@given(st.lists(st.floats(-100.0, 100.0), min_size=2, max_size=99))
def test_parseval_the_lines_hold_the_signals_whole_power(values):
    signal = np.array(values)
    _, amplitudes = order_spectrum(signal)
    power = 0.5 * np.sum(amplitudes**2)
    if signal.size % 2 == 0:
        power += 0.5 * amplitudes[-1] ** 2  # the alternating line's mean square is its amplitude squared
    assert power == pytest.approx(float(np.var(signal)), rel=1e-9, abs=1e-9)


@given(st.lists(st.complex_numbers(max_magnitude=10.0), min_size=48, max_size=48), st.sampled_from([1, 2, 5]))
def test_complex_amplitudes_are_those_of_the_stated_convention(given_amplitudes, cycles):
    """x = Re Σ a exp(i n θ): over one cycle, over several, and for several signals at once."""
    angle = np.arange(288 * cycles) * CYCLE / 288
    orders = 0.5 * np.arange(1, 49)
    wanted = np.array(given_amplitudes)
    signal = 3.0 + np.real(np.exp(1j * np.outer(angle, orders)) @ wanted)
    found_orders, found = order_amplitudes(np.stack((signal, -signal), axis=1), 24.0, cycles)
    assert np.array_equal(found_orders, orders) and np.abs(found[:, 0] - wanted).max() < 1e-10
    assert np.abs(found[:, 1] + wanted).max() < 1e-10


def test_of_several_cycles_only_what_repeats_every_cycle_counts():
    angle = np.arange(2 * 288) * CYCLE / 288
    signal = np.cos(6.0 * angle) + 0.3 * np.cos(0.25 * angle)  # every second cycle is alike
    orders, found = order_amplitudes(signal, 12.0, cycles=2)
    assert np.abs(found - (orders == 6.0)).max() < 1e-12


def test_highest_order_cuts_the_list():
    orders, amplitudes = order_spectrum(np.arange(720.0), highest=12.0)
    assert orders[-1] == 12.0 and amplitudes.size == 24


def test_resampling_recovers_orders_when_the_speed_varies():
    errors = []
    for steps in (1500, 3000):
        time = np.linspace(0.0, 1.0, steps)
        angle = 60.0 * math.pi * (time + 0.02 * np.sin(9.0 * time))
        signal = 3.0 + 0.7 * np.cos(6.0 * angle) + 0.2 * np.sin(1.5 * angle)
        orders, amplitudes = order_spectrum(last_cycle(angle, signal))
        errors.append(abs(amplitudes[orders == 6.0][0] - 0.7) + abs(amplitudes[orders == 1.5][0] - 0.2))
        # interpolating cubic splines miss a wave of phase step x by x⁴/720 at its nodes' mean
        assert errors[-1] < 0.7 * (6.0 * np.diff(angle).max()) ** 4 / 720.0
    assert errors[0] / errors[1] > 12.0


def test_last_cycle_takes_uniform_samples_as_they_are():
    angle = np.arange(3 * 360 + 1) * CYCLE / 360
    signal = np.random.default_rng(2).standard_normal(angle.size)
    assert last_cycle(angle, signal, 360) == pytest.approx(signal[-361:-1], abs=1e-9)


def test_a_crank_that_swings_may_lack_a_quarter_of_a_sample_of_the_last_cycle():
    """The spline goes on into what is lacking; a run that lacks more is no cycle."""
    angle, beyond = (CYCLE / (720.0 + lacking) * (lacking + np.arange(721)) for lacking in (0.2, 0.3))
    assert last_cycle(angle, np.cos(angle), 720) == pytest.approx(np.cos(np.arange(720) * CYCLE / 720), abs=1e-6)
    with pytest.raises(InputError, match="simulate longer"):
        last_cycle(beyond, np.cos(beyond))


def test_summary_takes_extremes_of_the_last_cycle_only():
    angle = np.arange(2 * 720 + 1) * CYCLE / 720
    late = angle >= CYCLE

    def film(name):
        return {
            f"{name}.force.x": np.where(late, 300.0, 9e9),
            f"{name}.force.y": np.full(angle.size, 400.0),
            f"{name}.film_thickness_min": np.where(late, 2e-6, 0.0),
            f"{name}.eccentricity": np.where(late, 0.9, 1.0),
            f"{name}.pressure_max": np.where(late, 5e7, 1e9),
        }

    moments = {"bearing[1].moment.x": np.full(angle.size, -3.0), "bearing[1].moment.y": np.where(late, 4.0, 50.0)}
    outputs = {**film("bearing[1]"), **moments, **film("big_end[1]"), **film("big_end[2]")}
    outputs["big_end[2].eccentricity"] = np.zeros(angle.size)
    extremes = {"min_film_um": pytest.approx(2.0), "max_eccentricity": 0.9, "max_pressure_pa": 5e7}
    assert bearing_rows(angle, outputs) == [{"name": "main[1]", "peak_load_n": 500.0, **extremes, "max_moment_nm": 5.0}]
    # a rigid big end has a load and no film
    assert big_end_rows(angle, outputs) == [
        {"name": "big_end[1]", "peak_load_n": 500.0, **extremes},
        {"name": "big_end[2]", "peak_load_n": 500.0},
    ]
    # Below a micrometre an edge closes, and a run says so.
    assert closing_edges(bearing_rows(angle, outputs)) == []
    outputs["bearing[1].film_thickness_min"] = np.where(late, 0.9e-6, 2e-6)
    assert closing_edges(bearing_rows(angle, outputs)) == ["main[1]"]
    assert "less than 1 um open in main[1]" in closing_text(["main[1]"])
    shape = vibration(angle, 0.01 + 0.002 * np.sin(3.0 * angle), 180.0 / math.pi)
    assert shape["peak_to_peak"] == pytest.approx(math.degrees(0.004), rel=1e-4)
    assert shape["mean"] == pytest.approx(math.degrees(0.01))
    assert dict(shape["orders"])[3.0] == pytest.approx(math.degrees(0.002), rel=1e-6)


def test_films_outside_the_table_are_told_by_crank_angle():
    """Two mains, three iterations a step of 2.5°: six films. In the second cycle some are solved within one bin."""
    angle = np.arange(2 * 288 + 1) * CYCLE / 288 - math.radians(3.0)
    solved = np.zeros(angle.size)
    solved[5] = 6.0  # in the first cycle, which is not told of
    solved[288 + 42 : 288 + 45] = 1.0, 2.0, 3.0
    outputs = {f"{name}.eccentricity": angle for name in ("bearing[1]", "bearing[2]", "big_end[1]")}
    outputs |= {"solver.online_films": solved, "solver.iterations": np.full(angle.size, 3.0)}
    told = online_films(angle, outputs)
    assert (told["solved"], told["films"]) == (6, 6 * 288)
    assert told["share"] == pytest.approx(1.0 / 288)
    # the frame stands 3° behind: steps end at 102, 104.5 and 107 deg, four steps to a bin of 10°
    assert told["by_crank_angle"] == [[100.0, pytest.approx(6.0 / 24.0)]]
    text = online_text(told)
    assert "6 of 1728" in text and "100-110 deg (25 %)" in text and "\n" not in text
    outputs["solver.online_films"] = np.zeros(angle.size)
    none = online_films(angle, outputs)
    assert none["by_crank_angle"] == [] and "most at" not in online_text(none)


def resonance_ramp(rate_rpm_per_s, sampled_hz=12000.0):
    """Some orders through a resonance of 2 % damping, 1400 to 2600 rev/min: angle, signal, places, amplitudes there."""
    rpm = math.pi / 30.0
    rate, first = rate_rpm_per_s * rpm, 1400.0 * rpm
    time = np.arange(0.0, 1200.0 / rate_rpm_per_s, 1.0 / sampled_hz)
    angle, speed = first * time + 0.5 * rate * time**2, first + rate * time

    def amplitude(order, speed):
        share = order * speed / (2.0 * math.pi * 240.0)
        return {6.0: 1.0, 6.5: 0.2, 7.5: 0.3, 9.0: 0.5, 0.5: 3.0}[order] / (1.0 - share**2 + 0.04j * share)

    orders = (6.0, 6.5, 7.5, 9.0, 0.5)
    signal = sum(np.real(amplitude(order, speed) * np.exp(1j * order * angle)) for order in orders)
    wanted = np.arange(1460.0, 2541.0, 20.0) * rpm
    at = (wanted**2 - first**2) / (2.0 * rate)
    return angle, signal, at, {order: amplitude(order, wanted) for order in orders}


@pytest.mark.parametrize(("rate", "within"), [(50.0, 1e-3), (100.0, 1e-3), (200.0, 1e-2)])
def test_orders_are_tracked_through_a_ramp(rate, within):
    angle, signal, at, wanted = resonance_ramp(rate)
    orders, both = tracked_orders(angle, np.stack((signal, 2.0 * signal), axis=1), at, 24.0)
    found = both[:, :, 0]
    assert orders[-1] == 24.0 and np.allclose(both[:, :, 1], 2.0 * found)
    for order, amplitude in wanted.items():
        own = found[:, orders == order][:, 0]
        assert np.abs(own - amplitude).max() < within * np.abs(amplitude).max()
    others = ~np.isin(orders, list(wanted))
    assert np.abs(found[:, others]).max() < within * max(np.abs(amplitude).max() for amplitude in wanted.values())


SHORT, LONG = np.linspace(0.0, 10.0, 50), np.arange(2000) * 0.05
REFUSED = [
    (lambda: order_amplitudes(np.zeros(88), 24.0), "order 24 needs more samples; those of this cycle resolve 22"),
    (lambda: last_cycle(SHORT, SHORT), "covers 573.0 of 720 deg"),
    (lambda: last_cycle(SHORT[::-1], SHORT), "increase"),
    (lambda: order_spectrum(np.array([1.0, np.nan])), "finite"),
    (lambda: tracked_orders(LONG, LONG, [5.0], 12.0), "leave 2 cycles at either end"),
    (lambda: tracked_orders(LONG, LONG, [50.0], 40.0), r"2\.9 deg apart resolve orders to 31\.4, not to 40"),
    (lambda: tracked_orders(LONG[::-1], LONG, [50.0], 12.0), "increase"),
]


@pytest.mark.parametrize(("call", "says"), REFUSED)
def test_what_samples_cannot_tell_is_refused(call, says):
    with pytest.raises(InputError, match=says):
        call()
