"""The eye's compliance on a ring, whose bending is known in closed form, and what follows from an eye's proportions.

Two opposite forces P on a thin ring widen the diameter between them by P R³/(E I) (π/4 − 2/π) = 0.149 P R³/(E I):
Timoshenko, Strength of Materials II, art. 17; Roark's Formulas for Stress and Strain, circular rings, case 1.
"""

from dataclasses import replace

import numpy as np
import pytest
from solids import STEEL, ring

import cranktrain as ct
from cranktrain.film.elastic.bore_compliance import LOBE, patterns, reduced_compliance
from cranktrain.structure.fem.elasticity import finite_elements
from cranktrain.structure.rod.eye import Eye, eye_flexibility, eye_mesh, eye_of

WAVES, DEGREE = 12, 1
SIX = ct.load_engine("diesel_i6")


def test_two_opposite_forces_widen_a_ring_as_timoshenkos():
    # Shear, stretch and the lever of a pressure inside are of the order of t/R = 0.04.
    radius, t, length = 0.05, 0.002, 0.006
    inner, outer = radius - 0.5 * t, radius + 0.5 * t
    mesh = ring(inner, outer, length, 96, 1, 1)
    skin = mesh.boundary_facets()
    y = mesh.p[1, mesh.facets[:, skin]]
    # Balanced forces leave nothing to the cut, wherever it is.
    mesh = mesh.with_boundaries({"bore": mesh.boundaries["bore"], "cut": skin[(y > 0.95 * outer).all(axis=0)]})
    eye = Eye(2 * inner, length, *(2 * inner, t, t, 0.1, 0.01, 0.01, 0.1, 0.01))
    compliance = eye_flexibility(finite_elements(mesh, STEEL), eye, WAVES, DEGREE)
    around, along = patterns(np.array([0.5 * np.pi, -0.5 * np.pi]), np.zeros(2), WAVES, DEGREE)
    # Forces of 1 N, on the film's area 2 π R L: ∫ ψ p dA = ψ at the point, so that shares are ψ over the area.
    area = 2 * np.pi * inner * length
    force = np.einsum("ak,b->ab", around, along[:, 0] * [1, 0])
    widened = np.einsum("abcd,cd->ab", compliance, force / area)
    found = np.einsum("ab,ab->", widened, force) / area
    stiffness = STEEL.youngs_modulus * length * t**3 / 12
    assert found == pytest.approx((np.pi / 4 - 2 / np.pi) * radius**3 / stiffness, rel=0.05)


@pytest.fixture(scope="module")
def usual():
    eye = eye_of(SIX.big_end_bearing, SIX.rod)
    return eye, eye_flexibility(finite_elements(eye_mesh(eye), eye.material), eye)


def lobe(degrees):
    """Film pressure of 1 N about an angle, as shares of the patterns with its area."""
    angles = 2 * np.pi * np.arange(720) / 720
    zetas, weights = np.polynomial.legendre.leggauss(8)
    away = np.abs(np.angle(np.exp(1j * (angles - np.radians(degrees)))))
    pressure = np.outer(np.where(away < 0.5 * LOBE, np.cos(np.pi * away / LOBE), 0.0), 1.0 - zetas**2)
    around, along = patterns(angles, zetas, 12, 4)
    mean = 0.5 * weights / angles.size
    return np.einsum("ai,bj,ij,j->ab", around, along, pressure, mean) / np.sum(pressure * np.cos(away)[:, None] * mean)


def widening(compliance, area, load, degrees):
    """Radial displacement in mid-bore, m/N, at some angles under a load at ``load`` degrees."""
    around, along = patterns(np.radians(np.array(degrees)), np.zeros(len(degrees)), 12, 4)
    moved = np.einsum("abcd,cd->ab", compliance, lobe(load)) / area**2
    return np.einsum("ab,ak,bk->k", moved, around, along)


def test_a_load_on_the_cap_closes_the_bore_across(usual):
    """The bore becomes an oval along the rod: the film's gap closes at the sides, as of rods at high speed."""
    eye, compliance = usual
    area = np.pi * eye.film_diameter * eye.film_width
    under, right, left = widening(compliance, area, -90, [-90, 0, 180])
    assert right == pytest.approx(left, rel=0.02)
    assert right < -0.2 * under < 0.0
    # Towards the shank there is ten times as much steel behind the shell.
    (towards_shank,) = widening(compliance, area, 90, [90])
    assert 0.0 < towards_shank < 0.15 * under


def test_shapes_hold_the_energy_and_twice_the_size_is_half_as_soft(usual):
    """Displacement by force goes with 1/(E length)."""
    eye, compliance = usual
    lengths = [name for name, value in vars(eye).items() if type(value) is float and name != "bore_mesh_share"]
    big = replace(eye, **{name: 2 * getattr(eye, name) for name in lengths})
    soft, stiff = (
        reduced_compliance(c, np.pi * e.film_diameter * e.film_width, 7, True).compliance
        for e, c in ((eye, compliance), (big, eye_flexibility(finite_elements(eye_mesh(big), big.material), big)))
    )
    assert 2 * stiff == pytest.approx(soft, rel=0.01)
    eye, compliance = usual
    bore = reduced_compliance(compliance, np.pi * eye.film_diameter * eye.film_width, 7, True)
    assert bore.captured[-1] > 0.93
    assert (bore.compliance > 0).all() and not bore.load_coupling.any()


@pytest.mark.slow
def test_the_eye_hardly_depends_on_mesh_and_cut(usual):
    eye, compliance = usual
    area = np.pi * eye.film_diameter * eye.film_width
    soft = reduced_compliance(compliance, area, 4, True).compliance
    for changed in (replace(eye, mesh_size=0.7 * eye.mesh_size), replace(eye, cut=1.3 * eye.cut)):
        found = eye_flexibility(finite_elements(eye_mesh(changed), eye.material), changed)
        assert reduced_compliance(found, area, 4, True).compliance[:2] == pytest.approx(soft[:2], rel=0.1)
