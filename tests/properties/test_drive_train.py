"""Drive lines that begin on an added body: torque through a dual-mass flywheel, and through gears."""

import math
from dataclasses import replace

import numpy as np
import pytest
from bodies import rigid_crank, series

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.dynamics.simulation import Settings, Simulation, simulate
from cranktrain.engine.additions import BodyTable, ConnectionTable, FrameTable
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.connections import Coupling, RigidGear, SlidingJoint, Spring
from cranktrain.engine.drive_line_chain import DriveLineChain
from cranktrain.engine.file import load_engine
from cranktrain.engine.torsional_chain import Chain, Disc, Shaft
from cranktrain.results.summary import run_summary

RPM = math.pi / 30.0
SPEED = 2000.0 * RPM
SPRINGS = {"single_petrol": (0.1, 800.0, 8.0), "diesel_i6": (0.4, 8000.0, 20.0)}
"""Inertia of the secondary mass, stiffness and damping of the bow springs of each engine."""
HOLD = Spring((1e8, 1e8, 1e8), (1e4, 1e4, 1e4), (1e6, 1e6, 0.0), (1e3, 1e3, 0.0))


def bare(name):
    return replace(load_engine(name), axial_path=None)


def body_behind(engine, name, inertia, frame="crank"):
    z = float(rigid_crank(engine).positions[-2, 2])
    moments = (0.6 * inertia, 0.6 * inertia, inertia)
    return BodyTable(
        name, frame, mass=8.0, inertia=moments, centre=(0.0, 0.0, z), interfaces=("hub",), x=(0.0,), y=(0.0,), z=(z,)
    )


def guide(name):
    return ConnectionTable(f"guide_{name}", "spring", (f"{name}.hub", "ground"), spring=HOLD)


def through_springs(engine):
    """The engine with a dual-mass flywheel: its drive line begins on the secondary mass."""
    inertia, stiffness, damping = SPRINGS[engine.name]
    bow = ConnectionTable("bow", "coupling", ("crank.flywheel", "second.hub"),
                          coupling=Coupling(stiffness=stiffness, damping=damping))  # fmt: skip
    line = replace(engine.drive_line, start="second.hub")
    return replace(
        engine, body=(body_behind(engine, "second", inertia),), connection=(bow, guide("second")), drive_line=line
    )


def as_chain(engine):
    """The same torsional system as discs and shafts on the flywheel."""
    line, (inertia, *law) = engine.drive_line, SPRINGS[engine.name]
    shafts = Shaft(("flywheel", "second"), *law), Shaft(("second", "dynamometer"), line.stiffness, line.damping)
    return replace(engine, drive_line_chain=DriveLineChain.of(Chain((Disc("second", inertia),), shafts)))


def started(engine, boundary="speed", crank=None, load=30.0, speed=SPEED):
    settings = Settings(crank="rigid", bearings="held", block="ground", boundary=boundary, step=math.radians(2.5))
    run = Simulation(engine, crank or rigid_crank(engine), settings)
    run.inputs[0] = speed
    if boundary == "torque":
        run.load_torque = load
    run.initialize()
    return run


@pytest.mark.parametrize(("name", "order"), [("single_petrol", 0.5), ("diesel_i6", 3.0)])
def test_torque_through_a_dual_mass_flywheel_is_that_of_two_masses(name, order):
    """Against a chain of discs, and closed forms below (single) and above (six) the secondary mass's resonance."""
    engine, line = bare(name), bare(name).drive_line
    inertia, stiffness, damping = SPRINGS[name]
    settings = Settings(crank="rigid", bearings="held", block="ground", step=math.radians(1.25))
    found, other = (
        simulate(one, rigid_crank(engine), settings, SPEED, settle=1e-6)
        for one in (through_springs(engine), as_chain(engine))
    )
    ours, theirs = found.outputs, other.outputs
    for output, same in (
        ("connection[bow].torque", -theirs["shaft.torque"]),
        ("flywheel.speed", theirs["flywheel.speed"]),
    ):
        assert np.abs(ours[output] - same).max() < 1e-4 * np.ptp(same), output
    # The mean torque goes through both springs, and twists the first one by torque over stiffness.
    torque = float(ours["shaft.torque"][1:].mean())
    assert ours["connection[bow].twist"][1:].mean() == pytest.approx(torque / stiffness, rel=1e-5)
    omega = order * SPEED
    flywheel, second = (
        np.exp(-1j * omega * found.time[1:]) @ (ours[f"{one}.speed"][1:] - SPEED) for one in ("flywheel", "second")
    )
    bow, shaft = stiffness + 1j * omega * damping, line.stiffness + 1j * omega * line.damping
    assert second / flywheel == pytest.approx(bow / (bow + shaft - inertia * omega**2), rel=1e-3)
    assert abs(run_summary(found, "")["energy"]["residual_of_gas_work"]) < 1e-5


def cycles(engine):
    if engine.name == "four_petrol":  # its gearbox shaft is made of finite elements
        found = run_summary(ct.simulate(engine, speed_rpm=2000.0, crank="torsional", bearings="linear"), "")
    else:
        settings = Settings(crank="rigid", bearings="held", block="ground", step=math.radians(2.5))
        found = run_summary(simulate(engine, rigid_crank(engine), settings, SPEED), "")
    assert abs(found["energy"]["residual_of_gas_work"]) < 1e-5
    assert found["settling"]["repeats_every_cycles"] == 1
    return found["settling"]["cycles"]


def geared_four(friction):
    """A four with table springs and friction, a joint, and a gearbox shaft that twists and bends between bearings."""
    engine = load_engine("four_petrol")
    second = body_behind(engine, "second", 0.1)
    z = [second.z[0] + along for along in (0.02, 0.1, 0.3, 0.38)]
    box = BodyTable("box", "crank", interfaces=("in", "front", "rear", "out"), z=tuple(z), stations=tuple(z),
                    diameters=(0.03, 0.04, 0.03))  # fmt: skip
    springs = Coupling(twists=(-1.0, 0.0, 1.0), torques=(-382.0, 0.0, 382.0), friction=friction)
    joint = SlidingJoint(joint="bolted", joint_stiffness=1e7, turning_stiffness=2e5, turning_damping=20.0)
    rest = [replace(guide(name), name=name, ends=(f"box.{name}", "ground")) for name in ("front", "rear")]
    added = (
        ConnectionTable("bow", "coupling", ("crank.flywheel", "second.hub"), coupling=springs), guide("second"),
        ConnectionTable("joint", "axial_joint", ("second.hub", "box.in"), axial_joint=joint), *rest,
    )  # fmt: skip
    line = replace(engine.drive_line, start="box.out")
    return engine, replace(engine, frame=(), body=(second, box), connection=added, drive_line=line)


@pytest.mark.parametrize(
    ("name", "friction"), [("single_petrol", 0.0), ("single_petrol", 5.0), ("diesel_i6", 0.0), ("diesel_i6", 15.0)]
)
def test_torque_through_a_dual_mass_flywheel_settles_as_the_plain_engine_does(name, friction):
    """Within three cycles more: secondary mass and crank have slow modes, in which bow springs stick and slide."""
    engine = through_springs(bare(name))
    bow, *others = engine.connection
    rubbing = replace(bow, coupling=replace(bow.coupling, friction=friction))
    assert cycles(replace(engine, connection=(rubbing, *others))) <= cycles(bare(name)) + 3


@pytest.mark.parametrize("friction", [0.0, 15.0])
def test_torque_through_table_springs_and_a_gearbox_shaft_settles_as_the_plain_four_does(friction):
    """The line behind has a disc on soft springs with friction too; it counts in the plain engine as well."""
    plain, geared = geared_four(friction)
    assert cycles(geared) <= cycles(replace(plain, frame=(), body=(), connection=())) + 6


@pytest.mark.parametrize("boundary", ["speed", "torque"])
@pytest.mark.parametrize("name", ["single_petrol", "diesel_i6"])
def test_a_drive_line_behind_rigid_gears_is_one_on_the_crank_by_the_square_of_the_ratio(name, boundary):
    """Wheel at half the crank's speed: stiffness, damping and inertias by its square, torque by the ratio itself."""
    engine, ratio, inertia = bare(name), 0.5, 0.3
    gears = ConnectionTable("gears", "rigid_gear", ("crank.flywheel", "out.hub"), rigid_gear=RigidGear())
    geared = replace(
        engine, frame=(FrameTable("half", ratio),), body=(body_behind(engine, "out", inertia, "half"),),
        connection=(gears, guide("out")), drive_line=replace(engine.drive_line, start="out.hub"),
    )  # fmt: skip
    line = engine.drive_line
    alike = replace(line, stiffness=line.stiffness * ratio**2, damping=line.damping * ratio**2,
                    dynamometer_inertia=line.dynamometer_inertia * ratio**2)  # fmt: skip
    heavier = rigid_crank(engine, inertia=(6.0, 6.0, 1.4 + inertia * ratio**2))
    found = series(started(geared, boundary, load=60.0), 576, 288)
    other = series(started(replace(engine, drive_line=alike), boundary, heavier, load=30.0), 576, 288)
    for output in ("pulley.speed", "crank.angle"):
        assert np.abs(found[output] - other[output]).max() < 1e-6 * np.ptp(other[output]), output
    apart = np.abs(ratio * found["shaft.torque"] - other["shaft.torque"]).max()
    assert apart < 1e-5 * np.ptp(other["shaft.torque"])


LOSSY = Shaft(("flywheel", "disc"), 1e4, 0.0, 0.1), Shaft(("disc", "dynamometer"), 1e4, 1.0)


def starting(start):
    return lambda engine: replace(engine, drive_line=replace(engine.drive_line, start=start))


WRONG = [
    (starting("secnd.hub"), "drive_line.start: no body 'secnd'"),
    (starting("second.hup"), "drive_line.start: body 'second' has no interface 'hup'"),
    (starting("second"), "names no interface"),
    (lambda engine: replace(engine, frame=(FrameTable("f", -1.0),), body=(replace(engine.body[0], frame="f"),)),
     "begin at one that turns forwards"),
    (lambda engine: replace(engine, axial_path=load_engine("diesel_i6").axial_path),
     "axial_path.joint: joins the shaft at the crank's flywheel"),
    (lambda engine: replace(engine, drive_line_chain=DriveLineChain.of(Chain((Disc("disc", 0.1),), LOSSY))),
     "drive_line_chain.loss_factors: act in the modes of crank and line alone"),
    (lambda engine: replace(engine, connection=(replace(engine.connection[0], ends=("second.hub", "ground")),
                                                *engine.connection[1:])),
     "connection 'bow': .* its ends turn 1 and 0 times as fast .* turns with the crank, so that this"),
    (lambda engine: replace(engine, connection=engine.connection[1:]),
     "no connection turns body 'second' with the crank"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "said"), WRONG, ids=[said[:30] for _, said in WRONG])
def test_where_no_drive_line_can_begin_is_told(change, said):
    engine = change(through_springs(bare("diesel_i6")))
    with pytest.raises(InputError, match=said):
        check_engine(engine)
        started(engine)
