"""The journal film: what its map interpolates, what symmetry and thermodynamics ask, where it must stay finite."""

import math

import entry
import numpy as np
import pytest
from film_tables import differences
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from some import some

from cranktrain.engine.file import load_engine
from cranktrain.film.laws.bearings import Bearings, bearing_parameters, law_films
from cranktrain.film.laws.films import PLANE_BY_PLACE
from cranktrain.film.laws.impedance import MapFilm, impedance_map, journal_force, pressure_and_flow
from cranktrain.film.laws.parabolic import (
    WORK_SIZE,
    film_force,
    film_geometry,
    film_observables,
    friction_torque,
    node_table,
)
from cranktrain.film.laws.register import PLAIN, bearing_law

BEARING = load_engine("diesel_i6").main_bearing
VISCOSITY = 0.012
CLEARANCE, KAPPA2, FACTOR = film_geometry(BEARING.diameter, BEARING.width, BEARING.clearance, VISCOSITY)
RADIUS = 0.5 * BEARING.diameter
CONTACT = 0.5 * BEARING.contact_pressure * BEARING.width * BEARING.diameter
MAP = impedance_map(KAPPA2)
PARAMETERS = bearing_parameters(BEARING, VISCOSITY)
NODES = node_table()
SPIN = 100.0  # half the sum of surface speeds, rad/s
ROUGH = 1.0 - BEARING.contact_height / BEARING.clearance  # eccentricity of first contact
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def film(place, velocity, half_speed=SPIN):
    """Output of the law at ``place`` (clearances) and ``velocity`` (clearances × rad/s)."""
    out = np.zeros(16)
    x, v = CLEARANCE * np.asarray(place), CLEARANCE * np.asarray(velocity)
    journal_force(*x, *v, half_speed, MapFilm(CLEARANCE, FACTOR, BEARING.contact_height, CONTACT, MAP), out)
    return out


def squeeze(place, velocity, half_speed=SPIN):
    """Velocity of pure squeeze, in clearances: what the film sees in a frame turning at half the surface speeds."""
    return np.asarray(velocity) - half_speed * TURN @ np.asarray(place)


def solved(place, velocity, half_speed=SPIN):
    """Force (N), largest pressure (Pa) and side flow (m³/s) of the film solved online."""
    eps = np.hypot(*place)
    axes = np.array([[place[0], -place[1]], [place[1], place[0]]]) / eps
    v = axes.T @ squeeze(place, velocity, half_speed)
    out, work, zone = np.zeros(2), np.zeros(WORK_SIZE), np.zeros(2)
    film_force(eps, *v, KAPPA2, NODES, work, zone, out)
    highest, flow = film_observables(*v, work, zone)
    scale = VISCOSITY * (RADIUS / CLEARANCE) ** 2
    return -FACTOR * axes @ out[:2], 15 * scale * highest, 10 * RADIUS**3 / BEARING.width * CLEARANCE * flow


def states(largest):
    """Places in clearances, and velocities in clearances × rad/s."""
    parts = st.floats(0.01, largest), st.floats(-math.pi, math.pi), *2 * [st.floats(-300.0, 300.0)]
    return st.tuples(*parts).map(lambda s: (s[0] * np.array([math.cos(s[1]), math.sin(s[1])]), np.array(s[2:])))


@settings(max_examples=300, deadline=None)
@given(states(min(0.95, ROUGH)))
def test_map_equals_the_film_solved_online(state):
    place, velocity = state
    assume(np.linalg.norm(squeeze(place, velocity)) > 1.0)
    expected, highest, flow = solved(place, velocity)
    force = film(place, velocity)[:2]
    assert np.linalg.norm(force - expected) < 0.005 * np.linalg.norm(expected)
    out = np.zeros(8)
    shown = pressure_and_flow(CLEARANCE * place, CLEARANCE * velocity, SPIN, PARAMETERS, MAP, out)
    # Both are read for output only; the largest pressure is a node's, which jumps by a per cent as the peak moves.
    assert shown[0] == pytest.approx(highest, rel=0.02)
    assert shown[1] == pytest.approx(flow, rel=0.01)


@settings(max_examples=200, deadline=None)
@given(states(0.99))
def test_tangents_are_derivatives_of_the_force(state):
    place, velocity = state
    speed = np.linalg.norm(squeeze(place, velocity))
    # Where the squeeze nearly vanishes its direction turns within any difference step; at first contact the third
    # derivative jumps.
    assume(speed > 30.0 and abs(np.linalg.norm(place) - ROUGH) > 1e-3)
    out = film(place, velocity)
    gap = 1 - np.linalg.norm(place)
    steps = [1e-4 * gap * min(1.0, np.linalg.norm(place) / gap), 1e-4 * speed]
    values = np.concatenate([place, velocity])
    slopes = differences(lambda s: film(s[:2], s[2:])[:2], values, np.repeat(steps, 2)) / CLEARANCE
    for own, found in zip((slopes[:, :2], slopes[:, 2:]), out[2:10].reshape(2, 2, 2), strict=True):
        assert np.abs(found - own).max() < 1e-6 * np.abs(own).max()


@settings(max_examples=100, deadline=None)
@given(states(0.99))
def test_film_takes_energy_from_pure_squeeze(state):
    place, velocity = state
    out = film(place, velocity, 0.0)
    contact = film(place, (0.0, 0.0), 0.0)
    power = (out[:2] - contact[:2]) @ velocity
    assert power <= 0.0
    # And the damping matrix of a film is positive, so it damps small motion too.
    tangent = out[6:10].reshape(2, 2)
    if np.linalg.norm(velocity) > 1.0:
        assert np.linalg.eigvalsh(-(tangent + tangent.T)).min() > -1e-3 * np.abs(tangent).max()


@pytest.mark.parametrize("velocity", [(0.0, 0.0), (0.0, 50.0)])
@pytest.mark.parametrize("half_speed", [0.0, SPIN])
def test_nothing_breaks_at_the_centre_at_rest_or_beyond_the_wall(velocity, half_speed):
    for eps in (0.0, 1e-12, 1e-6, 0.5, 0.999, 0.9999, 1.0, 1.001, 1.3):
        out = film((eps, 0.0), velocity, half_speed)
        assert np.isfinite(out[:11]).all(), eps
    assert film((0.0, 0.0), (0.0, 0.0), half_speed)[:2].tolist() == [0.0, 0.0]


def test_contact_sets_in_smoothly_and_grows():
    """At first touch neither force nor stiffness jumps; at the wall the pressure is the one given."""
    eps = np.linspace(ROUGH - 0.02, 1.05, 400)
    normal = np.array([-film((e, 0.0), (0.0, 0.0), 0.0)[0] for e in eps])
    assert (normal[eps < ROUGH] == 0.0).all() and (np.diff(normal[eps > ROUGH]) > 0).all()
    assert np.abs(film((ROUGH + 1e-9, 0.0), (0.0, 0.0), 0.0)[2]) < 1e-4 * CONTACT / BEARING.contact_height
    assert -film((1.0, 0.0), (0.0, 0.0), 0.0)[0] == pytest.approx(CONTACT, rel=1e-9)


@pytest.mark.parametrize("eps", [0.5 + 0.5 * ROUGH, 1.0, 1.04])
@pytest.mark.parametrize("angle", [0.0, 2.2])
def test_tangents_of_contact_are_its_derivatives(eps, angle):
    """A journal at rest between surfaces at rest: contact alone acts."""
    place, rest = eps * np.array([math.cos(angle), math.sin(angle)]), np.zeros(2)
    tangent = film(place, rest, 0.0)[PLANE_BY_PLACE : PLANE_BY_PLACE + 4].reshape(2, 2)
    for column, step in some(enumerate(1e-6 * np.eye(2))):
        slope = (film(place + step, rest, 0.0)[:2] - film(place - step, rest, 0.0)[:2]) / (2e-6 * CLEARANCE)
        assert tangent[:, column] == pytest.approx(slope, rel=1e-6, abs=1e-6 * np.abs(tangent).max())


def test_friction_brakes_and_is_petroffs_in_the_middle():
    """Journal at rest in place: e × F works on it as well, and all that is fed in heats the film."""
    petroff = 2 * math.pi * VISCOSITY * RADIUS**3 * BEARING.width * 2 * SPIN / CLEARANCE
    for eps in (0.0, 0.3, 0.6, 0.9, 0.95):
        force, place = film((eps, 0.0), (0.0, 0.0))[:2], np.array([eps * CLEARANCE, 0.0])
        torque = friction_torque(eps, force, place, PARAMETERS, 2 * SPIN)
        assert torque < -petroff if eps else torque == pytest.approx(-petroff, rel=1e-12)


def test_springs_and_dampers_are_at_rest_in_space():
    films = law_films(bearing_law("linear"), PLAIN, Bearings(bearing_parameters(BEARING, VISCOSITY)[None], BEARING))
    law = entry.Law(films)
    place, velocity = np.array([3e-6, -2e-6]), np.array([1e-3, 2e-3])
    for angle in (0.0, 0.7, 2.0):
        c, s = math.cos(angle), math.sin(angle)
        to_space = np.array([[c, -s], [s, c]])
        answer = law(place, velocity, cos=c, sin=s)
        force, by_place, by_velocity = answer.force[:2], answer.by_place[:2, :2], answer.by_velocity[:2, :2]
        expected = -np.array(BEARING.ground_stiffness) * (to_space @ place)
        expected -= np.array([BEARING.damping_x, BEARING.damping_y]) * (to_space @ velocity)
        assert to_space @ force == pytest.approx(expected, rel=1e-12)
        assert force == pytest.approx(by_place @ place + by_velocity @ velocity, rel=1e-12)
