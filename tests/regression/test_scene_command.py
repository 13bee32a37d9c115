"""The verbs plan and run: what their JSON holds, what an interrupt keeps, and wrong scenes."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from engine_texts import coarse_text

from cranktrain.cli.main import main
from cranktrain.store.hdf5 import read_result
from cranktrain.store.kept import Kept
from cranktrain.studies.planning import measured, scene_model
from cranktrain.studies.planning.scene_model import SceneModel
from cranktrain.studies.scene import load_scene

PLAIN = {
    "engine": '"diesel_i6"',
    "speeds_rpm": "[2000]",
    "outputs": '["pulley.torsion"]',
    "frequency_hz": "400",
    "accuracy": "0.05",
}


def write(path, tables="", **keys):
    """Scene file of PLAIN with these keys changed; None leaves one out."""
    entries = {**PLAIN, **keys}
    lines = [f"{key} = {value}" for key, value in entries.items() if value is not None]
    path.write_text("\n".join(lines) + "\n" + tables, encoding="utf-8")
    return str(path)


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """V8 on a coarse mesh: its ladder needs no film table."""
    path = tmp_path_factory.mktemp("scene") / "coarse.toml"
    path.write_text(coarse_text("diesel_v8", 50, count=1), "utf-8")
    return path


@pytest.fixture
def scene(coarse, tmp_path):
    """Scene whose levels, method and step are fixed, so that little is measured."""

    def written(tables="", **keys):
        fixed = {"crank": '"torsional"', "integrator": '"esdirk4"', "step_deg": "4", "cycles": "3"}
        return write(tmp_path / "scene.toml", tables, engine=f'"{coarse}"', **{**fixed, **keys})

    return written


def test_the_example_is_a_scene():
    scene = load_scene(Path(__file__).parents[2] / "examples" / "scene.toml")
    assert scene.outputs == ("pulley.torsion", "bearing[4].force.y")
    assert (scene.speeds_rpm, scene.frequency, scene.accuracy, scene.budget) == ((2000.0,), 600.0, 0.3, 2)


def test_stresses_alone_are_judged_by_what_they_follow(tmp_path):
    scene = load_scene(write(tmp_path / "scene.toml", outputs='["stress"]'))
    assert scene.stress
    assert scene.outputs[0] == "pulley.torsion" and "bearing[7].force.y" in scene.outputs


def test_plan(scene, capsys, run_json):
    plan = run_json("plan", scene())
    assert (plan["crank"], plan["bearings"], plan["block"]) == ("torsional", "held", "ground")
    assert (plan["integrator"], plan["step_deg"]) == ("esdirk4", 4.0)
    assert plan["modes"] > 6
    assert 0.0 < plan["predicted_numerical_error"] < plan["predicted_model_error"] < plan["predicted_error"]
    # Three cycles leave something of settling, an error of its own.
    assert 0.0 < plan["predicted_settling_error"] < 0.1
    parts = [plan[f"predicted_{kind}_error"] for kind in ("numerical", "model", "settling")]
    total = math.hypot(*parts)
    assert plan["predicted_error"] == pytest.approx(total, rel=1e-9)  # one output: the same one is worst in both
    assert plan["predicted_real_time_factor"] > 0.0
    assert (plan["next_level"]["crank"], plan["next_level"]["bearings"]) == ("beam", "roller")
    assert len(plan["reasons"]) >= 5
    assert main(["plan", scene()]) == 0
    assert "next level up" in capsys.readouterr().out


def test_run_and_verify(scene, tmp_path, run_json):
    output = tmp_path / "kept.h5"
    result = run_json("plan", scene(), "--run", "--verify", "--output", str(output))
    datasets, attributes = read_result(output)
    assert result["result"] == str(output) and not result["interrupted"]
    assert attributes["crank"] == "torsional"
    values, unit = datasets["pulley.torsion"]
    torsion = result["outputs"]["pulley.torsion"]
    assert unit == torsion["unit"] == "rad"
    last = values[-181:-1]  # 720 degrees in steps of 4
    assert torsion["amplitude"] == pytest.approx(0.5 * np.ptp(last), rel=1e-12)
    assert torsion["mean"] == pytest.approx(last.mean(), rel=1e-12)
    assert torsion["orders"][-1][0] == pytest.approx(400 * 60 / 2000, abs=0.5)
    own, check = result["levels"]
    assert (own["crank"], check["crank"]) == ("torsional", "beam")
    assert check["step_deg"] == 2.0 and check["difference"] == {"pulley.torsion": 0.0}
    verification = result["verification"]
    assert verification["verified_error"] == own["difference"]["pulley.torsion"]
    assert verification["ratio"] == pytest.approx(verification["predicted_error"] / verification["verified_error"])


def test_every_level(scene, tmp_path, run_json):
    output = tmp_path / "ladder.h5"
    result = run_json("plan", scene(), "--run", "--all-levels", "--output", str(output))
    found = [(level["crank"], level["bearings"]) for level in result["levels"]]
    assert found == [("torsional", "held"), ("beam", "roller"), ("solid", "linear"), ("solid", "roller")]
    differences = [level["difference"]["pulley.torsion"] for level in result["levels"]]
    assert differences[-1] == 0.0 and min(differences[:-1]) > 0.0
    assert all(level["seconds"] > 0.0 and level["status"] == "ok" for level in result["levels"])
    datasets, _ = read_result(output)
    assert "levels/solid-roller/2000rpm/pulley.torsion" in datasets


def test_a_run_up_keeps_a_run_per_speed(scene, tmp_path, run_json):
    tables = "[run_up]\nfrom = 1500\nto = 2000\npoints = 3\n"
    output = tmp_path / "up.h5"
    result = run_json("plan", scene(tables, speeds_rpm=None), "--run", "--output", str(output))
    torsion = result["outputs"]["pulley.torsion"]
    assert [row[0] for row in torsion["by_speed"]] == [1500.0, 1750.0, 2000.0]
    assert torsion["amplitude"] == max(row[2] for row in torsion["by_speed"])
    datasets, _ = read_result(output)
    assert {"1500rpm/pulley.torsion", "1750rpm/pulley.torsion", "2000rpm/pulley.torsion"} <= set(datasets)


def test_an_interrupt_keeps_what_is_complete(scene, tmp_path, capsys, run_json, monkeypatch):
    output = tmp_path / "cut.h5"
    path = scene()
    run_json("plan", path)  # measures all that the run's own plan needs
    honest, calls = SceneModel.run, []

    def interrupted(model, case, *arguments, **more):
        calls.append(case)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return honest(model, case, *arguments, **more)

    monkeypatch.setattr(SceneModel, "run", interrupted)
    assert main(["plan", path, "--run", "--all-levels", "--output", str(output), "--json"]) == 130
    result = json.loads(capsys.readouterr().out)
    assert result["interrupted"]
    assert [level["status"] for level in result["levels"]] == ["ok", "ok", "interrupted"]
    datasets, _ = read_result(output)
    assert "pulley.torsion" in datasets and "levels/beam-roller/2000rpm/pulley.torsion" in datasets


def test_half_a_run_is_not_kept(scene, tmp_path, capsys, run_json, monkeypatch):
    monkeypatch.setattr(measured, "Kept", lambda folder: Kept(tmp_path / "store"))
    honest = scene_model.simulate

    def cut(*arguments, **choices):
        return replace(honest(*arguments, **choices), complete=False)

    monkeypatch.setattr(scene_model, "simulate", cut)
    path = scene()
    assert main(["plan", path]) == 130
    assert "finished measurements are kept" in capsys.readouterr().err
    assert not list((tmp_path / "store").glob("*.npz"))
    monkeypatch.setattr(scene_model, "simulate", honest)
    assert run_json("plan", path)["predicted_real_time_factor"] > 0.0


def test_a_budget_that_is_missed_is_said_and_no_error(scene, run_json):
    plan = run_json("plan", scene(budget_real_time_factor="1e-4"))
    assert not plan["within_budget"]
    assert any(reason.startswith("budget missed") for reason in plan["reasons"])


def test_films_of_a_scene_are_as_warm_as_it_says(tmp_path):
    levels = {"crank": '"rigid"', "bearings": '"impedance"', "outputs": '["bearing.force.y"]', "cycles": "2"}
    path = write(tmp_path / "scene.toml", **levels, frequency_hz="50", film_temperature='"heat-balance"')
    model = SceneModel(load_scene(path))
    case = model.case("rigid", "impedance", "esdirk4", math.radians(4.0))
    warm = model.run(case, 209.4).film_temperatures
    assert model.settings(replace(case, bearings="linear")).film_temperature == "engine"
    cold = SceneModel(replace(model.scene, film_temperature="engine")).run(case, 209.4).film_temperatures
    assert np.ptp(cold) == 0.0 and (warm > cold + 1.0).all()


def test_an_accuracy_that_no_step_reaches(scene, capsys):
    path = scene(accuracy="1e-6", integrator='"backward-euler"', step_deg=None)
    assert main(["plan", path]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert "cannot be reached" in error and "the nearest valid accuracy is" in error
