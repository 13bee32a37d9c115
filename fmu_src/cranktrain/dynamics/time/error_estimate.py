"""Error of a step in the outputs that matter, and events at which a long step would miss what happens.

The estimate is the difference from the integrator's embedded solution, or for methods of Newmark's form that from
constant acceleration: of the pulley's torsion and axial motion over the RMS of their alternating part, as a cycle's
exponentially fading memory knows it, and of each journal and the thrust collar over their clearance. A method that has
no estimate cannot adapt its step.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model.slots import TURNING_MODES
from cranktrain.dynamics.model.state import OUTPUT_MEAN, OUTPUT_VARIANCE, POSITION, SHAFT_SPEED, offset
from cranktrain.dynamics.motion.equations import trace_angle
from cranktrain.dynamics.time.integrator_tables import DIRK
from cranktrain.film.laws.films import CLOSES, CONTACT
from cranktrain.film.laws.parameters import CLEARANCE, CONTACT_HEIGHT

LEAST_TORSION, LEAST_AXIAL = 1.0e-6, 1.0e-8
"""Least amplitudes (rad, m) that errors are held against."""


@kernel
def step_error(model, work, state, h):
    """Estimated error of the step just taken, in units of the tolerance ``model.choices[4]``."""
    table = model.stages
    turning = int(model.layout[TURNING_MODES])
    stages = int(table[0, 1])
    newmark = table[0, 0] != DIRK
    worst = 0.0
    for j in range(2):
        change = 0.0
        for i in range(turning):
            move = 0.0
            if newmark:
                move = work.modal[9, i]
            else:
                for s in range(stages):
                    move += h * table[1 + stages, s] * work.stage[s, 1, i]
            change += model.ends[1 + j, i] * move
        least = LEAST_TORSION if j == 0 else LEAST_AXIAL
        size = max(least, math.sqrt(max(0.0, state[OUTPUT_VARIANCE + j])))
        worst = max(worst, abs(change) / size)
    for k in range(2 * model.bearings.shape[0] + 1):
        change = 0.0
        if newmark:
            for i in range(turning):
                change += model.ports[k, i] * work.modal[9, i]
        else:
            for s in range(stages):
                change += h * table[1 + stages, s] * work.known[s, 1, k]
        worst = max(worst, abs(change) / model.scales[k])
    return worst / model.choices[4]


@kernel
def remember_outputs(model, state, h):
    """Let mean and variance of torsion and axial motion follow over a cycle, after a step h."""
    q = offset(POSITION, model.omega2.shape[0])
    fading = 1.0 - math.exp(-h * max(abs(state[SHAFT_SPEED]), 1.0) / (4.0 * math.pi))
    for j in range(2):
        value = 0.0
        for i in range(int(model.layout[TURNING_MODES])):
            value += model.ends[1 + j, i] * state[q + i]
        away = value - state[OUTPUT_MEAN + j]
        state[OUTPUT_MEAN + j] += fading * away
        state[OUTPUT_VARIANCE + j] += fading * ((1.0 - fading) * away * away - state[OUTPUT_VARIANCE + j])


@kernel
def event_within(model, work, state, builtin, angle, turn, h):
    """Whether a kink of the gas trace, a film's contact or the thrust collar's change of side lies ahead within h.

    The frame turns from ``angle`` by ``turn`` meanwhile; ports stand in ``work.port[15:17]``.
    """
    if builtin:
        for c in range(model.cylinders.shape[0]):
            place = trace_angle(model, c, angle)
            for k in range(model.kinks.shape[0]):
                ahead = model.kinks[k] - place
                ahead -= 4.0 * math.pi * math.floor(ahead / (4.0 * math.pi))
                if 0.0 < ahead < turn:
                    return True
    u = work.port[15]
    ud = work.port[16]
    b = model.bearings.shape[0]
    if model.films.traits[CONTACT] > 0.0:
        for i in range(b):
            law = model.bearings[i]
            x = u[2 * i]
            y = u[2 * i + 1]
            e = math.sqrt(x * x + y * y)
            if e > 0.0:
                gap = law[CLEARANCE] - e - law[CONTACT_HEIGHT]
                rate = -(x * ud[2 * i] + y * ud[2 * i + 1]) / e
                if gap * (gap + h * rate) < 0.0:
                    return True
    z = u[2 * b]
    return model.thrust.traits[CLOSES] > 0.0 and z * (z + h * ud[2 * b]) < 0.0
