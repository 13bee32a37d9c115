"""The bore's compliance on rings, whose widening is known in closed form.

Lamé: Timoshenko & Goodier, Theory of Elasticity, art. 28; inextensional bending of a thin ring: Timoshenko, Strength of
Materials II, art. 17, and ovalisation of thick ones by Michell's stress function (Timoshenko & Goodier, art. 43).
"""

import numpy as np
import pytest
from solids import STEEL, ring

from cranktrain.film.elastic.bore_compliance import reduced_compliance
from cranktrain.structure.block.saddle import pattern_compliance
from cranktrain.structure.fem.elasticity import finite_elements

E, NU = STEEL.youngs_modulus, STEEL.poisson_ratio


def widening(inner, outer, length, around, through, layers=1, waves=3, degree=1):
    """Compliance on patterns of a free ring: three points hold it where a balanced load leaves no reaction."""
    model = finite_elements(ring(inner, outer, length, around, through, layers), STEEL)
    dofs = model.basis.nodal_dofs
    x, y, z = model.mesh.p[:, : dofs.shape[1]]
    edge = np.flatnonzero((z < -0.4999 * length) & (np.hypot(x, y) > 0.9999 * outer))
    turned = np.arctan2(y[edge], x[edge])
    first, second, third = (edge[np.abs(turned - angle).argmin()] for angle in (0.0, 1.5, 3.0))
    # Six supports: a point, the tangent and the axis at another, the axis at a third.
    held = np.array([*dofs[:, first], *dofs[[0, 2], second], dofs[2, third]])
    return pattern_compliance(model, held, 2 * inner, length, waves, degree)


def plane_stress_ovalisation(a, b, n):
    """Radial displacement at r = a under p = cos nφ there, m/Pa, from Michell's stress function, by a 4 × 4 system."""

    # φ = (A r^n + B r^-n + C r^(n+2) + D r^(2-n)) cos nθ; displacement from Hooke's law in plane stress.
    def row_rr(r):
        inner = [n * (1 - n) * r ** (n - 2), -n * (1 + n) * r ** (-n - 2)]
        return [*inner, (n + 2 - n * n) * r**n, (2 - n - n * n) * r**-n]

    def row_rt(r):
        return [n * (n - 1) * r ** (n - 2), -n * (n + 1) * r ** (-n - 2), n * (n + 1) * r**n, -n * (n - 1) * r**-n]

    constants = np.linalg.solve([row_rr(a), row_rt(a), row_rr(b), row_rt(b)], [-1.0, 0.0, 0.0, 0.0])
    up, down = 2 * (1 - NU) - n * (1 + NU), 2 * (1 - NU) + n * (1 + NU)
    radial = [-(1 + NU) * n * a ** (n - 1), (1 + NU) * n * a ** (-n - 1), up * a ** (n + 1), down * a ** (1 - n)]
    return float(np.dot(radial, constants)) / E


def test_thick_ring_widens_as_lames():
    """Evenly along the axis: nothing of it is linear or a bow, the patterns beside the constant one."""
    a, b, length = 0.045, 0.08, 0.02
    area = 2 * np.pi * a * length
    lame = a / E * ((b**2 + a**2) / (b**2 - a**2) + NU)
    found = widening(a, b, length, 48, 4, degree=2)[0, :, 0, 0] / area
    assert found[0] == pytest.approx(lame, rel=1e-3)
    assert np.abs(found[1:]).max() < 1e-3 * lame


@pytest.mark.parametrize("wave", [2, 3])
def test_thick_ring_ovalises_as_michells(wave):
    a, b, length = 0.045, 0.07, 0.01
    area = 2 * np.pi * a * length
    found = widening(a, b, length, 64, 4)
    for index in (2 * wave - 1, 2 * wave):
        assert found[index, 0, index, 0] / area == pytest.approx(plane_stress_ovalisation(a, b, wave), rel=5e-3)


def test_thin_ring_ovalises_by_bending_and_is_softest_so():
    """w = q R⁴/(9 E t³/12) cos 2φ; shear, stretch and the pressure's lever are of the order of t/R."""
    # w = q R⁴ / (9 E t³/12) cos 2φ; shear, stretch and the pressure's lever are of the order of t/R.
    radius, t, length = 0.05, 0.002, 0.006
    a = radius - 0.5 * t
    area = 2 * np.pi * a * length
    bending = (a / radius) * radius**4 / (9 * E * t**3 / 12)
    assert widening(a, radius + 0.5 * t, length, 96, 1)[3, 0, 3, 0] / area == pytest.approx(bending, rel=0.03)
    a, b, length = 0.048, 0.05, 0.006
    area = 2 * np.pi * a * length
    bore = reduced_compliance(widening(a, b, length, 96, 1), area, 2)
    assert np.sum(bore.coefficients[:, 3:5, 0] ** 2, axis=1) == pytest.approx(1.0, abs=1e-4)
    assert bore.compliance[0] == pytest.approx(bore.compliance[1], rel=1e-3)
