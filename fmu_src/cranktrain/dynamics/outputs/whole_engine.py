"""What the running model shows beside the crank: pistons, mounts, the engine as a whole, its cover and its damper.

Axes at rest, x across the engine, y upwards, z along the crank; a piston's are across and along its cylinder. What a
level lacks is 0.
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model.slots import DAMPER, DAMPER_TEMPERATURE, LINERS, PISTONS, STATE_UDD, TURNING_MODES
from cranktrain.dynamics.model.state import ACCELERATION, POSITION, VELOCITY, offset
from cranktrain.dynamics.motion.rods import SIDE, observe_rod, upper_share
from cranktrain.loads.damper import damper_torque

PISTON = ("lateral", "tilt", "side_force", "friction")
"""Motion in the liner, across the cylinder at the height of the pin and in tilt; forces on it, across and along."""
MOUNT = ("force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z")
"""What a mount does to the engine, the engine's weight included."""
WHOLE = (
    "engine.position.x",
    "engine.position.y",
    "engine.position.z",
    "engine.rotation.x",
    "engine.rotation.y",
    "engine.rotation.z",
    "cover.acceleration",
    "damper.torque",
    "damper.heat",
    "damper.twist",
    "damper.temperature",
)


def engine_output_names(cylinders: int, mounts: int) -> tuple[str, ...]:
    """Names of the outputs of this module, in order."""
    return (
        tuple(f"piston[{i + 1}].{name}" for i in range(cylinders) for name in PISTON)
        + tuple(f"mount[{i + 1}].{name}" for i in range(mounts) for name in MOUNT)
        + WHOLE
    )


@kernel
def observe_engine(model, work, state, frame, u, ud, mounts, out, k):
    """Write the outputs of this module from k on; returns where they end. ``mounts`` counts those that are shown."""
    n = model.omega2.shape[0]
    t = int(model.layout[TURNING_MODES])
    r = work.scratch
    for c in range(model.cylinders.shape[0]):
        side = r[SIDE:]
        observe_rod(model, frame, work, c, u, ud, work.port[STATE_UDD], r, side)
        out[k] = 0.0
        out[k + 1] = 0.0
        if model.layout[PISTONS] > 0.0:
            port = int(model.layout[PISTONS]) + 2 * c
            out[k] = u[port]
            out[k + 1] = u[port + 1]
            if model.layout[LINERS] > 0.0:
                liner = int(model.layout[LINERS]) + 3 * c
                share = upper_share(model, c, r[10])
                out[k] -= share * u[liner] + (1.0 - share) * u[liner + 1]
                out[k + 1] += (u[liner] - u[liner + 1]) / (model.block.liners[c, 0] - model.block.liners[c, 1])
        out[k + 2] = -side[7] - side[8]
        out[k + 3] = -side[9]
        k += 4
    q = state[offset(POSITION, n) + t : offset(POSITION, n) + n]
    v = state[offset(VELOCITY, n) + t : offset(VELOCITY, n) + n]
    a = state[offset(ACCELERATION, n) + t : offset(ACCELERATION, n) + n]
    block = model.block
    for j in range(6 * mounts):
        out[k + j] = 0.0
    for j in range(block.mounts.shape[0]):
        place = 0.0
        rate = 0.0
        for i in range(n - t):
            place += block.mounts[j, i] * q[i]
            rate += block.mounts[j, i] * v[i]
        out[k + j] = block.mount_laws[j, 2] - block.mount_laws[j, 0] * place - block.mount_laws[j, 1] * rate
    k += 6 * mounts
    for j in range(6):
        motion = 0.0
        for i in range(n - t):
            motion += block.motion[j, i] * q[i]
        out[k + j] = motion
    k += 6
    out[k] = 0.0
    for i in range(n - t):
        out[k] += block.cover[i] * a[i]
    for j in range(1, 5):
        out[k + j] = 0.0
    if model.layout[DAMPER] > 0.0:
        port = int(model.layout[DAMPER])
        damper_torque(model.damper, u[port], ud[port], r)
        out[k + 1] = r[0]
        out[k + 2] = r[3]
        out[k + 3] = u[port]
        out[k + 4] = model.scalars[DAMPER_TEMPERATURE]
    return k + 5
