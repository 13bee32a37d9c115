"""Torsional frequencies of the page's Campbell diagram: those of the crank with its damper's ring, over the speed."""

from __future__ import annotations

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.loads.damper import STIFFNESS, damper_parameters, damper_temperature, damping_coefficient
from cranktrain.studies.torsion.damped_modes import damped_modes
from cranktrain.studies.torsion.peak_modes import OVERDAMPED
from cranktrain.studies.torsion.shaft_orders import ShaftOrders

FREQUENCIES = 3
"""Torsional frequencies that the diagram shows, if the crank has as many."""
PLACES = 5
"""Speeds at which they are computed; a damper's fluid changes with its temperature."""


def torsional_frequencies(structure: ShaftOrders, engine: Engine, low: float, high: float) -> tuple[Array, Array]:
    """Speeds (s,) rad/s from ``low`` to ``high``, and frequencies (s, m) Hz there; not a number where there is none.

    Undamped and with mean rods but for the damper: its ring is one more coordinate, held by the spring and the damping
    of the damper at small amplitude and as warm as its table says at the speed. Modes that the damper damps by half of
    the critical damping or more are no resonance and left out.
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
