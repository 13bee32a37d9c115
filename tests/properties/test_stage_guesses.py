"""First guesses of stages: they decide how many iterations a stage takes, never to what it converges."""

import math

import numpy as np
import pytest

from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.model.slots import MORE_MISSED, N_ITERATIONS, N_STAGES
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.time.integrators import INTEGRATORS, integrator_table
from cranktrain.dynamics.time.stage_guesses import WEIGHTS
from cranktrain.dynamics.time.table import EXPLICIT_FIRST, FIRST_STAGE, GUESSED, HEAD, STAGES
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import assemble


def cycle(method, degrees, speed, weights=True):
    """Run of the six with aligned films, its second cycle of torsion, and what the series missed more, step by step."""
    settings = Settings(crank="beam", bearings="impedance", step=math.radians(degrees), integrator=method)
    made = assemble(load_engine("diesel_i6"), settings)
    run = Simulation(made.engine, made.body, made.settings, None, made.parts)
    run.inputs[0] = speed
    run.initialize()
    if not weights:
        run.model.stages[FIRST_STAGE:, GUESSED:] = 0.0
    count = round(720.0 / degrees)
    step = 4.0 * math.pi / speed / count
    done = run.series(step, 1, np.zeros((count, run.outputs.size)))
    run.work.counters[:] = 0.0
    rows, more = np.zeros((1, run.outputs.size)), []
    torsion = np.zeros(count)
    for k in range(count):
        done += run.series(step, done + 1, rows)
        torsion[k] = rows[0, run.output_names.index("pulley.torsion")]
        more.append(run.work.known[:, MORE_MISSED, : run.model.scales.size] / run.model.scales)
    return run, torsion, np.array(more)


@pytest.mark.parametrize(("method", "degrees", "speed"), [("esdirk4", 5.0, 230.0), ("esdirk4", 8.0, 150.0)])
def test_weights_spare_iterations_and_leave_the_motion_as_it_is(method, degrees, speed):
    """At speeds that the weights were not fitted at; the motion agrees to what the Newton tolerance leaves.

    The steps themselves leave 7e-3 and more (``python -m benchmarks.level_cost``).
    """
    with_weights, torsion, _ = cycle(method, degrees, speed)
    without, expected, _ = cycle(method, degrees, speed, weights=False)
    spread = np.std(expected)
    assert np.abs(torsion - expected).max() < 1e-3 * spread
    taken, before = (run.work.counters[N_ITERATIONS] / run.work.counters[N_STAGES] for run in (with_weights, without))
    assert 1.0 <= taken < 0.97 * before


@pytest.mark.parametrize("method", ["esdirk4", "esdirk47", "esdirk57"])
def test_guesses_miss_less_at_every_stage_behind_the_first(method):
    """The median over a cycle of the largest miss, at a speed and a step that the weights were not fitted at."""
    run, _, more = cycle(method, 4.0, 180.0)
    stages = int(run.model.stages[HEAD, STAGES])
    weights = run.model.stages[FIRST_STAGE : FIRST_STAGE + stages, GUESSED : GUESSED + stages]
    left = more[:, :stages] - np.einsum("sp,tpk->tsk", weights, more[:, :stages])
    before, after = (np.median(np.abs(values[:, 2:stages]).max(axis=2), axis=0) for values in (more, left))
    assert (after <= before).all() and np.median(after / before) < 0.5


def test_weights_look_at_stages_before_alone():
    """An explicit first stage misses nothing, and a table without weights guesses without."""
    assert WEIGHTS.keys() <= INTEGRATORS.keys()
    for name in INTEGRATORS:
        table = integrator_table(name)
        stages = int(table[HEAD, STAGES])
        weights = table[FIRST_STAGE : FIRST_STAGE + stages, GUESSED:]
        assert not np.triu(weights[:, :stages]).any() and not weights[:, stages:].any()
        assert name in WEIGHTS or not weights.any()
        if table[HEAD, EXPLICIT_FIRST]:
            assert not weights[:, 0].any()


def test_guesses_do_not_look_at_what_the_workspace_held_before():
    """Rows of no stage before are NaN: a weight of zero does not undo them."""
    settings = Settings(crank="beam", bearings="impedance")
    made = assemble(load_engine("diesel_i6"), settings)
    motions = []
    for held in (0.0, math.nan):
        run = Simulation(made.engine, made.body, made.settings, None, made.parts)
        run.inputs[0] = 200.0
        run.initialize()
        run.work.known[:] = held
        run.step(1e-3)
        motions.append(run.outputs.copy())
    assert np.isfinite(motions[0]).all() and np.array_equal(*motions)
