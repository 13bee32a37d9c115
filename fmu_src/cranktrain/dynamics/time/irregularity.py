"""Degree of irregularity of the crank's own speed, (largest − least) / mean over one cycle of the crank.

Extremes are taken at communication points, so that a partner that reads the speed finds the same values. Points 5
degrees apart miss at most 1 − cos(n · 2.5°) of the amplitude of order n: 0.1 % of order 1, 0.9 % of order 3.
"""

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model import state as st
from cranktrain.dynamics.motion.gas import crank_rotation
from cranktrain.loads.gas_pressure import CYCLE

NEARLY = 1.0e-6
"""Fraction by which a cycle may be short and still count as full, because motion does not repeat more exactly."""


@kernel
def follow_speed(model, state):
    """Update the extremes of the crank's speed in the state; at the end of a cycle store its irregularity."""
    rotation, rate, _ = crank_rotation(model, state)
    angle = state[st.SHAFT_ANGLE] + state[st.LEAD_ANGLE] + rotation
    speed = state[st.SHAFT_SPEED] + state[st.LEAD_SPEED] + rate
    begins = state[st.SPEED_LARGEST] <= 0.0
    if not begins:
        state[st.SPEED_LEAST] = min(state[st.SPEED_LEAST], speed)
        state[st.SPEED_LARGEST] = max(state[st.SPEED_LARGEST], speed)
        turned = angle - state[st.ROUND_ANGLE]
        begins = turned >= CYCLE * (1.0 - NEARLY)
        if begins:
            mean = turned / (state[st.TIME] - state[st.ROUND_TIME])
            state[st.IRREGULARITY] = (state[st.SPEED_LARGEST] - state[st.SPEED_LEAST]) / mean
    if begins:
        state[st.ROUND_ANGLE] = angle
        state[st.ROUND_TIME] = state[st.TIME]
        state[st.SPEED_LEAST] = speed
        state[st.SPEED_LARGEST] = speed
