"""Bodies of simple form, meshed without a CAD kernel, and their modes by a solver of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.sparse.linalg import LinearOperator, eigsh
from skfem import MeshTet1, MeshTet2, MeshTri

from cranktrain.engine.parts import Material
from cranktrain.structure.fem.factor import factorise

STEEL = Material(youngs_modulus=210e9, poisson_ratio=0.3, density=7850.0)


def block(size, cells, origin=(0.0, 0.0, 0.0)) -> MeshTet2:
    """Rectangular block ``size`` about ``origin``, divided ``cells`` times."""
    axes = [o + s * (np.linspace(0, 1, n + 1) - 0.5) for s, n, o in zip(size, cells, origin, strict=True)]
    return MeshTet2.from_mesh(MeshTet1.init_tensor(*axes))


def round_bar(radius: float, length: float, refinements: int, layers: int) -> MeshTet2:
    """Round bar about z from 0 to ``length``, the mid-side nodes of its surface on the circle."""
    disc = MeshTri.init_circle(refinements)
    n = disc.p.shape[1]
    points = np.vstack((np.tile(disc.p, layers + 1), np.repeat(np.linspace(0, length, layers + 1), n)))
    a, b, c = np.sort(disc.t, axis=0)
    prism = np.hstack([np.stack(t) for t in ((a, b, c, c + n), (a, b, b + n, c + n), (a, a + n, b + n, c + n))])
    mesh = MeshTet2.from_mesh(MeshTet1(points, np.hstack([prism + k * n for k in range(layers)])))
    nodes = mesh.doflocs.copy()
    ends = np.hypot(*mesh.doflocs[:2, mesh.edges])
    on_surface = mesh.nvertices + np.flatnonzero((ends > 1 - 1e-9).all(axis=0))
    on_surface = on_surface[np.isin(on_surface - mesh.nvertices, mesh.boundary_edges())]
    nodes[:2, on_surface] /= np.hypot(*nodes[:2, on_surface])
    nodes[:2] *= radius
    return replace(mesh, doflocs=nodes)


def ring(inner: float, outer: float, length: float, around: int, through: int, layers: int) -> MeshTet2:
    """Ring about z, its middle at z = 0, the bore named ``bore``; mid-side nodes on circles."""
    place = np.arange(around * (through + 1)).reshape(around, through + 1)
    a, b = place[:, :-1].ravel(), place[:, 1:].ravel()
    c, d = (np.roll(place, -1, 0)[:, k].ravel() for k in (slice(None, -1), slice(1, None)))
    low, middle, high = np.sort(np.hstack((np.stack((a, b, d)), np.stack((a, c, d)))), axis=0)
    n = place.size
    turns = 2 * np.pi * np.arange(around) / around
    radius, angle, height = np.meshgrid(
        np.linspace(inner, outer, through + 1), turns, np.linspace(-0.5, 0.5, layers + 1)
    )
    points = np.stack([x.reshape(n, -1).T.ravel() for x in (radius * np.cos(angle), radius * np.sin(angle), height)])
    points[2] *= length
    up = low + n, middle + n, high + n
    prism = np.hstack([np.stack(t) for t in ((low, middle, high, up[2]), (low, middle, up[1], up[2]), (low, *up))])
    mesh = MeshTet2.from_mesh(MeshTet1(points, np.hstack([prism + k * n for k in range(layers)])))
    nodes = mesh.doflocs.copy()
    ends = mesh.p[:, mesh.edges]
    nodes[:2, mesh.nvertices :] *= np.hypot(*ends[:2]).mean(axis=0) / np.hypot(*nodes[:2, mesh.nvertices :])
    mesh = replace(mesh, doflocs=nodes)
    facets = mesh.boundary_facets()
    corners = np.hypot(*mesh.p[:2, mesh.facets[:, facets]])
    return mesh.with_boundaries({"bore": facets[(corners < inner * (1 + 1e-9)).all(axis=0)]})


def frequencies(stiffness, mass, count, shift_hz):
    """Lowest ``count`` natural frequencies, Hz (the square root of the size where ω² < 0), and modes."""
    shift = (2 * np.pi * shift_hz) ** 2
    inverse = factorise((stiffness + shift * mass).tocsc())
    n = stiffness.shape[0]
    values, modes = eigsh(
        stiffness,
        count,
        mass,
        sigma=-shift,
        OPinv=LinearOperator((n, n), inverse.solve, dtype=float),
        v0=np.random.default_rng(1).standard_normal(n),
    )
    order = np.argsort(values)
    return np.sqrt(np.abs(values[order])) / (2 * np.pi), modes[:, order]


def timoshenko_free_free(
    mode: int, length: float, area: float, inertia: float, shear: float, material: Material
) -> float:
    """Frequency (Hz) of a free beam with the shear coefficient ``shear``; (w, ψ, M, Q)' = A (w, ψ, M, Q)."""
    modulus = material.youngs_modulus / (2 * (1 + material.poisson_ratio))
    bending = material.youngs_modulus * inertia

    def free_ends(frequency: float) -> float:
        squared = material.density * (2 * np.pi * frequency) ** 2
        change = np.array(
            [
                [0, 1, 0, 1 / (shear * modulus * area)],
                [0, 0, 1 / bending, 0],
                [0, -squared * inertia, 0, -1],
                [-squared * area, 0, 0, 0],
            ]
        )
        # Lengths over the beam's, loads over EI: a well-scaled transfer matrix.
        scale = np.array([length, 1, bending / length, bending / length**2])
        transfer = expm(length * change * scale / scale[:, None])
        return float(np.linalg.det(transfer[2:, :2]))

    euler = (np.array([4.7300407, 7.8532046, 10.9956078])[mode] / length) ** 2
    euler *= np.sqrt(bending / (material.density * area)) / (2 * np.pi)
    return brentq(free_ends, 0.7 * euler, 1.01 * euler)
