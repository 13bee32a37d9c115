"""Contacts that only push, and forces on cam, train and valve at a given position and velocity.

A contact of depth δ has F = k δ (1 + χ δ̇), or 0 if this is not positive; χ is one over the damping velocity. The force
is continuous at first contact, so a second-order method keeps its order. A mass that hits it at v leaves at v':

    χ v − ln(1 + χ v) = −χ v' − ln(1 − χ v').

Source: K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech.
42 (1975) 440, with the exponent 1.
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.cam import cam_lift, wrapped

SLOW = 0.1
"""Speed of the camshaft, rad/s, around which friction reverses its sign smoothly."""


@kernel
def contact(depth, rate, stiffness, damping):
    """Force of a contact, N, and its derivatives by depth and rate; in N m if depth is an angle."""
    share = 1.0 + damping * rate
    if depth <= 0.0 or share <= 0.0:
        return 0.0, 0.0, 0.0
    return stiffness * depth * share, stiffness * share, stiffness * depth * damping


@kernel
def drive_torque(n, lead, rate):
    """Torque of the drive on the camshaft, N m, for a lead of the crank (rad, at the camshaft), and its derivatives."""
    gap = n[at.HALF_GAP]
    if lead > gap:
        return contact(lead - gap, rate, n[at.DRIVE], n[at.DRIVE_DAMPING])
    torque, by_depth, by_rate = contact(-lead - gap, -rate, n[at.DRIVE], n[at.DRIVE_DAMPING])
    return 0.0 - torque, by_depth, by_rate


@kernel
def friction_arm(n, lift, speed):
    """Friction torque over the train's force, m, and its derivatives by the cam's lift and the camshaft's speed."""
    moving = math.sqrt(speed * speed + SLOW * SLOW)
    share, radius = n[at.FRICTION] * n[at.RATIO] / moving, n[at.BASE_RADIUS] + lift
    return share * speed * radius, share * speed, share * (SLOW / moving) ** 2 * radius


@kernel
def follow_cam(cam, row, angle):
    """Write the cam's lift and its two derivatives at a camshaft angle, rad, into the row."""
    lift, slope, curve = cam_lift(cam, wrapped(angle - row[at.R_NOSE]))
    row[at.R_LIFT] = lift
    row[at.R_SLOPE] = slope
    row[at.R_CURVE] = curve


@kernel
def train_force(n, row, speed):
    """Force (N) of the train on the valve at the row's position, with slopes by depth and rate, and z′ and z″."""
    first, second = n[at.RATIO] * row[at.R_SLOPE], n[at.RATIO] * row[at.R_CURVE]
    depth = n[at.RATIO] * row[at.R_LIFT] - n[at.LASH] - row[at.R_X]
    force, by_depth, by_rate = contact(depth, first * speed - row[at.R_V], n[at.STIFFNESS], n[at.DAMPING])
    return force, by_depth, by_rate, first, second


@kernel
def seat_force(n, row):
    """Force of the seat on the valve, N, and its derivatives by depth and rate."""
    return contact(-row[at.R_X], -row[at.R_V], n[at.SEAT], n[at.SEAT_DAMPING])


@kernel
def line_energy(n, mass, row):
    """Energy of a line, J: masses, spring with its modes, train and seat."""
    x, v = row[at.R_X], row[at.R_V]
    energy = 0.5 * mass * v * v + n[at.PRELOAD] * x + 0.5 * n[at.RATE] * x * x
    for k in range(at.MODES):
        w, q = row[at.R_W + k], row[at.R_Q + k]
        energy += 0.5 * n[at.MODAL_MASS] * w * w + n[at.COUPLING + k] * v * w
        energy += 0.5 * n[at.MODAL_STIFFNESS + k] * q * q
    depth = n[at.RATIO] * row[at.R_LIFT] - n[at.LASH] - x
    return energy + 0.5 * n[at.STIFFNESS] * max(depth, 0.0) ** 2 + 0.5 * n[at.SEAT] * max(-x, 0.0) ** 2
