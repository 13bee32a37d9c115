"""Combustion: balances, closed forms, convergence, scatter and refusals."""

import math

import numpy as np
import pytest
from combustion_cycles import RPM, output, running, single, six, turn
from one_line import one_line
from scipy.integrate import quad
from scipy.optimize import brentq

from cranktrain.modules.combustion import gas as of_gas
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.burn import WIEBE, wiebe_rate
from cranktrain.modules.combustion.cycle_events import normal
from cranktrain.modules.combustion.cylinder import volume, volume_rate
from cranktrain.modules.combustion.mixture import temperature_of
from cranktrain.modules.combustion.settings import build_model
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.combustion.stepping import accept, attempt, first_rates
from cranktrain.modules.combustion.valve_flow import EVEN, built_in_lift, nozzle_flow, valve_area

CLOSED = {"intake_lift": 0.0, "exhaust_lift": 0.0, "start_cycles": 0.0, "angle_source": "speed"}
"""Valves that never open."""


def constant_gas(c_p, r):
    """Table of a gas of constant heat capacity in place of air and products, J/(kg K)."""
    row = np.zeros(of_gas.COLUMNS)
    row[[0, of_gas.RISE]], row[of_gas.H_0], row[of_gas.R_GAS] = c_p, -c_p * of_gas.REFERENCE, r
    return np.tile(row, (4, 1))


def test_mass_and_energy_balance_over_a_cycle():
    simulation = running(six())
    turn(simulation, 720)
    state, scale = simulation.of_cylinder, 1e-8
    gained = state(at.BURNT) + state(at.INTAKE) - state(at.EXHAUST)
    assert abs(state(at.MASS) - state(at.FIRST_MASS) - gained).max() < scale * state(at.INTAKE).min()
    heat = state(at.BURNT) * six().heating_value
    carried = state(at.INTAKE_ENTHALPY) - state(at.EXHAUST_ENTHALPY)
    missing = state(at.ENERGY) - state(at.FIRST_ENERGY) - heat + state(at.WALL) + state(at.WORK) - carried
    assert abs(missing).max() < scale * heat.min()
    names = ("balance.mass", "balance.energy")
    shown = [output(simulation, simulation.outputs, name) for name in names]
    assert abs(shown[0]) < scale * state(at.MASS).min() and abs(shown[1]) < scale * heat.min()


def test_energies_of_the_balance_are_those_of_pressures_and_temperatures():
    """State and outputs agree: U = m u(T, y), p V = m R T, and the work is the integral of what is shown."""
    simulation = running(single(tolerance=1e-9))
    rows = turn(simulation, 720, 0.25)
    model = build_model(single())
    mass, share = output(simulation, rows, "cylinder[1].mass"), output(simulation, rows, "cylinder[1].products")
    temperature, pressure = (output(simulation, rows, f"cylinder[1].{name}") for name in ("temperature", "pressure"))
    angles = np.radians(0.25 * np.arange(1, rows.shape[0] + 1))
    volumes = np.array([volume(model.numbers, a) for a in angles])
    r = np.array([of_gas.gas_constant(model.gas, y) for y in share])
    assert np.allclose(pressure * volumes, mass * r * temperature, rtol=1e-10)
    assert simulation.of_cylinder(at.ENERGY)[0] == pytest.approx(
        mass[-1] * of_gas.internal_energy(model.gas, share[-1], temperature[-1]), rel=1e-10
    )


def test_indicated_pressure_is_the_integral_of_p_dv():
    """Simpson's rule over the shown pressures between the corners of injection and ignition, to 1e-6."""
    simulation = running(single(tolerance=1e-9))
    turn(simulation, 360)  # to the begin of a counted cycle, in the middle of the gas exchange
    rows = turn(simulation, 720, 0.05)
    model = build_model(single())
    pressure = np.concatenate([[np.nan], output(simulation, rows, "cylinder[1].pressure")])
    pressure[0] = pressure[-1]  # the cycle repeats
    angles = -2.0 * math.pi + np.radians(0.05) * np.arange(pressure.size)
    slope = np.array([volume_rate(model.numbers, a) for a in angles])
    y = pressure * slope
    integral = np.radians(0.05) / 3.0 * (y[0] + y[-1] + 4.0 * y[1:-1:2].sum() + 2.0 * y[2:-2:2].sum())
    swept = volume(model.numbers, math.pi) - volume(model.numbers, 0.0)
    assert output(simulation, rows[-1], "indicated.pressure_mean") == pytest.approx(integral / swept, rel=1e-6)


def test_closed_adiabatic_cylinder_of_air_keeps_its_entropy():
    """∫ c_p dT/T = R ln(p₂/p₁), with the heat capacity integrated by quadrature."""
    settings = single(**CLOSED, wall_factor=0.0, tolerance=1e-10)
    simulation = running(settings, angle=math.pi, fuel_mass=0.0)
    rows = turn(simulation, 180)
    gas = of_gas.gas_table(settings.hydrogen_per_carbon)
    t2, p2 = (output(simulation, rows[-1], f"cylinder[1].{name}") for name in ("temperature", "pressure"))
    t1 = settings.intake_temperature
    rise = quad(
        lambda t: of_gas.heat_capacity(gas, 0.0, t) / t, t1, t2, points=[of_gas.MIDDLE], epsabs=0.0, epsrel=1e-12
    )[0]
    assert t2 > 850.0
    assert rise == pytest.approx(of_gas.gas_constant(gas, 0.0) * math.log(p2 / settings.intake_pressure), rel=1e-8)


def test_a_closed_charge_burns_to_its_adiabatic_flame_temperature():
    """Without wall heat U is that of before, and the heat less the work, whatever the way."""
    settings = single(**CLOSED, wall_factor=0.0, tolerance=1e-9)
    simulation = running(settings, angle=math.pi, fuel_mass=20e-6)
    before = simulation.of_cylinder(at.ENERGY)[0]
    rows = turn(simulation, 720)
    heat = simulation.of_cylinder(at.BURNT)[0] * settings.heating_value
    assert simulation.of_cylinder(at.BURNT)[0] == pytest.approx(20e-6, rel=1e-5)
    work = simulation.of_cylinder(at.WORK)[0]
    mass, share = (output(simulation, rows[-1], f"cylinder[1].{name}") for name in ("mass", "products"))
    made = 20e-6 * (1.0 + of_gas.stoichiometric_air(settings.hydrogen_per_carbon))
    assert mass * share == pytest.approx(made, rel=1e-5)  # fuel and the air that it takes
    gas = of_gas.gas_table(settings.hydrogen_per_carbon)
    flame = brentq(lambda t: mass * of_gas.internal_energy(gas, share, t) - before - heat + work, 250.0, 3000.0)
    assert output(simulation, rows[-1], "cylinder[1].temperature") == pytest.approx(flame, rel=1e-9)


def test_without_fuel_all_cylinders_are_motored():
    simulation = running(six(), fuel_mass=0.0)
    turn(simulation, 360)
    rows = turn(simulation, 720, 0.25)
    assert output(simulation, rows[-1], "heat.released") == 0.0
    assert output(simulation, rows, "cylinder[1].products").max() == 0.0
    assert output(simulation, rows[-1], "indicated.pressure_mean") < 0.0
    # heat is lost on the way up and down, so that the peak lies before dead centre
    assert -3.0 < math.degrees(output(simulation, rows[-1], "cylinder[1].peak_angle")) < 0.0


def test_a_misfire_is_one_cylinders_own():
    fired = running(six())
    misfired = running(six())
    misfired.inputs[at.FIRST_CYLINDER + 2 * at.OF_CYLINDER + at.FUEL_MASS] = 0.0
    a, b = (turn(simulation, 1440)[-1] for simulation in (fired, misfired))
    for i in range(1, 7):
        heat = output(misfired, b, f"cylinder[{i}].heat_released")
        assert heat == (0.0 if i == 3 else output(fired, a, f"cylinder[{i}].heat_released"))


def test_the_integrator_is_of_fifth_order():
    """The error of one step, over a smooth part of the compression, falls with the sixth power of its length."""
    simulation = running(single(**CLOSED), angle=3.4 * math.pi, fuel_mass=0.0, speed_rpm=1000.0)
    turn(simulation, 10)
    kept = simulation.state
    model, work, base = simulation._model, simulation._work, simulation.bases[0]

    def end(length_deg, steps):
        state = kept.copy()
        h = math.radians(length_deg) / work.now[at.NOW_SPEED] / steps
        for k in range(steps):
            first_rates(model, work, state, base, k * h)
            attempt(model, work, state, base, k * h, h)
            accept(model, work, state, base, k * h, h, state[base + at.PHI] + h * work.now[at.NOW_SPEED])
        return state[base + at.ENERGY]

    errors = [abs(end(length, 1) / end(length, 32) - 1.0) for length in (8.0, 4.0, 2.0)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[0] < 1e-5 and orders == pytest.approx([6.0, 6.0], abs=0.5)


def test_a_tighter_tolerance_brings_the_whole_cycle_closer():
    def trace(tolerance):
        simulation = running(single(tolerance=tolerance, start_cycles=2.0))
        return output(simulation, turn(simulation, 720), "cylinder[1].pressure")

    truth = trace(1e-11)
    errors = [abs(trace(tolerance) - truth).max() / truth.max() for tolerance in (1e-4, 1e-6, 1e-8)]
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2], errors
    assert errors[1] < 1e-4


def test_a_nozzle_chokes_and_stops_as_the_closed_form_says():
    area, p, t, r, gamma = 1e-4, 5e5, 400.0, 287.0, 1.4
    choked = area * p * math.sqrt(gamma / (r * t)) * (2.0 / (gamma + 1.0)) ** ((gamma + 1.0) / (2.0 * (gamma - 1.0)))
    for ratio in (0.0, 0.2, 0.528):
        assert nozzle_flow(area, p, t, r, gamma, ratio * p) == pytest.approx(choked, rel=1e-12)
    ratio = 0.8
    psi = math.sqrt(2.0 * gamma / (gamma - 1.0) * (ratio ** (2.0 / gamma) - ratio ** ((gamma + 1.0) / gamma)))
    assert nozzle_flow(area, p, t, r, gamma, ratio * p) == pytest.approx(area * p / math.sqrt(r * t) * psi, rel=1e-12)


def test_a_valves_flow_is_smooth_where_pressures_are_equal():
    def flow(ratio):
        return nozzle_flow(1e-4, 1e5, 300.0, 287.0, 1.4, ratio * 1e5)

    assert flow(1.0) == flow(1.1) == 0.0
    slopes = [(flow(1.0 - s) - flow(1.0 - 0.5 * s)) / (0.5 * s) for s in (EVEN * 1e-1, EVEN * 1e-2, EVEN * 1e-3)]
    assert slopes == pytest.approx([slopes[-1]] * 3, rel=0.1)
    edge = 1.0 - EVEN
    left, right = ((flow(edge + s) - flow(edge)) / s for s in (-1e-7, 1e-7))
    assert left == pytest.approx(right, rel=1e-3)


def test_blow_down_of_a_vessel_follows_the_closed_form():
    """A cylinder at rest empties through a choked valve: T/T₀ = (1 + (γ−1)/2 · t/τ)^−2, p by the isentrope."""
    r, gamma = 287.0, 1.4
    settings = single(start_cycles=0.0, wall_factor=0.0, lift_source="input", tolerance=1e-10, intake_pressure=20e5)
    gas = constant_gas(gamma / (gamma - 1.0) * r, r)
    simulation = running(settings, speed_rpm=0.0, gas=gas, angle=math.pi, exhaust_lift=3e-3)
    numbers = build_model(settings).numbers
    area = valve_area(3e-3, settings.exhaust_diameter, settings.exhaust_count, settings.curtain, settings.port)
    t0, v = settings.intake_temperature, volume(numbers, math.pi)
    choked = math.sqrt(gamma) * (2.0 / (gamma + 1.0)) ** ((gamma + 1.0) / (2.0 * (gamma - 1.0)))
    time = 1e-3
    for k in range(10):
        simulation.step((k + 1) * time / 10)
    factor = 1.0 + 0.5 * (gamma - 1.0) * area * choked * math.sqrt(r * t0) / v * time
    pressure = output(simulation, simulation.outputs, "cylinder[1].pressure")
    assert pressure == pytest.approx(20e5 * factor ** (-2.0 * gamma / (gamma - 1.0)), rel=1e-8)
    assert pressure > settings.exhaust_pressure / 0.5  # choked all the while


def test_gas_that_flows_back_into_the_intake_returns_first():
    """With the intake at a low pressure, burnt gas goes into its port and comes back: products stay in the cylinder."""
    settings = single(intake_opens=math.radians(-400.0))
    simulation = running(settings, intake_pressure=0.8e5, exhaust_pressure=2.0e5)
    turn(simulation, 320)
    rows = turn(simulation, 80)
    pool, heat = (simulation.of_cylinder(slot)[0] for slot in (at.POOL, at.POOL_ENTHALPY))
    share = simulation.of_cylinder(at.POOL_PRODUCTS)[0] / pool
    assert pool > 0.0 and 0.5 < share < 1.0
    assert heat / pool > of_gas.enthalpy(
        of_gas.gas_table(settings.hydrogen_per_carbon), share, 500.0
    )  # it comes back as hot
    filled = turn(simulation, 160)
    assert simulation.of_cylinder(at.POOL)[0] < 1e-2 * simulation.of_cylinder(at.MASS)[0]
    before = output(simulation, rows, "cylinder[1].products") * output(simulation, rows, "cylinder[1].mass")
    after = output(simulation, filled, "cylinder[1].products") * output(simulation, filled, "cylinder[1].mass")
    assert after[-1] > before.min()


def test_scatter_is_reproduced_by_its_seed():
    def heats(seed):
        simulation = running(six().__class__(**{**vars(six()), "scatter_fuel": 0.02, "seed": seed}))
        names = [k for k, name in enumerate(simulation.output_names) if name.endswith("heat_released")]
        return turn(simulation, 1440, 2.0)[::360, names]

    first, again, other = heats(5.0), heats(5.0), heats(6.0)
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    assert 0.005 < first[-1].std() / first[-1].mean() < 0.05 and np.ptp(first, axis=0).min() > 0.0


def test_the_scatters_numbers_are_normal():
    values = np.array([normal(3.0, i, cycle, 0) for i in range(8) for cycle in range(2500)])
    assert abs(values.mean()) < 0.03 and abs(values.std() - 1.0) < 0.03 and abs(values).max() <= 3.0
    others = np.array([normal(3.0, i, cycle, 1) for i in range(8) for cycle in range(2500)])
    assert abs(np.corrcoef(values, others)[0, 1]) < 0.03
    assert abs(np.corrcoef(values[1:], values[:-1])[0, 1]) < 0.03


def test_a_restored_state_goes_on_to_the_bit():
    simulation = running(single(scatter_fuel=0.02, scatter_timing=0.01, scatter_burn=0.05))
    for _ in range(12):  # a temperature that Newton's method sets out from may lead to the same bits by chance
        turn(simulation, 60)
        kept = simulation.state
        first = turn(simulation, 400)
        simulation.state = kept
        assert np.array_equal(first, turn(simulation, 400))


def test_received_angles_are_turned_on_by_the_speed():
    """Wrapped or not, at the begin or the end of a step: pressures are those of the crank at the end of the step."""
    speed, h = 2000.0 * RPM, 1e-4
    own = running(single(angle_source="speed"))
    begin, end = (running(single(angle_source="input", inputs_at=name)) for name in ("begin", "end"))
    place = own.output_names.index("cylinder[1].pressure")
    for k in range(700):
        own.step((k + 1) * h)
        begin.inputs[1] = (k * h * speed) % (4.0 * math.pi)
        end.inputs[1] = (k + 1) * h * speed
        begin.step((k + 1) * h)
        end.step((k + 1) * h)
        assert begin.outputs[place] == pytest.approx(own.outputs[place], rel=1e-6)
        assert end.outputs[place] == pytest.approx(own.outputs[place], rel=1e-6)
        assert begin.outputs[0] == pytest.approx(begin.inputs[1] + h * speed)
        assert end.outputs[0] == end.inputs[1]


def test_the_angle_of_a_swinging_crank_is_turned_on_to_second_order():
    """The speed tells the steady rotation only, as a cranktrain's frame does; the swing is seen in the angles."""
    speed = 2000.0 * RPM

    def angle(time):
        return speed * time + 0.01 * math.sin(6.0 * speed * time)

    def error(h):
        simulation = running(single(angle_source="input", start_cycles=0.0))
        missed = []
        for k in range(round(0.03 / h)):
            simulation.inputs[1] = angle(k * h) % (4.0 * math.pi)
            simulation.step((k + 1) * h)
            missed.append(math.remainder(simulation.outputs[0] - angle((k + 1) * h), 4.0 * math.pi))
        return max(map(abs, missed[2:]))

    errors = [error(h) for h in (4e-5, 2e-5, 1e-5)]
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([2.0, 2.0], abs=0.1)


def test_a_sliver_of_a_step_does_not_turn_the_angle_astray():
    speed = 2000.0 * RPM
    simulation = running(single(angle_source="input"))
    time = 0.0
    for h in (1e-4, 1e-12, 1e-4, 1e-13, 1e-4):
        simulation.inputs[1] = speed * time + 1e-9 * math.sin(1e9 * time)
        simulation.step(time + h)
        time += h
        assert simulation.outputs[0] == pytest.approx(speed * time, abs=1e-7)


@pytest.mark.parametrize("source", ["input", "auto"])
def test_given_lifts_drive_the_gas_exchange_as_the_built_in_ones_do(source):
    h = math.radians(0.5) / (1500.0 * RPM)
    built = running(single(lift_source="built-in"), speed_rpm=1500.0)
    given = running(single(lift_source=source, inputs_at="end"), speed_rpm=1500.0)
    s = single()
    for k in range(1440):
        angle = 0.5 * (k + 1) * math.pi / 180.0
        phi = angle if angle <= 2.0 * math.pi else angle - 4.0 * math.pi
        exhaust = max(
            built_in_lift(a, s.exhaust_opens, s.exhaust_closes, s.exhaust_lift) for a in (phi, phi + 4 * math.pi)
        )
        intake = max(built_in_lift(a, s.intake_opens, s.intake_closes, s.intake_lift) for a in (phi, phi - 4 * math.pi))
        given.inputs[at.FIRST_CYLINDER + at.LIFT_IN], given.inputs[at.FIRST_CYLINDER + at.LIFT_OUT] = intake, exhaust
        built.step((k + 1) * h)
        given.step((k + 1) * h)
        place = built.output_names.index("cylinder[1].mass")
        assert given.outputs[place] == pytest.approx(built.outputs[place], rel=5e-3)


def test_lifts_count_from_when_one_is_given():
    """As by a master whose first step has zeros: no slope is drawn from what was none."""
    open_valve = {"exhaust_lift": 8e-3}
    late, told = running(single()), running(single(lift_source="input"), **open_valve)
    place = at.FIRST_CYLINDER + at.LIFT_OUT
    for k in range(1, 4):
        if k == 2:
            late.inputs[place] = open_valve["exhaust_lift"]
        late.step(k * 1e-5)
        told.step(k * 1e-5)
        state = [run.of_cylinder(at.LAST_LIFT_OUT)[0] for run in (late, told)]
        assert state == ([0.0, 8e-3] if k == 1 else [8e-3, 8e-3])
    slopes = [run._work.now[at.SLOPE_OUT] for run in (late, told)]
    assert slopes == [0.0, 0.0] and late._work.now[at.LIFTS_GIVEN] == 1.0


def test_at_rest_gas_and_manifolds_come_to_one_pressure():
    """The stiff case: open valves, no motion. Flow that swung to and fro would bring the manifold's heat with it."""
    simulation = running(single(lift_source="input", exhaust_pressure=1.5e5), speed_rpm=0.0, exhaust_lift=8e-3)
    warm = []
    for k in range(20):
        simulation.step((k + 1) * 0.05)
        warm.append(output(simulation, simulation.outputs, "cylinder[1].temperature"))
    assert output(simulation, simulation.outputs, "cylinder[1].pressure") == pytest.approx(1.5e5, rel=1e-6)
    assert warm[-1] == pytest.approx(warm[0], rel=1e-6)


def test_wiebe_rates_integrate_to_their_shares():
    """The share that has burnt is (1 − exp(−a x^(m+1))) / (1 − exp(−a)), with x the part of the duration."""
    duration, exponent = 0.8, 0.7

    def share(angle):
        return math.expm1(-WIEBE * (angle / duration) ** (exponent + 1.0)) / math.expm1(-WIEBE)

    for angle in (0.2, 0.5, 0.8):
        integral = quad(wiebe_rate, 0.0, angle, args=(duration, exponent), epsrel=1e-10)[0]
        assert integral == pytest.approx(share(angle), rel=1e-8)
    assert quad(wiebe_rate, 0.0, duration, args=(duration, exponent))[0] == pytest.approx(1.0, rel=1e-8)


def test_gas_energy_is_continuous_and_its_temperature_the_inverse():
    model = build_model(single())
    gas = model.gas
    for share in (0.0, 0.3, 1.0):
        assert of_gas.enthalpy(gas, share, 298.15) == pytest.approx(0.0, abs=1e-3)
        below, above = (of_gas.enthalpy(gas, share, of_gas.MIDDLE + d) for d in (-1e-9, 1e-9))
        assert above - below == pytest.approx(0.0, abs=1e-3)
        for t in (250.0, 999.0, 1001.0, 2500.0, 4200.0):
            energy = of_gas.internal_energy(gas, share, t)
            assert temperature_of(model, share, 0.0, 0.0, 1.0, energy, 600.0) == pytest.approx(t, rel=1e-10)


@pytest.mark.parametrize(("changes", "said"), [
    ({"rod_length": 0.05}, "rod_length 50 mm does not exceed"),
    ({"compression_ratio": 1.0}, "compression_ratio 1 must be above 1"),
    ({"lift_source": "imput"}, "did you mean 'input'"), ({"bore": math.nan}, "bore is nan"),
])  # fmt: skip
def test_settings_that_no_engine_has_are_refused(changes, said):
    with one_line(said):
        CombustionSimulation(single(**changes))


def test_inputs_that_no_engine_has_are_refused_and_the_state_stays():
    simulation = running(single(angle_source="input"))
    simulation.inputs[1] = 0.01
    simulation.step(1e-4)
    before = simulation.state
    for place, value, words in (
        (1, 3.0, "deg off from where crank.speed has led"),
        (2, -1e5, "intake.pressure is -100000; it is absolute"),
        (6, math.nan, "cylinder[1].fuel_mass is nan"),
        (0, -1.0, "reverse running"),
    ):
        kept = simulation.inputs[place]
        simulation.inputs[place] = value
        with one_line(words):
            simulation.step(2e-4)
        simulation.inputs[place] = kept
    assert np.array_equal(simulation.state, before)
    with one_line("it must go forward"):
        simulation.step(0.0)
