"""What an engine block is made of against closed forms: a bored plate one element thick, and a thin-walled box.

Free annular plate: Kirchhoff's theory, w = (A J_n + B Y_n + C I_n + D K_n)(kr) cos nφ with M_r = V_r = 0 at both
edges (Leissa, *Vibration of Plates*, NASA SP-160, chapter 2). Box: Timoshenko's beam with Cowper's shear coefficient
(J. Appl. Mech. 33 (1966) 335) and longitudinal motion of a bar. NAFEMS FV52 is in ``test_finite_elements.py``.
"""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ivp, jvp, kvp, yvp
from solids import frequencies, ring, timoshenko_free_free

from cranktrain.engine.parts import Material
from cranktrain.structure.fem.elasticity import component_dofs, finite_elements
from cranktrain.structure.fem.mesh import NETGEN_EDGES, quadratic_mesh

IRON = Material(youngs_modulus=120e9, poisson_ratio=0.26, density=7200.0)
E, NU, RHO = IRON.youngs_modulus, IRON.poisson_ratio, IRON.density


def free_annulus(inner, outer, thickness, highest):
    """Frequencies (Hz) of a free annular plate up to ``highest``, twice each where there are nodal diameters."""
    stiffness = E * thickness**3 / (12 * (1 - NU**2))
    speed = np.sqrt(stiffness / (RHO * thickness))

    def edge(n, k, r):
        rows = []
        for function, sign in ((jvp, -1), (yvp, -1), (ivp, 1), (kvp, 1)):
            w, first, second = (k**d * function(n, k * r, d) for d in range(3))
            moment = second + NU * (first / r - n**2 * w / r**2)
            # ∇²w = ±k² w
            shear = sign * k**2 * first - (1 - NU) * n**2 / r**2 * (first - w / r)
            rows.append((moment / k**2, shear / k**3))
        return np.array(rows).T

    def determinant(n, k):
        matrix = np.vstack((edge(n, k, inner), edge(n, k, outer)))
        return np.linalg.det(matrix / np.linalg.norm(matrix, axis=0))

    found = []
    grid = np.linspace(0.5, np.sqrt(2 * np.pi * highest / speed) * outer, 400) / outer
    for n in range(7):
        values = [determinant(n, k) for k in grid]
        for a, b, va, vb in zip(grid, grid[1:], values, values[1:], strict=False):
            if va * vb < 0:
                k = brentq(lambda k, n=n: determinant(n, k), a, b)
                found += [speed * k**2 / (2 * np.pi)] * (2 if n else 1)
    return np.sort(found)


@pytest.mark.parametrize("hole", [0.045, 0.1])
def test_bored_plate_one_element_thick(hole):
    """Elements five times as long as thick, as in a block's walls and its cover."""
    outer, thickness = 0.2, 0.004
    model = finite_elements(ring(hole, outer, thickness, 64, 8, 1), IRON)
    hz, _ = frequencies(model.stiffness, model.mass, 16, 20.0)
    exact = free_annulus(hole, outer, thickness, 1000.0)
    assert exact.size >= 8
    assert hz[6 : 6 + 8] == pytest.approx(exact[:8], rel=0.01)


SIDE, WALL, LENGTH = 0.1, 0.005, 1.0


@pytest.fixture(scope="module")
def box():
    """Modes of a square tube from the CAD kernel that also meshes blocks; sides about the middle of the wall."""
    from netgen import occ

    a, b = 0.5 * (SIDE + WALL), 0.5 * (SIDE - WALL)
    shape = occ.Box(occ.Pnt(-a, -a, 0), occ.Pnt(a, a, LENGTH)) - occ.Box(occ.Pnt(-b, -b, -1), occ.Pnt(b, b, 2 * LENGTH))
    mesh = occ.OCCGeometry(shape).GenerateMesh(maxh=0.03, parallel_meshing=False)
    mesh.SecondOrder()
    tets = mesh.Elements3D().NumPy()["nodes"] - 1
    model = finite_elements(quadratic_mesh(np.asarray(mesh.Coordinates()), tets, {}, NETGEN_EDGES), IRON)
    hz, modes = frequencies(model.stiffness, model.mass, 40, 800.0)
    nodes = component_dofs(model.basis)
    return hz, (model.mass @ modes)[nodes], model.positions[:, nodes[0]]


def test_bending_and_longitudinal_motion_of_a_box(box):
    """Timoshenko's beam with Cowper's shear coefficient of a thin-walled square tube, and a bar."""
    hz, _, _ = box
    # Cowper's shear coefficient of a thin-walled square tube.
    shear = 20 * (1 + NU) / (48 + 39 * NU)
    outer, inner = SIDE + WALL, SIDE - WALL
    exact = timoshenko_free_free(0, LENGTH, outer**2 - inner**2, (outer**4 - inner**4) / 12, shear, IRON)
    assert hz[6:8] == pytest.approx(exact, rel=0.01)
    hz, (_, _, w), (_, _, z) = box
    longitudinal = hz[np.argmax(np.abs(np.cos(np.pi * z / LENGTH) @ w))]
    assert longitudinal == pytest.approx(np.sqrt(E / RHO) / (2 * LENGTH), rel=0.01)
