"""Films between rough surfaces, by the flow factors of Patir and Cheng, where one integral or less gives the result."""

import math

import numpy as np
import pytest
from one_line import one_line
from scipy.integrate import cumulative_simpson, simpson

from cranktrain.film.reynolds.field import solve_film
from cranktrain.film.reynolds.flow_factors import (
    flow_factor_constants,
    mean_gap,
    pressure_flow_factor,
    shear_flow_factor,
)
from cranktrain.film.reynolds.rough_gap import Roughness
from cranktrain.film.reynolds.supply import Edges

ETA, SIGMA, LENGTH, WIDTH = 0.01, 1e-6, 0.02, 0.03
PATTERNS = (1 / 6, 1.0, 6.0)


def factor(h, pattern):
    return pressure_flow_factor(h / SIGMA, flow_factor_constants(pattern))[0]


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("stepped", [False, True])
@pytest.mark.parametrize("along", [True, False])
def test_pressure_drives_the_flow_of_its_factor_through_a_parallel_gap(pattern, stepped, along):
    h, pressure = 3 * SIGMA, 2e5
    edges = Edges(x0=pressure, x1=0.0, z0=None, z1=None) if along else Edges(x0=None, x1=None, z0=pressure, z1=0.0)
    cells = (10, 6) if stepped else (11, 7)
    film = solve_film(
        np.full(cells, h), (LENGTH, WIDTH), viscosity=ETA, edges=edges, cavitation="full", stepped=stepped,
        roughness=Roughness(SIGMA, pattern),
    )  # fmt: skip
    area, out, gamma = (WIDTH / LENGTH, "x1", pattern) if along else (LENGTH / WIDTH, "z1", 1 / pattern)
    expected = factor(h, gamma) * h**3 * pressure * area / (12 * ETA)
    assert film.flows[out] == pytest.approx(expected, rel=1e-10)
    assert film.mass_defect < 1e-10


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("bias", [-1.0, 0.0, 0.5, 1.0])
def test_infinitely_wide_wedge(pattern, bias):
    """dp/dx = 12 η (½ U h_T + ½ U σ φ_s − q)/(φ_x h³), q such that p vanishes at both ends; by quadrature."""
    speed, n = 5.0, 801
    x = np.linspace(0.0, LENGTH, n)
    h = (6.0 - 4.0 * x / LENGTH) * SIGMA
    constants = flow_factor_constants(pattern)
    gap = SIGMA * np.array([mean_gap(r)[0] for r in h / SIGMA])
    slip = SIGMA * bias * np.array([shear_flow_factor(r, constants)[0] for r in h / SIGMA])
    resistance = 12 * ETA / (np.array([factor(v, pattern) for v in h]) * h**3)
    carried = 0.5 * speed * (gap + slip)
    flow = simpson(resistance * carried, x=x) / simpson(resistance, x=x)
    expected = cumulative_simpson(resistance * (carried - flow), x=x, initial=0.0)
    film = solve_film(
        h[:, None], (LENGTH, WIDTH), speeds=(speed, 0.0), viscosity=ETA, cavitation="full",
        roughness=Roughness(SIGMA, pattern, bias),
    )  # fmt: skip
    assert film.pressure[:, 0] == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())
    assert film.flows["x1"] == pytest.approx(flow * WIDTH, rel=1e-4)


def test_squeeze_of_a_parallel_strip_closes_the_mean_gap():
    """p = 6 η (−dh_T/dt) x (L − x)/(φ_x h³)."""
    h, rate = 1.0 * SIGMA, -1e-4
    film = solve_film(
        np.full((41, 1), h), (LENGTH, WIDTH), squeeze=rate, viscosity=ETA, cavitation="full", roughness=Roughness(SIGMA)
    )
    closing = -rate * 0.5 * math.erfc(-1.0 / math.sqrt(2.0))
    expected = 6 * ETA * closing * film.x * (LENGTH - film.x) / (factor(h, 1.0) * h**3)
    assert film.pressure[:, 0] == pytest.approx(expected, rel=1e-9, abs=1e-9 * expected.max())


@pytest.mark.parametrize("cavitation", ["full", "guembel", "reynolds", "mass-conserving"])
def test_smooth_limit(cavitation):
    x = np.arange(60) / 60 * 2 * math.pi
    h = 40e-6 * (1 - 0.6 * np.cos(x))[:, None] * np.ones(9)
    common = {"speeds": (8.0, 0.0), "viscosity": ETA, "periodic": True, "cavitation": cavitation}
    smooth = solve_film(h, (0.13, WIDTH), **common)
    rough = solve_film(h, (0.13, WIDTH), **common, roughness=Roughness(1e-10, bias=1.0))
    assert rough.pressure == pytest.approx(smooth.pressure, abs=1e-6 * smooth.p_max)
    assert rough.fill == pytest.approx(smooth.fill, abs=1e-6)


def test_a_time_step_conserves_the_oil_of_the_mean_gap():
    h = np.linspace(4.0, 2.0, 31)[:, None] * SIGMA * np.ones(5)
    common = {"speeds": (1.0, 0.0), "viscosity": ETA, "roughness": Roughness(SIGMA, 3.0, 0.3)}
    first = solve_film(h, (LENGTH, WIDTH), **common)
    dt = 1e-4
    second = solve_film(h - 0.1 * SIGMA, (LENGTH, WIDTH), **common, dt=dt, previous=first)
    grown = ((second.h * second.fill - first.h * first.fill) * first.areas).sum() / dt
    assert grown == pytest.approx(-sum(second.flows.values()), rel=1e-9)
    assert second.mass_defect < 1e-10


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"height": 0.0}, "height 0 m must be above zero"),
        ({"height": math.nan}, "must be above zero"),
        ({"bias": 1.5}, "bias 1.5 is not within -1 to 1"),
        ({"pattern": 20.0}, "outside the published 1/9 to 9"),
    ],
)
def test_roughness_without_factors_is_refused(changes, said):
    with one_line(said):
        Roughness(**{"height": SIGMA} | changes)
