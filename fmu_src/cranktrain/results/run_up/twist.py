"""Twist of the crank over a run-up, pulley against flywheel, and maps of its orders and frequencies over the speed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cranktrain.core.types import Array
from cranktrain.results.orders.harmonics import ComplexArray
from cranktrain.results.run_up.run_up import FLYWHEEL, TORSION, RunUp

TWIST = "twist"
"""Name of the twist beside the outputs of a run-up, rad."""
SAMPLES = 2880
"""Samples of a cycle: the range of order 24 is found to 0.2 %."""


def with_twist(run_up: RunUp) -> RunUp:
    """The run-up with ``TWIST``, the pulley's torsion less that of the flywheel; as it is where it lacks the latter."""
    if FLYWHEEL not in run_up.amplitudes:
        return run_up
    twist = run_up.amplitudes[TORSION] - run_up.amplitudes[FLYWHEEL]
    return replace(run_up, amplitudes={**run_up.amplitudes, TWIST: twist})


def half_range(run_up: RunUp, amplitudes: ComplexArray) -> Array:
    """Half of the peak-to-peak value over a cycle at each speed (s,), of complex orders (s, o)."""
    angle = np.linspace(0.0, 4.0 * math.pi, SAMPLES, endpoint=False)
    motion = (amplitudes @ np.exp(1j * np.outer(run_up.orders, angle))).real
    return np.asarray(0.5 * np.ptp(motion, axis=1))


def order_map(run_up: RunUp, output: str, speeds: Array) -> Array:
    """Amplitudes (o, n) of all orders at speeds (n,) rad/s, interpolated between those of the run-up."""
    sizes = np.abs(run_up.amplitudes[output]).T
    return np.array([np.interp(speeds, run_up.speeds, one) for one in sizes])


def frequency_map(run_up: RunUp, output: str, speeds: Array, hz: Array) -> Array:
    """Amplitudes (f, n) at frequencies (f,) Hz and speeds (n,) rad/s: those of the order nearest to each frequency.

    Not a number above the highest order of the run-up.
    """
    of_orders = order_map(run_up, output, speeds)
    wanted = 2.0 * math.pi * hz[:, None] / speeds
    nearest = np.abs(wanted[:, :, None] - run_up.orders).argmin(axis=2)
    found = np.take_along_axis(of_orders, nearest, axis=0)
    return np.where(wanted <= run_up.orders[-1] + 0.25, found, math.nan)
