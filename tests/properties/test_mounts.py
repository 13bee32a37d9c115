"""The rigid engine on its mounts against closed forms: modes, dynamic stiffness, excitation, response, runs in time."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from engine_texts import SIX, read
from refusals import refused_files, text_of
from scipy.integrate import quad, solve_ivp

import cranktrain as ct
from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.engine.articulated_rod import piston_height, rod_end
from cranktrain.engine.file import engine_of, load_engine
from cranktrain.engine.mount_dynamics import MountDynamics
from cranktrain.engine.parts import Mounts
from cranktrain.engine.written import document_of
from cranktrain.loads.gas_pressure import GasTrace, gas_pressure, spline_coefficients
from cranktrain.loads.mean_load import mean_torque
from cranktrain.results.orders.harmonics import last_cycle, order_spectrum
from cranktrain_lab.mounts.body import RigidEngine, rigid_engine
from cranktrain_lab.mounts.excitation import ORDERS, excitation
from cranktrain_lab.mounts.modes import modes
from cranktrain_lab.mounts.response import response
from cranktrain_lab.mounts.running import running_engine
from cranktrain_lab.mounts.stiffness import Branch, Support, fitted, with_states
from cranktrain_lab.mounts.study import passage, report, study
from cranktrain_lab.mounts.transient import states, steady, transient

HZ = 2.0 * math.pi
MASS, INERTIA = 150.0, (9.0, 7.0, 5.0)
STIFF, DAMPING = (2.0e5, 3.0e5, 1.5e5), (300.0, 500.0, 200.0)
HALF, LONG = 0.25, 0.3
"""Distances of four mounts from the centre across and along, m."""
SHIPPED = {"four": "generator_four", "single": "single_petrol", "v6": "v6_split", "six": "diesel_i6"}


def on_four(height=0.0, stiffness=STIFF):
    """Rigid engine and support of four equal mounts in a rectangle, ``height`` above the centre."""
    places = [(x, height, z) for x in (-HALF, HALF) for z in (-LONG, LONG)]
    mounts = np.array([[[*one], [0, 0, 0]] for one in places])[:, 0]
    motion = np.tile(np.eye(6), (4, 1, 1))
    for row, (x, y, z) in zip(motion, mounts, strict=True):
        row[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    support = Support(motion.reshape(-1, 6), np.tile([*stiffness, 0, 0, 0], 4), np.tile([*DAMPING, 0, 0, 0], 4), (), {})
    return RigidEngine(np.zeros(3), np.diag([*3 * (MASS,), *INERTIA]), 0.0, ()), support


def on_one(branches=(), tables=None, stiffness=1e5, damping=200.0, mass=100.0):
    """Mass on one mount that moves along y; the other directions are held by springs of their own."""
    springs, dampers = np.full(6, 1e9), np.zeros(6)
    springs[1], dampers[1] = stiffness, damping
    support = Support(np.eye(6), springs, dampers, tuple(branches), tables or {})
    return RigidEngine(np.zeros(3), mass * np.eye(6), 0.0, ()), support


def standing(name, **more):
    """Shipped engine with a standing body and four mounts, without a block of its own."""
    places = {"x": (-0.25, 0.25, -0.25, 0.25), "y": 4 * (0.02,), "z": (0.0, 0.0, 0.4, 0.4)}
    values = {f"stiffness_{axis}": 4 * (k,) for axis, k in zip("xyz", STIFF, strict=True)}
    values |= {f"damping_{axis}": 4 * (c,) for axis, c in zip("xyz", DAMPING, strict=True)}
    values |= {
        f"{noun}_r{axis}": 4 * (one,) for axis in "xyz" for noun, one in (("stiffness", 100.0), ("damping", 1.0))
    }
    body = {"standing_mass": 90.0, "standing_centre": (0.01, 0.12, 0.2), "standing_inertia": (6.0, 5.0, 4.0)}
    return replace(load_engine(name), block=None, mounts=Mounts(**places, **values, **body), **more)


def test_four_mounts_in_the_plane_of_the_centre_decouple_all_six_modes():
    found = {one.name: one for one in modes(*on_four())}
    arms = {"pitch": STIFF[1] * LONG**2, "yaw": STIFF[0] * LONG**2 + STIFF[2] * HALF**2, "roll": STIFF[1] * HALF**2}
    losses = {
        "pitch": DAMPING[1] * LONG**2,
        "yaw": DAMPING[0] * LONG**2 + DAMPING[2] * HALF**2,
        "roll": DAMPING[1] * HALF**2,
    }
    wanted = dict(
        zip(("lateral", "bounce", "fore-and-aft"), zip(STIFF, DAMPING, 3 * (MASS,), strict=True), strict=True)
    )
    wanted |= {name: (arms[name], losses[name], j) for name, j in zip(arms, INERTIA, strict=True)}
    assert set(found) == set(wanted)
    for name, (k, c, m) in wanted.items():
        omega = math.sqrt(4.0 * k / m)
        assert found[name].hz == pytest.approx(omega / HZ, rel=1e-9)
        assert found[name].damping_ratio == pytest.approx(4.0 * c / (2.0 * m * omega), rel=1e-9)
        assert found[name].fractions.max() == pytest.approx(1.0, abs=1e-12) and not found[name].coupled


def test_mounts_below_the_centre_couple_lateral_motion_with_roll():
    """|k − mω²  kh; kh  k_r + kh² − Jω²| = 0; fractions of the kinetic energy follow from the shape."""
    height, along = -0.1, 1.5e5
    found = {one.name: one for one in modes(*on_four(height, (STIFF[0], along, STIFF[2])))}
    k, roll, mass, inertia = 4.0 * STIFF[0], 4.0 * along * HALF**2, MASS, INERTIA[2]
    b = k / mass + (roll + k * height**2) / inertia
    squares = [0.5 * (b + sign * math.sqrt(b * b - 4.0 * k * roll / (mass * inertia))) for sign in (-1.0, 1.0)]
    for name, square in zip(("lateral", "roll"), squares, strict=True):
        one = found[name]
        assert one.hz == pytest.approx(math.sqrt(square) / HZ, rel=1e-9)
        turn = (k - mass * square) / (k * height)
        share = mass / (mass + inertia * turn**2)
        assert one.fractions[0] == pytest.approx(share, rel=1e-8)
        assert one.coupled == (["roll"] if name == "lateral" else ["lateral"])


def test_the_fluid_of_a_mount_is_the_published_lumped_model():
    """Singh, Kim and Ravindra: k + c s + (m s² + c_f s + k_l) k_c/(m s² + c_f s + k_l + k_c), chambers k_c and k_l.

    A compliant lower chamber is a stiffer rubber and fluid scaled by k_c/(k_c + k_l), as the how-to says.
    """
    k, c, upper, lower, mass, damper = 2e5, 150.0, 3e5, 4e4, 60.0, 700.0
    share = upper / (upper + lower)
    branch = Branch(1, share * upper, share**2 * damper, share**2 * mass)
    body, support = on_one((branch,), stiffness=k + share * lower, damping=c)
    for hz in (0.5, 5.0, 12.0, 60.0):
        s = 1j * HZ * hz
        below = mass * s * s + damper * s + lower
        wanted = k + c * s + upper * below / (upper + below)
        assert support.at(HZ * hz)[1] == pytest.approx(wanted, rel=1e-12)
        found = response(body, support, np.array([HZ * hz]), np.array([1.0]), np.array([[[0, 8.0, 0, 0, 0, 0]]]))
        assert found.frame[0, 0, 1] == pytest.approx(8.0 * wanted / (wanted + 100.0 * s * s), rel=1e-9)


def test_a_spinning_crank_couples_pitch_and_yaw_as_a_gyroscope():
    """Free in space, a symmetric rotor nutates at J_p Ω/J_d; on soft springs its response is largest there."""
    body, support = on_one(stiffness=1.0, damping=0.0)
    body = RigidEngine(body.centre, np.diag([100.0, 100, 100, 4.0, 4.0, 3.0]), 1.5, ())
    support = support._replace(stiffness=np.full(6, 1e-3))
    forces = np.zeros((1, 1, 6), dtype=complex)
    forces[0, 0, 3:5] = 1.0, -1j
    sizes = [
        abs(response(body, support, np.array([100.0]), np.array([order]), forces).centre[0, 0, 3])
        for order in (0.370, 0.375, 0.380)
    ]
    assert sizes[1] > 50.0 * max(sizes[0], sizes[2])


def test_states_have_the_dynamic_stiffness():
    """The periodic motion of the system in time is the response by order, with Maxwell elements, fluid and spin."""
    body, support = on_four(-0.1)
    body = body._replace(spin=0.8)
    support = support._replace(
        branches=(Branch(1, 1e5, 900.0, 0.0), Branch(7, 2e5, 800.0, 40.0), Branch(12, 5e4, 90.0, 0.0))
    )
    amplitudes = np.zeros((ORDERS.size, 6), dtype=complex)
    amplitudes[[0, 3, 4]] = np.arange(18.0).reshape(3, 6) * (1.0 + 0.5j)
    amplitudes[0] = amplitudes[0].real
    found = response(body, support, np.array([90.0]), ORDERS, amplitudes[None])
    system = states(body, support)
    state = steady(system, 90.0, amplitudes)
    np.testing.assert_allclose(state[:6], found.centre[0].real.sum(axis=0), rtol=1e-9)
    np.testing.assert_allclose(system.c @ state, found.mounts[0].real.sum(axis=0).ravel(), rtol=1e-9, atol=1e-9)


def chirp(angle, speed, acceleration):
    return np.array([0.0, 50.0 * math.cos(angle), 0.0, 0.0, 0.0, 0.0])


def test_a_passage_in_time_is_that_of_one_equation():
    """Mass on a hydraulic mount through its mode, against SciPy's DOP853; converged in the step."""
    branch = Branch(1, 2e5, 500.0, 30.0)
    body, support = on_one((branch,))
    system, rate, end = states(body, support), 40.0, 2.0
    runs = [transient(system, chirp, 0.0, rate, end, np.zeros(14), tolerance) for tolerance in (1e-6, 1e-10)]

    def equations(t, y):
        x, v, z, w = y
        pull = 2e5 * (x - z)
        return [
            v,
            (50.0 * math.cos(0.5 * rate * t * t) - 1e5 * x - 200.0 * v - pull) / 100.0,
            w,
            (pull - 500.0 * w) / 30.0,
        ]

    exact = solve_ivp(equations, (0.0, end), np.zeros(4), method="DOP853", t_eval=runs[0].time, rtol=1e-11, atol=1e-14)
    peak = np.abs(exact.y[0]).max()
    for run, error in zip(runs, (1e-4, 1e-7), strict=True):
        np.testing.assert_allclose(run.centre[:, 1], exact.y[0], atol=error * peak)
        force = 1e5 * exact.y[0] + 200.0 * exact.y[1] + 2e5 * (exact.y[0] - exact.y[2])
        np.testing.assert_allclose(run.mounts[:, 0, 1], force, atol=2.0 * error * np.abs(force).max())


def test_a_constant_speed_stays_on_the_periodic_motion_and_a_slow_passage_near_it():
    body, support = on_one(damping=1200.0)
    system, alone = states(body, support), np.zeros((ORDERS.size, 6), dtype=complex)
    alone[2, 1] = 50.0
    run = transient(system, chirp, 25.0, 0.0, 3.0, steady(system, 25.0, alone))
    omega = 25.0
    wanted = 50.0 / (1e5 - 100.0 * omega**2 + 1j * omega * 1200.0)
    np.testing.assert_allclose(run.centre[:, 1], (wanted * np.exp(1j * omega * run.time)).real, atol=1e-5 * abs(wanted))
    resonance = 50.0 / (1200.0 * math.sqrt(1e5 / 100.0 - 6.0**2))
    peaks = [
        np.abs(transient(system, chirp, 10.0, rate, 40.0 / rate, steady(system, 10.0, alone)).centre[:, 1]).max()
        for rate in (80.0, 8.0, 1.0)
    ]
    assert peaks[0] < peaks[1] < peaks[2] < resonance and peaks[2] == pytest.approx(resonance, rel=5e-3)


def test_tables_of_passive_mounts_are_fitted_and_others_are_not(capsys):
    omega = HZ * np.geomspace(1.0, 200.0, 30)
    parts = (Branch(0, 1e5, 3e3, 0.0), Branch(0, 3e5, 900.0, 45.0))
    rubber = 2e5 + 50j * omega + parts[0].at(omega)
    assert fitted(omega, rubber)[3] < 1e-2
    fluid = rubber + parts[1].at(omega)
    k, c, branches, error = fitted(omega, fluid)
    assert error < 1e-2 and all(one.stiffness > 0 and one.damping > 0 and one.mass >= 0 for one in branches)
    between = HZ * 17.3
    exact = 2e5 + 50j * between + sum(one.at(between) for one in parts)
    assert k + 1j * between * c + sum(one.at(between) for one in branches) == pytest.approx(exact, rel=2e-2)
    # Stiffness that falls by ten while energy is lost: no passive mount.
    assert fitted(omega, np.linspace(1.0, 0.1, 30) * 1e5 * (1 + 1j))[3] > 0.5
    _, worst = with_states(on_one(tables={1: (omega, fluid)})[1])
    assert worst == error


def test_a_mode_takes_the_stiffness_of_its_own_frequency():
    omega = HZ * np.array([1.0, 100.0])
    values = np.array([1e5, 4e5]) * (1.0 + 0.2j)
    found = {one.name: one for one in modes(*on_one(tables={1: (omega, values)}))}["bounce"]
    stiffness = np.interp(HZ * found.hz, omega, values.real)
    assert found.hz == pytest.approx(math.sqrt(stiffness / 100.0) / HZ, rel=1e-9)
    assert found.damping_ratio == pytest.approx(0.1, rel=1e-9)


def test_order_forces_of_a_four_are_the_exact_series():
    four = standing("generator_four")
    found, _ = excitation(four, rigid_engine(four).centre)
    r, length = four.throws[0], four.rod.length
    mass = four.rod.small_end_mass + four.cylinders.piston_mass
    for order in (2, 4, 6):
        wave = quad(lambda t, k=order: math.sqrt(length**2 - (r * math.sin(t)) ** 2) * math.cos(k * t), 0.0, math.pi)[0]
        wanted = 4.0 * mass * order**2 * 2.0 / math.pi * wave
        assert abs(found.masses[2 * order, 1]) == pytest.approx(abs(wanted), rel=1e-6)
        assert abs(found.masses[2 * order, 0]) < 1e-9 * abs(wanted)


@pytest.mark.parametrize("name", SHIPPED.values(), ids=SHIPPED.keys())
def test_the_roll_moment_is_that_of_the_pistons_on_their_liners(name):
    """M = Σ y_P (m_o ÿ_P + p A) tan φ, with rods that are two masses; its mean is minus the mean torque of the gas."""
    engine = load_engine(name)
    rod = engine.rod
    whole = rod.big_end_mass + rod.small_end_mass
    b = rod.length * rod.small_end_mass / whole
    engine = standing(name, rod=replace(rod, inertia=whole * b * (rod.length - b)), frame=(), body=(), connection=())
    made, _ = excitation(engine, np.zeros(3))
    speed, load = 0.8 * engine.speeds[1], 0.7
    angle = np.arange(2880) * (4.0 * math.pi / 2880)
    gas, burn = (
        GasTrace.from_engine(engine),
        0.7 * max(1.0 - made.gas.falloff * (speed / made.gas.best_speed - 1) ** 2, 0),
    )
    wanted = np.zeros(2880)
    for c, first in enumerate(engine.firing_angles):
        end, height = rod_end(engine, c, angle), piston_height(engine, c, angle)[0]
        change = np.fft.irfft(-np.square(0.5 * np.arange(1441)) * np.fft.rfft(height), 2880)
        trace = gas.motored + burn * (gas.fired - gas.motored)
        push = (
            (gas_pressure(angle - first, spline_coefficients(trace)) - 101325.0)
            * math.pi
            / 4
            * engine.cylinders.bore**2
        )
        mass = rod.small_end_mass + engine.cylinders.piston_mass
        lean = (end.x - engine.offsets[c]) / np.sqrt(rod.length**2 - (end.x - engine.offsets[c]) ** 2)
        wanted += (mass * speed**2 * change + push) * (height * lean - engine.offsets[c])
    spectrum = np.fft.rfft(wanted)[: ORDERS.size] * 2.0 / 2880
    spectrum[0] *= 0.5
    found = made.at(speed, load)[:, 5]
    np.testing.assert_allclose(found, spectrum, atol=1e-6 * np.abs(spectrum).max())
    assert made.at(speed, 1.0)[0, 5].real == pytest.approx(-mean_torque(engine, gas, speed), rel=1e-4)


@pytest.mark.parametrize("name", ["generator_four", "v6_split"])
def test_the_roll_moment_of_masses_closes_momentum_and_energy(name):
    """Rods are two points that have their inertia: M = −dH/dt + (dE/dt)/Ω at constant speed, and (2E/Ω² − H/Ω) Ω̇."""
    engine = load_engine(name)
    offset = replace(engine.cylinders, pin_offset=0.004)
    engine = standing(name, cylinders=offset, frame=(), body=(), connection=())
    made, _ = excitation(engine, np.zeros(3))
    rod, piston = engine.rod, engine.cylinders.piston_mass
    whole = rod.big_end_mass + rod.small_end_mass
    angle, momentum, energy = np.arange(720) * (2.0 * math.pi / 720), np.zeros(720), np.zeros(720)

    def rate(signal):
        return np.fft.irfft(1j * np.arange(361) * np.fft.rfft(signal), 720)

    for c in range(engine.n_cylinders):
        end, height = rod_end(engine, c, angle), piston_height(engine, c, angle)[0]
        pin, top = np.array([end.x, end.y]), np.array([np.full(720, engine.offsets[c]), height])
        along = (top - pin) / rod.length
        centre = pin + along * rod.length * rod.small_end_mass / whole
        half = along * math.sqrt(rod.inertia / whole)
        for mass, (x, y) in ((0.5 * whole, centre + half), (0.5 * whole, centre - half), (piston, top)):
            momentum += mass * (x * rate(y) - y * rate(x))
            energy += 0.5 * mass * (rate(x) ** 2 + rate(y) ** 2)
    for found, wanted in ((made.masses, rate(energy) - rate(momentum)), (made.rate, 2.0 * energy - momentum)):
        orders = 2.0 / 720 * np.fft.rfft(wanted)[:13]
        orders[0] *= 0.5
        np.testing.assert_allclose(found[::2, 5], orders, atol=1e-6 * np.abs(orders).max())


def test_a_six_has_no_free_force_and_rolls_at_its_firing_order():
    six = standing("diesel_i6")
    made = study(six, np.array([150.0, 200.0]), 1.0)
    assert made.orders.tolist() == [3.0, 6.0, 9.0, 12.0]
    assert np.abs(made.forces[:, 0, :5]).max() < 1e-6 * abs(made.forces[0, 0, 5])
    total = made.response.mounts[..., :3].sum(axis=2)
    np.testing.assert_allclose(total, made.response.frame[..., :3], atol=1e-9 * np.abs(total).max())


def test_rigid_body_adds_all_parts():
    four = standing("generator_four")
    found, alone = rigid_engine(four), rigid_engine(replace(four, mounts=replace(four.mounts, standing_mass=91.0)))
    moving = 4 * (four.rod.big_end_mass + four.rod.small_end_mass + four.cylinders.piston_mass)
    assert found.mass[0, 0] > 90.0 + moving + four.flywheel.mass + four.pulley.mass
    assert alone.mass[0, 0] - found.mass[0, 0] == pytest.approx(1.0)
    # A heavier rim of the flywheel turns freely: it adds angular momentum and no resistance to roll.
    rim = replace(four, flywheel=replace(four.flywheel, polar_inertia=four.flywheel.polar_inertia + 0.01))
    heavy = rigid_engine(rim)
    assert heavy.spin - found.spin == pytest.approx(0.01) and heavy.mass[5, 5] == pytest.approx(found.mass[5, 5])


def test_start_and_stop_of_a_four_through_its_modes():
    """Fast passages stay below the periodic cycles; a table of the constant mount changes neither."""
    four = standing("generator_four")
    made = study(four, np.array([100.0, 200.0]), 0.3)
    start, stop = passage(made, 60.0, 0.3), passage(made, -60.0, 0.3)
    assert start.run.speed[[0, -1]] == pytest.approx([0.0, four.speeds[0]])
    assert stop.run.speed[[0, -1]] == pytest.approx([four.speeds[0], 0.0], abs=1e-9)
    assert np.abs(start.run.centre[:, 5]).max() < start.centre[:, 5].max()
    frequencies = tuple(np.geomspace(0.5, 400.0, 40))
    loss = tuple(HZ * one * DAMPING[1] / STIFF[1] for one in frequencies)
    table = MountDynamics("same", ("y",), (1, 2, 3, 4), frequencies, 40 * (STIFF[1],), loss)
    other = study(replace(four, mount_dynamics=(table,)), np.array([100.0, 200.0]), 0.3)
    np.testing.assert_allclose([one.hz for one in other.modes], [one.hz for one in made.modes], rtol=1e-9)
    again = passage(other, 60.0, 0.3)
    assert again.error < 1e-6
    np.testing.assert_allclose(again.run.centre, start.run.centre, atol=1e-4 * np.abs(start.run.centre).max())


def test_the_verb_tells_modes_orders_and_passages(tmp_path, capsys):
    four = standing(
        "generator_four", mount_dynamics=(MountDynamics("fluid", ("y",), (1, 3), (), (), (), 2e5, 30.0, 700.0),)
    )
    path = tmp_path / "four.toml"
    path.write_text(four.to_toml(), encoding="utf-8")
    assert load_engine(path).mount_dynamics == four.mount_dynamics
    arguments = ["mounts", str(path), "--orders", "2,4", "--start", "600", "--stop", "600", "--plots", str(tmp_path)]
    assert main([*arguments, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (
        len(found["modes"]) == 6 and len(found["orders"]) == 2 * 41 and len(found["mounts"]) == 4 * len(found["orders"])
    )
    assert sum(one["weight_y_n"] for one in found["static"]) == pytest.approx(-9.80665 * found["mass_kg"], rel=1e-3)
    assert sum(one["torque_y_n"] for one in found["static"]) == pytest.approx(0.0, abs=1e-6)
    assert found["start"]["rate_rpm_per_s"] == pytest.approx(600.0) and len(found["stop"]["peaks"]) == 10
    assert len(found["plots"]) == 4 and all(
        (tmp_path / one.rpartition("/")[2]).stat().st_size for one in found["plots"]
    )
    assert main(arguments[:2]) == 0
    assert "Largest forces by order" in capsys.readouterr().out


def test_a_table_that_no_mount_has_does_not_run_in_time():
    table = MountDynamics("odd", ("y",), (1,), (1.0, 10.0, 100.0), (1e6, 1e5, 1e4), (1.0, 1.0, 1.0))
    made = study(standing("generator_four", mount_dynamics=(table,)), np.array([100.0, 200.0]), 0.3)
    assert report(made)["said"] == [
        "a table of mounts ends at 100 Hz, orders reach 382 Hz; beyond it the last stiffness is taken"
    ]
    with pytest.raises(InputError, match="differs from a table by"):
        passage(made, 60.0, 0.3)


FLUID = MountDynamics("fluid", ("y",), (1, 2, 3, 4), (), (), (), 6e5, 14.0, 900.0)
MAXWELL = MountDynamics("rubber", ("x",), (1, 2, 3, 4), (), (), (), 6e5, 0.0, 3000.0)


@pytest.mark.slow
@pytest.mark.parametrize("dynamics", [(), (FLUID, MAXWELL)], ids=["constant", "fluid"])
def test_a_flexible_block_adds_little_to_the_six(dynamics):
    """The rigid engine against a run with crank, pistons and elastic block: order 3 of all mounts within 3 %.

    Fluid in the mounts is bodies and connections of the running model.
    """
    engine, speed = replace(load_engine("diesel_i6"), mount_dynamics=dynamics), 1000.0
    runs = running_engine(engine)[0] if dynamics else engine
    run = ct.simulate(runs, speed_rpm=speed, crank="rigid", bearings="linear", block="flexible", load=1.0)
    made = study(engine, np.array([speed * RPM, 2.0 * speed * RPM]), 1.0, (3.0,))
    for j in range(4):
        for k, axis in enumerate("xy"):
            names = [f"mount[{j + 1}].force.{axis}"]
            names += [
                f"connection[{one.name}].force.{axis}" for one in runs.connection
                if one.ends[0] == f"block.mount[{j + 1}]" and one.spring.stiffness[k]
            ]  # fmt: skip
            orders, sizes = order_spectrum(last_cycle(run.angle, sum(run.outputs[name] for name in names)), 12.0)
            wanted = abs(made.response.mounts[0, 0, j, k])
            assert sizes[np.argmin(np.abs(orders - 3.0))] == pytest.approx(wanted, rel=3e-2)


def test_a_flexible_block_takes_mounts_over_frequency_as_bodies(tmp_path, capsys):
    six = replace(load_engine("diesel_i6"), mount_dynamics=(FLUID,))
    with pytest.raises(InputError, match="for a flexible block take the engine file"):
        ct.simulate(six, speed_rpm=1000.0, crank="rigid", bearings="linear", block="flexible")
    path = tmp_path / "six.toml"
    found = ct.mounts(six, output=path)
    made = load_engine(path)
    assert found["fit_error"] == 0.0 and len(made.body) == 4 and not made.mount_dynamics
    assert made.mounts.stiffness == six.mounts.stiffness
    with pytest.raises(InputError, match="so it runs as it is"):
        ct.mounts("diesel_i6", output=path)


def test_written_engines_keep_their_mounts():
    four = standing(
        "generator_four", mount_dynamics=(MountDynamics("a", ("x",), (1,), (1.0, 2.0), (1e5, 1e5), (0.1, 0.1)),)
    )
    assert engine_of(document_of(four), "four", None).mount_dynamics == four.mount_dynamics


@pytest.mark.parametrize(("old", "new", "said"), refused_files()["mount-dynamics"]["changes"])
def test_slips_of_tables_are_told(tmp_path, old, new, said):
    tables = text_of("mount-dynamics")
    assert old in tables and len(read(tmp_path, SIX + tables).mount_dynamics) == 2
    with pytest.raises(InputError, match=re.escape(said)):
        read(tmp_path, SIX + tables.replace(old, new, 1))


@pytest.mark.parametrize(("values", "said"), refused_files()["mount-dynamics"]["standing"])
def test_a_standing_body_is_whole(values, said):
    with pytest.raises(InputError, match=re.escape(said)):
        load_engine("diesel_i6").with_({f"mounts.{key}": value for key, value in values.items()})
