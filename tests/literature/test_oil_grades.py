"""Oils by grade: bounds of SAE J300, viscosity indices of ASTM D2270, laws of Vogel and Walther, and engine files."""

import json
import math
from dataclasses import replace

import pytest
from one_line import one_line

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.engine.lubricant import viscosity
from cranktrain.engine.oil_grades import COOL, EXPANSION, GRADES, HOT, graded, vogel_constants
from cranktrain.engine.quantities import OIL_GRADES, ZERO_CELSIUS

# SAE J300 (2021): kinematic viscosity at 100 °C, mm²/s, and least viscosity at 150 °C and 1e6 1/s, mPa s.
BANDS = {"20": (6.9, 9.3), "30": (9.3, 12.5), "40": (12.5, 16.3)}
HTHS = {"20": 2.6, "30": 2.9, "40": 3.5, "15W-40": 3.7}
INDICES = {
    "0W-20": 170, "0W-30": 170, "5W-30": 165, "10W-30": 140, "0W-40": 180, "5W-40": 170, "10W-40": 150, "15W-40": 135,
}  # fmt: skip
SIX = load_engine("diesel_i6")
OTHER_LAW = {"oil.vogel_a": None, "oil.vogel_b": None, "oil.vogel_c": None, "oil.walther_temperatures": None,
             "oil.walther_viscosities": None, "oil.density": None}  # fmt: skip


def index(warm, hot):
    """Viscosity index above 100 by ASTM D2270, procedure B; H of an oil of index 100 at 40 °C from its polynomials."""
    square, slope, constant = {True: (0.05794, 10.5156, -28.240), False: (0.26665, 6.7015, -10.810)}[hot < 9.0]
    if hot >= 12.0:
        square, slope, constant = 0.20073, 8.4658, -22.490
    high = square * hot**2 + slope * hot + constant
    exponent = math.log10(high / warm) / math.log10(hot)
    return (10.0**exponent - 1.0) / 0.00715 + 100.0


def at(grade, celsius):
    """Viscosity of an engine of this grade, Pa s."""
    return viscosity(SIX.with_({**OTHER_LAW, "oil.grade": grade}).oil, celsius + ZERO_CELSIUS)


def test_the_polynomials_of_the_index_give_the_values_that_the_standard_prints():
    """Index 100 where the viscosity at 40 °C is H: 59.60 at 8.0 and 82.87 mm²/s at 10.0 mm²/s."""
    assert index(59.60, 8.0) == pytest.approx(100.0, abs=0.1)
    assert index(82.87, 10.0) == pytest.approx(100.0, abs=0.1)


@pytest.mark.parametrize("grade", OIL_GRADES)
def test_a_grade_lies_within_its_standard(grade):
    typical, number = GRADES[grade], grade.partition("-")[2]
    low, high = BANDS[number]
    assert typical.hot == pytest.approx(0.5 * (low + high))
    assert index(typical.warm, typical.hot) == pytest.approx(INDICES[grade], abs=1.0)
    assert 1e3 * at(grade, 150.0) > HTHS.get(grade, HTHS[number]), "without shear an oil is thicker than with it"
    thinner = typical.density * (1.0 - EXPANSION * (HOT - COOL))
    assert 1e6 * at(grade, 100.0) / thinner == pytest.approx(typical.hot, rel=1e-9)
    warm = typical.density * (1.0 - EXPANSION * 25.0)
    assert 1e6 * at(grade, 40.0) / warm == pytest.approx(typical.warm, rel=1e-9)


def test_thicker_grades_are_thicker_where_their_numbers_say_so():
    """By the second number when hot; of one second number, by the first number in the cold."""
    for celsius in (80.0, 100.0, 120.0):
        assert at("0W-20", celsius) < at("5W-30", celsius) < at("5W-40", celsius)
    cold = [at(grade, 0.0) for grade in ("0W-40", "5W-40", "10W-40", "15W-40")]
    assert cold == sorted(cold)


@pytest.mark.parametrize("celsius", [20.0, 60.0, 80.0, 120.0])
def test_vogels_law_is_walthers_between_its_points(celsius):
    """The two laws through the same viscosities, each with the density of its temperature, agree within 2 %."""
    typical = GRADES["5W-30"]
    kelvin = celsius + ZERO_CELSIUS
    points = [(313.15, typical.warm), (373.15, typical.hot)]
    (t1, w1), (t2, w2) = ((math.log(t), math.log10(math.log10(nu + 0.7))) for t, nu in points)
    nu = 10.0**10.0 ** (w1 + (w2 - w1) * (math.log(kelvin) - t1) / (t2 - t1)) - 0.7
    density = typical.density * (1.0 - EXPANSION * (kelvin - COOL))
    assert at("5W-30", celsius) == pytest.approx(1e-6 * nu * density, rel=0.02)


def test_an_engine_file_with_a_grade_is_that_with_its_constants(tmp_path):
    engine = SIX.with_({**OTHER_LAW, "oil.grade": "10W-40"})
    a, b, c = vogel_constants(GRADES["10W-40"])
    alone = SIX.with_({"oil.vogel_a": a, "oil.vogel_b": b, "oil.vogel_c": c, "oil.density": engine.oil.density})
    assert (engine.oil.vogel_a, engine.oil.vogel_b, engine.oil.vogel_c) == (a, b, c)
    assert viscosity(engine.oil, 363.0) == viscosity(alone.oil, 363.0)
    path = tmp_path / "graded.toml"
    path.write_text(engine.to_toml(), "utf-8")
    assert load_engine(path).oil == engine.oil
    assert graded(engine.oil) == engine.oil and graded(SIX.oil) is SIX.oil
    assert SIX.with_({**OTHER_LAW, "oil.grade": "10W-40", "oil.density": "900 kg/m^3"}).oil.density == 900.0


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"oil.grade": "5W-30"}, "oil.vogel_a: is given beside grade '5W-30', which has its own law; leave one"),
        ({**OTHER_LAW, "oil.grade": "5W-35"}, "unknown grade '5W-35'"),
        ({**OTHER_LAW, "oil.grade": "5W-30", "oil.law": "walther"}, "oil.law: is given beside grade '5W-30'"),
        ({**OTHER_LAW, "oil.vogel_a": "0.1 mPa s"}, "density"),
    ],
)
def test_a_grade_beside_another_law_and_unknown_grades_are_refused(changes, line):
    with one_line(line):
        SIX.with_(changes)


def test_an_oil_that_was_built_in_python_with_a_grade_has_its_law():
    oil = replace(SIX.oil, grade="0W-20", vogel_a=0.0, vogel_b=0.0, vogel_c=0.0, density=0.0,
                  walther_temperatures=(), walther_viscosities=())  # fmt: skip
    assert load_engine(replace(SIX, oil=oil)).oil.vogel_a > 0.0


def test_a_bearing_takes_an_oil_by_its_grade(capsys):
    """As with the two viscosities and the density of the grade; both in one command are refused in one line."""
    bearing = ["bearing", "plain", "--diameter-mm", "60", "--width-mm", "25", "--clearance-um", "30", "--speed", "3000"]
    bearing += ["--load-n", "10000", "--inlet-temperature-c", "90", "--json"]
    typical = GRADES["5W-30"]
    density = typical.density * (1.0 - EXPANSION * (HOT - COOL))
    own = ["--oil-viscosity-40", str(typical.warm), "--oil-viscosity-100", str(typical.hot)]
    found = []
    for words in (["--oil-grade", "5W-30"], [*own, "--oil-density", repr(density)]):
        assert main([*bearing, *words]) == 0
        found.append(json.loads(capsys.readouterr().out))
        del found[-1]["seconds"]
    assert found[0] == found[1]
    assert found[0]["viscosity"] == pytest.approx(at("5W-30", found[0]["effective_temperature_c"]), rel=0.03)
    for words, said in ((["--oil-grade", "5W-30", *own[:2]], "--oil-viscosity-40 does not go with --oil-grade"),
                        (["--oil-grade", "5W30"], "5W-30")):  # fmt: skip
        assert main([*bearing[:-1], *words]) == 2
        [line] = capsys.readouterr().err.splitlines()
        assert said in line
