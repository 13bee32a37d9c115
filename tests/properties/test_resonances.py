"""Peaks of orders over speed: found where a closed form has them."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from cranktrain.results.orders.resonances import labelled, peaks
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.studies.run_up.report import report

MODE_HZ, DAMPING = 238.0, 0.015


def run_up(rpm, forces):
    """One mode under forces of constant amplitude, one by order; static twist of 1e-4 rad each."""
    speeds = np.asarray(rpm) * math.pi / 30.0
    orders = 0.5 * np.arange(1, 49)
    share = orders * speeds[:, None] / (2.0 * math.pi * MODE_HZ)
    torsion = 1e-4 * np.array([forces.get(order, 0.0) for order in orders]) / (1.0 - share**2 + 2j * DAMPING * share)
    s = speeds.size
    ones = np.ones(s, dtype=int)
    return RunUp(speeds, orders, {"pulley.torsion": torsion}, {}, ones, ones, np.zeros(s))


def test_peaks_of_one_mode_lie_at_its_critical_speeds():
    found = peaks(run_up(np.arange(1000.0, 2601.0, 20.0), {6.0: 1.0, 9.0: 0.5, 12.0: 0.3}))
    assert [peak.order for peak in found] == [6.0, 9.0, 12.0]
    for peak, force in zip(found, (1.0, 0.5, 0.3), strict=True):
        assert peak.speed * 30.0 / math.pi == pytest.approx(60.0 * MODE_HZ / peak.order, rel=5e-4)
        assert peak.amplitude == pytest.approx(force * 1e-4 / (2.0 * DAMPING), rel=0.01)
        assert peak.damping == pytest.approx(DAMPING, rel=0.05)
        assert peak.periodic


def test_the_error_of_a_peak_falls_with_the_square_of_the_step():
    errors = []
    for step in (32.0, 16.0, 8.0):
        (found,) = peaks(run_up(np.arange(2203.0, 2551.0, step), {6.0: 1.0}))
        errors.append(abs(found.amplitude / (1e-4 / (2.0 * DAMPING)) - 1.0))
    assert errors[2] < errors[0] / 8.0


def test_labels_are_those_of_the_nearest_modes():
    found = labelled(
        peaks(run_up(np.arange(1000.0, 2601.0, 20.0), {6.0: 1.0})),
        np.array([206.0, 236.0, 267.0]), ("bending", "torsional", "bending"),
    )  # fmt: skip
    assert found[0].kind == "torsional" and found[0].mode_hz == 236.0
    assert found[0].critical_speed == pytest.approx(2360.0 * math.pi / 30.0)


def test_slopes_ends_and_ripples_are_no_peaks():
    assert peaks(run_up(np.arange(1000.0, 2001.0, 20.0), {6.0: 1.0})) == []  # rising to its end
    made = run_up(np.arange(1000.0, 2601.0, 20.0), {6.0: 1.0})
    ripple = 1.0 + 0.04 * np.cos(np.arange(made.speeds.size))[:, None]
    rippled = RunUp(**{**vars(made), "amplitudes": {"pulley.torsion": made.torsion * ripple}})
    assert len(peaks(rippled)) == 1


def test_a_measured_critical_speed_stands_beside_the_nearest_peak_of_its_order():
    made = run_up(np.arange(1000.0, 2601.0, 20.0), {6.0: 1.0, 9.0: 0.5})
    rpm = np.array([2370.0, 0.0]) * math.pi / 30.0
    published = SimpleNamespace(critical_orders=(6.0, 9.0), measured_critical_speeds=tuple(rpm.tolist()))
    found = peaks(made)
    far = replace(found[0], speed=0.6 * found[0].speed)
    six, other, nine = report(made, [found[0], far, found[1]], published)["peaks"]
    assert six["measured_rpm"] == pytest.approx(2370.0)
    assert six["off_measured_percent"] == pytest.approx(100.0 * (six["rpm"] / 2370.0 - 1.0))
    assert other["measured_rpm"] is None and nine["off_measured_percent"] is None


def test_speeds_without_a_period_are_counted():
    made = run_up(np.arange(1000.0, 2601.0, 200.0), {6.0: 1.0})
    made = RunUp(**{**vars(made), "repeats": np.array([1, 0, 1, 1, 0, 2, 1, 1, 1])})
    assert report(made, [])["speeds_without_period"] == 2
    not_run = RunUp(**{**vars(made), "cycles": np.zeros(made.speeds.size, dtype=int)})
    assert report(not_run, [])["speeds_without_period"] == 0
