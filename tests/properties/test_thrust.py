"""The thrust bearing: symmetry, rupture, closed stiffness in series, exact tangents, limits of its film."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cranktrain.engine import load_engine
from cranktrain.film.thrust import AMBIENT, closed_stiffness, side_force, thrust_force, thrust_parameters

BEARING = load_engine("diesel_i6").thrust
VISCOSITY = 0.012
FILM = thrust_parameters(BEARING, VISCOSITY, linear=False)
HALF = 0.5 * BEARING.clearance
SPEED = 200.0
PLACES = st.floats(-1.03, 1.03).map(lambda share: share * HALF)
VELOCITIES = st.floats(-0.05, 0.05)


def side(gap, closing, speed=SPEED):
    return side_force(gap, closing, speed, *FILM[2:])


@settings(max_examples=100, deadline=None)
@given(PLACES, VELOCITIES)
def test_both_sides_are_alike(z, v):
    force, stiffness, damping = thrust_force(z, v, SPEED, FILM)
    mirrored = thrust_force(-z, -v, SPEED, FILM)
    assert mirrored == pytest.approx((-force, stiffness, damping), rel=1e-9, abs=1e-6)


def pads():
    """Area (m²) of all pads of one side."""
    radius = 0.25 * (BEARING.inner_diameter + BEARING.outer_diameter)
    width = 0.5 * (BEARING.outer_diameter - BEARING.inner_diameter)
    return 2 * math.pi * radius * BEARING.pad_fraction * width


def ruptured(force):
    """What is left of the full film's force: the law's own statement."""
    suction = AMBIENT * pads()
    return 0.5 * (force - suction + math.hypot(force + suction, suction))


@settings(max_examples=200, deadline=None)
@given(st.floats(-5e-6, 2e-4), st.floats(-10.0, 10.0))
def test_a_side_never_pulls_harder_than_ambient_pressure_on_its_pads(gap, closing):
    # Rounding of the full film's force, which reaches 1e10 N here.
    assert side(gap, closing)[0] >= -AMBIENT * pads() - 1e-4


def test_pulled_apart_hard_a_side_lets_go_at_ambient_pressure():
    assert side(5e-6, -50.0)[0] == pytest.approx(-AMBIENT * pads(), rel=1e-3)


@settings(max_examples=200, deadline=None)
@given(PLACES, VELOCITIES)
def test_tangents_are_derivatives_of_the_force(z, v):
    force, stiffness, damping = thrust_force(z, v, SPEED, FILM)
    # Steps that change by little what a side still carries above its limit of suction.
    sides = [side(HALF - z, v), side(HALF + z, -v)]
    step = min([1e-9, *(0.01 * (f + AMBIENT * pads()) / abs(k) for f, k, _ in sides)])
    rate = min([1e-6, *(0.01 * (f + AMBIENT * pads()) / abs(c) for f, _, c in sides)])
    kinks = [BEARING.contact_height, 0.0, 0.2 * BEARING.contact_height]
    assume(all(abs(gap - kink) > 4e-9 for gap in (HALF - z, HALF + z) for kink in kinks))

    def slope(dz, dv):
        near = thrust_force(z + dz, v + dv, SPEED, FILM)[0] - thrust_force(z - dz, v - dv, SPEED, FILM)[0]
        far = thrust_force(z + 2 * dz, v + 2 * dv, SPEED, FILM)[0]
        return (8 * near - far + thrust_force(z - 2 * dz, v - 2 * dv, SPEED, FILM)[0]) / (12 * (dz + dv))

    # Rounding: of gaps at 1e-4 m, of velocities at 1e-2 m/s, and of the force.
    noise = 1e-15 * (abs(force) + 1e3) + 1e-19 * abs(stiffness) + 1e-17 * abs(damping)
    assert stiffness == pytest.approx(slope(step, 0.0), rel=1e-5, abs=10 * noise / step)
    assert damping == pytest.approx(slope(0.0, rate), rel=1e-5, abs=10 * noise / rate)


@settings(max_examples=100, deadline=None)
@given(PLACES, VELOCITIES)
def test_it_centres_and_damps(z, v):
    _, stiffness, damping = thrust_force(z, 0.0, SPEED, FILM)
    assert stiffness < 0.0
    assert thrust_force(z, v, SPEED, FILM)[2] < 0.0
    assert damping < 0.0


def test_closed_it_is_collar_and_block_in_series():
    series = BEARING.contact_stiffness * BEARING.block_stiffness / (BEARING.contact_stiffness + BEARING.block_stiffness)
    assert closed_stiffness(BEARING) == pytest.approx(series, rel=1e-14)
    # Deep in contact the film is frozen and the spring's slope remains; the other side has no film to speak of.
    deep = thrust_force(HALF + 3e-6, 0.0, 0.0, FILM)[0] - thrust_force(HALF + 2e-6, 0.0, 0.0, FILM)[0]
    assert -deep / 1e-6 == pytest.approx(series, rel=1e-3)
    linear = thrust_parameters(BEARING, VISCOSITY, linear=True)
    assert thrust_force(1e-6, 0.0, SPEED, linear) == pytest.approx((-1e-6 * series, -series, -BEARING.damping))
    assert closed_stiffness(replace(BEARING, block_stiffness=1e30)) == pytest.approx(BEARING.contact_stiffness)


def test_wedge_is_that_of_a_wide_linear_slider():
    # Film pressure of a linear wedge from h + δ to h, integrated numerically, times the stated leakage factor.
    h, taper = 15e-6, BEARING.taper
    radius = 0.25 * (BEARING.inner_diameter + BEARING.outer_diameter)
    width = 0.5 * (BEARING.outer_diameter - BEARING.inner_diameter)
    length = 2 * math.pi * radius * BEARING.pad_fraction / BEARING.pads
    x = np.linspace(0.0, length, 20001)
    film = h + taper * (1 - x / length)
    dx = x[1]

    def integral(y):
        return np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * dx)])

    one, two = integral(film**-2), integral(film**-3)
    pressure = 6 * VISCOSITY * radius * SPEED * (one - one[-1] / two[-1] * two)
    load = BEARING.pads * width * np.trapezoid(pressure, dx=dx) * width**2 / (width**2 + length**2)
    assert side(h, 0.0)[0] == pytest.approx(ruptured(load), rel=1e-6)


def test_squeeze_goes_with_the_cube_of_the_film():
    thin, thick = side(10e-6, 50.0, 0.0)[0], side(20e-6, 50.0, 0.0)[0]
    # Far above the rounding at rupture, which leaves a share of (suction / force)².
    assert thick > 100 * AMBIENT * pads()
    assert thin / thick == pytest.approx(8.0, rel=1e-3)


def test_force_has_no_jump_where_the_collar_touches():
    before, after = (side(BEARING.contact_height + d, 0.02)[0] for d in (1e-13, -1e-13))
    assert after == pytest.approx(before, rel=1e-5)
