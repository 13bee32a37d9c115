"""Stress concentration factors of a throw's fillets from finite elements, by the definitions of IACS UR M53.

The end of a quarter throw in the main journal is plane and rigid, as the rule requires. It is loaded by unit cases:

    bending    a couple about the axis across the throw: symmetric about the throw's plane and about the pin's middle
    torsion    a couple about the crank's axis: antisymmetric about both
    shear      a force along the throw with a couple that makes the moment in the middle of the web zero, held at the
    pin's middle

Factors are the greatest von Mises stress on a fillet over M/(B W²/6) in bending and over Q/(B W) in shear, and its
greatest shear stress over 16 T/(π D³) in torsion.

Source: IACS Unified Requirement M53, Rev. 1 (2004), section 3; its appendix III on factors from finite elements.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array, Integers
from cranktrain.engine.parts import Material
from cranktrain.structure.crank.sections import bare_outline, web_width
from cranktrain.structure.fem.elasticity import FEModel, component_dofs, finite_elements
from cranktrain.structure.fem.factor import factorise
from cranktrain.structure.stress.nodal_stress import NodalStress, principal, von_mises
from cranktrain.structure.stress.throw_mesh import QuarterThrow

STEEL = Material(youngs_modulus=210e9, poisson_ratio=0.3, density=7850.0)
_ON_PLANE = 1e-7


class ThrowFactors(NamedTuple):
    """Factors of pin (α) and main journal (β) in bending, torsion and shear without moment in the web.

    ``free_surface`` is the ratio of smallest to largest principal stress at the peak in bending, the larger one of pin
    and main journal. It is 0 at a free surface, so it measures the convergence of the peak.
    """

    alpha_b: float
    beta_b: float
    alpha_t: float
    beta_t: float
    beta_q: float
    free_surface: float


def throw_factors(quarter: QuarterThrow, material: Material = STEEL) -> ThrowFactors:
    """Factors of a quarter throw; takes about a minute. ``InputError`` if the CAD kernel fails."""
    model = finite_elements(quarter.mesh(), material)
    x, y, z = model.mesh.doflocs
    start, front, rear, middle = quarter.stations
    side, mid_pin, end = (np.flatnonzero(np.abs(a - b) < _ON_PLANE) for a, b in ((x, 0.0), (z, middle), (z, start)))
    dofs = component_dofs(model.basis)
    held = dofs[1, mid_pin]
    with one_thread():
        symmetric = np.concatenate((dofs[0, side], dofs[2, mid_pin]))
        loads = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, start - 0.5 * (front + rear)]])
        bent = _loaded(model, end, np.union1d(symmetric, held), ((1, 0), (2, 0), (0, 1)), loads)
        antisymmetric = np.concatenate((dofs[1:, side].ravel(), dofs[:2, mid_pin].ravel()))
        twisted = _loaded(model, end, antisymmetric, ((0, 0), (1, 1), (2, 1)), np.array([[0.0, 0.0, 1.0]]))
    pin = _fillet(x, y - quarter.throw, z, 0.5 * quarter.pin_diameter, rear, quarter.pin_fillet)
    main = _fillet(x, y, -z, 0.5 * quarter.main_diameter, -front, quarter.main_fillet)
    width, thick = quarter.web_width, quarter.web_thickness
    if (crank := quarter.crankshaft) is not None:  # halfway between the surfaces of the journals
        between = 0.5 * (0.5 * quarter.main_diameter + quarter.throw - 0.5 * quarter.pin_diameter)
        width = float(web_width(bare_outline(crank, crank.throw), np.array([between]))[0])
    at_pin, at_main = (NodalStress.of(model.mesh, material, nodes) for nodes in (pin, main))

    def greatest(stress: Array) -> float:
        return float(von_mises(stress).max())

    def shear(stress: Array) -> float:
        values = principal(stress)
        return float((values[:, 2] - values[:, 0]).max() / 2.0)

    # Nominal bending stress of the web under the loads of the quarter, which carries half of the throw's load.
    bending = 2.0 / (width * thick**2 / 6.0)
    torsion = [2.0 * 16.0 / (math.pi * d**3) for d in (quarter.pin_diameter, quarter.main_diameter)]
    (pin_bent, _), (main_bent, main_sheared) = at_pin(bent[dofs]), at_main(bent[dofs])
    return ThrowFactors(
        alpha_b=greatest(pin_bent) / bending,
        beta_b=greatest(main_bent) / bending,
        alpha_t=shear(at_pin(twisted[dofs])[0]) / torsion[0],
        beta_t=shear(at_main(twisted[dofs])[0]) / torsion[1],
        beta_q=greatest(main_sheared) / (2.0 / (width * thick)),
        free_surface=max(free_surface(pin_bent), free_surface(main_bent)),
    )


def free_surface(stress: Array) -> float:
    """Ratio of smallest to largest |principal stress| at the point of greatest von Mises stress, of tensors (6, s)."""
    sizes = np.sort(np.abs(principal(stress[:, [int(von_mises(stress).argmax())]])[0]))
    return float(sizes[0] / sizes[2])


def _loaded(
    model: FEModel, end: Integers, fixed: Integers, motions: tuple[tuple[int, int], ...], loads: Array
) -> Array:
    """Displacements (ndof, cases) under loads (cases, motions) on the rigid end.

    ``motions`` are the permitted motions of the end: (axis, 0) along an axis, (axis, 1) about it, through the origin on
    the crank's axis at z = 0.
    """
    dofs = component_dofs(model.basis)
    place = model.mesh.doflocs
    shapes = np.zeros((model.basis.N, len(motions)))
    for k, (axis, turns) in enumerate(motions):
        unit = np.eye(3)[axis]
        field = np.cross(unit, place[:, end], axisb=0).T if turns else np.repeat(unit[:, None], len(end), axis=1)
        shapes[dofs[:, end], k] = field
    shapes[fixed] = 0.0
    free = np.setdiff1d(np.arange(model.basis.N), np.concatenate((fixed, dofs[:, end].ravel())))
    force = model.stiffness @ shapes
    shapes[free] = -factorise(model.stiffness[free][:, free].tocsc()).solve(np.ascontiguousarray(force[free]))
    stiffness = shapes.T @ (model.stiffness @ shapes)
    return np.asarray(shapes @ np.linalg.solve(stiffness, loads.T))


def _fillet(across: Array, along: Array, z: Array, radius: float, face: float, fillet: float) -> Integers:
    """Nodes on the fillet of a journal that leaves the web at z = ``face`` towards larger z."""
    depth = z - face
    beside = np.hypot(np.hypot(across, along) - radius - fillet, depth - fillet)
    inside = (depth < 1.001 * fillet) & (depth > -1e-3 * fillet)
    return np.flatnonzero((np.abs(beside - fillet) < 0.05 * fillet) & inside)
