"""The driven end solves its equations: each motion over a step against the matrix exponential of its law."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from cranktrain.loads.drive_line import (
    FOLLOWING,
    KEEPING,
    RECENTRING_REVOLUTIONS,
    following_motion,
    frame_lead,
    shaft_motion,
)

SPEED = 200.0
PER_TAU = SPEED / (2.0 * math.pi * RECENTRING_REVOLUTIONS)  # 1/τ_c
ROTATION = (0.02, -3.0, 500.0)  # φ, φ̇, φ̈ at the start of the step


def chain(size, links):
    """Matrix of ẏ_i = Σ factor y_j for rows of (i, j, factor)."""
    matrix = np.zeros((size, size))
    for i, j, factor in links:
        matrix[i, j] = factor
    return matrix


@pytest.mark.parametrize("t", [1e-4, 3e-3, 0.2])
def test_the_shaft_follows_a_ramp_through_its_filter(t):
    omega, start = 80.0, np.array([0.3, 190.0, 40.0, 205.0, -60.0])  # angle, speed, acceleration, target, rate
    law = [(0, 1, 1.0), (1, 2, 1.0), (2, 3, omega**2), (2, 1, -(omega**2)), (2, 2, -2.0 * omega), (3, 4, 1.0)]
    expected = expm(chain(5, law) * t) @ start
    assert shaft_motion(*start, omega, t) == pytest.approx(expected[:3], rel=1e-11)


def test_without_a_filter_the_shaft_is_where_it_is_told_to_be():
    assert shaft_motion(0.3, 190.0, 40.0, 205.0, -60.0, 0.0, 0.1) == pytest.approx((0.3 + 20.5 - 0.3, 199.0, -60.0))


def errors(found, law, start, rows):
    """Of a motion's results ``rows`` after a step and after half of it, against its law."""
    return [np.abs(np.array(found(t)) - (expm(law * t) @ start)[rows]).max() for t in (2e-3, 1e-3)]


def test_the_lead_recentres_the_crank_as_its_law_says():
    """τ₂ ẇ = φ/τ_c − w with τ_c = 4τ₂ and a quadratic φ; the series ends behind the fourth power of the time."""
    kappa = 4.0 * PER_TAU
    law = chain(5, [(0, 1, 1.0), (1, 1, -kappa), (1, 2, kappa * PER_TAU), (2, 3, 1.0), (3, 4, 1.0)])
    start = np.array([0.01, 0.5, *ROTATION])
    coarse, fine = errors(lambda t: frame_lead(0.01, 0.5, *ROTATION, SPEED, t)[:2], law, start, [0, 1])
    assert fine < 1e-8 * abs(law @ start).max()
    assert coarse > 2.0**4.5 * fine
    rate = frame_lead(0.01, 0.5, *ROTATION, SPEED, 1e-3)[2]
    assert rate == pytest.approx((law @ expm(law * 1e-3) @ start)[1], rel=1e-5)


def test_a_frame_that_follows_a_free_crank_does_so_exactly_for_a_quadratic_rotation():
    """Ω̇ = A + 0.7 φ/τ_c² and Ȧ = 0.15 φ/τ_c³."""
    gain, grow = FOLLOWING * PER_TAU**2, KEEPING * PER_TAU**3
    law = chain(6, [(0, 1, 1.0), (1, 2, 1.0), (1, 3, gain), (2, 3, grow), (3, 4, 1.0), (4, 5, 1.0)])
    start, t = np.array([0.3, SPEED, 25.0, *ROTATION]), 2e-3
    expected = expm(law * t) @ start
    angle, speed, acceleration, kept = following_motion(0.3, SPEED, 25.0, *ROTATION, t)
    assert (angle, speed, kept) == pytest.approx(expected[:3], rel=1e-12)
    assert acceleration == pytest.approx((law @ expected)[1], rel=1e-12)
