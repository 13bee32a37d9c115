"""Force law of a rigid rod and its piston on a pin, with their masses and the gas on the piston.

The first end is the pin, the second one holds the cylinder. The first two components are the displacement of the pin
across the axis of its crank; a pin locked on a circle has its rotation instead. The pin's place is exact at any
rotation of the crank relative to its frame (:mod:`cranktrain.dynamics.motion.crank_pin`). The force of the rod is that
of :mod:`cranktrain.loads.slider_crank`, and goes through the master rod's knuckle if the rod is articulated.

A guided piston has two inner components, its displacement across the cylinder and its tilt, between the springs of its
skirt (:mod:`cranktrain.loads.piston_guidance`). Its liner may move and lean with a block: gas and friction act along
the liner and its springs normal to it. An engine on soft mounts leans by a degree, and 100 kN of gas then have a
component of 2 kN across.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import inlined_kernel, law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.crank_pin import accelerate, cylinder_axes, in_space, pin_motion
from cranktrain.engine.connections import SliderCrank
from cranktrain.film.laws import films as on
from cranktrain.loads.articulated_rod import AX, AY, VX, VY, X, Y, force_change, force_on_pin, hang
from cranktrain.loads.piston_guidance import HEIGHT as LAYER_HEIGHT
from cranktrain.loads.piston_guidance import UNBALANCE, layer_force, liner_friction
from cranktrain.loads.slider_crank import (
    BY_ACCELERATION,
    BY_VX,
    BY_X,
    PISTON,
    PISTON_ACCELERATION,
    PISTON_VELOCITY,
    pin_tangent,
    remainder_inertia,
    rod_force,
    turn_back,
)

# Figures of the law, in slots of a bearing's figures: distance of the piston pin from the crank's axis (m), its rate
# (m/s), and the force of the piston on its cylinder across it (N).
HEIGHT, SPEED, SIDE = on.P_MAX, on.P_MAX + 1, on.P_MAX + 2
# With OBSERVE, in place of the tangents:
# RISING: rate of the piston pin along its leaning liner, m/s; the liner's own rise is not subtracted.
# LATERAL, TILT: displacement across the liner at the height of the pin, m, and tilt relative to the liner, rad.
# FRICTION_ALONG, LINER_LOSS: friction of the piston on its liner, N, and the power that it takes, W.
# SKIRT_LOSS: power lost in the springs of the skirt, W.
# KNUCKLE: force (2) of the rod on its own pin, along the axes of its cylinder, N.
# HELD: side force of an articulated rod on the master's piston, N.
# ON_PIN: force (2) on the crank pin along the axes of its frame, N.
RISING, LATERAL, TILT, FRICTION_ALONG, SKIRT_LOSS, KNUCKLE = range(on.BY_PLACE, on.BY_PLACE + 6)
HELD, ON_PIN, LINER_LOSS = KNUCKLE + 2, KNUCKLE + 3, KNUCKLE + 5
# Positions in a record's room: motion of an articulated rod's end in axes of its cylinder, motion of the pin in axes of
# the master's cylinder, result of rod_force, and of a spring layer.
OF_END, OF_MASTER, OF_ROD, OF_LAYER, ROOM = 0, 6, 18, 31, 34
ROW = 4
"""Values in a row of the law's tangents."""
RISE, RATES, AXIS = 2, 3, 6
"""Positions in what the law is told of its liner: its rise, rates, and place of the block's axis."""


class SliderCrankRecord(NamedTuple):
    """Data of r rods with their pistons."""

    rods: Array  # (r, CYLINDER) see dynamics.model.slots
    pins: Array  # (r, 2) position of each pin in the frame of its crank, m
    up: Array  # (r, 2) upwards across and along each cylinder
    liners: Array  # (r, 2) height of each liner's upper and lower ring along its cylinder from the crank's axis, m
    guidance: Array  # (10,) see loads.piston_guidance
    room: Array  # (ROOM,) scratch


def slider_crank_record(given: SliderCrank, sense: float, pin: Array) -> SliderCrankRecord:
    """Record of a rod on a ``pin`` (2,), m, of a crank whose frame turns in a ``sense``.

    The frame of a crank that turns backwards has y and z of the engine reversed, so the cylinder's angle β becomes
    π − β there, and across the cylinder is the other way round.
    """
    bank = given.bank if sense > 0.0 else math.pi - given.bank
    row = np.full((1, at.CYLINDER), at.NO_PORT)
    row[0, [at.ROD, at.M_BIG, at.M_OSC]] = given.length, given.big_end_mass, given.small_end_mass + given.piston_mass
    row[0, at.DELTA_J] = remainder_inertia(given.rod)
    row[0, at.OFFSET] = sense * given.offset
    row[0, [at.COS_BANK, at.SIN_BANK]] = math.cos(bank), math.sin(bank)
    row[0, at.AREA] = 0.25 * math.pi * given.bore**2 if given.cylinder else 0.0
    row[0, [at.OWN_ROD, at.PIN_PORT]] = 1.0, 0.0
    up = sense * np.array([[math.sin(bank), math.cos(bank)]])
    return own_rods(row, np.array(pin, dtype=float)[None], np.ones((1, 2)), np.zeros(10), up)


def own_rods(rods: Array, pins: Array, liners: Array, guidance: Array, up: Array | None = None) -> SliderCrankRecord:
    """Record of rods that shares the arrays given, so that what a run changes in them holds for the law.

    Without ``up`` (r, 2) the engine's y points upwards.
    """
    own = np.ascontiguousarray(rods[:, [at.SIN_BANK, at.COS_BANK]]) if up is None else up
    return SliderCrankRecord(rods, pins, own, liners, guidance, np.zeros(ROOM))


_read = record_reader(SliderCrankRecord(*np.zeros((4, 1, 1)), *np.zeros((2, 1))))


@law_kernel
def slider_crank_law(record, action, i, place, velocity, numbers, memory, out):
    """Write force, tangent of a stage and figures of a rod, see :mod:`cranktrain.film.laws.films`. Return 0.

    The torque of the force about the part of the pin's displacement that only a turn adds is in ``out[FRICTION]``.
    """
    own = _read(record)
    rod = own.rods[i]
    found = own.room[OF_ROD:]
    held = rod[at.PIN_PORT] < 0.0
    if held:
        # The one component is the rotation, which the numbers hold as well.
        x0 = own.pins[i, 0]
        y0 = own.pins[i, 1]
        turned = numbers[on.TWIST], numbers[on.TWIST_RATE], numbers[on.TWIST_CHANGE]
        in_space(-turned[0] * y0, turned[0] * x0, -turned[1] * y0, turned[1] * x0, numbers[on.WHIRL], place, velocity)
        accelerate(-turned[1] * y0, turned[1] * x0, -turned[2] * y0, turned[2] * x0, place, numbers)
    x, y, vx, vy, ax, ay, more_x, more_y = pin_motion(own.pins[i], place, velocity, numbers)
    hung = rod[at.MASTER] >= 0.0
    bank = own.rods[int(rod[at.MASTER])] if hung else rod
    cos, sin = cylinder_axes(bank, numbers[on.COS], numbers[on.SIN])
    # Motion of the rod's end across and along its cylinder.
    across, along = cos * x - sin * y, sin * x + cos * y
    across_v, along_v = cos * vx - sin * vy, sin * vx + cos * vy
    across_a, along_a = cos * ax - sin * ay, sin * ax + cos * ay
    if hung:
        end = own.room[OF_END:]
        end[X], end[Y], end[VX], end[VY], end[AX], end[AY] = across, along, across_v, along_v, across_a, along_a
        hang(rod[at.JOINT :], end, own.room[OF_MASTER:])
        across, along, across_v, along_v, across_a, along_a = end[X], end[Y], end[VX], end[VY], end[AX], end[AY]
    end_motion = across, along, across_v, along_v, across_a, along_a
    for k in range(on.ECCENTRICITY):
        out[k] = 0.0
    side, reach = piston_forces(own, i, end_motion, place, velocity, numbers, action, out)
    g_x = numbers[on.GRAVITY] * own.up[i, 0]
    g_y = numbers[on.GRAVITY] * own.up[i, 1]
    m_b = rod[at.M_BIG]
    found[0] -= m_b * (across_a + g_x)
    found[1] -= m_b * (along_a + g_y)
    found[BY_ACCELERATION] -= m_b
    found[BY_ACCELERATION + 3] -= m_b
    tangent = out[on.BY_PLACE :]
    if action == on.OBSERVE:
        out[KNUCKLE] = found[0]
        out[KNUCKLE + 1] = found[1]
    elif numbers[on.FROZEN] != 0.0:
        pass
    elif hung:
        knuckle_tangent(rod[at.JOINT :], own.room[OF_MASTER:], numbers, found, cos, sin, tangent)
    else:
        pin_tangent(
            found,
            numbers[on.RATIO],
            numbers[on.INERTANCE],
            numbers[on.WHIRL],
            numbers[on.WHIRL_CHANGE],
            cos,
            sin,
            tangent,
        )
    if hung:
        found[0], found[1], share = force_on_pin(rod[at.JOINT :], own.room[OF_MASTER:], found)
        if action == on.OBSERVE:
            out[HELD] = share
    if numbers[on.SLOPE] != 0.0 and numbers[on.FROZEN] == 0.0 and action != on.OBSERVE:
        gas_tangent(own, rod, numbers[on.SLOPE], side / reach, (x, y), cos, sin, tangent)
    force_x = cos * found[0] + sin * found[1]
    force_y = cos * found[1] - sin * found[0]
    if action == on.OBSERVE:
        out[ON_PIN] = force_x
        out[ON_PIN + 1] = force_y
    if held:
        out[0] = x * force_y - y * force_x
        if action != on.OBSERVE:
            # The pin moves along its circle, while the force keeps its direction.
            by_x = x * tangent[ROW] - y * tangent[0]
            by_y = x * tangent[ROW + 1] - y * tangent[1]
            tangent[0] = x * by_y - y * by_x - x * force_x - y * force_y
        out[on.FRICTION] = 0.0
        return 0
    out[0] = force_x
    out[1] = force_y
    out[on.FRICTION] = more_x * force_y - more_y * force_x
    return 0


@inlined_kernel
def piston_forces(own, i, end_motion, place, velocity, numbers, action, out):
    """Force of rod i without its big end, into its room, and the forces and figures of its piston, into ``out``.

    ``end_motion`` is the motion of the rod's end across and along its cylinder. Returns the distance (m) of the rod's
    end from the cylinder's axis or its guided piston, and that of the piston's pin above the rod's end.
    """
    rod = own.rods[i]
    across, along, across_v, along_v, across_a, along_a = end_motion
    found = own.room[OF_ROD:]
    guided = rod[at.PISTON_PORT] >= 0.0
    side = across - rod[at.OFFSET]
    rate = across_v
    change = across_a
    gas = numbers[on.PRESSURE] * rod[at.AREA] * rod[at.OWN_ROD]
    g_y = numbers[on.GRAVITY] * own.up[i, 1]
    down = gas
    if guided:
        side -= place[on.INNER]
        rate -= velocity[on.INNER]
        change -= numbers[on.ACCELERATION + 2]
        down = skirt_forces(own, i, (side, rate, along, along_v), place, velocity, numbers, action, out)
    rod_force(
        side + rod[at.OFFSET], along, rate, along_v, change, along_a, down, rod[at.ROD], 0.0, rod[at.M_OSC],
        rod[at.DELTA_J], rod[at.OFFSET], 0.0, g_y, found,
    )  # fmt: skip
    reach = found[PISTON] - along
    # The friction torque of the big end's film on the rod is balanced by forces at the piston's guide and the big end.
    balance = numbers[on.COUPLE] / reach if numbers[on.COUPLE] != 0.0 else 0.0
    if guided:
        weight = found[PISTON_ACCELERATION] + g_y
        out[on.INNER] -= found[0] + balance
        out[on.INNER + 1] += weight * (own.guidance[UNBALANCE] * place[on.INNER + 1] - rod[at.OFFSET] * rod[at.M_SMALL])
        out[on.INNER + 1] -= rod[at.OFFSET] * found[1]
        if action != on.OBSERVE:
            of_rod = found[BY_X] + numbers[on.RATIO] * found[BY_VX] + numbers[on.INERTANCE] * found[BY_ACCELERATION]
            out[on.BY_INNER] += of_rod
    else:
        out[SIDE] = -found[0] - rod[at.M_OSC] * numbers[on.GRAVITY] * own.up[i, 0]
        out[on.GAS_POWER] = -gas * found[PISTON_VELOCITY]
        if action == on.OBSERVE:
            out[RISING] = found[PISTON_VELOCITY]
    found[0] += balance
    out[HEIGHT] = found[PISTON]
    out[SPEED] = found[PISTON_VELOCITY]
    if action == on.OBSERVE:
        swing = rate / reach
        moving = rod[at.M_OSC] * out[SPEED] * out[SPEED] + rod[at.M_BIG] * (across_v * across_v + along_v * along_v)
        out[on.KINETIC] = 0.5 * (moving + rod[at.DELTA_J] * swing * swing)
    return side, reach


@inlined_kernel
def skirt_forces(own, i, end_motion, place, velocity, numbers, action, out):
    """Forces of skirt and liner on guided piston i, and of these on the liner, into ``out``, and their tangents.

    ``end_motion`` is the distance (m) of the rod's end from the piston across the cylinder, its rate, and place and
    rate of the end along the cylinder. Returns the force (N) down the cylinder on the rod, of gas, friction and a
    leaning liner.
    """
    rod = own.rods[i]
    law = own.guidance
    layer = own.room[OF_LAYER:]
    wall = numbers[on.WALL :]
    followed = rod[at.LINER_PORT] >= 0.0
    side, side_rate, along, along_v = end_motion
    gas = numbers[on.PRESSURE] * rod[at.AREA] * rod[at.OWN_ROD]
    lower = own.liners[i, 1]
    length = own.liners[i, 0] - lower
    reach = math.sqrt(rod[at.ROD] * rod[at.ROD] - side * side)
    height = along + reach
    rate = along_v - side * side_rate / reach
    slope = 0.0
    turning = 0.0
    if followed:
        slope = (wall[0] - wall[1]) / length
        turning = (wall[RATES] - wall[RATES + 1]) / length
    pressing = 0.0
    upper = 0.0
    tilting = 0.0
    lost = 0.0
    for k in range(2):
        above = law[LAYER_HEIGHT + k]
        gap = place[on.INNER] - place[on.INNER + 1] * above
        gap_rate = velocity[on.INNER] - velocity[on.INNER + 1] * above
        if followed:
            # Position of the piston along the liner, which has moved itself.
            share = (height + above - wall[RISE] - lower) / length
            gap -= share * wall[0] + (1.0 - share) * wall[1]
            gap_rate -= share * wall[RATES] + (1.0 - share) * wall[RATES + 1]
            gap_rate -= slope * (rate - wall[RATES + RISE])
        layer_force(law, k, gap, gap_rate, layer)
        if k == 0:
            upper = layer[0]
        pressing += layer[0]
        tilting += above * layer[0]
        lost -= layer[0] * gap_rate
        by = layer[1] + numbers[on.RATIO] * layer[2]
        out[on.BY_INNER] += by
        out[on.BY_INNER + 1] -= above * by
        out[on.BY_INNER + ROW] -= above * by
        out[on.BY_INNER + ROW + 1] += above * above * by
    rubbing = liner_friction(law, upper, pressing - upper, rate)
    push = gas - rubbing
    down = push + slope * pressing
    foot = wall[1] - slope * lower if followed else 0.0
    foot_rate = wall[RATES + 1] - turning * lower if followed else 0.0
    rising = rate + slope * (velocity[on.INNER] - foot_rate - turning * height) + turning * (place[on.INNER] - foot)
    across = pressing - slope * push
    out[on.INNER] = across
    out[on.INNER + 1] = -tilting
    out[SIDE] = -pressing
    out[on.GAS_POWER] = -gas * rising
    if followed:
        # Reaction on the block of the forces of liner and gas on the piston, with its moment about the block's axis.
        block_x = wall[AXIS] * rod[at.COS_BANK] + wall[AXIS + 1] * rod[at.SIN_BANK]
        block_y = wall[AXIS + 1] * rod[at.COS_BANK] - wall[AXIS] * rod[at.SIN_BANK]
        moment = (block_x - place[on.INNER]) * down + block_y * across - height * across - tilting
        out[on.FOLLOWED] = (moment + lower * across) / length
        out[on.FOLLOWED + 1] = -across - out[on.FOLLOWED]
        out[on.FOLLOWED + 2] = down - gas
    if action == on.OBSERVE:
        out[RISING] = rising
        out[LATERAL] = place[on.INNER] - foot - slope * height
        out[TILT] = place[on.INNER + 1] + slope
        out[FRICTION_ALONG] = -rubbing
        out[LINER_LOSS] = -rubbing * (rising - wall[RATES + RISE] if followed else rising)
        out[SKIRT_LOSS] = lost
    return down


@inlined_kernel
def knuckle_tangent(joint, pin, numbers, found, cos, sin, tangent):
    """Tangent of an articulated rod's force by the displacement of the crank pin in a stage, in axes of the frame.

    ``found`` is the rod's force on its knuckle pin with its derivatives, ``pin`` the motion of the crank pin in axes of
    the master's cylinder, ``cos`` and ``sin`` those of the frame's angle to it.
    """
    ratio = numbers[on.RATIO]
    omega = numbers[on.WHIRL]
    alpha = numbers[on.INERTANCE] - omega * omega
    beta = 2.0 * omega * ratio + numbers[on.WHIRL_CHANGE]
    for j in range(2):
        x = 1.0 - j
        y = 1.0 * j
        tangent[j], tangent[ROW + j] = force_change(
            joint, pin, found, x, y, ratio * x - omega * y, ratio * y + omega * x, alpha * x - beta * y,
            alpha * y + beta * x,
        )  # fmt: skip
    turn_back(tangent[0], tangent[1], tangent[ROW], tangent[ROW + 1], cos, sin, tangent)


@inlined_kernel
def gas_tangent(own, rod, slope, lean, pin, cos, sin, tangent):
    """Add to a rod's tangent the change of gas force; ``slope`` (Pa/rad) is over the angle of its pin.

    ``lean`` is the tangent of the rod's angle to its cylinder, ``pin`` the place (2) of the pin, m.
    """
    x, y = pin
    push = own.room[OF_LAYER:]
    # Force on the rod's end by unit force on its piston.
    push[0] = lean
    push[1] = -1.0
    push_x = lean
    push_y = -1.0
    if rod[at.MASTER] >= 0.0:
        push_x, push_y, _ = force_on_pin(rod[at.JOINT :], own.room[OF_MASTER:], push)
    gain = slope * rod[at.AREA] * rod[at.OWN_ROD] / (x * x + y * y)
    force_x = gain * (cos * push_x + sin * push_y)
    force_y = gain * (cos * push_y - sin * push_x)
    tangent[0] -= force_x * y
    tangent[1] += force_x * x
    tangent[ROW] -= force_y * y
    tangent[ROW + 1] += force_y * x
