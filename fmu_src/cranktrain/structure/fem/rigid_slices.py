"""A body of rigid slices: its mass and rotation invariants from the slices' masses and their motion in the modes.

A slice moves by a translation u of its reference point p and a rotation θ; its field is linear in the position r from
there, u + θ×r = B [1, r] with a 3×4 matrix B, so that ∫ρ u·v = tr(B_u Z B_vᵀ) with Z = ∫ρ [1, r][1, r]ᵀ. The rigid
crank is one slice; a beam is many, at the points of its quadrature.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cranktrain.core.reduced_body import TURN, ReducedBody, check, rigid_coordinates, rigid_modes, skew, with_rigid_rows
from cranktrain.core.types import Array


@dataclass(frozen=True, eq=False)
class Slices:
    """Rigid slices.

    Attributes
    ----------
    places : (s, 3) reference points, m
    moments : (s, 4, 4) ∫ρ [1, r][1, r]ᵀ about them, kg to kg m²
    """

    places: Array
    moments: Array

    def total(self) -> Array:
        """Moments (4, 4) of all slices about the frame's origin."""
        positions = self._positions()
        return np.asarray(np.einsum("sab,sbc,sdc->ad", positions, self.moments, positions))

    def paired(self, left: Array, right: Array) -> Array:
        """∫ρ u_i·v_j, (n, m), of fields (s, n, 3, 4) and (s, m, 3, 4)."""
        weighed = left @ self.moments[:, None]
        n, m = left.shape[1], right.shape[1]
        return np.asarray(weighed.swapaxes(0, 1).reshape(n, -1) @ right.swapaxes(0, 1).reshape(m, -1).T)

    def outward(self) -> Array:
        """Field of X_⊥, (s, 1, 3, 4)."""
        return (np.diag([1.0, 1.0, 0.0]) @ self._positions()[:, 1:])[:, None]

    def around(self) -> Array:
        """Field of e_z×X, (s, 1, 3, 4)."""
        return (TURN @ self._positions()[:, 1:])[:, None]

    def centrifugal_turning(self, motion: Array) -> Array:
        """Work of the centrifugal load of Ω = 1 on the slices' second-order rotations ½ θ×(θ×r), (n, n)."""
        arm = self.moments[:, 1:] @ self.outward()[:, 0].swapaxes(1, 2)
        law = np.trace(arm, axis1=1, axis2=2)[:, None, None] * np.eye(3) - 0.5 * (arm + arm.swapaxes(1, 2))
        rotation = motion[:, 3:]
        return np.asarray(np.einsum("sai,sab,sbj->ij", rotation, law, rotation, optimize=True))

    def _positions(self) -> Array:
        """[1, X] in terms of [1, r], (s, 4, 4)."""
        result = np.tile(np.eye(4), (self.places.shape[0], 1, 1))
        result[:, 1:, 0] = self.places
        return result


def fields(motion: Array) -> Array:
    """Fields (s, n, 3, 4) of motions (s, 6, n)."""
    translation, rotation = motion[:, :3].swapaxes(1, 2), motion[:, 3:].swapaxes(1, 2)
    return np.concatenate((translation[..., None], skew(rotation)), axis=3)


def rigid_motion(places: Array) -> Array:
    """Motion (s, 6, 6) of points (s, 3) under translations along and rotations about x, y, z through the origin."""
    result = np.tile(np.eye(6), (places.shape[0], 1, 1))
    result[:, :3, 3:] = -skew(places)
    return result


def sliced_body(
    name: str,
    digest: str,
    interfaces: dict[str, tuple[float, float, float]],
    slices: Slices,
    omega: Array,
    shapes: Array,
    motion: Array,
    stress: Array,
) -> ReducedBody:
    """Reduced body of slices in given modes, the first six of which are rigid and orthonormal in its mass.

    Parameters
    ----------
    interfaces : names and places, m
    omega, shapes : (n,) rad/s and (m, 6, n) as of :class:`ReducedBody`
    motion : (s, 6, n) motion of the slices in the modes
    stress : (n, n) stress stiffness without that of the slices themselves, valid between elastic modes
    """
    field = fields(motion)
    turned = TURN @ field
    total = slices.total()
    centrifugal = slices.paired(turned, turned)
    turned_load = slices.paired(skew(np.eye(3)) @ slices.outward(), field)
    positions = np.array(list(interfaces.values()))
    translation = np.zeros((slices.places.shape[0], 3, 3, 4))
    translation[:, np.arange(3), np.arange(3), 0] = 1.0
    body = ReducedBody(
        name=name,
        omega=omega,
        interfaces=tuple(interfaces),
        positions=positions,
        shapes=shapes,
        gyroscopic=slices.paired(field, turned),
        centrifugal=centrifugal,
        stress_stiffness=np.zeros_like(centrifugal),
        centrifugal_load=slices.paired(slices.outward(), field)[0],
        euler_load=slices.paired(slices.around(), field)[0],
        translation=slices.paired(translation, field),
        mass=float(total[0, 0]),
        centre=total[0, 1:] / total[0, 0],
        inertia=np.trace(total[1:, 1:]) * np.eye(3) - total[1:, 1:],
        digest=digest,
    )
    whole = stress + slices.centrifugal_turning(motion)
    stiffness = with_rigid_rows(whole, centrifugal, rigid_coordinates(body), turned_load)
    body = replace(body, stress_stiffness=stiffness)
    check(body)
    return body


def rigid_basis(slices: Slices) -> Array:
    """Coefficients (6, 6) that make rigid motions about the origin orthonormal in the slices' mass."""
    motion = fields(rigid_motion(slices.places))
    return rigid_modes(slices.paired(motion, motion))
