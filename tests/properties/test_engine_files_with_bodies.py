"""Bodies and connections as an engine file adds them, against equations of their own."""

import math
from dataclasses import replace

import numpy as np
import pytest
from one_line import one_line
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from started import at_speed, series

import cranktrain as ct
from cranktrain.core.reduced_body import rigid_body
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.model.pack import pack
from cranktrain.dynamics.outputs.register import output_family
from cranktrain.engine.additions import BodyTable, ConnectionTable, FrameTable
from cranktrain.engine.connections import Belt, Film, GearMesh, Load, Spring
from cranktrain.engine.file import load_engine
from cranktrain.store.bodies import export_body
from cranktrain.structure.additions import check_added

SPEED = 2000.0 * math.pi / 30.0
PERIOD = 4.0 * math.pi / SPEED
GRAVITY = 9.81
RADIUS, STIFF, LOST, TENSION = 0.045, 6e5, 60.0, 500.0  # m, N/m, N s/m, N: of the belt
CAM, HEIGHT = 3e-3, 0.4  # kg m², m
FILM = Film(diameter=0.03, width=0.018, clearance=2.5e-5, contact_height=1e-6, contact_pressure=3e8)


def assembled(engine, **more):
    """An engine with a torsional crank by formula, in held bearings."""
    engine = replace(engine, **more, reduction=replace(engine.reduction, torsional_source="ker-wilson"))
    return ct.assemble(engine, ct.Settings(crank="torsional", bearings="held"), inherit=False)


def gear(name, axis, inertia=3e-3):
    """A gear wheel on an axis of its own that turns backwards."""
    place = {"x": axis[:1], "y": axis[1:], "z": (0.1,)}
    return BodyTable(name, "back", mass=2.0, inertia=(2e-3, 2e-3, inertia), centre=(*axis, 0.1), interfaces=("gear",),
                     **place)  # fmt: skip


HOLD = Spring((2e8, 2e8, 1e7), (1e4, 1e4, 1e3), (1e5, 1e5, 0.0), (1e2, 1e2, 0.0))


def with_camshaft(name, order):
    """An engine whose belt drives a camshaft on two films, loaded by a mean torque and by one of an ``order``."""
    places = {"x": (0.0,) * 3, "y": (HEIGHT,) * 3, "z": (-0.06, 0.0, 0.4)}
    cam = BodyTable(
        "cam", "half", mass=4.0, inertia=(0.03, 0.03, CAM), centre=(0.0, HEIGHT, 0.2),
        interfaces=("pulley", "front", "rear"), **places,
    )  # fmt: skip
    links = (
        ConnectionTable("belt", "belt", ("crank.pulley", "cam.pulley"), belt=Belt(RADIUS, STIFF, LOST, TENSION)),
        ConnectionTable("front", "film", ("cam.front", "ground"), film=FILM),
        ConnectionTable("rear", "film", ("cam.rear", "ground"), film=FILM),
        ConnectionTable("axial", "spring", ("cam.front", "ground"), spring=Spring((0.0, 0.0, 1e7), (0.0, 0.0, 1e3))),
        ConnectionTable("mean", "load", ("cam.rear", "ground"), load=Load(torque=(0.0, 0.0, -6.0))),
        ConnectionTable("valves", "load", ("cam.rear", "ground"), load=Load((0.0,) * 3, (0.0, 0.0, 15.0), order, 0.7)),
    )
    return assembled(load_engine(name), frame=(FrameTable("half", 0.5, (0.0, HEIGHT)),), body=(cam,), connection=links)


@pytest.mark.parametrize(("name", "order"), [("single_petrol", 2.0), ("diesel_i6", 3.0)])
def test_a_camshaft_on_a_belt_turns_as_newtons_equation_solved_by_radau(name, order):
    """Its belt carries valve torque and friction, and its films carry weight and belt."""
    made = with_camshaft(name, order)
    run = at_speed(SPEED, made.engine, made.body, made.settings, None, made.parts)
    found = run_cycles(run, None, 1e-4, None, None)
    d = {key: found.last_cycle(key)[1] for key in found.outputs}
    angle, cam = 0.5 * found.last_cycle("cam.speed")[0], d["cam.speed"]
    t = np.linspace(0.0, PERIOD, len(cam))
    on, off = (d[f"connection[belt].tension.running_{way}"] for way in ("on", "off"))
    torque = d["connection[mean].torque.z"] + d["connection[valves].torque.z"]
    friction = sum(d[f"connection[{end}].friction_torque"] for end in ("front", "rear"))
    belt, valves, lost = (np.trapezoid(one * cam, t) for one in (2.0 * RADIUS * (on - off), torque, friction))
    assert belt == pytest.approx(lost - valves, rel=1e-4)

    def across(kind, end):
        x, y = (d[f"connection[{end}].{kind}.{way}"] for way in "xy")
        return np.array([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y])

    upright = math.sqrt(1.0 - (RADIUS / HEIGHT) ** 2)
    held = sum(across("force", end)[1, :-1].mean() for end in ("front", "rear"))
    assert held == pytest.approx((on + off)[:-1].mean() * upright + 4.0 * GRAVITY, rel=1e-4)

    def curve(values):
        return CubicSpline(t, np.append(values[:-1], values[0]), bc_type="periodic")

    pulley, given, drag = curve(d["pulley.speed"]), curve(torque), curve(friction)
    turned, lift = pulley.antiderivative(), curve(1.15 * across("position", "front")[1]
                                                  - 0.15 * across("position", "rear")[1])  # fmt: skip

    def rates(time, state):
        cycles, at = divmod(time, PERIOD)
        slip = RADIUS * (cycles * turned(PERIOD) + turned(at)) - 2.0 * RADIUS * state[0]
        rate = RADIUS * pulley(at) - 2.0 * RADIUS * state[1]
        pulled = [TENSION + STIFF * (upright * lift(at) + way * slip) + LOST * (upright * lift(at, 1) + way * rate)
                  for way in (1.0, -1.0)]  # fmt: skip
        first, second = (0.5 * (one + math.sqrt(one * one + (0.01 * TENSION) ** 2)) for one in pulled)
        return [state[1], (2.0 * RADIUS * (first - second) + given(at) - drag(at)) / CAM]

    options = {"rtol": 1e-7, "atol": 1e-9, "max_step": PERIOD / 100, "t_eval": 3.0 * PERIOD + t[:-1]}
    exact = solve_ivp(rates, (0.0, 4.0 * PERIOD), [0.0, 0.5 * SPEED], method="Radau", **options).y[1]
    assert np.abs(exact - cam[:-1]).max() < 2e-3 * np.ptp(cam)


def test_each_impact_of_a_loose_gear_keeps_the_angular_momentum():
    """A gear with backlash rattles on the crank of a single: J Δω is the force's impulse less the drag."""
    axis, inertia, drag, step = (-0.09, -0.06), 1.5e-3, 0.4, PERIOD / 2880
    links = (
        ConnectionTable("mesh", "gear_mesh", ("crank.flywheel", "loose.gear"),
                        gear_mesh=GearMesh(2e7, 500.0, backlash=1e-4)),
        ConnectionTable("held", "spring", ("loose.gear", "ground"), spring=HOLD),
        ConnectionTable("drag", "load", ("loose.gear", "ground"), load=Load(torque=(0.0, 0.0, drag))),
    )  # fmt: skip
    made = assembled(
        load_engine("single_petrol"),
        frame=(FrameTable("back", -1.0, axis),),
        body=(gear("loose", axis, inertia),),
        connection=links,
    )
    found = series(at_speed(SPEED, made.engine, made.body, made.settings, None, made.parts), step, 2 * 2880)
    force, speed = found["connection[mesh].force.tangential"], found["loose.speed"]
    pushed = np.abs(force) > 0.5
    first, last = (np.flatnonzero(np.diff(pushed.astype(int)) == way) for way in (1, -1))
    last = last[last > first[0]]
    assert len(last) > 20
    impulses, errors = [], []
    for one, other in zip(first, last, strict=False):
        part = slice(one - 1, other + 3)
        impulse = 0.5 * math.hypot(*axis) * np.trapezoid(force[part], dx=step)
        gained = inertia * (speed[part][-1] - speed[part][0])
        impulses.append(abs(impulse))
        errors.append(abs(gained - impulse - drag * step * (len(speed[part]) - 1)))
    assert max(errors) < 0.01 * max(impulses)


def test_a_body_from_a_file_moves_as_the_same_body_in_the_table(tmp_path):
    """A rigid gear on springs; without its springs, or with another interface, one line refuses it."""
    axis = (-0.1, 0.0)
    turned = np.array(ct.Frame("back", -1.0, 0.0, axis).local((*axis, 0.1)))
    body = rigid_body("wheel", 2.0, np.diag([2e-3, 2e-3, 3e-3]), tuple(turned), {"gear": tuple(turned)})
    kept = BodyTable("wheel", "back", file=str(export_body(tmp_path / "wheel.h5", body)))
    mesh = ConnectionTable("mesh", "gear_mesh", ("crank.flywheel", "wheel.gear"), gear_mesh=GearMesh(5e7, 1e3))
    held = ConnectionTable("held", "spring", ("wheel.gear", "ground"), spring=HOLD)
    parts = {"frame": (FrameTable("back", -1.0, axis),), "connection": (mesh, held)}
    runs = []
    for table in (gear("wheel", axis), kept):
        made = assembled(load_engine("single_petrol"), body=(table,), **parts)
        runs.append(series(at_speed(SPEED, made.engine, made.body, made.settings, None, made.parts), 1e-4, 100))
    for name in ("wheel.speed", "connection[mesh].force.tangential", "flywheel.torsion"):
        assert np.abs(runs[0][name] - runs[1][name]).max() < 1e-9 * np.abs(runs[0][name]).max()
    with one_line("body 'wheel': no connection holds it along x"):
        check_added(replace(made.engine, connection=(mesh,)), own_crank=False, own_block=False)
    with one_line("connection 'held': body 'wheel' has no interface 'gaer'; did you mean 'gear'?"):
        wrong = replace(held, ends=("wheel.gaer", "ground"))
        check_added(replace(made.engine, connection=(mesh, wrong)), own_crank=False, own_block=False)


@pytest.mark.parametrize(("ends", "said"), [
    ("wheel.off ground", "'wheel.off' circles 5 mm from the axis of frame 'back'"),
    ("wheel.hub other.hub", "'other.hub' circles 400 mm from the axis of frame 'back'"),
    ("wheel.hub", "ends: the first one lies on the axis of its crank, where no piston would move"),
])  # fmt: skip
def test_a_bearing_that_circles_an_axis_and_a_rod_on_its_cranks_are_refused(ends, said):
    frames = ct.Frame("back", -2.0), ct.Frame("far", 1.0, axis=(0.4, 0.0))
    places = {"hub": (0, 0, 0), "off": (5e-3, 0, 0)}
    bodies = tuple(ct.Body(name, rigid_body(name, 2.0, np.eye(3), (0, 0, 0), places), frame)
                   for name, frame in (("wheel", "back"), ("other", "far")))  # fmt: skip
    rod = {"length": 0.1, "big_end_mass": 0.2, "small_end_mass": 0.1, "piston_mass": 0.3}
    law, data = ("film", vars(FILM)) if " " in ends else ("slider_crank", rod)
    first, second = (ct.End(*end.split(".")) for end in f"{ends} ground".split()[:2])
    with one_line("connection 'c': ", said):
        pack(ct.Topology(frames, bodies, (ct.Connection("c", law, (first, second), data),)))


def test_families_leave_out_names_with_brackets_of_their_own():
    assert output_family("connection[line[1]].force.x") == output_family("connection[front].force.y") == (
        "connection.force"
    )  # fmt: skip
