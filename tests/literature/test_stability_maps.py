"""Stability maps against theory: each map's boundary, found by the running model, on one coarse point or two.

Spectral radii and the threshold of inner damping: tests/data/integrators.json (tolerances stated there).
"""

import math

import entry
import numpy as np
import pytest
from expected import cases
from some import some

from cranktrain.dynamics.time.integrators import INTEGRATORS, integrator_table
from cranktrain_lab.stability import contact_ringing, oil_whirl, rotating_damping, step_film_stiffness
from cranktrain_lab.stability.amplification import constant, radius, scaled, step_matrix
from cranktrain_lab.stability.explicit import METHODS, amplification, spectral_radius
from cranktrain_lab.stability.rotor import SPEED, film_at, film_law, film_rotor
from cranktrain_lab.stability.stability_map import bisected

CASES = cases("integrators")


@pytest.mark.parametrize(("case", "name"), [("generalized_alpha", "generalised-alpha"), ("hht", "hht")])
def test_matrices_of_steps_have_the_published_radii(case, name):
    for parameter, rows in some(CASES[case]["expected"]["rho_Omega"].items()):
        for omega_h, expected in some(rows):
            found = radius(integrator_table(f"{name}:{parameter}"), 1.0, omega_h**2)
            assert found == pytest.approx(expected, abs=1e-5), (parameter, omega_h)


def oscillator(omega, ratio):
    return np.array([[0.0, 1.0], [-(omega**2), -2.0 * ratio * omega]])


@pytest.mark.parametrize(
    ("method", "ratio", "bound"),
    [
        ("central-differences", 0.0, 2.0),
        ("central-differences", 0.5, 2.0 * (math.sqrt(1.25) - 0.5)),
        ("central-differences", 3.0, 2.0 * (math.sqrt(10.0) - 3.0)),
        ("rk4", 0.0, 2.0 * math.sqrt(2.0)),
        # Two real rates, the faster at ω (ζ + √(ζ² − 1)); 2.7852936 is the root of R(z) = 1 on the negative axis.
        ("rk4", 3.0, 2.7852936 / (3.0 + math.sqrt(8.0))),
    ],
)
def test_explicit_methods_end_at_their_stability_functions_bound(method, ratio, bound):
    found = bisected(
        lambda h: spectral_radius(amplification(method, h, oscillator(1.0, ratio))) > 1.0 + 1e-12, 0.05, 4.0, 1e-9
    )
    assert found == pytest.approx(bound, rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("eccentricity", [0.3, 0.97])
def test_explicit_steps_in_the_film_as_it_is_end_where_its_tangents_say(method, eccentricity):
    law = film_law(entry.film_parameters(film_rotor(10.0, 1000.0)))
    film = film_at(eccentricity, law)
    expected = step_film_stiffness.theoretical_limit(method, step_film_stiffness.journal_system(film, 10.0))
    assert step_film_stiffness.marched_limit(method, film, 10.0, law) == pytest.approx(expected, rel=0.02)
    # Shorter than the default step, four times in a thick film and thousands of times in a thin one.
    assert expected < math.radians(2.5) / SPEED / 4.0


@pytest.mark.parametrize("method", INTEGRATORS)
def test_no_step_of_the_product_is_too_long_for_a_film_that_does_not_whirl(method):
    law, table = film_law(entry.film_parameters(film_rotor(10.0, 1000.0))), integrator_table(method)
    for eccentricity in (0.1, 0.6, 0.97):
        film = film_at(eccentricity, law)
        system = constant(film.stiffness / 10.0, film.damping / 10.0)
        for h in some(np.radians([0.01, 0.3, 2.5, 30.0, 360.0]) / SPEED):
            matrix = scaled(step_matrix(table, h, system), table, 1.0 / h)
            assert np.abs(np.linalg.eigvals(matrix)).max() < 1.0 + 1e-9, (eccentricity, h)


def test_the_products_step_takes_a_blow_on_a_thick_film_at_any_length():
    law = film_law(entry.film_parameters(film_rotor(10.0, 1000.0)))
    assert math.isinf(step_film_stiffness.product_limit(film_at(0.3, law), 10.0, 9))
    thin = step_film_stiffness.product_limit(film_at(0.97, law), 10.0, 9)
    assert math.radians(0.5) < thin < math.radians(10.0)


@pytest.mark.parametrize("degrees", [0.7, 2.5])
def test_a_contact_rings_as_powers_of_the_methods_matrix_say(degrees):
    contact, h = contact_ringing.Contact(), math.radians(degrees) / SPEED
    count = contact_ringing.SETTLING + contact_ringing.TAIL

    def left(forces):
        return contact_ringing.ringing(forces) > contact_ringing.LEFT

    def powers(rho):
        return contact_ringing.linear_forces(contact_ringing.with_radius(rho), contact.omega * h, count)

    expected = bisected(lambda rho: left(powers(rho)), 0, 1, 1e-5)
    found = bisected(lambda rho: left(contact.forces(h, count, contact_ringing.with_radius(rho))), 0, 1, 1e-4)
    assert found == pytest.approx(expected, rel=0.02)


def test_the_trapezoidal_rule_never_lets_a_contact_go():
    contact = contact_ringing.Contact()
    forces = contact.forces(math.radians(10.0) / SPEED, 200, contact_ringing.with_radius(1.0))
    assert np.abs(forces[150:]).max() > 0.9 * np.abs(forces).max()
    quiet = contact.forces(math.radians(10.0) / SPEED, 200, contact_ringing.with_radius(0.6))
    assert np.abs(quiet[150:]).max() < 1e-9 * np.abs(quiet).max()


def whirling_film():
    law = film_law(entry.film_parameters(film_rotor(10.0, 1000.0)))
    film = film_at(oil_whirl.ECCENTRICITY, law)
    return law, film, oil_whirl.threshold_mass(film, law[0])


@pytest.mark.parametrize(
    ("method", "off"),
    [("sdirk4", 2e-4), ("esdirk4", 2e-4), ("generalised-alpha:0.6", 2e-3), ("hht:-0.1", 2e-3), ("trapezoidal", 2e-3),
     ("bdf2", 5e-3), ("backward-euler", 0.12)],
)  # fmt: skip
def test_whirl_sets_in_where_the_film_and_the_methods_own_damping_say(method, off):
    law, film, critical = whirling_film()
    step = math.radians(5.0)
    expected = oil_whirl.whirl_onset(lambda mass: oil_whirl.linear_growth(method, step, law, film, mass), critical)
    found = oil_whirl.whirl_onset(
        lambda mass: oil_whirl.running_growth(method, step, film, mass), critical, 0.97 * expected, 1.03 * expected
    )
    assert found == pytest.approx(expected, rel=1e-3)
    # The film's own threshold is one.
    assert found == pytest.approx(1.0, abs=off)
    if method == "backward-euler":
        assert found > 1.08


def test_inner_damping_drives_the_rotor_above_the_published_threshold():
    case = CASES["jeffcott_internal_damping"]["inputs"]
    outer, inner = case["ce"], case["ci"]
    # The case's rotor, a thousand times as fast: ratios are what matter.
    rotor = rotating_damping.Laval(1.0, 1e3, 1e3 * outer, 1e3 * inner)
    found = bisected(lambda speed: rotor.growth(1e3 * speed) > 0.0, 2.0, 4.0, 1e-9)
    assert found == pytest.approx(3.0, abs=1e-6)
    values = rotor.eigenvalues(3.1e3)
    slow = values[np.abs(values.imag) < 1e4]
    # Forwards at ω_n: in the turning frame it falls back by Ω − ω_n.
    assert np.min(np.abs(np.abs(slow[slow.real > 0.0].imag) - 2.1e3)) < 10.0


@pytest.mark.parametrize(("method", "degrees"), rotating_damping.methods())
def test_steps_see_inner_damping_where_their_tables_say(method, degrees):
    step, outer, inner = math.radians(degrees), 0.02, 0.02
    expected = rotating_damping.method_onset(method, step, outer, inner)
    rotor = rotating_damping.Laval(1.0, 1e3, 1e3 * outer, 1e3 * inner, method)
    found = bisected(lambda s: rotor.step_radius(1e3 * s, step) > 1.0, 0.95 * expected, 1.05 * expected, 1e-5)
    assert found == pytest.approx(expected, rel=1e-3)
    late = expected / rotating_damping.threshold(outer, inner)
    assert late > 1.05 if method == "backward-euler" else late == pytest.approx(1.0, rel=1e-3)
