"""Outputs of the engine as a whole: mounts, block, cover and damper.

Axes are at rest, x across the engine, y upwards, z along the crank. Values that a level does not model are 0.
"""

from cranktrain.core.kernel import inlined_kernel, law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import turning_modes
from cranktrain.dynamics.model.state import ACCELERATION, POSITION, VELOCITY, offset
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.dynamics.outputs.laws import observe_law
from cranktrain.dynamics.topology.damper import HEAT

AXES = 6
"""Number of components: displacements along and rotations about x, y, z, or forces and moments."""
TORQUE, DAMPER_HEAT, TWIST, TEMPERATURE, DAMPER_OUTPUTS = range(5)


@law_kernel
def observe_mounts(model, work, state, members, out):
    """Forces and moments of each mount on the engine, including those that carry the engine's weight."""
    block = model.block
    for j in range(AXES * members):
        out[j] = 0.0
    for j in range(block.mounts.shape[0]):
        law = block.mount_laws[j]
        place = of_block(model, state, POSITION, block.mounts[j])
        rate = of_block(model, state, VELOCITY, block.mounts[j])
        out[j] = law[at.MOUNT_PRELOAD] - law[at.MOUNT_STIFFNESS] * place - law[at.MOUNT_DAMPING] * rate
    return 0


@inlined_kernel
def of_block(model, state, kind, shape):
    """Position, velocity or acceleration, by ``kind``, of a point of the block with a ``shape`` (n_s,)."""
    first = offset(kind, model.omega2.shape[0]) + turning_modes(model)
    return dot(shape, state[first:], model.block.preload.shape[0])


@law_kernel
def observe_block(model, work, state, members, out):
    """Displacement and rotation of the block as a whole."""
    for j in range(AXES):
        out[j] = of_block(model, state, POSITION, model.block.motion[j])
    return 0


@law_kernel
def observe_cover(model, work, state, members, out):
    """Acceleration of the cover's middle, normal to the cover."""
    out[0] = of_block(model, state, ACCELERATION, model.block.cover)
    return 0


@law_kernel
def observe_damper(model, work, state, members, out):
    """Torque of the damper's ring on the housing, dissipated power, twist relative to the housing, temperature."""
    for j in range(DAMPER_OUTPUTS):
        out[j] = 0.0
    damper = int(model.layout[at.DAMPER_ROW])
    if damper >= 0:
        observe_law(model, work, state, damper)
        out[TORQUE] = work.found[damper, 0]
        out[DAMPER_HEAT] = work.found[damper, HEAT]
        out[TWIST] = model.laws.place[damper, 0]
        out[TEMPERATURE] = model.scalars[at.DAMPER_TEMPERATURE]
    return 0
