"""Clocks of a cranktrain's FMU of FMI 3.0: ticks at firing dead centres, told to a host that uses event mode."""

import csv
import shutil
import subprocess
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.validation import validate_fmu
from fmus_by_version import torsional_fmu
from scripts import example

from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.fmu.build import build_fmu
from cranktrain.fmu.description3 import clock_table
from cranktrain.fmu.engine_fmu import engine_interface, product

SPEED = 2000.0 * np.pi / 30.0
CYCLE = 4.0 * np.pi
NEAR = 1e-6
"""Angle behind a dead centre, rad, at which a clock ticks at the latest."""
ENGINES = ("single_petrol", "diesel_i6", "diesel_v8", "v12_petrol", "two_stroke_six")


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    """A function that builds an engine's FMU with its torsional crank, with clocks or without."""
    kept = {}

    def fmu(name, clocks=True):
        if (name, clocks) not in kept:
            try:
                folder = tmp_path_factory.mktemp(name)
                kept[name, clocks] = torsional_fmu(name, folder, "3.0", clocks)
            except InputError as error:
                pytest.skip(str(error))
        return kept[name, clocks]

    return fmu


def heard(path, cycles, degrees, **options):
    """Ticks (angle in rad, cylinders from 0 on) and results of a run by FMPy in event mode at the FMU's start speed."""
    unit = example("fmu_dead_centres").Listener(path)
    step = np.radians(degrees) / unit.start_speed
    result = unit.simulate(round(cycles * 720.0 / degrees) * step, step, **options)
    return numbered(unit), result


def numbered(unit):
    return [(angle, [list(unit.clocks).index(name) for name in names]) for _, angle, names in unit.ticks]


@pytest.mark.parametrize("name", ENGINES)
def test_each_cylinder_ticks_once_a_cycle_at_its_firing_dead_centre(fmus, name):
    """In firing order, 0 to 1e-6 rad behind the dead centre; the angles follow from throws, banks and firing order."""
    engine = load_engine(name)
    angles, cycle = np.array(engine.firing_angles), engine.cylinders.cycle
    ticks, result = heard(fmus(name), 2.0, 1.0)
    begin, end = result["crank.angle"][[0, -1]]
    expected = sorted(
        (angle + n * cycle, k)
        for k, angle in enumerate(angles)
        for n in range(-1, 6)
        if begin < angle + n * cycle <= end
    )
    found = [(angle, k) for angle, cylinders in ticks for k in cylinders]
    assert [k for _, k in found] == [k for _, k in expected]
    behind = np.array([a for a, _ in found]) - [a for a, _ in expected]
    assert behind.min() > -1e-9
    assert behind.max() <= NEAR
    assert abs(len(found) - 2 * engine.n_cylinders * round(CYCLE / cycle)) <= 1
    order = [k + 1 for _, k in found[: engine.n_cylinders]]
    assert from_one(order) == from_one(engine.cylinders.firing_order)


def from_one(order):
    """A firing order that begins with cylinder 1."""
    at = list(order).index(1)
    return [*order[at:], *order[:at]]


def test_dead_centres_are_found_while_the_speed_changes(fmus):
    """From 1000 to 2500 rev/min within two cycles, steps of 5 degrees at first and 12 at the end."""
    stop, step = 0.137, np.radians(5.0) / (0.5 * SPEED)
    speed = np.array([(0.0, 0.5 * SPEED), (stop, 1.25 * SPEED)], dtype=[("time", "f8"), ("speed", "f8")])
    unit = example("fmu_dead_centres").Listener(fmus("diesel_i6"))
    unit.simulate(stop, step, input=speed)
    angles = load_engine("diesel_i6").firing_angles
    found = [(angle, k) for angle, cylinders in numbered(unit) for k in cylinders]
    assert len(found) >= 11
    for angle, k in found:
        behind = (angle - angles[k] + NEAR) % CYCLE - NEAR
        assert -1e-9 < behind <= NEAR


@pytest.mark.parametrize(("dense", "tolerance"), [("on", 0.0), ("off", 1e-6)])
def test_events_leave_the_torsion_as_it_is(fmus, dense, tolerance):
    """Of its range: internal steps pass over the events (on), or are split there (off)."""
    path = fmus("diesel_i6")
    [choices] = [
        v.declaredType for v in read_model_description(str(path)).modelVariables if v.name == "solver.dense_output"
    ]
    number = next(int(item.value) for item in choices.items if item.name == dense)
    given = {"start_values": {"solver.dense_output": number}}
    _, events = heard(path, 1.0, 1.5, **given)
    step = np.radians(1.5) / SPEED
    plain = simulate_fmu(str(path), stop_time=480 * step, output_interval=step, **given)
    same = np.isin(events["time"], plain["time"])
    times, places = np.unique(events["time"][same], return_index=True)
    np.testing.assert_array_equal(times, plain["time"])
    difference = events["pulley.torsion"][same][places] - plain["pulley.torsion"]
    assert np.abs(difference).max() <= tolerance * np.ptp(plain["pulley.torsion"])


def test_fmu_dead_centres(fmus, capsys):
    """The example prints a line for each tick."""
    found = example("fmu_dead_centres").main([str(fmus("diesel_i6")), "--cycles", "0.5"])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(found) == 3 and lines[0].endswith("120.0000 deg  cylinder[5].dead_centre")
    with pytest.raises(SystemExit, match="has no clocks; build it with"):
        example("fmu_dead_centres").main([str(fmus("diesel_i6", False))])


@pytest.mark.slow
def test_the_fmu_of_a_scene_ticks(tmp_path):
    """It has fewer variables, which number otherwise."""
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'engine = "diesel_i6"\nspeeds_rpm = [1600]\nfrequency_hz = 500\naccuracy = 0.4\ncycles = 2\nstep_deg = 3\n'
        'integrator = "esdirk4"\noutputs = ["pulley.torsion"]\ncrank = "torsional"\n',
        encoding="utf-8",
    )
    path = build_fmu(scene, tmp_path / "fmu", platforms=("linux64",), fmi="3.0", clocks=True)
    ticks, _ = heard(path, 1.0, 1.0)
    assert [k + 1 for _, cylinders in ticks for k in cylinders] == [5, 3, 6, 2, 4, 1]


@pytest.mark.parametrize("name", ["diesel_i6", "single_petrol"])
def test_clocks_are_declared_as_the_standard_wants_them(fmus, name):
    path = fmus(name)
    about = read_model_description(str(path))
    assert validate_fmu(str(path)) == []
    clocks = [v for v in about.modelVariables if v.type == "Clock"]
    assert [v.name for v in clocks] == [f"cylinder[{k + 1}].dead_centre" for k in range(load_engine(name).n_cylinders)]
    for clock in clocks:
        assert (clock.causality, clock.variability, clock.intervalVariability) == ("output", "discrete", "triggered")
        assert clock.shape == () and "firing top dead centre" in clock.description
    assert about.coSimulation.hasEventMode and about.coSimulation.mightReturnEarlyFromDoStep
    assert {v.name for v in clocks} < {output.variable.name for output in about.outputs}
    folder = Path(extract(str(path)))
    assert "dead_centre" in (folder / "documentation" / "index.html").read_text("utf-8")
    shutil.rmtree(folder)


def test_an_fmu_has_clocks_only_if_they_are_asked_for(fmus):
    """Because a host without event mode may not use an FMU that has clocks."""
    about = read_model_description(str(fmus("diesel_i6", False)))
    assert not about.coSimulation.hasEventMode and not any(v.type == "Clock" for v in about.modelVariables)


def test_clocks_are_of_fmi_3_and_need_dead_centres(tmp_path):
    with pytest.raises(InputError, match=r"clocks are of FMI 3\.0; build the FMU for it, or leave clocks out"):
        build_fmu("diesel_i6", tmp_path, clocks=True)
    engine = load_engine("diesel_i6")
    made = product(engine, engine_interface(engine, clocks=True))
    fewer = [v for v in made.variables if v.name != "cylinder[3].firing_angle"]
    with pytest.raises(InputError, match=r"clocks need 'cylinder\[3\]\.firing_angle', which this FMU does not have"):
        clock_table(made, fewer)


@pytest.mark.slow
def test_fmusim_stops_at_dead_centres(fmus, tmp_path):
    """One row more at each time of an event, and one more at the time after it was handled, as by FMPy."""
    tool = shutil.which("fmusim")
    if tool is None:
        pytest.skip("needs fmusim on the path, built from its sources")
    path, step = fmus("diesel_i6"), np.radians(1.0) / SPEED
    run = ["--interface-type", "cs", "--early-return-allowed", "--event-mode-used", "--output-variable", "crank.angle"]
    times = ["--stop-time", str(360 * step), "--output-interval", str(step), "--output-file", str(tmp_path / "out.csv")]
    done = subprocess.run(
        [tool, *run, *times, str(path)], capture_output=True, text=True, env={"TMPDIR": str(tmp_path)}
    )
    assert done.returncode == 0, done.stderr[-2000:]
    rows = [[float(text) for text in row] for row in list(csv.reader((tmp_path / "out.csv").open()))[1:]]
    twice = [angle for (time, angle), (after, _) in pairwise(rows) if time == after]
    ticks, _ = heard(path, 0.5, 1.0)
    np.testing.assert_allclose(twice, [angle for angle, _ in ticks], rtol=1e-12)
