"""Oil under pressure in the elastic film: the laws' tables, tangents, balance, and the solver of any film beside it."""

from dataclasses import replace

import numpy as np
import pytest
from elastic_bearing import (
    CLEARANCE,
    DIAMETER,
    SPEED,
    VISCOSITY,
    WIDTH,
    Bearing,
    carry,
    fill_up,
    follow,
    grooved,
    tangent_errors,
)

from cranktrain.engine.file import load_engine
from cranktrain.engine.lubricant import density_factor, pressure_constants, pressure_factor
from cranktrain.film.elastic.grid import FILM_MIN, FRICTION_TORQUE, PRESSURE_MAX, ElasticGrid
from cranktrain.film.elastic.oil import HIGHEST, oil_tables, reduced_pressure
from cranktrain.film.reynolds.field import Supply, solve_film

PLAIN = replace(load_engine("diesel_i6").oil, pressure_viscosity=20e-9)
BARUS = replace(PLAIN, pressure_law="barus")
BOTH = replace(PLAIN, pressure_law="roelands", compressibility="dowson-higginson")


def tables(oil):
    return oil_tables(oil, np.array([VISCOSITY]))


def test_an_oil_that_pressure_leaves_alone_has_no_table():
    assert tables(PLAIN) is None


def test_reduced_pressure_of_barus_oil_is_its_closed_form():
    step, values, _ = tables(BARUS)
    for p in np.random.default_rng(0).uniform(0, HIGHEST, 300):
        q, slope, curve = reduced_pressure(values[0], step, p)
        assert q == pytest.approx(-np.expm1(-20e-9 * p) / 20e-9, rel=2e-7, abs=10.0)
        assert slope == pytest.approx(np.exp(-20e-9 * p), rel=1e-4)
        assert curve == pytest.approx(-20e-9 * np.exp(-20e-9 * p), rel=0.02)
    assert reduced_pressure(values[0], step, 2 * HIGHEST)[1] == pytest.approx(np.exp(-20.0), rel=1e-9)


@pytest.mark.parametrize("oil", [BARUS, replace(PLAIN, compressibility="dowson-higginson"), BOTH])
@pytest.mark.parametrize(("count", "highest"), [(0, 0.8), (7, 0.95)])
def test_tangents_are_derivatives_of_the_forces(oil, count, highest):
    bearing = grooved(count=count, softness=0.1, oil=tables(oil))
    worst, pressures = [], []

    def check(n, position, velocity, h):
        pressures.append(bearing.out[PRESSURE_MAX])
        if n % 14:
            return
        worst.extend(tangent_errors(bearing, position, velocity, h))

    follow(bearing, 71, highest, visit=check)
    assert 1.5e7 < max(pressures) < 4e8
    assert np.median(worst) < 1e-4 and np.quantile(worst, 0.9) < 3e-3


def field_law(oil):
    law, first, second = pressure_constants(oil, VISCOSITY)
    return np.vectorize(lambda p: pressure_factor(law, p, first, second)[0])


def test_a_rigid_steady_film_is_that_of_the_solver_of_any_film():
    """The same bearing by the complementarity of ``solve_film``: force and peak within 1 %; constant oil is far off."""
    grid = ElasticGrid(96, 11)
    line = np.zeros((grid.n_phi, grid.n_z))
    line[0] = 1
    bearing = Bearing(grid, supply=line, oil=tables(BOTH))
    eps, where = 0.85, np.pi
    force = bearing.settle([eps * CLEARANCE * np.cos(where), 0, 0, 0])
    phi, z = grid.angles[:, None], 0.5 * WIDTH * (grid.zetas + 1)
    h = CLEARANCE * (1 - eps * np.cos(phi - where)) * np.ones_like(z)
    fed = np.zeros(h.shape, dtype=bool)
    fed[0] = True

    def solved(**oil):
        film = solve_film(
            h, (np.pi * DIAMETER, WIDTH), speeds=(SPEED * 0.5 * DIAMETER, 0.0), viscosity=VISCOSITY, periodic=True,
            supplies=[Supply("line", fed, 0.0)], nodes=(0.5 * DIAMETER * grid.angles, z), **oil,
        )  # fmt: skip
        pressed = film.pressure * film.areas
        return film.p_max, np.array([-(pressed * np.cos(phi)).sum(), -(pressed * np.sin(phi)).sum()])

    peak, expected = solved(pressure_viscosity=field_law(BOTH), density=np.vectorize(density_factor))
    constant, _ = solved()
    assert peak > 1.2 * constant
    assert bearing.out[PRESSURE_MAX] == pytest.approx(peak, rel=0.01)
    assert force[:2] == pytest.approx(expected, rel=0.01, abs=0.01 * abs(expected).max())


def test_compressible_oil_of_a_filling_bearing_is_what_the_groove_gave():
    bearing = grooved(oil=tables(BOTH))
    # What Newton's last step left over: its square.
    fill_up(bearing, CLEARANCE * np.array([0.4, -0.65, 0.0, 0.02]), 0.7, 100, 3e-6)
    assert bearing.out[PRESSURE_MAX] > 1e7


def test_oil_that_thickens_with_pressure_carries_on_a_thicker_film_with_more_friction():
    """Under one load: an elastic bearing between constant oil and Barus; Roelands, slower at high pressure, between."""
    load = np.array([3e3, -60e3, 0, 0])
    least, torque = {}, {}
    for name in ("none", "roelands", "barus"):
        bearing = grooved(count=7, oil=tables(replace(PLAIN, pressure_law=name)))
        record = FILM_MIN, FRICTION_TORQUE, PRESSURE_MAX
        rows = carry(bearing, lambda angle: load * min(angle, 1.0), np.radians(4), 60, record=record)
        least[name], torque[name], peak = rows[-1]
    assert least["none"] < 0.9 * least["roelands"] and least["roelands"] < least["barus"]
    assert abs(torque["none"]) < abs(torque["roelands"])
    assert peak > 8e7
