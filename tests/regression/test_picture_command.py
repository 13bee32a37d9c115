"""The verb picture: its files, its JSON, and wrong input."""

import json
import re

import numpy as np
import pytest

from cranktrain.cli.main import main


def drawn(run_json, *arguments):
    return run_json("picture", *map(str, arguments))


def page_data(path):
    text = path.read_text("utf-8")
    return json.loads(re.search(r"^const DATA = (.*);$", text, re.MULTILINE)[1])


def test_the_mode_that_modal_lists(coarse, run_json):
    path = coarse.with_name("mode.html")
    report = drawn(run_json, coarse, "--mode", "torsional", "--output", path)
    modes = run_json("modal", str(coarse))["cranktrain"]
    number = [mode["hz"] for mode in modes["modes"]].index(modes["first_torsional_hz"]) + 1
    words = f"mode {number} of the cranktrain at rest, torsional, {modes['first_torsional_hz']:.1f} Hz"
    assert words in report["title"] and report["frames"] == 24
    assert report["enlargement"] == pytest.approx(1.0, rel=1e-3)
    again = drawn(run_json, coarse, "--mode", number, "--enlarge", "2", "--output", path)
    assert again == {**report, "enlargement": 2.0}
    assert page_data(path)["enlargement"] == 2.0
    free = drawn(run_json, coarse, "--free", "--output", path)
    assert "free crankshaft, torsional" in free["title"]


@pytest.mark.slow
def test_the_running_crank_in_the_colours_of_its_stress(coarse, run_json):
    path = coarse.with_name("run.html")
    report = drawn(run_json, coarse, "--speed", "2200", "--settle", "1e-2", "--output", path)
    data = page_data(path)
    assert report["frames"] == len(data["turn"]) == len(data["values"]) == 72
    given = "stress", str(coarse), "--speed", "2200", "--settle", "1e-2", "--no-check"
    stress = run_json(*given, "--output", str(coarse.with_name("run.h5")))
    greatest = [float(re.search(r"greatest (\d+) MPa", caption)[1]) for caption in data["captions"]]
    angles = np.array(stress["angles_deg"])
    at = [np.abs((angles - 10.0 * k + 360.0) % 720.0 - 360.0).argmin() for k in range(72)]
    assert greatest == pytest.approx(np.array(stress["max_von_mises_mpa"])[at], abs=0.51)  # shown in whole MPa


@pytest.mark.parametrize(("mode", "says"), [("torsion", "did you mean 'torsional'"), ("0", "within 1 to")])
def test_a_mode_that_there_is_not_is_one_line(mode, says, coarse, capsys):
    assert main(["picture", str(coarse), "--mode", mode]) == 2
    error = [line for line in capsys.readouterr().err.splitlines() if line.startswith("cranktrain:")]
    assert len(error) == 1 and says in error[0]
