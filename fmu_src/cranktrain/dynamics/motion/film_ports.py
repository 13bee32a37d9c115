"""Force laws at the ports of a stage: input motion of a law, its forces, and its tangents by motion of the ports.

A law acts at the Newton ports of its connection. Components that form pairs rotate with the frame's axes: for a journal
x and y of its middle, and with tilt those of its end as well; for a collar its rotations. In a stage u̇ changes by
(c_v/c_q) times the change of u, and velocities in space along the frame's axes are u̇ + Ω e_z×u. So a law's tangents by
displacement and by velocity make one block.

The film of a floating big end acts between pin and rod, which both rotate. Laws with a memory solve their film in axes
of the rod (x across it, y from the big end to the small end, and the angle of a supply counts from x), in which the
bore is at rest. Other laws use axes of the frame. The rod leans by ψ with sin ψ = s/L, where s is the distance of the
big end from the axis of its cylinder, and rotates at ψ̇ = ṡ/(L cos ψ).
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.crank_pin import cylinder_axes, in_space, pin_motion, tell_twist
from cranktrain.film.laws import films as on
from cranktrain.film.laws.films import film_call

ROW = 4
"""Values in a row of a law's tangents, and of a connection's block."""


@inlined_kernel
def frame_numbers(frame, numbers):
    """Write the frame's angle into the ``numbers`` of laws."""
    numbers[on.COS] = frame[at.COS]
    numbers[on.SIN] = frame[at.SIN]
    numbers[on.ANGLE] = frame[at.THETA]


@inlined_kernel
def place_law(model, k, u, ud, whirl):
    """Write displacement and velocity in space of connection k, along the frame's axes, to ``model.laws``."""
    row = model.connections[k]
    place = model.laws.place[k]
    velocity = model.laws.velocity[k]
    size = row[at.COUPLED]
    pairs = row[at.PAIRS]
    for r in range(size if pairs < 0 else pairs):
        port = row[at.FIRST + r]
        place[r] = u[port]
        velocity[r] = ud[port]
    if pairs >= 0:
        for r in range(pairs, size, 2):
            i = row[at.FIRST + r]
            in_space(u[i], u[i + 1], ud[i], ud[i + 1], whirl, place[r:], velocity[r:])


@inlined_kernel
def tell_law(model, frame, k, u, ud):
    """Pass the speed to the law of connection k, and the torque of the drive line's springs if that law needs it."""
    row = model.connections[k]
    speed = frame[at.OMEGA]
    if row[at.SPIN] >= 0:
        speed += ud[row[at.SPIN]]
    model.laws.numbers[on.SPEED] = speed
    model.laws.numbers[on.RUBBING] = speed
    if row[at.TOLD] >= 0:
        windup = u[row[at.TOLD]] + model.scalars[at.WINDUP_LEAD] * frame[at.LEAD]
        model.laws.place[k, row[at.COUPLED]] = model.scalars[at.WINDUP_K] * windup


@kernel
def place_eye(model, k, u, ud, omega, pin_speed):
    """Write displacement and velocity in space of a pin in the eye of its rod, connection k, to ``model.laws``.

    Sets speeds and axes of the rod in the ``numbers``, which must hold the frame's axes; :func:`frame_again` restores
    these. u and ud (m,) are the ports' motion, ``omega`` is the speed of the frame and ``pin_speed`` of the pin, rad/s.
    Returns the speed of the rod, rad/s.
    """
    row = model.connections[k]
    rod = model.cylinders[row[at.OF_CYLINDER]]
    centre = model.pins[row[at.OF_CYLINDER]]
    numbers = model.laws.numbers
    place = model.laws.place[k]
    velocity = model.laws.velocity[k]
    numbers[on.WHIRL] = omega
    numbers[on.WHIRL_CHANGE] = 0.0
    tell_twist(u[row[at.SPIN]], ud[row[at.SPIN]], 0.0, numbers)
    i = row[at.FIRST]
    in_space(u[i], u[i + 1], ud[i], ud[i + 1], omega, place, velocity)
    pin_x, pin_y, pin_vx, pin_vy, _, _, _, _ = pin_motion(centre, place, velocity, numbers)
    i = row[at.FIRST + 2]
    in_space(u[i], u[i + 1], ud[i], ud[i + 1], omega, place, velocity)
    x = centre[0] + place[0]
    y = centre[1] + place[1]
    vx = velocity[0] - omega * centre[1]
    vy = velocity[1] + omega * centre[0]
    place[0] = pin_x - x
    place[1] = pin_y - y
    velocity[0] = pin_vx - vx
    velocity[1] = pin_vy - vy
    cos, sin = cylinder_axes(rod, numbers[on.COS], numbers[on.SIN])
    side = cos * x - sin * y - rod[at.OFFSET]
    height = math.sqrt(rod[at.ROD] * rod[at.ROD] - side * side)
    rod_speed = (cos * vx - sin * vy) / height
    lean_sin = side / rod[at.ROD]
    lean_cos = height / rod[at.ROD]
    numbers[on.SPEED] = pin_speed + rod_speed
    numbers[on.RUBBING] = pin_speed - rod_speed
    numbers[on.COS] = cos * lean_cos + sin * lean_sin
    numbers[on.SIN] = sin * lean_cos - cos * lean_sin
    numbers[on.TURN] = rod_speed
    return rod_speed


@inlined_kernel
def frame_again(numbers, cos, sin):
    """Restore the axes of the crank's frame in the ``numbers`` of the force laws."""
    numbers[on.COS] = cos
    numbers[on.SIN] = sin
    numbers[on.TURN] = 0.0


@inlined_kernel
def call_at_ports(model, work, frame, action, k, memory, out):
    """Call the law of connection k, at ports or in an eye, at the motion of a stage. Return 0, or a failure status."""
    u = work.port[at.U]
    ud = work.port[at.UD]
    if model.connections[k, at.SHAPE] == at.OF_EYE:
        place_eye(model, k, u, ud, frame[at.OMEGA], frame[at.OMEGA] + ud[model.connections[k, at.SPIN]])
        status = film_call(model.laws, action, k, memory, out)
        frame_again(model.laws.numbers, frame[at.COS], frame[at.SIN])
        return status
    place_law(model, k, work.port[at.RELATIVE], work.port[at.RELATIVE_RATE], frame[at.WHIRL])
    tell_law(model, frame, k, u, ud)
    return film_call(model.laws, action, k, memory, out)


@kernel
def line_up_laws(model, work, frame):
    """Pass the motion of all journals and pins to laws that solve several films together."""
    for k in range(model.connections.shape[0]):
        if model.laws.traits[k, on.TOGETHER] > 0.0 and model.connections[k, at.SHAPE] != at.OF_TERMS:
            call_at_ports(model, work, frame, on.LINE_UP, k, model.laws.out, model.laws.out)


@inlined_kernel
def hand_forces(row, frame, out, u, f):
    """Add forces ``out`` of a law to those at the ports f (m,) of its connection, and the moments of these forces.

    u (m,) are the displacements of the ports. Moments are about the crank's axis.
    """
    size = row[at.COUPLED]
    pairs = row[at.PAIRS]
    for r in range(size if pairs < 0 else pairs):
        f[row[at.FIRST + r]] += out[r]
    if pairs < 0:
        return
    torque = 0.0
    x = frame[at.CRANK_X] if pairs == 0 else 0.0
    y = frame[at.CRANK_Y] if pairs == 0 else 0.0
    for r in range(pairs, size, 2):
        torque = hand_pair(row[at.FIRST + r], x, y, out[r:], u, f, torque)
        x = 0.0
        y = 0.0
    if row[at.SPIN] >= 0:
        torque += out[on.FRICTION]
    f[row[at.TURNED]] += torque


@inlined_kernel
def hand_pair(port, x, y, out, u, f, torque):
    """Add a pair of forces to those at ``port`` and the next one. Return ``torque`` plus its moment about (x, y)."""
    f[port] += out[0]
    f[port + 1] += out[1]
    return torque + (u[port] - x) * out[1] - (u[port + 1] - y) * out[0]


@inlined_kernel
def law_block(out, size, pairs, ratio, whirl, block):
    """Tangent of a law's ``size`` forces by the displacement of its ports into the 4 × 4 ``block``.

    ``pairs`` is the first component of those that rotate with the law's axes, at ``whirl`` (rad/s), or −1.
    """
    for r in range(size):
        for s in range(size):
            i = ROW * r + s
            block[i] = out[on.BY_PLACE + i] + ratio * out[on.BY_VELOCITY + i]
        if pairs >= 0:
            for s in range(pairs, size, 2):
                i = ROW * r + s
                block[i] += whirl * out[on.BY_VELOCITY + i + 1]
                block[i + 1] -= whirl * out[on.BY_VELOCITY + i]


@inlined_kernel
def pairs_block(out, ratio, whirl, block):
    """Tangent block of a law with pairs of components only; values of a missing second pair are zero."""
    for r in range(ROW):
        for s in range(0, ROW, 2):
            i = ROW * r + s
            x = out[on.BY_VELOCITY + i]
            y = out[on.BY_VELOCITY + i + 1]
            block[i] = out[on.BY_PLACE + i] + ratio * x + whirl * y
            block[i + 1] = out[on.BY_PLACE + i + 1] + ratio * y - whirl * x
