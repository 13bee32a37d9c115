"""Friction of a journal in mixed and boundary lubrication beside closed forms: what a measured rig must be told.

Journal friction of the classical handbooks (Dubbel, "Zapfenreibung"; Decker, Maschinenelemente): a journal that presses
on its bore by p(φ) rubs with the coefficient f = μ ∫ p dφ / ∫ p cos φ dφ. f is μ for a pressure on a line, 4/π μ for a
cosine over half of the bore and π/2 μ for an even one: nothing but μ and the width of the contact counts.
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad

import cranktrain as ct

RADIUS, WIDTH, CLEARANCE, LOAD = 0.03, 0.025, 30e-6, 15e3
RIG = {
    "diameter_mm": 60, "width_mm": 25, "clearance_um": 30, "viscosity_pas": 0.02, "roughness_um": 0.8,
    "asperity_density": 3000, "asperity_radius_um": 20, "contact_modulus_gpa": 60, "hardness_mpa": 200,
    "boundary_friction": 0.12, "grid": (96, 12),
}  # fmt: skip
SLOW, MIXED, FULL = 0.05, 100.0, 2000.0


def found(speed, **changes):
    return ct.Bearing(**{**RIG, **changes}, speed_rpm=speed).equilibrium(LOAD)


def greenwood_tripp(h, sigma, density, radius, modulus):
    """Pressure of the published integral, Pa; its F_{5/2} by quadrature, the lining's yield left out."""
    integral = quad(lambda s: (s - h / sigma) ** 2.5 * math.exp(-0.5 * s * s), h / sigma, h / sigma + 12.0)[0]
    shape = (density * radius * sigma) ** 2 * math.sqrt(sigma / radius)
    return 16.0 * math.sqrt(2.0) * math.pi / 15.0 * shape * modulus * integral / math.sqrt(2.0 * math.pi)


@pytest.mark.parametrize("given", ["density and radius", "factor and ratio"])
def test_contact_load_is_the_integral_of_greenwood_and_tripps_pressure(given):
    """Around the bore at an eccentricity, from the density and the tips' radius or from their products."""
    sigma, density, radius, eccentricity = 0.8e-6, 3e9, 20e-6, 0.96
    changes = {"hardness_mpa": 1e5, "grid": (320, 8)}
    if given == "factor and ratio":
        changes |= {"asperity_density": None, "asperity_radius_um": None}
        changes |= {"asperity_factor": density * radius * sigma, "asperity_ratio": sigma / radius}
    state = ct.Bearing(**{**RIG, **changes}, speed_rpm=1.0).at_eccentricity(eccentricity)

    def pressed(phi):
        gap = CLEARANCE * (1.0 - eccentricity * math.cos(phi))
        return greenwood_tripp(gap, sigma, density, radius, 60e9) * math.cos(phi)

    expected = 2.0 * RADIUS * WIDTH * quad(pressed, 0.0, 1.0, epsrel=1e-8)[0]
    assert state["contact_load"] == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(
    "changes",
    [{}, {"roughness_um": 1.2}, {"asperity_density": 6000}, {"contact_modulus_gpa": 120}, {"hardness_mpa": 100},
     {"roughness_pattern": 6.0}, {"clearance_um": 45}, {"viscosity_pas": 0.01}],
)  # fmt: skip
def test_boundary_friction_depends_on_its_coefficient_alone(changes):
    """Where asperities carry all, f/μ lies between 1 and 4/π, near 1 on a narrow contact, whatever the surfaces are.

    So a rig whose friction in the boundary regime is missed by more than 4/π − 1 = 27 % has another μ.
    """
    state = found(SLOW, **changes)
    assert state["contact_load"] > 0.99 * LOAD
    assert 1.0 < state["friction_coefficient"] / RIG["boundary_friction"] < 4.0 / math.pi
    assert state["friction_coefficient"] == pytest.approx(RIG["boundary_friction"], rel=0.02)
    more = found(SLOW, **changes, boundary_friction=0.18)
    assert more["friction_coefficient"] == pytest.approx(1.5 * state["friction_coefficient"], rel=1e-2)


def test_mixed_friction_depends_on_what_few_rigs_publish():
    """Asperities of twice the density carry and rub half as much again or more; no film, or a full one, knows them."""
    more = {"asperity_density": 6000}
    ratio = [found(speed, **more)["friction_coefficient"] / found(speed)["friction_coefficient"] for speed in
             (SLOW, MIXED, FULL)]  # fmt: skip
    assert ratio[0] == pytest.approx(1.0, abs=0.01) and ratio[2] == pytest.approx(1.0, abs=0.01)
    assert ratio[1] > 1.5


def test_friction_is_what_the_parts_rub():
    """f F R = torque; asperities rub μ p_c + τ₀ a on their true area; the pressure stays below the hardness."""
    state = found(MIXED, boundary_shear_mpa=20.0)
    assert state["friction_coefficient"] * LOAD * RADIUS == pytest.approx(state["friction_torque"], rel=1e-6)
    bare = found(MIXED)
    sheared = state["contact_friction_torque"] - bare["contact_friction_torque"]
    assert sheared == pytest.approx(20e6 * 1e-6 * state["contact_area_mm2"] * RADIUS, rel=1e-3)
    assert bare["contact_pressure_max_mpa"] < found(MIXED, hardness_mpa=1e5)["contact_pressure_max_mpa"] * 1.001
    soft = [found(SLOW, hardness_mpa=h)["contact_pressure_max_mpa"] for h in (30.0, 60.0, 1e5)]
    assert soft[0] < 30.0 and soft[1] < 60.0 and np.all(np.diff(soft) > 0.0)
