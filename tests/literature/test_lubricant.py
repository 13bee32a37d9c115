"""Viscosity laws against the data they are fitted to and each other, and the oil's temperature against its table."""

import math
from dataclasses import replace

import pytest
from one_line import one_line
from scipy.integrate import quad

from cranktrain.engine.checks.oil import thickness
from cranktrain.engine.file import load_engine
from cranktrain.engine.lubricant import (
    barus_factor,
    oil_temperature,
    pressure_constants,
    pressure_factor,
    roelands_factor,
    viscosity,
    walther_through,
    walther_viscosity,
)

OIL = load_engine("diesel_i6").oil


@pytest.mark.parametrize(("celsius", "pascal_seconds"), [(40, 0.1), (100, 0.0143)])
def test_sae_15w40_at_its_two_standard_points(celsius, pascal_seconds):
    assert viscosity(OIL, celsius + 273.15) == pytest.approx(pascal_seconds, rel=1e-4)


def test_oil_temperature_follows_its_table_and_stays_constant_outside():
    rpm = math.pi / 30.0
    for speed, celsius in ((0, 80), (1000, 80), (1700, 92.5), (2400, 105), (4000, 105)):
        assert oil_temperature(OIL, speed * rpm) == pytest.approx(celsius + 273.15, abs=1e-9)
    single = replace(OIL, temperature_speeds=(100.0,), temperatures=(360.0,))
    assert oil_temperature(single, 250.0) == 360.0


def test_walthers_law_goes_through_its_points_and_is_straight_in_its_chart():
    points = [(313.15, 110e-6), (373.15, 14.5e-6)]
    a, b = walther_through(points)
    for kelvin, nu in points:
        assert walther_viscosity(kelvin, a, b, 850.0) == pytest.approx(850.0 * nu, rel=1e-12)
    kelvins = (300.0, 340.0, 425.0)
    chart = [math.log10(math.log10(1e6 * walther_viscosity(t, a, b, 870.0) / 870.0 + 0.7)) for t in kelvins]
    slopes = [(chart[i + 1] - chart[i]) / math.log10(kelvins[i + 1] / kelvins[i]) for i in range(2)]
    assert slopes == pytest.approx([-b, -b], rel=1e-12)
    # ASTM D341's own slope of such an oil: B between 3 and 4.
    assert 3.0 < b < 4.0


def test_both_laws_of_the_engine_file_agree():
    """And the check of an oil, which writes them again, finds the viscosities of the runs."""
    walther = replace(OIL, law="walther")
    for celsius, tolerance in ((40, 1e-3), (100, 1e-3), (60, 0.02), (80, 0.02), (120, 0.02), (150, 0.02)):
        kelvin = celsius + 273.15
        assert viscosity(walther, kelvin) == pytest.approx(viscosity(OIL, kelvin), rel=tolerance)
        for oil in (walther, OIL):
            assert thickness(oil, kelvin) == pytest.approx(viscosity(oil, kelvin), rel=1e-12)


@pytest.mark.parametrize(
    ("points", "says"),
    [
        ([(313.15, 110e-6)], "takes two points"),
        ([(373.15, 110e-6), (313.15, 14.5e-6)], "increase"),
        ([(313.15, 14e-6), (373.15, 110e-6)], "decrease"),
        ([(313.15, 1e-6), (373.15, 1e-7)], "has no value at 0.1 mm^2/s"),
    ],
)
def test_points_off_walthers_chart_are_refused(points, says):
    with one_line(says):
        walther_through(points)


@pytest.mark.parametrize("eta", [0.005, 0.0143, 0.1])
def test_roelands_has_barus_slope_and_grows_slower(eta):
    alpha = 20e-9
    law, above, z = pressure_constants(replace(OIL, pressure_law="roelands", pressure_viscosity=alpha), eta)
    assert 0.3 < z < 1.0
    assert roelands_factor(0.0, above, z) == pytest.approx((1.0, alpha), rel=1e-12)
    for p in (1e6, 1e8, 5e8):
        assert 1.0 < pressure_factor(law, p, above, z)[0] < barus_factor(p, alpha)[0]
    # The form of the textbooks, with η₀ on both sides: ln η + 9.67 = (ln η₀ + 9.67)(1 + 5.1e-9 p)^Z.
    p = 2e8
    left = math.log(eta * roelands_factor(p, above, z)[0]) + 9.67
    assert left == pytest.approx((math.log(eta) + 9.67) * (1.0 + 5.1e-9 * p) ** z, rel=1e-3)


@pytest.mark.parametrize(("alpha", "limit"), [(20e-9, 53.2e6), (15e-9, 76.8e6), (12e-9, 104.4e6)])
def test_reduced_pressure_ends_under_roelands_law_too(alpha, limit):
    """A constant oil's pressure beyond ∫ dp/f has no stiffening counterpart: 1/α by Barus, little more by Roelands."""
    law, above, z = pressure_constants(replace(OIL, pressure_law="roelands", pressure_viscosity=alpha), 0.0143)
    reduced = [quad(lambda p: 1.0 / pressure_factor(law, p, above, z)[0], 0.0, top, limit=200)[0] for top in (3e9, 6e9)]
    assert reduced == pytest.approx([limit, limit], rel=2e-3)
    assert 1.0 < limit * alpha < 1.3


def test_pressure_laws_and_their_derivatives():
    eta = 0.0143
    assert barus_factor(1e8, 20e-9)[0] == pytest.approx(math.exp(2.0), rel=1e-14)
    for name in ("none", "barus", "roelands"):
        law, first, second = pressure_constants(replace(OIL, pressure_law=name), eta)
        for p in (-0.9e8, 0.0, 5e6, 3e8):
            step = 1e3
            up, down = (pressure_factor(law, p + s, first, second)[0] for s in (step, -step))
            slope = pressure_factor(law, p, first, second)[1]
            assert slope == pytest.approx((up - down) / (2.0 * step), rel=1e-5, abs=1e-16)
    for changes, at_rest, said in (
        ({"pressure_law": "barrus"}, eta, "pressure law 'barrus' does not exist; did you mean 'barus'?"),
        ({"pressure_law": "barus", "pressure_viscosity": -1e-9}, eta, "must not be negative"),
        ({"pressure_law": "roelands"}, 1e-5, "Roelands' law needs a viscosity above"),
    ):
        with one_line(said):
            pressure_constants(replace(OIL, **changes), at_rest)
    for oil, kelvin, said in ((OIL, 100.0, "below"), (replace(OIL, law="valther"), 350.0, "did you mean 'walther'?")):
        with one_line(said):
            viscosity(oil, kelvin)
