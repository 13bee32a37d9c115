"""The thrust bearing: symmetry, rupture, closed stiffness in series, tilt, exact tangents, limits of its film."""

import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cranktrain.engine.file import load_engine
from cranktrain.film.laws import thrust as film
from cranktrain.film.laws.bearings import thrust_bearing

SIXES = load_engine("diesel_i6").thrust
BEARING = replace(SIXES, closed_stiffness=None)  # the contact closes lists too
VISCOSITY = 0.012
FILM = film.thrust_parameters(BEARING, VISCOSITY)
HALF = 0.5 * BEARING.clearance
SPEED = 200.0
PLACES = st.floats(-1.03, 1.03).map(lambda share: share * HALF)
VELOCITIES = st.floats(-0.05, 0.05)


def side(gap, closing, speed=SPEED):
    """Force of one side's pads, and its derivatives by gap and closing velocity."""
    return tuple(FILM[film.PADS] * value for value in film.pad_force(gap, closing, FILM[film.WEDGE] * speed, FILM)[:3])


def tilted(z, tx, ty, vz=0.0, vtx=0.0, vty=0.0, speed=SPEED, parameters=FILM):
    """Force and moments (3,), and their derivatives by place and by rate, (3, 3) each."""
    out = np.full(21, np.nan)
    film.thrust_force_tilted(z, tx, ty, vz, vtx, vty, speed, parameters, out)
    return out[:3], out[3:12].reshape(3, 3), out[12:].reshape(3, 3)


def square(z, v, speed=SPEED):
    """Force of all pads on a collar square to its axis, and its derivatives by place and velocity."""
    (f1, k1, c1), (f2, k2, c2) = side(HALF - z, v, speed), side(HALF + z, -v, speed)
    return f2 - f1, k1 + k2, -c1 - c2


def pads():
    """Area (m²) of all pads of one side."""
    _, length, width = film.pad_size(BEARING)
    return BEARING.pads * length * width


@settings(max_examples=200, deadline=None)
@given(st.floats(-5e-6, 2e-4), st.floats(-10.0, 10.0))
def test_a_side_never_pulls_harder_than_ambient_pressure_on_its_pads(gap, closing):
    # Rounding of the full film's force, which reaches 1e10 N here.
    assert side(gap, closing)[0] >= -film.AMBIENT * pads() - 1e-4
    assert side(5e-6, -50.0)[0] == pytest.approx(-film.AMBIENT * pads(), rel=1e-3)  # pulled apart hard it lets go


@settings(max_examples=200, deadline=None)
@given(PLACES, VELOCITIES)
def test_tangents_are_derivatives_of_the_force(z, v):
    force, stiffness, damping = square(z, v)
    # Steps that change by little what a side still carries above its limit of suction.
    sides = [side(HALF - z, v), side(HALF + z, -v)]
    step = min([1e-9, *(0.01 * (f + film.AMBIENT * pads()) / abs(k) for f, k, _ in sides)])
    rate = min([1e-6, *(0.01 * (f + film.AMBIENT * pads()) / abs(c) for f, _, c in sides)])
    kinks = [BEARING.contact_height, 0.0, 0.2 * BEARING.contact_height]
    assume(all(abs(gap - kink) > 4e-9 for gap in (HALF - z, HALF + z) for kink in kinks))

    def slope(dz, dv):
        near = square(z + dz, v + dv)[0] - square(z - dz, v - dv)[0]
        far = square(z + 2 * dz, v + 2 * dv)[0]
        return (8 * near - far + square(z - 2 * dz, v - 2 * dv)[0]) / (12 * (dz + dv))

    # Rounding: of gaps at 1e-4 m, of velocities at 1e-2 m/s, and of the force.
    noise = 1e-15 * (abs(force) + 1e3) + 1e-19 * abs(stiffness) + 1e-17 * abs(damping)
    assert stiffness == pytest.approx(slope(step, 0.0), rel=1e-5, abs=10 * noise / step)
    assert damping == pytest.approx(slope(0.0, rate), rel=1e-5, abs=10 * noise / rate)


@settings(max_examples=100, deadline=None)
@given(PLACES, VELOCITIES)
def test_it_centres_and_damps(z, v):
    _, stiffness, damping = square(z, 0.0)
    assert stiffness < 0.0 and damping < 0.0 and square(z, v)[2] < 0.0


def test_closed_it_is_collar_and_block_in_series():
    both = 1.0 / (1.0 / SIXES.closed_stiffness + 1.0 / SIXES.block_stiffness)
    assert film.closed_stiffness(SIXES) == pytest.approx(both)
    series = BEARING.contact_stiffness * BEARING.block_stiffness / (BEARING.contact_stiffness + BEARING.block_stiffness)
    assert film.closed_stiffness(BEARING) == pytest.approx(series, rel=1e-14)
    # Deep in contact the film is frozen and the spring's slope remains; the other side has no film to speak of.
    deep = square(HALF + 3e-6, 0.0, 0.0)[0] - square(HALF + 2e-6, 0.0, 0.0)[0]
    assert -deep / 1e-6 == pytest.approx(series, rel=1e-3)
    closed = entry.Law(thrust_bearing(BEARING, VISCOSITY, clearance=False, tilt=False))((1e-6,), (0.0,))
    found = closed.force[0], closed.by_place[0, 0], closed.by_velocity[0, 0]
    assert found == pytest.approx((-1e-6 * series, -series, -BEARING.damping))
    assert film.closed_stiffness(replace(BEARING, block_stiffness=1e30)) == pytest.approx(BEARING.contact_stiffness)


def test_wedge_and_squeeze_are_one_velocity():
    # A pad that rises evenly by δ over B turns sliding at U into squeeze at U δ / (2 B).
    radius, length, _ = film.pad_size(BEARING)
    squeeze = radius * SPEED * BEARING.taper / (2 * length)
    assert side(15e-6, 0.0)[0] == pytest.approx(side(15e-6, squeeze, 0.0)[0], rel=1e-12)


def test_spline_of_the_damping_is_close_to_the_solution():
    films = np.geomspace(0.2 * BEARING.contact_height, 2 * BEARING.clearance, 101)
    solved = VISCOSITY * film.pad_damping(films, BEARING.taper, *film.pad_size(BEARING)[1:])
    found = np.array([film.damping_of_film(h, FILM)[0] for h in films])
    assert found == pytest.approx(solved, rel=1e-3)


def test_rupture_starts_where_the_film_begins_to_pull():
    # No force at rest without speed, and nothing is lost of a film that pulls weakly.
    assert side(20e-6, 0.0, 0.0)[0] == 0.0
    push, pull = side(20e-6, 1e-5, 0.0)[0], side(20e-6, -1e-5, 0.0)[0]
    assert -pull == pytest.approx(push, rel=1e-3)


@settings(max_examples=50, deadline=None)
@given(PLACES, VELOCITIES)
def test_without_tilt_the_tilting_collar_is_the_plain_one(z, v):
    force, place, rate = tilted(z, 0.0, 0.0, v)
    plain = square(z, v)
    assert (force[0], place[0, 0], rate[0, 0]) == pytest.approx(plain, rel=1e-12)
    scale = FILM[film.PADS] * film.pad_size(BEARING)[0]
    largest = max(film.pad_force(HALF - s, 0, 0, FILM)[0] for s in (z, -z))
    assert np.abs(force[1:]).max() <= 1e-13 * scale * largest + 1e-9


TILTS = st.floats(-0.6, 0.6).map(lambda share: share * HALF / film.pad_size(BEARING)[0])


@settings(max_examples=100, deadline=None)
@given(PLACES.map(lambda z: 0.5 * z), TILTS, TILTS, VELOCITIES, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_tangents_of_the_tilted_collar_are_derivatives(z, tx, ty, vz, vtx, vty):
    # Where no pad comes near contact, whose kinks are the plain collar's.
    radius = film.pad_size(BEARING)[0]
    assume(abs(z) + radius * math.hypot(tx, ty) < HALF - 5e-6)
    at = np.array([z, tx, ty, vz, vtx, vty])
    force, place, rate = tilted(*at)
    analytic = np.hstack((place, rate))
    steps = np.array([2e-9, 4e-8, 4e-8, 1e-6, 2e-5, 2e-5])
    numeric = np.empty((3, 6))
    for j, step in enumerate(np.diag(steps)):
        near = tilted(*(at + step))[0] - tilted(*(at - step))[0]
        far = tilted(*(at + 2 * step))[0] - tilted(*(at - 2 * step))[0]
        numeric[:, j] = (8 * near - far) / (12 * steps[j])
    # A pad's force has a kink in its second derivative where it begins to pull; rounding of each pad's force.
    size = np.array([1.0, radius, radius])
    scale = np.abs(analytic / size[:, None]).max(axis=0) + 1e-13 * (np.abs(force / size).max() + 1e3) / steps
    assert (np.abs(numeric - analytic) <= 2e-5 * size[:, None] * scale).all()


@settings(max_examples=50, deadline=None)
@given(st.floats(-0.3, 0.3).map(lambda s: s * HALF), TILTS, TILTS)
def test_turned_by_a_pad_the_moments_turn_along(z, tx, ty):
    turn = 2 * math.pi / BEARING.pads
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    force, *_ = tilted(z, tx, ty)
    turned, *_ = tilted(z, *(rotation @ (tx, ty)))
    assert turned[0] == pytest.approx(force[0], rel=1e-9, abs=1e-6)
    assert turned[1:] == pytest.approx(rotation @ force[1:], rel=1e-9, abs=1e-8)


def test_tilt_is_righted_and_turned_on():
    # At standstill nothing but damping; running, the film rights the collar and pushes it on in the sense of rotation.
    tilt = 0.3 * HALF / film.pad_size(BEARING)[0]
    still, _, rate = tilted(0.0, tilt, 0.0, speed=0.0)
    assert still == pytest.approx(np.zeros(3), abs=1e-12)
    assert (np.linalg.eigvalsh(0.5 * (rate + rate.T)) < 0.0).all()
    running, *_ = tilted(0.0, tilt, 0.0)
    assert running[1] < 0.0 < running[2]
    # Half-frequency whirl: carried round at half the speed the tilted collar feels the wedge of its pads only.
    whirling, *_ = tilted(0.0, tilt, 0.0, 0.0, 0.0, 0.5 * SPEED * tilt)
    assert abs(whirling[2]) < 1e-9 * abs(running[2])


def test_an_edge_that_touches_carries():
    # Tilted beyond the clearance one pad is in contact: finite force and moment that right it.
    tilt = 1.05 * HALF / (film.pad_size(BEARING)[0] * math.sin(math.pi / 4))
    force, place, _ = tilted(0.0, tilt, 0.0, speed=0.0)
    assert np.isfinite(place).all()
    pressed = 4 * film.closed_stiffness(BEARING) / BEARING.pads * (0.05 * HALF + BEARING.contact_height)
    assert force[1] == pytest.approx(-pressed * 1.05 * HALF / tilt, rel=1e-6)


def test_force_has_no_jump_where_the_collar_touches():
    before, after = (side(BEARING.contact_height + d, 0.02)[0] for d in (1e-13, -1e-13))
    assert after == pytest.approx(before, rel=1e-5)


def test_the_closed_bearing_of_lists_and_the_contact_of_a_run_are_two_values():
    own = replace(BEARING, closed_stiffness=0.5 * BEARING.contact_stiffness)
    assert film.closed_stiffness(own) < film.closed_stiffness(BEARING)
    assert film.touching_stiffness(own) == film.touching_stiffness(BEARING) == film.closed_stiffness(BEARING)
    at = film.STIFFNESS
    assert film.thrust_pads(own, 0.01).parameters[at] == film.touching_stiffness(own)
    assert film.closed_pads(own, 0.01).parameters[at] == film.closed_stiffness(own)
