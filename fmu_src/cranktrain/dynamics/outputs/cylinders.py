"""Outputs of cylinders and pistons: the gas volume, and the piston's motion in its liner.

Motion and forces are across and along the cylinder. Values that a level does not model are 0.
"""

import math

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.gas import crank_rotation, gas_force, rigid_volume, trace_angle
from cranktrain.dynamics.motion.masses import observe_rod
from cranktrain.dynamics.topology.slider_crank import (
    FRICTION_ALONG,
    HEIGHT,
    HELD,
    RISING,
    SIDE,
    SKIRT_LOSS,
    SPEED,
)
from cranktrain.dynamics.topology.slider_crank import LATERAL as FOUND_LATERAL
from cranktrain.dynamics.topology.slider_crank import TILT as FOUND_TILT
from cranktrain.film.laws.films import GAS_POWER, KINETIC
from cranktrain.loads.built_in_trace import CYCLE

VOLUME, VOLUME_RATE, DEVIATION, DEVIATION_RATE, PISTON_POSITION, OWN_ANGLE, CYLINDER_OUTPUTS = range(7)
LATERAL, TILT, SIDE_FORCE, FRICTION, PISTON_OUTPUTS = range(5)


@law_kernel
def observe_cylinders(model, work, state, members, out):
    """Gas volume, its deviation from rigid parts, rates of both, piston position, and own crank angle of a cylinder."""
    frame = work.frames[0]
    work.powers[at.GAS_POWER] = 0.0
    work.powers[at.GAS_WORK] = 0.0
    _, rate, _ = crank_rotation(model, state)
    for c in range(members):
        rod = model.cylinders[c]
        observe_rod(model, work, c)
        found = work.rods[c]
        angle = trace_angle(model, c, work.gas[c, at.OWN_ANGLE])
        rigid, slope = rigid_volume(model, c, frame[at.CRANK])
        row = out[CYLINDER_OUTPUTS * c : CYLINDER_OUTPUTS * (c + 1)]
        row[VOLUME] = work.gas[c, at.VOLUME]
        row[VOLUME_RATE] = -rod[at.AREA] * (found[RISING] - work.rises[c, 1])
        row[DEVIATION] = row[VOLUME] - rigid
        row[DEVIATION_RATE] = row[VOLUME_RATE] - slope * (frame[at.OMEGA] + rate)
        row[PISTON_POSITION] = rod[at.STROKE_TOP] - found[HEIGHT]
        row[OWN_ANGLE] = angle - CYCLE * math.floor(angle / CYCLE)
        pressure = work.pressures[0, c] - model.scalars[at.CRANKCASE]
        work.powers[at.GAS_POWER] -= pressure * rod[at.AREA] * found[SPEED]
        work.powers[at.GAS_WORK] += (
            found[GAS_POWER] + gas_force(rod, model.scalars, work.pressures[0, c]) * (work.rises[c, 1])
        )
    return 0


@law_kernel
def observe_pistons(model, work, state, members, out):
    """Piston motion in the liner, across at the height of the pin and in tilt; forces on it, across and along."""
    work.powers[at.LINERS_FRICTION] = 0.0
    work.powers[at.LINERS_LOSS] = 0.0
    work.powers[at.SKIRTS_LOSS] = 0.0
    for c in range(members):
        row = out[PISTON_OUTPUTS * c : PISTON_OUTPUTS * (c + 1)]
        observe_rod(model, work, c)
        found = work.rods[c]
        row[LATERAL] = found[FOUND_LATERAL]
        row[TILT] = found[FOUND_TILT]
        row[SIDE_FORCE] = found[SIDE]
        row[FRICTION] = found[FRICTION_ALONG]
        if model.cylinders[c, at.MASTER] >= 0.0:  # a master rod has a lower number than its articulated rods
            out[PISTON_OUTPUTS * int(model.cylinders[c, at.MASTER]) + SIDE_FORCE] -= found[HELD]
        rising = found[RISING]
        liner = int(model.cylinders[c, at.LINER_PORT])
        if liner >= 0:
            rising -= work.port[at.STATE_UD, liner + 2]
        work.powers[at.STORED] += found[KINETIC]
        work.powers[at.LINERS_FRICTION] += row[FRICTION] * found[SPEED]
        work.powers[at.LINERS_LOSS] += row[FRICTION] * rising
        work.powers[at.SKIRTS_LOSS] += found[SKIRT_LOSS]
    return 0
