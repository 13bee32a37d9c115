"""Drive lines in time: couplings over torque, friction and linear dampers, beside the frequency domain.

The mean torque of the gas is wound up in each shaft of a line to the dynamometer, whatever the shaft's law. Small
oscillations about it are those of the tangent stiffness, so orders in time meet those of the frequency domain.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from bodies import rigid_crank

from cranktrain.core.errors import InputError
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation, simulate
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.drive_line_chain import DriveLineChain
from cranktrain.engine.file import load_engine
from cranktrain.engine.line_elements import element_values, torque_curve
from cranktrain.engine.parts import Damper, MeanLoad
from cranktrain.engine.torsional_chain import Chain, Disc, Shaft
from cranktrain.loads.damper import with_damper_housing
from cranktrain.loads.gas_pressure import CYCLE, GasTrace
from cranktrain.loads.mean_load import balancing_load, mean_torques
from cranktrain.results.orders.harmonics import order_amplitudes
from cranktrain.structure.assembly import assemble
from cranktrain.studies.run_up.steady import Job, SteadyRuns
from cranktrain.studies.torsion.frequency_run_up import frequency_run_up

SIX = load_engine("diesel_i6")
RPM = math.pi / 30.0
LOCKED = Settings(crank="rigid", bearings="held")
SPEED = 1500.0 * RPM


def behind(*shafts, discs=(("driven", 2.0),)):
    chain = Chain(tuple(Disc(*row) for row in discs), shafts)
    engine = replace(SIX, drive_line_chain=DriveLineChain.of(chain))
    check_engine(engine)
    return engine


def last_cycle(engine, settings=LOCKED):
    """Outputs of the last of the cycles that repeat."""
    run = simulate(engine, rigid_crank(engine), settings, SPEED)
    assert run.settling.repeats == 1
    return {name: values[-run.per_cycle :] for name, values in run.outputs.items()}


def order(values, number):
    orders, amplitudes = order_amplitudes(values, 12.0, 1)
    return abs(amplitudes[list(orders).index(number)])


def test_a_progressive_coupling_winds_up_by_its_curve_and_swings_on_its_tangent():
    stages = element_values("shaft", {"stiffness": (2e4, 3e4, 6e4), "torques": (500.0, 1500.0), "damping": 20.0})
    engine = behind(Shaft(("flywheel", "driven"), **stages), Shaft(("driven", "dynamometer"), 5e4, 20.0))
    found = last_cycle(engine)
    twist = found["connection[line[1]].twist"]
    mean = mean_torques(engine, GasTrace.from_engine(engine))[1]
    twists, torques = torque_curve(engine.drive_line_chain.chain.shafts[0])
    # The whole oscillation stays on the second stage.
    assert torques[2] < 500.0 < np.interp(twist.min(), twists, torques)
    assert np.interp(twist.max(), twists, torques) < 1500.0
    assert np.interp(twist.mean(), twists, torques) == pytest.approx(mean, rel=5e-3)
    # What the shaft's law carries, less what the connection pushes the flywheel by, is the torque of the curve.
    whole = found["shaft.torque"] - found["connection[line[1]].torque"]
    assert whole.mean() == pytest.approx(np.interp(twist, twists, torques).mean(), rel=1e-6)
    steady = frequency_run_up(engine, rigid_crank(engine), LOCKED, np.array([SPEED]), [3.0, 6.0], "harmonic-balance")
    for number in (3.0, 6.0):
        expected = abs(steady.order(number, "shaft[flywheel to driven].torque")[0])
        assert order(whole, number) == pytest.approx(expected, rel=5e-3)


def test_friction_of_bow_springs_is_that_of_its_equivalent_damping():
    """Order 3 dominates the twist, so equivalent damping errs by the square of what the other orders have."""
    engine = behind(
        Shaft(("flywheel", "driven"), 6e3, 5.0, friction=40.0, slip_speed=0.5),
        Shaft(("driven", "dynamometer"), 2e4, 40.0),
        discs=(("driven", 0.5),),
    )
    found = last_cycle(engine)
    body = rigid_crank(engine)
    steady = frequency_run_up(engine, body, LOCKED, np.array([SPEED]), [3.0], "harmonic-balance")
    free = replace(engine, drive_line_chain=replace(engine.drive_line_chain, frictions=(0.0, 0.0)))
    without = frequency_run_up(free, body, LOCKED, np.array([SPEED]), [3.0], "harmonic-balance")
    ours = order(found["shaft.torque"] - found["connection[line[1]].torque"], 3.0)
    rubbed, smooth = (abs(one.order(3.0, "shaft[flywheel to driven].torque")[0]) for one in (steady, without))
    assert ours == pytest.approx(rubbed, rel=0.05)
    assert abs(ours - rubbed) < 0.2 * abs(ours - smooth)


@pytest.mark.parametrize(
    "law",
    [
        {"damping": 60.0},
        {"frequencies": (40.0, 100.0), "stiffnesses": (2e4, 5e4), "dampings": (30.0, 10.0), "frequency": 75.0},
    ],
)
def test_a_linear_damper_in_time_meets_the_frequency_domain(law):
    """Order 3 at 1500 rev/min is 75 Hz, at which the steel springs are linearised."""
    fitted = with_damper_housing(replace(SIX, damper=Damper(kind="linear", ring_inertia=0.3, **law)))
    check_engine(fitted)
    settings = replace(LOCKED, damper="fitted")
    found = last_cycle(fitted, settings)
    steady = frequency_run_up(fitted, rigid_crank(fitted), settings, np.array([SPEED]), [3.0], "harmonic-balance")
    assert order(found["pulley.torsion"], 3.0) == pytest.approx(abs(steady.order(3.0)[0]), rel=2e-3)


def test_what_cannot_run_in_time_is_refused_in_one_line():
    free = behind(Shaft(("flywheel", "driven"), 2e4, 5.0))
    with pytest.raises(InputError, match=r"ends freely; a run in time needs a shaft to 'dynamometer'"):
        Simulation(free, rigid_crank(free), LOCKED)
    geared = behind(
        Shaft(("flywheel", "a"), 3e4, 5.0), Shaft(("a", "b"), ratio=2.0),
        Shaft(("b", "c"), 2e4, friction=3.0), Shaft(("c", "dynamometer"), 1e4, 5.0),
        discs=(("a", 0.5), ("b", 0.2), ("c", 0.4)),
    )  # fmt: skip
    with pytest.raises(InputError, match=r"shaft 3 has stiffness over torque or friction, and its end 'b' is no disc"):
        Simulation(geared, rigid_crank(geared), LOCKED)
    # In the frequency domain both run.
    for engine in (free, geared):
        run = frequency_run_up(engine, rigid_crank(engine), LOCKED, np.array([SPEED]), [3.0], "harmonic-balance")
        assert np.isfinite(run.torsion).all()


def test_cycles_in_time_balance_a_propeller_at_each_speed():
    """The shaft's mean torque is the load's, less the heat of dampings: nothing rubs on locked journals."""
    load = MeanLoad(kind="propeller", speed=200.0, torque=1200.0)
    engine = replace(SIX, load=load, reduction=replace(SIX.reduction, torsional_source="ker-wilson"))
    made = assemble(engine, Settings(crank="torsional", bearings="held"), inherit=False)
    runs = SteadyRuns(Job(made, None, 1e-4, 6.0, ("shaft.torque",), balanced=True))
    near = []
    for speed in (150.0, 152.0, 100.0):
        found = runs.at(speed, near)
        near = [found.start]
        burn = balancing_load(engine, GasTrace.from_engine(engine), speed)
        run = simulate(engine, made.body, replace(made.settings, gas_load=burn), speed, settle=1e-4)
        works = np.trapezoid(run.powers, dx=run.step, axis=0)
        damped = (works[at.CRANK_LOSS] + works[at.SHAFTS_LOSS]) / CYCLE
        assert found.extremes["shaft.torque"][1] + damped == pytest.approx(load.torque_at(speed), rel=1e-3)
