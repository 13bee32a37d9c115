"""The verb tradeoff --total: wrong input is one line, an interrupt says how to go on, and the JSON is what ships."""

import json

import pytest
from total_error import few

from cranktrain.cli.main import main
from cranktrain.studies import kept as stores
from cranktrain.studies.tradeoff.total import measure, shipped, study

__all__ = ["few"]


@pytest.fixture
def scene(few, monkeypatch, tmp_path):
    """The few choices in place of the usual ones, with a store of its own."""
    monkeypatch.setattr(study, "total_scenes", lambda quick: [few])
    monkeypatch.setattr(stores, "cache_folder", lambda: tmp_path / "cache")
    return few


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--family", "modes"), "--total is a study of its own; leave --family out"),
        (("nothing.toml",), "nothing.toml"),
        (("--output", "/dev/null/here"), "no files can be written there"),
    ],
)
def test_wrong_input_is_one_line(arguments, says, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["tradeoff", "--total", *arguments]) == 2
    error = capsys.readouterr().err
    assert says in error and error.count("\n") == 1


def test_json_is_what_ships_and_tables_say_what_to_take(scene, capsys, tmp_path):
    arguments = ["tradeoff", "--total", "--output", str(tmp_path / "out")]
    assert main([*arguments, "--json"]) == 0
    printed = capsys.readouterr().out
    result = json.loads(printed)
    assert result["command"] == "cranktrain tradeoff --total"
    digest, figures = shipped.read(printed)
    assert digest == shipped.engine_digest(scene.engine) and len(figures.points) == 4
    assert json.loads((tmp_path / "out" / "total.json").read_text("utf-8"))["points"] == result["points"]
    assert main(arguments) == 0
    shown = capsys.readouterr()
    assert "torsion of the pulley" in shown.out and "for 3 %" in shown.out and "the default, beam/linear" in shown.out


def test_an_interrupt_keeps_what_was_measured(scene, capsys, tmp_path, monkeypatch):
    honest, calls = measure._run, []

    def interrupted(job, say):
        calls.append(job)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return honest(job, say)

    monkeypatch.setattr(measure, "_run", interrupted)
    arguments = ["tradeoff", "--total", "--output", str(tmp_path / "out"), "--json"]
    assert main(arguments) == 130
    assert "the same command goes on from there" in capsys.readouterr().err
    assert not list((tmp_path / "out").iterdir())
    kept = len(list((tmp_path / "cache" / "total").glob("*.npz")))
    calls.clear()
    monkeypatch.setattr(measure, "_run", lambda job, say: calls.append(job) or honest(job, say))
    assert main(arguments) == 0
    assert kept == 2 and len(calls) == 7 - kept  # the best model's fine run is one of its own
