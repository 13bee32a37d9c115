"""A rod and its piston as a connection: on an engine's own pins, and on two geared cranks with opposed pistons."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from bodies import joined
from one_line import one_line
from rods import beside, in_space, teeth
from scipy.integrate import solve_ivp
from started import series

import cranktrain as ct
from cranktrain.core.reduced_body import rigid_body
from cranktrain.dynamics.simulation import Simulation, simulate
from cranktrain.engine.additions import BodyTable, ConnectionTable, FrameTable
from cranktrain.engine.connections import GearMesh, SliderCrank, Spring
from cranktrain.engine.file import load_engine
from cranktrain.results.summary import run_summary

GROUND, SPEED = ct.End("ground"), 200.0


def on_own_pins(engine):
    """A second rod on each pin of an engine, in the cylinder of the first one."""
    links = []
    for c, pin in enumerate(engine.cylinders.pins):
        data = {"cylinder": c + 1, "bank": engine.cylinders.bank_angles[c], "offset": engine.offsets[c]}
        ends = ct.End("crank", f"pin[{pin}]", (0.0, 0.0, engine.rod_offsets[c])), GROUND
        links.append(ct.Connection(f"second[{c + 1}]", "slider_crank", ends, data))
    return ct.Topology((), (), tuple(links))


def constant_pressures(engine, made, topology):
    """Outputs by name of a cycle from the equilibrium at constant pressures, which foretell no cycle."""
    parts = made.parts if topology is None else made.parts._replace(topology=topology)
    run = Simulation(engine, made.body, made.settings, None, parts)
    run.inputs[0] = SPEED
    run.inputs[1 : 1 + engine.n_cylinders] = 1e5 * np.linspace(2.0, 9.0, engine.n_cylinders)
    run.initialize()
    return series(run, 4.0 * math.pi / SPEED / 288, 288)


@pytest.mark.parametrize("name", ["single_petrol", "diesel_i6", "diesel_v8"])
def test_a_second_rod_on_each_pin_is_rods_and_pistons_of_twice_the_mass(name):
    """With twice the piston's area, without structural damping, which follows the mass of the engine's own rods."""
    engine = load_engine(name)
    engine = replace(engine, damping=replace(engine.damping, kind="modal", ratio=0.0))
    settings = ct.Settings(crank="beam", bearings="linear", gas_source="input", newton_tolerance=1e-10)
    made = ct.assemble(engine, settings, inherit=False)
    rod, own = engine.rod, engine.cylinders
    twice = {key: 2 * getattr(rod, key) for key in ("big_end_mass", "small_end_mass", "inertia")}
    cylinders = replace(own, bore=math.sqrt(2.0) * own.bore, piston_mass=2 * own.piston_mass)
    heavy = replace(engine, rod=replace(rod, **twice), cylinders=cylinders)
    wanted, ours = constant_pressures(heavy, made, None), constant_pressures(engine, made, on_own_pins(engine))
    for output in ("flywheel.torsion", "pulley.torsion", "bearing[1].force.x", "bearing[1].force.y", "gas.work"):
        size = np.ptp(wanted[output])
        left = float(np.abs(ours[output] - wanted[output]).max())
        assert left < (5e-5 if any(engine.rod_offsets) else 1e-6) * size, output
    side, place = ours["connection[second[1]].force.side"], ours["connection[second[1]].piston.position"]
    assert np.abs(side - ours["piston[1].side_force"]).max() < 1e-9 * np.ptp(side)
    assert np.ptp(ours["cylinder[1].piston_position"] + place) < 1e-12


def test_opposed_pistons_on_two_geared_cranks_move_as_lagranges_equations_say():
    """Rods and pistons as functions of the cranks' motion, by Radau; their forces to 1e-5 of their range."""
    distance, throws, length, centre = 0.53, (0.05, 0.04), 0.2, 0.07
    hub, damper, mesh, mesh_damper, play = 5e8, 5e3, 1e8, 2e3, 1e-8
    crank_mass, inertias, rod_mass, rod_inertia, piston_mass = 8.0, (200.0, 80.0), 0.5, 3e-3, 0.6
    rod = {
        "length": length, "big_end_mass": rod_mass * (1.0 - centre / length),
        "small_end_mass": rod_mass * centre / length, "inertia": rod_inertia, "piston_mass": piston_mass,
    }  # fmt: skip
    frames, bodies, links = [], [], []
    for name, ratio, y, throw, inertia, bank, offset in (
        ("a", 1.0, 0.0, throws[0], inertias[0], 0.0, 4e-3),
        ("b", -1.0, distance, -throws[1], inertias[1], math.pi, -4e-3),
    ):  # fmt: skip
        frame = ct.Frame(f"frame_{name}", ratio, axis=(0.0, y))
        pin = frame.local(np.array([0.0, y + throw, 0.0]))
        made = rigid_body(f"crank_{name}", crank_mass, inertia * np.eye(3), (0, 0, 0), {"hub": (0, 0, 0), "pin": pin})
        frames.append(frame)
        bodies.append(ct.Body(made.name, made, frame.name))
        links += [
            joined(f"hub_{name}", "spring", f"crank_{name}.hub", stiffness=(hub, hub, 1e8),
                   damping=(damper, damper, 1e3), turning_stiffness=(1e6, 1e6, 0.0)),
            joined(f"rod_{name}", "slider_crank", f"crank_{name}.pin", bank=bank, offset=offset, **rod),
        ]  # fmt: skip
    links.append(joined("mesh", "gear_mesh", "crank_a.hub crank_b.hub", stiffness=mesh, damping=mesh_damper,
                        backlash=play))  # fmt: skip
    run = beside(ct.Topology(tuple(frames), tuple(bodies), tuple(links)), SPEED, dense_output="off")

    def parts(q):
        """Places across and along and angles of both rods' centres and pistons, (10,), from x, y, φ of both cranks."""
        found = []
        for throw, up, (x, y, turn) in zip((throws[0], -throws[1]), (1.0, -1.0), q.reshape(2, 3), strict=True):
            across, along = x - throw * np.sin(turn), y + throw * np.cos(turn)
            lean = np.arcsin((across - 4e-3) / length)
            piston = along + up * length * np.cos(lean)
            share = centre / length
            middle = across + share * (4e-3 - across), along + share * (piston - along)
            found += [*middle, up * lean, 4e-3 + 0.0 * x, piston]
        return np.array(found)

    weights = np.array([rod_mass, rod_mass, rod_inertia, piston_mass, piston_mass] * 2)
    own_weights = np.array([crank_mass, crank_mass, inertias[0], crank_mass, crank_mass, inertias[1]])

    def slopes(q):
        return np.array([parts(q + way).imag for way in 1e-30j * np.eye(6)]).T * 1e30

    def rates(time, y):
        apart, moving = y.reshape(2, 6)
        ideal = np.array([0.0, 0.0, SPEED * time, 0.0, 0.0, -SPEED * time])
        q = ideal + apart
        v = moving + np.array([0.0, 0.0, SPEED, 0.0, 0.0, -SPEED])
        slope, step = slopes(q), 2e-3 / SPEED
        near, far = (slopes(q + far * step * v) - slopes(q - far * step * v) for far in (1.0, 2.0))
        curved = (8.0 * near - far) @ v / (12.0 * step)
        loads = np.zeros(6)
        loads[[1, 4]] = -9.80665 * crank_mass
        loads[[0, 1, 3, 4]] -= hub * apart[[0, 1, 3, 4]] + damper * moving[[0, 1, 3, 4]]
        arms = 0.5 * distance, -0.5 * distance
        loads += teeth(*y.reshape(2, 2, 3), (0.0, distance), arms, mesh, mesh_damper, play).ravel()
        falling = np.zeros(10)
        falling[[1, 4, 6, 9]] = -9.80665 * weights[[1, 4, 6, 9]]
        whole = np.diag(own_weights) + slope.T @ (weights[:, None] * slope)
        return np.concatenate((moving, np.linalg.solve(whole, loads + slope.T @ (falling - weights * curved))))

    def deviations(time):
        """What the run's cranks move besides their frames, in space."""
        return np.stack([in_space(run, frame, body, frame.ratio * SPEED * time, frame.ratio * SPEED)
                         for frame, body in zip(frames, bodies, strict=True)], axis=1).ravel()  # fmt: skip

    step, steps = 4.0 * math.pi / SPEED / 18432, 1536
    ours = np.empty((steps + 1, 12))
    for k in range(steps + 1):
        if k > 0:
            run.step(k * step)
        ours[k] = deviations(k * step)
    times = np.arange(0, steps + 1, 64) * step
    found = solve_ivp(rates, (0.0, times[-1]), ours[0], "Radau", times, rtol=1e-8, atol=1e-13)
    size = np.ptp(found.y.T, axis=0)
    assert (np.abs(ours[::64] - found.y.T).max(axis=0) < 1e-5 * size).all()


def opposed(engine, height):
    """An engine with a second crank over its own, geared to it, with rods like the engine's upside down."""
    throw, count, z = engine.throws[0], engine.n_cylinders, engine.cylinder_positions
    angles = np.array([engine.crankshaft.throw_angles[pin - 1] for pin in engine.cylinders.pins])
    pins = tuple(f"pin[{c + 1}]" for c in range(count))
    crank = BodyTable(
        "crank2", "upper", 10.0 * count, (0.4 * count, 0.4 * count, 0.05 * count), (0.0, height, sum(z) / count),
        (*pins, "front", "back", "flywheel"), (*(-throw * np.sin(angles)).tolist(), 0.0, 0.0, 0.0),
        (*(height - throw * np.cos(angles)).tolist(), height, height, height),
        (*z, z[0] - 0.05, z[-1] + 0.05, z[-1] + 0.06),
    )  # fmt: skip
    held = Spring((1e9, 1e9, 1e8), (2e4, 2e4, 1e4))
    links = [ConnectionTable("gears", "gear_mesh", ("crank.flywheel", "crank2.flywheel"), gear_mesh=GearMesh(2e7, 1e4))]
    links += [ConnectionTable(end, "spring", (f"crank2.{end}", "ground"), spring=held) for end in ("front", "back")]
    links += [
        ConnectionTable(f"rod[{c}]", "slider_crank", (f"crank2.pin[{c}]", f"block.liner[{c}]"),
                        slider_crank=SliderCrank(cylinder=c, bank=math.pi))
        for c in range(1, count + 1)
    ]  # fmt: skip
    return replace(engine, frame=(FrameTable("upper", ratio=-1.0, axis=(0.0, height)),), body=(crank,),
                   connection=tuple(links))  # fmt: skip


@pytest.mark.parametrize(("name", "height", "left"), [("single_petrol", 0.44, 5e-4), ("diesel_i6", 0.62, 2e-5)])
def test_an_engine_of_opposed_pistons_from_a_file(tmp_path, name, height, left):
    """The upper pistons do the work of the lower ones, and the gears bring it down; energy closes as without them."""
    plain = load_engine(name)
    file = tmp_path / "two_cranks.toml"
    file.write_text(opposed(plain, height).to_toml(), "utf-8")
    # Teeth ring at 1 kHz, so fewer samples see a wrong mean of force times speed.
    settings = ct.Settings(crank="rigid", bearings="linear", step=math.radians(1.0))
    runs = []
    for engine in (load_engine(file), plain):
        made = ct.assemble(engine, settings, inherit=False)
        runs.append(simulate(engine, made.body, made.settings, 2000.0 * math.pi / 30.0, parts=made.parts))
    run = runs[0]
    energy, own = (run_summary(one, "")["energy"] for one in runs)
    # The pressure follows the angle of the lower pin, by which the upper one is twisted.
    assert energy["gas_work_j"] == pytest.approx(2.0 * own["gas_work_j"], rel=5e-3)
    assert abs(energy["residual_of_gas_work"]) < left
    last = run.angle > run.angle[-1] - 4.0 * math.pi
    force, speed = (run.outputs[name][last] for name in ("connection[gears].force.tangential", "crank2.speed"))
    brought = float((force * 0.5 * height * speed).mean()) * 4.0 * math.pi / (2000.0 * math.pi / 30.0)
    assert abs(brought) == pytest.approx(own["gas_work_j"], rel=0.01)
    place = run.outputs["connection[rod[1]].piston.position"]
    assert np.abs(place - place.max() + run.outputs["cylinder[1].piston_position"]).max() < 2e-4


def test_a_rod_without_a_crank_or_without_masses_is_told():
    """Names of the connection and of the key come in one line."""
    engine = load_engine("single_petrol")
    made = ct.assemble(engine, ct.Settings(crank="rigid", bearings="linear"), inherit=False)

    def refused(*places, **data):
        topology = ct.Topology((), (), (ct.Connection("r", "slider_crank", places, data),))
        Simulation(engine, made.body, made.settings, None, made.parts._replace(topology=topology)).initialize()

    pin = ct.End("crank", "pin[1]")
    for words, places, data in (
        (("length", "cylinder"), (pin, GROUND), {}),
        (("length", "throw"), (pin, GROUND), {"cylinder": 1, "length": 0.02}),
        (("cylinder", "1 to 1"), (pin, GROUND), {"cylinder": 2}), (("pin", "turns"), (GROUND, pin), {"cylinder": 1}),
    ):  # fmt: skip
        with one_line("connection 'r'", *words):
            refused(*places, **data)
