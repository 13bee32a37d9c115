"""Motion of the bare crankshaft and loads at its interfaces, from a recorded cycle of the running model."""

from __future__ import annotations

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.results.strength.cut_loads import named_loads, weight
from cranktrain.results.strength.recorded_cycle import RecordedCycle
from cranktrain.structure.stress.direct_solution import Instants


def bare_instants(cycle: RecordedCycle) -> Instants:
    """All samples of a cycle in the modes of the bare crankshaft, without attached parts."""
    body = cycle.body
    basis = np.eye(body.n_modes) if body.basis is None else body.basis
    return Instants(
        position=cycle.position @ basis.T,
        velocity=cycle.velocity @ basis.T,
        acceleration=(cycle.change + cycle.damping * cycle.velocity) @ basis.T,
        loads=wrenches(cycle),
        speed=cycle.speed,
        speed_rate=cycle.acceleration,
        gravity=weight(cycle),
    )


def wrenches(cycle: RecordedCycle) -> Array:
    """Force and moment (n, m, 6) at each of the m interfaces, N and N m."""
    found = np.zeros((cycle.angle.size, len(cycle.body.interfaces), 6))
    for name, load in named_loads(cycle):
        row = cycle.body.index(name)
        every = np.ones(load.z.size, dtype=bool)
        found[:, row] += np.concatenate(load.resultant(every, cycle.body.positions[row]), axis=1)
    return found
