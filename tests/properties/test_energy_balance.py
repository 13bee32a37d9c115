"""The gas work of a cycle is accounted for by named losses, at every level: one part in 100,000 is left at most.

Powers are those that the running model's own force laws leave in ``Work.powers``, see results/energy.py. What a
quadrature leaves falls with the step, what the forces leave does not: steps are as long as the level's own.
"""

import math
from functools import cache

import numpy as np
import pytest
from bodies import rigid_crank, six
from box_block import box_block
from small_block import single
from standing import rigid_block

from cranktrain.dynamics.model.slots import POWERS
from cranktrain.dynamics.settled.powers import PowerSamples
from cranktrain.dynamics.simulation import Parts, Settings, simulate
from cranktrain.engine.file import load_engine
from cranktrain.results.energy import SHARES, energy_balance
from cranktrain.structure import assembly

CLOSED = 1e-5
"""Largest residual over the gas work."""


def balance(engine, body, rpm=2000, step_deg=2.5, parts=None, cycles=None, **choices):
    """Energy balance of the last cycle of a run until its outputs repeat."""
    settings = Settings(step=math.radians(step_deg), **choices)
    run = simulate(engine, body, settings, rpm * math.pi / 30, cycles, parts=parts, settle=1e-5)
    return energy_balance(run.powers, run.time[1] - run.time[0])


@cache
def of_six(bearings, block, step_deg=2.5, **choices):
    engine, body = six()
    standing = {"ground": None, "rigid": rigid_block, "elastic": lambda engine, _: box_block(engine)}[block]
    parts = Parts(block=standing and standing(engine, body))
    if bearings == "table":
        parts = parts._replace(table=assembly.main_table(engine))
    level = "ground" if block == "ground" else "flexible"
    return balance(engine, body, 2000, step_deg, parts, bearings=bearings, block=level, **choices)


@pytest.mark.parametrize("block", ["ground", "rigid", "elastic"])
def test_six_with_films_without_tilt(block):
    assert abs(of_six("impedance", block)["residual_of_gas_work"]) < CLOSED


@pytest.mark.parametrize("block", ["ground", "elastic"])
def test_six_with_tabulated_films(block):
    assert abs(of_six("table", block)["residual_of_gas_work"]) < CLOSED


def test_six_with_floating_big_ends_and_damper():
    found = of_six("impedance", "elastic", big_ends="impedance", damper="fitted")
    assert abs(found["residual_of_gas_work"]) < CLOSED
    assert found["losses_j"]["damper"] > 0 and found["losses_j"]["big_ends_shear"] > 0


def test_eight_on_rollers_in_its_block():
    engine = load_engine("diesel_v8")
    crank = rigid_crank(engine)
    parts = Parts(block=box_block(engine))
    found = balance(engine, crank, 1800, parts=parts, crank="rigid", bearings="roller", block="flexible")
    assert abs(found["residual_of_gas_work"]) < CLOSED


def test_a_short_engine_in_its_block():
    engine = single()
    crank = rigid_crank(engine, mass=20.0, inertia=(0.2, 0.2, 0.3), centre=(0.0, 0.0, 0.065), pitch=0.13)
    parts = Parts(block=box_block(engine))
    found = balance(engine, crank, parts=parts, crank="rigid", bearings="impedance", block="flexible")
    assert abs(found["residual_of_gas_work"]) < CLOSED


def test_each_loss_counts():
    """Left out, any loss that this engine has more of than the residual may be opens the balance."""
    found = of_six("impedance", "elastic", big_ends="impedance", damper="fitted")
    gas, losses = found["gas_work_j"], found["losses_j"]
    counted = [name for name, loss in losses.items() if abs(loss) > 2 * CLOSED * gas]
    assert {"dynamometer", "mains_shear", "mains_squeeze", "big_ends_shear", "liners_friction"} <= set(counted)
    for name in counted:
        assert abs(found["residual_j"] + losses[name]) > CLOSED * gas, name
    # Heat comes from no loss, and all that take power are named.
    assert all(loss > -CLOSED * gas for loss in losses.values())
    assert set(losses) == {share.key for share in SHARES}


def test_what_is_not_a_cycle_has_no_samples():
    samples = PowerSamples(3)
    rows = np.arange(5.0 * POWERS).reshape(5, POWERS)
    samples.begin(rows[0])
    for row in rows[1:3]:
        samples.add(row)
    assert samples.cycle is None
    for row in rows[3:]:
        samples.add(row)
    assert np.array_equal(samples.cycle, rows[1:])
    samples.begin(rows[4])
    assert np.array_equal(samples.cycle, rows[1:])
    samples.add(rows[0])
    assert samples.cycle is None
