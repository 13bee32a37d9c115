"""Free forces and couples of six and V8 as their mounts feel them, against the closed forms of their layouts.

Values: tests/data/slider_crank.json, id ``balance``. Rigid engines without gas and weight run in bearings, pistons and
mounts so stiff that what reaches the mounts is what the rods leave; the crank is balanced by itself, and so heavy in
its turning that its speed stays even. Static: the mounts hold the mean torque of the shaft.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from bodies import rigid_crank
from expected import cases
from standing import rigid_block
from started import at_speed, shown

from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.simulation import Parts, Settings, simulate
from cranktrain.engine.file import load_engine

EXPECTED = cases("slider_crank")["balance"]["expected"]
SPEED = 2000 * math.pi / 30
PITCH = 0.128
SIX, EIGHT = load_engine("diesel_i6"), load_engine("diesel_v8")


def held(engine):
    """Engine with everything stiff that lies between rods and mounts, without friction."""
    six = SIX.mounts
    count = len(six.x)
    stiff = {f"stiffness_{axis}": (1e11,) * count for axis in "xyz"}
    mounts = replace(six, z=(0.0, 0.0, 0.5, 0.5), **stiff, **{f"damping_{axis}": (1e7,) * count for axis in "xyz"})
    guidance = replace(SIX.piston_guidance, upper_stiffness=1e10, lower_stiffness=1e10, upper_damping=1e5,
                       lower_damping=1e5, friction=0.0)  # fmt: skip
    stiff = replace(engine, mounts=mounts, piston_guidance=guidance, block=SIX.block)
    if engine.main_bearing is not None:
        springs = {"stiffness_x": 1e11, "stiffness_y": 1e11, "damping_x": 3e7, "damping_y": 3e7}
        return replace(stiff, main_bearing=replace(engine.main_bearing.in_rigid_bores, **springs))
    rollers = engine.main_roller
    count = len(rollers.stiffness)
    return replace(stiff, main_roller=replace(rollers, stiffness=(1e11,) * count, damping=(3e7,) * count))


def on_the_mounts(engine):
    """Force (n, 3) of the engine on its mounts over a cycle, and its moment about the middle of the pins."""
    engine = held(engine)
    crank = rigid_crank(engine, inertia=(60.0, 60.0, 100.0), pitch=PITCH)
    block = rigid_block(engine, crank)
    # Springs of 1e11 N/m make forces of what Newton's iteration usually leaves.
    settings = Settings(
        crank="rigid", bearings="linear", block="flexible", gas_source="input", gravity=0.0, newton_tolerance=1e-9
    )
    simulation = at_speed(SPEED, engine, crank, settings, parts=Parts(block=block))
    h = communication_step(SPEED, settings.step)
    count = round(4 * math.pi / SPEED / h)
    middle = np.array([0.0, 0.0, 0.5 * PITCH * len(engine.crankshaft.throw_angles)])
    force, moment = np.zeros((count, 3)), np.zeros((count, 3))
    for k in range(-count, count):
        simulation.step(simulation.time + h)
        if k < 0:
            continue
        out = shown(simulation)
        for i, place in enumerate(engine.mounts.positions):
            f, m = (np.array([out[f"mount[{i + 1}].{part}.{axis}"] for axis in "xyz"]) for part in ("force", "moment"))
            force[k] -= f
            moment[k] -= m + np.cross(np.array(place) - middle, f)
    return force, moment


def order(signal, k):
    """Complex amplitude of the crank's order k (per revolution) of a cycle (n, 3)."""
    return np.fft.rfft(signal, axis=0)[2 * k] * 2 / len(signal)


def masses(engine):
    rod = engine.rod
    return rod.big_end_mass, rod.small_end_mass + engine.cylinders.piston_mass


def test_six_runs_free_of_first_and_second_order():
    assert EXPECTED["I6"] == "1st,2nd force and moment = 0"
    force, moment = on_the_mounts(SIX)
    m_b, m_o = masses(SIX)
    unit = (m_b + m_o) * SIX.crankshaft.throw * SPEED**2
    for k in (1, 2):
        assert np.abs(order(force, k)).max() < 1e-4 * unit
        assert np.abs(order(moment, k)).max() < 1e-4 * unit * PITCH
    # What does not cancel is seen: six pistons of order six, from the height of one.
    angle = 2 * np.pi * np.arange(256) / 256
    height = np.sqrt(SIX.rod.length**2 - (SIX.crankshaft.throw * np.sin(angle)) ** 2)
    sixth = 6 * m_o * (6 * SPEED) ** 2 * np.abs(np.fft.rfft(height)[6]) * 2 / 256
    assert np.abs(order(force, 6))[1] == pytest.approx(sixth, rel=1e-2)


def test_cross_plane_v8_feels_its_rotating_couple():
    assert "sqrt(10)" in EXPECTED["V8_crossplane"]
    force, moment = on_the_mounts(EIGHT)
    m_b, m_o = masses(EIGHT)
    unit = (m_b + m_o) * EIGHT.crankshaft.throw * SPEED**2
    for k in (1, 2):
        assert np.abs(order(force, k)).max() < 1e-4 * unit
    assert np.abs(order(moment, 2)).max() < 3e-4 * unit * PITCH
    # Two rods on each pin; the pistons of two banks at right angles leave what one on the pin would.
    couple = math.sqrt(10.0) * (2 * m_b + m_o) * EIGHT.crankshaft.throw * SPEED**2 * PITCH
    first = order(moment, 1)
    assert np.abs(first[:2]) == pytest.approx([couple, couple], rel=1e-3)
    # It turns with the crank: a quarter between the axes, always as large.
    assert first[1] / first[0] == pytest.approx(-1j, abs=1e-3)


@pytest.mark.parametrize("offset", [0.0, 0.001])
def test_mounts_hold_the_mean_torque(offset):
    names = [f"damping_{axis}" for axis in ("x", "y", "z")]
    mounts = replace(SIX.mounts, **{name: tuple(10 * c for c in getattr(SIX.mounts, name)) for name in names})
    engine = replace(SIX, mounts=mounts, cylinders=replace(SIX.cylinders, pin_offset=offset))
    crank = rigid_crank(engine)
    block = rigid_block(engine, crank)
    run = simulate(engine, crank, Settings(crank="rigid", block="flexible"), SPEED, 16, parts=Parts(block=block))
    mean = {name: values[-run.per_cycle :].mean() for name, values in run.outputs.items()}
    moment = 0.0
    for i, (x, y, _) in enumerate(mounts.positions):
        name = f"mount[{i + 1}]"
        moment += mean[f"{name}.moment.z"] + x * mean[f"{name}.force.y"] - y * mean[f"{name}.force.x"]
    moment -= block.mass * 9.80665 * block.centre[0]
    # Crank and pistons hang a little beside the axis at rest as the engine leans.
    assert moment == pytest.approx(mean["shaft.torque"], rel=3e-3)
    # The engine leans against the crank's turning, about the middle of mounts that are all alike and equally high.
    stiffness = sum(x * x * ky + k for x, ky, k in zip(mounts.x, mounts.stiffness_y, mounts.stiffness_rz, strict=True))
    assert mean["engine.rotation.z"] == pytest.approx(-mean["shaft.torque"] / stiffness, rel=3e-3)
