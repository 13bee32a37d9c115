"""Films of floating big ends: motion and axes for their force laws, and the actions of a step for laws with a memory.

Pin and rod both rotate. Laws with a memory solve their film in axes of the rod (x across it, y from the big end to the
small end, and the angle of a supply counts from x), in which the bore is at rest. Other laws use axes of the frame. The
rod leans by ψ with sin ψ = s/L, where s is the distance of the big end from the axis of its cylinder, and rotates at
ψ̇ = ṡ/(L cos ψ).
"""

from __future__ import annotations

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.film_ports import ROW, frame_numbers, pairs_block
from cranktrain.dynamics.motion.rod_motion import (
    PIN,
    VX,
    X,
    Y,
    big_end_motion,
    cylinder_axes,
    pin_motion,
    rod_swing,
)
from cranktrain.film.laws.films import (
    CLOSE_STAGE,
    COS,
    FORCE,
    FRICTION,
    LINE_UP,
    MEMORY,
    RUBBING,
    SIN,
    SPEED,
    TOGETHER,
    TURN,
    film_call,
)


@kernel
def big_end_film(model, work, frame, c, cos, sin, ratio):
    """Evaluate the film between pin and free big end of cylinder c, from their motions in scratch.

    Adds its forces to pin, rod and pin rotation, and fills its tangent. Returns the side force on the piston that
    balances its friction torque on the rod, and 0 or the status of a law that failed.
    """
    row = model.cylinders[c]
    rod = work.scratch
    pin = work.scratch[PIN:]
    f = work.port[at.FORCES]
    out = model.laws.out
    turn = int(row[at.PIN_TURN])
    film = int(row[at.PIN_ROW])
    place_pin(model, film, pin, rod)
    height, _ = tell_big_end(model, row, rod, cos, sin, frame[at.OMEGA] + work.port[at.UD, turn])
    status = film_call(model.laws, FORCE, film, out, out)
    frame_again(model, frame)
    friction = out[FRICTION]
    k = int(row[at.PIN_PORT])
    f[k] += out[0]
    f[k + 1] += out[1]
    k = int(row[at.END_PORT])
    f[k] -= out[0]
    f[k + 1] -= out[1]
    moved_x = pin[X] - model.pins[c, 0] - frame[at.CRANK_X]
    moved_y = pin[Y] - model.pins[c, 1] - frame[at.CRANK_Y]
    f[turn] += moved_x * out[1] - moved_y * out[0] + friction
    block = work.blocks[film]
    pairs_block(out, ratio, frame[at.OMEGA], block)
    for r in range(2):
        for s in range(2):
            value = block[ROW * r + s]
            block[ROW * r + s + 2] = -value
            block[ROW * (r + 2) + s] = -value
            block[ROW * (r + 2) + s + 2] = value
    place = model.laws.place[film]
    return -(friction + place[X] * out[1] - place[Y] * out[0]) / height, status


@inlined_kernel
def place_pin(model, film, pin, rod):
    """Write displacement and velocity of a pin in its floating big end to row ``film``, from the motions of both."""
    for k in range(2):
        model.laws.place[film, k] = pin[k] - rod[k]
        model.laws.velocity[film, k] = pin[VX + k] - rod[VX + k]


@inlined_kernel
def tell_big_end(model, row, rod, cos, sin, pin_speed):
    """Pass speeds and rod axes to the law of a floating big end. Return the small end's height (m) and the rod's speed.

    ``cos`` and ``sin`` are those of the frame's angle relative to the cylinder, ``rod`` is the big end's motion; speeds
    in rad/s. :func:`frame_again` restores the axes.
    """
    numbers = model.laws.numbers
    height, rod_speed = rod_swing(row, rod, cos, sin)
    numbers[SPEED] = pin_speed + rod_speed
    numbers[RUBBING] = pin_speed - rod_speed
    turn_to_rod(row, rod, cos, sin, height, numbers)
    numbers[TURN] = rod_speed
    return height, rod_speed


@inlined_kernel
def turn_to_rod(row, rod, cos, sin, height, numbers):
    """Write to ``numbers`` cosine and sine of the frame's angle relative to the rod, from the angle to the cylinder."""
    lean_sin = (cos * rod[X] - sin * rod[Y] - row[at.OFFSET]) / row[at.ROD]
    lean_cos = height / row[at.ROD]
    numbers[COS] = cos * lean_cos + sin * lean_sin
    numbers[SIN] = sin * lean_cos - cos * lean_sin


@inlined_kernel
def frame_again(model, frame):
    """Restore the axes of the crank's frame in the ``numbers`` of the force laws."""
    frame_numbers(frame, model.laws.numbers)
    model.laws.numbers[TURN] = 0.0


@inlined_kernel
def big_end_row(model, c, trait):
    """Row of the big-end film of cylinder c; −1 if the big end does not float or its law lacks the trait."""
    film = int(model.cylinders[c, at.PIN_ROW])
    return film if model.cylinders[c, at.END_PORT] >= 0.0 and model.laws.traits[film, trait] > 0.0 else -1


@kernel
def open_big_end(model, work, cos, sin, whirl, film, c):
    """Pass the motion of a pin at the start of a step to the law of cylinder c; ``cos`` and ``sin`` are the frame's.

    ``whirl`` is the frame's speed then, rad/s. The state's motion is in ``work.port`` from row STATE_U on. The caller
    calls the law.
    """
    u = work.port[at.STATE_U]
    row = model.cylinders[c]
    rod = work.scratch
    pin = work.scratch[PIN:]
    frame = work.frames[0]
    # Displacements and velocities need only the frame's speed; the frame's row holds that of the first stage.
    first_stage = frame[at.OMEGA]
    frame[at.OMEGA] = whirl
    pin_motion(model, frame, c, u, work.port[at.STATE_UD], work.port[at.STATE_UDD], pin)
    big_end_motion(model, frame, c, u, work.port[at.STATE_UD], work.port[at.STATE_UDD], rod)
    place_pin(model, film, pin, rod)
    own_cos = cos * row[at.COS_BANK] + sin * row[at.SIN_BANK]
    own_sin = sin * row[at.COS_BANK] - cos * row[at.SIN_BANK]
    tell_big_end(model, row, rod, own_cos, own_sin, whirl)
    frame[at.OMEGA] = first_stage


@kernel
def act_on_big_ends(model, work, frame, action, trait):
    """Call the laws of floating big ends with a trait at the motion of a stage. Return 0, or a failure status."""
    status = 0
    for c in range(model.cylinders.shape[0]):
        film = big_end_row(model, c, trait)
        if film < 0:
            continue
        rod = work.scratch
        pin = work.scratch[PIN:]
        pin_motion(model, frame, c, work.port[at.U], work.port[at.UD], work.port[at.UDD], pin)
        big_end_motion(model, frame, c, work.port[at.U], work.port[at.UD], work.port[at.UDD], rod)
        place_pin(model, film, pin, rod)
        cos, sin = cylinder_axes(model.cylinders[c], frame)
        pin_speed = frame[at.OMEGA] + work.port[at.UD, int(model.cylinders[c, at.PIN_TURN])]
        tell_big_end(model, model.cylinders[c], rod, cos, sin, pin_speed)
        failure = film_call(model.laws, action, film, model.laws.out, model.laws.out)
        if failure != 0:
            status = failure
    frame_again(model, frame)
    return status


@inlined_kernel
def line_up_big_ends(model, work, frame):
    """Pass the motion of all pins to laws that solve several films together."""
    act_on_big_ends(model, work, frame, LINE_UP, TOGETHER)


@inlined_kernel
def close_big_ends(model, work, frame):
    """Solve films of big ends with a memory at the ports of a stage. Return 0, or a failure status."""
    return act_on_big_ends(model, work, frame, CLOSE_STAGE, MEMORY)
