"""The trade-off study: what a point holds, that errors fall as they must, and that an interrupted study goes on."""

import csv
import io
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.other_solvers.entries import other_entries, speedups
from benchmarks.other_solvers.solver import OtherSolver
from benchmarks.peer_programs.equal_error import Point as Setting
from benchmarks.peer_programs.equal_error import cost_at
from hypothesis import given
from hypothesis import strategies as st
from tradeoff_case import small

from cranktrain.core.errors import InputError
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.modules.combustion.file import load
from cranktrain.store.kept import Kept
from cranktrain_lab.cli.tradeoff import _row
from cranktrain_lab.tradeoff import families, measure, runs
from cranktrain_lab.tradeoff.choice import choice_text, unsettled_lines
from cranktrain_lab.tradeoff.families import FAMILIES
from cranktrain_lab.tradeoff.files import points_csv, write_files
from cranktrain_lab.tradeoff.measure import differences, high_order_error, measured
from cranktrain_lab.tradeoff.point import OUTPUTS, Point
from cranktrain_lab.tradeoff.study import study

__all__ = ["small"]
CONTRACT = {"family", "label", "parameters", "seconds_per_simulated_second", "error", "pareto", "status"}
POSITIVE = st.floats(1e-9, 1e3)


@given(st.lists(st.tuples(POSITIVE, POSITIVE), min_size=1, max_size=30), POSITIVE)
def test_cost_at_an_error_lies_on_the_front(choices, wanted):
    costs = [seconds for seconds, _ in choices]
    cost = cost_at([Setting("", error, seconds) for seconds, error in choices], wanted)
    within = [c for c, e in choices if e <= wanted]
    assert (cost is None) == (not within)
    if within:
        # No run that is close enough is cheaper than the interpolated cost, and the cheapest bounds it above.
        assert min(costs) * (1 - 1e-9) <= cost <= min(within) * (1 + 1e-9)


def test_cost_at_an_error_of_a_power_law():
    steps = np.array([4.0, 2.0, 1.0])
    points = [Setting("", step**3, 1.0 / step) for step in steps]
    assert cost_at(points, math.sqrt(8.0)) == pytest.approx(1.0 / math.sqrt(2.0))


def test_errors_are_relative_to_the_alternating_part():
    fine = 2.0 * math.pi * np.arange(1, 721) / 720
    exact = 5.0 + np.sin(fine)[None]
    coarse = exact[:, 2::3] + 0.01
    assert differences(coarse, 3.0, exact, 1.0, 1) == pytest.approx([0.01 * math.sqrt(2.0)])
    twice = np.concatenate((exact + 1.0, exact), axis=1)
    assert differences(np.tile(coarse, 2), 3.0, twice, 1.0, 2) == pytest.approx([0.01 * math.sqrt(2.0)])
    with pytest.raises(InputError, match="do not fall on"):
        differences(coarse, 1.5, exact, 1.0, 1)


def test_errors_of_high_orders_stand_apart():
    """An error of order 20 counts by its own size, whatever the low orders do and however outputs are sampled."""
    fine, coarse = (2.0 * math.pi * np.arange(1, n + 1) / n for n in (720, 240))
    exact = (10.0 * np.sin(3 * fine) + np.cos(40 * fine))[None]
    found = (11.0 * np.sin(3 * coarse) + 1.1 * np.cos(40 * coarse))[None]
    assert high_order_error(found, 3.0, exact, 1.0, 1) == pytest.approx(0.1)


@pytest.mark.slow
def test_points_of_a_study(small, tmp_path):
    result = study([small], ["integrators", "pressure"], True, Kept(tmp_path / "kept"), others=other_entries)
    data = json.loads(json.dumps(result.as_dict(), allow_nan=False))
    assert set(data) == {"points", "reference"}
    estimate = data["reference"]["error_estimate"]
    assert set(estimate) == set(OUTPUTS) and estimate["bearing_film"] is None
    assert 0.0 < estimate["pulley_torsion"] < 1e-4
    for point in data["points"]:
        assert set(point) >= CONTRACT
        assert set(point["error"]) == set(OUTPUTS)
        assert point["error"]["bearing_film"] is None  # linear bearings have no film
        assert point["parameters"]["error_kind"] in ("numerical", "input")
        assert point["status"] in ("ok", "unstable")
    points = {point.label: point for point in result.points if point.family == "integrators"}
    steps = [points[f"esdirk4 {deg:g}°"].worst for deg in (6.0, 3.0, 1.5)]
    assert steps[0] > 4 * steps[1] > 16 * steps[2]
    assert points["backward-euler 3°"].worst > 0.1
    assert points["radau-5 3°"].worst < points["esdirk4 3°"].worst
    # Another method, another assembly of the equations: the reference cannot be wrong alone.
    assert points["radau-5 3°"].error["pulley_torsion"] < 1e-4
    assert [p.label for p in result.points if p.parameters.get("default")] == ["esdirk47 5°"]
    traces = {point.label: point for point in result.points if point.family == "pressure"}
    assert traces["linear 2°"].worst > 10 * traces["spline 2°"].worst > 0.0
    cheapest = min((p for p in points.values() if p.usable), key=lambda p: p.seconds_per_simulated_second)
    assert cheapest.pareto

    again = study([small], ["integrators", "pressure"], True, Kept(tmp_path / "kept"), others=other_entries)
    assert again.as_dict() == result.as_dict()

    names = {path.name for path in write_files(result, tmp_path / "out")}
    assert {"integrators.png", "integrators.svg", "overall.png", "overall.svg", "tradeoff.html", "points.csv"} <= names
    assert {path.name for path in (tmp_path / "out").iterdir()} == names  # nothing temporary is left
    text = (tmp_path / "out" / "tradeoff.html").read_text(encoding="utf-8")
    assert "esdirk47 5" in text and not any(word in text for word in ("src=", "@import", "href=", "@DATA@"))
    rows = list(csv.DictReader(io.StringIO(points_csv(result.points))))
    assert len(rows) == len(result.points)
    assert float(rows[0]["error_pulley_torsion"]) == result.points[0].error["pulley_torsion"]
    said = choice_text(result)
    assert all(f"  {share} %" in said for share in ("10", "1", "0.1"))
    assert re.search(r"method and step: esdirk4 \S+ \(", said)
    # Where runs part, whatever their step, nothing finer than what parts them can be chosen.
    said = choice_text(replace(result, estimates={small.name: {"pulley_torsion": 0.02, "pulley_axial": None}}))
    assert "off by 2.0e-02" in said
    assert "  10 %\n" in said and "  1 %\n" not in said and "  0.1 %\n" not in said


def test_an_interrupted_study_goes_on(small, tmp_path):
    entries = FAMILIES["integrators"](small, True)[:3]
    store = Kept(tmp_path)
    told = []

    def interrupt(stage):
        told.append(stage)
        if len(told) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        measured(entries, store, 1, interrupt)
    broken = f"{measure._entry_key(entries[2])}.json"
    (tmp_path / broken).write_text('{"costs": [0.', encoding="utf-8")
    resumed = []
    points = measured(entries, Kept(tmp_path), 1, resumed.append)
    assert resumed == [f"integrators: {entries[2].label}"]
    fresh = measured(entries[:2], Kept(tmp_path / "other"), 1)
    for kept, new in zip(points, fresh, strict=False):
        assert kept.error == new.error
    assert measured(entries, Kept(tmp_path), 1, lambda stage: pytest.fail(stage)) == points


def test_repeats_are_taken_in_turn_and_counted(small, tmp_path):
    entries = FAMILIES["integrators"](small, True)[:2]
    told = []
    points = measured(entries, Kept(tmp_path), 3, told.append)
    labels = [entry.label for entry in entries]
    assert told == [f"integrators: {label}{turn}" for turn in ("", ", repeat 2", ", repeat 3") for label in labels]
    assert [point.parameters["repeats"] for point in points] == [3, 3]


def test_a_run_that_fails_is_a_point(small, tmp_path, monkeypatch):
    def lost(case, say=None):
        raise measure.CranktrainError("film of main[3] lost")

    entries = FAMILIES["integrators"](small, True)[:1]
    store = Kept(tmp_path)
    measure.recorded(entries[0].reference, store)
    monkeypatch.setattr(measure, "run", lost)
    (point,) = measured(entries, store)
    assert point.status == "failed: film of main[3] lost"
    assert point.seconds_per_simulated_second is None and point.worst is None and not point.usable


def test_levels_climb_to_the_next(small):
    for family, kind in (("bearings", "bearings"), ("ladder", "crank")):
        entries = [e for e in FAMILIES[family](small, True) if e.more.get("ladder") == kind]
        climbed = [(getattr(e.case.levels, kind), e.more["against"]) for e in entries if e.error_kind == "model"]
        assert [below for below, _ in climbed][1:] == [above for _, above in climbed][:-1]
        tops = {e.more["against"] for e in entries if e.error_kind == "top"}
        assert tops == {climbed[-1][1]}


def test_other_solvers_come_with_their_entries(small, tmp_path):
    """The study alone has the stage solver's methods; an entry that brings a solver is run by it."""
    assert all(entry.other is None for entry in FAMILIES["integrators"](small, True))
    entries = [entry for entry in other_entries(small, True) if entry.label == "radau-5 3°"]
    store, told = Kept(tmp_path), []
    (point,) = measured(entries, store, 1, told.append)
    assert (point.solver, point.parameters["integrator"], point.parameters["scaling"]) == ("radau-5", "radau-5", "each")
    assert point.status == "ok" and point.error["pulley_torsion"] < 1e-3
    other = replace(entries[0], other=OtherSolver("scipy:LSODA", 1e-2))
    keys = {measure._entry_key(entry) for entry in (entries[0], other, replace(other, other=None))}
    assert len(keys) == 3
    assert measured(entries, store, 1, lambda stage: pytest.fail(stage)) == [point]


def test_an_other_solver_that_does_not_exist_is_refused():
    with pytest.raises(InputError, match="did you mean 'scipy:LSODA'"):
        OtherSolver("scipy:LSODE", 1e-3)
    with pytest.raises(InputError, match="needs a tolerance"):
        OtherSolver("scipy:BDF")


def test_best_own_cost_beside_the_best_of_scipy():
    """At an error of 1e-3: ours of a power law, SciPy's cheapest of two, explicit methods left out."""

    def point(cost, error, **more):
        errors = dict.fromkeys(OUTPUTS, error)
        return Point("integrators", "", {"error_kind": "numerical", "integrator": "esdirk4", **more}, cost, errors)

    def other(method, name, cost):
        return point(cost, 1e-3, integrator=method, solver=name)

    points = [point(1.0, 1e-2), point(2.0, 1e-4)]
    assert speedups(points) == {}
    points += [other("scipy:BDF", "SciPy BDF", 30.0), other("scipy:LSODA", "SciPy LSODA, floored", 20.0)]
    entry = speedups([*points, other("runge-kutta-4", "runge-kutta-4", 0.1)])["0.001"]
    assert entry["own"] == pytest.approx(math.sqrt(2.0))
    assert (entry["scipy_best"], entry["ratio"]) == ("SciPy LSODA, floored", pytest.approx(20.0 / math.sqrt(2.0)))


@pytest.mark.slow
def test_schemes_beside_the_combustion_converge(small, tmp_path, monkeypatch):
    """Own reconstruction with order two at least, held values with order one; the charge burns after dead centre."""
    monkeypatch.setattr(families, "COUPLED_REFERENCE_DEG", 0.25)
    slow = {"injection_angle": math.radians(-0.1), "intake_pressure": 2.6e5, "exhaust_pressure": 2.3e5}
    monkeypatch.setattr(runs.combustion_file, "load", lambda path: replace(load(path), **slow))
    entries = FAMILIES["schemes"](small, True)
    entries += [e for e in FAMILIES["schemes"](small, False) if e.label in ("jacobi, linear 1°", "jacobi, linear 2°")]
    points = {point.label: point for point in measured(entries, Kept(tmp_path))}
    ratio = {}
    for way in ("gauss-seidel, own", "jacobi, own", "jacobi, hold"):
        fine, coarse = (points[f"{way} {step}°"].error["pulley_torsion"] for step in (2, 4))
        ratio[way] = coarse / fine
    fine, coarse = (points[f"jacobi, linear {step}°"].other_errors["shaft_torque"] for step in (1, 2))
    assert coarse / fine > 3.5 and fine < 5.0e-3  # means that are held: late by no part of a step
    assert ratio["gauss-seidel, own"] > 4.0 and ratio["jacobi, own"] > 4.0
    assert 1.7 < ratio["jacobi, hold"] < 2.3
    for scheme in ("gauss-seidel", "jacobi"):
        assert points[f"{scheme}, own 1°"].error["pulley_torsion"] < 5.0e-3
        assert points[f"{scheme}, own 1°"].parameters["scheme"] == scheme
    assert FAMILIES["schemes"](replace(small, engine=replace(small.engine, name="mine")), True) == []


def test_runs_begin_with_the_friction_of_the_spline_in_the_settled_cycle(small, tmp_path):
    """Teeth that began without their deflection would change the first cycle by a hundredth of the axial motion."""
    assert small.engine.axial_path.joint == "spline"
    entry = FAMILIES["integrators"](small, True)[1]
    (point,) = measured([replace(entry, reference=entry.case)], Kept(tmp_path))
    assert point.parameters["settling"] < 1e-3


def test_a_start_that_does_not_settle_is_told(small, tmp_path, monkeypatch):
    """One cycle does not settle the slow drive line: points, table of choices and page say what is left."""
    monkeypatch.setattr(runs, "SETTLE", 0.0)
    monkeypatch.setattr(runs, "run_cycles", lambda model, cycles, *rest: run_cycles(model, 2, *rest))
    monkeypatch.setattr(runs, "_SETTLED", {})
    entry = FAMILIES["pressure"](small, True)[0]
    case, reference = (replace(one, cycles=2) for one in (entry.case, entry.reference))
    store = Kept(tmp_path / "kept")
    (point,) = measured([replace(entry, case=case, reference=reference)], store)
    assert point.status == "ok" and point.unsettled > 1e-3
    assert point.parameters["start_unsettled"] > 1e-3 and point.parameters["reference_start_unsettled"] > 1e-3
    (line,) = unsettled_lines([point])
    assert f"1 of 1 runs, or their references, began in a motion that did not settle ({point.unsettled:.1e}" in line
    assert _row(point)[0] == f"pressure: {point.label}, start not settled"
    (kept,) = measured([replace(entry, case=case, reference=reference)], store)
    assert kept.as_dict() == point.as_dict()
    known = {key: value for key, value in point.parameters.items() if "unsettled" not in key}
    assert unsettled_lines([replace(point, parameters=known)]) == []


def test_an_interrupt_before_the_start_is_settled_is_none_of_a_result(small, tmp_path, monkeypatch):
    """The cycles that it cut short are not the settled ones, so nothing is kept."""
    monkeypatch.setattr(
        runs, "run_cycles", lambda model, *rest: replace(run_cycles(model, 1, *rest[1:]), complete=False)
    )
    monkeypatch.setattr(runs, "_SETTLED", {})
    with pytest.raises(KeyboardInterrupt):
        measured(FAMILIES["pressure"](small, True)[:1], Kept(tmp_path / "kept"))
    assert not list((tmp_path / "kept").rglob("*.*")) and not runs._SETTLED
