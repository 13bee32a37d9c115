"""The one form in which every body reaches the dynamics.

In a frame that turns at Ω about z a body with modal coordinates q obeys

    q̈ + (D + 2Ω G) q̇ + [diag(ω²) + Ω² (K_σ − C) + Ω̇ G] q = Ω² f_c − Ω̇ f_e + Σ Φᵀ f

with G_ij = ∫ρ φ_i·(e_z×φ_j), C_ij = ∫ρ (e_z×φ_i)·(e_z×φ_j), f_c,i = ∫ρ φ_i·X_⊥, f_e,i = ∫ρ φ_i·(e_z×X) and K_σ the
geometric stiffness of the stress that the centrifugal load of Ω = 1 rad/s produces. Modes are normalised to unit
modal mass; the first six are the exact rigid-body motions (three translations, then rotations about x, y, z through the
frame's origin, made orthonormal), with ω = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SCHEMA = 1


@dataclass(frozen=True, eq=False)
class ReducedBody:
    """A body in n modes with its shapes at m interfaces (SI).

    Attributes
    ----------
    name : str
    omega : (n,) natural angular frequencies, rad/s; the first six are 0
    interfaces : m names, e.g. ``main[1]``, ``pin[1]``, ``pulley``, ``flywheel``, ``thrust``
    positions : (m, 3) undeformed position of each interface node, m
    shapes : (m, 6, n) translation (m) and rotation (rad) of each interface per unit modal coordinate
    gyroscopic, centrifugal, stress_stiffness : (n, n) G, C, K_σ
    centrifugal_load, euler_load : (n,) f_c, f_e
    translation : (3, n) ∫ρ φ_i·e_k, the modal projection of a unit acceleration field (gravity)
    mass : kg
    centre : (3,) centre of mass, m
    inertia : (3, 3) inertia tensor about the frame's origin, kg m²
    digest : content digest of the inputs the body was made from
    """

    name: str
    omega: Array
    interfaces: tuple[str, ...]
    positions: Array
    shapes: Array
    gyroscopic: Array
    centrifugal: Array
    stress_stiffness: Array
    centrifugal_load: Array
    euler_load: Array
    translation: Array
    mass: float
    centre: Array
    inertia: Array
    digest: str = ""
    quality: dict[str, float] = field(default_factory=dict)

    @property
    def n_modes(self) -> int:
        """Number of modal coordinates."""
        return int(self.omega.size)

    @property
    def frequencies_hz(self) -> Array:
        """Natural frequencies, (n,) Hz."""
        return np.asarray(self.omega / (2.0 * np.pi))

    def index(self, interface: str) -> int:
        """Row of an interface by name; ``KeyError`` if the body has none of that name."""
        try:
            return self.interfaces.index(interface)
        except ValueError:
            raise KeyError(f"body '{self.name}' has no interface '{interface}'") from None
