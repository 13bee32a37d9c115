"""Bearings over a cycle: closed forms of made-up runs, limits, and the energy balance of a real one."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from one_line import one_line
from scipy.interpolate import CubicSpline
from some import some

import cranktrain as ct
from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.engine.limits import BearingLimits
from cranktrain.film.laws.register import bearing_law
from cranktrain.results.bearings.cycle import bearing_report, rod_lean
from cranktrain.results.bearings.run_up_cycles import bearing_outputs, run_up_bearings
from cranktrain.results.bearings.tables import missing_limits, violations
from cranktrain.results.orders.harmonics import CYCLE, order_amplitudes
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.store.hdf5 import write_result

ENGINE = load_engine("diesel_i6")
SPEED = 200.0
SAMPLES = 720


def vector(values):
    """A complex constant or history as both outputs of a vector."""
    values = np.broadcast_to(np.asarray(values, dtype=complex), SAMPLES + 1)
    return {"x": values.real, "y": values.imag}


def made_up(engine=ENGINE, start=0.3, **changes):
    """A run over one cycle and the crank angle; ``changes``: main or big_end → output → values, a vector's complex."""
    time = np.arange(SAMPLES + 1) * (CYCLE / SPEED / SAMPLES)
    angle = SPEED * time
    crank = start + angle
    outputs = {"crank.angle": crank, "crank.speed": np.full_like(time, SPEED)}
    usual = {
        "force": -1.0e4j, "position": -2e-5j, "velocity": 0j, "film_thickness_min": 5e-6, "pressure_max": 5e7,
        "friction_torque": 1.0, "oil_flow": 1e-5,
    }  # fmt: skip
    own = {"speed.relative": SPEED, "gap.angle": -0.5 * math.pi}
    families = {"bearing": (7, usual | own, "main"), "big_end": (engine.n_cylinders, usual, "big_end")}
    for family, (count, values, key) in families.items():
        for i in range(1, count + 1):
            for name, value in {**values, **changes.get(key, {})}.items():
                value = value(crank, i) if callable(value) else value
                if name in ("force", "position", "velocity"):
                    outputs |= {f"{family}[{i}].{name}.{axis}": array for axis, array in vector(value).items()}
                else:
                    outputs[f"{family}[{i}].{name}"] = np.broadcast_to(np.asarray(value, float), time.shape)
    return SimpleNamespace(time=time, angle=angle, outputs=outputs)


def test_a_load_that_turns_with_the_crank_is_a_circle_on_the_shell_and_a_point_on_the_journal():
    run = made_up(main={"force": lambda crank, i: 5e3 * i * np.exp(1j * crank)})
    for bearing in some(bearing_report(run, ENGINE).mains):
        force = 5e3 * bearing.number
        assert np.abs(bearing.on_shell) == pytest.approx(force, rel=1e-12)
        turned = np.unwrap(np.angle(bearing.on_shell))
        assert turned[-1] - turned[0] == pytest.approx(CYCLE * (1 - 1 / SAMPLES), rel=1e-9)
        assert bearing.on_journal == pytest.approx(np.full(SAMPLES, force), rel=1e-9)
        plain = ENGINE.main_bearing
        assert bearing.specific_load.value == pytest.approx(force / (plain.diameter * plain.width), rel=1e-12)
        assert bearing.mean_specific_load == pytest.approx(bearing.specific_load.value, rel=1e-12)
        assert bearing.pv == pytest.approx(0.5 * plain.diameter * SPEED * bearing.mean_specific_load, rel=1e-12)


def test_friction_power_is_torque_times_speed_and_fmep_that_of_a_known_torque():
    run = made_up(main={"friction_torque": lambda crank, i: 2.0 + np.cos(crank)}, big_end={"friction_torque": 0.0})
    report = bearing_report(run, ENGINE)
    assert report.speed == pytest.approx(SPEED, rel=1e-12)
    for bearing in report.mains:
        assert bearing.friction_power == pytest.approx(2.0 * SPEED, rel=1e-12)
        assert bearing.squeeze_power == 0.0
    # four strokes: 2 · 2π T/V of seven mains
    stroke = 2.0 * ENGINE.crankshaft.throw
    volume = 6 * 0.25 * math.pi * ENGINE.cylinders.bore**2 * stroke
    assert report.fmep == pytest.approx(2 * 2 * math.pi * 14.0 / volume, rel=1e-9)


def test_a_pin_turns_in_its_big_end_by_the_crank_less_the_rod():
    """A torque that follows the crank angle finds the rod's swing in the mean of its power."""
    run = made_up(big_end={"friction_torque": lambda crank, i: 3.0 + np.cos(2 * crank)})
    for c, bearing in some(enumerate(bearing_report(run, ENGINE).big_ends)):
        crank = run.outputs["crank.angle"]
        lean = rod_lean(ENGINE, c, crank)[0]
        relative = SPEED - CubicSpline(run.time, lean).derivative()(run.time)
        power = ((3.0 + np.cos(2 * crank)) * relative)[1:].mean()
        assert bearing.friction_power == pytest.approx(power, rel=1e-6)


def test_the_rods_frame_shows_where_its_shell_is_loaded():
    run = made_up(big_end={"force": lambda crank, i: -2e4j * np.exp(1j * rod_lean(ENGINE, i - 1, crank)[0])})
    for bearing in some(bearing_report(run, ENGINE).big_ends):
        assert bearing.on_rod == pytest.approx(np.full(SAMPLES, 2e4j), rel=1e-9)
        assert bearing.load.place == pytest.approx(0.5 * math.pi, abs=1e-9)
        assert bearing.load.value == pytest.approx(2e4, rel=1e-12)


def test_squeezing_a_damper_takes_its_power():
    """A pin that goes round at e in a film of damping d turns d (e ω)² into heat."""
    d, e = 1e6, 1e-5
    place = {"position": lambda crank, i: e * np.exp(1j * crank)}
    run = made_up(big_end=place | {"force": lambda crank, i: -d * 1j * SPEED * e * np.exp(1j * crank)})
    for bearing in some(bearing_report(run, ENGINE).big_ends):
        assert bearing.squeeze_power == pytest.approx(d * (e * SPEED) ** 2, rel=1e-4)
        assert np.abs(bearing.orbit) == pytest.approx(e / ENGINE.big_end_bearing.clearance, rel=1e-12)


def test_extremes_say_when_and_where():
    dip = math.radians(123.0)
    film = {"film_thickness_min": lambda crank, i: 5e-6 - 2e-6 * np.exp(-(((crank - dip) / 0.1) ** 2))}
    report = bearing_report(made_up(main=film, big_end=film), ENGINE)
    for bearing in report.bearings:
        assert bearing.film.value == pytest.approx(3e-6, rel=1e-3)
        assert bearing.film.angle == pytest.approx(dip, abs=math.radians(1.0))
    assert report.mains[0].film.place == -0.5 * math.pi
    lean = rod_lean(ENGINE, 0, np.array([report.big_ends[0].film.angle]))[0][0]
    assert report.big_ends[0].film.place == pytest.approx(-0.5 * math.pi - lean, abs=1e-9)


def test_bearings_without_films_have_loads_alone():
    report = bearing_report(made_up(big_end={"pressure_max": 0.0}), ENGINE)
    for bearing in report.big_ends:
        assert bearing.load.value == pytest.approx(1e4) and bearing.specific_load is not None
        assert bearing.film is bearing.friction_power is bearing.oil_flow is bearing.orbit is None
    assert report.total("friction_power") == pytest.approx(7 * SPEED)
    assert report.total("friction_power", "big_end") is None


def test_only_limits_that_are_given_are_held_against():
    report = bearing_report(made_up(), ENGINE)
    specific, lacking = 1e4 / (ENGINE.main_bearing.diameter * ENGINE.main_bearing.width), {
        "main_pressure", "main_pv", "big_end_film", "big_end_specific_load", "big_end_pv"
    }  # fmt: skip
    exceeded = {("main", "film"), ("main", "specific_load"), ("big_end", "pressure")}
    for share, wanted in ((0.999, exceeded), (1.001, set())):
        limits = BearingLimits(
            main_film=5e-6 / share, main_specific_load=specific * share, big_end_pressure=5e7 * share
        )
        held = replace(report, engine=replace(ENGINE, bearing_limits=limits))
        assert {(v.bearing.partition("[")[0], v.what) for v in violations(held)} == wanted
        assert set(missing_limits(held)) == lacking
    bare = replace(report, engine=replace(ENGINE, bearing_limits=None))
    assert violations(bare) == [] and len(missing_limits(bare)) == 8


def test_runs_that_are_too_short_or_of_another_engine_are_refused():
    run = made_up()
    outputs = {name: values[:360] for name, values in run.outputs.items()}
    half = SimpleNamespace(time=run.time[:360], angle=run.angle[:360], outputs=outputs)
    with one_line("shorter than one cycle"):
        bearing_report(half, ENGINE)
    with one_line("7 mains and 6 big ends, engine 'diesel_v8' 5 and 8"):
        bearing_report(run, load_engine("diesel_v8"))


def test_heat_of_all_films_is_what_the_gas_gives_less_what_leaves_through_the_shaft():
    """Indicated power, brake power and bearings from outputs alone, on a rigid crank that keeps no energy."""
    run = ct.simulate("diesel_i6", speed_rpm=2000, crank="rigid", big_ends="impedance", step_deg=1.0)
    report = bearing_report(run, run.engine)
    time, gas, speed = run.time[-1 - run.per_cycle :], run.gas, report.speed

    def rate(name):
        return CubicSpline(run.time, run[name]).derivative()(time)

    knots = np.linspace(0.0, CYCLE, gas.motored.size + 1)
    motored, fired = (CubicSpline(knots, np.append(p, p[0]), bc_type="periodic") for p in (gas.motored, gas.fired))
    share = 1.0 - gas.falloff * (speed / gas.best_speed - 1.0) ** 2
    indicated = 0.0
    for c, firing in enumerate(run.engine.firing_angles):
        angle = (run["crank.angle"][-time.size :] - firing) % CYCLE
        pressure = motored(angle) + share * (fired(angle) - motored(angle))
        indicated += np.trapezoid((pressure - 1e5) * rate(f"cylinder[{c + 1}].volume"), time)
    brake = np.trapezoid(run["shaft.torque"][-time.size :] * rate("crank.angle"), time)
    lost = (indicated - brake) * speed / CYCLE
    heat = report.total("friction_power") + report.total("squeeze_power")
    assert heat == pytest.approx(lost, rel=0.01)
    assert report.total("friction_power") < 0.97 * lost  # squeeze is part of it


def saved(path, bearings="impedance", **changes):
    """Result file of a made-up run."""
    run = made_up(**changes)
    data = {name: (values, "") for name, values in {"time": run.time, "angle": run.angle, **run.outputs}.items()}
    return str(write_result(path, data, {"engine": "diesel_i6", "bearings": bearings, "block": "ground"}))


def grid_said(capsys, *asked):
    """Lines of the verb on the grid of elastic films."""
    assert main(["bearing-loads", "diesel_i6", *map(str, asked)]) == 0
    return [line for line in capsys.readouterr().out.splitlines() if line.startswith("Grid of level")]


@pytest.mark.parametrize("level", ["ehd", "ehd:fine"])
def test_the_error_of_the_grid_is_told_with_elastic_films_alone(level, tmp_path, capsys):
    """Of the main with the thinnest film and of that with the largest pressure; a main without film has neither."""
    film, pressure = {1: 0.0, 3: 1.5e-6}, {1: 0.0, 5: 2e8}
    films = {
        "film_thickness_min": lambda crank, i: np.full_like(crank, film.get(i, 5e-6)),
        "pressure_max": lambda crank, i: np.full_like(crank, pressure.get(i, 5e7)),
    }
    other, own = saved(tmp_path / "a.h5", main=films), saved(tmp_path / "b.h5", level, main=films)
    assert grid_said(capsys, "--result", other) == []
    of_film, of_pressure = (f"within {100.0 * error:.0f} %" for error in bearing_law(level).film_errors["ground"])
    [line] = grid_said(capsys, "--result", other, own)
    assert f"level {level}: the least film of main[3], 1.50 um, is {of_film}" in line
    assert f"largest pressure of main[5], 200 MPa, {of_pressure}" in line
    assert main(["bearing-loads", "diesel_i6", "--result", other, own, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["speeds"]
    assert sorted(bool(speed["grid_errors"]) for speed in told) == [False, True]
    faster = made_up(main=films)
    faster.time /= 1.1
    run_up = run_up_of(made_up(), faster, outputs=bearing_outputs(ENGINE))
    for name, lines in (("impedance", []), (level, [line])):
        path = tmp_path / f"{len(lines)}.h5"
        replace(run_up, attributes={**run_up.attributes, "bearings": name, "block": "ground"}).save(path)
        assert grid_said(capsys, "--run-up", path) == lines


def test_the_verb_reads_results_and_warns_of_limits(tmp_path, capsys):
    well, badly = saved(tmp_path / "a.h5"), saved(tmp_path / "b.h5", main={"film_thickness_min": 1.1e-6})
    folder = tmp_path / "p"
    assert main(["bearing-loads", "diesel_i6", "--result", well, badly, "--plots", str(folder), "--json"]) == 0
    said = capsys.readouterr()
    found = json.loads(said.out)
    assert [len(speed["violations"]) for speed in found["speeds"]] == [0, 7]
    assert said.err.count("warning: 1910 rev/min, main[") == 7
    assert found["speeds"][1]["worst"]["main"]["min_film_um"] == pytest.approx(1.1)
    assert found["speeds"][0]["mains"][0]["peak_load_place_deg"] == pytest.approx(90.0)
    assert len(list(folder.iterdir())) == 5  # loads on shells and journals of each, and bearings over the speed
    assert main(["bearing-loads", "diesel_v8", "--result", well]) == 2
    assert "the run is of engine 'diesel_i6', not of 'diesel_v8'" in capsys.readouterr().err


def run_up_of(*runs, outputs=None):
    """Run-up whose speeds are those of made-up runs; its orders count from crank angle 0."""
    kept = {name: [run.outputs[name] for run in runs] for name in runs[0].outputs if name != "crank.angle"}
    orders = 0.5 * np.arange(1, 49)
    turned = np.exp(-1j * orders * runs[0].outputs["crank.angle"][0])
    chosen = {name: of for name, of in kept.items() if outputs is None or name in outputs}
    amplitudes = {name: np.array([order_amplitudes(one[:-1], 24.0)[1] * turned for one in of])
                  for name, of in chosen.items()}  # fmt: skip
    extremes = {name: np.array([[one.min(), one[1:].mean(), one.max()] for one in of]) for name, of in kept.items()}
    n, speeds = len(runs), np.array([CYCLE / run.time[-1] for run in runs])
    found = RunUp(speeds, orders, amplitudes, extremes, np.full(n, 3), np.ones(n, dtype=int), np.zeros(n))
    return replace(found, attributes={"engine": "diesel_i6"})


def test_a_run_up_tells_of_its_bearings_what_its_runs_do():
    """Loads, places and powers of few orders to the last digits; a narrow dip of the film by the run's own extreme."""
    place = {"position": lambda crank, i: 2e-5 * np.exp(1j * crank) + 5e-6 * i}
    turning = {
        "force": lambda crank, i: 1e4 * i * np.exp(1j * crank) + 3e3 * np.exp(-2.5j * crank),
        "friction_torque": lambda crank, i: 2.0 + np.cos(crank),
        "film_thickness_min": lambda crank, i: 5e-6 - 2e-6 * np.exp(-(((crank - 2.0) / 0.01) ** 2)),
    }
    speeds = {"velocity": lambda crank, i: 2e-5j * SPEED * np.exp(1j * crank)}
    run = made_up(main=turning | place | speeds, big_end=turning | place)
    direct = bearing_report(run, ENGINE)
    [found] = run_up_bearings(run_up_of(run, outputs=bearing_outputs(ENGINE)), ENGINE)
    assert found.speed == pytest.approx(direct.speed, rel=1e-9)
    for one, other in zip(found.bearings, direct.bearings, strict=True):
        assert one.load.value == pytest.approx(other.load.value, rel=1e-4)  # samples stand elsewhere
        assert one.film.value == other.film.value and one.pressure.value == other.pressure.value
        assert math.degrees(abs(one.film.angle - 2.0)) < 5.0
        for what, within in (("mean_specific_load", 1e-6), ("pv", 1e-3), ("friction_power", 1e-3), ("oil_flow", 1e-9)):
            assert getattr(one, what) == pytest.approx(getattr(other, what), rel=within), what
        assert one.squeeze_power == pytest.approx(other.squeeze_power, rel=1e-3, abs=1e-3 * other.friction_power)


def test_the_verb_reads_a_run_up_and_gathers_its_warnings(tmp_path, capsys):
    thin = {"film_thickness_min": 1.1e-6}
    runs = [made_up(), made_up(main=thin), made_up(main=thin)]
    for k, run in enumerate(runs):
        run.time *= 1.0 / (1.0 + 0.1 * k)
    path, folder = tmp_path / "up.h5", tmp_path / "p"
    run_up_of(*runs, outputs=bearing_outputs(ENGINE)).save(path)
    asked = ["bearing-loads", "diesel_i6", "--run-up", str(path)]
    assert main([*asked, "--plots", str(folder), "--json"]) == 0
    said = capsys.readouterr()
    assert [len(speed["violations"]) for speed in json.loads(said.out)["speeds"]] == [0, 7, 7]
    assert said.err.count("the first of 2 such speeds") == 7
    assert (folder / "bearings_over_speed.png").exists()
    run_up_of(*runs, outputs=["crank.speed"]).save(path)
    assert main(asked) == 2
    assert "up.h5: has no orders of 'big_end[1].force.x'; run" in capsys.readouterr().err
