"""The general film against closed forms: sliders, Petroff, long and short journal bearings, rupture and reformation."""

from itertools import pairwise
from math import pi

import numpy as np
import pytest
from expected import cases
from scipy.integrate import fixed_quad
from scipy.optimize import brentq

from cranktrain.film.reynolds.field import Edges, Supply, solve_film

CAVITATION = cases("cavitation")
LONG = cases("bearing_static")["long_bearing"]
SHORT = cases("bearing_static")["short_bearing_static"]


def tapered_slider(along_x):
    case = CAVITATION["tapered_slider_squeeze_pressure_bc"]
    values = case["inputs"]["example"]
    z = np.linspace(0.0, values["B"], 401)
    h = values["h0"] + values["dh_dz"] * z
    common = {"viscosity": values["eta"], "squeeze": values["dh_dt"], "cavitation": "full"}
    p0, p1 = values["p0"], values["p1"]
    if along_x:
        film = solve_film(h[:, None], (values["B"], 1.0), speeds=(values["U"], 0.0), edges=Edges(p0, p1), **common)
        return case, z, film.pressure[:, 0], -film.flows["x0"], film.flows["x1"]
    film = solve_film(
        np.broadcast_to(h, (7, 401)), (1.0, values["B"]), cross_speeds=(0.0, values["U"]),
        edges=Edges(None, None, p0, p1), **common,
    )  # fmt: skip
    return case, z, film.pressure[3], -film.flows["z0"], film.flows["z1"]


@pytest.mark.parametrize("along_x", [True, False])
def test_tapered_slider_with_squeeze_and_edge_pressures(along_x):
    case, z, pressure, inflow, outflow = tapered_slider(along_x)
    values = case["inputs"]["example"]
    names = {k: values[k] for k in ("h0", "B", "dh_dz", "p0", "p1", "eta", "dh_dt")}
    names |= {"U1z": values["U"], "U2z": 0.0, "rho": 1.0}
    expected = eval(case["expected"]["formula"], {"z": z} | names)
    assert np.abs(pressure - expected).max() < 1e-4 * np.abs(expected).max()
    for place, value in case["expected"]["example_p"].items():
        assert np.interp(float(place), z, pressure) == pytest.approx(value, rel=1e-4)
    for place, flow in ((0.0, inflow), (values["B"], outflow)):
        assert flow == pytest.approx(eval(case["expected"]["mdot_per_width_times_dx"], {"z": place} | names), rel=1e-4)


def test_petroffs_friction():
    d, clearance, width, eta, omega = 0.05, 5e-5, 0.03, 0.02, (300.0, -40.0)
    diameter = d + 2 * clearance
    h = np.full((36, 5), clearance)
    speeds = (omega[0] * d / 2, omega[1] * d / 2)
    film = solve_film(h, (pi * d, width), speeds=speeds, viscosity=eta, periodic=True, cavitation="full")
    power = -(film.drag[0][0] * speeds[0] + film.drag[1][0] * speeds[1])
    formula = CAVITATION["petroff"]["expected"]["P"].replace("^", "**")
    names = {"eta": eta, "d": d, "D": diameter, "B": width, "pi": pi, "omega1": omega[0], "omega2": omega[1]}
    assert power == pytest.approx(eval(formula, names), rel=1e-4)


def long_bearing(eps, cavitation, n):
    """Fr (against the eccentricity), Ft, p_max and end of the film (degrees from the largest gap); η = U = L = c = 1.

    Forces in η ω R L (R/c)², pressures in η ω (R/c)²: with c = 1 and R = 1 (the equation knows no other ratio).
    """
    theta = 2 * pi * np.arange(n) / n  # from the largest gap
    edge = np.zeros((n, 1), dtype=bool)
    edge[0] = True
    film = solve_film(
        (1 + eps * np.cos(theta))[:, None], (2 * pi, 1.0), speeds=(1.0, 0.0), viscosity=1.0, periodic=True,
        cavitation=cavitation, supplies=[Supply("largest gap", edge, 0.0)],
    )  # fmt: skip
    weighted = film.pressure[:, 0] * film.areas[:, 0]
    return np.array([-(weighted * np.cos(theta)).sum(), (weighted * np.sin(theta)).sum(), film.p_max])


def extrapolated(function, coarse):
    """Richardson's value of a second-order result from two grids."""
    return (4 * function(2 * coarse) - function(coarse)) / 3


@pytest.mark.parametrize("eps", [0.1, 0.4, 0.6, 0.8, 0.9])
def test_long_bearing_is_sommerfelds_and_its_half_guembels(eps):
    across = 12 * pi * eps / ((2 + eps**2) * np.sqrt(1 - eps**2))
    found = extrapolated(lambda n: long_bearing(eps, "full", n), 1440)
    assert found[:2] == pytest.approx([0.0, across], rel=1e-6, abs=1e-6 * across)
    found = extrapolated(lambda n: long_bearing(eps, "guembel", n), 1440)
    assert found[:2] == pytest.approx([12 * eps**2 / ((2 + eps**2) * (1 - eps**2)), 0.5 * across], rel=1e-5)


@pytest.mark.parametrize("row", LONG["expected"]["reynolds"], ids=lambda row: f"eps {row[0]}")
def test_long_bearing_that_ruptures(row):
    assert long_bearing(row[0], "reynolds", 720) == pytest.approx(row[1:4], rel=1e-3)
    # Fed full at the largest gap, a conserving film ruptures at the same place.
    assert long_bearing(row[0], "mass-conserving", 720) == pytest.approx(row[1:4], rel=1e-3)


@pytest.mark.parametrize("row", SHORT["expected"]["table"], ids=lambda row: f"eps {row[0]}")
def test_short_bearing_is_ocvirks(row):
    eps, load, attitude = row
    width = 0.004 * np.sqrt(1 - eps)  # L/R; the next term is of the order (L/R)²/(1 − ε)

    def force(n):
        phi = 2 * pi * np.arange(6 * n) / (6 * n)
        # Half the width, symmetric about z = 0.
        film = solve_film(
            np.repeat(1 - eps * np.cos(phi)[:, None], n // 5 + 1, axis=1), (2 * pi, width / 2), speeds=(1.0, 0.0),
            viscosity=1.0, periodic=True, cavitation="guembel", edges=Edges(z0=None),
        )  # fmt: skip
        pull = 2 * film.pressure * film.areas / width**3
        return np.array([(pull.T @ np.cos(phi)).sum(), (pull.T @ np.sin(phi)).sum()])

    along, across = extrapolated(force, 80)
    assert np.hypot(along, across) == pytest.approx(load, rel=1e-4)
    assert np.degrees(np.arctan2(-across, along)) == pytest.approx(attitude, abs=0.01)


# Rupture and reformation in one dimension: docs/decisions/0013-oil.md derives both solutions.

ETA, MEAN_SPEED, LENGTH = 0.02, 2.0, 0.02


class LinearFilm:
    """A film that is linear between points, and its integrals ∫ (Ū h − q) 12η/h³ x^k dx, k = 0, 1."""

    def __init__(self, places, films):
        self.places, self.films = np.array(places), np.array(films)

    def __call__(self, x):
        return np.interp(x, self.places, self.films)

    def integrals(self, start, end, flow):
        knots = [start, *(x for x in self.places if start < x < end), end]

        def slope(x, k):
            return 12 * ETA * (MEAN_SPEED * self(x) - flow) / self(x) ** 3 * x**k

        return [sum(fixed_quad(slope, a, b, (k,), n=40)[0] for a, b in pairwise(knots)) for k in (0, 1)]


def double_wedge():
    """Film, flow per width, load per width, and the fronts of a wedge that ruptures and a second one that refills."""
    film = LinearFilm([0.0, 0.4 * LENGTH, 0.6 * LENGTH, LENGTH], [2.2e-5, 1e-5, 2.5e-5, 0.9e-5])

    def front(x):  # pressure is zero at the inlet and, with its slope, at the front of rupture
        return film.integrals(0.0, x, MEAN_SPEED * film(x))[0]

    rupture = brentq(front, 0.401 * LENGTH, 0.59 * LENGTH, xtol=1e-15)
    flow = MEAN_SPEED * film(rupture)

    def behind(x):  # pressure is zero at the front of reformation and at the outlet
        return film.integrals(x, LENGTH, flow)[0]

    reformation = brentq(behind, rupture * 1.001, 0.95 * LENGTH, xtol=1e-15)
    assert film(reformation) * MEAN_SPEED > flow
    # The pressure is zero at both ends of each zone: ∫p dx = −∫x p' dx.
    load = -film.integrals(0.0, rupture, flow)[1] - film.integrals(reformation, LENGTH, flow)[1]
    return film, flow, load, rupture, reformation


def conserving(h, **options):
    return solve_film(np.asarray(h)[:, None], (LENGTH, 1.0), speeds=(2 * MEAN_SPEED, 0.0), viscosity=ETA, **options)


def test_double_wedge_ruptures_and_refills():
    film, flow, load, rupture, reformation = double_wedge()
    x = np.linspace(0.0, LENGTH, 1601)
    solved = conserving(film(x))
    assert solved.load == pytest.approx(load, rel=1e-3)
    assert solved.flows["x1"] == pytest.approx(flow, rel=1e-3)
    assert -solved.flows["x0"] == pytest.approx(flow, rel=1e-3)
    empty = x[solved.ruptured[:, 0]]
    assert empty[0] == pytest.approx(rupture, abs=2 * x[1])
    assert empty[-1] == pytest.approx(reformation, abs=2 * x[1])
    # In between the fill is what the flow leaves in the gap; a node's fill stands for the face behind it.
    inside = solved.ruptured[:, 0] & (x > rupture + x[1]) & (x < reformation - 2 * x[1])
    assert solved.fill[inside, 0] == pytest.approx(flow / (MEAN_SPEED * film(x[inside] + 0.5 * x[1])), rel=1e-3)


def test_the_load_of_the_double_wedge_converges():
    film, _, load, _, _ = double_wedge()
    errors = [abs(conserving(film(np.linspace(0.0, LENGTH, n + 1))).load / load - 1) for n in (100, 1600)]
    # At least first order, on fronts that fall anywhere between nodes.
    assert errors[1] < errors[0] / 12


@pytest.mark.parametrize("reverse", [False, True])
def test_pocket_slider_ruptures_at_its_step_and_refills(reverse):
    land, pocket, inlet, outlet = 1e-5, 2.5e-5, 1e6, 3e5
    a, b = 0.25 * LENGTH, 0.75 * LENGTH
    flow = MEAN_SPEED * land + land**3 * inlet / (12 * ETA * a)
    peak = outlet + inlet * (LENGTH - b) / a
    slope = 12 * ETA * (MEAN_SPEED * pocket - flow) / pocket**3
    reformation = b - peak / slope
    assert a < reformation < b
    load = 0.5 * inlet * a + 0.5 * peak * (b - reformation) + 0.5 * (peak + outlet) * (LENGTH - b)
    n = 1000
    cells = np.full((n, 1), land)
    cells[n // 4 : 3 * n // 4] = pocket
    ends = (outlet, inlet) if reverse else (inlet, outlet)
    direction = -1.0 if reverse else 1.0
    solved = solve_film(
        cells, (LENGTH, 1.0), speeds=(0.0, direction * 2 * MEAN_SPEED), viscosity=ETA, edges=Edges(*ends), stepped=True
    )
    assert solved.load == pytest.approx(load, rel=1e-3)
    assert solved.flows["x0" if reverse else "x1"] == pytest.approx(flow, rel=1e-3)
    assert solved.p_max == pytest.approx(peak, rel=1e-3)
    empty = solved.x[solved.ruptured[:, 0]]
    empty = LENGTH - empty[::-1] if reverse else empty
    assert (empty[0], empty[-1]) == pytest.approx((a, reformation), abs=2 * LENGTH / n)
    assert solved.mass_defect < 1e-10


def test_rayleighs_step():
    # Two lands of 2.2 : 1, classical: the peak at the step balances both flows exactly.
    deep, shallow, step = 2.2e-5, 1e-5, 0.7 * LENGTH
    n = 100
    cells = np.full((n, 1), shallow)
    cells[:70] = deep
    solved = conserving(cells[:, 0], stepped=True)
    peak = 12 * ETA * MEAN_SPEED * (deep - shallow) / (deep**3 / step + shallow**3 / (LENGTH - step))
    assert solved.p_max == pytest.approx(peak, rel=1e-9)
    assert solved.load == pytest.approx(0.5 * peak * LENGTH, rel=1e-9)


def test_a_starved_inlet_refills_where_the_flow_says():
    film = LinearFilm([0.0, LENGTH], [2.4e-5, 1e-5])
    # The given fill is that of the first face, which lies half a step inside.
    flow = 0.5 * MEAN_SPEED * film(0.5 * LENGTH / 1600)
    reformation = brentq(lambda x: film.integrals(x, LENGTH, flow)[0], 1e-3 * LENGTH, 0.8 * LENGTH, xtol=1e-15)
    solved = conserving(film(np.linspace(0.0, LENGTH, 1601)), edges=Edges(fill=0.5))
    assert solved.flows["x1"] == pytest.approx(flow, rel=1e-7)
    assert solved.load == pytest.approx(-film.integrals(reformation, LENGTH, flow)[1], rel=1e-3)
