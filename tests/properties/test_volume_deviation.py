"""Combustion in cylinders whose pistons follow a crank that twists: volumes deviate from those of rigid parts."""

import math

import numpy as np
import pytest
from combustion_cycles import RPM, output, running, single, six, turn

from cranktrain.core.errors import InputError
from cranktrain.modules.combustion.volume_deviation import extrapolated

SPEED = 2000.0 * RPM
S = six()
AREA, R, L = 0.25 * math.pi * S.bore**2, 0.5 * S.stroke, S.rod_length
SWEPT = AREA * S.stroke
TWIST, ORDER, PHASE = 4e-3, 4.0, 0.7
"""Twist of a pin, rad, its order and phase."""


def rigid_volume(phi):
    """m³ at a crank angle after dead centre, of a piston without offset."""
    x = R * np.cos(phi) + np.sqrt(L**2 - (R * np.sin(phi)) ** 2)
    return AREA * (L + R - x) + SWEPT / (S.compression_ratio - 1.0)


def deviation(theta):
    """m³ of a cylinder whose pin is ahead by a swinging twist."""
    return rigid_volume(theta + TWIST * np.cos(ORDER * theta + PHASE)) - rigid_volume(theta)


def twisted(degrees, step_deg=1.0, at="begin", **changes):
    """Rows of one cylinder whose pin twists, from 150 degrees before its dead centre on, with their crank angles."""
    begin = -math.radians(150.0)
    simulation = running(single(inputs_at=at, angle_source="input", **changes), angle=begin)
    place = {name: k for k, name in enumerate(simulation.input_names)}
    h, e = math.radians(step_deg), 1e-5
    angles, rows = [begin + (k + 1) * h for k in range(round(degrees / step_deg))], []
    for end in angles:
        at_angle = end if at == "end" else end - h
        simulation.inputs[1] = at_angle
        simulation.inputs[place["cylinder[1].volume_deviation"]] = deviation(at_angle)
        rate = SPEED * (deviation(at_angle + e) - deviation(at_angle - e)) / (2.0 * e)
        simulation.inputs[place["cylinder[1].volume_deviation_rate"]] = rate
        simulation.step((end - begin) / SPEED)
        rows.append(simulation.outputs.copy())
    return simulation, np.array(angles), np.array(rows)


@pytest.mark.parametrize("at", ["begin", "end"])
def test_a_sealed_adiabatic_charge_is_compressed_in_its_own_volume(at):
    """Without valves, walls and fuel, p Vᵏ of the volume that the pin leaves; of the crank's angle it is not."""
    shut = {"intake_lift": 0.0, "exhaust_lift": 0.0, "wall_factor": 0.0, "fuel_mass": 0.0, "start_cycles": 0.0}
    simulation, angles, rows = twisted(300.0, at=at, **shut)
    pressure, temperature = (output(simulation, rows, f"cylinder[1].{name}") for name in ("pressure", "temperature"))
    mass = output(simulation, rows, "cylinder[1].mass")
    volume = rigid_volume(angles) + deviation(angles)
    held = pressure * volume / (mass * temperature)
    np.testing.assert_allclose(held[5:], held[-1], rtol=2e-6)
    rigid = pressure * rigid_volume(angles) / (mass * temperature)
    assert np.ptp(rigid) > 1e-3 * held[-1]


def test_work_is_the_integral_of_p_dv_over_the_own_volume_and_torque_its_rate():
    simulation, angles, rows = twisted(900.0, step_deg=0.5)
    names = "cylinder[1].pressure", "gas.work", "indicated.torque"
    pressure, work, torque = (output(simulation, rows, name) for name in names)
    volume = rigid_volume(angles) + deviation(angles)
    cycle = slice(len(rows) - 1441, len(rows))
    own = np.trapezoid(pressure[cycle] - S.crankcase_pressure, volume[cycle])
    assert work[-1] - work[-1441] == pytest.approx(own, rel=5e-5)
    balance = output(simulation, rows[-1], "balance.energy")
    assert abs(balance) < 1e-9 * output(simulation, rows[-1], "heat.released")
    before, after = (rigid_volume(at) + deviation(at) for at in (angles - 1e-5, angles + 1e-5))
    own = (pressure - S.crankcase_pressure) * (after - before) / 2e-5
    np.testing.assert_allclose(torque[10:], own[10:], atol=1e-4 * np.abs(own).max())


@pytest.mark.parametrize(("step_deg", "most"), [(0.5, 2e-6), (1.0, 3e-5), (3.0, 3e-3)])
def test_a_deviation_is_foreseen_to_fourth_order(step_deg, most):
    simulation, angles, rows = twisted(720.0, step_deg=step_deg)
    taken = output(simulation, rows, "cylinder[1].deviation_taken")
    off = np.abs(taken - deviation(angles))[4:].max() / np.abs(deviation(angles)).max()
    assert off < most


def test_a_cubic_is_extrapolated_exactly_and_a_first_step_goes_along_a_line():
    cubic = np.polynomial.Polynomial([2.0, 3.0, -1.0, 0.5])
    rate = cubic.deriv()
    found = extrapolated(cubic(-0.7), rate(-0.7), cubic(0.0), rate(0.0), 0.7, 1.1)
    assert found == pytest.approx((cubic(1.1), rate(1.1)), rel=1e-12)
    assert extrapolated(9.0, 9.0, 2.0, 3.0, 0.0, 1.1) == pytest.approx((2.0 + 3.3, 3.0))


def test_long_steps_hold_the_deviation():
    """The start runs whole cycles in one step: nothing is extrapolated over them."""
    simulation = running(single(angle_source="speed"), volume_deviation=1e-6, volume_deviation_rate=1e-3)
    assert output(simulation, simulation.outputs, "cylinder[1].deviation_taken") == 1e-6
    simulation.step(math.radians(60.0) / SPEED)
    assert output(simulation, simulation.outputs, "cylinder[1].deviation_taken") == 1e-6


def test_a_restored_state_goes_on_to_the_bit_with_deviations():
    simulation, _, _ = twisted(200.0)
    state = simulation.state
    first = turn(simulation, 30.0)
    simulation.state = state
    np.testing.assert_array_equal(turn(simulation, 30.0), first)


def test_a_deviation_beyond_the_clearance_volume_is_refused():
    simulation = running(single())
    place = simulation.input_names.index("cylinder[1].volume_deviation")
    simulation.inputs[place] = 1.01 * SWEPT / (S.compression_ratio - 1.0)
    before = simulation.state
    with pytest.raises(InputError, match=r"cylinder\[1\]\.volume_deviation is .* m3, more than the clearance volume"):
        simulation.step(1e-5)
    np.testing.assert_array_equal(simulation.state, before)
