"""Initial motion of a run: rotation of a rigid crank on its connecting shaft, and the engine's roll on its mounts.

At constant speed the rods' torque T(θ) drives J φ̈ + c φ̇ + k φ = T − T̄, and the mean T̄ winds up the shaft. The
periodic solution is exact for a rigid crank of constant inertia (rods at their cycle mean). It is near enough to the
real motion to save the run the slow decay of the drive line's own vibration. The torque on the block is −T. The block
rolls on its mounts under the mean and rocks under the alternating part, as a rigid body, with crank and pistons.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.model.layout import (
    block_modes,
    block_port_count,
    crank_modes,
    first_piston,
    joint_row,
    turning_modes,
)
from cranktrain.dynamics.model.records import ModelArrays
from cranktrain.dynamics.model.workspace import start_room
from cranktrain.dynamics.motion.gas import rigid_volume
from cranktrain.dynamics.motion.linear_algebra import factor_lu, solve_lu
from cranktrain.dynamics.tangents import law_in_rotation
from cranktrain.dynamics.topology import slots as top
from cranktrain.film.laws.films import GRAVITY, PRESSURE

ORDERS = 60
"""Number of harmonics (multiples of half an order) in the block's rocking motion at the start."""
RIGID = 6
"""Number of rigid modes of the block."""
STRAIGHT = 5
"""Number of rigid modes of the crank, not counting rotation about its axis."""


class Start(NamedTuple):
    """Mean wind-up of the shaft (rad) and torque (N m), the crank's rotation relative to it (rad) and its rate (rad/s).

    ``inertia`` (kg m²) is that of crank and rods; 0 if the cycle to come is unknown.
    """

    windup: float = 0.0
    torque: float = 0.0
    rotation: float = 0.0
    rate: float = 0.0
    inertia: float = 0.0


def rigid_start(model: ModelArrays, speed: float) -> Start:
    """Start of a rigid crank at θ = 0 of a cycle at ``speed``, rad/s."""
    room = start_room(model)
    rigid_motion(model, room, speed)
    return Start(*map(float, room.mean))


def carried(model: ModelArrays, block: Array) -> Array:
    """Motion of all modes (n,) that follows the block's modal motion (n_b,)."""
    q = np.zeros(model.omega2.size)
    carry(model, start_room(model).joined, np.ascontiguousarray(block, dtype=float), q)
    return q


@kernel
def forget_motion(room):
    """Reset the estimate of the mean motion in the first cycle of a run."""
    for k in range(room.mean.shape[0]):
        room.mean[k] = 0.0
    for k in range(room.spectrum.shape[1]):
        room.spectrum[0, k] = 0.0
        room.spectrum[1, k] = 0.0


@kernel
def rigid_motion(model, room, speed):
    """Fill ``room.mean`` with the start of a rigid crank, and ``room.spectrum`` with its alternating torque.

    The torque is its mean and 2 Re Σ (spectrum[0] + i spectrum[1]) exp(iωt) over harmonics of half the speed.
    """
    forget_motion(room)
    mean = room.mean
    rigid_torque(model, speed, room.numbers, room.law, room.torque)
    samples = room.torque.shape[0]
    total = 0.0
    for i in range(samples):
        total += room.torque[i]
    mean[slots.START_TORQUE] = total / samples
    stiffness = model.scalars[slots.SHAFT_K]
    if stiffness <= 0.0:
        return
    mean[slots.START_WINDUP] = mean[slots.START_TORQUE] / stiffness
    if speed <= 0.0:
        return
    inertia = 1.0 / model.scalars[slots.RIGID_ROTATION] ** 2
    for c in range(model.cylinders.shape[0]):
        x, y = model.pins[c, 0], model.pins[c, 1]
        inertia += (model.cylinders[c, slots.M_BIG] + 0.5 * model.cylinders[c, slots.M_OSC]) * (x * x + y * y)
    for b in range(model.bodies.rows.shape[0]):
        inertia += model.bodies.constants[b, top.REFLECTED]
    mean[slots.START_INERTIA] = inertia
    alternating_torque(room, mean[slots.START_TORQUE])
    for k in range(1, slots.START_HARMONICS):
        omega = 0.5 * speed * k
        # The motion under the torque harmonic T̂ is T̂/(a + ib).
        a = stiffness - inertia * omega * omega
        b = model.scalars[slots.SHAFT_C] * omega
        size = a * a + b * b
        real = (room.spectrum[0, k] * a + room.spectrum[1, k] * b) / size
        imaginary = (room.spectrum[1, k] * a - room.spectrum[0, k] * b) / size
        mean[slots.START_ROTATION] += 2.0 * real
        mean[slots.START_ROTATION_RATE] -= 2.0 * omega * imaginary


@kernel
def alternating_torque(room, mean):
    """Fourier coefficients of the torque minus its ``mean``, N m, by direct sums."""
    samples = room.torque.shape[0]
    for i in range(samples):
        room.circle[0, i] = math.cos(2.0 * math.pi * i / samples)
        room.circle[1, i] = math.sin(2.0 * math.pi * i / samples)
    for k in range(1, slots.START_HARMONICS):
        real = 0.0
        imaginary = 0.0
        at = 0
        for i in range(samples):
            real += (room.torque[i] - mean) * room.circle[0, at]
            imaginary -= (room.torque[i] - mean) * room.circle[1, at]
            at += k
            if at >= samples:
                at -= samples
        room.spectrum[0, k] = real / samples
        room.spectrum[1, k] = imaginary / samples


@kernel
def lean(model, work, speed, place, rate):
    """Modal displacement and velocity (n,) of an engine that rolls and rocks on its mounts, crank at θ = 0.

    They follow from the torque in ``work.start``. Returns 0, or 1 if the mounts do not hold the engine.
    """
    for i in range(model.omega2.shape[0]):
        place[i] = 0.0
        rate[i] = 0.0
    if block_port_count(model) == 0:
        return 0
    room = work.start
    modes = block_modes(model)
    b = model.bearings.shape[0]
    load = room.block[slots.START_LOAD]
    own = room.block[slots.START_PLACE]
    own_rate = room.block[slots.START_RATE]
    for i in range(modes):
        load[i] = 0.0
        for k in range(b):
            bore = model.connections[k, slots.REACTS]
            load[i] -= model.bodies.shapes[bore, i] / b
        own[i] = 0.0
        own_rate[i] = 0.0
    room.spectrum[0, 0] = 0.5 * room.mean[slots.START_TORQUE]
    for k in range(ORDERS + 1):
        if rock(model, room, 0.5 * speed * k, k) != 0:
            return 1
    carry(model, room.joined, own, place)
    carry(model, room.joined, own_rate, rate)
    return 0


@kernel
def rock(model, room, omega, harmonic):
    """Add the block's rigid motion under one harmonic of the torque. Return 0, or 1 if no mount holds the block."""
    load = room.block[slots.START_LOAD]
    own = room.block[slots.START_PLACE]
    own_rate = room.block[slots.START_RATE]
    matrix, motion, pivots = room.matrix, room.vectors[0], room.vectors[1]
    for i in range(RIGID):
        motion[i] = 2.0 * room.spectrum[0, harmonic] * load[i]
        motion[RIGID + i] = 2.0 * room.spectrum[1, harmonic] * load[i]
        for j in range(RIGID):
            matrix[i, j] = matrix[RIGID + i, RIGID + j] = model.block.stiffness[i, j]
            matrix[RIGID + i, j] = omega * model.block.damping[i, j]
            matrix[i, RIGID + j] = -matrix[RIGID + i, j]
        matrix[i, i] -= omega * omega
        matrix[RIGID + i, RIGID + i] -= omega * omega
    if factor_lu(matrix, 2 * RIGID, pivots) != 0:
        return 1
    solve_lu(matrix, 2 * RIGID, pivots, motion)
    for i in range(RIGID):
        own[i] += motion[i]
        own_rate[i] -= omega * motion[RIGID + i]
    return 0


@kernel
def carry(model, joined, block, q):
    """Motion q (n,) of all modes that follows the block's modal motion (n_b,); ``joined`` (rows, 6) is scratch."""
    turning = turning_modes(model)
    modes, shapes = block.shape[0], model.bodies.shapes
    for i in range(q.shape[0]):
        q[i] = 0.0
    if modes == 0:
        return
    for i in range(modes):
        q[turning + i] = block[i]
    # The crank moves with the block as a rigid body that does not rotate, other bodies with their supports. Along its
    # axis the crank is held by the drive line if that has an axial path.
    row = 0
    for part in range(3):
        pairs = model.axial if part == 2 else model.pairs
        for k in range(pairs.shape[0]):
            port = int(pairs[k, 0]) + part % 2
            still = int(pairs[k, 1]) + part % 2
            for i in range(STRAIGHT):
                joined[row, i] = model.bodies.shapes[port, i]
            joined[row, STRAIGHT] = 0.0
            if part < 2 or joint_row(model) < 0:
                for i in range(modes):
                    joined[row, STRAIGHT] += shapes[still, i] * block[i]
            row += 1
    least_squares(joined, q)
    carry_others(model, block, q)
    crank, count = crank_modes(model), model.cylinders.shape[0]
    for c in range(count):
        pin, rod = int(model.cylinders[c, slots.PIN_PORT]), int(model.cylinders[c, slots.END_PORT])
        for k in range(2 if rod >= 0 else 0):
            moved = 0.0
            for i in range(STRAIGHT):
                moved += model.bodies.shapes[pin + k, i] * q[i]
            own = crank + 2 * c + k
            q[own] = moved / model.bodies.shapes[rod + k, own]
    shape = model.block.piston_shape
    determinant = shape[0, 0] * shape[1, 1] - shape[0, 1] * shape[1, 0]
    for c in range(count):
        piston = int(model.cylinders[c, slots.PISTON_PORT])
        if piston < 0:
            continue
        liner = int(model.cylinders[c, slots.LINER_PORT])
        across = 0.0
        for i in range(modes):
            across += 0.5 * (shapes[liner, i] + shapes[liner + 1, i]) * block[i]
        own = turning + modes + piston - first_piston(model)
        q[own] = shape[1, 1] * across / determinant
        q[own + 1] = -shape[1, 0] * across / determinant


@inlined_kernel
def carry_others(model, block, q):
    """Add the motion of added bodies that follows the block's, with their frames at the angles of the start."""
    for b in range(top.OTHERS, model.bodies.rows.shape[0]):
        row = model.bodies.rows[b]
        if row[top.CARRIED] > 0:
            for i in range(row[top.MODES]):
                for k in range(RIGID):
                    share = model.bodies.carried[row[top.OWN_MODE] + i, k]
                    q[row[top.MODE] + i] += share * block[k]


@kernel
def least_squares(rows, x):
    """Least-squares solution ``x`` of ``rows`` (destroyed; last column: right-hand side), by modified Gram-Schmidt.

    The last rows, as many as unknowns, are scratch for the triangular factor.
    """
    unknowns = rows.shape[1] - 1
    count = rows.shape[0] - unknowns
    for j in range(unknowns):
        triangle = rows[count + j]
        size = 0.0
        for r in range(count):
            size += rows[r, j] * rows[r, j]
        size = math.sqrt(size)
        triangle[j] = size
        for r in range(count):
            rows[r, j] /= size
        for k in range(j + 1, unknowns + 1):
            along = 0.0
            for r in range(count):
                along += rows[r, j] * rows[r, k]
            triangle[k] = along
            for r in range(count):
                rows[r, k] -= along * rows[r, j]
    for j in range(unknowns - 1, -1, -1):
        x[j] = rows[count + j, unknowns]
        for k in range(j + 1, unknowns):
            x[j] -= rows[count + j, k] * x[k]
        x[j] /= rows[count + j, j]


@kernel
def rigid_torque(model, speed, numbers, out, torque):
    """Torque of all rods about the axis at uniform angles over a cycle, for a rigid crank at constant speed, N m.

    ``numbers`` (NUMBERS,), zero but for what a law is told here, and ``out`` (SIZE,) are those of force laws.
    """
    count = torque.shape[0]
    numbers[GRAVITY] = model.scalars[slots.GRAVITY]
    for i in range(count):
        theta = 4.0 * math.pi * i / count
        torque[i] = 0.0
        for c in range(model.cylinders.shape[0]):
            k = int(model.cylinders[c, slots.END_ROW])
            law_in_rotation(model, k, theta, speed, numbers, out)
            held = model.connections[k, slots.PAIRS] < 0  # the component of a pin locked on its circle is its rotation
            torque[i] += out[0] if held else model.pins[c, 0] * out[1] - model.pins[c, 1] * out[0]
            if model.cylinders[c, slots.OWN_ROD] == 0.0:
                # Gas winds up the drive line also where an added piston carries it.
                torque[i] += numbers[PRESSURE] * rigid_volume(model, c, theta)[1]
