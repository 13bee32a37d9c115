"""Degree of irregularity of the crank's own speed, (largest − least) / mean over one cycle of the crank.

Extremes are taken at communication points, so that a partner that reads the speed finds the same values. Points 5
degrees apart miss at most 1 − cos(n · 2.5°) of the amplitude of order n: 0.1 % of order 1, 0.9 % of order 3.
"""

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model.state import (
    IRREGULARITY,
    LEAD_ANGLE,
    LEAD_SPEED,
    ROUND_ANGLE,
    ROUND_TIME,
    SHAFT_ANGLE,
    SHAFT_SPEED,
    SPEED_LARGEST,
    SPEED_LEAST,
    TIME,
)
from cranktrain.dynamics.motion.gas import crank_rotation
from cranktrain.loads.gas_pressure import CYCLE

NEARLY = 1.0e-6
"""Fraction by which a cycle may be short and still count as full, because motion does not repeat more exactly."""


@kernel
def follow_speed(model, state):
    """Update the extremes of the crank's speed in the state; at the end of a cycle store its irregularity."""
    rotation, rate, _ = crank_rotation(model, state)
    angle = state[SHAFT_ANGLE] + state[LEAD_ANGLE] + rotation
    speed = state[SHAFT_SPEED] + state[LEAD_SPEED] + rate
    begins = state[SPEED_LARGEST] <= 0.0
    if not begins:
        state[SPEED_LEAST] = min(state[SPEED_LEAST], speed)
        state[SPEED_LARGEST] = max(state[SPEED_LARGEST], speed)
        turned = angle - state[ROUND_ANGLE]
        begins = turned >= CYCLE * (1.0 - NEARLY)
        if begins:
            mean = turned / (state[TIME] - state[ROUND_TIME])
            state[IRREGULARITY] = (state[SPEED_LARGEST] - state[SPEED_LEAST]) / mean
    if begins:
        state[ROUND_ANGLE] = angle
        state[ROUND_TIME] = state[TIME]
        state[SPEED_LEAST] = speed
        state[SPEED_LARGEST] = speed
