"""Gears without give: planetary gears and gear trains by elimination, against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from some import some
from standing import rigid_block
from tests.bodies import free_six, joined, rigid_crank, series, started

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import in_modes, rigid_body
from cranktrain.dynamics.simulation import Parts, Settings, Simulation, simulate
from cranktrain.engine.file import load_engine
from cranktrain.results.strength.recorded_cycle import recorded_cycle
from cranktrain.results.summary import run_summary
from cranktrain.structure.assembly import running_crank

SUN, RING = 30, 70
PLANET = (RING - SUN) / 2
INERTIAS = {"sun": 0.02, "ring": 0.2, "carrier": 0.3, "planets": 0.004, "input": 0.1, "output": 0.5}
SPEED = 2000.0 * math.pi / 30.0
HOLD = {"stiffness": (1e8, 1e8, 1e8), "damping": (1e4, 1e4, 1e4), "turning_stiffness": (1e6, 1e6, 0.0),
        "turning_damping": (1e3, 1e3, 0.0)}  # fmt: skip


def rotor(name, frame, inertia, z=0.0):
    tensor = np.diag([0.6 * inertia, 0.6 * inertia, inertia])
    return ct.Body(name, rigid_body(name, 2.0, tensor, (0.0, 0.0, z), {"hub": (0.0, 0.0, z)}), frame)


def ends(*names):
    return tuple(ct.End(name) if name == "ground" else ct.End(name, "hub") for name in names)


def planetary_speeds(fixed):
    """Speeds of sun, ring, carrier and planets over the input's, by Willis; the input is the sun, or the ring."""
    if fixed == "ring":
        sun, ring, carrier = 1.0, 0.0, SUN / (SUN + RING)
    elif fixed == "carrier":
        sun, ring, carrier = 1.0, -SUN / RING, 0.0
    elif fixed == "sun":
        sun, ring, carrier = 0.0, 1.0, RING / (SUN + RING)
    else:
        sun, ring, carrier = 1.0, 0.4, (SUN + 0.4 * RING) / (SUN + RING)
    return {
        "sun": sun, "ring": ring, "carrier": carrier,
        "planets": ((SUN + PLANET) * carrier - SUN * sun) / PLANET,
    }  # fmt: skip


def gear_set(fixed, z=0.0, extra=()):
    """A planetary gear, one of its three at rest or none; input and output on couplings."""
    speeds = planetary_speeds(fixed)
    frames = tuple(ct.Frame(f"f_{name}", speed) for name, speed in speeds.items())
    turning = [name for name in speeds if name != fixed]
    bodies = [rotor(name, f"f_{name}", INERTIAS[name], math.copysign(z, speeds[name]) if z else 0.0)
              for name in turning]  # fmt: skip
    held = ["ground" if name == fixed else name for name in ("sun", "ring", "carrier")]
    gear = ct.Connection("gear", "planetary", ends(*held, "planets"), {"teeth_sun": SUN, "teeth_ring": RING})
    return ct.Topology(frames, tuple(bodies), (gear, *extra)), speeds


@pytest.mark.parametrize("fixed", ["ring", "carrier", "sun", "none"])
def test_a_planetary_gear_has_the_closed_forms_ratios_and_modes(fixed):
    """Two shafts on springs at two of its members: Lagrange's equations in the free rotations, to rounding."""
    top, speeds = gear_set(fixed)
    first, last = [name for name in ("sun", "ring", "carrier") if name != fixed][:2]
    springs = {first: 3e4, last: 8e4}
    shafts = {first: "input", last: "output"}
    bodies = tuple(rotor(shaft, f"f_{name}", INERTIAS[shaft]) for name, shaft in shafts.items())
    links = tuple(ct.Connection(shaft, "coupling", ends(shaft, name), {"stiffness": springs[name]})
                  for name, shaft in shafts.items())  # fmt: skip
    top = replace(top, bodies=top.bodies + bodies, connections=top.connections + links)
    modes = ct.topology_modes(top)
    # Rotations in space of sun, ring, carrier, planets by two free ones, or one where a member is at rest.
    basis = np.array([[1.0, 0.0], [0.0, 1.0], [SUN / (SUN + RING), RING / (SUN + RING)]])
    basis = np.vstack((basis, ((SUN + PLANET) * basis[2] - SUN * basis[0]) / PLANET))
    if fixed != "none":
        row = basis[("sun", "ring", "carrier").index(fixed)]
        basis = basis @ np.array([[-row[1]], [row[0]]])
    free = basis.shape[1]
    names = ("sun", "ring", "carrier", "planets")
    inertia = sum(INERTIAS[name] * np.outer(row, row) for name, row in zip(names, basis, strict=True) if name != fixed)
    mass = np.zeros((free + 2, free + 2))
    mass[:free, :free] = inertia
    stiffness = np.zeros_like(mass)
    for k, (name, shaft) in enumerate(shafts.items()):
        mass[free + k, free + k] = INERTIAS[shaft]
        twist = np.zeros(free + 2)
        twist[:free], twist[free + k] = basis[names.index(name)], -1.0
        stiffness += springs[name] * np.outer(twist, twist)
    exact = np.sqrt(np.maximum(eigh(stiffness, mass, eigvals_only=True), 0.0)) / (2.0 * math.pi)
    for frequency in some(exact[exact > 1.0]):
        k = int(np.abs(modes.frequencies_hz - frequency).argmin())
        assert modes.frequencies_hz[k] == pytest.approx(frequency, rel=1e-12)
        own = {
            name: modes.rotations[name][k] * (1.0 if speeds[name] >= 0.0 else -1.0) for name in names if name != fixed
        }
        willis = sum(teeth * own.get(name, 0.0) for name, teeth in
                     (("sun", SUN), ("ring", RING), ("carrier", -SUN - RING)))  # fmt: skip
        assert abs(willis) < 1e-10 * SUN * max(map(abs, own.values()))


def test_a_train_of_rigid_gears_is_one_rotor():
    """Three wheels: one free rotation, with each inertia by the square of its ratio."""
    frames = tuple(ct.Frame(name, ratio, axis=(x, 0.0)) for name, ratio, x in
                   (("a", 1.0, 0.0), ("b", -2.0, 0.3), ("c", 0.5, 0.9)))  # fmt: skip
    bodies = tuple(rotor(name, name, inertia) for name, inertia in (("a", 0.1), ("b", 0.02), ("c", 0.4)))
    gears = tuple(ct.Connection(f"gear_{pair}", "rigid_gear", ends(*pair)) for pair in ("ab", "bc"))
    hold = ct.Connection("hold", "spring", ends("a", "ground"), {"turning_stiffness": (0.0, 0.0, 5e4)})
    modes = ct.topology_modes(ct.Topology(frames, bodies, (*gears, hold)))
    whole = 0.1 + 0.02 * 4.0 + 0.4 * 0.25
    assert modes.frequencies_hz[-1] == pytest.approx(math.sqrt(5e4 / whole) / (2.0 * math.pi), rel=1e-12)
    turn = {name: modes.rotations[name][-1] for name in "abc"}
    assert turn["b"] == pytest.approx(2.0 * turn["a"], rel=1e-12)  # each in its own sense
    assert turn["c"] == pytest.approx(0.5 * turn["a"], rel=1e-12)


def run_beside(top):
    return series(started(SPEED, parts=Parts(topology=top), block="ground"), 288, 288)


def test_beside_a_running_engine_a_planetary_gear_is_the_inertia_that_it_reflects():
    """Sun on a coupling at the flywheel, carrier drives: the crank feels J_s + J_c i² + J_p j² at any time."""
    body = rigid_crank(free_six())
    z = float(body.positions[body.index("flywheel"), 2])
    link = joined("link", "coupling", "sun.hub crank.flywheel", stiffness=2e5, damping=20.0)
    top, speeds = gear_set("ring", z)
    guides = tuple(ct.Connection(f"guide_{one.name}", "spring", ends(one.name, "ground"), HOLD) for one in top.bodies)
    found = run_beside(replace(top, connections=(*top.connections, link, *guides)))
    whole = sum(INERTIAS[name] * speeds[name] ** 2 for name in ("sun", "carrier", "planets"))
    one = rotor("sun", "f_sun", whole, z)
    alone = ct.Topology(top.frames, (one,), (link, ct.Connection("guide_sun", "spring", ends("sun", "ground"), HOLD)))
    other = run_beside(alone)
    for name in ("connection[link].torque", "sun.speed", "pulley.torsion"):
        assert np.abs(found[name] - other[name]).max() < 1e-6 * np.abs(other[name]).max()
    for name in ("carrier", "planets"):
        np.testing.assert_allclose(found[f"{name}.speed"], speeds[name] * found["sun.speed"], rtol=1e-9)


BAD = [
    (("sun", "ground", "carrier", "planets"), {}, "ratio 0.3"),
    (("sun", "ground", "carrier"), {"teeth_ring": 20}, "no room for planets"),
    (("sun", "carrier"), {}, "three or four"),
    (("sun", "ground", "carrier"), {"teeth": 3}, "has no 'teeth'"),
]


@pytest.mark.parametrize(("names", "data", "said"), BAD, ids=[said for *_, said in BAD])
def test_what_cannot_mesh_is_told(names, data, said):
    top, _ = gear_set("ring")
    if said == "ratio 0.3":
        frames = tuple(replace(frame, ratio=0.31) if frame.name == "f_carrier" else frame for frame in top.frames)
        top = replace(top, frames=frames)
    gear = ct.Connection("gear", "planetary", ends(*names), {"teeth_sun": SUN, "teeth_ring": RING} | data)
    with pytest.raises(InputError, match=said):
        ct.topology_modes(replace(top, connections=(gear,)))


def wheel_on_crank(body, at="pulley", ratio=-2.0, inertia=0.02):
    """A wheel of an axis beside the crank's, joined to the crank by rigid gears, with guides that let it turn."""
    z = math.copysign(1.0, ratio) * float(body.positions[body.index(at), 2])
    gear = ct.Connection("gear", "rigid_gear", (ct.End("crank", at), *ends("wheel")))
    guide = ct.Connection("guide", "spring", ends("wheel", "ground"), HOLD)
    return ct.Topology((ct.Frame("f", ratio, axis=(0.2, 0.0)),), (rotor("wheel", "f", inertia, z),), (gear, guide))


def turns_of(engine, body, top, **levels):
    """Outputs of the first two cycles of a crank on its axis, by name, and the simulation."""
    settings = Settings(bearings="held", block="ground", **levels)
    run = Simulation(engine, body, settings, parts=Parts(topology=top))
    run.inputs[0] = SPEED
    run.initialize()
    return series(run, 576, 288), run


def with_inertia(body, at, inertia):
    """A crank on its axis with more polar inertia at an interface: Rayleigh's quotient in its own modes."""
    n, turn = body.n_modes, body.shapes[body.index(at), 5].copy()
    turn[:5] = 0.0
    mass, basis = np.eye(n) + inertia * np.outer(turn, turn), np.eye(n)
    basis[5, 5] = 1.0 / math.sqrt(mass[5, 5])
    others = np.eye(n)[:, 6:] - np.outer(basis[:, 5], basis[:, 5] @ mass[:, 6:])
    squares, modes = eigh(others.T @ (body.omega[:, None] ** 2 * others), others.T @ mass @ others)
    basis[:, 6:] = others @ modes
    heavier = replace(body, euler_load=body.euler_load + inertia * turn)
    return in_modes(heavier, basis, np.concatenate((np.zeros(6), np.sqrt(squares))))


@pytest.mark.parametrize("name", ["single_petrol", "diesel_i6"])
@pytest.mark.parametrize("kind", ["gear", "planetary"])
def test_rigid_gears_on_the_crank_add_the_inertia_that_they_reflect(name, kind):
    engine = replace(load_engine(name), axial_path=None)
    body = rigid_crank(engine)
    top, reflected = wheel_on_crank(body), 0.02 * 4.0
    if kind == "planetary":
        z = float(body.positions[body.index("flywheel"), 2])
        whole, speeds = gear_set("ring", z)
        gear = ct.Connection("gear", "planetary", (ct.End("crank", "flywheel"), *ends("ground", "carrier", "planets")),
                             {"teeth_sun": SUN, "teeth_ring": RING})  # fmt: skip
        guides = tuple(ct.Connection(f"guide_{one.name}", "spring", ends(one.name, "ground"), HOLD)
                       for one in whole.bodies[1:])  # fmt: skip
        top = ct.Topology(whole.frames, whole.bodies[1:], (gear, *guides))
        reflected = sum(INERTIAS[name] * speeds[name] ** 2 for name in ("carrier", "planets"))
    found, _ = turns_of(engine, body, top, crank="rigid")
    other, _ = turns_of(engine, rigid_crank(engine, inertia=(6.0, 6.0, 1.4 + reflected)), None, crank="rigid")
    for output in ("pulley.torsion", "shaft.torque", "torque.brake"):
        assert np.abs(found[output] - other[output]).max() < 1e-6 * np.abs(other[output]).max(), output
    wheel, ratio = ("wheel", -2.0) if kind == "gear" else ("planets", planetary_speeds("ring")["planets"])
    np.testing.assert_allclose(found[f"{wheel}.speed"], ratio * found["pulley.speed"], rtol=1e-9)


@pytest.mark.parametrize("name", ["single_petrol", "diesel_i6"])
def test_rigid_gears_on_an_elastic_crank_change_its_modes(name):
    """Frequencies of the running model, and its motion, are those of the crank with more inertia at the gear."""
    engine = replace(load_engine(name), axial_path=None)
    body = running_crank(engine, "torsional")
    body = replace(body, damping=np.zeros(body.n_modes))
    inertia = 0.01 * float(body.euler_load @ body.euler_load)
    found, run = turns_of(engine, body, wheel_on_crank(body, inertia=inertia), crank="torsional")
    heavier = with_inertia(body, "pulley", 4.0 * inertia)
    elastic = np.sqrt(run.model.omega2[11 : 5 + body.n_modes])  # behind the wheel's five free motions
    np.testing.assert_allclose(elastic, heavier.omega[6:], rtol=1e-9)
    other, _ = turns_of(engine, heavier, None, crank="torsional")
    for output in ("pulley.torsion", "flywheel.torsion", "shaft.torque"):
        assert np.abs(found[output] - other[output]).max() < 3e-5 * np.abs(other[output]).max(), output


def test_work_and_losses_of_an_engine_with_an_unbalanced_shaft_on_rigid_gears_balance():
    engine = free_six()
    body = rigid_crank(engine)
    top = wheel_on_crank(body, "main[3]")
    off = rigid_body("wheel", 2.0, np.diag([0.012, 0.012, 0.02]), (0.004, 0.002, -0.25), {"hub": (0.0, 0.0, -0.256)})
    top = replace(top, bodies=(ct.Body("wheel", off, "f"),))
    settings = Settings(crank="rigid", bearings="impedance", block="ground", step=math.radians(1.25))
    run = simulate(engine, body, settings, SPEED, parts=Parts(topology=top), settle=1e-5)
    assert abs(run_summary(run, "")["energy"]["residual_of_gas_work"]) < 1e-6


def test_what_rigid_gears_on_the_crank_cannot_do_is_told():
    engine = free_six()
    body = rigid_crank(engine)
    top = wheel_on_crank(body)
    levels = {"crank": "rigid", "bearings": "linear", "block": "ground"}
    wrong = replace(top.connections[0], ends=(ct.End("crank", "pulley"), ct.End("ground")))
    with pytest.raises(InputError, match="connection 'gear': gears need two frames that turn"):
        turns_of(engine, body, replace(top, connections=(wrong, top.connections[1])), crank="rigid")
    on_block = replace(top.connections[0], law="planetary", data={"teeth_sun": SUN, "teeth_ring": RING},
                       ends=(ct.End("crank", "pulley"), ct.End("block", "bore[1]"), *ends("wheel")))  # fmt: skip
    carrier = ct.Frame("f", SUN / (SUN + RING))
    geared = ct.Topology((carrier,), top.bodies, (on_block, top.connections[1]))
    parts = Parts(topology=geared, block=rigid_block(engine, body))
    with pytest.raises(InputError, match="connection 'gear': law 'planetary' holds no block that moves"):
        Simulation(engine, body, Settings(**levels | {"block": "flexible"}), parts=parts).initialize()
    parts = Parts(topology=top, data={"flywheel.polar_inertia": 0.9 * engine.flywheel.polar_inertia})
    with pytest.raises(InputError, match="modes include bodies on rigid gears"):
        Simulation(engine, body, Settings(**levels), parts=parts).initialize()
    run = Simulation(engine, body, Settings(**levels), parts=Parts(topology=top))
    with pytest.raises(InputError, match="connection 'gear': law 'rigid_gear' has no force"):
        recorded_cycle(run, engine)
