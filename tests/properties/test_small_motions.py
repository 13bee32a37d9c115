"""Small motions of bodies in turning frames, against closed forms and against runs."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bodies import free_six, joined
from small_block import single
from some import some
from started import at_speed

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.linear import SmallMotions
from cranktrain.dynamics.model.pack import pack
from cranktrain.dynamics.simulation import simulate
from cranktrain.dynamics.tangents import tangents_in_rotation
from cranktrain.engine.additions import BodyTable, ConnectionTable, FrameTable
from cranktrain.engine.connections import Coupling, GearMesh, Load, Spring
from cranktrain.structure.crank.level import crank_body
from cranktrain.structure.in_motion.eigenproblem import modes_in_motion, vibrations
from cranktrain.studies.campbell import campbell
from cranktrain.studies.run_up.free_decay import torsional_mode
from cranktrain.studies.torsion.frequency_run_up import frequency_run_up

MASS, POLAR, ACROSS, REACH = 6.0, 0.08, 0.05, 0.07
SIDE, TILT, LOST = 4e6, 3e4, 40.0  # N/m, N m/rad, N s/m


def overhung(ratio, held="ground"):
    """A disc that overhangs its bearing by REACH, in a frame that turns ``ratio`` times as fast as the crank."""
    frame = ct.Frame("own", ratio)
    place = {"end": tuple(frame.local((0.0, 0.0, 0.0)))}
    centre = frame.local((0.0, 0.0, REACH))
    disc = ct.rigid_body("disc", MASS, np.diag([ACROSS, ACROSS, POLAR]), tuple(centre), place)
    ends = "disc.end" if held == "ground" else f"disc.end {held}"
    law = {"stiffness": (SIDE, SIDE, 1e7), "turning_stiffness": (TILT, TILT, 1e5), "damping": (LOST, LOST, 0.0)}
    return ct.Topology((frame,), (ct.Body("disc", disc, "own"),), (joined("bearing", "spring", ends, **law),))


def whirl(spin, lost=LOST):
    """Exponents (4,) in space of a disc and its tilt at ``spin`` (rad/s), its bearing at −REACH from its centre."""
    row = np.array([1.0, -REACH])
    stiffness = SIDE * np.outer(row, row) + np.diag([0.0, TILT])
    damping = lost * np.outer(row, row) + np.diag([0.0, -1j * spin * POLAR])
    mass = np.diag([MASS, ACROSS])
    zero, unit = np.zeros((2, 2)), np.eye(2)
    return np.linalg.eigvals(
        np.block([[zero, unit], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    )


def nearest(values, wanted):
    return values[np.argmin(np.abs(values - wanted))]


@pytest.mark.parametrize("ratio", [1.0, -2.0, 0.5])
@pytest.mark.parametrize("speed", [50.0, 400.0])
def test_an_overhung_disc_whirls_forwards_and_backwards_as_the_closed_form(ratio, speed):
    """In its own axes, which turn at the spin, each whirl has the frequency in space less the spin."""
    model = pack(overhung(ratio))
    found = SmallMotions(model)
    values, shapes, _ = vibrations(
        found.equations(speed, tangents_in_rotation(model).mean()), 0.5, np.zeros((found.mode.size, 1))
    )
    spin = abs(ratio) * speed
    across = np.max(np.abs(shapes[(found.band == 0.0)]), axis=0) > 0.9 * np.max(np.abs(shapes), axis=0)
    exact = whirl(spin) - 1j * spin
    seen = np.where(exact.imag > 0.0, exact, exact.conj())
    for one in some(seen[seen.imag > math.pi]):
        assert nearest(values[across], one) == pytest.approx(one, rel=1e-9)


def formula(engine):
    """The engine with shaft stiffnesses by formula, which needs no finite elements."""
    return replace(engine, reduction=replace(engine.reduction, torsional_source="ker-wilson"))


def balanced(engine, main, z, inertia, torque=60.0):
    """An engine on springs with an unbalanced shaft geared to a main at −2, loaded so that its teeth never part."""
    axis = (-0.04, -0.1)
    shaft = BodyTable(
        name="shaft", frame="back", mass=1.6, inertia=(inertia,) * 3, centre=(axis[0], axis[1] - 2.5e-3, z),
        interfaces=("gear", "front", "rear"), x=(axis[0],) * 3, y=(axis[1],) * 3, z=(z, z - 0.08, z + 0.08),
    )  # fmt: skip
    held = Spring((2e8, 2e8, 1e7), (1e4, 1e4, 1e3))
    links = (
        ConnectionTable("mesh", "gear_mesh", (f"crank.main[{main}]", "shaft.gear"), gear_mesh=GearMesh(3e7, 3e3)),
        ConnectionTable("front", "spring", ("shaft.front", "ground"), spring=held),
        ConnectionTable("rear", "spring", ("shaft.rear", "ground"), spring=held),
        ConnectionTable("brake", "load", ("shaft.gear", "ground"), load=Load(torque=(0.0, 0.0, torque))),
    )
    return replace(formula(engine), frame=(FrameTable("back", ratio=-2.0, axis=axis),), body=(shaft,), connection=links)


def with_secondary(engine):
    """An engine with a second flywheel on springs of a coupling."""
    places = {"interfaces": ("hub",), "x": (0.0,), "y": (0.0,), "z": (1.0,)}
    disc = BodyTable(name="disc", frame="crank", mass=5.0, inertia=(0.1, 0.1, 0.15), centre=(0.0, 0.0, 1.0), **places)
    guide = Spring((1e8, 1e8, 1e8), (1e3,) * 3, (1e5, 1e5, 0.0))
    links = (
        ConnectionTable("springs", "coupling", ("disc.hub", "crank.flywheel"), coupling=Coupling(8e4, 15.0)),
        ConnectionTable("guide", "spring", ("disc.hub", "ground"), spring=guide),
    )
    return replace(formula(engine), body=(disc,), connection=links)


ENGINES = {
    "one cylinder with a geared shaft": lambda: balanced(single(), 1, 0.1, 3e-3),
    "one cylinder with a second flywheel": lambda: with_secondary(single()),
    "six with a geared shaft": lambda: balanced(free_six(), 4, 0.4, 3e-2, 600.0),
    "six with a second flywheel": lambda: with_secondary(free_six()),
}


@cache
def made(name):
    engine = ENGINES[name]()
    return engine, crank_body(engine, "torsional")


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("rpm", [1700.0])
def test_a_steady_state_in_the_frequency_domain_is_that_of_a_run_in_time(name, rpm):
    """Orders of the twist from pulley to flywheel above a tenth of the largest, to 1 %."""
    engine, body = made(name)
    settings, orders = ct.Settings(crank="torsional", block="ground", step=math.radians(0.5)), 0.5 * np.arange(1, 25)
    run = simulate(engine, body, settings, rpm * RPM, settle=1e-6)
    twist = (run.outputs["pulley.torsion"] - run.outputs["flywheel.torsion"])[-run.per_cycle :]
    sizes = 2.0 * np.abs(np.fft.rfft(twist)[1:25]) / run.per_cycle

    def twists(engine):
        found = frequency_run_up(engine, body, settings, np.array([rpm * RPM]), orders, "harmonic-balance").amplitudes
        return np.abs(found["pulley.torsion"][0] - found["flywheel.torsion"][0])

    large = sizes > 0.1 * sizes.max()
    assert twists(engine)[large] == pytest.approx(sizes[large], rel=1e-2)
    assert np.max(np.abs(twists(engine.without_additions) / sizes - 1.0)[large]) > 3e-2


@pytest.mark.parametrize("name", ENGINES)
def test_the_torsional_mode_in_motion_is_the_decay_of_a_run(name):
    engine, body = made(name)
    simulation = at_speed(1700.0 * RPM, engine, body, ct.Settings(crank="torsional", block="ground"))
    run_cycles(simulation, None, 1e-5, None, None)
    mode, found = torsional_mode(simulation), modes_in_motion(simulation)
    assert mode is not None
    assert found.torsional_hz == pytest.approx(mode.decay.imag / (2.0 * math.pi), rel=3e-3)


def test_a_campbell_diagram_has_the_whirl_of_an_added_disc():
    """An overhung disc beside a short crank, in the crank's axes; modes of the crank are as without the disc."""
    engine = formula(single())
    places = {"interfaces": ("end",), "x": (0.0,), "y": (0.0,), "z": (0.5,)}
    inertia, centre = (ACROSS, ACROSS, POLAR), (0.0, 0.0, 0.5 + REACH)
    disc = BodyTable(name="disc", frame="crank", mass=MASS, inertia=inertia, centre=centre, **places)
    spring = Spring((SIDE, SIDE, 1e9), turning_stiffness=(TILT, TILT, 1e6))
    held = ConnectionTable("bearing", "spring", ("disc.end", "ground"), spring=spring)
    speeds, body = np.array([100.0, 200.0, 300.0, 400.0]), crank_body(engine, "torsional")
    found = campbell(replace(engine, body=(disc,), connection=(held,)), body, speeds)
    alone = campbell(engine, body, speeds)
    of_crank = [k for k, kind in enumerate(found.kinds) if kind != "added"]
    assert found.hz[:, of_crank] == pytest.approx(alone.hz, rel=1e-9)
    added = found.hz[:, [k for k, kind in enumerate(found.kinds) if kind == "added"]]
    for speed, hz in zip(speeds.tolist(), added, strict=True):
        exact = np.abs((whirl(speed, 0.0) - 1j * speed).imag) / (2.0 * math.pi)
        for one in exact[exact > 60.0]:
            assert nearest(hz, one) == pytest.approx(one, rel=1e-9)
    assert added.shape[1] >= 4  # both whirls of displacement and tilt move apart with the speed


def test_what_has_no_linear_form_is_refused_with_its_reason():
    engine, body = made("one cylinder with a geared shaft")
    open_teeth = replace(engine.connection[0], gear_mesh=GearMesh(3e7, 3e3, backlash=1e-4))
    engine = replace(engine, connection=(open_teeth, *engine.connection[1:]))
    with pytest.raises(InputError, match="connection 'mesh': teeth with backlash come apart"):
        frequency_run_up(engine, body, ct.Settings(crank="torsional"), np.array([200.0]), [3.0])
