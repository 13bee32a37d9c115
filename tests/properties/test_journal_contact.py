"""Contact in a journal bearing: integral of the pressure, tangents, symmetries, friction, and where it begins."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from one_line import one_line
from some import some

from cranktrain.film.contact.asperity import (
    FADING,
    FRICTION,
    HIGHEST,
    LOWEST,
    SHEAR,
    SMOOTH_SPEED,
    contact_constants,
    contact_pressure,
    contact_table,
)
from cranktrain.film.contact.gap import STRAIGHT, relief
from cranktrain.film.contact.journal import N_OUT, journal_contact, journal_contact_data

SIGMA, CLEARANCE, RADIUS, WIDTH = 0.4e-6, 40e-6, 42.5e-3, 30e-3
MU, TAU = 0.1, 2e6
TABLE = contact_table()
SMOOTH = journal_contact_data(RADIUS, CLEARANCE, WIDTH, contact_constants(SIGMA, 0.05, 0.01, 60e9), TABLE)
ROUGH = journal_contact_data(RADIUS, CLEARANCE, WIDTH, contact_constants(SIGMA, 0.05, 0.01, 60e9, MU, TAU), TABLE)
RELIEF, HARDNESS = (6e-6, 0.5, 2.0), 300e6
RUN_IN = journal_contact_data(
    RADIUS, CLEARANCE, WIDTH, contact_constants(SIGMA, 0.05, 0.01, 60e9, MU, TAU, HARDNESS), TABLE, RELIEF
)
TOUCHING = st.floats(0.95, 1.05)
DIRECTION = st.floats(0.0, 6.28)
TILT = st.floats(0.0, 0.5)


def contact(x, y, a=0.0, b=0.0, sliding=0.0, data=SMOOTH):
    """Forces (4,), tangents (4, 4) and the rest; places in units of the clearance."""
    out = np.zeros(N_OUT)
    places = np.array([x, y, a, b]) * CLEARANCE
    journal_contact(*places, float(sliding), data, out)
    return out[:4], out[4:20].reshape(4, 4), out[20:]


def integrated(x, y, a, b, data=SMOOTH, profile=STRAIGHT, around=1440, across=400):
    """Forces (4,) and load by plain quadrature of the contact pressure over the film."""
    zeta, weight = np.polynomial.legendre.leggauss(across)
    phi = 2.0 * np.pi * (np.arange(around) + 0.5) / around
    total = np.zeros(5)
    for z, w in zip(zeta, weight, strict=True):
        gap = CLEARANCE * (1.0 - (x + a * z) * np.cos(phi) - (y + b * z) * np.sin(phi)) + relief(z, profile)
        p = np.array([contact_pressure(h, data.constants, TABLE)[0] if h < 4e-6 else 0.0 for h in gap])
        share = p * w * 0.5 * WIDTH * RADIUS * 2.0 * np.pi / around
        f = -np.array([share @ np.cos(phi), share @ np.sin(phi)])
        total += np.array([*f, *(z * f), share.sum()])
    return total


PLACES = (0.985, 0.0, 0.0, 0.0), (0.6, -0.7, 0.1, 0.02), (1.01, 0.02, 0.0, 0.0), (0.2, 0.1, 0.75, 0.3)
OF_RUN_IN = PLACES[0], (0.8, -0.1, 0.3, 0.02), (0.5, 0.1, 0.64, 0.1)


@pytest.mark.parametrize("shell", ["straight", "relieved, with a lining that yields"])
def test_resultant_is_the_integral_of_the_contact_pressure(shell):
    places, *of, close = (PLACES, SMOOTH, STRAIGHT, 2e-5) if shell == "straight" else (OF_RUN_IN, RUN_IN, RELIEF, 5e-4)
    for place in some(places):
        force, _, rest = contact(*place, data=of[0])
        exact = integrated(*place, *of)
        assert force == pytest.approx(exact[:4], rel=close, abs=close * np.linalg.norm(exact[:4]))
        assert rest[2] == pytest.approx(exact[4], rel=close)


def test_light_contact_does_not_feel_the_hardness():
    elastic = contact_constants(SIGMA, 0.05, 0.01, 60e9)
    hard = contact_constants(SIGMA, 0.05, 0.01, 60e9, hardness=HARDNESS)
    for gap in (3.0 * SIGMA, 1.5 * SIGMA, -2.0 * SIGMA):
        free, limited = (contact_pressure(gap, constants, TABLE)[:2] for constants in (elastic, hard))
        share = (1.0 + (free[0] / HARDNESS) ** 3) ** (-1 / 3)
        assert limited == pytest.approx((free[0] * share, free[1] * share**4), rel=1e-12)
        assert free[0] > 0.2 * HARDNESS or limited[0] > 0.997 * free[0]


@pytest.mark.parametrize("tilt", [0.0, 0.2, 0.5])
def test_no_contact_presses_harder_than_the_lining(tilt):
    """However deep: the pressure stays below the hardness, the force below hardness times projected area, and grows."""
    forces = []
    for eps in np.linspace(0.9, 2.5, 400):
        force, tangent, rest = contact(eps - tilt, 0.0, tilt, 0.0, data=RUN_IN)
        assert rest[4] <= HARDNESS and np.isfinite(tangent).all()
        assert rest[2] <= HARDNESS * 2.0 * np.pi * RADIUS * WIDTH
        forces.append(-force[0])
    assert (np.diff(forces) >= -1e-9 * max(forces)).all()
    assert max(forces) < HARDNESS * 2.0 * RADIUS * WIDTH


@settings(max_examples=60, deadline=None)
@given(TOUCHING, DIRECTION, TILT, DIRECTION, st.sampled_from([-3.0, 0.0, 0.004, 3.0]))
def test_tangents_are_the_derivatives(eps, direction, tilt, way, sliding):
    # Worst end at ``eps``: the middle follows from the tilt.
    end = eps * np.array([math.cos(direction), math.sin(direction)])
    turn = tilt * np.array([math.cos(way), math.sin(way)])
    at = np.array([*(end - turn), *turn])
    step = 1e-6
    for data in (ROUGH, RUN_IN):
        _, tangent, _ = contact(*at, sliding, data)
        for k in range(4):
            plus, minus = at.copy(), at.copy()
            plus[k] += step
            minus[k] -= step
            by = (contact(*plus, sliding, data)[0] - contact(*minus, sliding, data)[0]) / (2.0 * step * CLEARANCE)
            assert tangent[:, k] == pytest.approx(by, rel=1e-5, abs=1e-6 * np.abs(tangent).max() + 1e-3)


def test_nothing_touches_until_the_least_gap_is_as_thin_as_the_roughness():
    first = 1.0 - HIGHEST * SIGMA / CLEARANCE
    assert not contact(0.0, 0.0)[0].any() and not contact(first - 1e-9, 0.0)[1].any()
    forces = np.array([contact(e, 0.0)[0][0] for e in np.linspace(first, 1.2, 400)])
    assert (np.diff(forces) <= 0.0).all() and forces[-1] < -1e6
    # An end of a tilted journal touches alone; a tilt as wide as the clearance touches both ends, on opposite sides.
    force, _, rest = contact(0.5, 0.0, 0.5, 0.0)
    assert force[0] == pytest.approx(force[2], rel=0.03) and force[0] < 0.0 < rest[4]
    both = contact(0.0, 0.0, 1.0, 0.0)[0]
    assert both[0] == pytest.approx(0.0, abs=1e-9 * abs(both[2])) and both[2] < 0.0


@pytest.mark.parametrize("gap_ratio", [HIGHEST, FADING, LOWEST])
def test_force_and_tangent_are_continuous_where_the_law_changes(gap_ratio):
    e = 1.0 - gap_ratio * SIGMA / CLEARANCE
    inside, outside = contact(e + 1e-9, 0.0), contact(e - 1e-9, 0.0)
    assert inside[0] == pytest.approx(outside[0], rel=1e-5, abs=1e-6)
    assert inside[1] == pytest.approx(outside[1], rel=1e-5, abs=1e-9 * np.abs(inside[1]).max() + 1e-3)


def test_boundary_friction_opposes_sliding_smoothly_through_standstill():
    for speed in (1e-3, 0.1, 9.0):
        forward, backward = contact(0.99, 0.0, 0.0, 0.0, speed, ROUGH), contact(0.99, 0.0, 0.0, 0.0, -speed, ROUGH)
        assert forward[2][0] < 0.0 < backward[2][0] and forward[2][0] == pytest.approx(-backward[2][0], rel=1e-12)
        # It holds the journal back across the line of centres: −y where it slides to +y.
        assert forward[0][1] < 0.0 < backward[0][1]
    _, _, rest = contact(0.99, 0.0, 0.0, 0.0, 50.0, ROUGH)
    assert rest[0] == pytest.approx(-RADIUS * (MU * rest[2] + TAU * rest[3]), rel=1e-6)
    assert rest[0] * 50.0 < 0.0
    still = contact(0.99, 0.0, 0.0, 0.0, 0.0, ROUGH)[2]
    assert still[0] == 0.0
    step = 1e-3 * SMOOTH_SPEED
    by = (contact(0.99, 0, 0, 0, step, ROUGH)[2][0] - contact(0.99, 0, 0, 0, -step, ROUGH)[2][0]) / (2 * step)
    assert still[1] == pytest.approx(by, rel=1e-5)
    assert ROUGH.constants[FRICTION] == MU and ROUGH.constants[SHEAR] == TAU


def test_what_cannot_be_is_refused_in_one_line():
    with one_line("roughness -1e-06 must be positive"):
        contact_constants(-1e-6, 0.05, 0.01, 60e9)
    with one_line("boundary friction -0.1 must not be negative"):
        contact_constants(1e-6, 0.05, 0.01, 60e9, -0.1)
    with one_line("clearance 2 um is not wider than 6 times the roughness"):
        journal_contact_data(RADIUS, 2e-6, WIDTH, contact_constants(SIGMA, 0.05, 0.01, 60e9), TABLE)
