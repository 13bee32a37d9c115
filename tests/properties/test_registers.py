"""One row adds a level or an output: files and rows of CONTRIBUTING.md, and nothing else is touched."""

import re
import runpy
import shutil
from pathlib import Path

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.dynamics.outputs.register import FAMILIES
from cranktrain.engine.file import load_engine
from cranktrain.film.laws.register import LAWS
from cranktrain.fmu.description import read_interface
from cranktrain.store.hdf5 import read_result
from cranktrain.studies.output_levels import bearing_ladder, lowest_levels
from cranktrain_lab.tradeoff.level_points import bearing_levels

ROOT = Path(__file__).parents[2]
INTERFACE = ROOT / "modelDescription"
FILES = dict(re.findall(r"```python\n# (\w+)\.py\n(.*?)```", (ROOT / "CONTRIBUTING.md").read_text("utf-8"), re.DOTALL))


@pytest.fixture
def added(tmp_path, monkeypatch):
    """Adds a file and its row; the registers are as they were behind the test."""
    tables = [(table, dict(table)) for table in (LAWS, FAMILIES)]
    monkeypatch.syspath_prepend(str(tmp_path))

    def add(name):
        for file in (name, f"{name}_row"):
            (tmp_path / f"{file}.py").write_text(FILES[file])
        runpy.run_path(str(tmp_path / f"{name}_row.py"))

    yield add
    for table, before in tables:
        table.clear()
        table.update(before)


def outputs_of(levels, folder):
    """Outputs by name of a cycle that the command line runs."""
    words = f"simulate diesel_i6 --crank rigid {levels} --speed 2000 --cycles 1 --json --output {folder}/run.h5"
    assert main(words.split()) == 0
    return {name: values for name, (values, _) in read_result(folder / "run.h5")[0].items()}


def test_a_law_with_tilt_runs_an_engine_from_the_command_line(added, tmp_path):
    """F = k r³/c² with the stiffness k of the engine file."""
    added("cubic")
    found = outputs_of("--bearings cubic", tmp_path)
    place = np.hypot(found["bearing[4].position.x"], found["bearing[4].position.y"])
    force = np.hypot(found["bearing[4].force.x"], found["bearing[4].force.y"])
    bearing = load_engine("diesel_i6").main_bearing
    assert np.median(force / place**3) == pytest.approx(bearing.ground_stiffness[1] / bearing.clearance**2, rel=0.01)
    assert np.abs(found["bearing[4].moment.x"]).max() > 0.0


def test_a_law_appears_wherever_levels_are_listed(added, capsys):
    added("cubic")
    with pytest.raises(SystemExit):
        main(["simulate", "--help"])
    assert "cubic" in capsys.readouterr().out
    levels = next(v for v in read_interface(INTERFACE).variables if v.name == "bearing.level")
    assert "cubic" in levels.choices and "springs that stiffen" in levels.description
    for ladder in (bearing_ladder(rollers=False), bearing_levels(load_engine("diesel_i6"))):
        assert ladder[ladder.index("impedance") - 1] == "cubic"
    assert main(["simulate", "diesel_i6", "--bearings", "cubik", "--speed", "2000"]) == 2
    assert "did you mean 'cubic'" in capsys.readouterr().err


def test_an_output_is_one_file_one_row_and_one_entry(added, tmp_path):
    added("wind_up")
    assert outputs_of("--bearings linear", tmp_path)["frame.wind_up"].max() > 0.0
    assert lowest_levels(["frame.wind_up"]).crank == "torsional"
    folder = shutil.copytree(INTERFACE, tmp_path / "interface")
    text = (folder / "interface.toml").read_text()
    entry = '\n[[variable]]\nname = "frame.wind_up"\ncausality = "output"\nunit = "rad"\n'
    (folder / "interface.toml").write_text(text + entry + 'description = "wind-up of the shaft"\n')
    assert read_interface(folder).variables[-1].name == "frame.wind_up"
