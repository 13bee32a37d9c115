"""The journal film in steady rotation against Butenschön's, Raimondi and Boyd's tables and the closed forms.

A table printed with four decimals is compared within its tolerance and half of its last digit. Cells that the data
file flags as misprints are compared with the independent value that it gives for them.
"""

from itertools import pairwise

import numpy as np
import pytest
from expected import cases
from journal_films import film, journal_grid
from some import some

from cranktrain.film.steady.sommerfeld import prescribed_film

STATIC = cases("bearing_static")
BUTENSCHOEN = STATIC["butenschoen_rotation"]
MISPRINTS = {row[:3] and tuple(row[:3]): row[4] for row in BUTENSCHOEN["notes"]["flagged_typos"]}


def printed(quantity, key, row, column):
    eps, ratio = BUTENSCHOEN["inputs"]["eps"][row], BUTENSCHOEN["inputs"]["B_over_D"][column]
    other = MISPRINTS.get((quantity, ratio, eps))
    return other if isinstance(other, float) else BUTENSCHOEN["expected"][key][row][column]


@pytest.mark.parametrize("column", range(8), ids=[f"B/D {r:.3f}" for r in BUTENSCHOEN["inputs"]["B_over_D"]])
def test_every_cell_of_butenschoens_table(column):
    ratio = BUTENSCHOEN["inputs"]["B_over_D"][column]
    for row, eps in some(enumerate(BUTENSCHOEN["inputs"]["eps"])):
        ours = prescribed_film(ratio, eps)
        assert ours.sommerfeld == pytest.approx(printed("So", "So", row, column), rel=5e-3, abs=0.5e-4), eps
        assert np.degrees(ours.attitude) == pytest.approx(printed("beta", "beta_deg", row, column), abs=0.2), eps
        assert ours.side_flow == pytest.approx(printed("Q", "Q", row, column), rel=0.01), eps


def test_film_depends_on_the_sum_of_the_speeds_less_twice_that_of_the_line_of_centres():
    case = STATIC["rotating_load_equivalence"]["inputs"]
    eps, ratio = case["eps"], case["B"] / case["d"]
    w1, w2 = case["omega1"], case["omega2"]
    grid = journal_grid(96, 16, half=True)
    force = {}
    for w_ecc in (w2, 0.5 * (w1 + w2), 0.0):
        # ė = ω_ecc e_z×e; v = ė − ½(ω₁ + ω₂) e_z×e.
        force[w_ecc] = film(grid, ratio, (eps, 0.0), (0.0, (w_ecc - 0.5 * (w1 + w2)) * eps)).force
    resulting = w1 + w2 - 2.0 * w2
    steady = prescribed_film(ratio, eps, supply="none")
    assert 3.0 * np.hypot(*force[w2][:2]) / abs(resulting) == pytest.approx(steady.sommerfeld, rel=5e-3)
    assert not force[0.5 * (w1 + w2)].any(), "the wedge's capacity vanishes at the half speed"


def test_raimondi_and_boyds_load_and_friction():
    case = STATIC["raimondi_boyd_LD1_stored"]["expected"]
    for s, h0, friction in some(zip(case["S"], case["h0_over_c"], case["Rc_f"], strict=True)):
        ours = prescribed_film(1.0, 1.0 - h0)
        # S = η N D L (R/c)²/W with N in rev/s is 1/(2π So).
        assert 1.0 / (2.0 * np.pi * ours.sommerfeld) == pytest.approx(s, rel=0.02)
        assert ours.friction == pytest.approx(friction, rel=0.02)


def richardson(values, orders=(2,)):
    """Extrapolate values of halved steps."""
    for order in orders:
        values = [b + (b - a) / (2**order - 1) for a, b in pairwise(values)]
    return values[-1]


def long_force(eps, rupture, columns):
    """Force per η ω R L (R/c)² of the infinitely long bearing, on axes against and across the eccentricity."""
    grid = journal_grid(columns, 6, half=True, rupture=rupture, fed_at_widest=True, sealed=True)
    force = 6.0 * film(grid, 1.0, (eps, 0.0), (0.0, -0.5 * eps)).force[:2]
    return np.array([-force[0], force[1]])


@pytest.mark.parametrize("eps", [0.1, 0.4, 0.6, 0.8, 0.9])
def test_long_full_film_is_sommerfelds_and_its_half_guembels(eps):
    across = 12.0 * np.pi * eps / ((2.0 + eps**2) * np.sqrt(1.0 - eps**2))
    full = richardson([long_force(eps, "full", n) for n in (128, 256, 512)], (2, 4))
    np.testing.assert_allclose(full, [0.0, across], atol=1e-6 * across)
    half = richardson([long_force(eps, "guembel", n) for n in (256, 512)])
    np.testing.assert_allclose(half, [12.0 * eps**2 / ((2.0 + eps**2) * (1.0 - eps**2)), 0.5 * across], rtol=1e-4)


def test_long_film_with_rupture():
    for eps, radial, tangential, highest, *_ in some(STATIC["long_bearing"]["expected"]["reynolds"]):
        np.testing.assert_allclose(long_force(eps, "reynolds", 512), [radial, tangential], rtol=1e-3)
        grid = journal_grid(512, 6, half=True, fed_at_widest=True, sealed=True)
        work = film(grid, 1.0, (eps, 0.0), (0.0, -0.5 * eps)).work
        assert 12.0 * work.pressure.max() == pytest.approx(highest, rel=1e-3)


@pytest.mark.parametrize("row", STATIC["short_bearing_static"]["expected"]["table"], ids=lambda row: f"eps {row[0]}")
def test_short_half_film_is_ocvirks(row):
    eps, load, attitude = row
    ratio = 5e-4  # what is left of the finite width grows with ratio²/(1 − ε)²

    def forces(n):
        grid = journal_grid(n, 24, half=True, rupture="guembel")
        return film(grid, ratio, (eps, 0.0), (0.0, -0.5 * eps)).force[:2]

    radial, across = richardson([forces(n) for n in (384, 768)])
    # F = 6 η ω R L (R/c)² F̂; the table's unit is η ω R L³/c².
    assert 6.0 * np.hypot(radial, across) / (2.0 * ratio) ** 2 == pytest.approx(load, rel=1e-4)
    assert np.degrees(np.arctan2(across, -radial)) == pytest.approx(attitude, abs=5e-3)


def test_mass_conserving_and_reynolds_rupture_agree_where_the_groove_feeds_the_film():
    for eps in (0.3, 0.6, 0.9):
        ours, conserving = prescribed_film(0.5, eps), prescribed_film(0.5, eps, cavitation="mass-conserving")
        assert conserving.sommerfeld == pytest.approx(ours.sommerfeld, rel=5e-3)
        assert conserving.attitude == pytest.approx(ours.attitude, abs=np.radians(0.2))
        assert conserving.side_flow == pytest.approx(ours.side_flow, rel=0.01)
