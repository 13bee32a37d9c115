"""The damper in a run: its ring follows its law, to the limits of no fluid and of a ring that is stuck; its warmth."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
from bodies import free_six, rigid_crank, six
from one_line import one_line
from started import at_speed, rate, series

from cranktrain.core.reduced_body import truncate
from cranktrain.dynamics.cycle_run import damper_power
from cranktrain.dynamics.simulation import Settings, fitted_engine, simulate
from cranktrain.loads.damper import damper_parameters, damper_temperature, damper_torque, with_damper_housing
from cranktrain.structure.crank.level import crank_body
from cranktrain.structure.crank.reduction import running_body

SIX = free_six()
SPEED = 2000 * math.pi / 30
FITTED = Settings(crank="rigid", bearings="linear", damper="fitted")


def with_damper(**changes):
    return replace(SIX, damper=replace(SIX.damper, **changes))


@pytest.mark.parametrize("damper", [{}, {"law": "newtonian"}, {"law": "complex-modulus"}, {"kind": "rubber"}], ids=str)
def test_torque_twist_and_heat_are_those_of_the_law_and_turn_the_ring(damper):
    engine, h = with_damper(**damper), math.radians(0.5) / SPEED
    out = series(at_speed(SPEED, engine, rigid_crank(engine), replace(FITTED, step=math.radians(0.5))), h, 399)
    turned = rate(out["damper.twist"], h)
    law, found = damper_parameters(engine.damper, damper_temperature(engine.damper, SPEED)), np.zeros(4)
    twist, torque, heat, frame = (out[name][2:-2] for name in
                                  ("damper.twist", "damper.torque", "damper.heat", "frame.speed"))  # fmt: skip
    assert np.ptp(turned) > 0.1 and (heat >= 0.0).all()
    for k in range(0, turned.size, 20):
        damper_torque(law, twist[k], turned[k], found)
        assert torque[k] == pytest.approx(found[0], abs=1e-4 * np.abs(torque).max())
        assert heat[k] == pytest.approx(found[3], abs=1e-4 * heat.max())
    assert out["damper.temperature"] == pytest.approx(damper_temperature(engine.damper, SPEED))
    if damper in ({}, {"law": "newtonian"}):
        assert heat == pytest.approx(-torque * turned, abs=1e-3 * heat.max())
    # Nothing else turns the ring.
    ring = frame + rate(out["pulley.torsion"], h) - turned
    assert engine.damper.ring_inertia * rate(ring, h) == pytest.approx(-torque[2:-2], abs=2e-3 * np.abs(torque).max())


def elastic(engine, cutoff_hz=3000.0):
    """The coarse six's crank with what ``engine`` has on its pulley."""
    # Cut so high that what is left out answers alike, whatever the pulley weighs.
    return truncate(running_body(replace(engine, crankshaft=six()[0].crankshaft)), cutoff_hz)


def twist(engine, body, settings):
    # Long enough for the crank's own vibration to die down: it starts otherwise with and without a ring.
    result = simulate(engine, body, settings, SPEED, 8)
    # Against the flywheel: the frame goes with the crank's mean rotation, to which a ring belongs or not.
    return result.last_cycle("pulley.torsion")[1] - result.last_cycle("flywheel.torsion")[1]


LINEAR = Settings(bearings="linear")


def test_without_fluid_the_housing_alone_is_left():
    thin = with_damper(law="newtonian", viscosity=1e-6)
    housed = with_damper_housing(thin)
    body = elastic(housed)
    fitted, bare = twist(thin, body, replace(LINEAR, damper="fitted")), twist(thin, body, LINEAR)
    assert np.sqrt(np.mean((fitted - bare) ** 2)) < 1e-4 * np.std(bare)


def test_a_stuck_ring_is_a_heavier_pulley():
    # Damping of the shaft in proportion to its stiffness: the same whatever the modes, which differ with the ring.
    damping = replace(SIX.damping, kind="rayleigh", alpha=0.0, beta=1e-5)
    # In the nose's middle, where a pulley hardly tilts: its gyroscopic moment grows with its inertia, a ring has none.
    central = replace(SIX.pulley, offset=0.0)
    stuck = replace(with_damper(law="newtonian", viscosity=1e6), damping=damping, pulley=central)
    housed = with_damper_housing(stuck)
    heavier = replace(
        housed, pulley=replace(housed.pulley, polar_inertia=housed.pulley.polar_inertia + SIX.damper.ring_inertia)
    )
    # By inertia alone: gas follows the crank's mean rotation, of which a ring is a part or not (2e-3 of the torsion).
    motored = replace(LINEAR, gas_source="input")
    fitted = twist(stuck, elastic(housed, 6000.0), replace(motored, damper="fitted"))
    rigid = twist(heavier, elastic(heavier, 6000.0), motored)
    assert np.sqrt(np.mean((fitted - rigid) ** 2)) < 5e-4 * np.std(rigid)
    # The ring matters: without it the pulley swings otherwise.
    bare = twist(housed, elastic(housed), motored)
    assert np.sqrt(np.mean((bare - rigid) ** 2)) > 0.05 * np.std(rigid)


def test_the_heat_balance_settles_where_warmth_carries_the_losses_off():
    engine = six()[0]
    body = elastic(fitted_engine(engine, FITTED))
    result = simulate(engine, body, replace(LINEAR, damper="fitted"), SPEED, 3, damper_balance=True)
    damper = engine.damper
    warmth = damper.ambient_temperature + damper_power(result) / (damper.heat_transfer * damper.cooling_area)
    assert result.passes > 1
    assert result.outputs["damper.temperature"][-1] == pytest.approx(warmth, abs=0.5)
    assert damper_power(result) > 10.0


def test_too_much_heat_for_the_cooling_area_is_warned_of():
    tight = with_damper(power_limit=1e-3)
    with pytest.warns(UserWarning, match="damper.power_limit"):
        simulate(tight, rigid_crank(tight), FITTED, SPEED, 1)
    wide = with_damper(power_limit=1e9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulate(wide, rigid_crank(wide), FITTED, SPEED, 1)


def test_a_damper_hotter_than_its_law_is_refused():
    with one_line("hotter than its law is valid"):
        simulate(SIX, rigid_crank(SIX), replace(FITTED, damper_temperature=500.0), SPEED, 1)


@pytest.mark.parametrize("law", ["shear-thinning", "newtonian"])
def test_a_ring_that_slips_settles_nevertheless(law):
    """A fluid that thins carries no mean torque where its ring slips a little each cycle; another has no slip."""
    engine = replace(with_damper(law=law), reduction=replace(SIX.reduction, torsional_source="ker-wilson"))
    settings = Settings(crank="torsional", damper="fitted", integrator="esdirk4")
    housed = fitted_engine(engine, settings)
    run = simulate(engine, crank_body(housed, "torsional"), settings, 1800 * math.pi / 30, None, settle=1e-5)
    assert run.settling.repeats == 1 and run.settling.cycles <= 8
    torque, twist = (run.outputs[f"damper.{name}"] for name in ("torque", "twist"))
    assert abs(torque[1:].mean()) < 1e-5 * np.abs(torque).max()
    slip = abs(twist[-1] - twist[0]) / np.ptp(twist)
    assert slip > 1e-3 if law == "shear-thinning" else slip < 1e-5
