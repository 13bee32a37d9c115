"""Two run-ups at the same speeds."""

from dataclasses import replace
from typing import Any

import numpy as np

from cranktrain.core.types import Array
from cranktrain.results.run_up.run_up import RunUp

SAME = 1.0e-9
"""Largest relative difference of equal speeds."""


def on_common_speeds(a: RunUp, b: RunUp) -> tuple[RunUp, RunUp]:
    """Both run-ups at the speeds, in the range of both, of the one with fewer; the other one is interpolated.

    Both are without speeds if the ranges do not overlap.
    """
    low, high = max(a.speeds[0], b.speeds[0]) * (1.0 - SAME), min(a.speeds[-1], b.speeds[-1]) * (1.0 + SAME)
    inside = [one.speeds[(one.speeds >= low) & (one.speeds <= high)] for one in (a, b)]
    speeds = min(filter(len, inside), key=len, default=np.zeros(0))
    return at_speeds(a, speeds), at_speeds(b, speeds)


def at_speeds(run_up: RunUp, speeds: Array) -> RunUp:
    """Amplitudes and extremes of a run-up at speeds (n,), rad/s, in its range; its own ones are taken as they are.

    Between its speeds they are those of a cubic spline, and NaN beside a speed without result.
    """
    at = np.clip(np.searchsorted(run_up.speeds, speeds * (1.0 - SAME)), 0, run_up.speeds.size - 1)
    if np.all(np.abs(run_up.speeds[at] - speeds) <= SAME * speeds):
        return _with(run_up, speeds, lambda values: values[at])
    from scipy.interpolate import CubicSpline  # imported here because the import is slow

    def between(values: Any) -> Any:
        good = np.isfinite(values).all(axis=1)
        beside = np.interp(speeds, run_up.speeds, np.where(good, 0.0, np.nan))
        if good.sum() < 2:
            return np.full((speeds.size, *values.shape[1:]), np.nan, values.dtype)
        return CubicSpline(run_up.speeds[good], values[good])(speeds) + beside[:, None]

    return _with(run_up, speeds, between)


def _with(run_up: RunUp, speeds: Array, taken: Any) -> RunUp:
    """Run-up whose amplitudes and extremes are ``taken``, without settling."""
    none = np.zeros(speeds.size, dtype=int)
    return replace(
        run_up, speeds=speeds, cycles=none, repeats=none, left=np.zeros(speeds.size), parting=np.zeros(0),
        amplitudes={name: taken(values) for name, values in run_up.amplitudes.items()},
        extremes={name: taken(values) for name, values in run_up.extremes.items()},
    )  # fmt: skip
