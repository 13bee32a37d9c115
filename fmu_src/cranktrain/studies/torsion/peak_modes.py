"""Torsional modes of the cranktrain with its damper's ring at a peak of a run-up.

The ring is one more coordinate, coupled to the pulley by the damper's stiffness and damping at the peak's frequency and
at the temperature that the damper has at the peak's speed. A fluid that thins as it shears has the damping that
dissipates as much at the rate of ring against pulley that the mode has where the pulley swings as far as the peak.
Modes are the eigenvalues of :mod:`cranktrain.studies.torsion.damped_modes`; frequency and rate are found by iteration.
"""

import math

import numpy as np

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.engine.model import Engine
from cranktrain.loads.damper import (
    STIFFNESS,
    damper_parameters,
    damper_temperature,
    equivalent_damping,
    required_damper,
)
from cranktrain.results.orders.resonances import Peak
from cranktrain.structure.crank.modal import KINDS, at_largest, cranktrain_matrices, energy_shares
from cranktrain.studies.torsion.damped_modes import damped_modes, with_ring

_SETTLED, _ROUNDS = 1e-4, 50
OVERDAMPED = 0.5
"""Damping ratio from which a mode causes no peak."""


def modes_at_peak(engine: Engine, body: ReducedBody, peak: Peak) -> Array:
    """Frequencies (k,) Hz of the torsional modes at a peak of the pulley's torsion; empty if all are overdamped.

    Raises ``InputError``: an engine without damper, or one that is hotter or colder there than its law is valid.
    ``engine``, ``body``: with the damper's housing, the running body at any level that twists.
    """
    damper = required_damper(engine)
    temperature = damper_temperature(damper, peak.speed)
    stiffness, mass = cranktrain_matrices(engine, body)
    hub = body.shapes[body.index("pulley"), 5]
    hz, rate = peak.hz, 0.0
    for _ in range(_ROUNDS):
        parameters = damper_parameters(damper, temperature, hz)
        viscous = equivalent_damping(parameters, rate)
        modes = damped_modes(*with_ring(stiffness, mass, hub, damper.ring_inertia, parameters[STIFFNESS], viscous))
        shares = energy_shares(engine, body, at_largest(modes.shapes[:-1]), rods=True)
        torsional = (shares.argmax(axis=1) == KINDS.index("torsional")) & (modes.damping_ratios < OVERDAMPED)
        found = np.flatnonzero(torsional)
        if not found.size:
            return np.zeros(0)
        at = found[np.argmin(np.abs(modes.hz[found] - peak.hz))]
        turned = hub @ modes.shapes[:-1, at]
        before, rate = (
            rate,
            float(2.0 * math.pi * modes.hz[at] * peak.amplitude * abs(1.0 - modes.shapes[-1, at] / turned)),
        )
        if abs(modes.hz[at] - hz) <= _SETTLED * hz and abs(rate - before) <= _SETTLED * rate:
            break
        hz = float(modes.hz[at])
    return np.asarray(modes.hz[found])
