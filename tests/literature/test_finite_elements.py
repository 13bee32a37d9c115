"""The finite elements against bars, Timoshenko's beam, Lamé's modes of a cube and NAFEMS FV52."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from solids import STEEL, block, frequencies, round_bar

from cranktrain.engine import Material
from cranktrain.structure.elasticity import component_dofs, finite_elements

RADIUS, LENGTH = 0.02, 0.6
SHEAR_MODULUS = STEEL.youngs_modulus / (2 * (1 + STEEL.poisson_ratio))


@pytest.fixture(scope="module")
def bar_modes():
    model = finite_elements(round_bar(RADIUS, LENGTH, 2, 30), STEEL)
    hz, modes = frequencies(model.stiffness, model.mass, 18, 500.0)
    nodes = component_dofs(model.basis)
    x, y, _ = model.positions[:, nodes[0]]
    u, v, w = (model.mass @ modes)[nodes]
    z = model.positions[2, nodes[0]]
    half_wave = np.cos(np.pi * z / LENGTH)
    shares = {"torsion": (half_wave * x) @ v - (half_wave * y) @ u, "axial": half_wave @ w}
    return hz, {kind: hz[6 + np.argmax(np.abs(share[6:]))] for kind, share in shares.items()}


def test_torsion_of_a_round_bar(bar_modes):
    exact = np.sqrt(SHEAR_MODULUS / STEEL.density) / (2 * LENGTH)
    assert bar_modes[1]["torsion"] == pytest.approx(exact, rel=1e-3)


def test_longitudinal_motion_of_a_round_bar(bar_modes):
    bar = np.sqrt(STEEL.youngs_modulus / STEEL.density) / (2 * LENGTH)
    # Rayleigh and Love: the lateral inertia lowers the bar's frequency by 0.025 % at this slenderness.
    lateral = STEEL.poisson_ratio**2 * np.pi**2 * RADIUS**2 / (2 * LENGTH**2)
    assert bar_modes[1]["axial"] == pytest.approx(bar, rel=1e-3)
    assert bar_modes[1]["axial"] == pytest.approx(bar / np.sqrt(1 + lateral), rel=1e-4)


def test_bending_of_a_round_bar(bar_modes):
    hz = bar_modes[0]
    pairs = hz[6:12].reshape(3, 2)
    for mode, pair in enumerate(pairs):
        assert pair == pytest.approx(timoshenko_free_free(mode), rel=3e-3)


def timoshenko_free_free(mode: int) -> float:
    """Frequency (Hz) of a free beam, Cowper's shear coefficient; (w, ψ, M, Q)' = A (w, ψ, M, Q)."""
    area, inertia = np.pi * RADIUS**2, np.pi * RADIUS**4 / 4
    shear = 6 * (1 + STEEL.poisson_ratio) / (7 + 6 * STEEL.poisson_ratio)
    bending = STEEL.youngs_modulus * inertia

    def free_ends(frequency: float) -> float:
        squared = STEEL.density * (2 * np.pi * frequency) ** 2
        change = np.array(
            [
                [0, 1, 0, 1 / (shear * SHEAR_MODULUS * area)],
                [0, 0, 1 / bending, 0],
                [0, -squared * inertia, 0, -1],
                [-squared * area, 0, 0, 0],
            ]
        )
        # Lengths over LENGTH, loads over EI: a well-scaled transfer matrix.
        scale = np.array([LENGTH, 1, bending / LENGTH, bending / LENGTH**2])
        transfer = expm(LENGTH * change * scale / scale[:, None])
        return float(np.linalg.det(transfer[2:, :2]))

    euler = (np.array([4.7300407, 7.8532046, 10.9956078])[mode] / LENGTH) ** 2
    euler *= np.sqrt(bending / (STEEL.density * area)) / (2 * np.pi)
    return brentq(free_ends, 0.85 * euler, 1.01 * euler)


def test_lame_modes_of_a_cube_converge_at_fourth_order():
    """Lamé's three shear modes of a free cube are exact: ω = √2 π c_s / a; quadratic elements miss them by O(h⁴)."""
    side = 0.1
    exact = np.sqrt(SHEAR_MODULUS / STEEL.density) / (np.sqrt(2) * side)
    errors = []
    for n in (5, 10):
        hz, _ = frequencies(*matrices(block((side,) * 3, (n,) * 3)), 20, 5000.0)
        errors.append(np.sort(hz[np.argsort(np.abs(hz - exact))[:3]]) / exact - 1)
    assert np.min(errors) > 0, "consistent mass gives upper bounds"
    assert np.max(errors[1]) < 5e-4
    # The order is approached from below: 3.2, 3.5, 3.65 from mesh to mesh, as the next term of the error fades.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.5)


def test_torsion_of_a_curved_bar_converges_at_fourth_order():
    """The surface is approximated to the same order as the field."""
    length, radius = 0.1, 0.02
    exact = np.sqrt(SHEAR_MODULUS / STEEL.density) / (2 * length)
    errors = []
    for refinements, layers in ((1, 2), (2, 4), (3, 8)):
        hz, _ = frequencies(*matrices(round_bar(radius, length, refinements, layers)), 10, 3000.0)
        errors.append(np.min(np.abs(hz / exact - 1)))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates == pytest.approx([4.0, 4.0], abs=0.6)
    assert errors[-1] < 5e-4


def matrices(mesh):
    """Stiffness and mass in steel."""
    model = finite_elements(mesh, STEEL)
    return model.stiffness, model.mass


def test_nafems_fv52_thick_plate():
    """One layer of quadratic elements, as the benchmark has: its line support softens without end in finer ones."""
    case = json.loads((Path(__file__).parents[1] / "data" / "finite_elements.json").read_text())["NAFEMS_FV52"]
    material = Material(case["youngs_modulus_pa"], case["poisson_ratio"], case["density"])
    side, thick = case["side_m"], case["thickness_m"]
    model = finite_elements(block((side, side, thick), (6, 6, 1)), material)
    x, y, z = model.positions
    edge = np.isclose(np.maximum(np.abs(x), np.abs(y)), side / 2) & np.isclose(z, -thick / 2)
    free = np.flatnonzero(~(edge & (model.components == 2)))
    hz, _ = frequencies(model.stiffness[free][:, free], model.mass[free][:, free], 10, 20.0)
    assert np.all(hz[: case["rigid_modes"]] < 1e-2)
    elastic, reference = hz[case["rigid_modes"] :], case["reference_hz"]
    assert elastic[0] == pytest.approx(reference[0], rel=case["tolerance_first"])
    assert elastic[1:] == pytest.approx(reference[1:], rel=case["tolerance_others"])
