"""Reconstruction of the inputs over the next communication step from their last samples.

Rule ``hold`` keeps the newest sample, ``linear`` extrapolates in time, ``interpolate`` goes from the last sample but
one to the newest and so is one step late. Rule ``polytropic``, the default, extrapolates cylinder pressures by

    p(θ) = G(θ)/V(θ)ⁿ,  n = 1.33,

where G is the parabola over the crank's angle through the last three samples of p Vⁿ. Compression and expansion leave G
nearly constant, and a burn raises it smoothly. A sample belongs to the angle that its partner gives, apart from whole
cycles. If no angle is given (its input stays 0), the sample belongs to the crank's angle at its communication point, or
``gas_delay`` steps earlier, for masters whose units all step at the same time. If p Vⁿ changes by more than the
fraction JUMP between two samples, it has jumped: G does not extend across the jump, and the pressure is held right
after it. A pressure with two identical samples is held too, because no partner drives it. Speed and torques are
extrapolated linearly.

V and θ belong to the cylinder's own crank pin. A pressure as a function of time (by the other rules, a rate or given
stages) is one at the crank's angle, and is converted to the pin's angle by p Vⁿ as well. A partner that uses deviations
of the volumes also gives the deviation with which a pressure was computed. G is then sampled in the volume of rigid
parts plus this deviation, depends on the crank's angle, and is divided by the actual volume above the piston; pressures
as functions of time are not converted.

If a rate is given with a sample, the input continues from the sample at that rate under every rule.

Samples that lie much closer together than the next step say nothing about it: the newer one replaces the other, and
inputs that would need both are held. A communication step up to :data:`SLIVER` does not count: state and time stay as
they are, so that the next step includes it.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model import state as st
from cranktrain.dynamics.model.layout import block_port_count, turning_modes
from cranktrain.dynamics.model.state import offset
from cranktrain.dynamics.motion.gas import built_in, crank_rotation, gas_volume, knows_volumes
from cranktrain.loads.gas_pressure import CYCLE

POLYTROPIC = 1.33
"""Exponent of compression and expansion with heat to the walls."""
GIVEN = 1.0e-3
"""Difference (Pa) from the start value above which a pressure counts as given; co-simulation masters may round."""
JUMP = 0.5
"""Largest relative change of p Vⁿ between two samples that counts as smooth; a larger one is a jump."""
SHORT = 0.2
"""Least distance of two samples that are extrapolated, as a fraction of the next communication step."""
LEAST_TURN = 1.0e-9
"""Angle between two samples, rad, below which both samples count as one angle."""
SLIVER = 1.0e-9
ROUNDING = 1.0e-15
"""Communication steps up to SLIVER (s) plus ROUNDING times the time are ignored: masters that sum times make them."""


@inlined_kernel
def crank_angle(model, state):
    """Angle of the crank relative to the cylinders at the state, rad, which determines the gas pressure."""
    n = model.omega2.shape[0]
    rotation, _, _ = crank_rotation(model, state)
    angle = state[st.SHAFT_ANGLE] + state[st.LEAD_ANGLE] + rotation
    if block_port_count(model) > 0:
        t = turning_modes(model)
        for i in range(6):
            angle -= model.block.motion[at.ROTATION, i] * state[offset(st.POSITION, n) + t + i]
    return angle


@inlined_kernel
def nearest_turn(angle):
    """Angle (rad) minus the whole number of cycles that brings the angle nearest to 0."""
    return angle - CYCLE * math.floor(angle / CYCLE + 0.5)


@kernel
def take_sample(model, state, inputs, interval):
    """Store the inputs of this communication point, from which a step of ``interval`` (s) begins, as newest sample.

    With an interval of 0 there is no step, so the inputs are held and no sample is kept.
    """
    samples = int(state[st.SAMPLES])
    angle = crank_angle(model, state)
    belongs = angle
    told = inputs[model.cylinders.shape[0] + at.ANGLE_INPUT]
    if told != 0.0:
        state[st.ANGLE_SET] = 1.0
    if state[st.ANGLE_SET] > 0.0:
        belongs += nearest_turn(told - angle)
    elif samples > 0:
        belongs -= model.choices[at.GAS_DELAY] * (angle - state[st.POINT_ANGLE])
    near = samples > 0 and state[st.LAST_INTERVAL] < SHORT * interval
    if near:
        state[st.EARLIER_INTERVAL] += state[st.LAST_INTERVAL]
    else:
        state[st.EARLIER_INTERVAL] = state[st.LAST_INTERVAL]
        for s in range(st.MOST_SAMPLES - 1, 0, -1):
            state[st.SAMPLE_ANGLES + s] = state[st.SAMPLE_ANGLES + s - 1]
            for k in range(inputs.shape[0]):
                state[st.INPUTS_NOW + s * st.MAX_INPUTS + k] = state[st.INPUTS_NOW + (s - 1) * st.MAX_INPUTS + k]
        samples = min(st.MOST_SAMPLES, samples + 1)
    first = model.cylinders.shape[0] + at.DEVIATION_INPUT
    for k in range(inputs.shape[0]):
        state[st.INPUTS_NOW + k] = inputs[k]
        if k >= first and inputs[k] != 0.0:
            state[st.DEVIATIONS_SET] = 1.0
        if 0 < k <= model.cylinders.shape[0] and abs(inputs[k] - at.AMBIENT) > GIVEN:
            state[st.PRESSURES_SET] = 1.0
    state[st.SAMPLE_ANGLES] = belongs
    state[st.POINT_ANGLE] = angle
    state[st.LAST_INTERVAL] = interval
    state[st.SAMPLES] = samples if interval > 0.0 else 0.0


@kernel
def take_rates(state, rates, interval):
    """Store the rates (per second) of the inputs over the next step of ``interval`` (s).

    A rate that is not finite counts as not given. With an interval of 0 there is no step, so the inputs are held.
    """
    for k in range(rates.shape[0]):
        given = interval > 0.0 and math.isfinite(rates[k])
        state[st.INPUT_RATES + k] = rates[k] if given else 0.0
        state[st.RATES_GIVEN + k] = 1.0 if given else 0.0


@kernel
def reconstruct(model, work, state):
    """Fill ``work.inputs`` for the communication step that begins at the newest sample."""
    rule = model.choices[at.RECONSTRUCTION]
    samples = int(state[st.SAMPLES])
    earlier = state[st.EARLIER_INTERVAL]
    interval = state[st.LAST_INTERVAL]
    cylinders = model.cylinders.shape[0]
    work.inputs[at.ANGLES, at.DEVIATIONS] = state[st.DEVIATIONS_SET]
    for k in range(cylinders + at.AXIAL_INPUT + 1):
        now = state[st.INPUTS_NOW + k]
        before = state[st.INPUTS_BEFORE + k] if samples > 1 else now
        work.inputs[at.VALUE, k] = now
        work.inputs[at.RATE, k] = 0.0
        work.inputs[at.BEND, k] = 0.0
        work.inputs[at.EXPONENT, k] = 0.0
        if state[st.RATES_GIVEN + k] > 0.0:
            work.inputs[at.RATE, k] = state[st.INPUT_RATES + k]
        elif rule == 2.0 and interval > 0.0:
            work.inputs[at.VALUE, k] = before
            work.inputs[at.RATE, k] = (now - before) / interval
        elif (rule == 1.0 or (rule == 3.0 and not 0 < k <= cylinders)) and samples > 1 and earlier >= SHORT * interval:
            work.inputs[at.RATE, k] = (now - before) / earlier
    for k in range(1, 1 + cylinders):
        # A pressure with two identical samples is not driven by a co-simulation partner.
        if not knows_volumes(work) and (now_moves(state, k) or state[st.RATES_GIVEN + k] > 0.0):
            work.inputs[at.EXPONENT, k] = -POLYTROPIC
    if rule == 3.0 and not built_in(model, state):
        work.inputs[at.ANGLES, 0] = state[st.SAMPLE_ANGLES]
        work.inputs[at.ANGLES, 1] = state[st.SAMPLE_ANGLES + 1]
        least = max(LEAST_TURN, SHORT * abs(state[st.SHAFT_SPEED]) * interval)
        for c in range(cylinders):
            if state[st.RATES_GIVEN + 1 + c] == 0.0:
                polytropic_series(model, work, state, c, least)


@inlined_kernel
def now_moves(state, k):
    """True if the newest sample of input k differs from the sample before it."""
    return state[st.SAMPLES] > 1.0 and state[st.INPUTS_NOW + k] != state[st.INPUTS_BEFORE + k]


@inlined_kernel
def sampled_polytropic(model, state, cylinder, sample):
    """p Vⁿ of a cylinder at one of the input samples, SI, with the volume that the co-simulation partner used."""
    first = st.INPUTS_NOW + sample * st.MAX_INPUTS
    volume = gas_volume(model, cylinder, state[st.SAMPLE_ANGLES + sample])
    volume += state[first + model.cylinders.shape[0] + at.DEVIATION_INPUT + cylinder]
    return state[first + 1 + cylinder] * volume**POLYTROPIC


@inlined_kernel
def smooth(after, before):
    """True if p Vⁿ changed from ``before`` to ``after`` without a jump."""
    return abs(after - before) <= JUMP * max(after, before)


@inlined_kernel
def polytropic_series(model, work, state, cylinder, least):
    """Set the parabola through samples of a cylinder's p Vⁿ at least ``least`` (rad) apart and without a jump."""
    k = 1 + cylinder
    samples = int(state[st.SAMPLES])
    newest, middle, oldest = state[st.SAMPLE_ANGLES], state[st.SAMPLE_ANGLES + 1], state[st.SAMPLE_ANGLES + 2]
    # Without this condition a pressure that no co-simulation partner drives would vary with the volume.
    if newest - middle < least or not now_moves(state, k):
        return
    g = sampled_polytropic(model, state, cylinder, 0)
    g_before = sampled_polytropic(model, state, cylinder, 1)
    if not smooth(g, g_before):
        return
    work.inputs[at.EXPONENT, k] = POLYTROPIC
    work.inputs[at.VALUE, k] = g
    rate = (g - g_before) / (newest - middle)
    work.inputs[at.RATE, k] = rate
    if samples < 3 or middle - oldest < least:
        return
    g_older = sampled_polytropic(model, state, cylinder, 2)
    if smooth(g_before, g_older):
        work.inputs[at.BEND, k] = (rate - (g_before - g_older) / (middle - oldest)) / (newest - oldest)


@kernel
def take_stage(work, share):
    """Set ``work.inputs``, apart from the speed, to the inputs at the fraction ``share`` of the communication step.

    They lie on the polynomial through all given stages, so at a stage they equal the given values.
    """
    staged = work.staged
    end = 1 + int(staged[0, at.STAGES_GIVEN])
    for i in range(1, end):
        weight = 1.0
        for j in range(1, end):
            if j != i:
                weight *= (share - staged[j, 0]) / (staged[i, 0] - staged[j, 0])
        for k in range(1, work.inputs.shape[1]):
            before = work.inputs[at.VALUE, k] if i > 1 else 0.0
            work.inputs[at.VALUE, k] = before + weight * staged[i, 1 + k]
            work.inputs[at.RATE, k] = 0.0
            work.inputs[at.EXPONENT, k] = 0.0 if knows_volumes(work) else -POLYTROPIC
