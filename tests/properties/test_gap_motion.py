"""Kinematics of the gap: against brute force, numerical derivatives and the film that they drive."""

import math

import numpy as np
import pytest
from some import some

from cranktrain.film.contact.gap import STRAIGHT, relief
from cranktrain.film.laws.gap_motion import (
    LEAST_ANGLE,
    LEAST_GAP,
    LEAST_RATE,
    LEAST_SIDE,
    SIZE,
    SPEED_EFFECTIVE,
    SPEED_GAP,
    SPEED_RELATIVE,
    VELOCITY_EFFECTIVE,
    gap_motion,
)

C = 40e-6


def motion(place, velocity, journal=0.0, bore=0.0, profile=STRAIGHT):
    out = np.full(SIZE, np.nan)
    gap_motion(*place, *velocity, (C, profile), journal, bore, out)
    return out


def random_states(count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        place = C * rng.uniform(-0.5, 0.5, 4)
        yield place, C * rng.uniform(-300.0, 300.0, 4), *rng.uniform(-300.0, 300.0, 2)


def film(place, phi, zeta):
    x, y, a, b = place
    return C - (x + zeta * a) * np.cos(phi) - (y + zeta * b) * np.sin(phi)


def test_least_gap_is_the_smallest_of_the_whole_film():
    phi = np.linspace(-np.pi, np.pi, 7201)[:, None]
    zeta = np.linspace(-1.0, 1.0, 41)[None, :]
    for place, velocity, *speeds in some(random_states(50, 1)):
        out = motion(place, velocity, *speeds)
        h = film(place, phi, zeta)
        i, j = np.unravel_index(h.argmin(), h.shape)
        # h is quadratic round its minimum: half a grid step off costs at most this.
        assert 0.0 <= h[i, j] - out[LEAST_GAP] <= 1.5 * C * (0.5 * (phi[1, 0] - phi[0, 0])) ** 2
        assert math.remainder(out[LEAST_ANGLE] - phi[i, 0], 2 * np.pi) == pytest.approx(0.0, abs=1e-3)
        assert out[LEAST_SIDE] == zeta[0, j]
        assert film(place, out[LEAST_ANGLE], out[LEAST_SIDE]) == pytest.approx(out[LEAST_GAP], rel=1e-12, abs=1e-18)


@pytest.mark.parametrize("profile", [(6e-6, 0.5, 2.0), (10e-6, 1.0, 3.0), (3e-6, 0.2, 1.0)])
def test_least_gap_of_a_relieved_shell(profile):
    zeta = np.linspace(-1.0, 1.0, 20001)
    g = np.array([relief(z, profile) for z in zeta])
    assert g.max() == pytest.approx(profile[0]) and g[zeta.size // 2] == 0.0
    inside = 0
    for place, velocity, *speeds in random_states(50, 7):
        out = motion(place, velocity, *speeds, profile=profile)
        x, y, a, b = place
        h = C + g - np.hypot(x + zeta * a, y + zeta * b)
        assert -1e-18 <= h.min() - out[LEAST_GAP] < 1e-4 * profile[0]
        assert out[LEAST_SIDE] == pytest.approx(zeta[h.argmin()], abs=0.01)
        inside += abs(out[LEAST_SIDE]) < 0.999
        after, before = (motion(place + s * 1e-8 * velocity, velocity, profile=profile) for s in (1.0, -1.0))
        if abs(after[LEAST_SIDE] - before[LEAST_SIDE]) < 0.1:
            rate = (after[LEAST_GAP] - before[LEAST_GAP]) / 2e-8
            assert rate == pytest.approx(out[LEAST_RATE], abs=1e-3 * np.abs(velocity).max())
    assert inside > 0


def test_effective_velocity_is_made_of_radial_motion_and_effective_speed():
    for place, velocity, *speeds in some(random_states(50, 3)):
        out = motion(place, velocity, *speeds)
        e = math.hypot(*place[:2])
        radial = (place[0] * velocity[0] + place[1] * velocity[1]) / e
        assert out[VELOCITY_EFFECTIVE] == pytest.approx(math.hypot(radial, 0.5 * e * out[SPEED_EFFECTIVE]), rel=1e-12)
        assert out[SPEED_RELATIVE] == speeds[0] - speeds[1]


@pytest.mark.parametrize("speeds", [(200.0, 0.0), (120.0, 80.0), (-50.0, 250.0)])
def test_half_speed_whirl_has_no_effective_speed_and_one_in_place_is_squeezed_at_half_its_speed(speeds):
    out = motion(np.array([0.3, -0.4, 0.0, 0.0]) * C, np.zeros(4), *speeds)
    assert (out[SPEED_GAP], out[SPEED_EFFECTIVE], out[LEAST_SIDE], out[LEAST_RATE]) == (0.0, sum(speeds), 0.0, 0.0)
    assert out[VELOCITY_EFFECTIVE] == pytest.approx(abs(sum(speeds)) * 0.5 * C / 2, rel=1e-14)
    assert out[LEAST_GAP] == pytest.approx(0.5 * C, rel=1e-14)
    assert out[LEAST_ANGLE] == pytest.approx(math.atan2(-0.4, 0.3), rel=1e-14)
    x, y = 0.6 * C, 0.2 * C
    whirl = 0.5 * sum(speeds)
    out = motion((x, y, 0.0, 0.0), (-whirl * y, whirl * x, 0.0, 0.0), *speeds)
    assert out[SPEED_GAP] == pytest.approx(whirl, rel=1e-14)
    assert out[SPEED_EFFECTIVE] == pytest.approx(0.0, abs=1e-12 * abs(whirl))
    assert out[VELOCITY_EFFECTIVE] == pytest.approx(0.0, abs=1e-12 * C * abs(whirl))


def test_a_centred_journal_and_one_whose_edge_touches():
    out = motion(np.zeros(4), (3e-3, 4e-3, 0.0, 0.0), journal=100.0)
    assert (out[LEAST_GAP], out[LEAST_ANGLE], out[LEAST_SIDE], out[SPEED_GAP]) == (C, 0.0, 0.0, 0.0)
    assert out[LEAST_RATE] == pytest.approx(-5e-3, rel=1e-14) and np.isfinite(out).all()
    edge = motion((0.0, 0.0, 0.0, -1.1 * C), np.zeros(4))
    assert edge[LEAST_GAP] == pytest.approx(-0.1 * C, rel=1e-12) and edge[LEAST_SIDE] == 1.0
