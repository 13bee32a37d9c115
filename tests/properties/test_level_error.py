"""A run names the total error of its levels: the shipped figure, and cheaper-than-others levels with half of it."""

import json
import re
from pathlib import Path

import pytest

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.studies.constant_speed import Request
from cranktrain.studies.planning.level_error import HALF, WORTH, level_error
from cranktrain.studies.total_error import shipped

SIX = load_engine("diesel_i6")
POINTS = json.loads((Path(shipped.__file__).parent / "data" / "diesel_i6.json").read_text("utf-8"))["points"]


def error_of(first=2000.0, last=None, engine=SIX, **request):
    """Of a run at a speed, rev/min, or of a run-up."""
    asked = Request(speed_rpm=first, **request)
    return level_error(engine, asked.settings(engine), first, *([] if last is None else [last]))


def figure(label, rpm=2000.0):
    """Total error of torsion and cost of a label as the shipped file has them."""
    [point] = [one for one in POINTS if one["label"] == label and one["speed_rpm"] == rpm]
    return point["errors"]["torsion"]["total"], point["cost"]


def test_the_default_run_of_the_six_names_its_shipped_error_and_the_command_that_halves_it():
    text = error_of()["text"]
    (own, cost), (better, dear) = figure("solid/impedance/ground 5°"), figure("solid/ehd/flexible 2°")
    assert f"within about {100.0 * own:.2g} % of the best model here" in text
    assert f"--bearings ehd --block flexible --step-deg 2: {100.0 * better:.2g} %, {dear / cost:.2g} times" in text
    assert better <= HALF * own
    rivals = [one for one in POINTS if one["speed_rpm"] == 2000.0 and one["errors"]["torsion"]]
    rivals = [one for one in rivals if re.fullmatch(r"[a-z]+/[a-z:]+/[a-z]+ [0-9.]+°", one["label"])]
    halving = [one["cost"] for one in rivals if one["errors"]["torsion"]["total"] <= HALF * own]
    assert dear <= WORTH * min(halving)


def test_between_two_measured_speeds_the_larger_error_counts_and_the_best_model_names_no_better_one():
    between, there = (error_of(rpm)["text"].split(" of the best")[0] for rpm in (1500.0, 2000.0))
    assert between == there
    assert figure("solid/impedance/ground 5°", 1000.0)[0] < figure("solid/impedance/ground 5°")[0]


@pytest.mark.parametrize("other", [{"load": 0.5}, {"first": 2600.0}, {"big_ends": "impedance"}, {"step_deg": 4.0}])
def test_runs_and_engines_without_a_figure_say_so(other):
    assert error_of(**other)["text"].startswith("Error of these levels: not measured for this run")
    heavier = SIX.with_({"cylinders.piston_mass": "2.1 kg"})
    assert "not measured for this engine" in error_of(engine=heavier)["text"]

    text = error_of(bearings="ehd", block="flexible")["text"]
    assert f"{100.0 * figure('solid/ehd/flexible 2°')[0]:.2g} % of the best" in text and "--" not in text


def test_a_run_up_has_the_largest_error_of_the_measured_speeds_that_it_covers():
    errors = {rpm: figure("solid/impedance/ground 5°", rpm)[0] for rpm in (1000.0, 2000.0)}
    both, part = error_of(800.0, 2600.0), error_of(1900.0, 2400.0)
    assert both["total"] == max(errors.values()) and both["measured_rpm"] == [1000.0, 2000.0]
    numbers = f"{100.0 * both['halved_total']:.2g} %, {both['halved_time']:.2g} times"
    assert f"{both['halved_by']}: {numbers}" in both["text"] and both["halved_total"] <= HALF * both["total"]
    assert part["total"] == both["total"] and error_of(600.0, 1000.0)["total"] == errors[1000.0]
    assert error_of(2000.0, 2400.0)["measured_rpm"] == [2000.0]
    for first, last in ((400.0, 900.0), (2100.0, 2400.0)):
        assert error_of(first, last)["total"] is None


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--crank", "torsional", "--method", "linear"], "Error of these levels: not measured with --method; "),
        (["--crank", "beam", "--bearings", "linear"], "best model here"),
    ],
)
def test_a_run_up_says_in_one_line_and_in_json_how_far_its_levels_are_off(words, line, tmp_path, capsys):
    run = ["runup", "diesel_i6", "--from", "1980", "--to", "2000", *words, "--no-inherit", "--workers", "1"]
    run = run[:-2] if "--method" in words else run
    assert main([*run, "--output", str(tmp_path / "a.h5")]) == 0
    [shown] = [one for one in capsys.readouterr().out.splitlines() if line in one]
    assert main([*run, "--output", str(tmp_path / "b.h5"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["level_error"]["text"] == shown
