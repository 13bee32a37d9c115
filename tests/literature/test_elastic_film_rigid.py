"""The elastic film in its rigid limit against published bearings: steady rotation and squeeze.

Butenschön's tables hold for an axial groove at the widest gap with p = 0 there and rupture by Swift and Stieber; a
mass-conserving film fed along that line ruptures at the same place and, without supply elsewhere, refills nowhere else.
"""

import numpy as np
import pytest
from elastic_bearing import DIAMETER, VISCOSITY, Bearing
from expected import cases

from cranktrain.film.elastic.grid import ElasticGrid

STATIC = cases("bearing_static")
SQUEEZE = cases("squeeze")


def fed_at_the_widest_gap(n_phi, n_z, width_ratio, **options):
    grid = ElasticGrid(n_phi, n_z)
    supply = np.zeros((n_phi, n_z))
    supply[n_phi // 2] = 1
    return Bearing(grid, width=width_ratio * DIAMETER, supply=supply, **options)


@pytest.mark.parametrize("width_ratio", [1.0, 0.5, 0.4, 0.25])
def test_load_and_attitude_of_the_steady_journal_are_butenschoens(width_ratio):
    """Default grid up to 0.9; the peak at 0.95 is narrower than its nodes and asks for twice as many."""
    case = STATIC["butenschoen_rotation"]
    column = int(np.argmin(np.abs(np.array(case["inputs"]["B_over_D"]) - width_ratio)))
    assert case["inputs"]["B_over_D"][column] == width_ratio
    coarse, fine = fed_at_the_widest_gap(72, 7, width_ratio), fed_at_the_widest_gap(144, 11, width_ratio)
    for row, eps in enumerate(case["inputs"]["eps"]):
        if eps < 0.1 or eps > 0.95:
            continue
        bearing = coarse if eps <= 0.9 else fine
        bearing.forget()
        force = bearing.settle([eps * bearing.clearance, 0, 0, 0])
        psi = bearing.clearance / (0.5 * DIAMETER)
        so = np.hypot(*force[:2]) * psi**2 / (width_ratio * DIAMETER**2 * VISCOSITY * 209.4)
        attitude = np.degrees(np.arctan2(force[1], -force[0]))
        assert so == pytest.approx(case["expected"]["So"][row][column], rel=0.01, abs=0.5e-4), eps
        assert attitude == pytest.approx(case["expected"]["beta_deg"][row][column], abs=0.2), eps


@pytest.mark.parametrize("eps", [0.2, 0.5, 0.8, 0.9])
def test_squeeze_of_a_short_film_tends_to_the_closed_form(eps):
    """F = η R L³/c² ε̇ J(ε) of a half film, full at the start; the next term is of the order (L/D)²/(1 − ε)."""
    expected = SQUEEZE["short_pifilm_squeeze"]["expected"]["J"][f"{eps}"]

    def error(ratio):
        bearing = Bearing(ElasticGrid(144, 7), width=ratio * DIAMETER)
        c = bearing.clearance
        force = bearing.settle([eps * c, 0, 0, 0], [c, 0, 0, 0], speed=0.0, dt=1e-6)[0]
        return abs(-force / (VISCOSITY * 0.5 * DIAMETER * (ratio * DIAMETER) ** 3 / c**2 * expected) - 1)

    assert error(0.02) < 5e-3
