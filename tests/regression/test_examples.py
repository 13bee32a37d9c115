"""Every example runs, and gives one number that is known."""

import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scripts import example

import cranktrain as ct
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.additions import read_added
from cranktrain.structure.crank.level import crank_body

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(scope="module")
def beam():
    """The six's crankshaft of beams, which takes no finite elements."""
    return crank_body(load_engine("diesel_i6"), "beam")


def test_all_examples_are_here():
    fmus = Path(__file__).parents[1] / "fmu"
    others = "".join((fmus / f"test_{name}.py").read_text("utf-8") for name in ("example_fmus", "fmi3_clocks"))
    tested = {name[len("test_") :] for name in [*globals(), *re.findall(r"def (\w+)", others)] if "test_" in name}
    assert {path.stem for path in EXAMPLES.glob("*.py")} <= tested


@pytest.mark.slow
def test_balancers(tmp_path, monkeypatch, capsys):
    """The shafts cancel the second order: less than 3 % of it is left."""
    module = example("balancers")
    monkeypatch.setattr(sys, "argv", ["balancers.py", str(tmp_path / "balancers.png")])
    assert module.main() == 0
    left, whole = (float(text) for text in re.findall(r"([\d.]+) N of order 2", capsys.readouterr().out))
    assert left < 0.03 * whole
    assert (tmp_path / "balancers.png").stat().st_size > 10_000


def test_engine_mounts(tmp_path, monkeypatch, capsys):
    """Fluid in the mounts halves the roll at a start."""
    monkeypatch.setattr(sys, "argv", ["engine_mounts.py", str(tmp_path / "mounts.png")])
    assert example("engine_mounts").main() == 0
    rubber, hydraulic = (float(text) for text in re.findall(r"rolls by ([\d.]+) mrad", capsys.readouterr().out))
    assert 0.4 * rubber < hydraulic < 0.6 * rubber
    assert (tmp_path / "mounts.png").stat().st_size > 10_000


def test_elastic_rod():
    """Its rods weigh alike, and gas and inertia move the piston as the rod's own stiffness and a film's gap allow."""
    module = example("elastic_rod")
    own = [module.engine_with(rods) for rods in (module.RODS, module.RODS + module.RIGID)]
    masses = [read_added(engine)["rod[1]"].mass for engine in own]
    assert masses == pytest.approx(2 * [own[0].rod.big_end_mass + own[0].rod.small_end_mass])
    runs = [ct.simulate(engine, speed_rpm=5000.0, crank="beam", block="ground") for engine in own]
    gained = np.subtract(*(run["piston[1].position.y"] for run in runs))
    # 25 kN on 144 mm of some 300 mm2 of steel: 50 to 80 um.
    assert -80e-6 < gained.min() < -40e-6 and 10e-6 < gained.max() < 40e-6


def test_dual_mass_flywheel(tmp_path):
    """Through the resonance at start-up, the secondary mass follows the primary one as two masses on a spring do.

    In resonance, where order 3 is nearly all of the twist, friction acts as a damper of 4 T_f/(π ω A), A its amplitude.
    """
    module, speeds = example("dual_mass_flywheel"), np.array([150.0, 250.0, 300.0, 500.0])
    found = module.main(str(tmp_path / "dmf.png"), speeds)
    for friction, swings in found.items():
        for rpm, (first, second) in zip(speeds, swings, strict=True):
            if friction and rpm != 250.0:
                continue
            omega = module.ORDER * rpm * np.pi / 30.0
            damping = module.DAMPING + 4.0 * friction / (np.pi * omega * abs(second - first))
            spring = module.STIFFNESS + 1j * omega * damping
            exact = abs(spring / (spring - module.SECONDARY * omega**2))
            assert abs(second / first) == pytest.approx(exact, rel=0.01 if friction == 0.0 else 0.03)
    peaks = [np.abs(np.diff(swings, axis=1)[1, 0]) for swings in found.values()]
    assert peaks[1] < 0.9 * peaks[0]
    assert (tmp_path / "dmf.png").stat().st_size > 10_000


def test_ship_shafting(tmp_path):
    """Order 6 meets the 1-node mode where the stress peaks; two masses on the shafts in series come near to it."""
    module = example("ship_shafting")
    mode, stresses = module.main(str(tmp_path / "ship.png"), np.arange(36.0, 50.0))
    assert mode["shape"] == "drive line, 1-node"
    [thrust, straight, propeller] = stresses
    assert straight["worst"]["rpm"] == pytest.approx(mode["critical_rpm"]["6"], rel=0.02)
    # Half of the range of a torque that order 6 dominates is the same in shafts in series.
    for one, two in ((straight, propeller), (straight, thrust)):
        torques = [entry["torque_amplitude_knm"][6] for entry in (one, two)]
        assert torques[0] == pytest.approx(torques[1], rel=0.1)
    assert [entry["verdict"] for entry in stresses] == ["within the limit", "barred range", "barred range"]
    assert (tmp_path / "ship.png").stat().st_size > 10_000


def test_mixed_mains(capsys):
    """Only main 1 loses its film, and with it its friction."""
    assert example("mixed_mains").main() == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    assert [row[6] == "none" for row in rows] == [True] + 6 * [False]
    assert [float(row[-1]) > 0.5 for row in rows] == [False] + 6 * [True]


def test_pressed_collar(tmp_path):
    """On a beam: the collar moves less than the crank where a force presses it, and about as much where it floats."""
    found = example("pressed_collar").main(str(tmp_path / "collar.png"), "beam", (1300.0, 1600.0, 50.0))
    pressed, floating = found["pressed"], found["floating"]
    assert pressed["collar_um"] < 0.4 * pressed["crank_um"] and floating["collar_um"] > 0.8 * floating["crank_um"]
    assert (tmp_path / "collar.png").stat().st_size > 10_000


@pytest.mark.slow
def test_a_pressed_collar_has_the_axial_resonance_that_was_measured(tmp_path):
    """292 Hz in most of its orders; a floating collar has it in few."""
    found = example("pressed_collar").main(str(tmp_path / "collar.png"))
    assert found["pressed"]["median_hz"] == pytest.approx(292.0, abs=8.0)
    assert len(found["pressed"]["maxima_hz"]) >= 5 > 2 >= len(found["floating"]["maxima_hz"])


def test_fmu_input(tmp_path):
    assert example("fmu_input").main(tmp_path) == pytest.approx(13.456e6, rel=1e-4)
    for name in ("fmu_pressures.csv", "fmu_pressures_fmi3.csv", "fmu_run_up.csv"):
        assert (tmp_path / name).read_text() == (EXAMPLES / name).read_text()


def test_combustion(tmp_path, capsys):
    picture = tmp_path / "combustion.png"
    assert example("combustion").main(str(picture)) == pytest.approx(13.52e6, rel=2e-3)
    said = capsys.readouterr().out
    assert picture.stat().st_size > 10_000 and "| 2000 | 13.52 |" in said and "| diesel_v8 | 2000 |" in said


def test_valve_train(tmp_path, capsys):
    picture = tmp_path / "valve_train.png"
    assert example("valve_train").main(str(picture)) == pytest.approx(8.5, rel=0.02)
    assert picture.stat().st_size > 10_000 and "| 2000 | 8.5 |" in capsys.readouterr().out


def test_petrol(tmp_path, capsys):
    picture = tmp_path / "petrol.png"
    assert example("petrol").main(str(picture)) == pytest.approx(10.74e6, rel=2e-3)
    assert picture.stat().st_size > 10_000 and "| idle | 900 | 0.32 |" in capsys.readouterr().out


def test_combustion_calibration(tmp_path, capsys):
    """A trace that the module itself made is met by the fit, and its peak pressure over the speed by that trace's."""
    module = example("combustion_calibration")
    trace = np.array([[60.0, 0.27], [180.0, 0.27], [670.0, 0.26], [720.0, 0.26]])
    values = np.array([v.start for v in module.VALUES]) * 1.03
    at, pressures = module.cycle(module.with_values(module.cylinder(trace, 210.0), values), 210.0)
    rows = [*trace[:2], *np.column_stack([at + 360.0, pressures])[180:601:6], *trace[2:]]
    (tmp_path / "trace.csv").write_text("\n".join(f"{a};{p}" for a, p in rows))
    (tmp_path / "peaks.csv").write_text(f"{210.0 / module.RPM};{pressures.max()}\n1000;{pressures.max()}")
    found, left = module.main(str(tmp_path / "trace.csv"), str(tmp_path / "peaks.csv"))
    assert left < 2e-3 * pressures.max() and found[1] == pytest.approx(values[1], rel=0.02)
    assert "start of injection that meets it" in capsys.readouterr().out


def test_own_combustion_slave():
    """Mean torque over a cycle is the work of the mean pressure; before it burns the gas follows its polytrope."""
    unit = example("own_combustion_slave").OwnCombustion(instance_name="own", resources=".")
    torques = []
    for k in range(720):
        unit.values["crank.angle"], unit.values["crank.speed"] = math.radians(k), 0.0
        unit.do_step(0.0, 1e-4)
        torques.append(unit.values["indicated.torque"])
    swept = 6.0 * 0.25 * math.pi * 0.105**2 * 0.12
    assert np.mean(torques) == pytest.approx(unit.values["indicated.pressure_mean"] * swept / (4.0 * math.pi), rel=1e-6)
    ratio = unit.pressure(math.radians(-30.0)) / unit.pressure(math.radians(-90.0))
    volumes = unit.volume(math.radians(-90.0)) / unit.volume(math.radians(-30.0))
    assert ratio == pytest.approx(volumes**1.35, rel=1e-12)


STIFF, SPEEDS = (90.0, 150.0), (2200.0, 2350.0)


def test_parameter_study(tmp_path, capsys, monkeypatch):
    """Without Dask one line says so; the ring near 150 Hz takes a third of the twist that is left at 90 Hz."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    picture = tmp_path / "study.png"
    found = example("parameter_study").main(str(picture), STIFF, SPEEDS)
    assert max(found[150.0]) / max(found[90.0]) == pytest.approx(0.631, abs=0.03)
    said = capsys.readouterr().out.splitlines()
    assert len([line for line in said if "no Dask here" in line]) == 1 and said[-1].startswith("2/2: ring 150 Hz")
    assert picture.stat().st_size > 10_000


@pytest.mark.slow
def test_parameter_study_on_a_cluster():
    pytest.importorskip("distributed")
    call = f"""if __name__ == "__main__":
    import runpy
    study = runpy.run_path({str(EXAMPLES / "parameter_study.py")!r}, run_name="__main__")
    main = study["main"]
    main("", {STIFF!r}, {SPEEDS!r})"""
    done = subprocess.run([sys.executable, "-c", call], capture_output=True, text=True, timeout=3600)
    assert done.returncode == 0 and "2 dampers on" in done.stdout, done.stderr


def test_roller_stiffness():
    module = example("roller_stiffness")
    assert module.of_load("At the throws", module.MAIN, loads=[40e3]) == pytest.approx(2552e3, rel=1e-3)


def test_thrust_start(beam, tmp_path):
    picture = tmp_path / "start.png"
    assert example("thrust_start").main(str(picture), beam) == pytest.approx(79.0, rel=0.2)
    assert picture.stat().st_size > 10_000


def test_measured_pressure(beam, tmp_path, capsys):
    """The built-in trace, written to a file and read again, loads the bearings as it does built in."""
    trace = GasTrace.from_engine(load_engine("diesel_i6"))
    file = tmp_path / "trace.csv"
    file.write_text("\n".join(f"{a:.6f};{p:.3f}" for a, p in zip(trace.angles * 57.29577951, trace.fired, strict=True)))
    assert example("measured_pressure").main(str(file), body=beam) == pytest.approx(1.0, abs=0.01)
    assert "| peak to peak |" in capsys.readouterr().out


@pytest.mark.slow
def test_flexible_block():
    assert example("flexible_block").main("diesel_i6") == {"diesel_i6": pytest.approx(237.6, abs=0.1)}


@pytest.mark.slow
def test_fmu_v8(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = example("fmu_v8").main([])
    assert found["fitted"] / found["none"] == pytest.approx(0.155, abs=0.02)


@pytest.mark.slow
def test_demo(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    summary = example("demo").main()
    assert summary["first_torsional_hz"] == pytest.approx(237.2, abs=0.1)
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"pulley.png", "loads.png", "frequencies.txt"}


@pytest.mark.slow
def test_virtual_sensor(tmp_path):
    found = example("virtual_sensor").main(str(tmp_path / "results"))
    # The noise of the measured torsion, 2 mdeg, and little else; a model without its damper is far away.
    assert found["as_built"] == pytest.approx(2e-3, abs=0.7e-3)
    assert found["without_its_damper"] > 20.0 * found["as_built"]


@pytest.mark.slow
def test_harness(tmp_path):
    picture = tmp_path / "harness.png"
    assert example("harness").main(str(picture), str(tmp_path / "results")) == pytest.approx(32.8, rel=0.02)
    assert picture.stat().st_size > 10_000 and (tmp_path / "results" / "report.html").is_file()


@pytest.mark.slow
def test_bench_samples(tmp_path):
    """The samples in the repository are those that it writes; the wheel's edges hold the torsion that was put in."""
    module = example("bench_samples")
    folder = module.main(tmp_path / "bench")
    kept = {path.name: path for path in (EXAMPLES / "bench").iterdir()}
    assert set(kept) == {path.name for path in folder.iterdir()}
    assert max(path.stat().st_size for path in kept.values()) < 200_000
    for name in ("ok1.csv", "today.csv", "run.csv"):
        rows = [np.genfromtxt(one, delimiter=",", skip_header=2, usecols=0 if name == "run.csv" else (0, 1, 2))
                for one in (kept[name], folder / name)]  # fmt: skip
        np.testing.assert_allclose(*rows, rtol=1e-3, atol=1e-5)
    found = ct.analyse_measured(str(folder / "run.csv"), rotation="pulley", teeth=60, missing=2, orders="3,6")
    read, speeds = found["orders"][0], 1300.0 + 200.0 * np.arange(4)
    answers = module.TorsionalAnswers(load_engine("diesel_i6"), 1.0, damper=True)
    place = module.Place("pulley.torsion", speeds * math.pi / 30.0, np.array([3.0, 6.0]))
    put_in = np.degrees(np.abs(answers.orders(answers.healthy, place)))
    back = [np.interp(speeds, read["speeds_rpm"], [row[k] for row in read["amplitudes"]]) for k in (0, 1)]
    np.testing.assert_allclose(np.array(back).T, put_in, rtol=0.02, atol=2e-3)  # 1.5e-3 is the reading's own error


@pytest.mark.slow
@pytest.mark.parametrize("name", ["single_petrol", "two_stroke_six"])
def test_compare_engines(name):
    """Orders within 0.1 %, speeds and heights within 0.2 % of a fine step and of another integrator."""
    ((_, values),) = example("compare_engines").differences([name])
    assert np.all(np.reshape(values, (2, 4))[:, :3] < (0.1, 0.2, 0.2))
