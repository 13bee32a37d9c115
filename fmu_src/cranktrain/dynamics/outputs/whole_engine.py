"""What the running model shows of the engine as a whole: mounts, block, cover and damper.

Axes at rest, x across the engine, y upwards, z along the crank. What a level lacks is 0.
"""

from __future__ import annotations

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import damper_row
from cranktrain.dynamics.model.state import ACCELERATION, POSITION, VELOCITY, offset
from cranktrain.loads.damper import damper_torque

AXES = 6
"""Displacements along x, y, z and rotations about them, or forces and moments."""
TORQUE, HEAT, TWIST, TEMPERATURE, DAMPER_OUTPUTS = range(5)
DAMPER_HEAT = 3
"""Where the damper's law writes the power that it dissipates."""


@law_kernel
def observe_mounts(model, work, state, members, out):
    """What each mount does to the engine, the engine's weight included."""
    n = model.omega2.shape[0]
    t = model.ports.shape[1]
    q = state[offset(POSITION, n) + t : offset(POSITION, n) + n]
    v = state[offset(VELOCITY, n) + t : offset(VELOCITY, n) + n]
    block = model.block
    work.powers[at.MOUNTS_LOSS] = 0.0
    for j in range(AXES * members):
        out[j] = 0.0
    for j in range(block.mounts.shape[0]):
        place = 0.0
        rate = 0.0
        for i in range(model.block.preload.shape[0]):
            place += block.mounts[j, i] * q[i]
            rate += block.mounts[j, i] * v[i]
        law = block.mount_laws[j]
        work.powers[at.MOUNTS_LOSS] += law[at.MOUNT_DAMPING] * rate * rate
        out[j] = law[at.MOUNT_PRELOAD] - law[at.MOUNT_STIFFNESS] * place - law[at.MOUNT_DAMPING] * rate
    return 0


@law_kernel
def observe_block(model, work, state, members, out):
    """Displacement and rotation of the block as a whole."""
    n = model.omega2.shape[0]
    t = model.ports.shape[1]
    q = state[offset(POSITION, n) + t : offset(POSITION, n) + n]
    for j in range(AXES):
        motion = 0.0
        for i in range(model.block.preload.shape[0]):
            motion += model.block.motion[j, i] * q[i]
        out[j] = motion
    return 0


@law_kernel
def observe_cover(model, work, state, members, out):
    """Acceleration of the cover's middle, square to it."""
    n = model.omega2.shape[0]
    t = model.ports.shape[1]
    a = state[offset(ACCELERATION, n) + t : offset(ACCELERATION, n) + n]
    out[0] = 0.0
    for i in range(model.block.preload.shape[0]):
        out[0] += model.block.cover[i] * a[i]
    return 0


@law_kernel
def observe_damper(model, work, state, members, out):
    """Torque of the ring on the housing, power that it dissipates, its twist against the housing, its temperature."""
    for j in range(DAMPER_OUTPUTS):
        out[j] = 0.0
    work.powers[at.DAMPER_LOSS] = 0.0
    damper = damper_row(model)
    if damper >= 0:
        port = int(model.connections[damper, at.FIRST])
        r = work.scratch
        damper_torque(model.damper, work.port[at.STATE_U, port], work.port[at.STATE_UD, port], r)
        out[TORQUE] = r[0]
        out[HEAT] = r[DAMPER_HEAT]
        work.powers[at.DAMPER_LOSS] = r[DAMPER_HEAT]
        out[TWIST] = work.port[at.STATE_U, port]
        out[TEMPERATURE] = model.scalars[at.DAMPER_TEMPERATURE]
    return 0
