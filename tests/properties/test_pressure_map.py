"""Pressures by cylinder, speed and load, in a unit that may be unstated: files read as written, interpolation, runs."""

import math
import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from benchmarks._forced_torsion import gas_forces
from one_line import one_line
from refusals import refused_files

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.loads.cylinder_volume import mean_effective_pressure
from cranktrain.loads.gas_pressure import CYCLE, GasTrace, gas_pressures, gas_tables
from cranktrain.loads.pressure_level import CANDIDATES, compression_level, meant
from cranktrain.loads.pressure_map import PressureMap, read_gas
from cranktrain.loads.pressure_units import UNITS
from cranktrain.loads.run_doubts import run_doubts
from cranktrain.studies.constant_speed import Request
from cranktrain.studies.torsion.frequency_run_up import frequency_run_up
from cranktrain.studies.torsion.rod_torque import gas_push
from cranktrain_lab.coupling.recording_unit import MeasuredPressures, TraceUnit

SIX = load_engine("diesel_i6")
RPM = math.pi / 30.0
TRACE = GasTrace.from_engine(SIX)
DEGREES = np.arange(720.0)


def written(path, columns, angles=DEGREES, header="deg;bar"):
    """File of pressures (Pa) in bar."""
    rows = zip(angles, *(1e-5 * column for column in columns), strict=True)
    text = "\n".join(";".join(f"{value:.8g}" for value in row) for row in rows)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{header}\n{text}\n".lstrip("\n"), encoding="utf-8")
    return path


def scaled(share):
    """The six's pressure with its burn scaled."""
    return TRACE.motored + share * (TRACE.fired - TRACE.motored)


SHARES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
FIRING = np.degrees(SIX.firing_angles)


def told(call, *arguments):
    """Result of a call and its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = call(*arguments)
    return found, [str(warning.message) for warning in caught]


def of_six(path, base="own", **choices):
    """File of six cylinders, from their own dead centres or all from that of cylinder 1."""
    shifts = (round(angle) if base == "common" else 0 for angle in FIRING)
    return written(
        path, [np.roll(scaled(share), shift) for share, shift in zip(SHARES, shifts, strict=True)], **choices
    )


@pytest.mark.parametrize("base", ["own", "common"])
def test_a_column_for_each_cylinder_is_that_of_the_cylinder_from_either_base(tmp_path, base):
    gas, doubts = told(GasTrace.from_csv, of_six(tmp_path / "six.csv", base), SIX)
    assert doubts == [] and len(gas.own) == 6
    assert ("from which all angles count" in gas.source) == (base == "common")
    for own, share in zip(gas.own, SHARES, strict=True):
        assert np.abs(own.fired - scaled(share)).max() < 2e-3 * TRACE.peak
    assert gas.imep == pytest.approx(
        np.mean([mean_effective_pressure(SIX, scaled(share)) for share in SHARES]), rel=1e-3
    )
    assert gas.peak == gas.own[0].peak == max(own.peak for own in gas.own)


def test_a_header_with_numbers_says_which_column_is_whose(tmp_path):
    order = (3, 1, 2, 6, 5, 4)
    header = "angle [deg];" + ";".join(f"cylinder[{k}] (bar)" for k in order)
    path = written(tmp_path / "six.csv", [scaled(SHARES[k - 1]) for k in order], header=header)
    gas = GasTrace.from_csv(path, SIX)
    assert [own.peak for own in gas.own] == sorted((own.peak for own in gas.own), reverse=True)


@pytest.mark.parametrize(
    ("columns", "header", "says"),
    [
        ((1.0, 0.9), "deg;bar", r"line 2: 3 columns; give two, .*, or a pressure for each of the 6 cylinders"),
        (SHARES, "deg;" + ";".join(["p [bar]"] * 5 + ["V [cm3]"]), "unit 'cm3' is not known"),
        (SHARES, "deg;" + ";".join(["p [bar]"] * 5 + ["p [MPa]"]), "several pressure units, MPa, bar"),
        (range(0, 600, 100), "deg;bar", r"peaks are neither within 60 deg of dead centre.*2 at 111, fires at 480"),
    ],
)
def test_columns_that_are_no_cylinders_are_refused(tmp_path, columns, header, says):
    columns = [scaled(one) if isinstance(one, float) else np.roll(scaled(1.0), one) for one in columns]
    path = written(tmp_path / "six.csv", columns, header=header)
    with pytest.raises(InputError, match=says):
        GasTrace.from_csv(path, SIX)


def test_a_two_stroke_trace_is_folded_into_its_cycle_and_laid_twice(tmp_path):
    """From −180 to 180 degrees, and as two cycles over 720; as four-stroke the file lacks half of its cycle."""
    throws = tuple(math.radians(angle) for angle in (0, 120, 240, 60, 180, 300))
    two = replace(
        SIX,
        cylinders=replace(SIX.cylinders, cycle=2.0 * math.pi, firing_order=(1, 6, 3, 5, 2, 4)),
        crankshaft=replace(SIX.crankshaft, throw_angles=throws),
    )
    trace = GasTrace.from_engine(two)
    half = written(tmp_path / "half.csv", [np.roll(trace.fired[:360], 180)], np.arange(-180.0, 180.0))
    twice = written(tmp_path / "twice.csv", [trace.fired])
    for path in (half, twice):
        gas, doubts = told(GasTrace.from_csv, path, two)
        assert doubts == []
        assert gas.fired[360:] == pytest.approx(gas.fired[:360], rel=1e-9)
        assert np.abs(gas.fired - trace.fired).max() < 2e-3 * trace.peak
        assert gas.imep == pytest.approx(trace.imep, rel=1e-3)
    with pytest.raises(InputError, match=r"cycle of 720 deg is wanted.*two-stroke state cylinders\.cycle = 360"):
        GasTrace.from_csv(half, SIX)


def test_equal_columns_give_the_bits_of_one_and_others_their_own(tmp_path):
    """Tables and pressures of a kernel, forces of the studies' own equations, and pin forces of a run."""
    one = GasTrace.from_csv(written(tmp_path / "one.csv", [scaled(1.0)]), SIX)
    alike = GasTrace.from_csv(written(tmp_path / "alike.csv", 6 * [scaled(1.0)]), SIX)
    differ = GasTrace.from_csv(of_six(tmp_path / "six.csv"), SIX)
    tables = [gas_tables(gas) for gas in (one, alike, differ)]
    assert [len(table) for table in tables] == [2, 12, 12]
    angle = np.linspace(-1.0, 11.0, 40)
    forces = [gas_forces(SIX, 200.0, angle, gas, 1.0) for gas in (one, alike, differ)]
    assert np.array_equal(forces[0], forces[1])
    assert np.array_equal(forces[0][:, 0], forces[2][:, 0]) and not np.allclose(forces[0][:, 5], forces[2][:, 5])
    own = angle[:, None] - np.array(SIX.firing_angles)
    pushes = [sum(gas_push(table, 1.0, own)) for table in tables]
    assert np.array_equal(pushes[0], pushes[1])
    for c in range(6):
        found = [sum(gas_pressures(float(own[3, c]), table, c)) for table in tables]
        assert found[0] == found[1] == pytest.approx(pushes[0][3, c], rel=1e-12)
        assert found[2] == pytest.approx(pushes[2][3, c], rel=1e-12)


def test_a_cylinder_of_its_own_pressure_loads_its_pin(tmp_path):
    """The peak force of a weak cylinder falls as its pressure does; the others feel it by the crank's motion alone."""
    equal = written(tmp_path / "one.csv", [scaled(1.0)])
    weak = written(tmp_path / "weak.csv", [scaled(0.5 if c == 2 else 1.0) for c in range(6)])
    levels = {"crank": "rigid", "big_ends": "impedance", "bearings": "linear", "speed_rpm": 1900, "cycles": 1}
    runs = [ct.simulate(SIX, pressure=path, **levels) for path in (equal, weak)]
    names = [[f"big_end[{c}].force.{axis}" for axis in "xy"] for c in range(1, 7)]
    forces = np.array([[max(np.abs(run[name]).max() for name in own) for own in names] for run in runs])
    fallen = 1.0 - forces[1] / forces[0]
    assert fallen[2] > 0.1 and np.abs(np.delete(fallen, 2)).max() < 0.05


def folder_of(tmp_path, **files):
    for name, share in files.items():
        written(tmp_path / "map" / f"{name}.csv", [scaled(share)])
    return tmp_path / "map"


def test_between_two_speeds_each_cylinder_s_trace_is_interpolated_and_at_the_ends_kept(tmp_path):
    for rpm, share in ((1000, 0.8), (2000, 1.0)):
        written(tmp_path / "own" / f"{rpm}.csv", [share * scaled(one) for one in SHARES])
    ends = [[own.fired for own in read_gas(tmp_path / "own", SIX).at(rpm * RPM, 1.0).own] for rpm in (1000, 1500, 2000)]
    assert ends[1] == pytest.approx(0.5 * (np.array(ends[0]) + ends[2]), rel=1e-12)
    folder = folder_of(tmp_path, **{"1000": 0.6, "2000rpm": 1.0})
    gas = read_gas(folder, SIX)
    assert isinstance(gas, PressureMap)
    low, high = (gas.at(rpm * RPM, 1.0).fired for rpm in (1000.0, 2000.0))
    assert gas.at(1500.0 * RPM, 1.0).fired == pytest.approx(0.5 * (low + high), rel=1e-12)
    assert gas.at(1250.0 * RPM, 1.0).fired == pytest.approx(0.75 * low + 0.25 * high, rel=1e-12)
    assert gas.at(1500.0 * RPM, 1.0).imep == pytest.approx(
        mean_effective_pressure(SIX, gas.at(1500.0 * RPM, 1.0).fired), rel=1e-9
    )
    assert np.array_equal(gas.at(500.0 * RPM, 1.0).fired, low) and np.array_equal(gas.at(1e4, 1.0).fired, high)
    assert told(gas.tell_ends, [1000 * RPM, 2000 * RPM], 1.0)[1] == []
    (line,) = told(gas.tell_ends, [900 * RPM, 2500 * RPM], 1.0)[1]
    assert "2500 rev/min lies beyond its speeds, 1000 to 2000 rev/min" in line
    (line,) = told(lambda: Request(speed_rpm=2600, pressure=folder).gas(SIX))[1]
    assert "2600 rev/min lies beyond" in line


def test_an_index_file_names_speeds_and_loads(tmp_path):
    rows = {(1000, 0.5): 0.3, (2000, 0.5): 0.5, (1000, 1.0): 0.6, (2000, 1.0): 1.0}
    lines = ["speed_rpm, load, file"]
    for (rpm, load), share in rows.items():
        name = written(tmp_path / "traces" / f"{rpm}_{load}.csv", [scaled(share)]).name
        lines.append(f"{rpm}, {load}, traces/{name}")
    index = tmp_path / "index.csv"
    index.write_text("\n".join(lines), encoding="utf-8")
    gas = read_gas(index, SIX)
    middle = gas.at(1500 * RPM, 0.75)
    expected = sum(gas.at(rpm * RPM, load).fired for rpm, load in rows) / 4.0
    assert middle.fired == pytest.approx(expected, rel=1e-12)
    # The load is in the map: a model does not scale the burn once more.
    assert np.array_equal(middle.motored, middle.fired)
    (line,) = told(gas.tell_ends, [1500 * RPM], 0.2)[1]
    assert "load 0.2 lies beyond its loads, 0.5 to 1" in line
    folder = folder_of(tmp_path, **{"1000_full": 0.6, "2000_full": 1.0, "1000_50%": 0.3, "2000_50%": 0.5})
    assert read_gas(folder, SIX).at(1500 * RPM, 0.75).fired == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("text", "says"), refused_files()["pressure-index"]["beside_traces"])
def test_a_wrong_index_is_refused_in_one_line(tmp_path, text, says):
    written(tmp_path / "a.csv", [scaled(1.0)])
    of_six(tmp_path / "six.csv")
    index = tmp_path / "index.csv"
    index.write_text(text, encoding="utf-8")
    with one_line(says):
        read_gas(index, SIX)


def test_a_folder_without_speeds_is_refused(tmp_path):
    with pytest.raises(InputError, match="no trace in this folder; name traces by rev/min"):
        read_gas(tmp_path, SIX)
    written(tmp_path / "idle.csv", [scaled(1.0)])
    with pytest.raises(InputError, match=r"idle\.csv: the name is no speed; name traces by rev/min and load"):
        read_gas(tmp_path, SIX)


def test_run_ups_in_the_frequency_domain_take_the_trace_of_each_speed(tmp_path):
    gas = read_gas(folder_of(tmp_path, **{"1000": 0.6, "2000": 1.0}), SIX)
    made = ct.assemble(SIX, Settings(crank="torsional", bearings="held"), inherit=False)
    speeds = np.array([1000.0, 1500.0, 2000.0]) * RPM
    run_up = frequency_run_up(made.engine, made.body, made.settings, speeds, [3.0, 6.0], gas=gas)
    for k, speed in enumerate(speeds.tolist()):
        alone = frequency_run_up(
            made.engine, made.body, made.settings, speeds[k : k + 1], [3.0, 6.0], gas=gas.at(speed, 1.0)
        )
        assert np.array_equal(run_up.torsion[k], alone.torsion[0])
    assert np.abs(run_up.torsion[0]).max() > 0.0 and not np.allclose(run_up.torsion[0], run_up.torsion[2])


def test_a_simulation_follows_the_speed_from_run_to_run(tmp_path):
    gas = read_gas(folder_of(tmp_path, **{"1000": 0.6, "2000": 1.0}), SIX)
    made = ct.assemble(SIX, Settings(crank="rigid", bearings="held"))
    simulation = Simulation(SIX, made.body, made.settings, gas, made.parts)
    simulation.inputs[0] = 1500.0 * RPM
    simulation.initialize()
    assert np.array_equal(simulation.model.gas, gas_tables(gas.at(1500.0 * RPM, 1.0)))
    simulation.go_on_at(1750.0 * RPM)
    assert np.array_equal(simulation.model.gas, gas_tables(gas.at(1750.0 * RPM, 1.0)))
    simulation.inputs[0] = 1800.0 * RPM
    simulation.follow_gas()
    assert np.array_equal(simulation.model.gas, gas_tables(gas.at(1800.0 * RPM, 1.0)))


def test_measured_pressures_stand_in_for_a_combustion():
    """Pressures at the angle extrapolated over a step, the state of a step taken back, torque by virtual work."""
    unit = TraceUnit("combustion", MeasuredPressures(SIX, TRACE))
    unit.write(np.array([0.5, 200.0]))
    unit.initialize(0.0)
    held = unit.keep()
    unit.step(0.0, 1e-3)
    found = dict(zip(unit.outputs, unit.read(), strict=True))
    assert found["pressure.angle"] == pytest.approx(0.7) and found["indicated.pressure_mean"] == TRACE.imep
    tables = gas_tables(TRACE)
    for c, phase in enumerate(SIX.firing_angles):
        assert found[f"cylinder[{c + 1}].pressure"] == pytest.approx(
            sum(gas_pressures(0.7 - phase, tables, c)), rel=1e-9
        )
    unit.restore(held)
    assert unit.read()[list(unit.outputs).index("pressure.angle")] == 0.5
    work = 0.0
    for k in range(720):
        unit.write(np.array([CYCLE * k / 720, 0.0]))
        unit.step(0.0, 1.0)
        work += unit.read()[-1] * CYCLE / 720
    assert work == pytest.approx(TRACE.imep * SIX.displacement, rel=1e-4)


def averaged(pressure, degrees):
    """Moving average of a trace at whole degrees."""
    return np.mean([np.roll(pressure, k) for k in range(-(degrees // 2), degrees // 2 + 1)], axis=0)


EARLY = np.roll(scaled(1.0), -5)
DOUBTED = {
    "shifted by 60 degrees": (np.roll(scaled(1.0), -60), "the peak lies at -49 deg after firing dead centre"),
    "backwards": (np.roll(EARLY[::-1], 1), "mean effective pressure is -1.* bar, so the cycle takes work"),
    "psi told as bar": (0.2 * scaled(1.0) / 6894.757 * 1e5, "start of the compression, 2.9 times the engine file"),
    "psi told as kPa": (scaled(1.0) / 6894.757 * 1e3, "start of the compression, 0.14. times the engine file"),
    "shifted by 20 degrees": (np.roll(scaled(1.0), 20), r"p V\^0\.963 constant, usual exponents 1\.05 to 1\.6"),
    "shifted by 5 degrees": (np.roll(scaled(1.0), 5), r"V\^1\.24 and expansion p V\^1\.44, as if .* at \+(4\.5|5) deg"),
    "early by 5 degrees": (np.roll(scaled(1.0), -5), r"V\^1\.48 and expansion p V\^1\.21, as if .* at -5 deg"),
    "half load, late by 10 degrees": (np.roll(scaled(0.5), 10), r"as if dead centre lay at \+(9\.5|10) deg"),
    "half load, early by 10 degrees": (np.roll(scaled(0.6), -10), r"the cycle takes work|lay at -10 deg"),
    "pegged 1.5 bar low": (scaled(1.0) - 1.5e5, "in the mean, so the pressure is too low throughout; check its zero"),
    "gauge told as absolute": (scaled(1.0) - 1.013e5, "in the mean, so the pressure is too low throughout"),
    "averaged over 31 degrees": (averaged(scaled(1.0), 31), "a moving average over 31(.5)? deg"),
}


@pytest.mark.parametrize("kind", DOUBTED)
def test_traces_that_are_hardly_of_the_engine_are_told_in_one_line(tmp_path, kind):
    pressure, says = DOUBTED[kind]
    path = written(tmp_path / "doubted.csv", [pressure])
    found, lines = told(GasTrace.from_csv, path, SIX)
    assert len(lines) == 1 and found.fired.min() > 0.0
    assert re.search(says, lines[0]) and "\n" not in lines[0], lines


@pytest.mark.parametrize("degrees", [90.0, 180.0])
def test_a_dead_centre_that_is_stated_wrongly_is_told(tmp_path, degrees):
    path = written(tmp_path / "trace.csv", [scaled(1.0)])
    _, lines = told(GasTrace.from_csv, path, SIX, None, degrees)
    assert len(lines) == 1 and "the peak lies at -" in lines[0] and "check where dead centre is" in lines[0]
    with pytest.raises(InputError, match="not within 60 deg of 0 or 360; say where firing dead centre is"):
        GasTrace.from_csv(written(tmp_path / "own.csv", [np.roll(scaled(1.0), int(degrees))]), SIX)


def test_runs_that_take_work_or_are_driven_are_told_in_one_line():
    speed = 1600.0 * RPM
    assert list(run_doubts(SIX, TRACE, speed, 1.0, None)) == []
    assert list(run_doubts(SIX, TRACE, speed, 0.0, None)) == []
    torque = TRACE.imep * SIX.displacement / CYCLE
    assert list(run_doubts(SIX, TRACE, speed, 1.0, 0.95 * torque)) == []
    assert list(run_doubts(SIX, TRACE, speed, 0.0, -50.0)) == []  # a motored engine is driven
    says = {
        "drives the fired engine; a load is positive": (1.0, -100.0, SIX, TRACE, speed),
        "is more than the gas gives": (1.0, 1.3 * torque, SIX, TRACE, speed),
        "leaves no heat at 6400 rev/min, 4 times best_speed": (1.0, None, SIX, TRACE, 4.0 * speed),
    }
    cold = replace(SIX, combustion=replace(SIX.combustion, heat=200.0, exhaust_pressure=3.5e5))
    says["so a fired run takes work; check combustion.heat"] = (1.0, None, cold, GasTrace.from_engine(cold), speed)
    for text, (load, given, engine, gas, at) in says.items():
        (line,) = run_doubts(engine, gas, at, load, given)
        assert text in line and "\n" not in line


OWN = Path(__file__).parents[1] / "data" / "engines"
ENGINES = ["diesel_i6", "diesel_v8", *sorted(str(path) for path in OWN.glob("*.toml"))]


def trace(engine):
    return np.roll(GasTrace.from_engine(engine).fired, 360)


def headless(path, pressure, unit="bar"):
    """A file without header of a trace (Pa) in a unit at each degree."""
    return written(path, [1e5 / UNITS[unit] * pressure], np.arange(-360.0, 360.0), "")


@pytest.mark.parametrize("name", ENGINES, ids=lambda name: Path(name).stem)
@pytest.mark.parametrize("share", [1.0, 0.5, 0.3])
@pytest.mark.parametrize("unit", CANDIDATES)
def test_the_right_unit_or_none(tmp_path, name, share, unit):
    """At full load and throttled, in each unit: the peak is that of the trace; usual traces need no unit."""
    engine = load_engine(name)
    pressure = share * trace(engine)
    path = headless(tmp_path / "p.csv", pressure, unit)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            read = GasTrace.from_csv(path, engine)
        except InputError as error:
            assert name != "diesel_i6" or share < 1.0 or unit not in ("bar", "MPa", "kPa", "Pa")
            assert f"{unit} ({1e-5 * pressure.max():.4g} bar)" in str(error) and "--pressure-unit" in str(error)
            assert "\n" not in str(error)
        else:
            assert read.peak == pytest.approx(pressure.max(), rel=5e-3) and f"{unit} (not stated" in read.source
        stated = GasTrace.from_csv(path, engine, unit)
    assert stated.peak == pytest.approx(pressure.max(), rel=5e-3)


def test_both_readings_are_told(tmp_path):
    """3.2 in psi is an intake at 0.22 bar, in bar a supercharged one; exponent and ratio of the peak are alike."""
    four = load_engine(OWN / "gas_i4.toml")
    pressure = trace(four)
    level = pressure * 3.2 / pressure[180]
    with pytest.raises(InputError, match="several fit a peak of") as caught:
        GasTrace.from_csv(headless(tmp_path / "p.csv", 1e5 * level), four)
    assert meant(("psi", "bar"), level.max()) in str(caught.value)


@pytest.mark.parametrize("exponent", [1.25, 1.32, 1.4])
@pytest.mark.parametrize("name", ["diesel_i6", str(OWN / "gas_i4.toml")], ids=["six", "four"])
def test_the_level_of_a_polytropic_compression_is_its_pressure_at_bottom_dead_centre(name, exponent):
    from cranktrain.loads.cylinder_volume import cylinder_volume

    engine, angle = load_engine(name), np.arange(-180.0, 180.0, 0.5)
    volume, _ = cylinder_volume(engine, np.radians(angle))
    pressure = 1.7 * (volume / volume[0]) ** -exponent
    assert compression_level(engine, angle % 720.0, pressure) == pytest.approx(1.7, rel=1e-9)
    shifted = np.maximum(pressure - 1.69, 1e-3)  # gauge, or a drifted zero: no line of a compression from 0.01
    assert compression_level(engine, angle % 720.0, shifted) is None
