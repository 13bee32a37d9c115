"""Outputs of cylinders and pistons: the gas volume, and the piston's motion in its liner.

Motion and forces are across and along the cylinder. Values that a level does not model are 0.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel, law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.gas import crank_rotation, own_angle, rigid_volume, trace_angle, volume_over
from cranktrain.dynamics.motion.guided_pistons import FRICTION_ALONG, LOWER, UPPER, upper_share
from cranktrain.dynamics.motion.rod_motion import CROSS, MASTERS_PIN, SIDE, VX, VY, X, Y, rod_end_across
from cranktrain.dynamics.motion.rods import observe_rod, piston_rise
from cranktrain.loads.articulated_rod import force_on_pin
from cranktrain.loads.built_in_trace import CYCLE
from cranktrain.loads.piston_guidance import HEIGHT
from cranktrain.loads.slider_crank import PISTON, PISTON_VELOCITY

VOLUME, VOLUME_RATE, DEVIATION, DEVIATION_RATE, PISTON_POSITION, OWN_ANGLE, CYLINDER_OUTPUTS = range(7)
LATERAL, TILT, SIDE_FORCE, FRICTION, PISTON_OUTPUTS = range(5)


@law_kernel
def observe_cylinders(model, work, state, members, out):
    """Gas volume, its deviation from rigid parts, rates of both, piston position, and own crank angle of a cylinder."""
    frame = work.frames[0]
    u = work.port[at.STATE_U]
    ud = work.port[at.STATE_UD]
    work.powers[at.GAS_POWER] = 0.0
    work.powers[at.GAS_WORK] = 0.0
    _, rate, _ = crank_rotation(model, state)
    for c in range(members):
        rod = model.cylinders[c]
        rod_end_across(model, frame, c, u, ud, work.port[at.STATE_UDD], work.scratch)
        angle = trace_angle(model, c, own_angle(model, frame, u, work.scratch[X], work.scratch[Y], c))
        position, moving, height, rising = piston_rise(model, c, u, ud, work.scratch[CROSS:])
        rising -= work.rises[c, 1]
        rigid, slope = rigid_volume(model, c, frame[at.CRANK])
        row = out[CYLINDER_OUTPUTS * c : CYLINDER_OUTPUTS * (c + 1)]
        row[VOLUME] = volume_over(rod, height - work.rises[c, 0])
        row[VOLUME_RATE] = -rod[at.AREA] * rising
        row[DEVIATION] = row[VOLUME] - rigid
        row[DEVIATION_RATE] = row[VOLUME_RATE] - slope * (frame[at.OMEGA] + rate)
        row[PISTON_POSITION] = rod[at.STROKE_TOP] - position
        row[OWN_ANGLE] = angle - CYCLE * math.floor(angle / CYCLE)
        pressure = work.pressures[0, c] - model.scalars[at.CRANKCASE]
        work.powers[at.GAS_POWER] -= pressure * rod[at.AREA] * moving
        work.powers[at.GAS_WORK] -= pressure * rod[at.AREA] * rod[at.OWN_ROD] * rising
    return 0


@kernel
def sliding_rate(model, work, c, position, rate):
    """Rate (m/s) at which the pin of piston c rises along its leaning liner; the liner's own rise is not subtracted."""
    liner = int(model.cylinders[c, at.LINER_PORT])
    if liner < 0:
        return rate
    u = work.port[at.STATE_U]
    ud = work.port[at.STATE_UD]
    piston = int(model.cylinders[c, at.PISTON_PORT])
    length = model.block.liners[c, 0] - model.block.liners[c, 1]
    slope = (u[liner] - u[liner + 1]) / length
    turning = (ud[liner] - ud[liner + 1]) / length
    share = upper_share(model, c, position - u[liner + 2])
    wall_rate = share * ud[liner] + (1.0 - share) * ud[liner + 1]
    share = upper_share(model, c, 0.0)
    foot = share * u[liner] + (1.0 - share) * u[liner + 1]
    return rate + slope * (ud[piston] - wall_rate) + turning * (u[piston] - foot)


@law_kernel
def observe_pistons(model, work, state, members, out):
    """Piston motion in the liner, across at the height of the pin and in tilt; forces on it, across and along."""
    u = work.port[at.STATE_U]
    r = work.scratch
    work.powers[at.LINERS_FRICTION] = 0.0
    work.powers[at.LINERS_LOSS] = 0.0
    work.powers[at.SKIRTS_LOSS] = 0.0
    for c in range(members):
        row = out[PISTON_OUTPUTS * c : PISTON_OUTPUTS * (c + 1)]
        observe_rod(model, work, c)
        row[LATERAL] = 0.0
        row[TILT] = 0.0
        work.powers[at.STORED] += rod_energy(model, work, c)
        port, liner = int(model.cylinders[c, at.PISTON_PORT]), int(model.cylinders[c, at.LINER_PORT])
        if port >= 0:
            row[LATERAL] = u[port]
            row[TILT] = u[port + 1]
            if liner >= 0:
                share = upper_share(model, c, r[PISTON])
                row[LATERAL] -= share * u[liner] + (1.0 - share) * u[liner + 1]
                row[TILT] += (u[liner] - u[liner + 1]) / (model.block.liners[c, 0] - model.block.liners[c, 1])
        row[SIDE_FORCE] = -r[SIDE + UPPER] - r[SIDE + LOWER]
        row[FRICTION] = -r[SIDE + FRICTION_ALONG]
        master = int(model.cylinders[c, at.MASTER])
        if master >= 0:  # a master rod has a lower number than its articulated rods
            _, _, held = force_on_pin(model.cylinders[c, at.JOINT :], r[MASTERS_PIN:], r)
            out[PISTON_OUTPUTS * master + SIDE_FORCE] -= held
        work.powers[at.LINERS_FRICTION] += row[FRICTION] * r[PISTON_VELOCITY]
        rising = sliding_rate(model, work, c, r[PISTON], r[PISTON_VELOCITY])
        if liner >= 0:
            rising -= work.port[at.STATE_UD, liner + 2]
        work.powers[at.LINERS_LOSS] += row[FRICTION] * rising
        if port >= 0:
            for layer in range(2):
                work.powers[at.SKIRTS_LOSS] -= r[SIDE + UPPER + layer] * layer_rate(model, work, c, layer, r)
    return 0


@kernel
def rod_energy(model, work, c):
    """Kinetic energy (J) of a rod and of its piston along the cylinder, from the motion that observe_rod has stored."""
    rod = model.cylinders[c]
    cross = work.scratch[CROSS:]
    side = cross[X] - rod[at.OFFSET]
    side_rate = cross[VX]
    piston = int(rod[at.PISTON_PORT])
    if piston >= 0:
        side -= work.port[at.STATE_U, piston]
        side_rate -= work.port[at.STATE_UD, piston]
    swing = side_rate * side_rate / (rod[at.ROD] * rod[at.ROD] - side * side)
    along = work.scratch[PISTON_VELOCITY]
    across = cross[VX] * cross[VX] + cross[VY] * cross[VY]
    return 0.5 * (rod[at.M_OSC] * along * along + rod[at.M_BIG] * across + rod[at.DELTA_J] * swing)


@kernel
def layer_rate(model, work, c, layer, rod):
    """Rate of the gap (m/s) between a layer of the skirt of piston c and its liner, normal to the leaning liner."""
    u = work.port[at.STATE_U]
    ud = work.port[at.STATE_UD]
    piston, liner = int(model.cylinders[c, at.PISTON_PORT]), int(model.cylinders[c, at.LINER_PORT])
    height = model.block.guidance[HEIGHT + layer]
    rate = ud[piston] - ud[piston + 1] * height
    if liner >= 0:
        slope = (u[liner] - u[liner + 1]) / (model.block.liners[c, 0] - model.block.liners[c, 1])
        share = upper_share(model, c, rod[PISTON] + height - u[liner + 2])
        rate -= share * ud[liner] + (1.0 - share) * ud[liner + 1] + slope * (rod[PISTON_VELOCITY] - ud[liner + 2])
    return rate
