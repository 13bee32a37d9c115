"""Levels above: a torsional fit to orders of a crank of beams in films has intervals that hold what that would move."""

import math

import numpy as np
import pytest
from identified import identified, model_of, places, write_orders

import cranktrain as ct
from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.threads import one_thread
from cranktrain.core.units import RPM
from cranktrain.engine.file import load_engine
from cranktrain_lab.identification.confidence import confidence_of
from cranktrain_lab.identification.data import Data
from cranktrain_lab.identification.identify import prepared, read_measured_file
from cranktrain_lab.identification.ladder import Ask, climb
from cranktrain_lab.identification.model import TorsionalModel

KEYS = ("crank.stiffness", "load")
ENGINES = {
    "four_petrol": (np.linspace(2500.0, 5000.0, 12) * RPM, (2.0, 4.0, 6.0)),
    "v12_petrol": (np.linspace(2000.0, 5500.0, 15) * RPM, (4.5, 6.0, 7.5)),
}
"""Engines with the speeds and orders of their data."""
TRUE = (1.03, 0.95)
TWO = """
[[orders]]
name = "pulley"
file = "orders.csv"
[parameters]
"crank.stiffness" = { low = 0.5, high = 2.0 }
load = { low = 0.7, high = 1.3 }
"""
TEXT = f'{TWO}"damping.torsional_ratios[1]" = {{ low = 0.002, high = 0.2 }}\n'


def measured_model(name):
    """Model of an engine that has the true values' parameters."""
    engine = load_engine(name)
    return model_of(engine, KEYS, Data(places(*ENGINES[name], deviation=1e-5)), engine.damper is not None)


def written(folder, name, values, text=TEXT):
    """Measured file of an engine's orders, rad, with noise of 0.3 % of the largest order."""
    spread = 0.003 * max(float(np.abs(one).max()) for one in values)
    write_orders(folder / "orders.csv", places(*ENGINES[name]), values, spread, 4)
    (folder / "measured.toml").write_text(text, "utf-8")
    return folder / "measured.toml"


@pytest.fixture(scope="module", params=["four_petrol", pytest.param("v12_petrol", marks=pytest.mark.slow)])
def bending(request, tmp_path_factory):
    """An engine's name, and the measured file of its crank of beams on films."""
    with one_thread():
        values = measured_model(request.param).in_time(np.array(TRUE), "beam", 1e-3)
    return request.param, written(tmp_path_factory.mktemp("bending"), request.param, values)


def test_the_step_to_a_crank_that_bends_is_in_the_interval_of_a_torsional_fit(bending, tmp_path):
    """Films hold the journals: a crank in motion is stiffer than the torsional one by formula. No residual says so."""
    name, path = bending
    (rows, alone), (more, held) = (identified(name, path, method="linear", above=above) for above in ("none", "next"))
    found, wide = rows[KEYS[0]], more[KEYS[0]]
    assert found["value"] == wide["value"] and not found["low"] <= TRUE[0] <= found["high"]
    assert wide["low"] <= TRUE[0] <= wide["high"]
    assert [step["level"] for step in alone["above"]] == ["harmonic-balance"]
    assert [step["level"] for step in held["above"]] == ["harmonic-balance", "beam in time"]
    away, there = (math.log(value / TRUE[0]) for value in (found["value"], held["above"][-1]["values"][KEYS[0]]))
    assert abs(away) > 0.1 and abs(there) < 0.1 * abs(away)


def in_time_as_linear(self, values, crank, settle, tell=lambda stage: None, cycles=None):
    """Stands for a run in time of a crank whose load counts more than the linear level's."""
    for speed in self.speeds.tolist():
        tell(f"run at {speed:.0f} rad/s")
    moved = values.copy()
    moved[1] = 1.0 + 1.3 * (values[1] - 1.0)
    return self.answers(moved).strands


def test_derivatives_of_a_crank_that_bends_are_its_own_and_progress_follows_its_runs(tmp_path, monkeypatch):
    """The deviation of the load is that of the level that was asked, which knows it better by 1.3 times.

    Progress never falls, moves within the runs in time, those of the next crank too, and ends at the whole.
    """
    name = "four_petrol"
    model = measured_model(name)
    monkeypatch.setattr(TorsionalModel, "in_time", in_time_as_linear)
    monkeypatch.setattr(TorsionalModel, "balanced", lambda self, values: self.answers(values).strands)
    with one_thread():
        path = written(tmp_path, name, model.in_time(np.array(TRUE), "beam", 1e-3), TWO)
        read, spread = read_measured_file(path)[0], []
        for ask in (Ask("linear"), Ask("time", "beam", above="next")):
            stages, shares = [], []
            own, comparison = prepared(load_engine(name), read, path, lambda stage: None)
            found = climb(own, comparison, ask, stages.append, lambda share, cost, shares=shares: shares.append(share))
            spread.append(confidence_of(comparison, found.estimate, np.zeros((0, 2))).deviations)
    assert np.exp(found.estimate.inner) == pytest.approx(TRUE, rel=0.02)
    assert spread[1] == pytest.approx(spread[0] / [1.0, 1.3], rel=0.15)
    assert sum(stage.startswith("run at") for stage in stages) >= 5 * model.speeds.size
    assert shares == sorted(shares) and shares[-1] > 0.9
    assert len({round(share, 3) for share in shares}) > 40


def test_an_interrupt_within_the_derivatives_keeps_the_best_so_far(tmp_path, monkeypatch):
    name, runs = "four_petrol", []
    model = measured_model(name)

    def in_time(self, values, *given, **named):
        runs.append(values)
        if len(runs) == 3:
            raise KeyboardInterrupt
        return in_time_as_linear(self, values, "beam", 1e-3)

    monkeypatch.setattr(TorsionalModel, "balanced", lambda self, values: self.answers(values).strands)
    with one_thread():
        path = written(tmp_path, name, in_time_as_linear(model, np.array(TRUE), "beam", 1e-3), TWO)
        monkeypatch.setattr(TorsionalModel, "in_time", in_time)
        own, comparison = prepared(load_engine(name), read_measured_file(path)[0], path, lambda stage: None)
        found = climb(own, comparison, Ask("time", "beam", above="next"))
    assert found.estimate.interrupted and found.steps[-1].answers == 1 and not found.beyond
    assert np.exp(found.estimate.inner) == pytest.approx(TRUE, rel=0.05)


@pytest.mark.slow
def test_a_crank_that_bends_finds_its_own_stiffness_though_the_linear_level_resonates_elsewhere(tmp_path):
    """Data and model of one level, 0.3 % of noise: the factor within three of its deviations and half a per cent.

    The fitted linear level has its peaks an eighth lower, so that its derivatives are of use only where it is moved.
    """
    name = "four_petrol"
    model = measured_model(name)
    with one_thread():
        values = model.in_time(np.array(TRUE), "beam", 1e-3)
    rows, _ = identified(name, written(tmp_path, name, values, TWO), method="time", crank="beam")
    row = rows[KEYS[0]]
    assert abs(math.log(row["value"] / TRUE[0])) < min(0.03 * row["deviation_percent"], 0.005)


def test_where_no_crank_above_answers_the_intervals_leave_its_step_out_and_say_so(bending, monkeypatch):
    def in_time(*given, **named):
        raise SolverError("does not settle")

    monkeypatch.setattr(TorsionalModel, "in_time", in_time)
    (name, path), said = bending, []
    with one_thread():
        model, comparison = prepared(load_engine(name), read_measured_file(path)[0], path, said.append)
        found = climb(model, comparison, Ask("linear", above="next"), said.append)
    assert [step.level for step in found.beyond] == ["harmonic-balance"]
    assert said[-1] == "no answer by beam in time, whose step the intervals leave out: does not settle"


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"above": "beam", "method": "time", "crank": "beam"}, "'beam' is no crank level above 'beam' that bends"),
        ({"above": "rigid"}, "'rigid' is no crank level above 'torsional' that bends"),
        ({"above": "bream"}, "did you mean 'beam'"),
        ({"method": "time", "crank": "beam"}, "crank level 'beam' bends and has 'damping.ratio' for all its modes"),
    ],
)
def test_cranks_above_that_are_none_and_ratios_of_a_crank_that_bends_are_refused(tmp_path, options, text):
    path = tmp_path / "measured.toml"
    path.write_text(TEXT, "utf-8")
    with pytest.raises(InputError, match=text):
        ct.identify("four_petrol", path, **options)


def test_the_next_crank_is_the_lowest_above_that_bends():
    assert Ask(above="next").crank_above == Ask("linear", "solid", above="next").crank_above == "beam"
    assert Ask(above="solid").crank_above == Ask("time", "beam", above="next").crank_above == "solid"
    assert Ask("time", "solid", above="next").crank_above == Ask("time", "beam", above="none").crank_above == ""
