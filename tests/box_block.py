"""A block as a solid box, made by hand: every interface of an engine's block, in milliseconds.

Rayleigh–Ritz with all polynomials of the third degree in x, y and z for each component of displacement, on a box that
holds the interfaces; light and soft enough for the mass and the frequencies of a hollow block of iron.
"""

from itertools import product

import numpy as np
from scipy.linalg import eigh

from cranktrain.core.reduced_body import ReducedBody, check, rigid_modes
from cranktrain.structure.block.mesh import interface_places
from cranktrain.structure.block.shape import block_plan

DEGREE = 3
DENSITY = 1500.0
LAME, SHEAR = 2e9, 1.5e9
MARGIN = 0.05  # m around the interfaces


def _monomials(points):
    """Values (p, k) and gradients (p, k, 3) of the monomials at points (p, 3)."""
    exponents = np.array([e for e in product(range(DEGREE + 1), repeat=3) if sum(e) <= DEGREE])
    powers = points[:, None, :] ** exponents
    slopes = np.repeat(powers[..., None], 3, axis=3)
    for axis in range(3):
        e = exponents[:, axis]
        slopes[:, :, axis, axis] = e * points[:, None, axis] ** np.maximum(e - 1, 0)
    return powers.prod(axis=2), slopes.prod(axis=2)


def box_block(engine, modes=30):
    """Reduced body of the box in its first ``modes`` modes, free, with the interfaces of the engine's block."""
    places = interface_places(block_plan(engine))
    at = np.array(list(places.values()))
    low, high = at.min(axis=0) - MARGIN, at.max(axis=0) + MARGIN
    centre, half = 0.5 * (low + high), 0.5 * (high - low)
    nodes, weights = np.polynomial.legendre.leggauss(DEGREE + 1)
    grid = np.array(list(product(nodes, repeat=3)))
    volumes = np.array([np.prod(w) for w in product(weights, repeat=3)]) * half.prod()
    points = centre + half * grid
    values, slopes = _monomials(grid)
    slopes /= half
    count = values.shape[1]
    mass = np.kron(np.eye(3), DENSITY * np.einsum("q,qi,qj->ij", volumes, values, values))
    products = np.einsum("q,qic,qjd->cdij", volumes, slopes, slopes)
    stiffness = np.zeros((3, count, 3, count))
    for c, d in product(range(3), repeat=2):
        stiffness[c, :, d, :] = LAME * products[c, d] + SHEAR * products[d, c]
        if c == d:
            stiffness[c, :, d, :] += SHEAR * np.einsum("aaij->ij", products)
    squares, elastic = eigh(stiffness.reshape(3 * count, -1), mass)
    # Rigid motions of the origin, by their displacement (q, 3, 6), as polynomials.
    motions = np.zeros((len(grid), 3, 6))
    motions[:, :, :3] = np.eye(3)
    motions[:, :, 3:] = np.cross(np.eye(3)[None], points[:, None]).transpose(0, 2, 1)
    rigid = np.linalg.lstsq(values, motions.reshape(len(grid), -1), rcond=None)[0]
    rigid = rigid.reshape(count, 3, 6).transpose(1, 0, 2).reshape(-1, 6)
    whole = rigid.T @ mass @ rigid
    basis = np.hstack((rigid @ rigid_modes(whole), elastic[:, 6:modes])).reshape(3, count, modes)
    there, turning = _monomials((at - centre) / half)
    turning /= half
    gradient = np.einsum("mkd,ckn->mdcn", turning, basis)
    shapes = np.concatenate((np.einsum("mk,ckn->mcn", there, basis), np.empty((len(at), 3, modes))), axis=1)
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        shapes[:, 3 + axis] = 0.5 * (gradient[:, i, j] - gradient[:, j, i])
    body = ReducedBody(
        name="box",
        omega=np.concatenate((np.zeros(6), np.sqrt(squares[6:modes]))),
        interfaces=tuple(places),
        positions=at,
        shapes=shapes,
        # A block does not turn: these are not used.
        gyroscopic=np.zeros((modes, modes)),
        centrifugal=np.zeros((modes, modes)),
        stress_stiffness=np.zeros((modes, modes)),
        centrifugal_load=np.zeros(modes),
        euler_load=np.zeros(modes),
        translation=DENSITY * np.einsum("q,qk,ckn->cn", volumes, values, basis),
        mass=float(whole[0, 0]),
        centre=centre,
        inertia=whole[3:, 3:],
    )
    check(body)
    return body
