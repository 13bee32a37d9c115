"""Rods that hang on a master rod: limits, tangents, balance of momentum and energy, torsion, strokes, messages."""

import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from benchmarks._forced_torsion import gas_forces
from expected import DATA
from one_line import one_line
from some import some
from started import at_speed, shown

from cranktrain.dynamics.linear import SmallMotions
from cranktrain.dynamics.model.arrays import build_model
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.dynamics.simulation import Simulation, simulate
from cranktrain.engine.articulated_rod import dead_centre_angles, dead_centre_heights, piston_height
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.file import load_engine
from cranktrain.engine.firing import firing_summary
from cranktrain.engine.parts import ArticulatedRod
from cranktrain.loads.articulated_rod import MASTERS_PIN, force_change, force_on_pin, hang, joint_values
from cranktrain.loads.cylinder_volume import cylinder_volume
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.mean_load import mean_torque
from cranktrain.loads.slider_crank import remainder_inertia, rod_force
from cranktrain.results.bearings.cycle import bearing_report, rod_lean
from cranktrain.results.orders.harmonics import last_cycle, order_amplitudes
from cranktrain.results.summary import run_summary
from cranktrain.structure.assembly import running_crank
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, frequency_run_up
from cranktrain.studies.torsion.rod_torque import Rods

RADIAL, V12 = (load_engine(DATA / "engines" / f"{name}.toml") for name in ("radial5", "v12_articulated"))
ENGINES = {"radial5": RADIAL, "v12": V12}
GRAVITY = 9.80665
# Offsets of cylinders and knuckle pins off their banks: no symmetry hides a sign.
SKEW = replace(
    RADIAL,
    cylinders=replace(RADIAL.cylinders, pin_offset=0.004),
    articulated_rod=replace(RADIAL.articulated_rod, knuckle_angles=(0.0, 1.1, 2.7, 3.6, 5.2)),
)


SHAPES = pytest.mark.parametrize("engine", [RADIAL, V12, SKEW], ids=["radial5", "v12", "skew"])
RIGID = {"crank": "rigid", "block": "ground"}


def started(engine, omega, steady=False, **levels):
    """A run of a rigid crank at its start; a steady one turns evenly, on a flywheel of great inertia."""
    if steady:
        engine = replace(engine, flywheel=replace(engine.flywheel, polar_inertia=1e9, diametral_inertia=1e9))
    return at_speed(omega, engine, running_crank(engine, "rigid"), Settings(**RIGID, **levels))


class Geometry:
    """Rods of an engine in complex numbers, x + iy in axes at rest, from the crank angle alone."""

    def __init__(self, engine):
        self.engine, self.area = engine, 0.25 * math.pi * engine.cylinders.bore**2

    def bodies(self, c, theta):
        """Of cylinder c: what its rod turns about, its piston's pin, and the rod's unit vector to it."""
        engine, k = self.engine, self.engine.cylinders.pins[c] - 1
        master = engine.cylinders.pins.index(k + 1)
        crank = engine.crankshaft
        end = 1j * crank.throws[k] * np.exp(1j * (theta + crank.throw_angles[k]))
        if engine.articulations[c] is not None:
            _, _, along = self.bodies(master, theta)
            joint = engine.articulated_rod
            turn = engine.cylinders.bank_angles[c] - engine.cylinders.bank_angles[master]
            knuckle = joint.knuckle_angles[c] if joint.knuckle_angles else turn
            end = end + joint.knuckle_radius * along * np.exp(1j * knuckle)
        bank = np.exp(1j * engine.cylinders.bank_angles[c])
        length = (engine.articulated_rod if engine.articulations[c] else engine.rod).length
        own = end / bank
        across = own.real - engine.offsets[c]
        small = engine.offsets[c] + 1j * (own.imag + np.sqrt(length**2 - across**2))
        return end, small * bank, (small - own) * bank / length

    def accelerations(self, c, theta, omega, step=1e-4):
        """Second derivatives of :meth:`bodies` by time at constant speed."""
        before, now, after = (self.bodies(c, theta + k * step) for k in (-1.0, 0.0, 1.0))
        return [(a - 2.0 * b + d) * (omega / step) ** 2 for a, b, d in zip(before, now, after, strict=True)]


def pin_force(joint, motion, rod, gas):
    """Force on the crank pin and what ``force_change`` needs, from six values of its motion in the master's axes."""
    own, pin, out = np.array(motion, dtype=float), np.zeros(MASTERS_PIN), np.zeros(16)
    hang(joint, own, pin)
    rod_force(*own, gas, rod.length, rod.big_end_mass, 1.1, remainder_inertia(rod), 0.004, 3.0, -5.0, out)
    return np.array(force_on_pin(joint, pin, out)), pin, out


@pytest.mark.parametrize("cylinder", [1, 3, 4])
@pytest.mark.parametrize("angle", [0.3, 2.0, 4.5])
def test_tangents_are_those_of_differences(cylinder, angle):
    """In all six directions of place, velocity and acceleration, at some motion of the pin off its circle."""
    joint, rod = joint_values(SKEW.articulations[cylinder]), SKEW.articulated_rod
    r = SKEW.crankshaft.throw
    s, c = math.sin(angle), math.cos(angle)
    motion = np.array([-r * s, r * c, -11.0 * c, -9.0 * s, 2100.0, -900.0])
    _, pin, out = pin_force(joint, motion, rod, 2e4)
    scale = np.array([1e-6, 1e-6, 1e-3, 1e-3, 1.0, 1.0])
    for k, way in some(enumerate(np.eye(6))):
        ahead, behind = (pin_force(joint, motion + s * scale[k] * way, rod, 2e4)[0][:2] for s in (1.0, -1.0))
        wanted = (ahead - behind) / (2.0 * scale[k])
        found = np.array(force_change(joint, pin, out, *way))
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-7 * np.abs(wanted).max())


@pytest.mark.parametrize("name", ["radial5", "v12", "skew", "v_twin", "v6_split", "two_stroke_six"])
def test_forces_of_rods_are_those_of_their_momentum(name):
    """Newton's and Euler's equations of rods and pistons: gas, liners, weight, knuckle pins and crank pins."""
    engine = (ENGINES | {"skew": SKEW}).get(name) or load_engine(name).without_additions
    omega, geometry, n = 190.0, Geometry(engine), engine.n_cylinders
    simulation = started(engine, omega, steady=True, bearings="held", pistons="rigid")
    for k in range(1, 8):
        simulation.step(2.3e-3 * k)
        out, force, moment = shown(simulation), 0.0, 0.0
        theta = out["crank.angle"]
        loads = [complex(out[f"big_end[{c}].force.x"], out[f"big_end[{c}].force.y"]) for c in range(1, n + 1)]
        scale = max(map(abs, loads))
        for c, joint in enumerate(engine.articulations):
            rod, bank = engine.rods[c], np.exp(1j * engine.cylinders.bank_angles[c])
            end, small, along = geometry.bodies(c, theta)
            end2, small2, along2 = geometry.accelerations(c, theta, omega)
            gas = (entry.pressures(simulation)[c] - entry.AMBIENT) * geometry.area
            mass = rod.small_end_mass + engine.cylinders.piston_mass
            # The output is the piston's force on the liner.
            pressed = -(out[f"piston[{c + 1}].side_force"] + 1j * gas) * bank - mass * (small2 + 1j * GRAVITY)
            carried = -rod.big_end_mass * (end2 + 1j * GRAVITY)
            if joint is not None:
                assert abs(loads[c] - pressed - carried) < 1e-4 * scale
            else:
                carried -= loads[c]
            force += pressed + carried
            moment += (small.conjugate() * pressed + end.conjugate() * carried).imag
            moment -= remainder_inertia(rod) * (along.conjugate() * along2).imag
        assert abs(force) < 2e-5 * scale
        assert abs(moment) < 2e-5 * scale * engine.rod.length


@SHAPES
def test_torque_in_closed_form_is_that_of_the_force(engine):
    """−½ J' Ω² − h p A and weight against the kernels' force on each pin; J' against differences of J."""
    speed = 170.0
    simulation = started(engine, speed)
    torque = entry.rigid_torque(simulation.model, speed, 180)
    rods = Rods.of_engine(engine, simulation.body, GRAVITY)
    angle = np.arange(180) * (4.0 * math.pi / 180)
    each = np.repeat(angle[:, None], engine.n_cylinders, axis=1)
    still = rods.torque(each)
    gas = simulation.gas
    knots = np.arange(gas.motored.size) * (4.0 * math.pi / gas.motored.size)
    share = 1.0 - gas.falloff * (speed / gas.best_speed - 1.0) ** 2
    area = 0.25 * math.pi * engine.cylinders.bore**2
    pressure = gas.motored + share * (gas.fired - gas.motored) - entry.AMBIENT
    push = area * np.array([
        np.interp((angle - phase) % (4.0 * math.pi), knots, pressure, period=4.0 * math.pi)
        for phase in engine.firing_angles
    ]).T  # fmt: skip
    wanted = (still.weight - still.arm * push - 0.5 * still.slope * speed**2).sum(axis=1)
    np.testing.assert_allclose(torque, wanted, atol=2e-4 * np.abs(wanted).max())
    step = 1e-5
    ahead, behind = (rods.torque(each + s * step).inertia for s in (1.0, -1.0))
    slope = (ahead - behind) / (2.0 * step)
    np.testing.assert_allclose(still.slope, slope, atol=1e-7 * np.abs(still.inertia).max())


def on_springs(engine, body, speed, gas):
    """The running model of a crank on linear bearings."""
    return build_model(engine, body, Settings(**RIGID, bearings="linear"), speed, gas)


@SHAPES
def test_tangents_over_a_cycle_are_those_of_displaced_pins(engine):
    """Mean torque and its tangent by the pins' places, of a rigid crank whose throw differs a little."""
    body, gas, speed = running_crank(engine, "rigid"), GasTrace.from_engine(engine), 120.0
    angle = np.arange(9) * 4.0 * math.pi / 9
    _, forces, found = entry.rods_in_rotation(on_springs(engine, body, speed, gas), speed, angle.size)
    rods = Rods.of_engine(engine, body, 0.0)
    for c, pin in some(enumerate(engine.cylinders.pins)):
        x, y = body.positions[body.index(f"pin[{pin}]"), :2]
        # A rotation by φ: T' = −½ J'' Ω² − (h p A)', of the place's tangent at x = φ e_z × X, and −x·f.
        turn = np.array([-y, x])
        by_place = np.einsum("i,nij,j->n", turn, found[:, c], turn)
        by_place -= x * forces[:, c, 0] + y * forces[:, c, 1]
        step, column = 1e-5, np.zeros(engine.n_cylinders)
        column[c] = step
        ahead, behind = (rods.torque(angle[:, None] + s * column[None]) for s in (1.0, -1.0))
        push = [gas_forces(engine, speed, angle + s * step, gas, 1.0)[:, c] for s in (1.0, -1.0)]
        wanted = -0.5 * speed**2 * (ahead.slope[:, c] - behind.slope[:, c]) / (2.0 * step)
        wanted -= (push[0] * ahead.arm[:, c] - push[1] * behind.arm[:, c]) / (2.0 * step)
        np.testing.assert_allclose(by_place, wanted, atol=1e-6 * np.abs(wanted).max(), rtol=1e-6)


@pytest.mark.parametrize("engine", [SKEW, load_engine("single_petrol")], ids=["skew", "single"])
def test_the_moment_about_the_axis_goes_with_pins_that_are_displaced(engine):
    """One pressure at all angles does no work in a cycle, also on a crank beside its axis: its mean torque stays 0."""
    body, gas, speed = running_crank(engine, "rigid"), GasTrace.from_engine(engine), 120.0
    gas = replace(gas, motored=np.full(gas.motored.size, 4.0e6), fired=np.full(gas.motored.size, 4.0e6), own=())
    model = on_springs(engine, body, speed, gas)
    laws = entry.rods_in_rotation(model, speed, 90)[0].mean()
    # Rotation about the axis and translations across it, in the crank's modes.
    x, y = body.positions[0, :2]
    turn, *across = np.linalg.solve(body.shapes[0], np.array([[-y, x, 0, 0, 0, 1], *np.eye(6)[:2]]).T).T

    def torque(laws):
        """Torque of the rods by either translation of the crank."""
        still = laws._replace(place=0.0 * laws.place, velocity=0.0 * laws.velocity, forces=0.0 * laws.forces)
        own, none = (SmallMotions(model).equations(speed, one).stiffness for one in (laws, still))
        return np.array([turn @ (none - own)[:6, :6] @ way for way in across])

    at_rest = torque(laws._replace(forces=0.0 * laws.forces))  # as if the forces stayed at the undisplaced pins
    assert np.abs(torque(laws)).max() < 1e-6 * np.abs(at_rest).max()
    assert np.abs(at_rest).max() > 0.1 * np.abs(laws.forces).max()


@pytest.mark.parametrize("name", ENGINES)
def test_the_gas_work_of_a_cycle_is_accounted_for(name):
    settings, engine = Settings(**RIGID, bearings="linear", step=math.radians(1.25)), ENGINES[name]
    run = simulate(engine, running_crank(engine, "rigid"), settings, 200.0, settle=1e-5)
    energy = run_summary(run, "")["energy"]
    assert abs(energy["residual_of_gas_work"]) < 1e-5
    torque = float(np.mean(run.last_cycle("shaft.torque")[1][:-1]))
    assert torque == pytest.approx(mean_torque(engine, GasTrace.from_engine(engine), 200.0), rel=0.02)


@pytest.mark.parametrize("name", [*ENGINES, "single_petrol", "v_twin", "v6_split", "two_stroke_six"])
def test_forced_torsion_in_time_is_that_of_the_frequency_domain(name):
    """Orders of the pulley by harmonic balance against a run in time of the same crank, within 1e-4 of the largest."""
    engine = ENGINES.get(name) or replace(load_engine(name).without_additions, drive_line_chain=None, load=None)
    body, speed = running_crank(engine, "torsional"), 0.6 * engine.best_speed
    # Without weight: the frequency domain leaves out that of an unbalanced crank.
    settings = Settings(crank="torsional", block="ground", bearings="held", step=math.radians(1.25), gravity=0.0)
    run = simulate(engine, body, settings, speed, settle=1e-5)
    orders = tuple(0.5 * k for k in range(1, 25))
    wanted = frequency_run_up(engine, body, settings, np.array([speed]), orders, HARMONIC_BALANCE).torsion[0]
    angle, torsion = run.angle, run.outputs["pulley.torsion"]
    found = order_amplitudes(last_cycle(angle, torsion, 1440))[1][:24]
    np.testing.assert_allclose(np.abs(found), np.abs(wanted), atol=1e-4 * np.abs(found).max())


@SHAPES
def test_strokes_and_volumes_are_those_of_the_path(engine):
    """Against the geometry in complex numbers, sampled at 0.01 degrees."""
    simulation = started(engine, 100.0)
    theta, geometry, swept = np.arange(36000) * (2.0 * math.pi / 36000), Geometry(engine), 0.0
    for c in range(engine.n_cylinders):
        bank = np.exp(1j * engine.cylinders.bank_angles[c])
        height = (geometry.bodies(c, theta)[1] / bank).imag
        high, low = dead_centre_heights(engine, c)
        assert (high, low) == pytest.approx((height.max(), height.min()), abs=2e-9)
        assert math.remainder(dead_centre_angles(engine, c)[0] - theta[height.argmax()], 2 * math.pi) < 2e-4
        assert entry.stroke(simulation.model, c) == pytest.approx(np.ptp(height), abs=2e-6)
        stroke = np.ptp(height) if engine.articulations[c] else 2.0 * engine.throws[c]
        swept += geometry.area * stroke
        some = theta[::3000]
        above = np.ptp(height) / (engine.cylinders.compression_ratio - 1)
        volume = geometry.area * (height.max() - height[::3000] + above)
        if engine.articulations[c] is not None:
            found, slope = cylinder_volume(engine, some - engine.firing_angles[c], c)
            np.testing.assert_allclose(found, volume, rtol=1e-6)
            rise = piston_height(engine, c, some)[1]
            np.testing.assert_allclose(slope, -geometry.area * rise, rtol=1e-9)
            kernel = [entry.gas_volume(simulation.model, c, one) for one in some.tolist()]
            np.testing.assert_allclose(kernel, volume, rtol=1e-6)
    assert engine.displacement == pytest.approx(swept, rel=1e-6)


def test_piston_outputs_follow_the_path():
    run = simulate(V12, running_crank(V12, "rigid"), Settings(**RIGID, bearings="held"), 150.0, cycles=1)
    angle = run.last_cycle("crank.angle")[1]
    for c in (0, 6, 9):
        position = run.last_cycle(f"cylinder[{c + 1}].piston_position")[1]
        height, _ = piston_height(V12, c, angle)
        np.testing.assert_allclose(position, dead_centre_heights(V12, c)[0] - height, atol=1e-9)
        volume = run.last_cycle(f"cylinder[{c + 1}].volume")[1]
        np.testing.assert_allclose(volume, cylinder_volume(V12, angle - V12.firing_angles[c], c)[0], rtol=1e-6)


@pytest.mark.parametrize("engine", [V12, SKEW, load_engine("diesel_v8")], ids=["v12", "skew", "v8"])
def test_lean_of_a_rod_is_that_of_its_ends(engine):
    angle = np.linspace(0.0, 2.0 * math.pi, 200)
    for c in some(range(engine.n_cylinders)):
        along = Geometry(engine).bodies(c, angle)[2]
        lean, slope = rod_lean(engine, c, angle)
        np.testing.assert_allclose(np.exp(1j * lean), along / 1j, atol=1e-12)
        np.testing.assert_allclose(slope, np.gradient(np.unwrap(lean), angle, edge_order=2), atol=2e-3)


def test_knuckle_pins_have_loads_and_no_specific_load():
    run = simulate(V12, running_crank(V12, "rigid"), Settings(**RIGID, bearings="linear"), 200.0, cycles=1)
    ends = bearing_report(run, V12).big_ends
    assert all(one.specific_load is not None for one in ends[:6])
    assert all(one.specific_load is None and one.load.value > 0.0 for one in ends[6:])


@pytest.mark.parametrize("count", [3, 5, 7, 9])
def test_radial_engines_fire_every_second_cylinder_evenly(count):
    order = (*range(1, count + 1, 2), *range(2, count, 2))
    banks = tuple(2.0 * math.pi * k / count for k in range(count))
    made = replace(
        RADIAL, cylinders=replace(RADIAL.cylinders, firing_order=order, pins=count * (1,), bank_angles=banks)
    )
    check_engine(made)
    assert firing_summary(made) == {"order": list(order), "intervals_deg": pytest.approx(count * [720.0 / count])}


@pytest.mark.parametrize(("engine", "of", "changes", "place"), [
    (RADIAL, "cylinders", {"rods_on_pin": "side-by-side"}, "articulated_rod.length: is there, but no rod hangs"),
    (RADIAL, "cylinders", {"rod_offsets": (-0.01, -0.01, 0.01, 0.01, 0.0)}, "cylinders.rod_offsets: "),
    (RADIAL, "articulated_rod", {"length": 0.03}, "articulated_rod.length: 30 mm is too short for cylinder 2"),
    (RADIAL, "articulated_rod", {"knuckle_angles": (0.0, 1.0)}, "knuckle_angles: 2 angles for 5 cylinders"),
    (RADIAL, "articulated_rod", {"knuckle_angles": (1.0,) * 5}, "knuckle_angles: is 57.3 deg for cylinder 1"),
    (RADIAL, "articulated_rod", {"knuckle_radius": 0.3}, "knuckle_radius: 300 mm is no less than"),
    (RADIAL, "articulated_rod", None, "rods_on_pin: is articulated; add the table [articulated_rod]"),
    (load_engine("four_petrol"), "cylinders", {"rods_on_pin": "articulated"}, "no pin of cylinders.pins has two"),
])  # fmt: skip
def test_what_cannot_be_is_told_in_one_line(engine, of, changes, place):
    with one_line(place):
        check_engine(replace(engine, **{of: changes and replace(getattr(engine, of), **changes)}))


@pytest.mark.filterwarnings("error")
def test_usual_rods_raise_no_doubts_and_strange_ones_do():
    for engine in ENGINES.values():
        check_engine(engine)
    for changes, says in (
        ({"knuckle_radius": 0.02}, "articulated_rod.knuckle_radius: over the crank pin's radius it is"),
        ({"length": 0.1}, "articulated_rod.length: with knuckle_radius over rod.length it is"),
        ({"knuckle_angles": (0.0, -1.2, -2.5, -3.7, -5.0)}, "off the bank of cylinder 2"),
    ):
        with pytest.warns(UserWarning, match=says):
            check_engine(replace(RADIAL, articulated_rod=replace(RADIAL.articulated_rod, **changes)))


@pytest.mark.parametrize(("choices", "says"), [
    ({"big_ends": "impedance"}, "an articulated rod hangs on its master; leave big ends rigid"),
    ({"pistons": "guided"}, "guided pistons and block 'ground' do not take the side force"),
    ({"block": "flexible"}, "guided pistons and block 'flexible' do not take the side force"),
])  # fmt: skip
def test_levels_that_do_not_go_with_it_are_refused_in_one_line(choices, says):
    with one_line(says):
        Simulation(V12, running_crank(V12, "rigid"), Settings(**RIGID | {"bearings": "linear"} | choices)).initialize()


def test_no_flexible_block_is_chosen_for_it():
    eight = load_engine("diesel_v8")
    assert resolved(Settings(), eight).block == "flexible"
    cylinders = replace(eight.cylinders, rods_on_pin="articulated", rod_offsets=())
    rod = ArticulatedRod(0.8 * eight.rod.length, 0.5, 0.5, 0.01, 0.2 * eight.rod.length)
    chosen = resolved(Settings(), replace(eight, cylinders=cylinders, articulated_rod=rod))
    assert (chosen.block, chosen.pistons) == ("ground", "rigid")
