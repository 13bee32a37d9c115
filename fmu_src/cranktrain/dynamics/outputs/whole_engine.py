"""Outputs of the engine as a whole: mounts, block, cover and damper.

Axes are at rest, x across the engine, y upwards, z along the crank. Values that a level does not model are 0.
"""

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import damper_row, turning_modes
from cranktrain.dynamics.model.state import ACCELERATION, POSITION, VELOCITY, offset
from cranktrain.loads.damper import damper_torque

AXES = 6
"""Number of components: displacements along and rotations about x, y, z, or forces and moments."""
TORQUE, HEAT, TWIST, TEMPERATURE, DAMPER_OUTPUTS = range(5)
DAMPER_HEAT = 3
"""Position in the results of the damper's force law of the dissipated power."""


@law_kernel
def observe_mounts(model, work, state, members, out):
    """Forces and moments of each mount on the engine, including those that carry the engine's weight."""
    n = model.omega2.shape[0]
    t = turning_modes(model)
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
    t = turning_modes(model)
    q = state[offset(POSITION, n) + t : offset(POSITION, n) + n]
    for j in range(AXES):
        motion = 0.0
        for i in range(model.block.preload.shape[0]):
            motion += model.block.motion[j, i] * q[i]
        out[j] = motion
    return 0


@law_kernel
def observe_cover(model, work, state, members, out):
    """Acceleration of the cover's middle, normal to the cover."""
    n = model.omega2.shape[0]
    t = turning_modes(model)
    a = state[offset(ACCELERATION, n) + t : offset(ACCELERATION, n) + n]
    out[0] = 0.0
    for i in range(model.block.preload.shape[0]):
        out[0] += model.block.cover[i] * a[i]
    return 0


@law_kernel
def observe_damper(model, work, state, members, out):
    """Torque of the damper's ring on the housing, dissipated power, twist relative to the housing, temperature."""
    for j in range(DAMPER_OUTPUTS):
        out[j] = 0.0
    work.powers[at.DAMPER_LOSS] = 0.0
    damper = damper_row(model)
    if damper >= 0:
        port = model.connections[damper, at.FIRST]
        r = work.scratch
        damper_torque(model.damper, work.port[at.STATE_U, port], work.port[at.STATE_UD, port], r)
        out[TORQUE] = r[0]
        out[HEAT] = r[DAMPER_HEAT]
        work.powers[at.DAMPER_LOSS] = r[DAMPER_HEAT]
        out[TWIST] = work.port[at.STATE_U, port]
        out[TEMPERATURE] = model.scalars[at.DAMPER_TEMPERATURE]
    return 0
