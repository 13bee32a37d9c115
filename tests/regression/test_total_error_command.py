"""The verb tradeoff --total: wrong input is one line, an interrupt says how to go on, and the JSON is what ships."""

import json

import pytest
from film_tables import coarse_mains
from total_error import few

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.store import kept as stores
from cranktrain.studies.total_error import shipped
from cranktrain.studies.total_error.families import FAMILIES
from cranktrain.studies.total_error.point import Best, Split, TotalPoint
from cranktrain_lab.tradeoff import settled, study

__all__ = ["few"]


@pytest.fixture
def scene(few, monkeypatch, tmp_path):
    """The few choices in place of the usual ones, with a store of its own."""
    monkeypatch.setattr(study, "default_scenes", lambda quick, total: [few])
    monkeypatch.setattr(stores, "cache_folder", lambda: tmp_path / "cache")
    return few


def test_json_is_what_ships_and_tables_say_what_to_take(scene, capsys, tmp_path):
    arguments = ["tradeoff", "--total", "--output", str(tmp_path / "out")]
    assert main([*arguments, "--json"]) == 0
    printed = capsys.readouterr().out
    result = json.loads(printed)
    assert result["command"] == "cranktrain tradeoff --total"
    digest, figures = shipped.read(printed)
    assert digest == shipped.engine_digest(scene.engine) and len(figures.points) == 6
    assert json.loads((tmp_path / "out" / "total.json").read_text("utf-8"))["points"] == result["points"]
    assert main(arguments) == 0
    shown = capsys.readouterr()
    assert "torsion of the pulley" in shown.out and "for 3 %" in shown.out and "the default, beam/linear" in shown.out


def test_an_interrupt_keeps_what_was_measured(scene, capsys, tmp_path, monkeypatch):
    honest, calls = settled._run, []

    def interrupted(job, say):
        calls.append(job)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return honest(job, say)

    monkeypatch.setattr(settled, "_run", interrupted)
    arguments = ["tradeoff", "--total", "--output", str(tmp_path / "out"), "--json"]
    assert main(arguments) == 130
    assert "repeat the command to continue" in capsys.readouterr().err
    assert not list((tmp_path / "out").iterdir())
    kept = len(list((tmp_path / "cache" / "tradeoff").glob("*.npz")))
    calls.clear()
    monkeypatch.setattr(settled, "_run", lambda job, say: calls.append(job) or honest(job, say))
    assert main(arguments) == 0
    assert kept == 2 and len(calls) == 8 - kept  # the best model's own fine run is what all are compared with


def test_a_plan_takes_its_levels_from_shipped_figures(capsys, run_json, tmp_path, monkeypatch):
    """The cheapest choice within the accuracy of the best model, and by that its accuracy is judged."""

    def figured(crank, bearings, total, cost):
        errors = {**dict.fromkeys(FAMILIES), "torsion": Split(total, 0.9 * total, 0.2 * total, 0.0)}
        return TotalPoint("six 2000", 2000.0, crank, bearings, "ground", "esdirk4", 2.5, cost, errors)

    points = (
        figured("torsional", "held", 0.25, 0.05), figured("beam", "impedance", 0.1, 0.3),
        figured("solid", "impedance", 0.05, 0.4),
    )  # fmt: skip
    known = shipped.Shipped(points, {"six 2000": Best("solid/ehd/flexible", "esdirk4", 1.0, True, 99.0)}, "")
    digest = shipped.engine_digest(load_engine("diesel_i6"))
    monkeypatch.setattr(shipped, "_all", lambda: {digest: known})
    coarse_mains(monkeypatch)
    path = tmp_path / "scene.toml"

    def planned(accuracy):
        path.write_text(
            'engine = "diesel_i6"\nspeeds_rpm = [2000]\noutputs = ["pulley.torsion"]\nfrequency_hz = 400\n'
            f"accuracy = {accuracy}\ncycles = 3\n"
        )
        return run_json("plan", str(path))

    plan = planned(0.3)
    assert (plan["crank"], plan["bearings"], plan["block"]) == ("torsional", "held", "ground")
    assert 0.225 <= plan["predicted_total_error"] <= 0.3 and plan["within_accuracy"]
    assert plan["total_error_against"].startswith("against solid/ehd/flexible, measured at 2000 rev/min")
    assert any("torsional/held/ground esdirk4 2.5° is 25 % in all" in reason for reason in plan["reasons"])
    plan = planned(0.12)
    assert (plan["crank"], plan["bearings"]) == ("beam", "impedance")
    # What no measured choice reaches is looked for on the ladder, and said.
    plan = planned(0.04)
    assert plan["predicted_total_error"] is None and plan["total_error_against"] is None
    assert any("no measured choice serves 4 %" in reason for reason in plan["reasons"])
    assert main(["plan", str(path)]) == 0
    assert "closest solid/impedance/ground esdirk4 2.5°, 5 %" in capsys.readouterr().out.replace("\n", " ")
