"""Frames of rods and pistons, ends that slide, laws of gas and liner, and what files say of them."""

from __future__ import annotations

import math
import re
import tempfile
from dataclasses import replace
from pathlib import Path

import entry
import numpy as np
import pytest
from bodies import joined, rigid_crank
from one_line import one_line
from refusals import refused_files, text_of
from rods import FOUR, pair, rotation
from scipy.interpolate import CubicSpline
from some import some

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import rigid_body
from cranktrain.dynamics.simulation import Parts, Simulation
from cranktrain.dynamics.topology.values import REST
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import checked

SLIDERS = [
    (1.0, ct.Slider((0.0, 0.06), 0.2)),
    (1.0, ct.Slider((0.03, -0.05), 0.18, bank=0.7, offset=0.004)),
    (-1.0, ct.Slider((0.44, 0.31), 0.16, bank=-2.0, offset=-0.01)),
    (2.0, ct.Slider((0.41, 0.27), 0.9, bank=0.3)),
]
AXES = [(0.0, 0.0), (0.0, 0.0), (0.4, 0.3), (0.4, 0.3)]


@pytest.mark.parametrize(("ratio", "slider", "axis"), [(*pair, axis) for pair, axis in zip(SLIDERS, AXES, strict=True)])
def test_rods_reach_from_the_pin_to_the_cylinders_axis(ratio, slider, axis):
    _, rod, piston = pair(ratio, slider, axis)
    arm = np.array(slider.pin) - axis
    for theta in np.linspace(-7.0, 7.0, 29):
        big, small = entry.moved(rod, theta), entry.moved(piston, theta)
        pin = rotation(ratio * theta) @ arm
        np.testing.assert_allclose(big.place, pin, atol=1e-15)
        end = pin + rotation(big.angle) @ [0.0, slider.length]
        np.testing.assert_allclose(small.place, end, atol=1e-15)
        cylinder = rotation(slider.bank).T @ end
        assert cylinder[0] == pytest.approx(slider.offset, abs=1e-15) and cylinder[1] > 0.0
        assert small.angle == slider.bank


@pytest.mark.parametrize(("ratio", "slider", "axis"), [(*pair, axis) for pair, axis in zip(SLIDERS, AXES, strict=True)])
def test_derivatives_of_frames_are_derivatives(ratio, slider, axis):
    step = 1e-3
    for frame in some(pair(ratio, slider, axis)[1:]):
        for theta in np.linspace(-4.0, 4.0, 17):
            rows = [entry.moved(frame, theta + k * step) for k in range(-3, 4)]
            spline = CubicSpline(np.arange(-3, 4) * step, [[row.angle, *row.place] for row in rows])
            moved, back = rows[3], rotation(rows[3].angle).T
            angle, *place = spline(0.0, 1)
            assert moved.angle1 == pytest.approx(angle, abs=1e-7)
            np.testing.assert_allclose(moved.place1, place, atol=1e-7)
            np.testing.assert_allclose(moved.own1, back @ place, atol=1e-7)
            first = [np.array([rows[k].angle1, *rows[k].place1]) for k in (2, 4)]
            angle, *place = (first[1] - first[0]) / (2.0 * step)
            assert moved.angle2 == pytest.approx(angle, abs=1e-5)
            np.testing.assert_allclose(moved.own2, back @ place, atol=1e-5)


def test_a_rod_that_is_too_short_is_told():
    with one_line("a rod of 62 mm is no longer than the crank's throw and the cylinder's offset"):
        ct.Frame("r", 1.0, slider=ct.Slider((0.0, 0.06), 0.062, offset=0.003))


def test_an_end_that_slides_meets_the_wall_where_it_is():
    """A direction given in space, and the wall's point beside an interface that moves away by what the piston moves."""
    rng = np.random.default_rng(4)
    _, _, piston = pair(*SLIDERS[1], AXES[1])
    for _ in range(20):
        along, offset_, move, turn = rng.normal(size=(4, 3))
        theta = rng.uniform(-7.0, 7.0)
        end, motion = ct.End("w", "i", tuple(offset_)), np.concatenate((move, turn))
        found = entry.measured(end, REST, REST, along, np.zeros(3), theta, motion, sliding=piston)
        gone = entry.moved(piston, theta).place - entry.moved(piston, 0.0).place
        place = np.array(offset_) + np.array([*gone, 0.0])
        assert found == pytest.approx(along @ (move + np.cross(turn, place)), abs=1e-12)


TABLES = text_of("rod-frames")


def test_a_file_takes_rod_and_pistons_place_from_its_cylinder():
    engine = from_text(TABLES)
    made = ct.assemble(engine, ct.Settings(crank="beam", block="ground"), inherit=False)
    topology = entry.topology(made)
    rod, piston = topology.frames
    assert rod.slider.pin == pytest.approx((0.0, 0.043)) and rod.slider.length == pytest.approx(0.144)
    assert rod.slider == ct.Slider(rod.slider.pin, rod.slider.length, cylinder=1)
    np.testing.assert_allclose(piston.origin, [0.0, 0.187, 0.0], atol=1e-12)
    body = topology.body("piston[1]").reduced
    np.testing.assert_allclose(body.centre, [0.0, 0.0, 0.049], atol=1e-12)
    assert topology.cylinders == {1}


@pytest.mark.parametrize(("old", "new", "said"), refused_files()["rod-frames"]["changes"])
def test_slips_are_told(old, new, said):
    assert old in TABLES
    with pytest.raises(InputError, match=re.escape(said)):
        checked(from_text(TABLES.replace(old, new, 1)), ct.Settings(crank="beam"))


def test_a_cylinder_without_its_gas_is_told():
    with pytest.raises(InputError, match="cylinder 1 are left out; add a connection with law 'gas'"):
        from_text(TABLES.split("[[connection]]")[0])


def from_text(tables):
    """The four without balancers and with these tables."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "four.toml"
        path.write_text(FOUR.read_text(encoding="utf-8").split("# Two shafts")[0] + tables, encoding="utf-8")
        return load_engine(path)


def test_floating_big_ends_leave_their_rods_in_the_engine():
    engine = replace(load_engine("diesel_i6"), axial_path=None)
    top = ct.Topology((ct.Frame("r", 1.0, slider=ct.Slider((0.0, 0.06), 0.2, cylinder=2)),))
    settings = ct.Settings(crank="rigid", block="ground", big_ends="impedance")
    with one_line("rod of cylinder 2 is an added body, whose big end has a film of its own; leave"):
        Simulation(engine, rigid_crank(engine), settings, None, Parts(topology=top)).initialize()


@pytest.mark.parametrize("law", ["gas", "liner"])
def test_tangents_of_gas_and_liner_are_derivatives(law):
    data = {
        "gas": {"bore": 0.08, "angles": (0.0, 1.0, 3.0), "pressures": (5e6, 1e6, 1e5)},
        "liner": {"upper_stiffness": 3e7, "lower_stiffness": 2e7, "upper_height": 0.015, "lower_height": -0.02,
                  "upper_damping": 1e3, "lower_damping": 2e3, "clearance": 1e-5, "friction": 0.05},
    }[law]  # fmt: skip
    _, _, piston = pair(*SLIDERS[1], AXES[1])
    connection = joined("c", law, "p.pin", **data)
    body = rigid_body("p", 0.5, 1e-3 * np.eye(3), (0, 0, 0), {"pin": (0, 0, 0)})
    topology = ct.Topology((piston,), (ct.Body("p", body, "piston"),), (connection,))
    (call,), rng = entry.laws_of(topology)[0], np.random.default_rng(2)

    def force(x, v):
        return call(x, v).force

    for _ in range(20):
        place, velocity = rng.normal(size=4) * 3e-5, rng.normal(size=4) * 0.1
        call.tell(angle=rng.uniform(-20.0, 20.0))
        found = call(place, velocity)
        for k in range(2):
            step = np.zeros(4)
            step[k] = 1e-9
            by_place = (force(place + step, velocity) - force(place - step, velocity))[:2] / 2e-9
            np.testing.assert_allclose(found.by_place[:2, k], by_place, rtol=1e-4, atol=1.0)
        step = np.array([0.0, 0.0, 1e-6, 0.0])
        along = (force(place, velocity + step) - force(place, velocity - step))[2] / 2e-6
        if abs(place[0]) > 1.2e-5 and abs(place[1]) > 1.2e-5:
            # A layer's force counts as its size but for the last newtons.
            assert found.by_velocity[2, 2] == pytest.approx(along, rel=0.1, abs=0.1)
    if law == "gas":
        area = 0.25 * math.pi * 0.08**2
        for theta, pressure in ((0.5, 3e6), (0.5 + 8.0 * math.pi, 3e6), (2.0 - 4.0 * math.pi, 5.5e5)):
            exact = -(pressure - 1.013e5) * area
            assert call(np.zeros(4), np.zeros(4), angle=theta).force[0] == pytest.approx(exact, rel=1e-12)
