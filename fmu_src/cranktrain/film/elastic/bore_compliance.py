"""Compliance of the elastic bore of a plain bearing, reduced to a few shapes of radial displacement.

The surface of the bore has the coordinates of the film, φ from the x axis in the sense of rotation and ζ = 2z/L in
[−1, 1]. A film pressure p widens the bore by

    δ(φ, ζ) = Σ_k s_k(φ, ζ) c_k q_k,      q_k = ∫ p s_k dA,      ⟨s_j s_k⟩ = δ_jk,

with ⟨·⟩ the mean over the area. Shapes are sums of *patterns*, Fourier functions of φ times Legendre polynomials of ζ,
which are orthonormal in this mean. There are two kinds of shapes:

* *local*: ⟨s_k m⟩ = 0 for every rigid motion m = (cos φ, sin φ, ζ cos φ, ζ sin φ) of the bore, because the modes of the
  body that holds the bore contain these motions. The load path from the film to the supports also deforms the bore, by
  s_k g_k · ∫ p m dA; this part is as large as the local part. It is included in δ if q_k is computed with the weights
  s_k + g_k · m / c_k of :meth:`BoreCompliance.weights` instead of s_k. The law is then not symmetric. It is exact for
  a given load, but neglects the motion of the bore that would return the energy.
* *with motion*: the motions m are part of the shapes, for a bore that no other body holds. The law is symmetric and
  contains all of the above effects; it cannot generate energy.
"""

from dataclasses import dataclass

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.film.elastic.grid import ElasticGrid

LOBE = np.radians(120.0)
"""Extent (rad) of the film pressure that defines the captured fraction: half a cosine around, a parabola across."""


@dataclass(frozen=True, eq=False)
class BoreCompliance:
    """Elastic shapes of a bore and their compliance.

    Attributes
    ----------
    coefficients : (k, 2 waves + 1, degree + 1) factor of each pattern in each shape, see :func:`patterns`
    compliance : (k,) c_k in falling order, m/N
    load_coupling : (k, 4) g_k, m/N; zero for shapes with motion
    captured : (k,) fraction of the strain energy in the first 1 … k shapes under a film pressure of extent ``LOBE``,
        averaged over its direction
    area : film area, m²
    grid : grid of films in the bore; None for the grids of :mod:`cranktrain.film.laws.ehd`
    """

    coefficients: Array
    compliance: Array
    load_coupling: Array
    captured: Array
    area: float
    grid: ElasticGrid | None = None

    def shapes(self, angles: Array, zetas: Array) -> Array:
        """Return the radial shapes s_k on a grid, (k, n_phi, n_zeta): ``angles`` (n_phi,) rad, ``zetas`` (n_zeta,)."""
        waves, degree = (self.coefficients.shape[1] - 1) // 2, self.coefficients.shape[2] - 1
        around, along = patterns(np.asarray(angles), np.asarray(zetas), waves, degree)
        return np.einsum("kml,mi,lj->kij", self.coefficients, around, along)

    def weights(self, angles: Array, zetas: Array) -> Array:
        """Return pressure weights w_k on a grid, (k, n_phi, n_zeta); c_k ∫ p w_k dA includes the load path."""
        cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
        even, odd = np.ones_like(zetas), np.asarray(zetas)
        motions = np.stack((cos * even, sin * even, cos * odd, sin * odd))
        share = self.load_coupling / self.compliance[:, None]
        return self.shapes(angles, zetas) + np.einsum("kr,rij->kij", share, motions)


RIGID_BORE = BoreCompliance(np.zeros((0, 3, 2)), np.zeros(0), np.zeros((0, 4)), np.zeros(0), 1.0)
"""Compliance of a rigid bore."""


def patterns(angles: Array, zetas: Array, waves: int, degree: int) -> tuple[Array, Array]:
    """Return the circumferential and axial factors of the patterns, orthonormal in the mean over the area.

    Returns
    -------
    (2 waves + 1, …) functions of the angle, 1, √2 cos φ, √2 sin φ, √2 cos 2φ …; and (degree + 1, …) of ζ, √(2l + 1) P_l
    """
    turns = np.arange(1, waves + 1).reshape(-1, *(1,) * np.ndim(angles)) * np.asarray(angles)
    around = np.ones((2 * waves + 1, *np.shape(angles)))
    around[1::2], around[2::2] = np.sqrt(2.0) * np.cos(turns), np.sqrt(2.0) * np.sin(turns)
    along = np.stack(
        [np.sqrt(2 * k + 1) * np.polynomial.Legendre.basis(k)(np.asarray(zetas)) for k in range(degree + 1)]
    )
    return around, along


def reduced_compliance(patternwise: Array, area: float, count: int, with_motion: bool = False) -> BoreCompliance:
    """Return the eigenvectors of the compliance as shapes, softest first.

    Parameters
    ----------
    patternwise : (2 waves + 1, degree + 1, 2 waves + 1, degree + 1) m³/Pa, ∫ψ_i u(ψ_j) dA with u(ψ_j) the radial
        displacement per unit pressure in pattern ψ_j; waves and degree at least 1
    area : film area, m²
    count : number of shapes to keep
    with_motion : whether the shapes include rigid motions of the bore

    Raises
    ------
    InputError
        if ``count`` exceeds the number of patterns
    """
    around, along = patternwise.shape[:2]
    rigid = np.zeros((around, along), dtype=bool)
    rigid[1:3, :2] = not with_motion
    local = np.flatnonzero(~rigid)
    if not 1 <= count <= local.size:
        raise InputError(f"bore: {count} shapes wanted; the patterns allow 1 to {local.size}")
    matrix = patternwise.reshape(around * along, around * along) / area**2
    matrix = 0.5 * (matrix + matrix.T)
    values, vectors = np.linalg.eigh(matrix[np.ix_(local, local)])
    values, vectors = values[::-1], vectors[:, ::-1]
    # The sign of an eigenvector is arbitrary, so the largest component is made positive.
    vectors = vectors * np.sign(vectors[np.abs(vectors).argmax(axis=0), np.arange(local.size)])
    energy = values * ((_lobe(around, along)[:, local] @ vectors) ** 2).sum(axis=0)
    coefficients = np.zeros((count, around * along))
    coefficients[:, local] = vectors[:, :count].T
    coupling = np.zeros((count, 4))
    if not with_motion:
        # The patterns √2 cos φ, √2 sin φ, √6 ζ cos φ, √6 ζ sin φ are scaled to resultants, forces before moments.
        moved = np.array([along, 2 * along, along + 1, 2 * along + 1])
        coupling = vectors[:, :count].T @ matrix[np.ix_(local, moved)] * np.sqrt([2.0, 2.0, 6.0, 6.0])
    return BoreCompliance(
        coefficients=coefficients.reshape(count, around, along),
        compliance=values[:count].copy(),
        load_coupling=coupling,
        captured=np.cumsum(energy)[:count] / energy.sum(),
        area=area,
    )


def _lobe(around: int, along: int) -> Array:
    """Return the pattern coefficients of a pressure of extent ``LOBE`` in 24 directions, (24, around · along)."""
    angles = 2.0 * np.pi * np.arange(1440) / 1440
    zetas, weights = np.polynomial.legendre.leggauss(along + 2)
    in_angle, in_zeta = patterns(angles, zetas, (around - 1) // 2, along - 1)
    across = in_zeta @ (0.5 * weights * (1.0 - zetas**2))
    distance = np.abs(np.angle(np.exp(1j * angles)))
    lobe = np.where(distance < 0.5 * LOBE, np.cos(np.pi * distance / LOBE), 0.0)
    turned = np.stack([np.roll(lobe, 60 * k) for k in range(24)])
    return np.einsum("dm,l->dml", turned @ in_angle.T / angles.size, across).reshape(24, -1)
