"""Error estimate of a step in the main outputs, and events that a long step would miss.

The estimate is the difference from the integrator's embedded solution. It is taken for the pulley's torsion and axial
motion, over the RMS of their alternating part (averaged with a memory that fades over a cycle), and for each journal
and the thrust collar, over their clearance. A method without an embedded solution cannot adapt its step.
"""

import math

from cranktrain.core.kernel import call_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import collar_port, thrust_row, turning_modes
from cranktrain.dynamics.model.state import OUTPUT_MEAN, OUTPUT_VARIANCE, POSITION, SHAFT_SPEED, offset
from cranktrain.dynamics.motion.gas import trace_angle
from cranktrain.dynamics.time.table import FAMILY, HEAD
from cranktrain.film.laws.films import CLOSES, CONTACT
from cranktrain.film.laws.parameters import CLEARANCE, CONTACT_HEIGHT
from cranktrain.loads.built_in_trace import NO_KINK

LEAST_TORSION, LEAST_AXIAL = 1.0e-6, 1.0e-8
"""Least amplitudes of torsion (rad) and axial motion (m) that errors are compared with."""


@kernel
def step_error(model, work, state, h):
    """Estimated error of the step just taken, in units of the tolerance of adaptive control."""
    family = int(model.stages[HEAD, FAMILY])
    call_kernel(work.family[family, at.DIFFERENCE_KERNEL], (model, work, h))
    worst = 0.0
    for j in range(2):
        change = 0.0
        for i in range(turning_modes(model)):
            change += model.ends[1 + j, i] * work.modal[at.DIFFERENCE, i]
        least = LEAST_TORSION if j == 0 else LEAST_AXIAL
        size = max(least, math.sqrt(max(0.0, state[OUTPUT_VARIANCE + j])))
        worst = max(worst, abs(change) / size)
    for i in range(model.judged.shape[0]):
        k = int(model.judged[i])
        worst = max(worst, abs(work.port[at.U_DIFFERENCE, k]) / model.scales[k])
    return worst / model.choices[at.STEP_TOLERANCE]


@kernel
def remember_outputs(model, state, h):
    """Update running mean and variance of torsion and axial motion after a step h; older values fade over a cycle."""
    q = offset(POSITION, model.omega2.shape[0])
    fading = 1.0 - math.exp(-h * max(abs(state[SHAFT_SPEED]), 1.0) / (4.0 * math.pi))
    for j in range(2):
        value = 0.0
        for i in range(turning_modes(model)):
            value += model.ends[1 + j, i] * state[q + i]
        away = value - state[OUTPUT_MEAN + j]
        state[OUTPUT_MEAN + j] += fading * away
        state[OUTPUT_VARIANCE + j] += fading * ((1.0 - fading) * away * away - state[OUTPUT_VARIANCE + j])


@kernel
def event_within(model, work, state, builtin, angle, turn, h):
    """True if a gas trace kink, contact in a film or a change of side of the thrust collar occurs within a step h.

    The crank turns from ``angle`` by ``turn`` in this time. Ports are in ``work.port[RELATIVE]`` and the row after it.
    """
    if builtin:
        for c in range(model.cylinders.shape[0]):
            place = trace_angle(model, c, angle)
            for k in range(model.kinks.shape[0]):
                if model.kinks[k] == NO_KINK:
                    break
                ahead = model.kinks[k] - place
                ahead -= 4.0 * math.pi * math.floor(ahead / (4.0 * math.pi))
                if 0.0 < ahead < turn:
                    return True
    u = work.port[at.RELATIVE]
    ud = work.port[at.RELATIVE_RATE]
    for i in range(model.bearings.shape[0]):
        law = model.bearings[i]
        port = model.connections[i, at.FIRST]
        x = u[port]
        y = u[port + 1]
        e = math.sqrt(x * x + y * y)
        if e > 0.0 and model.laws.traits[i, CONTACT] > 0.0:
            gap = law[CLEARANCE] - e - law[CONTACT_HEIGHT]
            rate = -(x * ud[port] + y * ud[port + 1]) / e
            if gap * (gap + h * rate) < 0.0:
                return True
    if thrust_row(model) < 0:
        return False
    collar = collar_port(model)
    z = u[collar]
    return model.laws.traits[thrust_row(model), CLOSES] > 0.0 and z * (z + h * ud[collar]) < 0.0
