"""Nothing is lost between crank, pistons and block: mounts, weight and shaft alone change the engine's momentum.

At every instant, within a billionth of the peak gas force (and of that force times a metre for moments): rounding and
the last Newton step. Forces act at the undeformed places of the linearised bodies, in the balance as well. Steps are
small, because gravity takes the crank's displacement from the predictor.
"""

import math
from dataclasses import replace
from itertools import product

import entry
import numpy as np
import pytest
from bodies import free_six, rigid_crank, six
from momentum import imbalance
from small_block import single
from standing import rigid_block
from started import at_speed

from cranktrain.core.reduced_body import truncate
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.simulation import Parts, Settings, simulate
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.block.reduction import running_block
from cranktrain.structure.crank.reduction import running_body

SIX, EIGHT = free_six(), load_engine("diesel_v8")
STEP = math.radians(0.5)
GUIDED = SIX.piston_guidance


def with_cylinders(engine, guidance=GUIDED, **changes):
    return replace(engine, cylinders=replace(engine.cylinders, **changes), piston_guidance=guidance)


def peak_gas_force(engine):
    return 0.25 * math.pi * engine.cylinders.bore**2 * GasTrace.from_engine(engine).peak


def worst_imbalance(engine, crank, block, rpm=2000, cycles=1.0, **choices):
    """Largest imbalance over a run, (2, 3), in units of the peak gas force (and a metre)."""
    # By the larger γ of this method: rounding in accelerations grows with its inverse squared.
    choices = {"bearings": "linear", "crank": "solid", "integrator": "esdirk4", **choices}
    settings = Settings(block="flexible", step=STEP, newton_tolerance=1e-13, **choices)
    speed = rpm * math.pi / 30
    simulation = at_speed(speed, engine, crank, settings, parts=Parts(block=block))
    h = communication_step(speed, STEP)
    worst = np.zeros((2, 3))
    for k in range(1, round(cycles * 4 * math.pi / STEP) + 1):
        simulation.step(k * h)
        if k % 7 == 0:
            worst = np.maximum(worst, np.abs(imbalance(simulation)))
    return worst / peak_gas_force(engine)


SIXES = {
    "friction": SIX, "none": with_cylinders(SIX, replace(GUIDED, friction=0.0)),
    "pin offset": with_cylinders(SIX, pin_offset=0.002),
    "clearance": with_cylinders(SIX, replace(GUIDED, clearance=4e-5)),
}  # fmt: skip
RIGID = [*product(SIXES, ("linear", "impedance")), ("two banks", "linear"), ("two banks", "roller")]


@pytest.mark.parametrize(("case", "bearings"), [*RIGID, ("elastic crank", "impedance")])
def test_crank_in_a_rigid_block(case, bearings):
    engine = SIXES.get(case, EIGHT)
    crank = rigid_crank(engine)
    if case == "elastic crank":
        engine, body = six()
        crank = truncate(body, 1000.0)
    assert worst_imbalance(engine, crank, rigid_block(engine, crank), bearings=bearings).max() < 1e-9


def test_elastic_block():
    engine = single()
    block = running_block(engine)
    crank = rigid_crank(engine, mass=20.0, inertia=(0.2, 0.2, 0.3), centre=(0.0, 0.0, 0.065), pitch=0.13)
    assert block.n_modes > 6 and worst_imbalance(engine, crank, block, cycles=0.5).max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "rpm"), [(SIX, 2000), (EIGHT, 1800)], ids=["six", "eight"])
def test_engines_as_they_are(engine, rpm):
    """Elastic crank in its elastic block, with the films or rollers that the engine has."""
    crank, block = running_body(engine), running_block(engine)
    assert worst_imbalance(engine, crank, block, rpm, 0.5, bearings="auto").max() < 1e-9


def mean_side_force():
    """Mean force across of an unbalanced single's mains less that on its piston, and the largest on the mains, N."""
    engine = single()
    crank = rigid_crank(engine, mass=20.0, inertia=(0.2, 0.2, 0.3), centre=(0.0, -0.01, 0.065), pitch=0.13)
    settings = Settings(crank="solid", bearings="linear", block="ground", step=math.radians(1.0))
    run = simulate(engine, crank, settings, 3000.0 * math.pi / 30.0, settle=1e-7)
    mains = sum(run.outputs[f"bearing[{k}].force.x"][-run.per_cycle :] for k in (1, 2))
    return (mains - run.outputs["piston[1].side_force"][-run.per_cycle :]).mean(), np.abs(mains).max()


def test_an_unbalanced_crank_takes_its_centrifugal_force_along_as_it_winds_up(monkeypatch):
    """Over a cycle that repeats nothing but the piston's side force is left across; 234 N were by symmetric terms."""
    left, largest = mean_side_force()
    assert abs(left) < 3e-6 * largest
    entry.take_turning_stiffness(monkeypatch, lambda body: body.stress_stiffness - body.centrifugal)
    assert abs(mean_side_force()[0]) == pytest.approx(234.0, rel=0.1)
