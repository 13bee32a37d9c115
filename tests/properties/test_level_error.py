"""A run names the total error of its levels: the shipped figure, and cheaper-than-others levels with half of it."""

import json
import re
from pathlib import Path

import pytest

from cranktrain.engine.file import load_engine
from cranktrain.studies.constant_speed import Request
from cranktrain.studies.planning.level_error import HALF, WORTH, level_error_text
from cranktrain.studies.total_error import shipped

SIX = load_engine("diesel_i6")
POINTS = json.loads((Path(shipped.__file__).parent / "data" / "diesel_i6.json").read_text("utf-8"))["points"]


def said(engine=SIX, **request):
    asked = Request(**request)
    return level_error_text(engine, asked.settings(engine), asked.speed_rpm)


def figure(label, rpm=2000.0):
    """Total error of torsion and cost of a label as the shipped file has them."""
    [point] = [one for one in POINTS if one["label"] == label and one["speed_rpm"] == rpm]
    return point["errors"]["torsion"]["total"], point["cost"]


def test_the_default_run_of_the_six_names_its_shipped_error_and_the_command_that_halves_it():
    text = said(speed_rpm=2000.0)
    own, cost = figure("solid/impedance/ground 5°")
    better, dear = figure("solid/ehd/flexible 2°")
    assert f"within about {100.0 * own:.2g} % of the best model here" in text
    assert f"--bearings ehd --block flexible --step-deg 2: {100.0 * better:.2g} %, {dear / cost:.2g} times" in text
    assert better <= HALF * own
    usual = re.compile(r"[a-z]+/[a-z:]+/[a-z]+ [0-9.]+°")
    rivals = [one for one in POINTS if one["speed_rpm"] == 2000.0 and one["errors"]["torsion"]]
    rivals = [one for one in rivals if usual.fullmatch(one["label"])]
    halving = [one["cost"] for one in rivals if one["errors"]["torsion"]["total"] <= HALF * own]
    assert dear <= WORTH * min(halving)


def test_between_two_measured_speeds_the_larger_error_counts():
    assert said(speed_rpm=1500.0).split(" of the best")[0] == said(speed_rpm=2000.0).split(" of the best")[0]
    assert figure("solid/impedance/ground 5°", 1000.0)[0] < figure("solid/impedance/ground 5°")[0]


@pytest.mark.parametrize("other", [{"load": 0.5}, {"speed_rpm": 2600.0}, {"big_ends": "impedance"}, {"step_deg": 4.0}])
def test_runs_without_a_figure_say_so(other):
    assert said(**{"speed_rpm": 2000.0} | other).startswith("Error of these levels: not measured for this run")


def test_levels_next_to_the_best_model_name_no_better_ones():
    text = said(speed_rpm=2000.0, bearings="ehd", block="flexible")
    assert f"{100.0 * figure('solid/ehd/flexible 2°')[0]:.2g} % of the best" in text and "--" not in text


def test_another_engine_has_no_figure():
    heavier = SIX.with_({"cylinders.piston_mass": "2.1 kg"})
    assert "not measured for this engine" in said(heavier, speed_rpm=2000.0)
