"""Functions of the library: every verb has one, whose keywords are the fields of a question."""

import dataclasses
import inspect
import json
import pickle
import re
from pathlib import Path
from typing import Literal, get_args, get_origin

import numpy as np
import pytest
from one_line import one_line
from refusals import refused_files

import cranktrain as ct
from cranktrain.cli import main as command_line
from cranktrain.cli.functions import verb_of
from cranktrain.cli.parser import function_of
from cranktrain.cli.verbs import FUNCTIONS
from cranktrain.dynamics.model.settings import resolved
from cranktrain.film.laws.film_solution import IN_DOUBLES
from cranktrain.studies import constant_speed

STEADY = {"from_rpm": 4000, "to_rpm": 8000, "step_rpm": 500, "crank": "torsional", "method": "linear", "inherit": False}
RIGID = {"speed_rpm": 4000, "cycles": 1, "crank": "rigid", "bearings": "held", "step_deg": 10}
ALONE = {
    "engines": "engines", "bearing plain": "Bearing", "plan": "plan", "fmu": "build_fmu",
    "schema": "schema", "vary": "vary", "optimize": "optimize",
    "explore": "explore",
}  # fmt: skip
"""Verbs that the library has in another form, or not at all: a schema is for editors."""
FACE = Path(ct.__file__).with_suffix(".pyi")


def known(verb):
    return verb_of(function_of(FUNCTIONS[verb]))


def literals(kind):
    """Words that an annotation takes."""
    if get_origin(kind) is Literal:
        return {word for word in get_args(kind) if isinstance(word, str)}
    return {word for part in get_args(kind) for word in literals(part)}


@pytest.mark.parametrize("verb", FUNCTIONS)
def test_a_function_has_the_fields_of_its_question_as_keywords(verb):
    """Read from the dataclass, not by what makes the signature; words for type checkers are those of the registers.

    Help names every keyword and no option of the verb.
    """
    name, ask, fields = ALONE.get(verb, FUNCTIONS[verb].partition(":")[2]), known(verb).ask, known(verb).fields
    assert verb == "schema" or callable(getattr(ct, name))
    if verb not in ALONE:
        assert getattr(ct, ask.__name__) is ask and callable(ask.answer)
    declared = {one.name: one.default for one in dataclasses.fields(ask)}
    parameters = dict(inspect.signature(function_of(FUNCTIONS[verb])).parameters)
    if known(verb).subject is not None:
        first = parameters.pop(next(iter(parameters)))
        assert first.name == known(verb).subject.name and first.default is first.empty
    empty = inspect.Parameter.empty
    defaults = {key: empty if value is dataclasses.MISSING else value for key, value in declared.items()}
    assert {key: one.default for key, one in parameters.items()} == defaults
    stated = {one.name: {word for kind in one.kinds for word in literals(kind)} for one in fields}
    assert [one.name for one in fields if stated[one.name] and stated[one.name] != set(one.words)] == []
    text = inspect.getdoc(function_of(FUNCTIONS[verb]))
    assert [one.name for one in fields if not re.search(rf"^{one.name} : ", text, re.MULTILINE)] == []
    assert [option for one in fields for option in one.names if re.search(rf"{option}(?![-\w])", text)] == []


def test_editors_and_type_checkers_see_every_name():
    """Names are loaded lazily, so only the stub tells of them."""
    stated = re.findall(r"^from (cranktrain[\w.]*) import (\w+) as \2$", FACE.read_text("utf-8"), re.MULTILINE)
    assert {name: place.removeprefix("cranktrain.") for place, name in stated} == ct.NAMES and FACE.with_name(
        "py.typed"
    ).is_file()


def test_a_question_is_a_value():
    """Compared, replaced and sent to another process; its answer is that of the function."""
    question = ct.Simulate(**RIGID)
    assert question == ct.Simulate(**RIGID) == pickle.loads(pickle.dumps(question))
    assert dataclasses.replace(question, speed_rpm=3000) != question
    with pytest.raises(dataclasses.FrozenInstanceError):
        question.speed_rpm = 3000
    one, other = question.answer("single_petrol"), ct.simulate("single_petrol", **RIGID)
    assert all(np.array_equal(one[name], other[name]) for name in one.names)
    with pytest.raises(ct.InputError, match="speed_rpm 5 is not within"):
        dataclasses.replace(question, speed_rpm=5)


@pytest.mark.parametrize(
    ("settle", "bearings", "doubles"), [(1e-6, "ehd", True), (1e-3, "ehd", False), (1e-6, "table", False)]
)
def test_elastic_films_are_solved_in_doubles_where_they_are_to_repeat_closely(settle, bearings, doubles):
    """Rounding of singles differs from cycle to cycle."""
    engine = ct.load_engine("diesel_i6")
    made = ct.Assembly(engine, resolved(ct.Settings(bearings=bearings), engine), None, None)
    precise = constant_speed.Request(speed_rpm=2000.0, settle=settle)._precise(made)
    usual = made.settings.newton_tolerance
    assert precise.newton_tolerance == (IN_DOUBLES if doubles else usual) and usual > IN_DOUBLES


@pytest.mark.parametrize(
    ("given", "told"),
    [*refused_files()["keywords"]["simulate"], ({"speed_rpm": 4000, "crank": None}, "crank is None; leave it out")],
)
def test_a_wrong_type_is_one_line_in_keywords(given, told):
    with one_line(told) as error:
        ct.simulate("single_petrol", **given)
    assert not re.search(r"--[a-z]", str(error.value)), "names an option of the command line"


def test_other_functions_refuse_alike():
    for call, told in (
        (lambda: ct.modal(3), "engine is 3, of type int"),
        (lambda: ct.modal(), "engine is missing"),
        (lambda: ct.bearing_loads("single_petrol"), "one of speeds_rpm, result, run_up is missing"),
        (lambda: ct.bearing_loads("single_petrol", speeds_rpm=[2000, "x"]), "speeds_rpm is 'x'"),
        (lambda: ct.bearing_loads("single_petrol", speeds_rpm=2000, run_up="a.h5"), "does not go with"),
        (lambda: ct.film_table(length_ratio=0.4, relief=[1, 2]), "relief has 2 values; give 3"),
        (lambda: ct.campbell("single_petrol", crank="rigid"), "crank rigid has no natural frequencies"),
        (lambda: ct.campbell("single_petrol", crank="torsional", from_rpm=3000, to_rpm=2000), "from_rpm 3000"),
        (lambda: ct.runup("single_petrol", **{**STEADY, "ramp_rpm_per_s": 100.0}), "method does not go with"),
        (lambda: ct.assemble("single_petrol", {"crank": "rigid"}), "settings are"),
        (lambda: ct.load_run(3), "is no path"),
    ):
        with one_line(match=told):
            call()


def test_an_engine_in_memory_is_that_of_its_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    engine = ct.load_engine("single_petrol")
    by_name, in_memory = ct.runup("single_petrol", **STEADY), ct.runup(engine, **STEADY)
    assert np.array_equal(by_name.torsion, in_memory.torsion)
    assert list(tmp_path.iterdir()) == []  # a file only where one is named
    kept = ct.runup(engine, **STEADY, output="kept.h5")
    again = ct.load_run("kept.h5")
    assert np.array_equal(kept.torsion, again.torsion) and kept.report["firing"] and not again.report


def test_a_changed_engine_is_checked_by_every_function():
    engine = ct.load_engine("single_petrol")
    heavy = dataclasses.replace(engine, flywheel=dataclasses.replace(engine.flywheel, mass=-1.0))
    wrong = dataclasses.replace(engine, flywheel=dataclasses.replace(engine.flywheel, mass="heavy"))
    for call in (
        lambda one: ct.simulate(one, **RIGID),
        lambda one: ct.runup(one, **STEADY),
        lambda one: ct.assemble(one, ct.Settings(crank="rigid", bearings="held")),
        ct.load_engine,
    ):
        with pytest.raises(ct.InputError, match=r"flywheel\.mass: -1 kg is not within"):
            call(heavy)
        with pytest.raises(ct.InputError, match=r"flywheel\.mass: 'heavy' is not a finite number"):
            call(wrong)


def test_an_assembly_runs_as_its_engine_does():
    made = ct.assemble("single_petrol", ct.Settings(crank="rigid", bearings="held"))
    choices = {key: RIGID[key] for key in ("speed_rpm", "cycles", "step_deg")}
    one, other = ct.simulate(made, **choices), ct.simulate("single_petrol", **RIGID)
    assert all(np.array_equal(one[name], other[name]) for name in one.names)
    with pytest.raises(ct.InputError, match="drive_line belongs to an engine"):
        ct.simulate(made, **choices, drive_line="line.toml")


def test_a_new_engine_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    engine = ct.new_engine("my_twin", layout="i2", bore_mm=80.6254, stroke_mm=72)
    assert engine.n_cylinders == 2 and engine.cylinders.bore == pytest.approx(0.0806254, rel=1e-12)
    assert ct.engines()["single_petrol"] == ct.load_engine("single_petrol").title
    assert list(tmp_path.iterdir()) == [] and ct.simulate(engine, **RIGID).engine == engine
    with pytest.raises(ct.InputError, match=r"layout .*'i22'"):
        ct.new_engine("my_twin", layout="i22", bore_mm=80, stroke_mm=72)


def test_campbell_is_the_verb_s(capsys):
    found = ct.campbell("single_petrol", crank="beam", from_rpm=2000, to_rpm=8000)
    arguments = ["campbell", "single_petrol", "--crank", "beam", "--from", "2000", "--to", "8000", "--json"]
    assert command_line.main(arguments) == 0
    printed = json.loads(capsys.readouterr().out)
    assert [mode["name"] for mode in printed["modes"]] == list(found.names)
    assert np.array_equal(np.transpose([mode["hz"] for mode in printed["modes"]]), found.hz)
    for one in printed["crossings"]:  # an order meets a mode where it has its frequency
        assert one["hz"] == pytest.approx(one["order"] * one["rpm"] / 60.0)
        k = found.names.index(one["mode"])
        assert one["hz"] == pytest.approx(np.interp(one["rpm"], found.speeds_rpm, found.hz[:, k]), rel=1e-3)


def test_what_a_function_finds_is_what_the_verb_prints(tmp_path, monkeypatch, capsys):
    """Of verbs that take seconds; a list, a scalar and a file as keywords."""
    monkeypatch.chdir(tmp_path)
    ct.simulate("single_petrol", **{**RIGID, "bearings": "impedance", "step_deg": 2.5}, output="run.h5")
    loads = ["bearing-loads", "single_petrol", "--result", "run.h5"]
    roller = ["bearing", "roller", "--rollers", "12", "--length-mm", "20", "--load-n", "5000"]
    cases = [
        (lambda: ct.damper_optimum(inertia_ratio=0.5), ["damper-optimum", "--inertia-ratio", "0.5"]),
        (lambda: ct.bearing_loads(ct.load_engine("single_petrol"), result="run.h5"), loads),
        (lambda: ct.bearing_loads("single_petrol", result=["run.h5"]), loads),
        (lambda: ct.roller(rollers=12, length_mm=20, load_n=5000), roller),
        (lambda: ct.export("run.h5", to="run.csv"), ["export", "run.h5", "--to", "again.csv"]),
    ]
    for call, words in cases:
        found = call()
        assert command_line.main([*words, "--json"]) == 0
        printed = json.loads(capsys.readouterr().out)
        for own in (found, printed):
            own.pop("seconds", None)
        if words[0] != "export":
            assert json.loads(json.dumps(found)) == printed
        assert found.verb == " ".join(words[: 1 + (words[0] == "bearing")]) and len(repr(found).splitlines()) < 10
    assert (tmp_path / "run.csv").read_text() == (tmp_path / "again.csv").read_text()
