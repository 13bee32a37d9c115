"""Control volumes of a film between rough surfaces, with flow factors on faces and the mean gap in volumes.

The flow through a face and the oil in a volume follow from the nominal film h, with the factors of
:mod:`cranktrain.film.reynolds.flow_factors` at H = h/σ:

    q_x = Ū h_T + ½ (U₁ − U₂) σ φ_s − φ_x h³/(12 η) ∂p/∂x,    φ_s = b Φ_s(H, γ),    b = (σ₁² − σ₂²)/σ²,

and with 1/γ across. h_T is the mean gap between Gaussian surfaces. Both surfaces have the same pattern γ.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel
from cranktrain.core.types import Array
from cranktrain.film.reynolds.flow_factors import (
    flow_factor_constants,
    mean_gap,
    pressure_flow_factor,
    shear_flow_factor,
)
from cranktrain.film.reynolds.volumes import Faces, Rectangle, cell_sums

# Rows of the result of _factors: φ h³ (m³), h_T (m), σ φ_s (m), dh_T/dh.
CUBE, GAP, SLIP, GROWTH, N_ROWS = range(5)


@dataclass(frozen=True)
class Roughness:
    """Combined roughness of both surfaces; ``InputError`` for values without flow factors.

    Parameters
    ----------
    height : σ, standard deviation of the combined heights of both surfaces, m
    pattern : γ, 1 isotropic, up to 9 stretched along x, down to 1/9 across it
    bias : b = (σ₁² − σ₂²)/σ²; 0 for equal surfaces, 1 (−1) if the second (first) surface is smooth
    """

    height: float
    pattern: float = 1.0
    bias: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.height) and self.height > 0.0):
            raise InputError(f"roughness: height {self.height:g} m must be above zero; smooth surfaces need none")
        if not -1.0 <= self.bias <= 1.0:
            raise InputError(f"roughness: bias {self.bias:g} is not within -1 to 1; surfaces that are alike have 0")
        flow_factor_constants(self.pattern)


class RoughGap(NamedTuple):
    """Face and volume integrals of a film between rough surfaces; (n_x, n_z) each."""

    faces: Faces
    """Integrals ∫φ h³ and ∫h_T over the faces."""
    slip_x: Array
    """Integral ∫σ φ_s dz over the face, m²: factor of the additional flow by the difference of surface speeds."""
    slip_z: Array
    mean: Array
    """Mean gap h_T of the node's volume, m."""
    growth: Array
    """Derivative dh_T/dh of the node's volume."""


def rough_gap(h: Array, grid: Rectangle, stepped: bool, roughness: Roughness) -> RoughGap:
    """Make faces and volumes of the film ``h``, given at the nodes (n_x, n_z) or, if ``stepped``, in each cell."""
    along, across = flow_factor_constants(roughness.pattern), flow_factor_constants(1.0 / roughness.pattern)
    if stepped:
        f_x, f_z = _factors(h, roughness, along), _factors(h, roughness, across)
        sums_x = [cell_sums(values, grid)[0] for values in f_x]
        sums_z = [cell_sums(values, grid)[1] for values in f_z]
        mean, growth = (cell_sums(values, grid)[2] / grid.areas for values in (f_x[1], f_x[3]))
        return RoughGap(Faces(sums_x[0], sums_z[0], sums_x[1], sums_z[1]), sums_x[2], sums_z[2], mean, growth)
    f_x = _factors(0.5 * (h + np.roll(h, -1, axis=0)), roughness, along)
    f_z = _factors(0.5 * (h + np.roll(h, -1, axis=1)), roughness, across)
    wide_x = grid.width_z * (grid.step_x > 0.0)[:, None]
    wide_z = grid.width_x[:, None] * (grid.step_z > 0.0)
    nodes = _factors(h, roughness, along)
    faces = Faces(f_x[0] * wide_x, f_z[0] * wide_z, f_x[1] * wide_x, f_z[1] * wide_z)
    return RoughGap(faces, f_x[2] * wide_x, f_z[2] * wide_z, nodes[1], nodes[3])


def _factors(h: Array, roughness: Roughness, constants: Array) -> Array:
    """Return φ h³ (m³), h_T (m), σ φ_s (m) and dh_T/dh of each film in ``h``, (4, *h.shape)."""
    out = np.zeros((N_ROWS, h.size))
    _fill(np.ascontiguousarray(h, dtype=float).ravel(), roughness.height, roughness.bias, constants, out)
    return out.reshape(N_ROWS, *h.shape)


@kernel
def _fill(films, sigma, bias, constants, out):
    """Compute φ h³, h_T, σ φ_s and dh_T/dh of n films, in ``out`` (4, n)."""
    for k in range(films.shape[0]):
        ratio = films[k] / sigma
        factor, _ = pressure_flow_factor(ratio, constants)
        gap, growth = mean_gap(ratio)
        slip, _ = shear_flow_factor(ratio, constants)
        out[CUBE, k] = factor * films[k] ** 3
        out[GAP, k] = sigma * gap
        out[SLIP, k] = sigma * bias * slip
        out[GROWTH, k] = growth
