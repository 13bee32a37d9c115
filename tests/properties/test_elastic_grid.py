"""Axial lines of an elastic film: grooves end at lines, sums over pressure are exact, flows are those of wedges."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from elastic_bearing import follow, grooved
from one_line import one_line

from cranktrain.engine.file import load_engine
from cranktrain.film.elastic.begin import prepare_step, turn_geometry
from cranktrain.film.elastic.grid import ElasticGrid
from cranktrain.film.elastic.workspace import START_PLACE, WEIGHT, lane_work
from cranktrain.film.laws.ehd import FINE, IN_LOOP, elastic_arrays
from cranktrain.structure.block.saddle import bore_compliance

GRIDS = list(itertools.product(range(5, 17), (0.0, 0.5, 0.9), (0.0, 0.05, 0.133, 0.3, 0.5, 0.9)))


@pytest.mark.parametrize(("n_z", "edge", "groove"), GRIDS)
def test_lines_are_symmetric_increasing_and_mark_the_groove(n_z, edge, groove):
    zetas = ElasticGrid(48, n_z, edge, groove).zetas
    assert zetas.size == n_z + 2
    assert zetas[0] == -1.0 and zetas[-1] == 1.0
    assert np.diff(zetas).min() > 0.0
    assert zetas == pytest.approx(-zetas[::-1], abs=1e-15)
    if groove:
        assert np.abs(np.abs(zetas) - groove).min() < 1e-14
        # Two spacings of each land at least: one node between the groove and the end.
        assert (zetas > groove + 1e-12).sum() >= 2


@pytest.mark.parametrize("groove", [0.02, 0.133, 0.2, 0.3, 0.5, 0.9])
def test_given_lines_stay_where_they_are_but_for_a_wide_groove(groove):
    """Between the groove's edge and the end; the edges stay lines, and a groove that is too wide pushes the others."""
    zetas = ElasticGrid(FINE.n_phi, FINE.n_z, groove=groove, lands=FINE.lands).zetas
    assert zetas.size == FINE.n_z + 2 and zetas[-1] == 1.0
    assert np.diff(zetas).min() > 0.0
    assert zetas == pytest.approx(-zetas[::-1], abs=1e-15)
    assert np.abs(zetas - groove).min() < 1e-14
    if groove <= 0.5 * FINE.lands[0]:
        assert zetas[-4:-1] == pytest.approx(FINE.lands)
    # Spacings of the land keep their ratios otherwise.
    rest = (1.0 - zetas[-4:-1]) / (1.0 - zetas[-4])
    assert rest == pytest.approx((1.0 - np.array(FINE.lands)) / (1.0 - FINE.lands[0]))


@pytest.mark.parametrize("lands", [(0.4, 0.6), (0.6, 0.4, 0.8), (0.4, 0.6, 1.0), (0.0, 0.5, 0.8)])
def test_lines_that_do_not_fit_are_refused_in_one_line(lands):
    with one_line("do not fit 8 lines; give half as many less one"):
        ElasticGrid(48, 8, lands=lands)


def start_weights(film, place):
    """Weights of all lines, (48, n_z + 2), of a full film whose journal is at ``place`` in clearances."""
    work = lane_work(film)
    turn_geometry(film, work, 0, 0, 0)
    work.wide[START_PLACE : START_PLACE + 4] = place
    prepare_step(film, work, 0, np.zeros((1, film.supply.size)))
    return work.nodes[0, WEIGHT].reshape(48, -1).copy()


def weights(n_z, edge, groove, fed, place=(0.0, 0.0, 0.0, 0.0)):
    """Weights of all lines, of the nodes at which there is supply or not, for a journal at ``place`` in clearances."""
    grid = ElasticGrid(48, n_z, edge, groove)
    across = np.abs(grid.zetas[1:-1]) <= groove + 1e-9
    film = grid.film(0.085, 0.03, 4e-5, 0.01, supply=np.outer(np.arange(48) < 24, across).astype(float))
    return grid.zetas, start_weights(film, place)[0 if fed else 30]


@pytest.mark.parametrize(("n_z", "edge", "groove"), GRIDS)
def test_weights_of_an_even_film_are_symmetric_and_fill_the_width(n_z, edge, groove):
    for fed in (True, False):
        zetas, own = weights(n_z, edge, groove, fed)
        assert own.sum() == pytest.approx(2.0, rel=1e-12)
        assert own @ zetas == pytest.approx(0.0, abs=1e-12)
        assert own == pytest.approx(own[::-1], abs=1e-14)


@pytest.mark.parametrize(("n_z", "edge"), [(5, 0.0), (8, 0.5), (12, 0.5), (16, 0.9)])
def test_no_pressure_counts_against_the_load(n_z, edge):
    """Also where the journal lies in the edge of its shell, and heights differ by tens from line to line."""
    for tilt in (0.0, 0.3, 0.6, 0.9, 1.0, 1.05, 1.2, 2.0, 4.0):
        for groove in (0.0, 0.133, 0.3):
            for fed in (True, False):
                own = weights(n_z, edge, groove, fed, (0.05, 0.0, tilt, 0.0))[1]
                assert own.min() >= -1e-15
                assert own.sum() == pytest.approx(2.0, rel=1e-12)


@pytest.mark.parametrize("n_z", [7, 8, 11, 12, 16])
def test_sums_over_the_width_are_exact_for_parabolas_on_each_side_of_a_groove(n_z):
    """On even lines the flow of a parabola is linear; a groove's edge is a kink that no sum goes across."""
    for groove, fed in ((0.0, False), (0.2, True)):
        zetas, own = weights(n_z, 0.0, groove, fed)
        way = (1.0 - np.abs(zetas)) / (1.0 - groove)
        pressure = np.where(np.abs(zetas) <= groove + 1e-12, 1.0, way * (2.0 - way))
        if not fed:
            pressure = 1.0 - zetas**2
        whole = 2.0 * groove + 2.0 * (1.0 - groove) * 2.0 / 3.0
        assert own @ pressure == pytest.approx(whole, rel=1e-12)


def test_sums_are_exact_where_pressure_falls_along_a_wedge():
    """Flow without a source between lines of a wedge: the integral of p(ζ), whatever the spacing."""
    grid = ElasticGrid(48, 8, 0.7)
    film = grid.film(0.085, 0.03, 4e-5, 0.01)
    tilt = 0.9
    own = start_weights(film, (0.0, 0.0, tilt, 0.0))[0]
    h = 1.0 - tilt * grid.zetas
    # From 1 at ζ = −1 to 0 at ζ = 1 with H³ p′ constant: p is linear in 1/H².
    last = 1.0 / h[-1] ** 2
    pressure = (last - 1.0 / h**2) / (last - 1.0 / h[0] ** 2)
    z, w = np.polynomial.legendre.leggauss(400)
    exact = w @ ((last - 1.0 / (1.0 - tilt * z) ** 2) / (last - 1.0 / h[0] ** 2))
    assert own @ pressure == pytest.approx(exact, rel=1e-9)


def test_load_of_a_grooved_film_does_not_jump_from_one_count_of_lines_to_the_next():
    """They did where a groove was as wide as lines lie. No line is left out of those balanced four at a time."""

    def forces(n_z):
        bearing, kept = grooved(ElasticGrid(48, n_z, 0.5, 0.133), 7), []
        follow(bearing, 60, 0.93, visit=lambda *_: kept.append(bearing.forces))
        return np.array(kept)

    fine = forces(24)
    size = np.linalg.norm(fine[:, :2], axis=1).max()
    worst = {n_z: np.abs(forces(n_z) - fine).max() / size for n_z in range(7, 14)}
    assert max(worst.values()) < 0.02
    assert worst[13] < 0.5 * worst[7]


def test_the_groove_of_an_engine_is_as_wide_as_its_file_says():
    engine = load_engine("diesel_i6")
    bore = bore_compliance(engine, 7)
    for width in (2e-3, 4e-3, 8e-3):
        bearing = replace(engine.plain_mains, supply_width=width)
        film = elastic_arrays(bearing, 0.01, bore, IN_LOOP)
        zetas = film.lines[:, 0]
        fed = zetas[1:-1][film.supply.reshape(IN_LOOP.n_phi, -1).any(axis=0)]
        assert 0.5 * bearing.width * np.ptp(fed) == pytest.approx(width, rel=1e-12)
