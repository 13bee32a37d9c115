"""Twist of the crank (pulley relative to flywheel) in a run-up, and maps of orders and frequencies over speed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cranktrain.core.types import Array
from cranktrain.results.orders.harmonics import ComplexArray
from cranktrain.results.run_up.run_up import FLYWHEEL, TORSION, RunUp

TWIST = "twist"
"""Name of the twist among the outputs of a run-up, rad."""
SAMPLES = 2880
"""Number of samples of a cycle, with which the range of order 24 is accurate to 0.2 %."""


def with_twist(run_up: RunUp) -> RunUp:
    """Run-up with added output ``TWIST``, pulley's minus flywheel's torsion; unchanged without flywheel's torsion."""
    if FLYWHEEL not in run_up.amplitudes:
        return run_up
    twist = run_up.amplitudes[TORSION] - run_up.amplitudes[FLYWHEEL]
    return replace(run_up, amplitudes={**run_up.amplitudes, TWIST: twist})


def half_range(run_up: RunUp, amplitudes: ComplexArray) -> Array:
    """Half of the peak-to-peak value over a cycle at each speed (s,), from complex orders (s, o)."""
    angle = np.linspace(0.0, 4.0 * math.pi, SAMPLES, endpoint=False)
    motion = (amplitudes @ np.exp(1j * np.outer(run_up.orders, angle))).real
    return np.asarray(0.5 * np.ptp(motion, axis=1))


def order_map(run_up: RunUp, output: str, speeds: Array) -> Array:
    """Amplitudes (o, n) of all orders at speeds (n,) rad/s, interpolated between the speeds of the run-up."""
    sizes = np.abs(run_up.amplitudes[output]).T
    return np.array([np.interp(speeds, run_up.speeds, one) for one in sizes])


def frequency_map(run_up: RunUp, output: str, speeds: Array, hz: Array) -> Array:
    """Amplitudes (f, n) of the order nearest to each frequency (f,), Hz, at speeds (n,) rad/s.

    They are NaN above the highest order of the run-up.
    """
    of_orders = order_map(run_up, output, speeds)
    wanted = 2.0 * math.pi * hz[:, None] / speeds
    nearest = np.abs(wanted[:, :, None] - run_up.orders).argmin(axis=2)
    found = np.take_along_axis(of_orders, nearest, axis=0)
    return np.where(wanted <= run_up.orders[-1] + 0.25, found, math.nan)
