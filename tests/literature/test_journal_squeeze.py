"""Squeeze of the journal film: forces in the short and long limits, and orbits under constant and alternating load.

Without rotation ε̇ follows from the load: F = −D ε̇ with the film's own damping, of approach or of retreat.
"""

import math

import numpy as np
import pytest
from expected import cases
from scipy.integrate import solve_ivp
from some import some

from cranktrain.film.journal.film import DAMPING, OUT_SIZE, journal_film
from cranktrain.film.journal.grid import Motion, cold_start, journal_grid, journal_work

SQUEEZE = cases("squeeze")
SHORT = 1e-3
UNIT = 6.0 / (2.0 * SHORT) ** 2
"""Force of F̂ in η R L³/c² ε̇, as F = 6 η R L (R/c)² F̂."""


class Resistance:
    """Force (on the film, in units of 6 η R L (R/c)²) over the rate of eccentricity, by its sign."""

    def __init__(self, grid, width_ratio):
        self.grid, self.ratio2 = grid, width_ratio**-2
        self.work, self.out = journal_work(grid), np.zeros(OUT_SIZE)
        self.active = cold_start(grid)

    def __call__(self, eps, rate):
        at = Motion(eps, 0.0, 0.0, 0.0, math.copysign(1.0, rate), 0.0, 0.0, 0.0)
        journal_film(self.grid, self.ratio2, at, self.work, self.active, self.out)
        return -self.out[DAMPING]


def orbit(resistance, load, eps, times):
    """Eccentricity at ``times``."""

    def rate(t, e):
        force = load(t)
        return force / resistance(e[0], force) if force != 0.0 else 0.0

    found = solve_ivp(rate, times[[0, -1]], [eps], t_eval=times, rtol=1e-6, atol=1e-8)
    assert found.success
    return found.y[0]


@pytest.mark.parametrize(("eps", "expected"), SQUEEZE["short_pifilm_squeeze"]["expected"]["J"].items())
def test_short_half_film_resists_as_the_closed_form(eps, expected):
    # A journal on the far side that moves towards the centre is one at |ε| that retreats from the wall.
    grids = [journal_grid(n, 24, half=True, rupture="guembel") for n in (192, 384)]
    coarse, fine = (UNIT * Resistance(g, 5e-4)(float(eps), 1.0) * (SHORT / 5e-4) ** 2 for g in grids)
    assert fine + (fine - coarse) / 3.0 == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("eps", [0.0, 0.3, 0.6, 0.9])
def test_full_films_resist_as_the_closed_forms(eps):
    short = [UNIT * Resistance(journal_grid(n, 24, half=True, rupture="full"), SHORT)(eps, 1.0) for n in (96, 192)]
    exact = math.pi * (1.0 + 2.0 * eps**2) / (1.0 - eps**2) ** 2.5
    assert short[1] + (short[1] - short[0]) / 3.0 == pytest.approx(exact, rel=1e-4)
    sealed = [journal_grid(n, 6, half=True, rupture="full", fed_at_widest=True, sealed=True) for n in (96, 192)]
    long = [6.0 * Resistance(g, 1.0)(eps, 1.0) for g in sealed]
    assert long[1] + (long[1] - long[0]) / 3.0 == pytest.approx(12.0 * math.pi / (1.0 - eps**2) ** 1.5, rel=1e-4)


@pytest.mark.parametrize("amplitude", [0.5, 1.0, 2.0, 5.0, 10.0, 50.0])
def test_orbits_of_full_films_under_alternating_load(amplitude):
    times = np.linspace(0.0, 0.5 * math.pi, 400)
    short = Resistance(journal_grid(96, 12, half=True, rupture="full"), SHORT)
    # F₀ = A π η R L³/c² ω, in the units of the resistance.
    path = orbit(short, lambda t: amplitude * math.pi / UNIT * math.cos(t), 0.0, times)
    expected = SQUEEZE["short_fullfilm_sinusoidal_squeeze"]["expected"]["eps_max"][str(amplitude)]
    assert path[-1] == pytest.approx(expected, rel=1e-3)
    sealed = Resistance(journal_grid(96, 6, half=True, rupture="full", fed_at_widest=True, sealed=True), 1.0)
    path = orbit(sealed, lambda t: amplitude * 2.0 * math.pi * math.cos(t), 0.0, times)
    assert path[-1] == pytest.approx(amplitude / math.hypot(1.0, amplitude), rel=1e-3)


def test_time_to_fall_under_constant_load():
    levels = SQUEEZE["short_pifilm_squeeze"]["expected"]["G"]
    resistance = Resistance(journal_grid(96, 16, half=True, rupture="guembel"), SHORT)
    times = np.array([0.0, *levels.values()])
    eps = 0.0
    for begin, end, level in some(zip(times, times[1:], levels, strict=False)):
        # F c² t/(η R L³) = G(ε): with unit load in those units, time is G.
        eps = orbit(resistance, lambda _: 1.0 / UNIT, eps, np.linspace(begin, end, 120))[-1]
        assert eps == pytest.approx(float(level), rel=1e-3)


@pytest.mark.parametrize(("drive", "expected"), SQUEEZE["short_pifilm_squeeze"]["expected"]["amplitudes"].items())
def test_periodic_orbit_of_a_half_film(drive, expected):
    resistance = Resistance(journal_grid(96, 16, half=True, rupture="guembel"), SHORT)
    turn = np.linspace(-0.5 * math.pi, 1.5 * math.pi, 801)
    path = orbit(resistance, lambda t: float(drive) / UNIT * math.cos(t), -expected, turn)
    assert path.max() == pytest.approx(expected, rel=1e-3)
    assert path[-1] == pytest.approx(-expected, rel=1e-3)
