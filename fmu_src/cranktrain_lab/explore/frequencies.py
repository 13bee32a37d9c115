"""Torsional frequencies of the crank with damper ring over the speed, for the page's Campbell diagram."""

from __future__ import annotations

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.loads.damper import STIFFNESS, damper_parameters, damper_temperature, damping_coefficient
from cranktrain.studies.torsion.damped_modes import damped_modes
from cranktrain.studies.torsion.peak_modes import OVERDAMPED
from cranktrain.studies.torsion.shaft_orders import ShaftOrders

FREQUENCIES = 3
"""Largest number of torsional frequencies in the diagram."""
PLACES = 5
"""Number of speeds at which frequencies are computed, because a damper's fluid changes with its temperature."""


def torsional_frequencies(structure: ShaftOrders, engine: Engine, low: float, high: float) -> tuple[Array, Array]:
    """Return speeds (s,) rad/s from ``low`` to ``high``, and frequencies (s, m) Hz, NaN for missing modes.

    The model has mean rods and no damping except the damper. The damper's ring is an additional coordinate with the
    damper's stiffness and damping at small amplitude and at its temperature for the speed. Modes with half of the
    critical damping or more are left out, because they are not resonances.
    """
    speeds = np.linspace(low, high, PLACES)
    if not structure.ring or engine.damper is None:
        own = structure.frequencies_hz()[:FREQUENCIES]
        return speeds, np.broadcast_to(own, (PLACES, own.size))
    stiffness, _, mass = structure.matrices(True)
    twist = structure.ends_rows()[0]
    link = np.outer(twist, twist)
    found = np.full((PLACES, FREQUENCIES), np.nan)
    for row, speed in zip(found, speeds.tolist(), strict=True):
        law = damper_parameters(engine.damper, damper_temperature(engine.damper, speed))
        modes = damped_modes(stiffness + law[STIFFNESS] * link, damping_coefficient(law) * link, mass)
        hz = modes.hz[modes.damping_ratios < OVERDAMPED][:FREQUENCIES]
        row[: hz.size] = hz
    return speeds, found[:, ~np.isnan(found).all(axis=0)]
