"""Parts of the pulley's axial motion: they add up to ``pulley.axial``.

From the block outwards: the thrust faces move with the block on its mounts, the collar between its faces, and the crank
between collar and pulley, stretched by axial forces and, its throws being what they are, by twist and bending as well.
"""

from __future__ import annotations

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model.slots import FIRST, RELATIVE, THRUST_LAW, TURNING_MODES
from cranktrain.dynamics.model.state import POSITION, offset

OF_ENGINE, OF_BEARING, OF_CRANK = range(3)
PULLEY = 2
"""Row of ``ModelArrays.ends``."""


@law_kernel
def observe_axial(model, work, state, members, out):
    """Displacements along the crank axis: thrust faces in space, collar against them, pulley against the collar."""
    n = model.omega2.shape[0]
    t = int(model.layout[TURNING_MODES])
    q = state[offset(POSITION, n) : offset(POSITION, n) + n]
    collar = int(model.connections[int(model.layout[THRUST_LAW]), FIRST])
    out[OF_ENGINE] = 0.0
    for k in range(model.axial.shape[0]):
        faces = int(model.axial[k, 1]) - model.ports.shape[0]
        for i in range(model.block_ports.shape[1]):  # the block's own modes, before those of pistons
            out[OF_ENGINE] += model.block_ports[faces, i] * q[t + i]
    out[OF_BEARING] = work.port[RELATIVE, collar]
    out[OF_CRANK] = 0.0
    for i in range(t):
        out[OF_CRANK] += (model.ends[PULLEY, i] - model.ports[collar, i]) * q[i]
    return 0
