"""The verb tradeoff: wrong input is one line, an interrupt says how to go on, and the JSON holds the points."""

import json

import pytest
from tradeoff_case import small

from cranktrain.cli.main import main
from cranktrain.store import kept as stores
from cranktrain_lab.tradeoff import measure, study

__all__ = ["small"]


@pytest.fixture
def scene(small, monkeypatch, tmp_path):
    """The small scene in place of the usual ones, with a store of its own."""
    monkeypatch.setattr(study, "default_scenes", lambda quick, total: [small])
    monkeypatch.setattr(stores, "cache_folder", lambda: tmp_path / "cache")
    return small


def test_json_and_tables(scene, capsys, run_json, tmp_path):
    arguments = ["tradeoff", "--quick", "--family", "modes", "--output", str(tmp_path / "out")]
    result = run_json(*arguments)
    assert {point["family"] for point in result["points"]} == {"modes"}
    assert set(result["reference"]["error_estimate"]) == {"pulley_torsion", "pulley_axial", "bearing_film"}
    assert any(point["pareto"] for point in result["points"])
    assert main(arguments) == 0
    shown = capsys.readouterr()
    assert "Pareto fronts" in shown.out and "modes: " in shown.out
    assert "100 %" not in shown.err.splitlines()[-1]  # nothing was run again: the store has it


def test_an_interrupt_keeps_what_was_measured(scene, capsys, tmp_path, monkeypatch):
    run, calls = measure.run, []

    def interrupted(case, say=None):
        calls.append(case)
        if len(calls) == 6:
            raise KeyboardInterrupt
        return run(case, say)

    monkeypatch.setattr(measure, "run", interrupted)
    arguments = ["tradeoff", "--quick", "--family", "modes", "--output", str(tmp_path / "out"), "--json"]
    assert main(arguments) == 130
    assert "repeat the command to continue" in capsys.readouterr().err
    assert not list((tmp_path / "out").iterdir())
    kept = len(list((tmp_path / "cache" / "tradeoff").glob("*.json")))
    calls.clear()
    monkeypatch.setattr(measure, "run", lambda case, say=None: calls.append(case) or run(case, say))
    assert main(arguments) == 0
    result = json.loads(capsys.readouterr().out)
    assert kept >= 1 and len(calls) == len(result["points"]) - kept
