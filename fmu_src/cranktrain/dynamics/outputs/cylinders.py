"""Outputs of cylinders and pistons: the gas volume, and the piston's motion in its liner.

Motion and forces are across and along the cylinder. Values that a level does not model are 0.
"""

import math

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.gas import crank_rotation, rigid_volume, trace_angle
from cranktrain.dynamics.outputs.laws import observe_law
from cranktrain.dynamics.topology.slider_crank import (
    FRICTION_ALONG,
    HEIGHT,
    HELD,
    RISING,
    SIDE,
)
from cranktrain.dynamics.topology.slider_crank import LATERAL as FOUND_LATERAL
from cranktrain.dynamics.topology.slider_crank import TILT as FOUND_TILT
from cranktrain.loads.built_in_trace import CYCLE

VOLUME, VOLUME_RATE, DEVIATION, DEVIATION_RATE, PISTON_POSITION, OWN_ANGLE, CYLINDER_OUTPUTS = range(7)
LATERAL, TILT, SIDE_FORCE, FRICTION, PISTON_OUTPUTS = range(5)


@law_kernel
def observe_cylinders(model, work, state, members, out):
    """Gas volume, its deviation from rigid parts, rates of both, piston position, and own crank angle of a cylinder."""
    frame = work.frames[0]
    _, rate, _ = crank_rotation(model, state)
    for c in range(members):
        rod = model.cylinders[c]
        k = int(model.cylinders[c, at.END_ROW])
        observe_law(model, work, state, k)
        found = work.found[k]
        angle = trace_angle(model, c, work.gas[c, at.OWN_ANGLE])
        rigid, slope = rigid_volume(model, c, frame[at.CRANK])
        row = out[CYLINDER_OUTPUTS * c : CYLINDER_OUTPUTS * (c + 1)]
        row[VOLUME] = work.gas[c, at.VOLUME]
        head = model.connections[k, at.FOLLOWED]
        rise = work.port[at.UD, head + at.HEAD] if head >= 0 else 0.0
        row[VOLUME_RATE] = -rod[at.AREA] * (found[RISING] - rise)
        row[DEVIATION] = row[VOLUME] - rigid
        row[DEVIATION_RATE] = row[VOLUME_RATE] - slope * (frame[at.OMEGA] + rate)
        row[PISTON_POSITION] = rod[at.STROKE_TOP] - found[HEIGHT]
        row[OWN_ANGLE] = angle - CYCLE * math.floor(angle / CYCLE)
    return 0


@law_kernel
def observe_pistons(model, work, state, members, out):
    """Piston motion in the liner, across at the height of the pin and in tilt; forces on it, across and along."""
    for c in range(members):
        row = out[PISTON_OUTPUTS * c : PISTON_OUTPUTS * (c + 1)]
        k = int(model.cylinders[c, at.END_ROW])
        observe_law(model, work, state, k)
        found = work.found[k]
        row[LATERAL] = found[FOUND_LATERAL]
        row[TILT] = found[FOUND_TILT]
        row[SIDE_FORCE] = found[SIDE]
        row[FRICTION] = found[FRICTION_ALONG]
        if model.cylinders[c, at.MASTER] >= 0.0:  # a master rod has a lower number than its articulated rods
            out[PISTON_OUTPUTS * int(model.cylinders[c, at.MASTER]) + SIDE_FORCE] -= found[HELD]
    return 0
