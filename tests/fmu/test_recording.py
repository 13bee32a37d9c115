"""The native FMU under measured pressures and speed: its own run as measurement leaves no misfit."""

import json

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.store.hdf5 import read_result

pytestmark = pytest.mark.slow
FILE = """
engine = "single_petrol"
speed_rpm = 2400
cycles = 8
[measured]
file = "bench.csv"
channels = {{ {channels} }}
[units.cranktrain]
start = {{ "crank.level" = "torsional" }}
record = ["pulley.torsion"]
[[scenario]]
name = "run"
{asserts}
"""
ANGLE = np.arange(0.0, 720.0, 1.0)


def write(path, torsion=None):
    """Measurement of a smooth pressure with or without torsion, deg."""
    bump = 40.0 * np.exp(-(((ANGLE + 340.0) % 720.0 - 345.0) ** 2) / 900.0)
    columns = [ANGLE, 1.0 + bump, np.full(ANGLE.size, 2400.0)]
    names = ["crank.angle [deg]", "pressure [bar]", "speed [rev/min]"]
    if torsion is not None:
        columns, names = [*columns, torsion], [*names, "TORS [deg]"]
    rows = [",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join((",".join(names), *rows)) + "\n", "utf-8")


def test_its_own_run_as_measurement_leaves_no_misfit(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "bench.csv")
    (tmp_path / "first.toml").write_text(FILE.format(channels="", asserts=""), "utf-8")
    assert main(["harness", "first.toml", "--output", "first"]) == 0
    data, _ = read_result(tmp_path / "first" / "run.h5")
    angle, torsion = data["cranktrain/crank.angle"][0], np.degrees(data["cranktrain/pulley.torsion"][0])
    last = np.floor(angle[-1] / (4.0 * np.pi)) - 1.0
    write(tmp_path / "bench.csv", np.interp(np.radians(ANGLE) + 4.0 * np.pi * last, angle, torsion))
    asserts = (
        'assert = [ { output = "misfit.pulley.torsion", what = "rms", over_cycles = 1, unit = "deg", most = 1 }, '
        '{ output = "misfit.pulley.torsion", what = "peak_to_peak", over_cycles = 1, unit = "deg", most = 0 } ]'
    )
    text = FILE.format(channels='"pulley.torsion" = "TORS"', asserts=asserts)
    (tmp_path / "second.toml").write_text(text, "utf-8")
    capsys.readouterr()
    assert main(["harness", "second.toml", "--output", "second", "--html", "second.html", "--json"]) == 1
    assertions = json.loads(capsys.readouterr().out)["scenarios"][0]["assertions"]
    assert assertions[1]["passed"] and not assertions[2]["passed"]  # a swing is above zero
    assert assertions[1]["found"] < 2e-3 * np.ptp(torsion[-720:])
    assert "measurement" in (tmp_path / "second.html").read_text("utf-8")
    wrong = text.replace("misfit.pulley.torsion", "misfit.flywheel.torsion")
    (tmp_path / "wrong.toml").write_text(wrong, "utf-8")
    assert main(["harness", "wrong.toml", "--output", "wrong"]) == 2
    assert "the measurement has no flywheel.torsion to compare" in capsys.readouterr().err
