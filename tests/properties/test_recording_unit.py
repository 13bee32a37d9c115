"""Measurements beside the model: channels over crank angle, their zero, and what is refused in one line."""

import math

import numpy as np
import pytest

from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain_lab.coupling.recording_unit import Recording, RecordingUnit, without_zero
from cranktrain_lab.coupling.run import Coupled
from cranktrain_lab.coupling.unit import Port
from cranktrain_lab.harness.file import load_harness
from cranktrain_lab.harness.recording import read_recording, with_misfits
from cranktrain_lab.harness.tables import RecordingTable

ANGLE = np.arange(0.0, 720.0, 2.0)
PRESSURE = 5.0 + 4.0 * np.cos(np.radians(0.5 * ANGLE))
TORSION = 0.3 * np.sin(np.radians(1.5 * ANGLE))


def table(path, columns):
    """Write a text table of named columns."""
    rows = (",".join(f"{value:.9g}" for value in row) for row in zip(*columns.values(), strict=True))
    path.write_text("\n".join((",".join(columns), *rows)) + "\n", "utf-8")
    return path


def read(path, engine="four_petrol", **more):
    return read_recording(path, RecordingTable(file=path.name, **more), load_engine(engine))


def one_pressure(**more):
    return {"crank.angle [deg]": ANGLE, "pressure [bar]": PRESSURE, "pulley.torsion [deg]": TORSION, **more}


def test_one_pressure_serves_all_cylinders_at_their_firing_angles(tmp_path):
    found = read(table(tmp_path / "bench.csv", one_pressure()))
    unit = RecordingUnit("measured", found)
    for c, phase in enumerate(load_engine("four_petrol").firing_angles):
        pressures = [unit.at(f"cylinder[{c + 1}].pressure", phase + angle) for angle in (0.0, 1.0, 4.0)]
        assert pressures == pytest.approx([1e5 * (5.0 + 4.0 * math.cos(0.5 * angle)) for angle in (0.0, 1.0, 4.0)])
    assert unit.at("pulley.torsion", math.pi / 3.0) == pytest.approx(0.3 * math.sin(math.pi / 2.0), abs=1e-6)


def test_angles_that_start_anew_are_cycles_and_repeat_after_the_last(tmp_path):
    columns = {name: np.concatenate((own, own)) for name, own in one_pressure().items()}
    columns["pulley.torsion [deg]"] = np.concatenate((TORSION, 2.0 * TORSION))
    found = read(table(tmp_path / "bench.csv", columns))
    unit = RecordingUnit("measured", found)
    assert found.cycles == 2
    peak = math.pi / 3.0
    values = [unit.at("pulley.torsion", peak + 4.0 * math.pi * cycle) for cycle in (0, 1, 2)]
    assert values == pytest.approx([0.3, 0.6, 0.3], abs=1e-4)


def test_values_belong_to_the_angle_at_the_end_of_the_step():
    ports = {"pulley.torsion": Port("rad")}
    angles = np.arange(720) * (math.pi / 180.0)
    unit = RecordingUnit("measured", Recording("bench", 1, 0.0, {"pulley.torsion": np.sin(angles)}, ports))
    unit.link(("crank.angle", "crank.speed"), ("pulley.torsion", "pressure.angle"))
    unit.write(np.array([0.2, 100.0]))
    kept = unit.keep()
    unit.step(0.0, 0.001)
    assert unit.read() == pytest.approx([math.sin(0.3), 0.3], abs=1e-6)
    unit.restore(kept)
    assert unit.read()[1] == 0.0


def test_the_zero_is_the_mean_over_the_cycle_that_ends():
    angle = np.linspace(0.0, 16.0 * math.pi, 2881)
    wave = np.sin(angle) + 0.3 * np.cos(0.5 * angle)
    assert without_zero(angle, 5.0 + wave) == pytest.approx(wave, abs=1e-4)
    drift = without_zero(angle, 0.1 * angle)
    assert drift[-1] == pytest.approx(0.1 * 2.0 * math.pi, rel=1e-3)  # half a cycle behind


def test_a_run_that_ends_at_once_has_misfits_of_its_points():
    """Assertions on them are judged, whatever ended the run."""
    port, names = Port("rad", dimensions=(0,) * 8), ("measured.a", "cranktrain.a", "cranktrain.crank.angle")
    for rows in (np.array([[1.0, 3.0, 0.0]]), np.array([[1.0, 3.0, 0.0], [1.0, 5.0, 0.1]])):
        times, none = 1e-4 * np.arange(len(rows)), {}
        run = Coupled(names, ("rad",) * 3, times, rows, none, len(rows) - 1, 0, 0, 0.0, "fails")
        found = with_misfits(run, ["a"], {"measured.a": port, "cranktrain.a": port})
        assert found.of("misfit.a") == pytest.approx(rows[:, 1] - rows[:, 1].mean())


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"crank.angle [deg]": None}, r"bench.csv has no channel 'crank.angle'; name it"),
        ({"pressure [bar]": None}, r"pressures of 0 of the 4 cylinders"),
        ({k: own[:300] for k, own in one_pressure().items()}, r"covers 598 deg of crank angle, less than the 720"),
        ({"pressure [bar]": PRESSURE - 3.0}, r"falls to -2.* bar; pressures are absolute"),
        ({"cylinder[5].pressure [bar]": PRESSURE}, r"has 'cylinder\[5\].pressure', engine 'four_petrol' 4 cylinders"),
        ({"crank.angle [deg]": 0.0 * ANGLE}, r"does not rise from sample 1 on"),
        ({"pressure [bar]": 1e200 * PRESSURE}, r"cylinder\[1\].pressure of bench.csv goes to .*e\+205 \(SI\)"),
        ({"pulley.torsion [deg]": 1e300 * TORSION}, r"pulley.torsion of bench.csv goes to .*e\+299 \(SI\)"),
        ({"speed [rev/min]": np.full(ANGLE.size, 1e9)}, r"speed of bench.csv goes to 1.05e\+08 \(SI\)"),
        ({"crank.angle [deg]": np.append(ANGLE[:-1], 1e300)}, r"has a gap of 1e\+300 deg; correct it"),
        ({"channels": {"speed": "N"}}, r"measured.channels.'speed': channel 'N' is not in bench.csv"),
    ],
)
def test_what_cannot_be_beside_a_model_is_refused(tmp_path, changes, says):
    more = {"channels": changes.pop("channels")} if "channels" in changes else {}
    columns = {name: own for name, own in (one_pressure() | changes).items() if own is not None}
    with pytest.raises(InputError, match=says):
        read(table(tmp_path / "bench.csv", columns), **more)


SCENARIO = """
engine = "four_petrol"
speed_rpm = 2000
cycles = 2
{more}
[measured]
file = "bench.csv"
[[scenario]]
name = "one"
"""


def test_a_measurement_takes_the_place_of_the_combustion(tmp_path):
    table(tmp_path / "bench.csv", one_pressure(**{"speed [rev/min]": np.full(ANGLE.size, 1800.0)}))
    path = tmp_path / "bench.toml"
    path.write_text(SCENARIO.format(more="").replace("speed_rpm = 2000\n", ""), "utf-8")
    found = load_harness(path)
    assert set(found.units) == {"cranktrain"}
    assert found.speed == pytest.approx(1800.0 * math.pi / 30.0)
    path.write_text(SCENARIO.format(more='[units.combustion]\nbuild = "combustion_i6"'), "utf-8")
    with pytest.raises(InputError, match=r"units.combustion: \[measured\] takes the place of it"):
        load_harness(path)
    path.write_text(SCENARIO.format(more="").replace('engine = "four_petrol"\n', ""), "utf-8")
    with pytest.raises(InputError, match="name an engine"):
        load_harness(path)
