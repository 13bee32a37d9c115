"""What the running model shows: the outputs of DESIGN's list, as a flat array in the order of :func:`output_names`.

Forces, moments, places, velocities and angles of bearings are given in axes at rest: x across the engine, y upwards,
angles from x in the crank's sense of rotation. A moment is the true vector about the bearing's middle,
M = (−∫ z dF_y, ∫ z dF_x), on the journal. How velocities and gaps are defined: :mod:`cranktrain.film.laws.gap_motion`.
Films without tilt have no moment, and their least gap is that of the journal's middle. In an elastic bore least film
and gap.angle are the film's own; gap.side and gap.rate stay those of a round bore.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model.slots import (
    AREA,
    BANK,
    CLEARANCE_VOLUME,
    COS,
    DRIVEN,
    LEAD,
    LEAD_RATE,
    MAINS,
    OFFSET,
    OMEGA,
    PISTONS,
    RELATIVE,
    RELATIVE_RATE,
    RIGID_ROTATION,
    ROD,
    RODS,
    SHAFT_C,
    SHAFT_K,
    SIN,
    STATE_U,
    STATE_UD,
    STATE_UDD,
    STROKE_TOP,
    THETA,
    TURNING_MODES,
)
from cranktrain.dynamics.model.state import ITERATIONS, ONLINE_FILMS, POSITION, RESIDUAL, SUBSTEPS, VELOCITY, offset
from cranktrain.dynamics.motion.equations import frame_numbers, place_collar
from cranktrain.dynamics.motion.film_memory import memory_offset, place_film
from cranktrain.dynamics.motion.rods import big_end_motion, pin_motion
from cranktrain.dynamics.outputs.big_ends import BIG_END, BIG_END_OUTPUTS, observe_big_end
from cranktrain.dynamics.outputs.whole_engine import WHOLE, engine_output_names, observe_engine
from cranktrain.dynamics.time.status import OK
from cranktrain.dynamics.time.step_control import advance, frame_at, ports_at_state
from cranktrain.film.laws.films import (
    ECCENTRICITY,
    END_Y,
    FLOW,
    FRICTION,
    GAP,
    GAP_ANGLE,
    OBSERVE,
    P_MAX,
    RUBBING,
    SPEED,
    film_call,
)
from cranktrain.film.laws.gap_motion import (
    LEAST_ANGLE,
    LEAST_GAP,
    LEAST_RATE,
    LEAST_SIDE,
    SPEED_EFFECTIVE,
    SPEED_GAP,
    SPEED_RELATIVE,
    VELOCITY_EFFECTIVE,
    gap_motion,
)
from cranktrain.film.laws.parameters import CLEARANCE, WIDTH

GENERAL = ("crank.angle", "crank.speed", "pulley.torsion", "pulley.axial", "flywheel.torsion", "shaft.torque")
BEARING = (
    "force.x",
    "force.y",
    "eccentricity",
    "film_thickness_min",
    "pressure_max",
    "friction_torque",
    "oil_flow",
    "tilt",
    "moment.x",
    "moment.y",
    "position.x",
    "position.y",
    "velocity.x",
    "velocity.y",
    "velocity.effective",
    "speed.relative",
    "speed.gap",
    "speed.effective",
    "gap.angle",
    "gap.side",
    "gap.rate",
)
BEARING_OUTPUTS = len(BEARING)
MOMENT, PLACE, ANGLE = BEARING.index("moment.x"), BEARING.index("position.x"), BEARING.index("gap.angle")
MOTION = 48
"""Where in the scratch memory the kinematics of a gap lie, clear of films' results."""
END = ("solver.residual", "solver.substeps", "solver.iterations", "solver.online_films")


def output_names(bearings: int, cylinders: int, mounts: int) -> tuple[str, ...]:
    """Names of the outputs, in order; the FMU's variables carry the same names.

    The FMU's description is fixed before any level is chosen: names do not depend on levels, what a level lacks is 0.
    """
    return (
        GENERAL
        + tuple(f"bearing[{i + 1}].{name}" for i in range(bearings) for name in BEARING)
        + ("thrust.force", "thrust.displacement")
        + tuple(f"cylinder[{i + 1}].{name}" for i in range(cylinders) for name in ("volume", "piston_position"))
        + tuple(f"big_end[{i + 1}].{name}" for i in range(cylinders) for name in BIG_END)
        + engine_output_names(cylinders, mounts)
        + END
    )


@kernel
def observe(model, work, state, out):
    """Fill the outputs from the state alone, so that a restored state shows what the original did."""
    n = model.omega2.shape[0]
    m = model.ports.shape[0]
    t = int(model.layout[TURNING_MODES])
    b = model.bearings.shape[0]
    frame = work.frames[0]
    frame_at(model, work, state, 0.0, 0.0, frame, work.pressures[0])
    ports_at_state(model, work, state)
    u = work.port[STATE_U]
    ud = work.port[STATE_UD]
    d = work.port[RELATIVE]
    dd = work.port[RELATIVE_RATE]
    q = state[offset(POSITION, n) : offset(POSITION, n) + t]
    v = state[offset(VELOCITY, n) : offset(VELOCITY, n) + t]
    flywheel = 0.0
    twist = model.scalars[DRIVEN] * frame[LEAD]
    twist_rate = model.scalars[DRIVEN] * frame[LEAD_RATE]
    pulley = 0.0
    axial = 0.0
    for i in range(t):
        flywheel += model.ends[0, i] * q[i]
        twist += model.shaft[i] * q[i]
        twist_rate += model.shaft[i] * v[i]
        pulley += model.ends[1, i] * q[i]
        axial += model.ends[2, i] * q[i]
    out[0] = frame[THETA]
    out[1] = frame[OMEGA]
    if model.scalars[DRIVEN] == 0.0:
        # A free crank is where it is, not where the frame that follows it has come to.
        out[0] += model.scalars[RIGID_ROTATION] * q[5]
        out[1] += model.scalars[RIGID_ROTATION] * v[5]
    out[2] = pulley
    out[3] = axial
    out[4] = flywheel
    out[5] = model.scalars[SHAFT_K] * twist + model.scalars[SHAFT_C] * twist_rate
    k = 6
    journal = m - b
    free = model.layout[RODS] > 0.0
    cos = frame[COS]
    sin = frame[SIN]
    omega = frame[OMEGA]
    r = work.scratch
    films = model.films
    frame_numbers(frame, films.numbers)
    for i in range(b):
        law = model.bearings[i]
        speed = omega + ud[journal + i]
        film = films.out
        place_film(model, d, dd, omega, i)
        films.numbers[SPEED] = speed
        films.numbers[RUBBING] = speed
        film_call(films, OBSERVE, i, state[memory_offset(model, i) : memory_offset(model, i + 1)], film)
        # A sum with 0: of a law without tilt 0 is shown, not −0.
        arm = 0.5 * law[WIDTH]
        out[k + MOMENT] = 0.0 - arm * (sin * film[2] + cos * film[END_Y])
        out[k + MOMENT + 1] = 0.0 + arm * (cos * film[2] - sin * film[END_Y])
        out[k] = cos * film[0] - sin * film[1]
        out[k + 1] = sin * film[0] + cos * film[1]
        out[k + 2] = film[ECCENTRICITY]
        motion = r[MOTION:]
        observe_gap(films.place[i], films.velocity[i], cos, sin, law[CLEARANCE], speed, motion, out, k + PLACE)
        out[k + 3] = max(motion[LEAST_GAP], 0.0)
        if film[GAP] >= 0.0:
            out[k + 3] = film[GAP]
            out[k + ANGLE] = math.atan2(math.sin(film[GAP_ANGLE]), math.cos(film[GAP_ANGLE]))
        out[k + 4] = film[P_MAX]
        out[k + 5] = -film[FRICTION]
        out[k + 6] = film[FLOW]
        tilt_x = 0.0
        tilt_y = 0.0
        for j in range(t):
            tilt_x += model.tilts[2 * i, j] * q[j]
            tilt_y += model.tilts[2 * i + 1, j] * q[j]
        out[k + 7] = math.sqrt(tilt_x * tilt_x + tilt_y * tilt_y)
        k += BEARING_OUTPUTS
    for _ in range(BEARING_OUTPUTS * (int(model.layout[MAINS]) - b)):
        out[k] = 0.0
        k += 1
    place_collar(model, frame, d, dd)
    film_call(model.thrust, OBSERVE, 0, model.thrust.out, model.thrust.out)
    out[k] = model.thrust.out[0]
    out[k + 1] = d[2 * b]
    k += 2
    for c in range(model.cylinders.shape[0]):
        rod = model.cylinders[c]
        if free:
            port = int(model.layout[RODS]) + 2 * c
            big_end_motion(model, frame, c, port, u, ud, work.port[STATE_UDD], r)
        else:
            pin_motion(model, frame, c, u, ud, work.port[STATE_UDD], r)
        turn_cos = math.cos(frame[THETA] - rod[BANK])
        turn_sin = math.sin(frame[THETA] - rod[BANK])
        side = turn_cos * r[0] - turn_sin * r[1] - rod[OFFSET]
        if model.layout[PISTONS] > 0.0:
            side -= u[int(model.layout[PISTONS]) + 2 * c]
        position = turn_sin * r[0] + turn_cos * r[1] + math.sqrt(rod[ROD] * rod[ROD] - side * side)
        out[k] = rod[CLEARANCE_VOLUME] + rod[AREA] * (rod[STROKE_TOP] - position)
        out[k + 1] = rod[STROKE_TOP] - position
        k += 2
    for c in range(model.cylinders.shape[0]):
        observe_big_end(model, work, frame, c, u, ud, out, k)
        k += BIG_END_OUTPUTS
    mounts = (out.shape[0] - k - len(END) - len(WHOLE) - 4 * model.cylinders.shape[0]) // 6
    k = observe_engine(model, work, state, frame, u, ud, mounts, out, k)
    out[k] = state[RESIDUAL]
    out[k + 1] = state[SUBSTEPS]
    out[k + 2] = state[ITERATIONS]
    out[k + 3] = state[ONLINE_FILMS]


@kernel
def observe_gap(place, velocity, cos, sin, clearance, speed, motion, out, k):
    """Write position to gap.rate of a journal from k on; ``place`` and ``velocity`` (4,) are in axes of the frame."""
    x = cos * place[0] - sin * place[1]
    y = sin * place[0] + cos * place[1]
    vx = cos * velocity[0] - sin * velocity[1]
    vy = sin * velocity[0] + cos * velocity[1]
    gap_motion(
        x, y, cos * place[2] - sin * place[3], sin * place[2] + cos * place[3],
        vx, vy, cos * velocity[2] - sin * velocity[3], sin * velocity[2] + cos * velocity[3],
        clearance, speed, 0.0, motion,
    )  # fmt: skip
    out[k] = x
    out[k + 1] = y
    out[k + 2] = vx
    out[k + 3] = vy
    out[k + 4] = motion[VELOCITY_EFFECTIVE]
    out[k + 5] = motion[SPEED_RELATIVE]
    out[k + 6] = motion[SPEED_GAP]
    out[k + 7] = motion[SPEED_EFFECTIVE]
    out[k + 8] = motion[LEAST_ANGLE]
    out[k + 9] = motion[LEAST_SIDE]
    out[k + 10] = motion[LEAST_RATE]


@kernel
def advance_and_observe(model, work, state, inputs, t_end, out):
    """One communication step and its outputs in one call: each call from Python costs as much as a film."""
    status = advance(model, work, state, inputs, t_end)
    if status == OK:
        observe(model, work, state, out)
    return status


@kernel
def advance_series(model, work, state, inputs, step, first, series, out):
    """Communication steps to (first + k) step for each row k of ``series``, which keeps their outputs.

    Returns how many succeeded; what ends it early is tried again by the caller, who then knows why.
    """
    for k in range(series.shape[0]):
        if advance_and_observe(model, work, state, inputs, (first + k) * step, out) != OK:
            return k
        for j in range(out.shape[0]):
            series[k, j] = out[j]
    return series.shape[0]
