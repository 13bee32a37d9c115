"""Run-up of a torsional crank in the frequency domain: both rules, one speed at a time, and a run in time."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks._forced_torsion import torsional_response
from one_line import one_line
from some import some

from cranktrain.dynamics.simulation import Settings, simulate
from cranktrain.engine.file import load_engine
from cranktrain.loads.damper import (
    complex_modulus,
    damper_parameters,
    damper_temperature,
    damping_coefficient,
    shear_layers,
    with_damper_housing,
)
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.orders.harmonics import order_amplitudes
from cranktrain.structure.crank.level import crank_body
from cranktrain.studies.torsion.damper_link import DamperLink
from cranktrain.studies.torsion.frequency_run_up import frequency_run_up

RPM = math.pi / 30.0
ORDERS = 0.5 * np.arange(1, 49)
SETTINGS = Settings(crank="torsional")


def crank(name, law=None):
    """Engine and body by a formula; with a damper of this law where one is named."""
    engine = load_engine(name)
    engine = replace(engine, reduction=replace(engine.reduction, torsional_source="ker-wilson"))
    if law is not None:
        engine = with_damper_housing(replace(engine, damper=replace(engine.damper, law=law)))
    return engine, crank_body(engine, "torsional")


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_balance_is_that_of_one_speed(name):
    """Direct coupling of the orders against GMRES in the forces: the same equations, to a ten-millionth."""
    engine, body = crank(name)
    speeds = np.array([1480.0, 2200.0]) * RPM
    found = frequency_run_up(engine, body, SETTINGS, speeds, ORDERS, "harmonic-balance").torsion
    for speed, row in some(zip(speeds, found, strict=True)):
        expected = torsional_response(engine, body, speed, highest=24.0).pulley[1:]
        assert np.abs(row - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_rules_meet_where_nothing_varies(name):
    """Light pistons, weak gas: both rules differ by the share that varies, so by its first power."""
    engine, body = crank(name)
    gas = GasTrace.from_engine(engine)
    speeds = np.linspace(1000.0, 2600.0, 9) * RPM
    differences = []
    for share in (0.02, 0.002):
        # J_r - m_r b (L - b) of the remainder vanishes with it.
        small, big = share * engine.rod.small_end_mass, engine.rod.big_end_mass
        rod = replace(engine.rod, small_end_mass=small, inertia=small * big / (small + big) * engine.rod.length**2)
        cylinders = replace(engine.cylinders, piston_mass=share * engine.cylinders.piston_mass)
        light = replace(engine, rod=rod, cylinders=cylinders)
        ambient = gas.motored.min()
        traces = (ambient + share * (trace - ambient) for trace in (gas.motored, gas.fired))
        weak = replace(gas, **dict(zip(("motored", "fired"), traces, strict=True)))
        settings = replace(SETTINGS, gravity=0.0, crankcase_pressure=ambient)
        pair = [
            frequency_run_up(light, body, settings, speeds, ORDERS, rule, weak).torsion
            for rule in ("linear", "harmonic-balance")
        ]
        differences.append(np.linalg.norm(pair[1] - pair[0]) / np.linalg.norm(pair[0]))
    assert differences[1] < 2e-3
    assert differences[0] / differences[1] == pytest.approx(10.0, rel=0.3)


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_run_up_with_damper_is_a_run_in_time(name):
    """Newtonian fluid, whose complex stiffness is one damper at all frequencies: orders up to 12 to 2e-5."""
    engine, body = crank(name, "newtonian")
    settings = replace(SETTINGS, damper="fitted", step=math.radians(1.0), integrator="esdirk4", newton_tolerance=1e-9)
    speed, cycles = 1800.0 * RPM, 16
    run = simulate(engine, body, settings, speed, cycles)
    count = (run.time.size - 1) // cycles
    orders, amplitudes = order_amplitudes(run.outputs["pulley.torsion"][-count:], 12.0)
    wobble = run.outputs["crank.angle"][-count:] - speed * run.time[-count:]
    amplitudes = amplitudes * np.exp(-1j * orders * (speed * run.time[-count] + wobble.mean()))
    found = frequency_run_up(engine, body, settings, np.array([speed]), orders, "harmonic-balance").torsion[0]
    assert np.linalg.norm(found - amplitudes) < 2e-5 * np.linalg.norm(amplitudes)


def test_damper_has_at_each_order_what_its_law_has_there():
    """Complex modulus and rubber: the pair of spring and damper of a run is right at its own frequency alone."""
    engine, _ = crank("diesel_v8", "complex-modulus")
    damper, speed = engine.damper, 1800.0 * RPM
    own = 2.0 * math.pi * damper.frequency
    omega = np.array([[0.0, 0.5 * own, own, 2.0 * own]])
    link = DamperLink(engine, SETTINGS, np.array([speed]), omega)
    temperature = damper_temperature(damper, speed)
    pair = damper_parameters(damper, temperature)
    kept = pair[0] + 1j * omega[0] * damping_coefficient(pair)
    assert link.stiffness[0, 2] == pytest.approx(kept[2], rel=1e-12)
    assert abs(link.stiffness[0, 3] / kept[3] - 1.0) > 0.1
    whole = shear_layers(damper)[0].sum() * complex_modulus(damper, temperature, 2.0 * own)
    assert link.stiffness[0, 3] == pytest.approx(whole, rel=1e-12)
    assert link.stiffness[0, 0] == 0.0


def test_fluid_that_thins_tends_to_one_that_does_not():
    """Next to no load: the shear rates vanish, and with them what the fluid loses."""
    found = []
    for law in ("newtonian", "shear-thinning"):
        engine, body = crank("diesel_v8", law)
        weak = replace(engine.damper, critical_stress=1e4 * engine.damper.critical_stress)
        settings, engine = replace(SETTINGS, damper="fitted"), replace(engine, damper=weak)
        speeds = np.array([1800.0 * RPM])
        found.append(frequency_run_up(engine, body, settings, speeds, ORDERS, "harmonic-balance").torsion)
    assert np.abs(found[1] - found[0]).max() < 1e-5 * np.abs(found[0]).max()


def test_run_up_holds_what_was_asked():
    engine, body = crank("diesel_i6")
    speeds = np.array([2200.0, 1000.0, 1600.0]) * RPM
    run_up = frequency_run_up(engine, body, SETTINGS, speeds, [3.0, 6.0, 4.5])
    np.testing.assert_allclose(run_up.speeds, np.sort(speeds))
    alone = frequency_run_up(engine, body, SETTINGS, np.array([1600.0 * RPM]), [6.0]).torsion
    assert run_up.order(6.0)[1] == pytest.approx(alone[0, 0], rel=1e-12)
    least, mean, largest = run_up.extremes["pulley.torsion"].T
    assert np.all(least < mean) and np.all(mean < largest)
    sizes = np.abs(frequency_run_up(engine, body, SETTINGS, speeds, ORDERS).torsion).sum(axis=1)
    assert np.all(largest - mean < sizes.max())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rule": "linaer"}, "did you mean 'linear'"),
        ({"speeds": np.array([1.0])}, "at least 20 rev/min"),
        ({"orders": [0.7]}, "multiples of a half"),
        ({"settings": Settings(crank="torsional", bearings="linear")}, "only twists"),
        ({"settings": Settings(crank="torsional", boundary="torque")}, "boundary speed"),
    ],
)
def test_what_it_cannot_do_is_refused(change, message):
    engine, body = crank("diesel_i6")
    asked = {"settings": SETTINGS, "speeds": np.array([200.0]), "orders": [6.0], "rule": "linear"} | change
    with one_line(message):
        frequency_run_up(engine, body, asked["settings"], asked["speeds"], asked["orders"], asked["rule"])
