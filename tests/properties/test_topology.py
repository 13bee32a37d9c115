"""Bodies, frames and connections beside an engine's own: limits, symmetries and balances."""

import math
import re
from dataclasses import replace
from functools import cache

import entry
import numpy as np
import pytest
from bodies import free_six, joined, rigid_crank
from bodies import series as outputs_of
from rods import FOUR, in_space, teeth
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from some import some
from started import at_speed

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import attach, check, rigid_body
from cranktrain.dynamics.simulation import Parts, simulate
from cranktrain.engine.additions import ConnectionTable
from cranktrain.engine.connections import Coupling
from cranktrain.engine.drive_line_chain import DriveLineChain
from cranktrain.engine.file import load_engine
from cranktrain.results.summary import run_summary
from cranktrain.structure.additions import read_added
from cranktrain.structure.assembly import checked

SPEED = 2000.0 * math.pi / 30.0
HELD = {"stiffness": (1e9, 1e9, 1e8), "damping": (1e4, 1e4, 1e3), "turning_stiffness": (1e6, 1e6, 0.0)}


def disc(name, frame, inertia=0.05, mass=5.0):
    moments = np.diag([0.6 * inertia, 0.6 * inertia, inertia])
    return ct.Body(name, rigid_body(name, mass, moments, (0.0, 0.0, 0.0), {"gear": (0.0, 0.0, 0.0)}), frame)


def held(name, **changed):
    return joined(f"hold_{name}", "spring", f"{name}.gear", **HELD | changed)


def test_rigid_body_is_what_attaching_gives():
    inertia, place = np.array([[0.1, 0.01, 0.02], [0.01, 0.12, -0.01], [0.02, -0.01, 0.05]]), (0.01, -0.02, 0.2)
    ends = {"a": (0.0, 0.0, 0.0), "b": (0.0, 0.1, 0.4)}
    own, small = (
        rigid_body("own", 5.0, inertia, place, ends),
        rigid_body("own", 1e-10, 1e-12 * np.eye(3), (0,) * 3, ends),
    )
    check(own)
    other = attach(small, "a", 5.0, inertia, place)
    for name in ("gyroscopic", "centrifugal", "stress_stiffness", "shapes", "euler_load", "translation"):
        np.testing.assert_allclose(getattr(own, name), getattr(other, name), atol=2e-7)


def axes(frame, angle):
    """Axes of a frame (3, 3), columns in the engine's, at a crank angle."""
    turned = frame.rate * angle + frame.angle
    cos, sin = math.cos(turned), math.sin(turned)
    own = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return np.diag([1.0, frame.sense, frame.sense]) @ own


@pytest.mark.parametrize("ratios", [(1.0, -2.0), (0.0, 2.0), (-1.5, -1.5), (3.0, 0.0)])
def test_terms_project_motion_of_a_point_at_any_crank_angle(ratios):
    """A direction fixed in one frame, motion of a point beside an interface given in another: as vectors say."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        given, own = (ct.Frame("f", ratio, rng.uniform(-3, 3), (0.1, 0.2)) for ratio in ratios)
        along, about, offset, move, turn = rng.normal(size=(5, 3))
        angle = rng.uniform(-10.0, 10.0)
        end, motion = ct.End("b", "i", tuple(offset)), np.concatenate((move, turn))
        found = entry.measured(end, own, given, along, about, angle, motion, -1.0)
        of_given, of_own = axes(given, angle), axes(own, angle)
        point = of_own @ (move + np.cross(turn, offset))
        exact = -((of_given @ along) @ point + (of_given @ about) @ (of_own @ turn))
        assert abs(found - exact) < 1e-12


@pytest.mark.parametrize("ratio", [1.0, -2.0])
def test_an_unbalanced_body_takes_its_centrifugal_force_along_as_it_turns(ratio):
    """A steady torque winds it up against a spring; the force on its bearing, m e Ω², turns by the same angle."""
    engine = replace(load_engine(FOUR), frame=(), body=(), connection=())
    own = rigid_body("b", 1.0, np.diag([6e-2, 6e-2, 1e-2]), (0.0, -0.01, 0.0), {"gear": (0.0, 0.0, 0.0)})
    ends, order = (ct.End("b", "gear"), ct.End("ground")), round(2.0 * abs(ratio))
    hold = ct.Connection("s", "spring", ends, HELD | {"turning_stiffness": (1e6, 1e6, 100.0),
                                                      "turning_damping": (1e3, 1e3, 5.0)})  # fmt: skip
    found = []
    for torque in (0.0, 5.0):
        load = ct.Connection("l", "load", ends, {"torque": (0.0, 0.0, torque), "force": (0.0, 1e-6, 0.0)})
        top = ct.Topology((ct.Frame("f", ratio, axis=(-0.2, 0.0)),), (ct.Body("b", own, "f"),), (hold, load))
        made = ct.assemble(engine, ct.Settings(crank="rigid", bearings="linear", block="ground", gas_load=0.0))
        parts = made.parts._replace(topology=top)
        run = simulate(made.engine, made.body, made.settings, SPEED, parts=parts, settle=1e-6)
        count = run.per_cycle
        x, turned = run.outputs["connection[s].force.x"][-count:], run.outputs["b.rotation"][-count:]
        found.append((np.fft.fft(x)[order] * 2.0 / count, turned.mean()))
    (before, at_rest), (after, wound) = found
    assert wound - at_rest == pytest.approx(0.05, rel=0.02)
    assert abs(before) == pytest.approx(0.01 * (ratio * SPEED) ** 2, rel=0.02)
    turned = np.angle(after / before)
    assert turned == pytest.approx(math.copysign(1.0, ratio) * (wound - at_rest), rel=0.02)


CASES = {
    "gear_mesh": {"stiffness": 2e8, "damping": 3e3, "backlash": 4e-5, "helix_angle": 0.3, "teeth": 20,
                  "variation": 0.2},
    "coupling": {"stiffness": 1e4, "damping": 3.0, "twists": (-0.1, 0.0, 0.2), "torques": (-900.0, 0.0, 700.0),
                 "friction": 40.0, "slip_speed": 0.5},
    "spring": {"stiffness": (1e6, 2e6, 3e6), "damping": (1.0, 2.0, 3.0), "turning_stiffness": (1.0, 2.0, 3.0)},
    "load": {"force": (1.0, 2.0, 3.0), "torque": (4.0, 5.0, 6.0), "order": 2.0, "phase": 0.3},
}  # fmt: skip


def frames_for(law):
    same = law == "coupling"
    return ct.Frame("a", 1.0, axis=(0.0, 0.0)), ct.Frame("b", 1.0 if same else -2.0, axis=(0.12, 0.05))


@pytest.mark.parametrize("law", CASES)
def test_tangents_are_derivatives(law):
    first, second = frames_for(law)
    joint = joined("c", law, "a.gear b.gear", **CASES[law])
    laws, sizes = entry.laws_of(ct.Topology((first, second), (disc("a", "a"), disc("b", "b")), (joint,)))
    rng, scale = np.random.default_rng(5), 1e-2 if law == "coupling" else 3e-5
    for call, size in some(zip(laws, sizes, strict=True)):
        for _ in range(12):
            place, velocity = rng.normal(size=4) * scale, rng.normal(size=4)
            call.tell_all(rng)
            found = call(place, velocity)
            for k in some(range(size)):
                step = np.zeros(4)
                step[k] = 1e-4 * scale
                by_place = (call(place + step, velocity).force - call(place - step, velocity).force) / (2e-4 * scale)
                step[k] = 1e-4
                by_velocity = (call(place, velocity + step).force - call(place, velocity - step).force) / 2e-4
                for own, exact in ((found.by_place, by_place), (found.by_velocity, by_velocity)):
                    np.testing.assert_allclose(own[:, k], exact, atol=2e-4 * max(1.0, np.abs(exact).max()))


def test_two_geared_discs_have_the_closed_forms_mode():
    """ω² = k cos²α (r₁²/J₁ + r₂²/J₂), Ker Wilson's two masses through a gear, however they are held across."""
    first, second, k, r = 0.5, 0.2, 5e6, (0.1, 0.05)
    frames = ct.Frame("a", 1.0), ct.Frame("b", -2.0, axis=(0.0, sum(r)))
    stiff = {"stiffness": (1e13, 1e13, 1e9), "damping": (0.0, 0.0, 0.0)}
    mesh = joined("mesh", "gear_mesh", "a.gear b.gear", stiffness=k, damping=0.0)
    bodies = disc("a", "a", first), disc("b", "b", second)
    modes = ct.topology_modes(ct.Topology(frames, bodies, (mesh, held("a", **stiff), held("b", **stiff))))
    along = k * math.cos(math.radians(20.0)) ** 2
    exact = math.sqrt(along * (r[0] ** 2 / first + r[1] ** 2 / second)) / (2.0 * math.pi)
    assert np.abs(modes.frequencies_hz / exact - 1.0).min() < 1e-6
    assert modes.frequencies_hz[0] < 1e-2  # both turn together
    together = modes.rotations["b"][0] / modes.rotations["a"][0]
    assert together == pytest.approx(2.0, rel=1e-9)  # each in its own sense, as the frames turn


def test_a_linear_bearing_is_springs_of_its_own():
    """A disc in one: its bounce along x and y, and nothing across the film's own directions."""
    bearing = {"diameter": 0.04, "width": 0.02, "clearance": 3e-5, "contact_height": 1e-6, "contact_pressure": 1e8,
               "level": "linear", "stiffness_x": 2e7, "stiffness_y": 5e7}  # fmt: skip
    link = joined("c", "film", "a.gear", **bearing)
    modes = ct.topology_modes(ct.Topology((ct.Frame("a", 1.0),), (disc("a", "a"),), (link,)))
    for stiffness in (2e7, 5e7):
        assert np.abs(modes.frequencies_hz - math.sqrt(stiffness / 5.0) / (2.0 * math.pi)).min() < 1e-6


def test_modes_with_a_crank_are_those_of_a_heavier_flywheel():
    """A geared disc whose teeth hardly give is its inertia by the ratio squared at the crank; energy adds up to 1."""
    _, body = six()
    z = float(body.positions[body.index("flywheel"), 2])
    inertia, ratio, apart = 0.3, 2.0, 0.3
    wheel = rigid_body("w", 5.0, np.diag([0.3, 0.3, inertia]), (0, 0, -z), {"gear": (0, 0, -z)})
    mesh = joined("mesh", "gear_mesh", "crank.flywheel w.gear", stiffness=1e13, damping=0.0)
    hold = joined("hold", "spring", "w.gear", stiffness=(1e13, 1e13, 1e13), turning_stiffness=(1e10, 1e10, 0.0))
    top = ct.Topology((ct.Frame("f", -ratio, axis=(apart, 0.0)),), (ct.Body("w", wheel, "f"),), (mesh, hold))

    def at_rest(crank):
        """Held across and along everywhere, and against turning by a spring at the pulley."""
        rows = crank.shapes[[crank.index("main[1]"), crank.index("main[7]")], :2].reshape(-1, crank.n_modes)
        axial, turn = crank.shapes[crank.index("thrust"), 2], crank.shapes[crank.index("pulley"), 5]
        stiffness = np.diag(crank.omega**2) + 1e13 * (rows.T @ rows + np.outer(axial, axial))
        return entry.CrankAtRest(crank, stiffness + 2e5 * np.outer(turn, turn), np.eye(crank.n_modes))

    modes = ct.topology_modes(top, at_rest(body))
    heavier = attach(body, "flywheel", 1e-9, inertia * ratio**2 * np.diag([0.6, 0.6, 1.0]), (0.0, 0.0, 0.0))
    other = ct.topology_modes(ct.Topology(), at_rest(heavier))
    low = other.frequencies_hz[0]
    k = int(np.abs(modes.frequencies_hz - low).argmin())
    assert modes.frequencies_hz[k] == pytest.approx(low, rel=1e-4) and low > 1.0
    assert modes.shares["crank"][k] + modes.shares["w"][k] == pytest.approx(1.0)
    assert modes.shares["w"][k] == pytest.approx(inertia * ratio**2 / float(heavier.inertia[2, 2]), rel=1e-2)


def test_a_coupling_is_the_spring_of_two_masses():
    frames = ct.Frame("a", 1.0), ct.Frame("b", 1.0, axis=(0.3, 0.0))
    link = joined("c", "coupling", "a.gear b.gear", stiffness=2e4)
    top = ct.Topology(frames, (disc("a", "a", 0.05), disc("b", "b", 0.02)), (link, held("a"), held("b")))
    found = ct.topology_modes(top).frequencies_hz
    exact = math.sqrt(2e4 * (1 / 0.05 + 1 / 0.02)) / (2.0 * math.pi)
    assert np.abs(found / exact - 1.0).min() < 1e-9


SHAFT = """
[[frame]]
name = "backwards"
ratio = { value = -2, unit = "1", origin = "chosen" }
angle = { value = 0.4, unit = "rad", origin = "chosen" }

[[body]]
name = "shaft"
frame = "backwards"
stations = { value = [100, 300, 1100], unit = "mm", origin = "chosen" }
diameters = { value = [30, 30], unit = "mm", origin = "chosen" }
interfaces = ["front", "rear"]
z = { value = [100, 1100], unit = "mm", origin = "chosen" }
"""


def shaft_of(tmp_path, text):
    path = tmp_path / "four.toml"
    path.write_text(re.split(r"\n\[\[frame\]\]", FOUR.read_text(encoding="utf-8"))[0] + text, encoding="utf-8")
    return read_added(load_engine(path))["shaft"]


def test_a_shaft_of_stations_has_a_beams_frequencies(tmp_path):
    """Free and uniform: bending by Euler and Bernoulli, a slender shaft; torsion c/2l; the mass of the cylinder."""
    body = shaft_of(tmp_path, SHAFT)
    check(body)
    length, diameter, e, rho = 1.0, 0.03, 210e9, 7850.0
    bending = 4.730041**2 / (2.0 * math.pi * length**2) * math.sqrt(e / rho) * diameter / 4.0
    torsion = math.sqrt(e / 2.6 / rho) / (2.0 * length)
    found = body.frequencies_hz[6:]
    assert found[0] == pytest.approx(bending, rel=5e-3)
    assert np.abs(found / torsion - 1.0).min() < 2e-3
    assert body.mass == pytest.approx(rho * math.pi * diameter**2 / 4.0 * length, rel=1e-12)
    assert body.centre[2] == pytest.approx(-0.6)  # the frame's z axis is the engine's reversed
    np.testing.assert_allclose(body.damping, 0.02 * body.omega)


def test_a_disc_beside_the_axis_is_the_shafts_unbalance(tmp_path):
    disc_rows = """discs = ["rear"]
disc_masses = { value = [2.0], unit = "kg", origin = "chosen" }
disc_polar = { value = [0.01], unit = "kg m^2", origin = "chosen" }
disc_diametral = { value = [0.006], unit = "kg m^2", origin = "chosen" }
disc_x = { value = [1.0], unit = "mm", origin = "chosen" }
disc_y = { value = [-2.0], unit = "mm", origin = "chosen" }
"""
    body = shaft_of(tmp_path, SHAFT + disc_rows)
    check(body)
    frame = ct.Frame("f", -2.0, 0.4)
    np.testing.assert_allclose(body.mass * body.centre[:2], 2.0 * frame.turned(np.array([1e-3, -2e-3, 0.0]))[:2])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [("value = [30, 30]", "value = [30]", "2 pieces"), ("value = [100, 1100]", "value = [100, 1200]", "station"),
     ("value = [100, 300, 1100]", "value = [300, 100, 1100]", "increasing")],
)  # fmt: skip
def test_a_shaft_that_cannot_be_is_told(tmp_path, old, new, said):
    with pytest.raises(InputError, match=said):
        shaft_of(tmp_path, SHAFT.replace(old, new))


@pytest.mark.parametrize("crossed", [False, True])
def test_a_belt_stretches_by_no_turning_and_has_the_closed_forms_mode(crossed):
    """ω² = 2 k (r₁²/J₁ + r₂²/J₂): two strands in parallel; both pull at rest and meet the pulleys at a tangent."""
    first, second, k, radius, ratio = 0.3, 0.02, 4e5, 0.09, -3.0 if crossed else 3.0
    for along, on_first, on_second in entry.strands(0.4, (radius, radius / 3.0), crossed):
        assert abs(along @ on_first) < 1e-15 and abs(along @ on_second) < 1e-15
        assert np.linalg.norm(along) == pytest.approx(1.0) and np.linalg.norm(on_second) == pytest.approx(radius / 3.0)
        between = np.array([0.4, 0.0, 0.0]) + on_second - on_first
        np.testing.assert_allclose(np.cross(between, along), 0.0, atol=1e-15)
    frames = ct.Frame("a", 1.0, axis=(0.1, 0.0)), ct.Frame("b", ratio, axis=(0.1, 0.4))
    stiff = {"stiffness": (1e13, 1e13, 1e9), "damping": (0.0, 0.0, 0.0)}
    belt = joined("belt", "belt", "a.gear b.gear", radius=radius, stiffness=k, damping=0.0, tension=300.0)
    bodies = disc("a", "a", first), disc("b", "b", second)
    modes = ct.topology_modes(ct.Topology(frames, bodies, (belt, held("a", **stiff), held("b", **stiff))))
    exact = math.sqrt(2.0 * k * radius**2 * (1.0 / first + 1.0 / 9.0 / second)) / (2.0 * math.pi)
    assert np.abs(modes.frequencies_hz / exact - 1.0).min() < 1e-4  # strands stay at rest but for 0.005 %
    assert modes.frequencies_hz[0] < 1e-2
    assert modes.rotations["b"][0] / modes.rotations["a"][0] == pytest.approx(3.0, rel=1e-6)


@cache
def six():
    return free_six(), rigid_crank(free_six())


def series(topology=None, body=None, steps=144, a_cycle=288, **settings):
    """Outputs by name over the first steps of a run, so many a cycle."""
    own, crank = six()
    chosen = ct.Settings(**{"crank": "rigid", "block": "ground", "step": math.radians(2.5)} | settings)
    run = at_speed(SPEED, own, body or crank, chosen, None, Parts(topology=topology))
    return outputs_of(run, steps, a_cycle)


def test_a_body_that_nothing_joins_to_the_crank_leaves_it_alone():
    top = ct.Topology((ct.Frame("f", -1.0, axis=(0.5, 0.0)),), (disc("far", "f"),), (held("far"),))
    with_it = series(top, steps=72)
    alone = series(steps=72)
    for name in ("pulley.torsion", "bearing[3].force.y", "crank.speed"):
        np.testing.assert_allclose(with_it[name], alone[name], rtol=0.0, atol=2e-6 * np.abs(alone[name]).max())


def test_gear_force_is_what_accelerates_the_driven_disc():
    """J ω̇ of a disc that a gear drives under load, against the force at its pitch circle; turned, the same."""
    _, body = six()
    z = float(body.positions[body.index("flywheel"), 2])
    inertia, distance, torque = 0.06, 0.24, 600.0
    results = []
    for turn, ratio in ((0.0, -2.0), (1.1, -2.0), (0.0, 2.0)):
        axis = (distance * math.cos(turn), distance * math.sin(turn))
        sense = -1.0 if ratio < 0.0 else 1.0
        wheel = rigid_body("w", 5.0, np.diag([0.04, 0.04, inertia]), (0, 0, sense * z), {"gear": (0, 0, sense * z)})
        frame = ct.Frame("f", ratio, axis=axis)
        mesh = joined("mesh", "gear_mesh", "crank.flywheel w.gear", stiffness=3e8, damping=2e4)
        damped = {"damping": (3e4, 3e4, 1e3), "turning_damping": (1e2, 1e2, 0.0)}
        hold = joined("hold", "spring", "w.gear", **HELD | damped)
        # The load keeps the teeth on one flank.
        load = joined("load", "load", "w.gear", torque=(0.0, 0.0, torque))
        top = ct.Topology((frame,), (ct.Body("w", wheel, "f"),), (mesh, hold, load))
        found = series(top, steps=1152, a_cycle=576)
        # Radius of the driven gear: outside, a/(1 + 2); the crank inside a ring or round it, a/(2 - 1).
        radius = distance / 3.0 if ratio < 0.0 else distance
        force, speed = (found[name][576:] for name in ("connection[mesh].force.tangential", "w.speed"))
        time = np.arange(speed.size) * 4.0 * math.pi / SPEED / 576
        # −F acts on the driven gear, where its pitch circle meets the driving one: before or behind its centre.
        own = force if ratio < 0.0 else -force
        swept = np.concatenate(([0.0], np.cumsum(0.5 * (own[1:] + own[:-1]) * np.diff(time)))) * radius + torque * time
        gained = inertia * (speed - speed[0])
        assert np.abs(swept - gained).max() < 1e-2 * np.ptp(gained)
        results.append(np.abs(force))
    np.testing.assert_allclose(results[1], results[0], atol=2e-2 * results[0].max())


def test_two_geared_shafts_move_as_an_independent_right_hand_side_says():
    """Two discs in space, teeth struck on both flanks between them by a torque to and fro, by SciPy's Radau."""
    stiffness, damping, play = 2e7, 2e3, 5e-5
    across, damper, torque, order, mass = 5e7, 2e3, 60.0, 12.0, 5.0
    inertias, ratios = (0.05, 0.02), (2.0, -4.0)
    frames = ct.Frame("a", ratios[0], axis=(0.5, 0.0)), ct.Frame("b", ratios[1], axis=(0.62, 0.16))
    mesh = joined("mesh", "gear_mesh", "a.gear b.gear", stiffness=stiffness, damping=damping, backlash=play)
    holds = tuple(held(name, stiffness=(across, across, 1e7), damping=(damper, damper, 1e3)) for name in "ab")
    load = joined("load", "load", "a.gear", torque=(0.0, 0.0, torque), order=order)
    bodies = tuple(disc(name, name, inertia, mass) for name, inertia in zip("ab", inertias, strict=True))
    own, crank = six()
    settings = ct.Settings(crank="rigid", block="ground", gas_load=0.0, dense_output="off")
    parts = Parts(topology=ct.Topology(frames, bodies, (mesh, load, *holds)))
    run = at_speed(SPEED, own, crank, settings, None, parts)

    def deviations(time):
        """Displacement of both centres, deviations of both angles from turning evenly, and their rates, (12,)."""
        theta, omega, _ = entry.frame(run)
        found = np.stack([in_space(run, frame, body, frame.ratio * theta, frame.ratio * omega)
                          for body, frame in zip(bodies, frames, strict=True)], axis=1)  # fmt: skip
        found[:, :, 2] += np.outer([theta - SPEED * time, omega - SPEED], ratios)
        return found.ravel()

    arms = 0.2 * abs(ratios[1]) / 6.0, -0.2 * ratios[0] / 6.0

    def rates(time, y):
        place, rate = y.reshape(2, 2, 3)
        loads = teeth(place, rate, (0.12, 0.16), arms, stiffness, damping, play)
        loads[:, :2] += -across * place[:, :2] - damper * rate[:, :2] + [0.0, -9.80665 * mass]
        loads[0, 2] += torque * math.cos(order * float(crank_angle(time)))
        return np.concatenate((rate.ravel(), (loads / [[mass, mass, inertia] for inertia in inertias]).ravel()))

    step, steps = 4.0 * math.pi / SPEED / 55296, 6912
    ours, angles = np.empty((steps + 1, 12)), np.empty(steps + 1)
    for k in range(steps + 1):
        if k > 0:
            run.step(k * step)
        ours[k], angles[k] = deviations(k * step), entry.frame(run)[0]
    times = np.arange(steps + 1) * step
    crank_angle = CubicSpline(times, angles)
    found = solve_ivp(rates, (0.0, times[-1]), ours[0], "Radau", times, rtol=1e-9, atol=1e-13, max_step=5.0 * step)
    exact = found.y.T
    gap = arms[0] * exact[:, 2] - arms[1] * exact[:, 5]
    assert gap.max() > 0.5 * play and gap.min() < -0.5 * play  # both flanks were struck
    assert (np.abs(ours - exact).max(axis=0) < 1e-5 * np.ptp(exact, axis=0)).all()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('frame = "forwards"', 'frame = "forward"', "forwards"),
        ('"balancer[1].gear", "balancer[2].gear"', '"balancer[1].gear", "balancer[3].gear"', "balancer[2]"),
        ('ends = ["crank.main[3]", "balancer[1].gear"]', 'ends = ["crank.main[3]"]', "two"),
        ("inertia = { value = [5.5e-3, 5.5e-3, 6e-4]", "inertia = { value = [5.5e-3, 5.5e-3]", "three moments"),
        ('interfaces = ["front", "gear", "rear"]', 'interfaces = ["front", "front", "rear"]', "twice"),
        ('name = "balancer[2]"', 'name = "balancer[1]"', "taken already"),
        ('name = "balancer[1]"', 'name = "block"', "taken already"),
        ("crank.main[3]", "crank.main[7]", "main[5]"),
        ('block.bore[2]"]', 'block.bohr[2]"]', "bore[2]"),
        ("value = [-40, -100], unit", "value = [40, -100], unit", "axes apart"),
    ],
)
def test_slips_in_a_file_are_told_with_the_nearest_valid_thing_before_any_work(tmp_path, old, new, said):
    text = FOUR.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "four.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(said)):
        checked(load_engine(path), ct.Settings())


@pytest.mark.parametrize(
    ("connection", "said"),
    [
        (joined("c", "gear_mesh", "a.gear a.gear", **CASES["gear_mesh"]), "one place"),
        (joined("c", "coupling", "a.gear b.gear", stiffness=1e4), "same ratio"),
        (joined("c", "spring", "a.gear"), "stiffness"),
        (joined("c", "gear_mesh", "a.gear b.gear", stiffness=1e8), "damping"),
        (joined("c", "coupling", "a.gear b.gear", stiffness=-1.0), "not within"),
        (joined("c", "spring", "a.hub", **HELD), "gear"),
    ],
)  # fmt: skip
def test_what_a_law_cannot_join_is_told(connection, said):
    frames = ct.Frame("a", 1.0), ct.Frame("b", -2.0, axis=(0.2, 0.0))
    with pytest.raises(InputError, match=said):
        ct.topology_modes(ct.Topology(frames, (disc("a", "a"), disc("b", "b")), (connection,)))


FAST = 4000.0 * math.pi / 30.0


@cache
def four(balanced=True):
    engine = load_engine(FOUR)
    if not balanced:
        engine = replace(engine, frame=(), body=(), connection=())
    made = ct.assemble(engine, ct.Settings(crank="beam", bearings="impedance", block="flexible"), inherit=False)
    return simulate(made.engine, made.body, made.settings, FAST, parts=made.parts)


def order_force(run, order):
    """Amplitude of an order of the vertical force of all mounts, N."""
    force = sum(run.outputs[f"mount[{k}].force.y"][-run.per_cycle :] for k in range(1, 5))
    return 2.0 * abs(np.fft.rfft(force)[int(2 * order)]) / run.per_cycle


def test_a_connection_that_carries_nothing_keeps_no_run_from_being_periodic():
    """On ground the shafts' thrust springs carry rounding alone: straight teeth push nothing along the axis."""
    made = ct.assemble(load_engine(FOUR), ct.Settings(crank="beam", block="ground"), inherit=False)
    run = simulate(made.engine, made.body, made.settings, FAST, parts=made.parts)
    size = {name: np.abs(run.outputs[f"connection[{name}].force.z"]).max() for name in ("thrust_1", "thrust_2")}
    assert max(size.values()) < 1e-3  # N
    assert run.settling.repeats == 1 and "connection.force" in run.settling.left


def test_balancers_cancel_the_second_order_at_the_mounts():
    assert order_force(four(), 2) < 0.03 * order_force(four(balanced=False), 2)


def test_balancers_bearings_carry_their_centrifugal_force():
    """d'Alembert over a cycle: film and gear forces of a shaft against mass times acceleration of its centre."""
    run = four()
    n, mass, e = run.per_cycle, 1.6, 2.5046e-3
    out = {name: values[-n:] for name, values in run.outputs.items()}
    # Shaft 2 turns forwards; its axes lie at 2θ, its unbalance along −y of them. It is driven by shaft 1 alone.
    angle = 2.0 * out["crank.angle"]
    films = [np.array([out[f"connection[{end}_2].force.{way}"] for way in "xy"]) for end in ("front", "rear")]
    cos, sin = np.cos(angle), np.sin(angle)
    fx, fy = sum(films)
    force = np.array([cos * fx - sin * fy, sin * fx + cos * fy])
    # The second gear feels the opposite of the first one's; from shaft 1 towards shaft 2 is +x, along is +y.
    force -= np.array([out[f"connection[balancer_gear].force.{way}"] for way in ("radial", "tangential")])
    closed = mass * e * (2.0 * out["crank.speed"]) ** 2 * np.array([-sin, cos])
    weight = np.array([0.0, -mass * 9.81])[:, None]
    # The block shakes the shaft besides, but hardly at the second order, which the shafts cancel.
    found, exact = (np.fft.rfft(values, axis=1)[:, 4] for values in (force + weight, closed))
    assert np.abs(found - exact).max() < 1e-2 * np.abs(exact).max()


def test_friction_of_a_dual_mass_flywheel_is_its_hysteresis():
    """Torque over twist goes round a loop, in which friction is more than a fifth of the work."""
    _, body = six()
    z = float(body.positions[body.index("flywheel"), 2])
    mass = rigid_body("secondary", 5.0, np.diag([0.1, 0.1, 0.15]), (0.0, 0.0, z), {"hub": (0.0, 0.0, z)})
    law = {"stiffness": 8e3, "damping": 1.0, "friction": 15.0, "slip_speed": 0.05}
    bow = joined("bow", "coupling", "secondary.hub crank.flywheel", **law)
    guide = joined("guide", "spring", "secondary.hub", **HELD)
    top = ct.Topology((), (ct.Body("secondary", mass, "crank"),), (bow, guide))
    found = series(top, steps=6 * 576, a_cycle=576)
    torque, twist, rate = (found[f"connection[bow].{name}"][-577:] for name in ("torque", "twist", "twist_rate"))
    exact = -8e3 * twist - rate - 15.0 * rate / np.hypot(rate, 0.05)
    np.testing.assert_allclose(torque, exact, atol=1e-9 * np.abs(exact).max())
    work = -np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(twist))
    assert 15.0 * np.abs(np.diff(twist)).sum() > 0.2 * abs(work)


@pytest.mark.slow
def test_modal_lists_the_crank_with_its_balancers():
    report = ct.modal(FOUR)
    modes = report["with_additions"]["modes"]
    assert all(sum(mode["shares"].values()) == pytest.approx(1.0, abs=1e-9) for mode in modes)
    assert {"balancer[1]", "balancer[2]"} <= {mode["shape"] for mode in modes}
    # Bending hardly knows of them: the first two modes are those of the crank alone.
    alone = [mode["hz"] for mode in report["cranktrain"]["modes"][:2]]
    found = [mode["hz"] for mode in modes if mode["shape"] == "bending"][:2]
    assert found == pytest.approx(alone, rel=2e-3)


def chained(stiffness, connections=(), damping=8.0):
    """The six whose drive line has the secondary mass of a dual-mass flywheel as its first disc; its steady run."""
    engine, body = six()
    line = DriveLineChain(
        ("flywheel", "secondary"), ("secondary", "dynamometer"), (stiffness, 4e4), ("secondary",), (0.5,),
        dampings=(damping, 40.0),
    )  # fmt: skip
    engine = replace(engine, drive_line_chain=line, connection=connections)
    return simulate(engine, body, ct.Settings(crank="rigid", block="ground"), 800.0 * math.pi / 30.0, settle=1e-7)


def test_a_coupling_at_a_disc_of_the_drive_line_acts_beside_its_shaft():
    """Half of the springs as the chain's shaft and half as a coupling move the crank as all of them as the shaft."""
    ends = ("crank.line[secondary]", "crank.flywheel")
    half = ConnectionTable("springs", "coupling", ends, coupling=Coupling(4000.0, 4.0))
    whole, split = chained(8000.0), chained(4000.0, (half,), 4.0)
    # The crank starts wound up by the line's own shafts, so that both differ in time.
    one, other = (np.abs(np.fft.rfft(run.outputs["flywheel.torsion"][1:]))[1:30] for run in (whole, split))
    assert np.abs(one - other).max() < 1e-3 * one.max()
    # All of the drive line's torque passes the springs, half of it the coupling.
    torque = split.outputs["connection[springs].torque"].mean()
    assert torque == pytest.approx(0.5 * whole.outputs["shaft.torque"].mean(), rel=1e-3)
    rubbing = replace(half, coupling=Coupling(0.0, 0.0, friction=30.0, slip_speed=0.05))
    energy = run_summary(chained(8000.0, (rubbing,)), "")["energy"]
    assert energy["losses_j"]["connections"] > 1.0
    assert abs(energy["residual_of_gas_work"]) < 1e-5
