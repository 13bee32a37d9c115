"""Findley's criterion: shear amplitude combined with the largest normal stress, on the worst plane.

    max over planes of (τ_a + k max σ_n) ≤ f,     σ₋₁/τ₋₁ = 2/(1 + k/√(1 + k²)),     f = τ₋₁ √(1 + k²)

τ_a is the radius of the smallest circle around the path of the shear stress in the plane, so loads may be out of phase.
Mean stress enters through σ_n.

Source: W. N. Findley, A theory for the effect of mean stress on fatigue of metals under combined torsion and axial load
or bending, J. Eng. Ind. 81 (1959) 301–306.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.engine.limits import CrankStrength
from cranktrain.results.strength.fatigue import REVERSED_SHEAR, FilletHistory, Judgement, surface_strength

PLANES = 900
"""Number of planes over half a sphere, about 5 degrees apart."""
_ROUNDS = 200


class PlaneStress(NamedTuple):
    """Shear amplitude, largest and mean normal stress, Pa, of the worst plane, and its normal (3,)."""

    shear: float
    normal: float
    normal_mean: float
    direction: Array


def findley_constants(tension: float, shear: float) -> tuple[float, float]:
    """Constants k and f (Pa) from the fully reversed strengths in tension and shear, Pa; ``InputError``."""
    share = 2.0 * shear / tension - 1.0
    if not 0.0 <= share < 1.0:
        raise InputError(
            f"Findley's criterion needs a strength in shear 0.5 to 1 times that in tension, got {shear / tension:.3g}"
        )
    k = share / math.sqrt(1.0 - share**2)
    return k, shear * math.sqrt(1.0 + k * k)


def worst_plane(tensor: Array, k: float) -> PlaneStress:
    """Plane with the largest τ_a + k max σ_n under stresses (n, 6), Pa, in the order of :class:`FilletHistory`."""
    xx, yy, zz, xy, yz, zx = np.asarray(tensor, dtype=float).T
    stress = np.stack([np.stack(row, -1) for row in ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz))], -2)
    normals, first, second = _plane_axes()
    traction = stress @ normals.T  # (n, 3, planes)
    along, u, v = (np.einsum("nip,pi->np", traction, axis) for axis in (normals, first, second))
    normal = along.max(axis=0)
    # Upper bound of the criterion: half the diagonal of the box around a shear path exceeds the circle's radius.
    bound = 0.5 * np.hypot(np.ptp(u, axis=0), np.ptp(v, axis=0)) + k * normal
    worst, plane = -math.inf, PlaneStress(0.0, 0.0, 0.0, np.zeros(3))
    for p in np.argsort(-bound):
        if bound[p] <= worst:
            break
        shear = least_circle(np.stack([u[:, p], v[:, p]], axis=1))
        if shear + k * normal[p] > worst:
            worst = shear + k * float(normal[p])
            plane = PlaneStress(shear, float(normal[p]), float(along[:, p].mean()), normals[p])
    return plane


def least_circle(points: Array) -> float:
    """Radius of the smallest circle around points (n, 2), by Badoiu and Clarkson's iteration for its centre."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    best = math.inf
    for step in range(1, _ROUNDS):
        distance = np.hypot(*(points - centre).T)
        far = int(distance.argmax())
        best = min(best, float(distance[far]))
        centre = centre + (points[far] - centre) / (step + 1.0)
    return best


@cache
def _plane_axes() -> tuple[Array, Array, Array]:
    """Normals (planes, 3) spread evenly over half a sphere, axes included, and two unit vectors in each plane."""
    golden = math.pi * (3.0 - math.sqrt(5.0))
    z = (np.arange(PLANES) + 0.5) / PLANES
    r = np.sqrt(1.0 - z * z)
    turn = golden * np.arange(PLANES)
    normals = np.concatenate([np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1), np.eye(3)])
    first = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1)[:, None]
    return normals, first, np.cross(normals, first)


def findley_judgement(history: FilletHistory, strength: CrankStrength) -> Judgement:
    """Safety factor of a place by Findley's criterion; amplitude and mean are τ_a and mean σ_n in the worst plane."""
    tension = surface_strength(strength, history.gradient)
    k, limit = findley_constants(tension, REVERSED_SHEAR * tension)
    plane = worst_plane(history.tensor, k)
    present = plane.shear + k * plane.normal
    safety = limit / present if present > 0.0 else math.inf
    return Judgement(history.name, safety, plane.shear, plane.normal_mean, safety * plane.shear, history.converged)
