"""What the running model shows of pistons: the gas's volume, and the piston's motion in its liner.

Motion and forces are across and along the cylinder; what a level lacks is 0.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model.slots import (
    AREA,
    CLEARANCE_VOLUME,
    CRANKCASE,
    GAS_POWER,
    LINERS,
    LINERS_FRICTION,
    OFFSET,
    PISTONS,
    ROD,
    STATE_U,
    STATE_UD,
    STATE_UDD,
    STROKE_TOP,
)
from cranktrain.dynamics.motion.guided_pistons import FRICTION_ALONG, LOWER, UPPER, upper_share
from cranktrain.dynamics.motion.rod_motion import SIDE, VX, VY, X, Y, cylinder_axes, rod_end
from cranktrain.dynamics.motion.rods import observe_rod
from cranktrain.loads.slider_crank import PISTON, PISTON_VELOCITY

VOLUME, VOLUME_RATE, PISTON_POSITION, CYLINDER_OUTPUTS = range(4)
LATERAL, TILT, SIDE_FORCE, FRICTION, PISTON_OUTPUTS = range(5)


@law_kernel
def observe_cylinders(model, work, state, members, out):
    """Volume of the gas and its rate, and how far each piston is from the highest place of its pin."""
    frame = work.frames[0]
    u = work.port[STATE_U]
    motion = work.scratch
    work.powers[GAS_POWER] = 0.0
    for c in range(members):
        rod = model.cylinders[c]
        rod_end(model, frame, c, u, work.port[STATE_UD], work.port[STATE_UDD], motion)
        cos, sin = cylinder_axes(rod, frame)
        side = cos * motion[X] - sin * motion[Y] - rod[OFFSET]
        side_rate = cos * motion[VX] - sin * motion[VY]
        if model.layout[PISTONS] > 0.0:
            side -= u[int(model.layout[PISTONS]) + 2 * c]
            side_rate -= work.port[STATE_UD, int(model.layout[PISTONS]) + 2 * c]
        height = math.sqrt(rod[ROD] * rod[ROD] - side * side)
        position = sin * motion[X] + cos * motion[Y] + height
        rate = sin * motion[VX] + cos * motion[VY] - side * side_rate / height
        row = out[CYLINDER_OUTPUTS * c : CYLINDER_OUTPUTS * (c + 1)]
        row[VOLUME] = rod[CLEARANCE_VOLUME] + rod[AREA] * (rod[STROKE_TOP] - position)
        row[VOLUME_RATE] = -rod[AREA] * rate
        row[PISTON_POSITION] = rod[STROKE_TOP] - position
        work.powers[GAS_POWER] += (work.pressures[0, c] - model.scalars[CRANKCASE]) * row[VOLUME_RATE]
    return 0


@law_kernel
def observe_pistons(model, work, state, members, out):
    """Motion in the liner, across the cylinder at the height of the pin and in tilt; forces on it, across and along."""
    u = work.port[STATE_U]
    r = work.scratch
    work.powers[LINERS_FRICTION] = 0.0
    for c in range(members):
        row = out[PISTON_OUTPUTS * c : PISTON_OUTPUTS * (c + 1)]
        observe_rod(model, work, c)
        row[LATERAL] = 0.0
        row[TILT] = 0.0
        if model.layout[PISTONS] > 0.0:
            port = int(model.layout[PISTONS]) + 2 * c
            row[LATERAL] = u[port]
            row[TILT] = u[port + 1]
            if model.layout[LINERS] > 0.0:
                liner = int(model.layout[LINERS]) + 3 * c
                share = upper_share(model, c, r[PISTON])
                row[LATERAL] -= share * u[liner] + (1.0 - share) * u[liner + 1]
                row[TILT] += (u[liner] - u[liner + 1]) / (model.block.liners[c, 0] - model.block.liners[c, 1])
        row[SIDE_FORCE] = -r[SIDE + UPPER] - r[SIDE + LOWER]
        row[FRICTION] = -r[SIDE + FRICTION_ALONG]
        work.powers[LINERS_FRICTION] += row[FRICTION] * r[PISTON_VELOCITY]
    return 0
