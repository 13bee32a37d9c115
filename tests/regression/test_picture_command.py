"""The verb picture: its files, its JSON, and wrong input."""

import json
import re

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.engine.file import engine_path


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """Engine file with the coarse mesh of the other tests."""
    text = engine_path("diesel_i6").read_text(encoding="utf-8")
    path = tmp_path_factory.mktemp("picture") / "coarse.toml"
    path.write_text(re.sub(r"mesh_size = \{ value = [0-9.]+", "mesh_size = { value = 25", text), encoding="utf-8")
    return path


def drawn(capsys, *arguments):
    assert main(["picture", *map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def page_data(path):
    text = path.read_text("utf-8")
    return json.loads(re.search(r"^const DATA = (.*);$", text, re.MULTILINE)[1])


def test_the_mode_that_modal_lists(coarse, capsys):
    path = coarse.with_name("mode.html")
    report = drawn(capsys, coarse, "--mode", "torsional", "--output", path)
    assert main(["modal", str(coarse), "--json"]) == 0
    modes = json.loads(capsys.readouterr().out)["cranktrain"]
    number = [mode["hz"] for mode in modes["modes"]].index(modes["first_torsional_hz"]) + 1
    words = f"mode {number} of the cranktrain at rest, torsional, {modes['first_torsional_hz']:.1f} Hz"
    assert words in report["title"] and report["frames"] == 24
    assert report["enlargement"] == pytest.approx(1.0, rel=1e-3)
    again = drawn(capsys, coarse, "--mode", number, "--enlarge", "2", "--output", path)
    assert again == {**report, "enlargement": 2.0}
    assert page_data(path)["enlargement"] == 2.0
    free = drawn(capsys, coarse, "--free", "--output", path)
    assert "free crankshaft, torsional" in free["title"]


@pytest.mark.slow
def test_the_running_crank_in_the_colours_of_its_stress(coarse, capsys):
    path = coarse.with_name("run.html")
    report = drawn(capsys, coarse, "--speed", "2200", "--settle", "1e-2", "--output", path)
    data = page_data(path)
    assert report["frames"] == len(data["turn"]) == len(data["values"]) == 72
    given = ["stress", str(coarse), "--speed", "2200", "--settle", "1e-2", "--no-check", "--json"]
    assert main([*given, "--output", str(coarse.with_name("run.h5"))]) == 0
    stress = json.loads(capsys.readouterr().out)
    greatest = [float(re.search(r"greatest (\d+) MPa", caption)[1]) for caption in data["captions"]]
    angles = np.array(stress["angles_deg"])
    at = [np.abs((angles - 10.0 * k + 360.0) % 720.0 - 360.0).argmin() for k in range(72)]
    assert greatest == pytest.approx(np.array(stress["max_von_mises_mpa"])[at], abs=0.51)  # shown in whole MPa


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--mode", "torsion"), "did you mean 'torsional'"),
        (("--mode", "0"), "within 1 to"),
        (("--mode", "1", "--speed", "2200"), "leave one of them out"),
        (("--output", "crank.bmp"), ".html (a page to turn about)"),
        (("--speed", "10"), "--speed 10 is not within 20"),
        (("--enlarge", "-1"), "--enlarge"),
    ],
)
def test_wrong_input_is_one_line(arguments, says, coarse, capsys):
    assert main(["picture", str(coarse), *arguments]) == 2
    error = [line for line in capsys.readouterr().err.splitlines() if line.startswith("cranktrain:")]
    assert len(error) == 1 and says in error[0]
