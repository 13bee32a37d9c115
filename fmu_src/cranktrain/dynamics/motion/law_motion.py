"""Motion that a force law is told, by the shape of its connection, and the call of the law.

A law acts at the Newton ports of its connection, or on components that are sums of terms. Components that form pairs
rotate with the axes of the law: for a journal x and y of its middle, and with tilt those of its end as well; for a
collar its rotations. Velocities in space along these axes are u̇ + Ω e_z×u.

The film of a floating big end acts between pin and rod, which both rotate. Laws with a memory solve their film in axes
of the rod (x across it, y from the big end to the small end, and the angle of a supply counts from x), in which the
bore is at rest. Other laws use axes of the frame. The rod leans by ψ with sin ψ = s/L, where s is the distance of the
big end from the axis of its cylinder, and rotates at ψ̇ = ṡ/(L cos ψ).

A law with masses is told accelerations and the rule of the stage, and its tangent by position is that of the stage.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.crank_pin import accelerate, cylinder_axes, in_space, pin_motion, tell_twist
from cranktrain.dynamics.motion.gas import find_pressure
from cranktrain.dynamics.motion.links import component, frame_turn, sliding_rate
from cranktrain.dynamics.topology import slots as top
from cranktrain.film.laws import films as on
from cranktrain.film.laws.films import film_call


@inlined_kernel
def call_law(model, work, frame, pressures, action, k, memory, out):
    """Call the law of connection k at the motion in rows U, UD, UDD of ``work.port``. Return 0, or a failure status.

    Relative motion and components of terms must be those of this motion.
    """
    tell_law(model, work, frame, pressures, action, k)
    return film_call(model.laws, action, k, memory, out)


@inlined_kernel
def tell_law(model, work, frame, pressures, action, k):
    """Write to ``model.laws`` what the law of connection k is told; ``pressures`` (2c,) as of :func:`find_pressure`."""
    if model.connections[k, at.SHAPE] == at.OF_TERMS:
        tell_link(model, work, frame, pressures, k)
    elif model.laws.traits[k, on.MASS] > 0.0:
        tell_mass(model, work, frame, pressures, action, k)
    elif model.connections[k, at.SHAPE] == at.OF_EYE:
        tell_eye(model, work, frame, k)
    else:
        place_journal(model, k, work.port[at.RELATIVE], work.port[at.RELATIVE_RATE], frame[at.WHIRL])
        tell_journal(model, frame, k, work.port[at.U], work.port[at.UD])


@inlined_kernel
def tell_axes(numbers, angle, cos, sin):
    """Write the angle (rad) of axes that are those of a frame, its cosine and sine to the ``numbers`` of a law."""
    numbers[on.ANGLE] = angle
    numbers[on.COS] = cos
    numbers[on.SIN] = sin
    numbers[on.TURN] = 0.0


@inlined_kernel
def place_journal(model, k, d, dd, whirl):
    """Write displacement and velocity in space of connection k, from relative motion d and ḋ (m,) of the ports."""
    row = model.connections[k]
    place = model.laws.place[k]
    velocity = model.laws.velocity[k]
    size = row[at.COUPLED]
    pairs = row[at.PAIRS]
    if pairs == 0:
        # Without a loop a cycle of the six-cylinder engine at ``impedance`` takes 2 % less.
        i = row[at.FIRST]
        in_space(d[i], d[i + 1], dd[i], dd[i + 1], whirl, place, velocity)
        if size > 2:
            i = row[at.FIRST + 2]
            in_space(d[i], d[i + 1], dd[i], dd[i + 1], whirl, place[2:], velocity[2:])
        return
    for r in range(size if pairs < 0 else pairs):
        port = row[at.FIRST + r]
        place[r] = d[port]
        velocity[r] = dd[port]
    if pairs > 0:
        for r in range(pairs, size, 2):
            i = row[at.FIRST + r]
            in_space(d[i], d[i + 1], dd[i], dd[i + 1], whirl, place[r:], velocity[r:])


@inlined_kernel
def tell_journal(model, frame, k, u, ud):
    """Pass axes and speed to the law of connection k, and the torque of the drive line's springs if it needs it."""
    row = model.connections[k]
    numbers = model.laws.numbers
    tell_axes(numbers, frame[at.THETA], frame[at.COS], frame[at.SIN])
    speed = frame[at.OMEGA]
    if row[at.SPIN] >= 0:
        speed += ud[row[at.SPIN]]
    numbers[on.SPEED] = speed
    numbers[on.RUBBING] = speed
    if row[at.TOLD] >= 0:
        windup = u[row[at.TOLD]] + model.scalars[at.WINDUP_LEAD] * frame[at.LEAD]
        model.laws.place[k, row[at.COUPLED]] = model.scalars[at.WINDUP_K] * windup


@kernel
def tell_eye(model, work, frame, k):
    """Pass the motion of a pin in the eye of its rod, and the axes of the rod, to the film of connection k."""
    row = model.connections[k]
    rod = model.cylinders[row[at.OF_CYLINDER]]
    centre = model.pins[row[at.OF_CYLINDER]]
    numbers = model.laws.numbers
    place = model.laws.place[k]
    velocity = model.laws.velocity[k]
    u = work.port[at.U]
    ud = work.port[at.UD]
    omega = frame[at.OMEGA]
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
    cos, sin = cylinder_axes(rod, frame[at.COS], frame[at.SIN])
    side = cos * x - sin * y - rod[at.OFFSET]
    height = math.sqrt(rod[at.ROD] * rod[at.ROD] - side * side)
    rod_speed = (cos * vx - sin * vy) / height
    lean_sin = side / rod[at.ROD]
    lean_cos = height / rod[at.ROD]
    pin_speed = omega + ud[row[at.SPIN]]
    numbers[on.ANGLE] = frame[at.THETA]
    numbers[on.SPEED] = pin_speed + rod_speed
    numbers[on.RUBBING] = pin_speed - rod_speed
    numbers[on.COS] = cos * lean_cos + sin * lean_sin
    numbers[on.SIN] = sin * lean_cos - cos * lean_sin
    numbers[on.TURN] = rod_speed


@kernel
def tell_mass(model, work, frame, pressures, action, k):
    """Pass the motion of all its ports to the law of connection k, whose first end turns with the crank's frame.

    The gas pressure of its cylinder is found first, but for outputs. In these the law is not told the friction of a
    film on its rod, so that they follow from the state alone.
    """
    row = model.connections[k]
    numbers = model.laws.numbers
    place = model.laws.place[k]
    velocity = model.laws.velocity[k]
    u = work.port[at.U]
    ud = work.port[at.UD]
    udd = work.port[at.UDD]
    tell_axes(numbers, frame[at.THETA], frame[at.COS], frame[at.SIN])
    numbers[on.WHIRL] = frame[at.OMEGA]
    numbers[on.WHIRL_CHANGE] = frame[at.OMEGA_DOT]
    numbers[on.GRAVITY] = model.scalars[at.GRAVITY]
    i = row[at.FIRST]
    if row[at.PAIRS] == 0:
        in_space(u[i], u[i + 1], ud[i], ud[i + 1], numbers[on.WHIRL], place, velocity)
        accelerate(ud[i], ud[i + 1], udd[i], udd[i + 1], place, numbers)
    i = row[at.SPIN]
    if i >= 0:
        tell_twist(u[i], ud[i], udd[i], numbers)
    else:
        tell_twist(0.0, 0.0, 0.0, numbers)
    i = row[at.INNER]
    if i >= 0:
        numbers[on.ACCELERATION + 2] = udd[i]
        for j in range(2):
            place[on.INNER + j] = u[i + j]
            velocity[on.INNER + j] = ud[i + j]
    i = row[at.FOLLOWED]
    if i >= 0:
        for j in range(3):
            numbers[on.WALL + j] = u[i + j]
            numbers[on.WALL + 3 + j] = ud[i + j]
        numbers[on.WALL + 6] = frame[at.BLOCK_X]
        numbers[on.WALL + 7] = frame[at.BLOCK_Y]
    c = row[at.OF_CYLINDER]
    if action != on.OBSERVE:
        find_pressure(model, work, frame, u, pressures, k, False)
    numbers[on.PRESSURE] = pressures[c] - model.scalars[at.CRANKCASE]
    numbers[on.SLOPE] = work.gas[c, at.SLOPE]
    numbers[on.COUPLE] = work.gas[c, at.COUPLE] if action != on.OBSERVE else 0.0


@kernel
def tell_link(model, work, frame, pressures, k):
    """Pass the motion of its components, axes, speeds and inputs to the law of connection k."""
    row = model.connections[k]
    whirl = frame[at.WHIRL]
    omega = frame[at.OMEGA]
    ud = work.port[at.UD]
    gaps = work.links.gaps
    first = row[at.GAP]
    place = model.laws.place[k]
    velocity = model.laws.velocity[k]
    for r in range(row[at.COUPLED]):
        place[r] = gaps[top.D, first + r]
        velocity[r] = gaps[top.DD, first + r]
        if model.links.slides[first + r, top.SLIDING] >= 0.0:
            velocity[r] += whirl * sliding_rate(work, model.links.slides[first + r])
    if row[at.PAIRS] >= 0:
        turning = frame_turn(work, row) * whirl
        for r in range(row[at.PAIRS], row[at.COUPLED] - 1, 2):
            velocity[r] -= turning * place[r + 1]
            velocity[r + 1] += turning * place[r]
    numbers = model.laws.numbers
    frames = work.links.frames
    sense = row[at.AXES_SENSE]
    angle = sense * frames[row[at.AXES], top.TURNED]
    tell_axes(numbers, angle, math.cos(angle), math.sin(angle))
    own = sense * frames[row[at.FRAME_A], top.TURN] * omega
    other = sense * frames[row[at.FRAME_B], top.TURN] * omega
    if row[at.SPIN] >= 0:
        own += row[at.SENSE_A] * ud[row[at.SPIN]]
    if row[at.REACTS] >= 0:
        other += row[at.SENSE_B] * ud[row[at.REACTS]]
    numbers[on.SPEED] = own + other
    numbers[on.RUBBING] = own - other
    if row[at.OF_CYLINDER] >= 0:
        numbers[on.PRESSURE] = pressures[row[at.OF_CYLINDER]] - model.scalars[at.CRANKCASE]
    if row[at.TAKES] >= 0:
        numbers[on.INPUT] = frame[row[at.TAKES]]
    if model.laws.traits[k, on.MASS] > 0.0:
        tell_motion(model, work, frame, k)


@kernel
def tell_motion(model, work, frame, k):
    """Pass the motion of the first end, and gravity, to a law with masses, whose axes are those of that end's frame."""
    row = model.connections[k]
    numbers = model.laws.numbers
    turn = frame_turn(work, row)
    numbers[on.WHIRL] = turn * frame[at.OMEGA]
    numbers[on.WHIRL_CHANGE] = turn * frame[at.OMEGA_DOT]
    numbers[on.GRAVITY] = model.scalars[at.GRAVITY]
    numbers[on.SLOPE] = 0.0
    numbers[on.COUPLE] = 0.0
    first = row[at.GAP]
    udd = work.port[at.UDD]
    place = model.laws.place[k]
    vx, vy = work.links.gaps[top.DD, first], work.links.gaps[top.DD, first + 1]
    in_space(place[0], place[1], vx, vy, numbers[on.WHIRL], place, model.laws.velocity[k])
    accelerate(vx, vy, component(model, work, first, udd), component(model, work, first + 1, udd), place, numbers)
    spin = row[at.SPIN]
    sense = row[at.SENSE_A]
    tell_twist(sense * work.port[at.U, spin], sense * work.port[at.UD, spin], sense * udd[spin], numbers)


@kernel
def line_up_laws(model, work, frame, pressures):
    """Pass the motion of all journals and pins to laws that solve several films together."""
    for k in range(model.connections.shape[0]):
        if model.laws.traits[k, on.TOGETHER] > 0.0 and model.connections[k, at.SHAPE] != at.OF_TERMS:
            call_law(model, work, frame, pressures, on.LINE_UP, k, model.laws.out, model.laws.out)


@inlined_kernel
def ports_of_state(work):
    """Copy the ports' motion at the state to the rows of a stage."""
    for block in range(3):
        for k in range(work.port.shape[1]):
            work.port[at.U + block, k] = work.port[at.STATE_U + block, k]
