"""Nodal stresses against NAFEMS LE10 and, where it is installed, against CalculiX."""

import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from expected import data
from scipy.sparse.linalg import spsolve
from skfem import Basis, ElementTetP2, ElementVector, FacetBasis, LinearForm, MeshTet1, MeshTet2
from skfem.models.elasticity import linear_elasticity
from solids import STEEL, round_bar

from cranktrain.engine.parts import Material
from cranktrain.structure.fem.elasticity import component_dofs, finite_elements, lame
from cranktrain.structure.stress.nodal_stress import NodalStress, principal, von_mises

YY = 1


def thick_plate(case, around, across, through):
    """Quarter of the elliptic plate; parameters (share from inner to outer ellipse, angle, height)."""
    (a, b), (c, d) = case["inner_half_axes_m"], case["outer_half_axes_m"]
    mesh = MeshTet2.from_mesh(
        MeshTet1.init_tensor(
            np.linspace(0, 1, across + 1) ** 1.5,
            np.linspace(0, 0.5 * np.pi, around + 1),
            np.linspace(0, case["thickness_m"], through + 1),
        )
    )
    share, angle, height = mesh.doflocs
    x, y = ((p + share * (q - p)) * f(angle) for p, q, f in ((a, c, np.cos), (b, d, np.sin)))
    return mesh, replace(mesh, doflocs=np.vstack((x, y, height)))


def test_nafems_le10_thick_plate():
    case = data("finite_elements")["NAFEMS_LE10"]
    flat, mesh = thick_plate(case, 10, 8, 4)
    material = Material(case["youngs_modulus_pa"], case["poisson_ratio"], 7850.0)
    model = finite_elements(mesh, material)
    dofs = component_dofs(model.basis)
    share, angle, height = flat.doflocs
    top = case["thickness_m"]
    outer = np.isclose(share, 1.0)
    fixed = np.concatenate([
        dofs[1, np.isclose(angle, 0.0) | outer], dofs[0, np.isclose(angle, 0.5 * np.pi) | outer],
        dofs[2, outer & np.isclose(height, 0.5 * top)],
    ])  # fmt: skip
    upper = FacetBasis(mesh, ElementVector(ElementTetP2()), facets=mesh.facets_satisfying(lambda p: p[2] > 0.999 * top))
    load = LinearForm(lambda v, w: -case["pressure_pa"] * v[2]).assemble(upper)
    free = np.setdiff1d(np.arange(model.basis.N), fixed)
    u = np.zeros(model.basis.N)
    u[free] = spsolve(model.stiffness[free][:, free], load[free])
    at_d = np.flatnonzero(np.isclose(share, 0.0) & np.isclose(angle, 0.0) & np.isclose(height, top))
    stress = NodalStress.of(mesh, material, at_d)(u[dofs][:, :, None])[0, YY, 0]
    assert stress == pytest.approx(case["stress_yy_at_d_pa"], rel=0.02)


def test_surface_of_a_twisted_bar_converges_at_second_order():
    """τ = G ϑ' R on the surface of a round bar; there σ₁ = −σ₃ = τ, and the third principal stress vanishes."""
    radius, length, angle = 0.02, 0.08, 1e-3
    shear = lame(STEEL)[1] * angle / length * radius
    errors = []
    for refinements, layers in ((2, 4), (3, 8), (4, 16)):
        mesh = round_bar(radius, length, refinements, layers)
        x, y, z = mesh.doflocs
        middle = np.flatnonzero(np.isclose(np.hypot(x, y), radius) & np.isclose(z, 0.5 * length))
        twist = np.stack((-angle * z / length * y, angle * z / length * x, 0 * x))[:, :, None]
        stress = NodalStress.of(mesh, STEEL, middle)(twist)[0]
        errors.append(np.abs(principal(stress) / shear - [-1.0, 0.0, 1.0]).max())
        assert von_mises(stress) == pytest.approx(np.sqrt(3.0) * shear, rel=errors[-1])
    assert np.log2(errors[-2] / errors[-1]) == pytest.approx(2.0, abs=0.4)
    assert errors[-1] < 5e-3


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
def test_stresses_of_calculix(tmp_path):
    """A curved bar, clamped at one end and pulled across at the other, with CalculiX's four-point quadrature."""
    mesh = round_bar(0.02, 0.08, 2, 6)
    basis = Basis(mesh, ElementVector(ElementTetP2()), intorder=2)
    stiffness = linear_elasticity(*lame(STEEL)).assemble(basis).tocsc()
    dofs = component_dofs(basis)
    z = mesh.doflocs[2]
    clamped, pulled = np.flatnonzero(np.isclose(z, 0.0)), np.flatnonzero(np.isclose(z, z.max()))
    load = np.zeros(basis.N)
    load[dofs[0, pulled]] = 100.0
    load[dofs[2, pulled]] = 300.0
    free = np.setdiff1d(np.arange(basis.N), dofs[:, clamped])
    u = np.zeros(basis.N)
    u[free] = spsolve(stiffness[free][:, free], load[free])
    ours = NodalStress.of(mesh, STEEL, np.arange(z.size))(u[dofs][:, :, None])[0]

    deck = tmp_path / "bar.inp"
    deck.write_text(calculix_deck(mesh, STEEL, clamped, dict.fromkeys(pulled, (100.0, 0.0, 300.0))))
    subprocess.run([shutil.which("ccx"), "bar"], cwd=tmp_path, check=True, capture_output=True)
    theirs = calculix_stresses((tmp_path / "bar.frd").read_text(), z.size)
    away = np.setdiff1d(np.arange(z.size), clamped)
    difference = von_mises(ours[:, away] - theirs[:, away]) / von_mises(theirs[:, away])
    assert np.median(difference) < 1e-3


def calculix_deck(mesh, material, clamped, forces):
    """Static analysis of ten-node tetrahedra, nodes numbered from 1."""
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{k}, {x:.12e}, {y:.12e}, {z:.12e}" for k, (x, y, z) in enumerate(mesh.doflocs.T, 1)]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=BODY")
    # CalculiX, as Abaqus, has its mid-side nodes on 12, 23, 31, 14, 24, 34: the order of scikit-fem.
    elements = mesh.dofs.element_dofs.T + 1
    corners = mesh.p[:, mesh.t]
    left_handed = np.linalg.det((corners[:, 1:] - corners[:, :1]).transpose(2, 0, 1)) < 0.0
    elements[left_handed] = elements[left_handed][:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    lines += [f"{k}, " + ", ".join(map(str, nodes)) for k, nodes in enumerate(elements, 1)]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{material.youngs_modulus:.9e}, {material.poisson_ratio}"]
    lines += ["*SOLID SECTION, ELSET=BODY, MATERIAL=M", "*NSET, NSET=HELD"]
    lines += [f"{k + 1}," for k in clamped]
    lines += ["*BOUNDARY", "HELD, 1, 3", "*STEP", "*STATIC", "*CLOAD"]
    lines += [f"{k + 1}, {axis}, {f:.9e}" for k, force in forces.items() for axis, f in enumerate(force, 1)]
    return "\n".join([*lines, "*NODE FILE", "U", "*EL FILE", "S", "*END STEP", ""])


def calculix_stresses(text, nodes):
    """Nodal stresses (6, nodes) of a result file in fixed columns; components xx, yy, zz, xy, yz, zx."""
    part = text[text.index(" STRESS ") :]
    found = np.zeros((6, nodes))
    for line in part[: part.index("\n -3")].splitlines():
        if re.match(r" -1", line):
            found[:, int(line[3:13]) - 1] = [float(line[13 + 12 * k : 25 + 12 * k]) for k in range(6)]
    return found
