"""FMUs with measured pressures and another drive line: what they carry, do, refuse; their own run as measurement."""

import json
import math

import build_fmu
import numpy as np
import pytest
from fmpy import simulate_fmu

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.fmu import build as building
from cranktrain.fmu import flat
from cranktrain.fmu.flat import FlatModel
from cranktrain.fmu.running import simulation
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.pressure_map import read_gas
from cranktrain.store.hdf5 import read_result
from cranktrain.structure.assembly import running_crank

ENGINE, LINE = (
    "single_petrol",
    "disc,inertia,to,stiffness,shaft_damping\nflywheel,,,900,4\nclutch,0.05,dynamometer,600,6\n",
)
RPM = 3000.0


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Pressures of 0.8 and 0.6 of the engine's own burn, and a drive line; FMUs have the torsional crank alone."""
    trace = GasTrace.from_engine(load_engine(ENGINE))
    for share in (0.8, 0.6):
        bar = 1e-5 * (trace.motored + share * (trace.fired - trace.motored))
        rows = "\n".join(f"{angle};{value:.6f}" for angle, value in enumerate(bar))
        (tmp_path / "map").mkdir(exist_ok=True)
        (tmp_path / "map" / f"{5000 * share:.0f}.csv").write_text(f"deg;bar\n{rows}\n", "utf-8")
    (tmp_path / "line.csv").write_text(LINE, "utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        building,
        "whole_model",
        lambda engine, **_: FlatModel(engine, {"torsional": running_crank(engine, "torsional")}),
    )
    return tmp_path


def built(capsys, *options):
    """Path of an FMU that the command builds, and what it says; skips where no library can be made."""
    code = build_fmu.main([ENGINE, "--start", "crank.level=torsional", "-o", "dist", *options])
    said = capsys.readouterr()
    if "C compiler" in said.err:
        pytest.skip(said.err)
    assert code == 0, said.err
    return said.out.strip(), said.err


def last_cycle(path, *names):
    """Samples of outputs over the last of 12 cycles at ``RPM``."""
    cycle = 120.0 / RPM
    result = simulate_fmu(
        path, stop_time=12.0 * cycle, output_interval=cycle / 720.0, start_values={"speed": RPM * math.pi / 30.0},
        output=list(names),
    )  # fmt: skip
    return [np.array(result[name][-720:]) for name in names]


def test_its_work_is_that_of_the_pressures_in_the_file(folder, capsys):
    """Mean indicated torque p_mi V_h / 4π, of a file's own mean pressure, in a cycle at constant speed."""
    engine = load_engine(ENGINE)
    found = []
    for share in (0.8, 0.6):
        file = f"map/{5000 * share:.0f}.csv"
        path, said = built(capsys, "--pressure", file)
        assert f"measured trace {5000 * share:.0f}.csv, peak" in said
        torque = last_cycle(path, "torque.indicated")[0].mean()
        wanted = read_gas(file, engine).imep * engine.displacement / (4.0 * math.pi)
        assert torque == pytest.approx(wanted, rel=0.01)
        found.append(torque)
    assert found[1] < 0.9 * found[0]


def test_its_drive_line_holds_the_mean_torque_and_filters_the_rest(folder, capsys):
    """On a soft line the torque at the flywheel has the same mean as on the engine's own shaft, and less ripple."""
    own, _ = built(capsys, "--pressure", "map/4000.csv")
    (stiff,) = last_cycle(own, "shaft.torque")
    soft_path, _ = built(capsys, "--pressure", "map/4000.csv", "--drive-line", "line.csv")
    (soft,) = last_cycle(soft_path, "shaft.torque")
    assert soft.mean() == pytest.approx(stiff.mean(), rel=0.05)
    assert np.ptp(soft) < 0.5 * np.ptp(stiff)


def test_each_cylinder_s_trace_comes_back_from_the_archive():
    trace = GasTrace.from_engine(load_engine(ENGINE))
    both = tuple(GasTrace(trace.motored, share * trace.fired, share, 2.0, 0.0, "x") for share in (1.0, 0.5))
    gas = GasTrace(trace.motored, 0.75 * trace.fired, 0.75, 2.0, 0.0, "x", both)
    read = flat.from_bytes(flat.to_bytes(FlatModel(load_engine(ENGINE), {}, gas=gas))).gas
    assert read is not None and read.values == gas.values and read.source == "x"
    assert flat.from_bytes(flat.to_bytes(FlatModel(load_engine(ENGINE), {}))).gas is None


def test_a_simulation_of_its_data_runs_on_the_measured_trace():
    """As the Python FMU makes one."""
    engine = load_engine(ENGINE)
    own = GasTrace.from_engine(engine)
    gas = GasTrace(own.motored, 0.9 * own.fired, 0.9 * own.imep, own.best_speed, 0.0, "x")
    model = FlatModel(engine, {"torsional": running_crank(engine, "torsional")}, gas=gas)
    made = simulation(model, {"crank": "torsional"}, {})
    assert made.gas.values == gas.values and not made.gas.built_in


def test_a_map_is_refused_in_one_line_and_leaves_no_file(folder, capsys):
    assert build_fmu.main([ENGINE, "--pressure", "map", "-o", "dist"]) == 2
    said = capsys.readouterr().err
    assert "map: has traces over speed and load, and an FMU carries one trace" in said and said.count("\n") == 1
    assert not (folder / "dist").exists()


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


@pytest.mark.slow
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
