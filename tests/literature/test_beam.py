"""Timoshenko frames against published rotors and closed forms, and the beam crank against the solid one."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from expected import cases
from rotors import DENSITY, DIAMETER, LENGTH, SPEED, support, whirl_speeds, with_discs
from scipy.linalg import eigh
from scipy.optimize import brentq
from some import some

from cranktrain.core.reduced_body import attach, rigid_coordinates
from cranktrain.core.rigid_slices import Slices
from cranktrain.engine.file import load_engine
from cranktrain.engine.parts import Material
from cranktrain.structure.crank.beam import beam_body, crank_frame
from cranktrain.structure.crank.reduction import reduced_crankshaft
from cranktrain.structure.crank.sections import crank_moments
from cranktrain.structure.crank.shape import Outline
from cranktrain.structure.crank.web_member import Arm, rectangle_shear_factor, web_flexibility
from cranktrain.structure.fem.frame import Frame, Section, circular

CASES = cases("rotor")
YOUNG, SHEAR = 211e9, 81.2e9
POISSON = YOUNG / (2.0 * SHEAR) - 1.0


@cache
def rotor():
    """Friswell's shaft in six elements, reduced without loss, with its two discs."""
    frame = Frame(YOUNG, SHEAR)
    nodes = [frame.node((0.0, 0.0, z)) for z in np.linspace(0.0, LENGTH, 7)]
    for first, second in pairwise(nodes):
        frame.beam(first, second, circular(DIAMETER, DENSITY, POISSON))
    names = {"left": nodes[0], "disc 1": nodes[2], "disc 2": nodes[4], "right": nodes[-1]}
    return with_discs(frame.reduced("rotor", "", names, fixed_modes=18))


@pytest.mark.parametrize(("speed", "column"), [(0.0, "rpm0"), (SPEED, "rpm4000")])
def test_isotropic_rotor_whirls_as_published(speed, column):
    """Friswell et al. 5.9.1 with six Timoshenko elements: within the case's own 0.05 %."""
    found = whirl_speeds(rotor(), speed, support(rotor(), 1e6 * np.eye(2)))
    np.testing.assert_allclose(found[:6], CASES["friswell_5.9.1"]["expected"][column], rtol=5e-4)


def test_anisotropic_rotor_at_rest_vibrates_as_published():
    """Friswell et al. 5.9.2 at 0 rev/min."""
    body = rotor()
    stiffness = np.diag(body.omega**2) + support(body, np.diag([1e6, 8e5]))
    omega = np.sqrt(np.maximum(np.linalg.eigvalsh(stiffness), 0.0))
    expected = CASES["friswell_5.9.2"]["expected"]["rpm0"]
    np.testing.assert_allclose([omega[np.argmin(np.abs(omega - value))] for value in expected], expected, rtol=5e-4)


def cantilever(elements, slender, axis=(0.0, 0.0, 1.0)):
    frame = Frame(YOUNG, SHEAR)
    length = slender * DIAMETER
    nodes = [frame.node(length * x * np.asarray(axis)) for x in np.linspace(0.0, 1.0, elements + 1)]
    for first, second in pairwise(nodes):
        frame.beam(first, second, circular(DIAMETER, DENSITY, POISSON))
    return frame, length


@pytest.mark.parametrize("slender", [2.0, 5.0, 30.0])
@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.6, 0.0, -0.8), (1.0, 2.0, 3.0)])
def test_one_element_carries_end_loads_exactly(slender, axis):
    """Tip of a Timoshenko cantilever: F L³/3EI + F L/κGA, F L²/2EI; torsion T L/GJ; whatever its direction."""
    axis = np.array(axis) / np.linalg.norm(axis)
    frame, length = cantilever(1, slender, axis)
    stiffness = frame.matrices()[0][6:, 6:]
    section = circular(DIAMETER, DENSITY, POISSON)
    across = np.cross(axis, (0.3, 0.9, 0.1))
    across /= np.linalg.norm(across)
    tip = np.linalg.solve(stiffness, np.concatenate((across, axis)))
    bent = length**3 / (3 * YOUNG * section.bending) + length / (SHEAR * section.shear)
    assert tip[:3] @ across == pytest.approx(bent, rel=1e-9)
    assert tip[3:] @ np.cross(axis, across) == pytest.approx(length**2 / (2 * YOUNG * section.bending), rel=1e-9)
    assert tip[3:] @ axis == pytest.approx(length / (SHEAR * section.torsion), rel=1e-9)


def timoshenko_simply_supported(order, length):
    """Lower root of Timoshenko's frequency equation of a simply supported beam, rad/s."""
    section = circular(DIAMETER, DENSITY, POISSON)
    wave = order * np.pi / length
    bending, shear = YOUNG * section.bending, SHEAR * section.shear

    def residual(omega):
        across, turning = (
            shear * wave**2 - section.mass * omega**2,
            bending * wave**2 + shear - section.rotary * omega**2,
        )
        return across * turning - (shear * wave) ** 2

    euler = wave**2 * np.sqrt(bending / section.mass)
    return brentq(residual, 0.1 * euler, 1.001 * euler)


def test_simply_supported_beam_converges_to_timoshenko_at_second_order():
    """The interpolation is that of statics: with shear, frequencies converge at second order."""
    length, errors = 10 * DIAMETER, []
    for elements in (8, 16, 32):
        frame, _ = cantilever(elements, 10.0)
        stiffness, mass = frame.matrices()
        plane = [k for k in range(stiffness.shape[0]) if k % 6 in (0, 4)]
        kept = [k for k in plane if k not in (0, 6 * elements)]
        omega = np.sqrt(eigh(stiffness[np.ix_(kept, kept)], mass[np.ix_(kept, kept)], eigvals_only=True))
        errors.append([omega[k - 1] / timoshenko_simply_supported(k, length) - 1.0 for k in (1, 2, 3)])
    errors = np.abs(errors)
    assert errors[-1][0] < 1e-5 and errors[-1].max() < 5e-4
    np.testing.assert_allclose(np.log2(errors[1] / errors[2]), 2.0, atol=0.05)


def test_torsion_feels_no_speed_and_rigid_modes_are_exact():
    """Of a frame: neither torsion nor rotation as a whole feels the speed; rigid motions are those of points."""
    body = rotor()
    torsion = [k for k in range(6, body.n_modes) if np.abs(body.shapes[:, :3, k]).max() < 1e-6]
    assert torsion
    spin = body.stress_stiffness - body.centrifugal
    assert np.abs(spin[5]).max() < 1e-9
    for k in torsion:
        if np.abs(body.shapes[:, 5, k]).max() > 0.1:
            assert abs(spin[k, k]) < 1e-9
    body = rotor()
    coordinates = rigid_coordinates(body)
    for row, position in some(zip(body.shapes, body.positions, strict=True)):
        moved = coordinates[:3] + np.cross(coordinates[3:].T, position).T
        np.testing.assert_allclose(row[:3, :6], moved, atol=1e-12)
        np.testing.assert_allclose(row[3:, :6], coordinates[3:], atol=1e-12)


@pytest.mark.parametrize(("poisson_ratio", "factor"), [(0.0, 0.857), (0.3, 0.886), (0.5, 0.900)])
def test_shear_factor_of_a_circle_is_cowpers(poisson_ratio, factor):
    """G. Cowper, J. Appl. Mech. 33 (1966) 335: to the printed digits."""
    section = circular(DIAMETER, DENSITY, poisson_ratio)
    assert section.shear / section.area == pytest.approx(factor, abs=5e-4)


@pytest.mark.parametrize(("poisson_ratio", "factor"), [(0.0, 0.833), (0.3, 0.850), (0.5, 0.857)])
def test_shear_factor_of_a_rectangle_is_cowpers(poisson_ratio, factor):
    assert rectangle_shear_factor(poisson_ratio) == pytest.approx(factor, abs=5e-4)


def test_a_section_has_the_rotary_inertia_of_the_circle_that_is_heavy():
    """ρI per length, I = πd⁴/64 of the circle that is heavy: a quarter of the mass times its radius squared."""
    section = circular(DIAMETER, DENSITY, POISSON, heavy_diameter=0.03)
    assert section.mass == pytest.approx(DENSITY * np.pi * 0.015**2)
    assert section.rotary == pytest.approx(0.25 * section.mass * 0.015**2)
    assert circular(DIAMETER, DENSITY, POISSON).rotary == pytest.approx(DENSITY * section.bending)


def test_a_turning_rod_twists_stiffer_by_its_pull():
    """Pull N on the fibres of a round section works against twist as N (I_p/A) θ'².

    J. Houbolt and G. Brooks, NACA Report 1346 (1958), their term T k_A² φ'. A rod of length 2l turning about its middle
    has N = ½ρAΩ²(l² − y²); its first mode sin(πy/2l) gives ω² = ω₀² + ½ (π²/6 + ½) Ω², whatever the diameter. Along and
    across it swings as a string does: out of the plane of rotation by Ω² more than within (R. Southwell).
    """
    frame, half, elements = Frame(YOUNG, SHEAR), 10.0 * DIAMETER, 24
    nodes = [frame.node((0.0, y, 0.0)) for y in np.linspace(-half, half, elements + 1)]
    for first, second in pairwise(nodes):
        frame.beam(first, second, circular(DIAMETER, DENSITY, POISSON))
    body = frame.reduced("rod", "", {"left": nodes[0], "middle": nodes[elements // 2], "right": nodes[-1]}, 40)
    tip = np.abs(body.shapes[body.index("right")])
    gain = np.diag(body.stress_stiffness - body.centrifugal)
    twist = 6 + int(np.argmax(tip[4, 6:20] > 0.9 * np.linalg.norm(tip[3:, 6:20], axis=0)))
    assert body.omega[twist] == pytest.approx(0.5 * np.pi / half * np.sqrt(SHEAR / DENSITY), rel=1e-3)
    assert gain[twist] == pytest.approx(0.5 * (np.pi**2 / 6.0 + 0.5), rel=2e-3)
    # The lowest two elastic modes are one bending shape, turned by some angle about the rod.
    pair = (body.stress_stiffness - body.centrifugal)[6:8, 6:8]
    within, out = np.linalg.eigvalsh(pair)
    assert out - within == pytest.approx(1.0, abs=0.02)


def pin_axis(engine):
    """Direction from the main axis to the last pin, (3,)."""
    angle = engine.crankshaft.throw_angles[-1]
    return np.array([-np.sin(angle), np.cos(angle), 0.0])


def swung(carried):
    """A hub on a bending shaft carries two arms: ``stiff beams``, ``levers`` of their roots, or parts ``attached``."""
    frame, stiff = Frame(YOUNG, SHEAR), circular(10.0 * DIAMETER, 0.0, POISSON)
    weightless = Section(stiff.area, stiff.shear, stiff.bending, stiff.torsion, 0.0, 0.0)
    heavy = Section(stiff.area, stiff.shear, stiff.bending, stiff.torsion, 40.0, 1e-3)
    line = [frame.node((0.0, 0.0, z)) for z in (-0.3, -0.15, 0.0, 0.15, 0.3)]
    for first, second in pairwise(line):
        frame.beam(first, second, circular(DIAMETER, DENSITY, POISSON))
    arms = []
    for side in (-1.0, 1.0):
        root, tip = frame.node((0.0, 0.05 * side, 0.0)), frame.node((0.0, 0.25 * side, 0.0))
        frame.beam(line[2], root, weightless)
        frame.beam(root, tip, heavy)
        arms.append(frame.members[-1])
        if carried == "attached":
            del frame.members[-2:], frame.positions[-2:]
        elif carried == "levers":
            arm = frame.members.pop()
            flexibility = np.linalg.inv(arm.stiffness[6:, 6:])
            # All of the arm's mass swings with the rotation of its root.
            frame.flexible_link(root, tip, flexibility, arm.slices, np.zeros(4))
            light = Slices(np.array([frame.positions[tip]]), 1e-6 * np.diag([1.0, 1e-2, 1e-2, 1e-2])[None])
            frame.flexible_link(root, tip, flexibility, light, np.ones(1))
    body = frame.reduced("swung", "", {"front": line[0], "hub": line[2], "rear": line[4]}, 12)
    if carried == "attached":
        # Both arms as one part: balanced, it strains nothing but itself.
        slices = [arm.slices for arm in arms]
        total = sum(np.einsum("s,sa,sb->ab", x.moments[:, 0, 0], x.places, x.places) for x in slices)
        total = total + sum(x.moments[:, 1:, 1:].sum(axis=0) for x in slices)
        mass = sum(x.moments[:, 0, 0].sum() for x in slices)
        body = attach(body, "hub", mass, np.trace(total) * np.eye(3) - total, (0.0, 0.0, 0.0))
    return body


@pytest.mark.parametrize("carried", ["levers", "attached"])
@pytest.mark.parametrize("axis", [0, 1], ids=["across the arms", "about the arms"])
def test_mass_on_a_lever_feels_the_speed_as_mass_on_a_stiff_arm(axis, carried):
    """Arms that nod on a bending shaft: across them the centrifugal load rights them, about them it does nothing."""
    found = []
    for body in (swung("stiff beams"), swung(carried)):
        turning = np.abs(body.shapes[body.index("hub"), 3 + axis, 6:10])
        nod = 6 + int(np.argmax(turning))
        assert turning[nod - 6] > 0.5
        found.append((body.omega[nod], (body.stress_stiffness - body.centrifugal)[nod, nod]))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-3)


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_a_beam_crank_weighs_what_its_sections_weigh(name):
    """Mass, centre and inertia are the closed forms of cylinders and webs (without fillets, which are summed)."""
    engine = load_engine(name)
    engine = replace(engine, crankshaft=replace(engine.crankshaft, fillet=0.0))
    found, expected = beam_body(engine), crank_moments(engine)
    second = expected[1:, 1:]
    assert found.mass == pytest.approx(expected[0, 0], rel=1e-4)
    np.testing.assert_allclose(found.centre, expected[0, 1:] / expected[0, 0], atol=1e-5)
    np.testing.assert_allclose(np.diag(found.inertia), np.trace(second) - np.diag(second), rtol=3e-4)


def test_between_its_axes_a_web_moves_as_a_beam_whose_ends_do_not_turn():
    """The share of the pin's end is the deflection of a slender beam clamped at both ends, one of which is displaced.

    What of the web lies beyond an axis moves with that axis.
    """
    engine = load_engine("diesel_i6")
    crank, _ = crank_frame(engine)
    web = crank.members[-1]
    assert web.slices is not None
    places = np.linalg.norm(web.slices.places[:, :2], axis=1) * np.sign(web.slices.places @ pin_axis(engine))
    share = web.motion[:, 0, 6]
    np.testing.assert_allclose(web.motion[:, 0, 0], 1.0 - share, atol=1e-12)
    stiffness = cantilever(64, 1000.0)[0].matrices()[0]
    free = np.arange(6, 6 * 64)
    moved = np.linalg.solve(stiffness[np.ix_(free, free)], -stiffness[np.ix_(free, [6 * 64])])
    deflection = np.concatenate(([0.0], moved[::6, 0], [1.0]))
    fine = np.linspace(0.0, engine.crankshaft.throw, 65)
    assert np.count_nonzero((places > 0.0) & (places < fine[-1])) > 4
    np.testing.assert_allclose(share, np.interp(places, fine, deflection), atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "throw"), [("diesel_i6", 3), ("diesel_v8", 2)])
def test_a_throw_bends_and_twists_nearly_as_the_solid_one(name, throw):
    """Rotation of one main journal against the next per moment: within a quarter in bending, 5 % in torsion."""
    engine = load_engine(name)
    angle = engine.crankshaft.throw_angles[throw - 1]
    across, along = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])

    def compliances(body):
        ends = [body.shapes[body.index(f"main[{i}]"), 3:, 6:] for i in (throw, throw + 1)]
        turn = ends[1] - ends[0]
        return [(row**2 / body.omega[6:] ** 2).sum() for row in (across @ turn[:2], along @ turn[:2], turn[2])]

    ratios = np.array(compliances(beam_body(engine))) / compliances(reduced_crankshaft(engine))
    assert np.all(np.abs(ratios[:2] - 1.0) < 0.25)
    assert abs(ratios[2] - 1.0) < 0.05


def test_a_slender_web_is_a_plain_beam_between_its_journals():
    """Small journals far apart: 0.1 m more of throw is 0.1 m more of a rectangular beam under moments at its end."""
    c, steel = load_engine("diesel_i6").crankshaft, Material(210e9, 0.3, 7850.0)
    slender = Arm(Outline(0.03, 0.03, 0.2, 0.0), c.web_thickness, 0.01, 0.0, 0.01, c.pin_width)
    flexibility = web_flexibility(slender, steel)
    longer = flexibility - web_flexibility(slender._replace(outline=Outline(0.03, 0.03, 0.1, 0.0)), steel)
    # What the journals do is the same; 60 by 24 mm of plain web make the difference.
    width, height = 0.06, c.web_thickness
    torsion = (width * height) ** 4 / (40.0 * (width * height**3 + height * width**3) / 12.0)
    shear = steel.youngs_modulus / 2.6
    modulus = steel.youngs_modulus
    rigidities = [modulus * width * height**3 / 12.0, shear * torsion, modulus * height * width**3 / 12.0]
    np.testing.assert_allclose(np.diag(longer)[3:], 0.1 / np.array(rigidities), rtol=1e-3)
    np.testing.assert_allclose(flexibility, flexibility.T, atol=0.0)
    assert np.linalg.eigvalsh(flexibility)[0] > 0.0
