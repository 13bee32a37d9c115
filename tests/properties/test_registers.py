"""One row adds a level or an output: each test writes one new file, registers one row, and touches nothing else."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.dynamics.outputs.register import FAMILIES, Family, register_family
from cranktrain.engine.file import load_engine
from cranktrain.film.laws.register import LAWS, PLAIN, Form, Law, register_law
from cranktrain.fmu.description import read_interface
from cranktrain.store.hdf5 import read_result
from cranktrain.studies.output_levels import bearing_ladder, lowest_levels
from cranktrain_lab.tradeoff.level_points import bearing_levels

INTERFACE = Path(__file__).parents[2] / "modelDescription"

SPRINGS = """
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, GAP, SIZE

STIFFNESS, DAMPING = 1.0e9, 1.0e4


class Springs(NamedTuple):
    stiffness: Array


def springs(bearings):
    return Springs(np.full(len(bearings.parameters), STIFFNESS))


_read = record_reader(Springs(np.zeros(1)))


@law_kernel
def spring_law(record, action, i, place, velocity, numbers, memory, out):
    stiffness = _read(record).stiffness[i]
    for k in range(SIZE):
        out[k] = 0.0
    for k in range(4):
        out[k] = -stiffness * place[k] - DAMPING * velocity[k]
        out[BY_PLACE + 5 * k] = -stiffness
        out[BY_VELOCITY + 5 * k] = -DAMPING
    out[GAP] = -1.0
    return 0
"""

WIND_UP = """
from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model.slots import LEAD


@law_kernel
def observe_wind_up(model, work, state, members, out):
    out[0] = work.frames[0, LEAD]
    return 0
"""


@pytest.fixture
def rows():
    """The registers, which a test may add to; as they were behind it."""
    tables = [(table, dict(table)) for table in (LAWS, FAMILIES)]
    yield
    for table, before in tables:
        table.clear()
        table.update(before)


@pytest.fixture
def law(rows, tmp_path, monkeypatch):
    """A law ``springs`` that feels tilt."""
    (tmp_path / "spring_law.py").write_text(SPRINGS)
    monkeypatch.syspath_prepend(str(tmp_path))
    form = Form("spring_law:spring_law", "spring_law:springs", tilt=True)
    register_law(Law("springs", "springs that feel tilt", {PLAIN: form}, clearance=False))


def test_a_law_with_tilt_runs_an_engine_from_the_command_line(law, tmp_path):
    result = tmp_path / "run.h5"
    arguments = "simulate diesel_i6 --crank rigid --bearings springs --speed 2000 --cycles 1 --json --output"
    assert main([*arguments.split(), str(result)]) == 0
    run, _ = read_result(result)
    outputs = {name: values for name, (values, _) in run.items()}
    place = np.hypot(outputs["bearing[4].position.x"], outputs["bearing[4].position.y"])
    force = np.hypot(outputs["bearing[4].force.x"], outputs["bearing[4].force.y"])
    assert np.median(force / place) == pytest.approx(1.0e9, rel=0.1)
    assert np.abs(outputs["bearing[4].moment.x"]).max() > 0.0


def test_a_law_appears_wherever_levels_are_listed(law, capsys):
    with pytest.raises(SystemExit):
        main(["simulate", "--help"])
    assert "springs" in capsys.readouterr().out
    levels = next(v for v in read_interface(INTERFACE).variables if v.name == "bearing.level")
    assert "springs" in levels.choices and "springs that feel tilt" in levels.description
    assert bearing_ladder(rollers=False)[-1] == "springs"
    assert bearing_levels(load_engine("diesel_i6"))[-1] == "springs"


def test_an_unknown_level_is_refused_with_the_nearest(law, capsys):
    assert main(["simulate", "diesel_i6", "--bearings", "spring", "--speed", "2000"]) == 2
    assert "springs" in capsys.readouterr().err


def test_an_output_is_one_file_one_row_and_one_entry(rows, tmp_path, monkeypatch, capsys):
    (tmp_path / "wind_up.py").write_text(WIND_UP)
    monkeypatch.syspath_prepend(str(tmp_path))
    register_family(Family("frame", "wind_up:observe_wind_up", {"torsion": {"crank": "torsional"}}))
    result = tmp_path / "run.h5"
    arguments = "simulate diesel_i6 --crank rigid --bearings linear --speed 2000 --cycles 1 --json --output"
    assert main([*arguments.split(), str(result)]) == 0
    json.loads(capsys.readouterr().out)
    run, _ = read_result(result)
    assert run["frame.torsion"][0].max() > 0.0
    assert lowest_levels(["frame.torsion"]).crank == "torsional"
    folder = shutil.copytree(INTERFACE, tmp_path / "interface")
    text = (folder / "interface.toml").read_text()
    entry = '\n[[variable]]\nname = "frame.torsion"\ncausality = "output"\nunit = "rad"\n'
    (folder / "interface.toml").write_text(text + entry + 'description = "wind-up of the shaft"\n')
    assert read_interface(folder).variables[-1].name == "frame.torsion"
