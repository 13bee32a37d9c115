"""The bound on the work of a communication step: unseen below it, kept and told beyond it, a failure at the worst."""

import math
import warnings
from dataclasses import replace
from functools import cache

import entry
import numpy as np
import pytest
from bodies import rigid_crank, started

from cranktrain.core.errors import InputError, SolverError
from cranktrain.dynamics.simulation import Settings, Simulation, simulate
from cranktrain.dynamics.time.table import HEAD, STAGES
from cranktrain.dynamics.time.work_limit import LAST_ITERATIONS
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import assemble

ENGINE = load_engine("diesel_i6")
SPEED = 2000 * math.pi / 30
STEP = math.radians(2.5) / SPEED


def begun(**chosen):
    return started(SPEED, ENGINE, **chosen)


def run(simulation, count=288):
    """Outputs (steps, outputs) and work (steps,) of a cycle."""
    rows, work = [], []
    for k in range(count):
        simulation.step((k + 1) * STEP)
        rows.append(simulation.outputs.copy())
        work.append(entry.count(simulation, "work"))
    return np.array(rows), np.array(work)


@cache
def free(level):
    """The same without a limit."""
    return run(begun(bearings=level))


def column(simulation, rows, name):
    return rows[:, simulation.output_names.index(name)]


@pytest.mark.parametrize("level", ["impedance", "reynolds"])
def test_a_limit_that_is_not_reached_changes_nothing(level):
    rows, work = free(level)
    limited = begun(bearings=level, work_limit=float(work.max()))
    own, own_work = run(limited)
    assert np.array_equal(own, rows) and np.array_equal(own_work, work)
    assert entry.count(limited, "limited") == 0.0 and not limited.limited


@pytest.mark.parametrize("level", ["impedance", "reynolds"])
def test_beyond_the_limit_work_is_bounded_and_the_step_says_so(level):
    """Where films rupture anew as a cylinder fires iterations are most: there it is cut short, and stays near."""
    rows, work = free(level)
    limit = float(work.max() - 2.0)
    limited = begun(bearings=level, work_limit=limit)
    own, own_work = run(limited)
    told, substeps = (column(limited, own, f"solver.{name}") for name in ("limited", "substeps"))
    assert 0.0 < told.sum() == entry.count(limited, "limited") < 0.5 * told.size
    assert set(told) == {0.0, 1.0}
    stages = limited.model.stages[HEAD, STAGES]
    assert (own_work <= limit + LAST_ITERATIONS * stages * substeps).all()
    first = int(told.argmax())
    assert np.array_equal(own[:first], rows[:first]) and not np.array_equal(own[first], rows[first])
    assert work[first] > limit and (work[:first] <= limit + stages).all()
    eccentricity, free_one = (column(limited, found, "bearing[4].eccentricity") for found in (own, rows))
    assert np.abs(eccentricity - free_one).max() < 0.01


def test_adaptive_steps_are_not_shortened_beyond_it():
    settings = {"control": "adaptive", "tolerance": 1e-5}
    free_run, limited = begun(**settings), begun(**settings, work_limit=8.0)
    (_, work), (own, own_work) = run(free_run, 72), run(limited, 72)
    assert own_work.max() < work.max() and column(limited, own, "solver.limited").sum() > 0


@pytest.fixture(scope="module")
def beam_six():
    return assemble(ENGINE, Settings(crank="beam", bearings="impedance"))


def paced(parts, rpm, limit=0.0):
    """Half a second of the six with a beam crank in steps of a millisecond."""
    settings = replace(parts.settings, work_limit=limit)
    simulation = Simulation(parts.engine, parts.body, settings, parts=parts.parts)
    simulation.inputs[0] = rpm * math.pi / 30
    simulation.initialize()
    rows, work = [], []
    for k in range(500):
        simulation.step((k + 1) * 1e-3)
        rows.append(simulation.outputs.copy())
        work.append(entry.count(simulation, "work"))
    return simulation, np.array(rows), np.array(work)


@pytest.mark.parametrize("rpm", [1700, 1900, 2275])
def test_an_iteration_does_not_circle_where_a_journal_turns_round(beam_six, rpm):
    """At rest a film's force has a kink, which full Newton steps cross to and fro: parts of steps were halved."""
    simulation, rows, work = paced(beam_six, rpm)
    assert entry.count(simulation, "rejected") == 0.0
    assert np.array_equal(column(simulation, rows, "solver.iterations"), work)


@pytest.mark.parametrize(
    ("rpm", "part", "near"), [(1700, 0.5, 0.1), (2275, 0.5, 0.1), (1700, 0.99, 0.01), (2275, 0.99, 0.01)]
)
def test_a_run_in_real_time_goes_on_where_work_is_cut_short(beam_six, rpm, part, near):
    """Of steps limited to the work of half of them, or of 99 %, none fails, and journals stay near, in clearances."""
    free_one, rows, work = paced(beam_six, rpm)
    limited, own, _ = paced(beam_six, rpm, float(np.quantile(work, part)))
    assert column(limited, own, "solver.limited").sum() > 0
    for name in (name for name in limited.output_names if name.endswith("eccentricity")):
        assert np.abs(column(limited, own, name) - column(free_one, rows, name)).max() < near


def test_a_step_without_a_result_within_the_limit_fails_and_leaves_the_state():
    simulation = begun(bearings="impedance", work_limit=1.0)
    simulation.inputs[1] = 8e9  # nothing that twelve iterations find
    simulation.inputs[2:7] = 1e5
    before = simulation.state
    with pytest.raises(SolverError, match=r"solver\.work_limit allows"):
        for k in range(20):
            before = simulation.state
            simulation.step((k + 1) * STEP)
    assert np.array_equal(simulation.state, before)


def test_a_run_warns_and_counts():
    body = rigid_crank(ENGINE)
    work = free("impedance")[1]
    with pytest.warns(UserWarning, match=r"iterations of solver\.work_limit"):
        found = simulate(ENGINE, body, Settings(crank="rigid", work_limit=float(work.max() - 2.0)), SPEED, 1)
    assert found.counters["limited_steps"] > 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert simulate(ENGINE, body, Settings(crank="rigid"), SPEED, 1).counters["limited_steps"] == 0


@pytest.mark.parametrize("limit", [-1.0, math.nan, math.inf])
def test_a_limit_that_is_none_is_refused(limit):
    with pytest.raises(InputError, match="work_limit must be 0"):
        begun(work_limit=limit)
