"""Mass and rotation terms of rigid slices in the modes of the body that they belong to.

A slice moves by a translation u of its reference point p and a rotation θ. Its field is linear in the position r
relative to p: u + θ×r = B [1, r] with a 3×4 matrix B, so ∫ρ u·v = tr(B_u Z B_vᵀ) with Z = ∫ρ [1, r][1, r]ᵀ. A rigid
body or a part fixed to an interface is one slice; a beam consists of many, one at each quadrature point.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cranktrain.core.types import Array

_ACROSS = np.diag([1.0, 1.0, 0.0])
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
"""Matrix of r ↦ e_z×r."""


class SliceTerms(NamedTuple):
    """Mass and rotation terms of slices in n modes, named as in :class:`.ReducedBody`, valid between elastic modes.

    ``turned_load`` (3, n) is ∫ρ (e_k×X_⊥)·φ_j.
    """

    gyroscopic: Array
    centrifugal: Array
    stress_stiffness: Array
    centrifugal_load: Array
    euler_load: Array
    translation: Array
    turned_load: Array


@dataclass(frozen=True, eq=False)
class Slices:
    """Rigid slices of a body.

    Attributes
    ----------
    places : (s, 3) reference points, m
    moments : (s, 4, 4) ∫ρ [1, r][1, r]ᵀ about the reference points, kg to kg m²
    """

    places: Array
    moments: Array

    def total(self) -> Array:
        """Moments (4, 4) of all slices about the frame's origin."""
        positions = self._positions()
        return np.asarray(np.einsum("sab,sbc,sdc->ad", positions, self.moments, positions))

    def paired(self, left: Array, right: Array) -> Array:
        """Integrals ∫ρ u_i·v_j, (n, m), of n fields u and m fields v on s slices, (s, n, 3, 4) and (s, m, 3, 4)."""
        weighed = left @ self.moments[:, None]
        n, m = left.shape[1], right.shape[1]
        return np.asarray(weighed.swapaxes(0, 1).reshape(n, -1) @ right.swapaxes(0, 1).reshape(m, -1).T)

    def outward(self) -> Array:
        """Field of X_⊥, the distance from the axis, for each of s slices, (s, 1, 3, 4)."""
        return (_ACROSS @ self._positions()[:, 1:])[:, None]

    def around(self) -> Array:
        """Field of e_z×X for each of s slices, (s, 1, 3, 4)."""
        return (TURN @ self._positions()[:, 1:])[:, None]

    def terms(self, motion: Array) -> SliceTerms:
        """Terms of s slices whose motion in n modes is ``motion`` (s, 6, n)."""
        field, outward = fields(motion), self.outward()
        turned = TURN @ field
        translation = np.zeros((self.places.shape[0], 3, 3, 4))
        translation[:, np.arange(3), np.arange(3), 0] = 1.0
        return SliceTerms(
            gyroscopic=self.paired(field, turned),
            centrifugal=self.paired(turned, turned),
            stress_stiffness=self._centrifugal_turning(motion),
            centrifugal_load=self.paired(outward, field)[0],
            euler_load=self.paired(self.around(), field)[0],
            translation=self.paired(translation, field),
            turned_load=self.paired(skew(np.eye(3)) @ outward, field),
        )

    def _centrifugal_turning(self, motion: Array) -> Array:
        """Work of the centrifugal load of Ω = 1 on the slices' second-order rotations ½ θ×(θ×r), (n, n)."""
        arm = self.moments[:, 1:] @ self.outward()[:, 0].swapaxes(1, 2)
        law = np.trace(arm, axis1=1, axis2=2)[:, None, None] * np.eye(3) - 0.5 * (arm + arm.swapaxes(1, 2))
        rotation = motion[:, 3:]
        return np.asarray(np.einsum("sai,sab,sbj->ij", rotation, law, rotation, optimize=True))

    def _positions(self) -> Array:
        """Matrices (s, 4, 4), one for each slice, that give [1, X] from [1, r]."""
        result = np.tile(np.eye(4), (self.places.shape[0], 1, 1))
        result[:, 1:, 0] = self.places
        return result


def fields(motion: Array) -> Array:
    """Field matrices (s, n, 3, 4) of the motions (s, 6, n) of s slices in n modes."""
    translation, rotation = motion[:, :3].swapaxes(1, 2), motion[:, 3:].swapaxes(1, 2)
    return np.concatenate((translation[..., None], skew(rotation)), axis=3)


def rigid_motion(places: Array) -> Array:
    """Motion (s, 6, 6) of s points (s, 3) in unit translations along and rotations about x, y, z through the origin."""
    result = np.tile(np.eye(6), (places.shape[0], 1, 1))
    result[:, :3, 3:] = -skew(places)
    return result


def rigid_basis(slices: Slices) -> Array:
    """Coefficients (6, 6) that make rigid motions about the origin orthonormal in the mass of the slices."""
    motion = fields(rigid_motion(slices.places))
    return rigid_modes(slices.paired(motion, motion))


def rigid_modes(mass: Array) -> Array:
    """Coefficients (6, 6) that make rigid motions orthonormal in their mass matrix (6, 6), rotation about z kept pure.

    Gram–Schmidt in the order r_z, t_x, t_y, t_z, r_x, r_y; columns stay in the order t_x … r_z.
    """
    order = [5, 0, 1, 2, 3, 4]
    factor = np.linalg.cholesky(mass[np.ix_(order, order)])
    coefficients = np.zeros((6, 6))
    coefficients[np.ix_(order, order)] = np.linalg.inv(factor).T
    return coefficients


def skew(vector: Array) -> Array:
    """Matrices (..., 3, 3) of the cross product r ↦ v×r for vectors v (..., 3)."""
    x, y, z = np.moveaxis(np.asarray(vector), -1, 0)
    o = np.zeros_like(x)
    return np.stack((np.stack((o, -z, y), -1), np.stack((z, o, -x), -1), np.stack((-y, x, o), -1)), -2)


def second_moments(inertia: Array) -> Array:
    """Second moments ∫ρ r rᵀ (3, 3) of an inertia tensor."""
    return np.asarray(0.5 * np.trace(inertia) * np.eye(3) - inertia)


def inertia_tensor(moments: Sequence[float]) -> Array:
    """Inertia tensor (3, 3) from three moments, or from six values xx, yy, zz, xy, xz, yz with products −∫ρ xy."""
    tensor = np.diag(np.array(moments[:3]))
    for value, (i, k) in zip(moments[3:], ((0, 1), (0, 2), (1, 2)), strict=False):
        tensor[i, k] = tensor[k, i] = value
    return tensor


def part_moments(mass: float, inertia: Array, centre: Array) -> Array:
    """Moments (4, 4) of a rigid part with a mass, kg, an inertia about its centre, kg m², and a centre of mass, m."""
    first, second = mass * centre[None], second_moments(inertia) + mass * np.outer(centre, centre)
    return np.block([[np.full((1, 1), mass), first], [first.T, second]])
