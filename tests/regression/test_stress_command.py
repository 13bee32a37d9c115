"""The verb stress: what its JSON and its file hold, its check, and wrong input."""

import json
import re

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.engine.file import engine_path
from cranktrain.store.hdf5 import read_result


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """Engine file with the coarse mesh of the other tests."""
    text = engine_path("diesel_i6").read_text(encoding="utf-8")
    path = tmp_path_factory.mktemp("stress") / "coarse.toml"
    path.write_text(re.sub(r"mesh_size = \{ value = [0-9.]+", "mesh_size = { value = 25", text), encoding="utf-8")
    return path


@pytest.mark.slow
def test_stresses_of_a_cycle(coarse, capsys):
    output, pictures = coarse.with_name("run.h5"), coarse.with_name("pictures")
    given = ["stress", str(coarse), "--speed", "2200", "--settle", "1e-2"]
    assert main([*given, "--output", str(output), "--plots", str(pictures), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    angles, greatest = np.array(report["angles_deg"]), np.array(report["max_von_mises_mpa"])
    assert np.all(np.diff(angles) > 0.0) and 0.0 <= angles[0] < angles[-1] < 720.0
    place = report["location"]
    assert place["von_mises_mpa"] == pytest.approx(greatest.max())
    assert place["angle_deg"] == pytest.approx(angles[greatest.argmax()])
    assert "fillet" in place["feature"]
    assert report["static_check_relative"] < 0.02
    assert {path.name for path in pictures.iterdir()} == {"stresses.png", "stress_envelope.png"}
    datasets, attributes = read_result(output)
    assert datasets["envelope_von_mises"][0].max() == pytest.approx(1e6 * greatest.max())
    assert attributes["static_check_relative"] == report["static_check_relative"]
    assert main([*given, "--no-check", "--output", str(output)]) == 0
    shown = capsys.readouterr().out
    assert place["feature"] in shown and "Direct finite-element" not in shown


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--speed", "50"), "--speed"),
        (("--speed", "2200", "--bearings", "impedence"), "impedance"),
        (("--speed", "2200", "--bearings", "held"), "held"),
        (("--speed", "2200", "--output", "."), "folder"),
        (("--speed", "2200", "--fillets", "7"), "1 to 6"),
        (("--speed", "2200", "--fillets", "all", "--mesh", "own.msh"), "own.msh"),
    ],
)
def test_wrong_input_is_one_line(arguments, says, capsys):
    assert main(["stress", "diesel_i6", *arguments]) == 2
    error = capsys.readouterr().err.strip()
    assert says in error and "\n" not in error


@pytest.mark.parametrize("option", ["--body", "--mesh"])
def test_a_reduced_body_in_place_of_the_elements_is_refused(tmp_path, capsys, option):
    body = tmp_path / "crank.npz"
    body.touch()
    assert main(["stress", "diesel_i6", "--speed", "2200", option, str(body)]) == 2
    error = capsys.readouterr().err.strip()
    assert "crank.npz: a reduced body has no stresses" in error and "\n" not in error
