"""The parabolic-profile film against published and two-dimensional solutions of Reynolds' equation.

Butenschön's tables (tests/data/bearing_static.json) hold for an axial groove at the widest gap, p = 0 there, and four
printed digits; our bore has no groove and reforms by Reynolds' condition. The groove matters at small eccentricity and
large width only: up to B/D = 0.4 the load is within 1 % to ε = 0.95, as the product claims for its range.
"""

import numpy as np
import pytest
from expected import cases
from some import some

from cranktrain.film.laws.parabolic import WORK_SIZE, film_force, friction_torque, node_table
from cranktrain.film.laws.parameters import CLEARANCE, COLUMNS, RADIUS, VISCOSITY, WIDTH
from cranktrain.film.reynolds.field import Edges, solve_film

STATIC = cases("bearing_static")
SQUEEZE = cases("squeeze")
NODES = node_table()
WIDTH_RATIO = 30.0 / 85.0  # main bearings of the six


def parabolic(eps, v_r, v_t, width_ratio):
    """Force (2,) on axes along and across the line of centres, in units of η R L (R/c)² × velocity / c."""
    out = np.zeros(2)
    film_force(eps, v_r, v_t, 10 / (2 * width_ratio) ** 2, NODES, np.zeros(WORK_SIZE), np.zeros(2), out)
    return 10 * out[:2]


def reynolds(eps, v_r, v_t, width_ratio, around=360, across=14):
    """The same of the general film, which ``test_reynolds_closed_forms.py`` holds to closed forms; half the width."""
    psi = 2 * np.pi * np.arange(around) / around
    film, closing = (
        np.repeat(values[:, None], across + 1, axis=1)
        for values in (1 - eps * np.cos(psi), v_r * np.cos(psi) + v_t * np.sin(psi))
    )
    solved = solve_film(
        film, (2 * np.pi, width_ratio), squeeze=-closing, viscosity=1.0, periodic=True, cavitation="reynolds",
        edges=Edges(z0=None),
    )  # fmt: skip
    pull = (solved.pressure * solved.areas).sum(axis=1)
    return np.array([pull @ np.cos(psi), pull @ np.sin(psi)]) / width_ratio


@pytest.mark.parametrize("width_ratio", [0.4, 1 / 3, 0.25, 0.2, 1 / 6, 0.125])
def test_load_of_the_steady_journal_is_butenschoens(width_ratio):
    case = STATIC["butenschoen_rotation"]
    column = int(np.argmin(np.abs(np.array(case["inputs"]["B_over_D"]) - width_ratio)))
    for row, eps in some(enumerate(case["inputs"]["eps"])):
        if eps > 0.95:
            continue
        radial, across = parabolic(eps, 0.0, -0.5 * eps, width_ratio)
        printed = case["expected"]["So"][row][column]
        # One per cent, and half of the last printed digit.
        assert 0.5 * np.hypot(radial, across) == pytest.approx(printed, rel=0.01, abs=0.5e-4), eps
        attitude = np.degrees(np.arctan2(-across, radial))
        # Without the groove pressure builds up earlier at small loads: up to a degree at B/D = 0.4.
        assert attitude == pytest.approx(case["expected"]["beta_deg"][row][column], abs=1.0 if eps < 0.5 else 0.25), eps


@pytest.mark.parametrize("eps", [0.2, 0.6, 0.8, 0.9, 0.95])
def test_force_is_within_one_percent_of_two_dimensional_reynolds(eps):
    for direction in some(np.radians([0, 45, 90, 135, 180])):
        v = np.cos(direction), np.sin(direction)
        two_dimensional = reynolds(eps, *v, WIDTH_RATIO)
        error = np.linalg.norm(parabolic(eps, *v, WIDTH_RATIO) - two_dimensional) / np.linalg.norm(two_dimensional)
        assert error < 0.01, (np.degrees(direction), error)


def test_the_two_dimensional_reference_is_converged():
    coarse, fine = reynolds(0.95, 0.5, -0.8, WIDTH_RATIO), reynolds(0.95, 0.5, -0.8, WIDTH_RATIO, 540, 21)
    assert np.linalg.norm(coarse - fine) < 2e-3 * np.linalg.norm(fine)


@pytest.mark.parametrize(
    ("eps", "expected"), [(float(e), j) for e, j in SQUEEZE["short_pifilm_squeeze"]["expected"]["J"].items()]
)
def test_squeeze_of_a_short_film_tends_to_the_closed_form(eps, expected):
    # F = η R L³/c² ε̇ J(ε): the parabola is exact in the limit; at L/D = r the next term is of the order r²/(1 − ε).
    # A journal on the far side that moves towards the centre is one at |ε| that moves away from the wall.
    approach = 1.0 if eps >= 0 else -1.0

    def error(ratio):
        force = parabolic(abs(eps), approach, 0.0, ratio)[0] / (2 * ratio) ** 2
        return abs(approach * force / expected - 1)

    assert error(0.01) < 2e-3
    assert error(0.01) < 0.5 * error(0.04)


@pytest.mark.parametrize("row", STATIC["short_bearing_static"]["expected"]["table"], ids=lambda row: f"eps {row[0]}")
def test_a_short_steady_film_carries_ocvirks_load(row):
    # Gümbel's half film is where Reynolds' rupture goes as the width vanishes; the 96 nodes leave 2e-3 at ε = 0.95.
    eps, load, attitude = row
    radial, across = parabolic(eps, 0.0, -0.5 * eps, 0.005)
    assert np.hypot(radial, across) / 0.01**2 == pytest.approx(load, rel=3e-3)
    assert np.degrees(np.arctan2(-across, radial)) == pytest.approx(attitude, abs=0.2)


@pytest.mark.parametrize("eps", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("speed", [300.0, -300.0])
def test_friction_of_sommerfelds_film_is_sommerfelds(eps, speed):
    """Journal of an infinitely long bearing whose film stays filled, A. Sommerfeld, Z. Math. Phys. 50 (1904) 97:

    W = 12π η ω L R (R/c)² ε / [(2 + ε²) √(1 − ε²)] square to the line of centres,
    M = 4π η ω L R³/c (1 + 2ε²) / [(2 + ε²) √(1 − ε²)] on the journal.
    """
    eta, radius, width, clearance = 0.01, 0.04, 0.03, 40e-6
    bearing = np.zeros(COLUMNS)
    bearing[[VISCOSITY, RADIUS, WIDTH, CLEARANCE]] = eta, radius, width, clearance
    root = (2.0 + eps**2) * np.sqrt(1.0 - eps**2)
    load = 12.0 * np.pi * eta * speed * width * radius * (radius / clearance) ** 2 * eps / root
    torque = 4.0 * np.pi * eta * speed * width * radius**3 / clearance * (1.0 + 2.0 * eps**2) / root
    # The film rises ahead of the least gap: it pushes the journal on in the sense of rotation, as this law's does.
    across = parabolic(eps, 0.0, -0.5 * eps * np.sign(speed), WIDTH_RATIO)[1]
    assert np.sign(-across) == np.sign(speed)
    for angle in (0.0, 2.0):
        along, square = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        found = friction_torque(eps, load * square, eps * clearance * along, bearing, speed)
        assert found == pytest.approx(-torque, rel=1e-12)
