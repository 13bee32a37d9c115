"""Interpolation of the motion within an internal step, from both ends of the step.

Position, velocity and acceleration of each mode are known at both ends of a step of length h. They determine one
polynomial of degree five. With θ = (t − t₀)/h and D = q₁ − q₀

    q = q₀ + θ h v₀ + ½ θ² h² a₀ + θ³ [(10 − 15θ + 6θ²) (D − h v₀ − ½ h² a₀) − (4 − 7θ + 3θ²) h (v₁ − v₀ − h a₀)
        + ½ (1 − 2θ + θ²) h² (a₁ − a₀)];

velocity and acceleration are its derivatives. Its errors are of order h⁶ in q, h⁵ in v and h⁴ in a for any method,
which is no lower than the order of a method of order five. The frame's motion is that of the stages, which is known
at any time. The memory of a law, as a quantity and its rate, follows a cubic polynomial.

The state keeps both ends after the motion at the communication point: header up to ``METHOD``, then all from ``BODY``
on. The inputs are not kept, because they belong to communication points.

Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed. (1993), section II.6.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import state as st
from cranktrain.dynamics.model.layout import port_count
from cranktrain.dynamics.model.state import end_size, film_offset, offset
from cranktrain.dynamics.motion.film_memory import motion_size
from cranktrain.dynamics.motion.gas import crank_rotation
from cranktrain.dynamics.time.step_control import base_motion
from cranktrain.loads.drive_line import frame_lead

BEGIN, END = 0, 1
"""Numbers that stand for the begin and the end of a step."""


@inlined_kernel
def end_offset(model, end):
    """First index in the state of the stored begin or end of the step under way."""
    size = motion_size(model)
    return size + end * end_size(size)


@kernel
def keep_end(model, state, end):
    """Store the present motion as begin or end of the step under way."""
    o = end_offset(model, end)
    for i in range(st.METHOD):
        state[o + i] = state[i]
    for i in range(motion_size(model) - st.BODY):
        state[o + st.METHOD + i] = state[st.BODY + i]


@kernel
def recall_end(model, state, end):
    """Restore the motion at begin or end of a step to the state; time, inputs and communication data do not change."""
    o = end_offset(model, end)
    for i in range(st.SHAFT_ANGLE, st.LEAD_SPEED + 1):
        state[i] = state[o + i]
    state[st.OMEGA_REFERENCE] = state[o + st.OMEGA_REFERENCE]
    state[st.CONTRACTION] = state[o + st.CONTRACTION]
    state[st.STEP_LAST] = state[o + st.STEP_LAST]
    for i in range(st.HALVINGS, st.METHOD):
        state[i] = state[o + i]
    for i in range(motion_size(model) - st.BODY):
        state[st.BODY + i] = state[o + st.METHOD + i]


@kernel
def interpolate_motion(model, work, state, time, sampled):
    """Set the state to the motion at a ``time`` (s) within the step under way.

    ``work.inputs`` are those of the communication step that began at ``sampled`` (s). Values that only steps read, such
    as the guesses of ports, are those at the step's begin.
    """
    recall_end(model, state, BEGIN)
    h = state[end_offset(model, END) + st.STEP_LAST]
    t = (time - state[st.STEP_BEGIN]) / h
    rotation, rate, change = crank_rotation(model, state)
    lead, lead_rate, _ = frame_lead(
        state[st.LEAD_ANGLE], state[st.LEAD_SPEED], rotation, rate, change, state[st.SHAFT_SPEED], t * h
    )  # fmt: skip
    angle, speed, _, kept = base_motion(model, work, state, state[st.STEP_BEGIN] - sampled, t * h)
    state[st.SHAFT_ANGLE] = angle
    state[st.SHAFT_SPEED] = speed
    state[st.SHAFT_ACCELERATION] = kept
    state[st.LEAD_ANGLE] = lead
    state[st.LEAD_SPEED] = lead_rate
    state[st.GAS_DONE] += t * (state[end_offset(model, END) + st.GAS_DONE] - state[st.GAS_DONE])
    interpolate_modes(model, state, t, h)
    # The memory of force laws is pairs of a quantity and its rate.
    first = film_offset(model.omega2.shape[0], port_count(model))
    far = end_offset(model, END) + st.METHOD - st.BODY
    for k in range(first, motion_size(model), 2):
        rate = h * state[k + 1]
        d = state[far + k] - state[k] - rate
        e = h * state[far + k + 1] - rate
        state[k] += t * (rate + t * (3.0 * d - e + t * (e - 2.0 * d)))
        state[k + 1] = (rate + t * (2.0 * (3.0 * d - e) + 3.0 * t * (e - 2.0 * d))) / h


@kernel
def interpolate_modes(model, state, t, h):
    """Interpolate position, velocity, acceleration of all modes at fraction ``t`` of a step h (s), from its begin."""
    n = model.omega2.shape[0]
    q = offset(st.POSITION, n)
    v = offset(st.VELOCITY, n)
    a = offset(st.ACCELERATION, n)
    far = end_offset(model, END) + st.METHOD - st.BODY
    # Weights of D − h v₀ − ½ h² a₀, h (v₁ − v₀ − h a₀) and h² (a₁ − a₀) in q, in h v and in h² a.
    t2 = t * t
    t3 = t2 * t
    place = t3 * (10.0 - 15.0 * t + 6.0 * t2)
    place_rate = t2 * (30.0 - 60.0 * t + 30.0 * t2)
    place_bend = t * (60.0 - 180.0 * t + 120.0 * t2)
    move = -t3 * (4.0 - 7.0 * t + 3.0 * t2)
    move_rate = -t2 * (12.0 - 28.0 * t + 15.0 * t2)
    move_bend = -t * (24.0 - 84.0 * t + 60.0 * t2)
    push = 0.5 * t3 * (1.0 - 2.0 * t + t2)
    push_rate = 0.5 * t2 * (3.0 - 8.0 * t + 5.0 * t2)
    push_bend = 0.5 * t * (6.0 - 24.0 * t + 20.0 * t2)
    for i in range(n):
        velocity = h * state[v + i]
        swing = h * h * state[a + i]
        d = state[far + q + i] - state[q + i] - velocity - 0.5 * swing
        e = h * state[far + v + i] - velocity - swing
        f = h * h * state[far + a + i] - swing
        state[q + i] += t * velocity + 0.5 * t2 * swing + place * d + move * e + push * f
        state[v + i] = (velocity + t * swing + place_rate * d + move_rate * e + push_rate * f) / h
        state[a + i] = (swing + place_bend * d + move_bend * e + push_bend * f) / (h * h)
