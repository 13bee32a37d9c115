"""Rollers of a bearing: tangents, symmetries, clearance, slices, balance with any load, the law in a running engine."""

import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from cranktrain.engine.parts import RollerBearings
from cranktrain.engine.roller_bearing import RollerBearing, iso_profile, main_roller
from cranktrain.film.laws import roller_contacts as contacts
from cranktrain.film.laws.bearings import Bearings, law_films
from cranktrain.film.laws.parameters import CLEARANCE, WIDTH
from cranktrain.film.laws.register import ROLLER, bearing_law
from cranktrain.film.laws.roller import roller_parameters

BEARING = RollerBearing(14, 24e-3, 18e-3, 110e-3, 40e-6, 0.00035)
PITCH = 2.0 * math.pi / BEARING.rollers
PLACES = st.tuples(*[st.floats(-60e-6, 60e-6)] * 2, *[st.floats(-25e-6, 25e-6)] * 2).map(np.array)
ANGLES = st.floats(-4.0, 4.0)
SEVERAL = (BEARING, replace(BEARING, law="iso16281", profile=0.0), replace(BEARING, clearance=-10e-6))


def forces(place, first_angle=0.0, bearing=BEARING):
    """Forces (4,) and tangents (4, 4)."""
    out = contacts.force_at(bearing, np.asarray(place), first_angle)
    return out[:4], out[contacts.BY_PLACE : contacts.WORK].reshape(4, 4)


def approaches(bearing, place, first_angle):
    """Approach of every slice of every roller, negative where apart."""
    angles = first_angle + 2.0 * np.pi * np.arange(bearing.rollers) / bearing.rollers
    zeta, _, relief = contacts.roller_slices(bearing)
    x, y, a, b = place
    along = np.add.outer(np.cos(angles) * x + np.sin(angles) * y, 0 * zeta)
    return along + np.outer(np.cos(angles) * a + np.sin(angles) * b, zeta) - 0.5 * bearing.clearance - relief


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(SEVERAL), PLACES, ANGLES)
def test_kernel_is_the_plain_sum_over_rollers_and_slices(bearing, place, first):
    zeta, share, _ = contacts.roller_slices(bearing)
    delta = np.maximum(approaches(bearing, place, first), 0.0)
    angles = first + 2.0 * np.pi * np.arange(bearing.rollers) / bearing.rollers
    loads = bearing.contact_stiffness * delta ** (10 / 9) * share
    each, moment = loads.sum(axis=1), loads @ zeta
    direction = np.array([np.cos(angles), np.sin(angles)])
    force, _ = forces(place, first, bearing)
    size = 1e-9 * (1.0 + each.sum())
    assert force == pytest.approx(-np.concatenate([direction @ each, direction @ moment]), abs=size)
    out = contacts.force_at(bearing, place, first)
    assert out[contacts.LARGEST] == pytest.approx(each.max(), rel=1e-9, abs=1e-9)
    assert (out[contacts.LOADED] > 0) == out[: contacts.WORK].any() == each.any()
    assert contacts.roller_loads(bearing, place, first) == pytest.approx(each, rel=1e-9, abs=1e-9)
    assert out[contacts.WORK] == pytest.approx(9 / 19 * np.sum(loads * delta), rel=1e-9, abs=1e-15)
    highest = (bearing.contact_stiffness / bearing.length * delta ** (10 / 9)).max()
    assert out[contacts.PRESSURE] == pytest.approx(bearing.pressure_factor * math.sqrt(highest), rel=1e-9)
    assert contacts.slice_stiffness(bearing, place, first).sum() == pytest.approx(
        10 / 9 * np.sum(loads[delta > 0] / delta[delta > 0]), rel=1e-9
    )


@settings(max_examples=100, deadline=None)
@given(st.sampled_from(SEVERAL), PLACES, ANGLES)
def test_tangents_and_forces_are_the_derivatives_of_force_and_energy(bearing, place, first):
    # Where a slice just touches, its tangent rises like δ^(1/9): a central difference of step h misses 0.0165 (h/δ)² of
    # it, 4e-7 at δ = 200 h.
    gaps = np.abs(approaches(bearing, place, first))
    step = 1e-9
    assume(gaps.min() > 200 * step)
    assume(contacts.force_at(bearing, place, first)[contacts.LOADED] > 0)
    force, tangent = forces(place, first, bearing)
    difference = np.empty((4, 4))
    slope = np.empty(4)
    for k in range(4):
        at = [place.copy(), place.copy()]
        at[0][k] += step
        at[1][k] -= step
        plus, minus = (contacts.force_at(bearing, p, first) for p in at)
        difference[:, k] = (plus[:4] - minus[:4]) / (2 * step)
        slope[k] = (plus[contacts.WORK] - minus[contacts.WORK]) / (2 * step)
    assert tangent == pytest.approx(difference, abs=1e-6 * np.abs(tangent).max())
    # Contacts store energy only, and resist every motion.
    assert tangent == pytest.approx(tangent.T, abs=1e-12 * (np.abs(tangent).max() + 1.0))
    assert np.linalg.eigvalsh(tangent).max() <= 1e-12 * (np.abs(tangent).max() + 1.0)
    assert force == pytest.approx(-slope, abs=1e-6 * contacts.roller_loads(bearing, place, first).sum())


def test_slices_converge_to_the_integral_over_a_tilted_straight_roller():
    # q(ζ) of one wedge: ∫ (d + sζ)₊^(10/9) ½ dζ over [−1, 1], half of the roller apart.
    d, s = 3e-6, 12e-6
    bearing = RollerBearing(3, 24e-3, 18e-3, 110e-3)
    exact = bearing.contact_stiffness * 0.5 * (d + s) ** (19 / 9) / (19 / 9 * s)
    place = np.array([d, 0.0, s, 0.0])
    few, more, most = (abs(contacts.roller_loads(bearing, place, 0.0, n)[0] / exact - 1.0) for n in (4, 32, 128))
    assert more < 1e-3 and most < 1e-4 and most < 0.05 * few


def test_a_long_roller_is_straight_in_its_middle_and_relieved_by_the_standards_other_profile():
    long = RollerBearing(14, 60e-3, 18e-3, 110e-3, 0.0, iso_profile(60e-3, 18e-3))
    zeta, _, relief = contacts.roller_slices(long)
    assert long.profile == 0.0005
    assert not relief[np.abs(zeta) <= 0.25].any() and (np.diff(relief[zeta > 0.25]) > 0).all()
    k = np.argmin(np.abs(zeta - 0.7))
    s = (2 * 30e-3 * zeta[k] - 15e-3) / 45e-3
    assert relief[k] == pytest.approx(2 * 0.0005 * 18e-3 * math.log(1 / (1 - s * s)), rel=1e-9)


LOADS = st.tuples(st.floats(0.0, 6.0), ANGLES, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))


@settings(max_examples=100, deadline=None)
@given(LOADS, ANGLES, st.sampled_from([-20e-6, 0.0, 5e-6, 40e-6, 150e-6]))
@example((0.0, 4.367748939899276e-11, 0.0, 0.0), 0.0, 5e-6)
@example((0.0, 0.0, 0.0, 4.4e-11), 0.0, 5e-6)  # one roller in contact, and a moment across it
@example((0.0, 1e-5, 1e-5, 0.0), 1e-5, 40e-6)  # the search passes the balance
@example((0.0, 0.0, 0.0, 2e-9), 0.0, 150e-6)  # one roller bears, far from the next
@example((0.0, 0.0, 0.25, 4.3e-14), 0.0, 5e-6)  # a stiff and a soft direction at once
@example((0.0, 3.2091327742344452e-15, 0.0, 3.2091327742344452e-15), 0.0, 5e-6)  # a load across of rounding
def test_balance_with_any_load(load, first, clearance):
    exponent, way, q_x, q_y = load
    size = 10.0**exponent
    wanted = size * np.array([math.cos(way), math.sin(way), q_x, q_y])
    bearing = replace(BEARING, clearance=clearance)
    found = contacts.equilibrium(bearing, wanted, first)
    force, tangent = forces(found.place, first, bearing)
    assert -force == pytest.approx(wanted, abs=1e-7 * size)
    assert found.stiffness == pytest.approx(-tangent)
    assert found.loads == pytest.approx(contacts.roller_loads(bearing, found.place, first))
    # The further it is pressed, the further it goes.
    assert contacts.equilibrium(bearing, 1.1 * wanted, first).place @ wanted > found.place @ wanted


@pytest.mark.parametrize("clearance", [0.0, 40e-6, -20e-6])
def test_without_load_only_preloaded_rollers_bear_and_are_stiff_all_around(clearance):
    found = contacts.equilibrium(replace(BEARING, clearance=clearance), np.zeros(4))
    if clearance >= 0.0:
        assert not found.loads.any() and not found.stiffness.any() and found.pressure == 0.0
    else:
        assert np.abs(found.place).max() < 1e-12
        assert found.loads == pytest.approx(np.full(14, found.loads[0])) and found.loads[0] > 100.0
        assert found.stiffness[0, 0] == pytest.approx(found.stiffness[1, 1])


def test_clearance_concentrates_the_load_and_the_travel_is_that_of_the_rated_pressure():
    load = np.array([20e3, 0.0, 0.0, 0.0])
    gaps = (0.0, 20e-6, 80e-6, 160e-6)
    largest = [contacts.equilibrium(replace(BEARING, clearance=c), load).loads.max() for c in gaps]
    assert (np.diff(largest) > 0).all()
    straight = replace(BEARING, profile=0.0)
    place = np.array([straight.travel + 0.5 * straight.clearance, 0.0, 0.0, 0.0])
    assert contacts.force_at(straight, place)[contacts.PRESSURE] == pytest.approx(4e9, rel=1e-9)


@pytest.mark.parametrize("compliance", [1e-12, 1e-10, 1e-8])
def test_plain_newton_steps_find_a_stage_from_anywhere(compliance):
    # A stage of a running engine: u = u_free + H f(u), into and out of contact, without any line search.
    rng = np.random.default_rng(0)
    response = compliance * np.diag([1.0, 1.0, 0.3, 0.3])
    for _ in range(100):
        free = rng.uniform(-1.0, 1.0, 4) * [1e-4, 1e-4, 2e-5, 2e-5]
        u = rng.uniform(-1.0, 1.0, 4) * 30e-6
        for _ in range(12):
            force, tangent = forces(u)
            residual = free + response @ force - u
            if np.abs(residual).max() < 1e-12:
                break
            u = u + np.linalg.solve(np.eye(4) - response @ tangent, residual)
        assert np.abs(residual).max() < 1e-12


MAINS = RollerBearings(
    rollers=(14, 16), roller_diameter=(18e-3, 14e-3), roller_length=(24e-3, 20e-3), pitch_diameter=(110e-3, 106e-3),
    clearance=(40e-6, 30e-6), stiffness=(9e8, 7e8), tilt_stiffness=(4e4, 2e4), damping=(2e3, 1e3),
    tilt_damping=(0.2, 0.1), ring_mass=(1.0, 0.7), profile=(0.00035, 0.0),
)  # fmt: skip


def law(mains, i, place, velocity=(0.0, 0.0, 0.0, 0.0), theta=0.0, action="FORCE"):
    """Answer of a main bearing's law; the frame stands at ``theta``."""
    films = law_films(bearing_law("roller"), ROLLER, Bearings(roller_parameters(mains), rollers=mains))
    told = {"cos": math.cos(theta), "sin": math.sin(theta), "angle": theta}
    return entry.Law(films, i)(place, velocity, action, **told)


def turned(vector, angle):
    """Vectors of space seen in axes that are turned by ``angle``."""
    rotation = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    return np.kron(np.eye(2), rotation) @ vector


PLACE = np.array([22e-6, -31e-6, 3e-6, 5e-6])
MOVING = np.array([0.02, -0.01, 0.004, 0.03])


@pytest.mark.parametrize("main", [0, 1])
def test_law_is_the_bearing_of_its_main_with_damping(main):
    force, by_place, by_velocity, *_ = law(MAINS, main, PLACE, MOVING)
    bearing = main_roller(MAINS, main)
    out = contacts.force_at(bearing, PLACE, -0.5 * math.pi, 12)
    expected, tangent = out[:4], out[contacts.BY_PLACE : contacts.WORK].reshape(4, 4)
    lever = 0.5 * bearing.length
    damping = np.diag([MAINS.damping[main]] * 2 + [MAINS.tilt_damping[main] / lever**2] * 2)
    assert force == pytest.approx(expected - damping @ MOVING, rel=1e-9)
    assert by_place == pytest.approx(tangent, rel=1e-9, abs=1e-9 * np.abs(tangent).max())
    assert by_velocity == pytest.approx(-damping)


def test_slices_in_the_loop_are_enough():
    bearing = main_roller(MAINS, 0)
    for a in (0.0, 10e-6, 30e-6):
        place = np.array([0.0, -60e-6, 0.0, a])
        few, many = (contacts.force_at(bearing, place, -0.5 * math.pi, slices) for slices in (12, 200))
        assert few[:4] == pytest.approx(many[:4], abs=2e-3 * np.abs(many[:4]).max())


def test_linear_law():
    mains = replace(MAINS, law="linear")
    shown = law(mains, 1, PLACE, action="OBSERVE")
    lever = 0.5 * mains.roller_length[1]
    stiffness = np.diag([7e8, 7e8, 2e4 / lever**2, 2e4 / lever**2])
    assert shown.force == pytest.approx(-stiffness @ PLACE) and shown.by_place == pytest.approx(-stiffness)
    assert shown.pressure == 0.0


@pytest.mark.parametrize("theta", [0.4, 3.0, 40.0])
def test_rollers_that_stand_still_do_so_in_space(theta):
    still, tangent, *_ = law(MAINS, 0, PLACE)
    force, by_place, *_ = law(MAINS, 0, turned(PLACE, theta), theta=theta)
    assert force == pytest.approx(turned(still, theta), rel=1e-9, abs=1e-9 * np.abs(still).max())
    rotation = turned(np.eye(4), theta)
    assert by_place == pytest.approx(rotation @ tangent @ rotation.T, abs=1e-9 * np.abs(tangent).max())


def test_rollers_that_go_round_return_with_their_pitch_and_feel_whole_turns():
    mains = replace(MAINS, variable=True)
    ratio = 0.5 * (1.0 - 18.0 / 110.0)
    period = PITCH / ratio
    thetas = np.linspace(0.0, period, 9)
    forces = np.array([turned(law(mains, 0, turned(PLACE, t), theta=t)[0], -t) for t in thetas])
    assert forces[-1] == pytest.approx(forces[0], rel=1e-9)
    assert np.ptp(forces[:, 0]) > 1e-3 * np.abs(forces[:, 0]).max(), "the passage of the rollers is felt"
    a_turn_later = turned(law(mains, 0, turned(PLACE, 2 * np.pi), theta=2 * np.pi)[0], -2 * np.pi)
    cage = contacts.force_at(main_roller(mains, 0), PLACE, -0.5 * np.pi + 2 * np.pi * ratio, 12)
    assert a_turn_later == pytest.approx(cage[:4], rel=1e-9)


def test_figures_that_are_shown():
    bearing = main_roller(MAINS, 0)
    down = np.array([0.0, -60e-6, 0.0, 0.0])
    out = law(MAINS, 0, turned(down, 2.0), theta=2.0, action="OBSERVE")
    assert out.pressure == pytest.approx(contacts.force_at(bearing, down, -0.5 * np.pi, 12)[contacts.PRESSURE])
    assert out.gap == 0.0 and math.sin(out.gap_angle) == pytest.approx(-1.0)
    scale = bearing.travel + 0.5 * bearing.clearance
    assert out.eccentricity == pytest.approx(60e-6 / scale)
    parameters = roller_parameters(MAINS)
    assert parameters[0, CLEARANCE] == pytest.approx(scale) and parameters[1, WIDTH] == 20e-3
    free = law(MAINS, 0, np.array([0.0, -5e-6, 0.0, 2e-6]), action="OBSERVE")
    assert free.gap == pytest.approx(20e-6 - 5e-6 - 2e-6) and not free.force.any()
