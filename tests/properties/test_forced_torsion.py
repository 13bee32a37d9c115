"""Forced torsion in time against another solver, in the frequency domain, with and without each kind of damper."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks._forced_torsion import Ring, forced_torsion, order_peak
from bodies import six

from cranktrain.core.units import RPM
from cranktrain.dynamics.simulation import Settings, simulate
from cranktrain.engine.file import load_engine
from cranktrain.loads.damper import damper_parameters, damper_temperature, with_damper_housing
from cranktrain.structure.crank.modal import cranktrain_modes, torsional_frequencies
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft, running_body

WARM = 273.15 + 80.0
ORDERS = [1.5, 3.0, 4.5, 6.0, 7.5, 9.0]


def ring_of(damper, temperature=WARM):
    return Ring(damper_parameters(damper, temperature), damper.ring_inertia)


@pytest.mark.parametrize("rpm", [1600.0, 2380.0])
def test_the_six_against_a_run_in_time(rpm):
    """Orders of torsion agree to a per cent: a wound-up crank and second orders of torsion are in the run alone."""
    engine, body = six()
    found = forced_torsion(engine, body, rpm * RPM)
    run = simulate(engine, body, Settings(bearings="linear", step=math.radians(1.0), gravity=0.0), rpm * RPM, 12)
    signal = run.outputs["pulley.torsion"][-1 - run.per_cycle : -1]
    spectrum = 2.0 / signal.size * np.fft.rfft(signal)
    largest = max(abs(spectrum[round(2 * order)]) for order in ORDERS)
    for order in ORDERS:
        here = spectrum[round(2 * order)]
        assert found.pulley[round(2 * order)] == pytest.approx(here, rel=0.01, abs=1e-3 * largest), order


SLOW_LAWS = [pytest.param(law, marks=pytest.mark.slow) for law in ("shear-thinning", "complex-modulus", "rubber")]


@pytest.mark.parametrize("law", ["newtonian", *SLOW_LAWS])
def test_the_six_with_each_damper_against_a_run_in_time(law):
    """Near the damped resonance of order 6: amplitude within 0.1 %, its square the power 0.2 %, largest torque 1 %."""
    engine, _ = six()
    kind = {"kind": "rubber"} if law == "rubber" else {"law": law}
    housed = with_damper_housing(replace(engine, damper=replace(engine.damper, **kind)))
    body, damper, speed = running_body(housed), housed.damper, 2000.0 * RPM
    found = forced_torsion(housed, body, speed, ring_of(damper, damper_temperature(damper, speed)))
    settings = Settings(bearings="linear", step=math.radians(1.0), gravity=0.0, damper="fitted")
    run = simulate(housed, body, settings, speed, 12)
    last = slice(-1 - run.per_cycle, -1)
    amplitude = 2.0 / run.per_cycle * abs(np.fft.rfft(run.outputs["pulley.torsion"][last])[12])
    assert found.amplitude(6.0) == pytest.approx(amplitude, rel=1e-3)
    assert found.power == pytest.approx(run.outputs["damper.heat"][last].mean(), rel=2e-3)
    assert found.torque == pytest.approx(np.abs(run.outputs["damper.torque"][last]).max(), rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize("order", [8.0, 12.0])
def test_the_v8s_orders_fall_as_the_frequency_domain_predicts(order):
    """Where order 8 or 12 meets the torsional resonance without damper: the ratio of amplitudes within 3 %."""
    engine = load_engine("diesel_v8")
    bare, housed = reduced_crankshaft(engine), with_damper_housing(engine)
    bodies = running_body(engine, bare), running_body(housed, bare)
    torsional = torsional_frequencies(*cranktrain_modes(engine, complete_crankshaft(engine, bare)))[0]
    middle = 2.0 * math.pi * torsional / order
    speed = order_peak(engine, bodies[0], order, (0.9 * middle, 1.1 * middle)).speed
    ring = ring_of(housed.damper, damper_temperature(housed.damper, speed))
    predicted = [forced_torsion(engine, bodies[0], speed), forced_torsion(housed, bodies[1], speed, ring)]
    run = []
    for which, body, damper in ((engine, bodies[0], "none"), (housed, bodies[1], "fitted")):
        result = simulate(which, body, Settings(bearings="linear", step=math.radians(1.0), damper=damper), speed, 14)
        signal = result.outputs["pulley.torsion"][-1 - result.per_cycle : -1]
        run.append(2.0 / signal.size * abs(np.fft.rfft(signal)[round(2.0 * order)]))
    ratio = predicted[1].amplitude(order) / predicted[0].amplitude(order)
    assert ratio < 0.5 and run[1] / run[0] == pytest.approx(ratio, rel=0.03)
