"""Speeds of the crank: its own is the rate of its angle and pays for work done; brake torque is what losses leave."""

import math
from dataclasses import replace

import numpy as np
import pytest
from bodies import rigid_crank
from started import rate
from test_load_torque import CRANK_INERTIA, SIX, rods_inertia

import cranktrain as ct
from cranktrain.dynamics.simulation import Settings, simulate

SPEED = 2000 * math.pi / 30


@pytest.fixture(scope="module")
def rigid():
    """The six's rigid crank on springs without friction, on an undamped shaft, settled; a point each degree."""
    engine = replace(SIX, drive_line=replace(SIX.drive_line, damping=0.0))
    settings = Settings(crank="rigid", bearings="linear", step=math.radians(1.0), gravity=0.0)
    return simulate(engine, rigid_crank(engine), settings, SPEED, 30)


def last(run, *names):
    return [run.outputs[name][-run.per_cycle - 1 :] for name in names]


def test_crank_speed_is_the_rate_of_crank_angle(rigid):
    angle, speed, frame = last(rigid, "crank.angle", "crank.speed", "frame.speed")
    np.testing.assert_allclose(speed[2:-2], rate(angle, rigid.step), atol=2e-4 * np.ptp(speed))
    assert np.ptp(frame) < 0.02 * np.ptp(speed)
    torsion, flywheel = last(rigid, "flywheel.torsion", "flywheel.speed")
    turned = rate(torsion, rigid.step)
    np.testing.assert_allclose(flywheel[2:-2] - frame[2:-2], turned, atol=2e-4 * np.ptp(speed))


def test_irregularity_is_that_of_the_kinetic_energy(rigid):
    """½ J(θ) ω² gains what gas does and shaft takes; ω from this work alone swings as much as crank.speed does."""
    angle, speed, gas, shaft, frame = last(
        rigid, "crank.angle", "crank.speed", "torque.indicated", "shaft.torque", "frame.speed"
    )
    power = gas * frame - shaft * speed
    work = np.concatenate(([0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * rigid.step)))
    inertia = CRANK_INERTIA + rods_inertia(SIX, angle)
    own = np.sqrt((inertia[0] * speed[0] ** 2 + 2.0 * work) / inertia)
    irregularity = np.ptp(own) / own[1:].mean()
    assert irregularity == pytest.approx(np.ptp(speed) / SPEED, rel=1e-2)
    assert rigid.outputs["crank.irregularity"][-1] == pytest.approx(irregularity, rel=1e-2)
    assert rigid.outputs["crank.irregularity"][rigid.per_cycle // 2] == 0.0  # no full cycle yet


@pytest.mark.parametrize(("engine", "choices"), [
    ("diesel_i6", {"crank": "torsional", "bearings": "impedance", "damper": True}),
    ("single_petrol", {"crank": "rigid", "bearings": "impedance"}),
    ("four_petrol", {"crank": "torsional", "bearings": "impedance"}),
])  # fmt: skip
def test_brake_torque_is_on_average_the_shaft_s(engine, choices):
    """Means of powers, less films' squeeze, structure, damper and drive line, differ by the stored energy alone."""
    run = ct.simulate(engine, speed_rpm=2000, settle=1e-3, **choices)
    energy = run.summary()["energy"]
    power, shaft, indicated, frame = last(run, "torque.brake", "shaft.torque", "torque.indicated", "frame.speed")
    if "connection[line[1]].torque" in run.outputs:
        shaft = shaft - last(run, "connection[line[1]].torque")[0]
    brake, shaft = float((power * frame)[1:].mean()) / SPEED, float(shaft[1:].mean())
    indicated = float(indicated[1:].mean())
    missing = abs(energy["stored_j"]) + abs(energy["residual_j"])
    assert abs(brake - shaft) * 4.0 * math.pi < missing + 2e-4 * energy["gas_work_j"]
    assert indicated > brake
    speeds = run.summary()["speeds"]
    assert list(speeds) == ["crank", "flywheel", "pulley"]
    assert speeds["crank"]["mean_rpm"] == pytest.approx(2000.0, rel=1e-4)
    swing = last(run, "flywheel.speed")[0]
    assert speeds["flywheel"]["irregularity"] == pytest.approx(np.ptp(swing) / swing[1:].mean(), rel=1e-12)
