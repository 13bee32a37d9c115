"""Valve train: limits, balances, convergence, loss of contact and rattle, orders, starts, states and refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest
from valve_trains import CYCLE, FREE, RIGID, RPM, output, running, single, six, turn

from cranktrain.modules.combustion.file import load as load_combustion
from cranktrain.modules.combustion.valve_flow import built_in_lift
from cranktrain.modules.register import module_files
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.cam import cam_lift, wrapped
from cranktrain.modules.valve_train.file import load
from cranktrain.modules.valve_train.settings import build_model, cam_of, make_work, smallest_radius
from cranktrain.modules.valve_train.stepping import attempt, keep_step
from cranktrain.results.orders.harmonics import order_amplitudes


@pytest.mark.parametrize("power", [5.0, 7.0, 9.5])
def test_a_cam_is_three_times_continuously_differentiable(power):
    """Slope and curvature are the lift's derivatives; lift, slope, curvature and its derivative have no jump."""
    cam = cam_of(replace(six(), power=power), "intake")
    half, ramp = cam[at.HALF], cam[at.RAMP]
    angles = np.linspace(-half - 1.1 * ramp, half + 1.1 * ramp, 20001)
    lift, slope, curve = np.array([cam_lift(cam, psi) for psi in angles]).T
    h = angles[1] - angles[0]
    assert np.abs(np.gradient(lift, h) - slope)[1:-1].max() < 1e-6 * np.abs(slope).max()
    assert np.abs(np.gradient(slope, h) - curve)[1:-1].max() < 1e-4 * np.abs(curve).max()
    third, e = np.ptp(np.gradient(curve, h)), 1e-6
    for corner in (0.0, half, half + 0.5 * ramp, half + ramp):
        for sign in (-1.0, 1.0):
            a, b, c, d = (np.array(cam_lift(cam, sign * corner + k * e)) for k in (-2, -1, 1, 2))
            assert (c - b) / (2.0 * e) == pytest.approx((d - a) / (4.0 * e), rel=1e-3, abs=1e-4 * third), corner
            assert abs((d - c)[2] - (b - a)[2]) / e < 1e-3 * third, corner
    assert np.all(slope[angles < 0.0] >= 0.0) and lift.max() == pytest.approx(cam[at.LIFT], rel=1e-12)


@pytest.mark.parametrize("engine", ["i6", "v8"])
def test_lifts_agree_with_the_combustion_modules_table(engine):
    """Same ends and lift, area within 2 %, nowhere more than 5 % of the lift apart; ramps take up the lash."""
    train = load(module_files()[f"valvetrain_{engine}"])
    table = load_combustion(module_files()[f"combustion_{engine}"])
    simulation = running(train, 60.0)
    rows = turn(simulation, 720)
    crank = train.firing_angles[0] + np.radians(np.arange(1, 721))
    for kind in ("intake", "exhaust"):
        opens, closes, highest = (getattr(table, f"{kind}_{what}") for what in ("opens", "closes", "lift"))
        assert (opens, closes, highest) == tuple(getattr(train, f"{kind}_{w}") for w in ("opens", "closes", "lift"))
        found = output(simulation, rows, f"cylinder[1].{kind}_lift")
        middle = 0.5 * (opens + closes)
        angles = [2.0 * wrapped(0.5 * (phi - middle)) + middle for phi in crank]
        expected = np.array([built_in_lift(phi, opens, closes, highest) for phi in angles])
        assert found.max() == pytest.approx(highest, rel=5e-3)
        assert found.sum() == pytest.approx(expected.sum(), rel=0.02)
        assert np.abs(found - expected).max() < 0.05 * highest
        away = np.array([phi < opens - 0.02 or phi > closes + 0.02 for phi in angles])
        assert found[away].max() < 1e-4  # ramps take up the lash
    assert smallest_radius(train, "intake") > 0.005


def test_slow_and_rigid_lift_is_that_of_the_cam():
    settings = single(**RIGID, **FREE)
    simulation = running(settings, 30.0)
    rows = turn(simulation, 720)
    model = build_model(settings)
    crank = np.radians(np.arange(1, 721))
    for kind, name in enumerate(("intake", "exhaust")):
        cam = model.cams[kind]
        z = np.array([settings.ratio * cam_lift(cam, wrapped(0.5 * a - model.noses[kind]))[0] for a in crank])
        held = settings.spring_preload / settings.stiffness
        found = output(simulation, rows, f"cylinder[1].{name}_lift")
        assert found == pytest.approx(np.maximum(z - held, 0.0), abs=2e-6)


def test_slow_torque_is_the_springs_energy_by_the_angle():
    """Without friction: T = (p + k x) dx/dφ, valve by valve; its mean is nought."""
    settings = single(**RIGID, **FREE, tolerance=1e-6)
    simulation = running(settings, 30.0)
    rows = turn(simulation, 720, 0.5)
    energy = np.zeros(len(rows))
    for name in ("intake", "exhaust"):
        x = output(simulation, rows, f"cylinder[1].{name}_lift")
        energy += settings.spring_preload * x + 0.5 * settings.spring_rate * x**2
    torque = output(simulation, rows, "valvetrain.torque_step")
    expected = np.diff(energy, prepend=energy[-1]) / math.radians(0.5)
    assert torque == pytest.approx(expected, abs=5e-3 * np.abs(expected).max())
    assert abs(torque.mean()) < 1e-3 * np.abs(torque).max()


def test_mean_torque_is_what_friction_and_dampers_take():
    simulation = running(six())
    before = simulation.state
    rows = turn(simulation, 720)
    lost = (simulation.state - before)[[at.FRICTION_WORK, at.DAMPED]]
    work = output(simulation, rows, "valvetrain.torque_step").mean() * CYCLE
    assert work == pytest.approx(lost.sum(), rel=1e-3)
    assert lost[0] > 0.95 * work
    assert output(simulation, rows[-1], "valvetrain.torque_mean") == pytest.approx(work / CYCLE, rel=1e-3)
    power = output(simulation, rows, "friction.power").mean()
    assert power * CYCLE / simulation.inputs[0] == pytest.approx(lost[0], rel=1e-9)


@pytest.mark.parametrize(("factor", "shares"), [(0.8, (5e-5, 5e-6, 5e-7)), (1.7, (5e-4, 1e-4, 1e-5))])
def test_energy_balance(factor, shares):
    """What is missing over a cycle, against the work done, falls with the tolerance; also with bounce and rattle."""
    for tolerance, share in zip((1e-3, 1e-4, 1e-6), shares, strict=True):
        simulation = running(replace(six(), tolerance=tolerance), factor * six().rated_speed / RPM)
        before = simulation.state
        turn(simulation, 720)
        work = simulation.state[at.WORK] - before[at.WORK]
        assert abs(output(simulation, simulation.outputs, "balance.energy")) < share * work


def fixed_steps(simulation, state, turn_deg, count):
    """State after so many equal steps of the method over a turn of the crank, without step control."""
    model, work = build_model(simulation.settings), make_work(2 * len(simulation.settings.firing_angles))
    state, speed = state.copy(), simulation.inputs[0]
    crank = state[at.CAM_ANGLE] + output(simulation, simulation.outputs, "camshaft.lag")
    h = math.radians(turn_deg) / speed / count
    for k in range(count):
        assert attempt(model, work, state, crank + 0.5 * speed * k * h, 0.5 * speed, h) >= 0.0
        keep_step(work, state)
    return state


@pytest.mark.parametrize(("degrees", "least"), [(15.0, 1.9), (60.0, 1.7)])
def test_second_order_also_over_seating(degrees, least):
    """Of velocities at 1.5 times the rated speed, on the cam and over the impact on the seat."""
    simulation = running(single(start_cycles=1.0), 1.5 * single().rated_speed / RPM)
    turn(simulation, 540)  # the intake closes at 570 degrees
    state = simulation.state
    places = [at.N_HEAD + at.V, at.N_HEAD + at.N_LINE + at.V]
    finest = fixed_steps(simulation, state, degrees, 12800)
    errors = [np.abs((fixed_steps(simulation, state, degrees, n) - finest)[places]).max() for n in (200, 400, 800)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders.mean() > least, (errors, orders)


def test_tolerance_converges_with_bounce_and_rattle():
    """A cycle from rest at 1.6 times the rated speed: loss of contact, bounce and a drive apart."""
    found = {}
    for tolerance in (1e-4, 1e-5, 1e-7):
        settings = replace(six(), tolerance=tolerance, start_cycles=0.0)
        simulation = running(settings, 1.6 * settings.rated_speed / RPM)
        rows = turn(simulation, 720)
        found[tolerance] = np.array([output(simulation, rows, f"cylinder[{i}].intake_lift") for i in (1, 3, 5)])
        assert output(simulation, rows[-1], "contact.loss") > 0.01
    off = [np.abs(found[tolerance] - found[1e-7]).max() / 0.01 for tolerance in (1e-4, 1e-5)]
    assert off[0] < 0.03 and off[1] < 0.4 * off[0], off


def test_results_do_not_depend_on_the_communication_step():
    lifts, torques = [], []
    for step in (0.2, 1.0, 6.0):
        simulation = running(replace(six(), tolerance=1e-6))
        rows = turn(simulation, 720, step)
        every = round(6.0 / step)
        lifts.append(output(simulation, rows, "cylinder[4].exhaust_lift")[every - 1 :: every])
        torques.append(output(simulation, rows, "valvetrain.torque_step").reshape(-1, every).mean(axis=1))
    for k in (1, 2):
        assert lifts[k] == pytest.approx(lifts[0], abs=1e-6)
        assert torques[k] == pytest.approx(torques[0], abs=2e-3 * np.abs(torques[0]).max())


def test_orders_of_the_torque_are_those_of_the_events():
    """Six cylinders at equal distances: orders 3, 6, … per revolution of the crank and no others."""
    simulation = running(replace(six(), tolerance=1e-6))
    torque = output(simulation, turn(simulation, 720), "valvetrain.torque")
    orders, complex_amplitudes = order_amplitudes(torque, 24.0)
    amplitudes = np.abs(complex_amplitudes)
    of_events = (orders > 0.0) & (np.abs(orders / 3.0 - np.round(orders / 3.0)) < 1e-9)
    assert amplitudes[of_events].max() > 3.0
    assert amplitudes[(orders > 0.0) & ~of_events].max() < 2e-3 * amplitudes[of_events].max()
    assert set(orders[np.argsort(amplitudes * (orders > 0.0))[-2:]]) <= {3.0, 6.0, 9.0}


def test_a_drive_rattles_through_its_backlash_where_the_torque_changes_sign():
    """Without friction the cams drive the camshaft; with it, at low speed, they never do."""
    rattling, loaded = running(replace(six(), **FREE), 600.0), running(six(), 600.0)
    for simulation in (rattling, loaded):
        rows = turn(simulation, 1440)
        lag = output(simulation, rows, "camshaft.lag")
        gap = 0.5 * six().backlash / six().drive_radius
        if simulation is loaded:
            assert output(simulation, rows[-1], "drive.apart") == 0.0 and lag.min() > gap
        else:
            assert output(simulation, rows[-1], "drive.apart") > 0.01 and lag.min() < -gap < gap < lag.max()


def test_at_rest_it_stands_at_the_given_angle_and_then_runs_up():
    """Nothing moves at rest: springs push the camshaft back against its drive. Then it is turned to 2000 rev/min."""
    simulation = running(six(), 0.0, angle=math.radians(100.0))
    first = simulation.outputs.copy()
    for k in range(20):
        simulation.step((k + 1) * 1e-3)
    names = np.array(simulation.output_names)
    moving = np.array([name.startswith(("solver", "balance")) for name in names])
    assert simulation.outputs[~moving] == pytest.approx(first[~moving], abs=1e-6 * np.abs(first).max() * 1e-3)
    torque = output(simulation, first, "drive.torque")
    lag = output(simulation, first, "camshaft.lag")
    gap = math.copysign(0.5 * six().backlash / six().drive_radius, torque)
    assert torque != 0.0 and lag == pytest.approx(torque / six().drive_stiffness + gap, rel=1e-6)
    angle, t, h = math.radians(100.0), simulation.time, 2e-4
    for k in range(2000):
        speed = 500.0 * (k + 1) * h
        simulation.inputs[:] = speed, angle
        simulation.step(t + (k + 1) * h)
        angle += speed * h
    assert output(simulation, simulation.outputs, "camshaft.speed") == pytest.approx(0.5 * speed, rel=0.02)
    assert output(simulation, simulation.outputs, "cylinder[1].intake_seating_velocity") > 0.0


@pytest.mark.parametrize("ends", ["begin", "end"])
def test_received_angles_lead_where_the_speed_does(ends):
    """Wrapped angles of a steady crank, of a step's begin or end, give what the speed alone gives."""
    alone = running(replace(six(), angle_source="speed"))
    told = running(replace(six(), inputs_at=ends))
    h = math.radians(1.0) / alone.inputs[0]
    for k in range(900):
        alone.step((k + 1) * h)
        told.inputs[1] = math.fmod(math.radians(k + (ends == "end")), CYCLE)
        told.step((k + 1) * h)
    assert told.outputs[: at.OUT_BALANCE] == pytest.approx(alone.outputs[: at.OUT_BALANCE], rel=1e-5, abs=1e-9)


def test_a_restored_state_goes_on_to_the_bit():
    simulation = running(six(), 3000.0)
    turn(simulation, 100, 0.7)
    state = simulation.state
    first = turn(simulation, 300, 0.7)
    other = running(six(), 1000.0)
    other.inputs[:] = simulation.inputs
    other.state = state
    assert np.array_equal(turn(other, 300, 0.7), first)


def test_many_tiny_steps_and_an_absurd_speed():
    simulation = running(six(), 12000.0)
    assert np.isfinite(turn(simulation, 720, 5.0)).all()
    simulation = running(six())
    for k in range(50):
        simulation.step(simulation.time + 10.0 ** (-12.0 + 0.2 * k))
    assert np.isfinite(simulation.outputs).all()
