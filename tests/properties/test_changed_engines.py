"""Engines that Python changes: units, checks as of files, and the file that they are written to."""

from dataclasses import replace
from pathlib import Path

import pytest
from one_line import one_line

import cranktrain as ct
from cranktrain.engine.file import engine_names

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("name", [*engine_names(), str(ROOT / "examples" / "four_with_balancers.toml")])
def test_a_written_engine_is_read_as_the_same(name, tmp_path):
    """To the bit, whatever units the file has."""
    engine = ct.load_engine(name)
    path = tmp_path / "again.toml"
    path.write_text(engine.to_toml(), encoding="utf-8")
    assert ct.load_engine(path) == engine


def test_values_are_changed_with_their_units():
    engine = ct.load_engine("four_petrol")
    same = [
        engine.with_({"flywheel.mass": "9 kg"}),
        engine.with_(flywheel__mass="9000 g"),
        engine.with_({"flywheel.mass": 9.0}),
        engine.with_({"flywheel.mass": "19.841603979665 lb"}),
    ]
    assert [one.flywheel.mass for one in same[:3]] == [9.0, 9.0, 9.0]
    assert same[3].flywheel.mass == pytest.approx(9.0)
    assert replace(same[0], flywheel=engine.flywheel) == engine
    assert engine.with_({}) == engine
    assert engine.with_({"rod.length": "0.15 m", "cylinders.piston_mass": "400 g"}).cylinders.piston_mass == 0.4


def test_lists_texts_tables_and_added_bodies_are_changed():
    engine = ct.load_engine("four_petrol")
    assert engine.with_(name="other", title="Another").name == "other"
    assert engine.with_({"cylinders.firing_order": [1, 2, 4, 3]}).cylinders.firing_order == (1, 2, 4, 3)
    assert engine.with_({"published": None}).published == ct.load_engine("single_petrol").published
    assert engine.with_({"flywheel": replace(engine.flywheel, mass=8.0)}).flywheel.mass == 8.0
    at = next(k for k, body in enumerate(engine.body, 1) if body.mass)
    assert engine.with_({f"body[{at}].mass": "1.5 kg"}).body[at - 1].mass == 1.5


WRONG = [
    ({"flywheel.mass": "9 kN"}, r"flywheel\.mass: unit 'kN' measures force, not mass"),
    ({"flywheel.mass": "9"}, r"is a text without a unit"),
    ({"flywheel.mass": "heavy"}, r"'heavy' is not a finite number"),
    ({"flywheel.mass": True}, r"True is not a finite number"),
    ({"flywheel.mass": [1.0, 2.0]}, r"a single value is wanted"),
    ({"flywheel.mass": float("nan")}, r"nan is not a finite number"),
    ({"flywheel.mass": object()}, r"is a object; give a number"),
    ({"flywheel.mass": -1}, r"-1 kg is not within"),
    ({"flywheel.mass": None}, r"key 'mass' is missing"),
    ({"flywheel.mas": 9.0}, r"unknown key 'mas'; did you mean 'mass'"),
    ({"flywhel.mass": 9.0}, r"has no 'flywhel'; did you mean 'flywheel'"),
    ({"flywheel": 3}, r"flywheel: 3 is not a table"),
    ({"crankshaft": None}, r"table 'crankshaft' is missing"),
    ({"name": 5}, r"name: 5 is not a text"),
    ({"name": "two words"}, r"'two words' is not a valid name"),
    ({3: 4}, r"3 is no name of a value"),
    ({"body[99].mass": 1.0}, r"so there is no body\[99\]"),
    ({"body.mass": 1.0}, r"name the table and its value, as in 'body\[1\]"),
    ({"flywheel": 3, "flywheel.mass": 4.0}, r"flywheel is 3, not a table"),
    ({"flywheel": None, "flywheel.mass": 4.0}, r"keys 'polar_inertia', 'diametral_inertia', 'offset' are missing"),
    ({"cylinders.firing_order": [1, 2]}, r"never fires"),
    ({"pulley.polar_inertia": "9 kg m^2"}, r"more than twice diametral_inertia"),
]


@pytest.mark.parametrize(("change", "told"), WRONG)
def test_a_change_is_checked_as_a_file_is(change, told):
    with one_line(match=told):
        ct.load_engine("four_petrol").with_(change)


def test_units_follow_from_the_field_not_from_its_value():
    """A temperature has a zero, an angle is read in degrees, a pressure in bar."""
    engine = ct.load_engine("four_petrol")
    warm = engine.with_({"oil.temperatures": ["90 degC"] * len(engine.oil.temperatures)})
    assert warm.oil.temperatures == (363.15,) * len(engine.oil.temperatures)
    assert warm == engine.with_({"oil.temperatures": [363.15] * len(engine.oil.temperatures)})
