"""Forced torsion in the frequency domain: closed forms, limits of the ring, a run in time, a law that is not linear."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks._forced_torsion import PeriodicResponse, Ring, balanced_ring, forced_torsion, order_peak
from bodies import six
from scipy.integrate import solve_ivp

from cranktrain.dynamics.simulation import Settings, simulate
from cranktrain.engine.file import load_engine
from cranktrain.loads.damper import (
    damper_parameters,
    damper_temperature,
    damper_torque,
    equivalent_damping,
    with_damper_housing,
)
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.crank.modal import cranktrain_modes, torsional_frequencies
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft, running_body

RPM = math.pi / 30.0
WARM = 273.15 + 80.0
ORDERS = [1.5, 3.0, 4.5, 6.0, 7.5, 9.0]


class Hub:
    """A hub on a spring, driven by a torque of several orders of ``base`` rad/s: the structure of two masses."""

    def __init__(self, inertia, stiffness, damping, torque, base, samples=256):
        self.omega = base * np.arange(len(torque), dtype=float)
        self.samples = samples
        self.inertia, self.stiffness, self.damping, self.torque = inertia, stiffness, damping, np.array(torque, complex)

    def response(self, row, added, torque):
        own = self.stiffness + 1j * self.omega * self.damping - self.omega**2 * self.inertia
        return (self.torque + torque) / (own + added)

    def spectrum(self, signal):
        result = 2.0 / self.samples * np.fft.rfft(signal)[: self.omega.size]
        result[0] *= 0.5
        return result

    def signal(self, spectrum):
        whole = np.zeros(self.samples // 2 + 1, complex)
        whole[: self.omega.size] = 0.5 * self.samples * spectrum
        whole[0] *= 2.0
        return np.fft.irfft(whole, self.samples)


def ring_of(damper, temperature=WARM):
    return Ring(damper_parameters(damper, temperature), damper.ring_inertia)


@pytest.mark.parametrize("law", ["newtonian", "complex-modulus"])
def test_two_masses_in_closed_form(law):
    """Hub and ring by Cramer's rule, at one order."""
    damper = replace(six()[0].damper, law=law)
    ring = ring_of(damper)
    hub = Hub(0.2, 4e5, 3.0, [0.0, 800.0], 1300.0)
    found = balanced_ring(hub, np.ones(1), ring)
    w = hub.omega[1]
    link = ring.parameters[0] + 1j * w * ring.parameters[1]
    own = hub.stiffness + 1j * w * hub.damping - w**2 * hub.inertia
    matrix = np.array([[own + link, -link], [-link, link - w**2 * ring.inertia]])
    angles = np.linalg.solve(matrix, [800.0, 0.0])
    assert found.pulley[1] == pytest.approx(angles[0], rel=1e-9)
    rate = abs(w * (angles[0] - angles[1]))
    assert found.damping == pytest.approx(ring.parameters[1], rel=1e-9)
    assert found.power == pytest.approx(0.5 * ring.parameters[1] * rate**2, rel=1e-9)
    assert found.torque == pytest.approx(abs(link) * rate / w, rel=1e-3)  # of samples


def test_power_in_is_power_out():
    damper = six()[0].damper
    hub = Hub(0.2, 4e5, 3.0, [0.0, 300.0, 500.0j, 200.0, 0, 0, 0, 0, 0, 0, 0, 0], 650.0)
    found = balanced_ring(hub, np.ones(1), ring_of(damper))
    rate = 1j * hub.omega * found.pulley
    given = 0.5 * np.real(hub.torque * rate.conj()).sum()
    assert given == pytest.approx(0.5 * hub.damping * (np.abs(rate) ** 2).sum() + found.power, rel=1e-6)


@pytest.mark.parametrize(("count", "tolerance"), [(24, 2e-4), (48, 1e-5)])
def test_a_law_that_is_not_linear_against_time_integration(count, tolerance):
    """Shear far above its critical rate, three orders at once: a run to the steady state, the nearer the more orders.

    The torque is then nearly a power of the rate, with a corner at each reversal: its orders fall slowly. The ring's
    mean slip, which no order shows, is part of the balance.
    """
    ring = ring_of(six()[0].damper)
    torque = np.zeros(count, complex)
    torque[1:4] = 1500.0, 2500.0j, 800.0
    base = 650.0
    hub = Hub(0.2, 4e5, 3.0, torque, base, samples=512)
    found = balanced_ring(hub, np.ones(1), ring)
    assert found.damping < 0.5 * equivalent_damping(ring.parameters, 1e-6)
    out = np.zeros(4)

    def slope(t, y):
        damper_torque(ring.parameters, y[0] - y[2], y[1] - y[3], out)
        drive = np.real(torque * np.exp(1j * hub.omega * t)).sum()
        return [y[1], (drive + out[0] - hub.damping * y[1] - hub.stiffness * y[0]) / hub.inertia, y[3],
                -out[0] / ring.inertia]  # fmt: skip

    period = 2.0 * math.pi / base
    times = (40.0 + np.arange(256) / 256.0) * period
    run = solve_ivp(slope, (0.0, times[-1]), np.zeros(4), "DOP853", times, rtol=1e-10, atol=1e-13)
    spectrum = 2.0 / 256.0 * np.fft.rfft(run.y[0])
    assert found.pulley[1:20] == pytest.approx(spectrum[1:20], abs=tolerance * np.abs(found.pulley).max())


def test_one_order_is_nearly_the_describing_function():
    """With one order the linear damper of equal dissipation is the one of the describing function, up to harmonics."""
    ring = ring_of(six()[0].damper)
    torque = np.zeros(16, complex)
    torque[1] = 2500.0
    hub = Hub(0.2, 4e5, 3.0, torque, 1300.0)
    found = balanced_ring(hub, np.ones(1), ring)
    w = hub.omega[1]
    twist = found.pulley[1] * -(w**2) * ring.inertia / (1j * w * found.damping - w**2 * ring.inertia)
    assert found.damping == pytest.approx(equivalent_damping(ring.parameters, abs(w * twist)), rel=0.01)


@pytest.mark.slow
def test_ring_let_go_and_ring_held():
    """No viscosity: as without ring. All viscosity: as with its inertia on the pulley. In between it damps."""
    engine, _ = six()
    housed = with_damper_housing(engine)
    body = running_body(housed)
    damper = replace(housed.damper, law="newtonian")
    speed = 2000.0 * RPM
    free = forced_torsion(housed, body, speed)
    crank = PeriodicResponse(housed, body, speed, GasTrace.from_engine(housed), 1.0, 24.0)
    inertia = -(crank.omega**2) * damper.ring_inertia + 0.0j
    held = crank.response(body.shapes[body.index("pulley"), 5], inertia, 0.0j * inertia)
    thin = forced_torsion(housed, body, speed, ring_of(replace(damper, viscosity=1e-7 * damper.viscosity)))
    thick = forced_torsion(housed, body, speed, ring_of(replace(damper, viscosity=1e7 * damper.viscosity)))
    size = np.abs(free.pulley[1:]).max()
    assert thin.pulley[1:] == pytest.approx(free.pulley[1:], abs=1e-5 * size)
    assert thick.pulley[1:] == pytest.approx(held[1:], abs=1e-5 * size)
    assert thin.power < 1.0 and thick.power < 1.0
    assert forced_torsion(housed, body, speed, ring_of(damper)).power > 100.0


@pytest.mark.parametrize("rpm", [1600.0, 2380.0])
def test_the_six_against_a_run_in_time(rpm):
    """Two independent ways to the steady state: orders of the pulley's torsion agree to a per cent.

    They differ by what is not linear in the run (the moment of forces on a wound-up crank, second orders of torsion),
    by 0.2 % at most in the large orders; small ones carry what larger ones spill.
    """
    engine, body = six()
    found = forced_torsion(engine, body, rpm * RPM)
    run = simulate(engine, body, Settings(bearings="linear", step=math.radians(1.0), gravity=0.0), rpm * RPM, 12)
    signal = run.outputs["pulley.torsion"][-1 - run.per_cycle : -1]
    spectrum = 2.0 / signal.size * np.fft.rfft(signal)
    largest = max(abs(spectrum[round(2 * order)]) for order in ORDERS)
    for order in ORDERS:
        here = spectrum[round(2 * order)]
        assert found.pulley[round(2 * order)] == pytest.approx(here, rel=0.01, abs=1e-3 * largest), order


def test_orders_alone_miss_the_resonance_that_coupled_orders_find():
    """Rods whose inertia varies couple the orders: near the resonance of order 6 that is no small correction."""
    engine, body = six()
    speed = 2400.0 * RPM
    alone = forced_torsion(engine, body, speed, coupled=False).amplitude(6.0)
    together = forced_torsion(engine, body, speed).amplitude(6.0)
    assert abs(alone / together - 1.0) > 0.2


def test_without_what_varies_coupling_changes_nothing():
    engine, body = six()
    gas = GasTrace.from_engine(engine)
    cranks = [PeriodicResponse(engine, body, 200.0, gas, 1.0, 12.0) for _ in range(2)]
    cranks[0].coupled = False
    for crank in cranks:
        crank._varying = tuple(np.zeros_like(part) for part in crank._varying)
    hub, nothing = body.shapes[body.index("pulley"), 5], np.zeros(25, complex)
    alone, together = (crank.response(hub, nothing, nothing) for crank in cranks)
    assert together == pytest.approx(alone, rel=1e-8, abs=1e-12)


def test_more_orders_change_little():
    engine, body = six()
    few, many = (forced_torsion(engine, body, 2380.0 * RPM, highest=highest) for highest in (16.0, 32.0))
    assert few.pulley[1:19] == pytest.approx(many.pulley[1:19], abs=2e-4 * np.abs(many.pulley[1:]).max())


SLOW_LAWS = [pytest.param(law, marks=pytest.mark.slow) for law in ("shear-thinning", "complex-modulus", "rubber")]


@pytest.mark.parametrize("law", ["newtonian", *SLOW_LAWS])
def test_the_six_with_each_damper_against_a_run_in_time(law):
    """Near the damped resonance of order 6: amplitude within 0.1 %, largest torque within 1 %.

    The dissipated power goes with the amplitude's square: within 0.2 %.
    """
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
    assert ratio < 0.5
    assert run[1] / run[0] == pytest.approx(ratio, rel=0.03)
