"""Vogel's law against the data it is fitted to, and the oil's temperature against its table."""

import math
from dataclasses import replace

import pytest

from cranktrain.engine import load_engine
from cranktrain.errors import InputError
from cranktrain.lubricant import oil_temperature, viscosity, vogel_through

OIL = load_engine("diesel_i6").oil


@pytest.mark.parametrize(("celsius", "pascal_seconds"), [(40, 0.1), (100, 0.0143)])
def test_sae_15w40_at_its_two_standard_points(celsius, pascal_seconds):
    assert viscosity(OIL, celsius + 273.15) == pytest.approx(pascal_seconds, rel=1e-4)


def test_third_point_is_walthers_law_through_the_first_two():
    # ASTM D341: lg lg(v + 0.7) is linear in lg T, v in mm²/s; density of the oil as it is in the engine file
    def walther(kelvin):
        def ordinate(eta):
            return math.log10(math.log10(1e6 * eta / 870.0 + 0.7))

        t1, t2 = math.log10(313.15), math.log10(373.15)
        slope = (ordinate(0.0143) - ordinate(0.1)) / (t2 - t1)
        lines = ordinate(0.1) + slope * (math.log10(kelvin) - t1)
        return (10.0 ** (10.0**lines) - 0.7) * 870.0 / 1e6

    assert viscosity(OIL, 423.15) == pytest.approx(walther(423.15), rel=0.02)
    # two laws through the same points agree between them
    for kelvin in (333.15, 353.15):
        assert viscosity(OIL, kelvin) == pytest.approx(walther(kelvin), rel=0.02)


def test_vogel_constants_come_back_from_points_on_their_own_curve():
    a, b, c = 7e-5, 1100.0, 165.0
    points = [(t, a * math.exp(b / (t - c))) for t in (300.0, 350.0, 420.0)]
    assert vogel_through(points) == pytest.approx((a, b, c), rel=1e-9)


def test_points_off_any_vogel_curve_are_refused():
    with pytest.raises(InputError, match="flatten"):
        vogel_through([(300.0, 0.1), (350.0, 0.09), (400.0, 0.001)])
    with pytest.raises(InputError, match="increase"):
        vogel_through([(350.0, 0.1), (300.0, 0.09), (400.0, 0.001)])
    with pytest.raises(InputError, match="below"):
        viscosity(OIL, 100.0)


def test_oil_temperature_follows_its_table_and_stays_constant_outside():
    rpm = math.pi / 30.0
    for speed, celsius in ((0, 80), (1000, 80), (1700, 92.5), (2400, 105), (4000, 105)):
        assert oil_temperature(OIL, speed * rpm) == pytest.approx(celsius + 273.15, abs=1e-9)
    single = replace(OIL, temperature_speeds=(100.0,), temperatures=(360.0,))
    assert oil_temperature(single, 250.0) == 360.0
