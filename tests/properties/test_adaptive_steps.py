"""Adaptive steps: the error follows the tolerance, events are met, a missed tolerance is told, runs go on from a state.

The elastic six of the coarse mesh on linear bearings at 2000 rev/min, whose exact motion is cheap to come by.
"""

import math
from functools import cache

import numpy as np
import pytest
from bodies import six

from cranktrain.dynamics.simulation import Settings, simulate
from cranktrain.loads.built_in_trace import KINKS, NO_KINK, fill_kinks
from cranktrain.loads.gas_pressure import spline_coefficients

SPEED = 2000 * math.pi / 30
STEP = math.radians(6.0)


def kinks(samples):
    """Crank angles, rad, at which a trace is least smooth."""
    table, found = spline_coefficients(samples), np.zeros(KINKS)
    fill_kinks(np.array([table, np.zeros_like(table)]), found)
    return found[found != NO_KINK]


@cache
def run(tolerance, integrator="esdirk4", bearings="linear"):
    control = "fixed" if tolerance is None else "adaptive"
    step = math.radians(0.25) if tolerance is None else STEP
    chosen = {"step": step, "control": control, "tolerance": tolerance or 1e-3, "newton_tolerance": 3e-5}
    settings = Settings(bearings=bearings, integrator=integrator, dense_output="off", **chosen)
    return simulate(*six(), settings, SPEED, 3)


def error(tolerance, integrator="esdirk4", name="pulley.torsion"):
    """RMS of the difference from fixed steps of 0.25 degrees over the alternating part, as in docs/tradeoff.md."""
    found, exact = run(tolerance, integrator).last_cycle(name)[1], run(None).last_cycle(name)[1]
    return np.sqrt(np.mean((found - exact[::24]) ** 2)) / np.std(exact)


@pytest.mark.parametrize(("integrator", "tolerances"), [
    ("esdirk4", (1e-4, 1e-6)), ("sdirk4", (1e-2, 1e-4)), ("generalised-alpha", (1e-2, 1e-4)),
])  # fmt: skip
def test_error_follows_the_tolerance(integrator, tolerances):
    """A hundredth of the tolerance: the local error of a method of order p (embedded p − 1) falls by it."""
    errors = [error(tolerance, integrator) for tolerance in tolerances]
    assert errors[1] < 0.1 * errors[0]
    # The error of a run stays near that of a step: what damps the crank forgets the rest.
    assert errors[1] < 10 * tolerances[1] * (30 if integrator == "generalised-alpha" else 1)
    coarse, fine = (run(tolerance, integrator).counters for tolerance in tolerances)
    assert coarse["steps"] < fine["steps"] and fine["missed_steps"] == 0


def test_a_tolerance_that_no_step_meets_is_told():
    settings = Settings(bearings="linear", step=STEP, control="adaptive", tolerance=1e-10)
    with pytest.warns(UserWarning, match=r"steps missed the tolerance of 1e-10 at the shortest step; use a shorter"):
        result = simulate(*six(), settings, SPEED, 1)
    assert result.counters["missed_steps"] > 0


def test_kinks_are_where_a_trace_breaks():
    """A triangle breaks at its foot and its tip."""
    angle = np.arange(720) * (4 * math.pi / 720)
    triangle = np.interp(angle, np.radians([0.0, 200.0, 240.0, 280.0, 720.0]), [0.0, 0.0, 1e6, 0.0, 0.0])
    assert np.degrees(kinks(triangle)) == pytest.approx([200.0, 240.0, 280.0], abs=1.5)


def test_steps_are_shorter_where_the_trace_breaks():
    """Errors aside (tolerance 1), only events halve steps: twelve or more in two turns of six cylinders."""
    settings = Settings(bearings="linear", step=STEP, control="adaptive", tolerance=1.0)
    result = simulate(*six(), settings, SPEED, 3)
    fixed = simulate(*six(), Settings(bearings="linear", step=STEP), SPEED, 3)
    more = result.counters["steps"] - fixed.counters["steps"]
    assert 3 * 6 <= more < fixed.counters["steps"]
