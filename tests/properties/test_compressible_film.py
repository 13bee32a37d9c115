"""Oil under pressure in the solver of any film: density and viscosity that grow with pressure.

Three references that share nothing with the solver: the slider's mass flow integrated by scipy from the place of
rupture, which is shot for; the gap of an elasto-hydrodynamic line contact, by the inverse method (Dowson and Higginson:
pressure given, the gap from the constant mass flow); a sealed chamber, in which ρ(p) h stays.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from cranktrain.engine.lubricant import DENSITY_LIMIT, DENSITY_SLOPE, ROELANDS_LOG, ROELANDS_PRESSURE, density_factor
from cranktrain.film.reynolds.field import Edges, Supply, solve_film

ETA, LENGTH, LEAST, OPENING = 0.02, 0.04, 1e-6, 20.0


def density(p):
    """Dowson and Higginson's, with its derivative."""
    p = np.maximum(p, 0.0)
    return 1 + DENSITY_SLOPE * p / (1 + DENSITY_LIMIT * p), DENSITY_SLOPE / (1 + DENSITY_LIMIT * p) ** 2


def roelands(alpha):
    above = np.log(ETA) + ROELANDS_LOG
    return lambda p: np.exp(above * ((1 + p / ROELANDS_PRESSURE) ** (alpha * ROELANDS_PRESSURE / above) - 1))


def parabola(x):
    return LEAST * (1 + OPENING * (2 * x / LENGTH) ** 2)


def shot(law, speed):
    """Largest pressure and load of a metre of the parabolic slider: p' from the mass flow, back from the rupture."""

    def back(rupture, dense=False):
        flow = 0.5 * speed * parabola(rupture)

        def slope(x, p):
            p = np.clip(p, -1e8, 3e9)
            h, r = parabola(x), density(p)[0]
            return 12 * ETA * law(p) * (0.5 * speed * h * r - flow) / (r * h**3)

        return solve_ivp(slope, (rupture, -0.5 * LENGTH), [0.0], "LSODA", rtol=1e-9, atol=1e-3, dense_output=dense)

    rupture = brentq(lambda x: back(x).y[0, -1], 0.002, 0.0032, xtol=1e-16)
    x = np.linspace(-0.5 * LENGTH, rupture, 20001)
    p = back(rupture, dense=True).sol(x)[0]
    return p.max(), np.trapezoid(p, x)


def slider(law, speed, n, **oil):
    h = parabola(np.linspace(-0.5 * LENGTH, 0.5 * LENGTH, n))[:, None]
    return solve_film(h, (LENGTH, 1.0), speeds=(speed, 0.0), viscosity=ETA, pressure_viscosity=law, **oil)


@pytest.mark.parametrize(("alpha", "speed", "highest", "without"), [
    (0.0, 0.5, 3.4e7, 0.011), (0.0, 15.0, 1.06e9, 0.088), (1.5e-8, 1.0, 2.0e8, 0.093),
], ids=["300 bar", "1 GPa", "Roelands, 2000 bar"])  # fmt: skip
def test_a_slider_of_compressible_oil_is_that_of_its_mass_flow(alpha, speed, highest, without):
    """Peak and load within 0.2 %, of second order; an incompressible oil is 1 to 13 % off."""
    law = roelands(alpha) if alpha else np.ones_like
    peak, load = shot(law, speed)
    assert peak == pytest.approx(highest, rel=0.02)
    errors = []
    for n in (201, 401, 801):
        film = slider(law, speed, n, density=density)
        assert film.mass_defect < 1e-8
        errors.append((abs(film.p_max / peak - 1), abs(film.load / load - 1)))
    assert max(errors[1]) < 2e-3 and max(errors[2]) < 5e-4
    assert np.log2(np.array(errors[0]) / errors[2]).min() > 3.0  # rupture falls between nodes: not quite four
    assert 1 - slider(law, speed, 801).load / load == pytest.approx(without, rel=0.1)


def line_contact(highest, alpha, n, half=2e-4, speed=5.0):
    """Gap at n places and pressure of a line contact, from the cubic of the mass flow; ruptured behind it."""
    x = np.linspace(-1.0, 1.5, n)
    p = highest * np.maximum(1 - x * x, 0) ** 2
    slope = np.where(abs(x) < 1, -4 * x * (1 - x * x) * highest, 0.0) / half
    per_gap = density(p)[0] * slope / (12 * ETA * roelands(alpha)(p))
    carried = 0.5 * speed * density(p)[0]
    centre = 1e-7 * (1e9 / highest) ** 0.5
    flow = 0.5 * speed * density(np.array(highest))[0] * centre
    h = flow / carried
    for _ in range(60):
        h = h - (carried * h - per_gap * h**3 - flow) / (carried - 3 * per_gap * h**2)
    h[x > 1] *= 1 + (x[x > 1] - 1) ** 2
    return h, p, 2.5 * half


@pytest.mark.parametrize("highest", [3e7, 2e8, 1e9], ids=["300 bar", "2000 bar", "1 GPa"])
def test_a_line_contact_of_the_inverse_method_gives_its_pressure_back(highest):
    """0.2 % from 300 bar to 1 GPa, where ρ h alone sets the pressure and comes from upstream: not of second order."""
    errors = []
    for n in (251, 501, 1001):
        h, p, length = line_contact(highest, 1.5e-8, n)
        film = solve_film(
            h[:, None], (length, 1.0), speeds=(5.0, 0.0), viscosity=ETA, pressure_viscosity=roelands(1.5e-8),
            density=density,
        )  # fmt: skip
        errors.append(abs(film.pressure[:, 0] - p).max() / highest)
    assert errors[-1] < 2e-3
    assert errors[0] > (2.0 if highest > 5e8 else 3.9) * errors[1]


def test_a_sealed_chamber_that_closes_keeps_its_mass():
    """No edge lets oil out: ρ(p) h is what it was, and the pressure follows from the density alone."""
    closed = Edges(None, None, None, None)
    sealed = {"edges": closed, "viscosity": ETA, "density": density}
    shape = np.full((7, 5), 1e-5)
    start = solve_film(shape, (0.01, 0.01), **sealed | {"edges": Edges()})
    for closing in (0.01, 0.05, 0.12):
        film = solve_film((1 - closing) * shape, (0.01, 0.01), **sealed, dt=1e-3, previous=start)
        wanted = 1 / (1 - closing) - 1
        expected = wanted / (DENSITY_SLOPE - DENSITY_LIMIT * wanted)
        assert film.pressure == pytest.approx(np.full((7, 5), expected), rel=1e-8)
        assert film.fill == pytest.approx(np.full((7, 5), 1 + wanted), rel=1e-9)


def test_a_compressible_bearing_film_steps_without_losing_oil():
    """Steps of a journal that moves, with rupture and a groove under pressure: the balance closes, p d = 0 holds."""
    phi, z = np.linspace(0, 2 * np.pi, 49)[:-1, None], np.linspace(-1, 1, 9)
    groove = np.zeros((48, 9), dtype=bool)
    groove[20, 3:6] = True
    film, highest, rng = None, 0.0, np.random.default_rng(3)
    e, where = 0.8, 1.0
    for _ in range(12):
        e, where = np.clip(e + rng.uniform(-0.1, 0.07), 0.4, 0.93), where + rng.uniform(-0.2, 0.4)
        h = 4e-5 * (1 - e * np.cos(phi - where) + 0.02 * z)
        options = {} if film is None else {"dt": rng.uniform(1e-3, 3e-3), "previous": film}
        film = solve_film(
            h, (0.13, 0.03), speeds=(8.0, 0.0), viscosity=ETA, pressure_viscosity=roelands(1.5e-8), density=density,
            periodic=True, supplies=[Supply("groove", groove, 4e5)], **options,
        )  # fmt: skip
        assert film.mass_defect < 1e-7
        highest = max(highest, film.p_max)
        full = film.fill >= 1.0
        assert film.pressure[~full].max(initial=0.0) == 0.0
        assert film.fill[full] == pytest.approx(density(film.pressure[full])[0], rel=1e-8)
    assert highest > 5e6


def test_density_of_the_oil_and_its_derivative():
    """Dowson and Higginson's figures: 1 + 0.6/2.7 at 1 GPa, never more than 1 + 0.6/1.7."""
    assert density_factor(1e9)[0] == pytest.approx(1 + 0.6 / 2.7, rel=1e-12)
    assert density_factor(1e15)[0] == pytest.approx(1 + 0.6 / 1.7, rel=1e-5)
    assert density_factor(-1e6) == (1.0, 0.0)
    for p in (1e5, 3e7, 4e8):
        difference = (density_factor(1.001 * p)[0] - density_factor(0.999 * p)[0]) / (0.002 * p)
        assert density_factor(p)[1] == pytest.approx(difference, rel=1e-5)
