"""Parts of the pulley's axial motion, which add up to ``pulley.axial``.

From the block outwards: motion of the thrust faces with the block on its mounts, motion of the collar between its
faces, and stretch of the crank between collar and pulley, by axial forces and, because of its throws, by twist and
bending.
"""

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import block_modes, collar_port, joint_row, turning_modes
from cranktrain.dynamics.model.state import POSITION, VELOCITY, offset
from cranktrain.dynamics.motion.film_memory import recalling_call
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.film.laws.films import OBSERVE

OF_ENGINE, OF_BEARING, OF_CRANK = range(3)
FORCE, SLIP = range(2)


@law_kernel
def observe_axial(model, work, state, members, out):
    """Displacements along the axis: thrust faces in space, collar relative to faces, pulley relative to collar."""
    n = model.omega2.shape[0]
    t = turning_modes(model)
    q = state[offset(POSITION, n) : offset(POSITION, n) + n]
    collar = collar_port(model)
    out[OF_ENGINE] = 0.0
    for k in range(model.axial.shape[0]):
        faces = int(model.axial[k, 1])
        for i in range(block_modes(model)):  # the block's own modes, before those of pistons
            out[OF_ENGINE] += model.bodies.shapes[faces, i] * q[t + i]
    out[OF_BEARING] = work.port[at.RELATIVE, collar]
    out[OF_CRANK] = 0.0
    for i in range(t):
        out[OF_CRANK] += (model.ends[at.PULLEY_AXIAL, i] - model.bodies.shapes[collar, i]) * q[i]
    return 0


@law_kernel
def observe_axial_path(model, work, state, members, out):
    """Axial force of the drive line on the flywheel, and displacement of the flywheel relative to the shaft."""
    out[FORCE] = 0.0
    out[SLIP] = 0.0
    n = model.omega2.shape[0]
    t = turning_modes(model)
    v = state[offset(VELOCITY, n) : offset(VELOCITY, n) + t]
    work.powers[at.AXIAL_JOINT_LOSS] = 0.0
    work.powers[at.AXIAL_FORCE_WORK] = -work.frames[0, at.AXIAL_FORCE] * dot(model.ends[at.FLYWHEEL_AXIAL], v, t)
    joint = joint_row(model)
    if joint >= 0:
        recalling_call(model, state, OBSERVE, joint, model.laws.out)
        out[FORCE] = model.laws.out[0]
        port = model.connections[joint, at.FIRST]
        out[SLIP] = work.port[at.STATE_U, port]
        work.powers[at.AXIAL_JOINT_LOSS] = -out[FORCE] * work.port[at.STATE_UD, port]
    return 0
