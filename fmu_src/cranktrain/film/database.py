"""Film table: force, moments and damping of a rigid-bore journal film over eccentricity, squeeze direction and tilt.

A plain or fully circumferentially grooved film at ambient pressure is homogeneous in its velocities, so its dimensionless
force (:mod:`cranktrain.film.journal`) depends on numbers only. In axes along and across the line of centres, with the
velocity of pure squeeze v = |v|(cos γ, sin γ) and the tilt t = (a, b), all over the clearance:

* aligned, over (ε, γ): ln M, β, ln p̂, ln q̂ of F = −|v| M (cos(γ + β), sin(γ + β)), the largest Π = |v| p̂ and the flow
  out of both ends |v| q̂ (as in :mod:`cranktrain.film.impedance`, from the two-dimensional film);
* tilted, over (ε, γ, a, b): ln M, β, the moments over |F|, the damping ∂(F, Q)/∂w over |F|/|v|, and ln p̂.

A velocity has four components and a table with tilt room for one direction: the tilted film is sampled where the tilt
turns with the line of centres, w_ref = v_t ε³/(ε⁴ + δ⁴) e_z×t, and the rest w − w_ref acts through the damping. A
journal whose tilt stands still while both surfaces turn is on that family (for ε ≫ δ); near the centre, where the line of
centres may turn at any rate, δ keeps the family finite.

Axes: x = −ln(1 − 0.97 ε) + 0.6 ln(1 + ε/0.1) and y = γ − 0.4 sin γ − 0.15 sin 2γ, uniform, y periodic
(nodes gather where a thin film passes from squeeze to wedge, about ±95°, and where the surfaces part); the tilt as shares
A = a/(√(1 − b²) − ε), B = b/√(1 − ε²) of what is possible before an end touches, both stretched by artanh. The box
|A|, |B| ≤ tilt range so fills the lens of possible tilts without a kink. Two mirrors, z → −z and about the line of centres,
leave a quarter of it to solve and to store; the splines are those of the whole.

Splines: cubic in x and y (C²), quadratic in A and B (C¹), coefficients of all functions side by side. The tilted films
are extrapolated (Richardson) from 8 and 16 axial intervals, spaced by a sine towards the ends: at a strong tilt the
pressure stands within a few per cent of the width, where even intervals err by 5 to 10 %.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from typing import NamedTuple

import numpy as np

from cranktrain.errors import InputError, SolverError, nearest
from cranktrain.film.journal import DAMPING, OUT_SIZE, film_observables, journal_film
from cranktrain.film.journal_grid import JournalGrid, cold_start, journal_grid, journal_work
from cranktrain.kernel import kernel
from cranktrain.reduced_body import Array

SCHEMA = 1
GROOVES = ("none", "circumferential")
RESOLUTIONS = {"coarse": (20, 28, 4), "default": (40, 56, 5), "fine": (48, 72, 6)}
"""Nodes over ε, γ and (from zero to the tilt range) each of A, B of the tilted table."""
N_ALIGNED = (49, 96)
TILT_GRIDS = ((64, 8), (64, 16))
ALIGNED_GRID = (144, 24)
ONLINE_GRID = (48, 12)
AXIAL_SINE = 0.98

STRETCH, LOW_SHARE, LOW_WIDTH = 0.97, 0.6, 0.1
GATHERED = (0.4, 0.15)
TILT_STRETCH = 0.9
CENTRED_TURN = 0.15
"""δ: eccentricity below which the tilt of the sampled family no longer turns with the line of centres."""
RATES = (1.0, 2.0)
ALIGNED_MAX = 0.995
TILTED_MAX = 0.98
FUNCTIONS = 12

LN_FORCE, TURN, MOMENT_R, MOMENT_T, D_FW, D_WW, LN_PRESSURE = 0, 1, 2, 3, 4, 8, 11


@dataclass(frozen=True)
class TableSettings:
    """What a table is made for; two equal ones give equal tables.

    length_ratio : L/D, the whole width
    groove : none, or circumferential: zero pressure all round at z = 0
    resolution : coarse, default or fine
    tilt : whether the tilted table is built
    tilt_range : largest A and B, share of the possible tilt
    """

    length_ratio: float
    groove: str = "none"
    resolution: str = "default"
    tilt: bool = True
    tilt_range: float = 0.9

    def __post_init__(self) -> None:
        if not (math.isfinite(self.length_ratio) and 0.05 <= self.length_ratio <= 4.0):
            raise InputError(f"length ratio {self.length_ratio:g} of a film table is not within 0.05 to 4 (L/D)")
        if self.groove not in GROOVES:
            raise InputError(f"groove '{self.groove}' of a film table does not exist; {nearest(self.groove, GROOVES)}")
        if self.resolution not in RESOLUTIONS:
            raise InputError(f"resolution '{self.resolution}' does not exist; {nearest(self.resolution, RESOLUTIONS)}")
        if not (math.isfinite(self.tilt_range) and 0.2 <= self.tilt_range <= 0.95):
            raise InputError(f"tilt range {self.tilt_range:g} is not within 0.2 to 0.95 of the possible tilt")

    @property
    def digest(self) -> str:
        """Of everything that the table's numbers depend on."""
        constants = (SCHEMA, N_ALIGNED, TILT_GRIDS, ALIGNED_GRID, AXIAL_SINE, GATHERED, STRETCH, LOW_SHARE, LOW_WIDTH)
        family = (TILT_STRETCH, CENTRED_TURN, ALIGNED_MAX, TILTED_MAX, RESOLUTIONS[self.resolution])
        return sha256(repr((sorted(asdict(self).items()), constants, family)).encode()).hexdigest()

    @property
    def shape(self) -> tuple[int, int, int]:
        """Nodes over ε, γ and each tilt of the tilted table."""
        return RESOLUTIONS[self.resolution]


class TableArrays(NamedTuple):
    """What kernels read: contiguous float64.

    aligned : (4, n_ε + 2, n_γ + 3) spline coefficients
    tilted : (n_ε + 2, n_γ + 3, n_t + 2, 12 (n_t + 2)) spline coefficients; of length 1 in each where not built
    axes : (8,) (D/L)² of the film, tilt range, largest x of the aligned and the tilted table, :func:`aligned_norms`,
        and the tilt rates |w − w_ref| / |v| where the law begins and ends to hand over to the film solved in place
    """

    aligned: Array
    tilted: Array
    axes: Array


@dataclass(frozen=True)
class FilmTable:
    """A built table and what it is worth.

    aligned_error : (n_ε − 1, n_γ) force error at cell centres over |F|
    tilted_error : (n_ε − 1, n_γ, n_t − 1, n_t − 1) the larger of force error over |F| and moment error over |F| L/2
    """

    settings: TableSettings
    arrays: TableArrays
    aligned_error: Array
    tilted_error: Array

    @property
    def cells(self) -> int:
        """Cells of both tables, counting the stored quarter only."""
        return int(self.aligned_error.size + self.tilted_error.size)

    def with_rates(self, inside: float, outside: float) -> FilmTable:
        """Table that hands over to the film solved in place between these tilt rates |w − w_ref| / |v|."""
        if not 0.0 < inside < outside:
            raise InputError(
                f"tilt rates {inside:g} and {outside:g} of the hand-over: the first must be the smaller one"
            )
        axes = np.concatenate([self.arrays.axes[:6], [inside, outside]])
        return replace(self, arrays=self.arrays._replace(axes=axes))

    def worst(self, eccentricity: float = 1.0) -> dict[str, float]:
        """Maximum and 95th percentile of the interpolation error over cells whose centre lies below ``eccentricity``."""
        result = {}
        for name, error, top in (
            ("aligned", self.aligned_error, ALIGNED_MAX),
            ("tilted", self.tilted_error, TILTED_MAX),
        ):
            if error.size:
                chosen = error[centres(eccentricity_nodes(error.shape[0] + 1, top)) <= eccentricity]
                result[f"{name}_max"] = float(chosen.max())
                result[f"{name}_p95"] = float(np.quantile(chosen, 0.95))
        return result


def eccentricity_nodes(count: int, top: float) -> Array:
    """Eccentricities, uniform in x, from 0 to ``top``."""
    x = np.linspace(0.0, float(_stretched(top)[0]), count)
    eps = top * x / x[-1]
    for _ in range(60):
        value = -np.log(1.0 - STRETCH * eps) + LOW_SHARE * np.log(1.0 + eps / LOW_WIDTH)
        eps = np.clip(eps - (value - x) / (STRETCH / (1.0 - STRETCH * eps) + LOW_SHARE / (LOW_WIDTH + eps)), 0.0, top)
    return eps


def centres(eccentricities: Array) -> Array:
    """Eccentricities half-way in x between ``eccentricities``."""
    return eccentricity_nodes(2 * len(eccentricities) - 1, float(eccentricities[-1]))[1::2]


def directions(count: int, shift: float = 0.0) -> Array:
    """Angles γ of the nodes, uniform in y from −π, moved by a ``shift`` of cells."""
    y = -math.pi + 2.0 * math.pi * (np.arange(count) + shift) / count
    gamma = y.copy()
    for _ in range(60):
        value = gamma - GATHERED[0] * np.sin(gamma) - GATHERED[1] * np.sin(2.0 * gamma)
        gamma -= (value - y) / (1.0 - GATHERED[0] * np.cos(gamma) - 2.0 * GATHERED[1] * np.cos(2.0 * gamma))
    return gamma


def tilt_shares(settings: TableSettings, middle: bool = False) -> Array:
    """Shares A or B of the nodes, or of the cells' middles."""
    n = settings.shape[2]
    s = (np.arange(n - 1) + 0.5) / (n - 1) if middle else np.linspace(0.0, 1.0, n)
    return settings.tilt_range * np.tanh(s * math.atanh(TILT_STRETCH)) / TILT_STRETCH


def table_grid(settings: TableSettings, n_phi: int = ONLINE_GRID[0], n_z: int = ONLINE_GRID[1]) -> JournalGrid:
    """Grid of a tilted film with axial nodes gathered at the ends (and at the groove).

    The weights are scaled so that the force of a parabola, the short bearing, is exact.
    """
    grid = journal_grid(n_phi, n_z)
    if settings.groove == "none":
        z = _sine(n_z)
    else:
        half = 0.5 + 0.5 * _sine(n_z // 2)
        z = np.concatenate([-half[::-1], half[1:]])
    n = n_z - 1
    cell = 0.5 * (z[2:] - z[:-2])
    conduct = 1.0 / np.diff(z)
    free = np.ones(n, dtype=bool)
    blocked = grid.blocked.copy()
    exact = 2.0 / 3.0
    if settings.groove == "circumferential":
        free[n_z // 2 - 1] = False
        blocked[:, n_z // 2 - 1] = 1.0
        exact = 1.0 / 6.0
    matrix = np.diag(conduct[:-1] + conduct[1:]) - np.diag(conduct[1:-1], 1) - np.diag(conduct[1:-1], -1)
    weight = cell * math.sqrt(exact / (cell[free] @ np.linalg.solve(matrix[np.ix_(free, free)], cell[free])))
    axial = np.zeros((5, n + 1))
    axial[0, :n] = z[1:-1]
    axial[1, :n] = cell
    axial[2, :n] = weight
    axial[3] = 0.5 * (z[1:] + z[:-1])
    axial[4] = conduct
    outlet = grid.settings.copy()
    outlet[3] = z[1] - z[0]
    return grid._replace(axial=axial, blocked=blocked, settings=outlet)


def _sine(n: int) -> Array:
    t = np.linspace(-1.0, 1.0, n + 1)
    return np.sin(0.5 * math.pi * AXIAL_SINE * t) / math.sin(0.5 * math.pi * AXIAL_SINE)


def aligned_norms(settings: TableSettings) -> tuple[float, float]:
    """(D/L)² of the aligned film, and its flow out of the outer ends over 2 R³/L |v| q̂.

    A groove makes two films of half the width: together they carry in the norm of the whole width, each lets half of
    its flow out at the outer end.
    """
    return (1.0 / settings.length_ratio**2, 1.0) if settings.groove == "none" else (4.0 / settings.length_ratio**2, 2.0)


def slab_names(settings: TableSettings) -> list[str]:
    """Names of the pieces that are sampled one by one, in any order, independent of each other."""
    names = [f"aligned {i}" for i in range(N_ALIGNED[0])] + [f"aligned middle {i}" for i in range(N_ALIGNED[0] - 1)]
    if settings.tilt:
        n = settings.shape[0]
        names += [f"tilted {i}" for i in range(n)] + [f"tilted middle {i}" for i in range(n - 1)]
    return names


def sample_slab(settings: TableSettings, name: str) -> Array:
    """Solve all films of one slab: (n_γ, 4), or (n_γ, n_t, n_t, 12) with tilt.

    Raises
    ------
    SolverError
        where a film did not converge
    """
    kind, *middle, index = name.split()
    aligned = kind == "aligned"
    n_eps, n_gamma = N_ALIGNED if aligned else settings.shape[:2]
    eps = eccentricity_nodes(n_eps, ALIGNED_MAX if aligned else TILTED_MAX)
    if middle:
        eps = centres(eps)
    gamma = directions(n_gamma, 0.5 if middle else 0.0)
    out = np.zeros(2 * OUT_SIZE)
    if aligned:
        grid = journal_grid(*ALIGNED_GRID, half=True)
        values = np.empty((n_gamma, 4))
        status = _sample_aligned(
            eps[int(index)], gamma, aligned_norms(settings)[0], grid, journal_work(grid), cold_start(grid), out, values
        )
    else:
        share = tilt_shares(settings, bool(middle))
        coarse, fine = (table_grid(settings, *size) for size in TILT_GRIDS)
        values = np.empty((n_gamma, len(share), len(share), FUNCTIONS))
        status = _sample_tilted(
            eps[int(index)], gamma, share, 1.0 / settings.length_ratio**2, coarse, journal_work(coarse),
            cold_start(coarse), fine, journal_work(fine), cold_start(fine), out, values,
        )  # fmt: skip
    if status < 0 or not np.isfinite(values).all():
        raise SolverError(
            f"film table, slab '{name}' (eccentricity {eps[int(index)]:.4f}): a film did not converge; "
            "reduce the tilt range"
        )
    return values


def assemble(settings: TableSettings, slabs: Mapping[str, Array]) -> FilmTable:
    """Fit the splines through all slabs of :func:`slab_names` and measure their error at cell centres."""
    n_eps, n_gamma = N_ALIGNED
    values = np.stack([slabs[f"aligned {i}"] for i in range(n_eps)])
    mirrored = values[:, _opposite(n_gamma)]
    values = 0.5 * (values + mirrored * np.array([1.0, -1.0, 1.0, 1.0]))
    along = np.linalg.solve(
        _not_a_knot(n_eps), np.concatenate([values, np.zeros((2, n_gamma, 4))]).reshape(n_eps + 2, -1)
    )
    around = np.linalg.solve(_circulant(n_gamma), along.reshape(n_eps + 2, n_gamma, 4))
    aligned = np.ascontiguousarray(np.moveaxis(around[:, _wrapped(n_gamma)], 2, 0))
    tops = [float(_stretched(top)[0]) for top in (ALIGNED_MAX, TILTED_MAX)]
    axes = np.array([1.0 / settings.length_ratio**2, settings.tilt_range, *tops, *aligned_norms(settings), *RATES])
    tilted = np.zeros((1, 1, 1, 1))
    if settings.tilt:
        tilted = _tilted_spline(np.stack([slabs[f"tilted {i}"] for i in range(settings.shape[0])]))
    arrays = TableArrays(aligned, tilted, axes)
    aligned_error = np.empty((n_eps - 1, n_gamma))
    gamma = directions(n_gamma, 0.5)
    for i, eps in enumerate(centres(eccentricity_nodes(n_eps, ALIGNED_MAX))):
        _aligned_errors(slabs[f"aligned middle {i}"], eps, gamma, arrays, np.zeros(16), aligned_error[i])
    tilted_error = np.empty((0, 0, 0, 0))
    if settings.tilt:
        n, n_gamma, n_tilt = settings.shape
        tilted_error = np.empty((n - 1, n_gamma, n_tilt - 1, n_tilt - 1))
        scratch, functions = np.zeros(SCRATCH), np.zeros((5, FUNCTIONS))
        gamma, share = directions(n_gamma, 0.5), tilt_shares(settings, middle=True)
        for i, eps in enumerate(centres(eccentricity_nodes(n, TILTED_MAX))):
            solved = slabs[f"tilted middle {i}"]
            _tilted_errors(solved, eps, gamma, share, arrays, scratch, functions, tilted_error[i])
    return FilmTable(settings, arrays, aligned_error, tilted_error)


def _opposite(n: int) -> Array:
    """Index of −γ on the circle that starts at −π."""
    return (-np.arange(n)) % n


def _wrapped(n: int) -> Array:
    return np.arange(-1, n + 2) % n


def _tilted_spline(values: Array) -> Array:
    """Coefficients of the stored quarter, from values (n_ε, n_γ, n_t, n_t, 12) on it."""
    n_eps, n_gamma, n_tilt, _, _ = values.shape
    line = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 1.0])
    ends = np.array([1.0, 1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0])
    back = _opposite(n_gamma)
    # Solved on both sides of a mirror, equal to rounding; from here on to the last bit.
    values = values.copy()
    values[:, :, :, 0] = 0.5 * (values + line * values[:, back])[:, :, :, 0]
    values[:, :, 0] = 0.5 * (values + ends * line * values[:, back])[:, :, 0]
    mirrored = line * values[:, back]
    upper = np.concatenate([mirrored[:, :, :, :0:-1], values], axis=3)
    lower = np.concatenate([ends * values[:, :, :, :0:-1], ends * mirrored], axis=3)[:, :, :0:-1]
    whole = np.concatenate([lower, upper], axis=2)
    count = 2 * n_tilt - 1
    c = np.linalg.solve(
        _not_a_knot(n_eps), np.concatenate([whole, np.zeros((2, *whole.shape[1:]))]).reshape(n_eps + 2, -1)
    )
    c = c.reshape(n_eps + 2, n_gamma, -1)
    c = np.linalg.solve(_circulant(n_gamma), c)[:, _wrapped(n_gamma)]
    c = c.reshape(n_eps + 2, n_gamma + 3, count, count, FUNCTIONS)
    tilt = np.linalg.inv(_quadratic(count))[:, :count]
    c = np.einsum("ka,lb,xgabf->xgklf", tilt[n_tilt - 1 :], tilt[n_tilt - 1 :], c, optimize=True)
    return np.ascontiguousarray(c.reshape(n_eps + 2, n_gamma + 3, n_tilt + 2, FUNCTIONS * (n_tilt + 2)))


def _not_a_knot(n: int) -> Array:
    """Matrix from n + 2 cubic coefficients to n values and two conditions: no jump of f''' one node from the ends."""
    rows = np.zeros((n + 2, n + 2))
    for i in range(n):
        rows[i, i : i + 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]
    rows[n, :5] = rows[n + 1, -5:] = [1.0, -4.0, 6.0, -4.0, 1.0]
    return rows


def _quadratic(n: int) -> Array:
    """Matrix from n + 2 quadratic coefficients to n values and no jump of f'' next to the ends."""
    rows = np.zeros((n + 2, n + 2))
    for i in range(n):
        rows[i, i : i + 3] = [0.125, 0.75, 0.125]
    rows[n, :4] = rows[n + 1, -4:] = [1.0, -3.0, 3.0, -1.0]
    return rows


def _circulant(n: int) -> Array:
    row = np.zeros(n)
    row[[0, 1, -1]] = [4.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0]
    return np.array([np.roll(row, i) for i in range(n)])


SCRATCH = 4 * 2 * 9 * FUNCTIONS + 3 * 9 * FUNCTIONS + 4 * 3 * FUNCTIONS
"""Length of the memory that :func:`interpolate_tilted` works in."""


@kernel
def _stretched(eps):
    """x of an eccentricity, and its slope."""
    x = -math.log(1.0 - STRETCH * eps) + LOW_SHARE * math.log(1.0 + eps / LOW_WIDTH)
    return x, STRETCH / (1.0 - STRETCH * eps) + LOW_SHARE / (LOW_WIDTH + eps)


@kernel
def turning(eps):
    """Rate w_ref / (v_t e_z×t) at which the tilt of the sampled family turns, and its slope."""
    d4 = CENTRED_TURN * CENTRED_TURN * CENTRED_TURN * CENTRED_TURN
    e3 = eps * eps * eps
    inverse = 1.0 / (e3 * eps + d4)
    rate = e3 * inverse
    return rate, (3.0 * eps * eps - 4.0 * e3 * rate) * inverse


@kernel
def _sample_aligned(eps, gamma, ratio2, grid, work, active, out, values):
    status = 0
    for j in range(gamma.shape[0]):
        cos = math.cos(gamma[j])
        sin = math.sin(gamma[j])
        if journal_film(grid, ratio2, eps, 0.0, 0.0, 0.0, cos, sin, 0.0, 0.0, work, active, out) < 0:
            status = -1
        radial = -(out[0] * cos + out[1] * sin)
        across = -(out[1] * cos - out[0] * sin)
        values[j, 0] = 0.5 * math.log(radial * radial + across * across)
        values[j, 1] = math.atan2(across, radial)
        highest, flow = film_observables(grid, work)
        values[j, 2] = math.log(highest)
        values[j, 3] = math.log(flow)
    return status


@kernel
def _sample_tilted(
    eps, gamma, share, ratio2, coarse, coarse_work, coarse_active, fine, fine_work, fine_active, out, values
):
    """All functions at one eccentricity; ``out`` (72,) holds the results of both films."""
    n = share.shape[0]
    rate, _ = turning(eps)
    status = 0
    first = out[:OUT_SIZE]
    second = out[OUT_SIZE:]
    for k in range(n):
        for m in range(n):
            b = share[m] * math.sqrt(1.0 - eps * eps)
            a = share[k] * (math.sqrt(1.0 - b * b) - eps)
            coarse_active[0, 0] = -1.0
            fine_active[0, 0] = -1.0
            for j in range(gamma.shape[0]):
                cos = math.cos(gamma[j])
                sin = math.sin(gamma[j])
                wx = -sin * rate * b
                wy = sin * rate * a
                if (
                    journal_film(coarse, ratio2, eps, 0.0, a, b, cos, sin, wx, wy, coarse_work, coarse_active, first)
                    < 0
                ):
                    status = -1
                if journal_film(fine, ratio2, eps, 0.0, a, b, cos, sin, wx, wy, fine_work, fine_active, second) < 0:
                    status = -1
                for q in range(OUT_SIZE):
                    first[q] = -(second[q] + (second[q] - first[q]) / 3.0)
                radial = first[0] * cos + first[1] * sin
                across = first[1] * cos - first[0] * sin
                force = math.sqrt(radial * radial + across * across)
                value = values[j, k, m]
                value[LN_FORCE] = math.log(force)
                value[TURN] = math.atan2(across, radial)
                value[MOMENT_R] = first[2] / force
                value[MOMENT_T] = first[3] / force
                value[D_FW] = first[DAMPING + 2] / force
                value[D_FW + 1] = first[DAMPING + 3] / force
                value[D_FW + 2] = first[DAMPING + 6] / force
                value[D_FW + 3] = first[DAMPING + 7] / force
                value[D_WW] = first[DAMPING + 10] / force
                value[D_WW + 1] = first[DAMPING + 11] / force
                value[D_WW + 2] = first[DAMPING + 15] / force
                highest, _ = film_observables(fine, fine_work)
                value[LN_PRESSURE] = math.log(highest)
    return status


@kernel
def _around(gamma, count):
    """Cell of an angle on a circle of ``count`` cells that starts at −π, the place in it, and its slope by γ."""
    scale = count / (2.0 * math.pi)
    sin = math.sin(gamma)
    cos = math.cos(gamma)
    y = (gamma - (GATHERED[0] + 2.0 * GATHERED[1] * cos) * sin + math.pi) * scale
    y -= count * math.floor(y / count)
    j = int(y)
    if j > count - 1:
        j = count - 1
    return j, y - j, scale * (1.0 - GATHERED[0] * cos - 2.0 * GATHERED[1] * (2.0 * cos * cos - 1.0))


@kernel
def interpolate_aligned(eps, gamma, table, first, out):
    """Two functions of the aligned table from ``first`` on: ``out[0:6]`` = f, ∂ε, ∂γ, g, ∂ε, ∂γ; ε ≤ ALIGNED_MAX."""
    coefficients = table.aligned
    n = coefficients.shape[1] - 2
    count = coefficients.shape[2] - 3
    x, slope = _stretched(eps)
    scale = (n - 1) / table.axes[2]
    x *= scale
    i = int(x)
    if i > n - 2:
        i = n - 2
    t = x - i
    j, s, turn = _around(gamma, count)
    r = 1.0 - t
    a0 = r * r * r / 6.0
    a1 = (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0
    a3 = t * t * t / 6.0
    a2 = 1.0 - a0 - a1 - a3
    d0 = -0.5 * r * r
    d1 = t * (1.5 * t - 2.0)
    d3 = 0.5 * t * t
    d2 = -d0 - d1 - d3
    r = 1.0 - s
    b0 = r * r * r / 6.0
    b1 = (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0
    b3 = s * s * s / 6.0
    b2 = 1.0 - b0 - b1 - b3
    e0 = -0.5 * r * r
    e1 = s * (1.5 * s - 2.0)
    e3 = 0.5 * s * s
    e2 = -e0 - e1 - e3
    for k in range(2):
        value = 0.0
        by_x = 0.0
        by_y = 0.0
        for m in range(4):
            a = a0 if m == 0 else (a1 if m == 1 else (a2 if m == 2 else a3))
            d = d0 if m == 0 else (d1 if m == 1 else (d2 if m == 2 else d3))
            c0 = coefficients[first + k, i + m, j]
            c1 = coefficients[first + k, i + m, j + 1]
            c2 = coefficients[first + k, i + m, j + 2]
            c3 = coefficients[first + k, i + m, j + 3]
            line = b0 * c0 + b1 * c1 + b2 * c2 + b3 * c3
            value += a * line
            by_x += d * line
            by_y += a * (e0 * c0 + e1 * c1 + e2 * c2 + e3 * c3)
        out[3 * k] = value
        out[3 * k + 1] = by_x * slope * scale
        out[3 * k + 2] = by_y * turn


@kernel
def _share_place(share, tilt_range, cells):
    """Nearest node, place around it in [−½, ½] and slope by the share, of A or B in [0, tilt range]."""
    z = share * TILT_STRETCH / tilt_range
    scale = cells / math.atanh(TILT_STRETCH)
    s = math.atanh(z) * scale
    k = int(s + 0.5)
    if k > cells:
        k = cells
    return k, s - k, scale * TILT_STRETCH / tilt_range / (1.0 - z * z)


@kernel
def interpolate_tilted(eps, gamma, share_a, share_b, table, scratch, functions):
    """All functions of the tilted table and their derivatives by ε, γ, A, B: ``functions`` (5, 12).

    0 ≤ A, B ≤ tilt range, ε ≤ TILTED_MAX. Contracted axis by axis, all functions of three by three tilts at a time.
    """
    c = table.tilted
    n = c.shape[0] - 2
    count = c.shape[1] - 3
    x, slope = _stretched(eps)
    scale = (n - 1) / table.axes[3]
    x *= scale
    slope *= scale
    i = int(x)
    if i > n - 2:
        i = n - 2
    t = x - i
    j, s, turn = _around(gamma, count)
    ka, ta, slope_a = _share_place(share_a, table.axes[1], c.shape[2] - 3)
    kb, tb, slope_b = _share_place(share_b, table.axes[1], c.shape[2] - 3)
    r = 1.0 - t
    a0 = r * r * r / 6.0
    a1 = (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0
    a3 = t * t * t / 6.0
    a2 = 1.0 - a0 - a1 - a3
    d0 = -0.5 * r * r * slope
    d1 = t * (1.5 * t - 2.0) * slope
    d3 = 0.5 * t * t * slope
    d2 = -d0 - d1 - d3
    row = 3 * FUNCTIONS
    block = 9 * FUNCTIONS
    first = kb * FUNCTIONS
    for g in range(4):
        for k in range(3):
            c0 = c[i, j + g, ka + k, first : first + row]
            c1 = c[i + 1, j + g, ka + k, first : first + row]
            c2 = c[i + 2, j + g, ka + k, first : first + row]
            c3 = c[i + 3, j + g, ka + k, first : first + row]
            place = 2 * g * block + k * row
            value = scratch[place : place + row]
            by_x = scratch[place + block : place + block + row]
            for q in range(36):
                value[q] = a0 * c0[q] + a1 * c1[q] + a2 * c2[q] + a3 * c3[q]
                by_x[q] = d0 * c0[q] + d1 * c1[q] + d2 * c2[q] + d3 * c3[q]
    r = 1.0 - s
    a0 = r * r * r / 6.0
    a1 = (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0
    a3 = s * s * s / 6.0
    a2 = 1.0 - a0 - a1 - a3
    d0 = -0.5 * r * r * turn
    d1 = s * (1.5 * s - 2.0) * turn
    d3 = 0.5 * s * s * turn
    d2 = -d0 - d1 - d3
    start = 8 * block
    v0 = scratch[:block]
    v1 = scratch[2 * block : 3 * block]
    v2 = scratch[4 * block : 5 * block]
    v3 = scratch[6 * block : 7 * block]
    x0 = scratch[block : 2 * block]
    x1 = scratch[3 * block : 4 * block]
    x2 = scratch[5 * block : 6 * block]
    x3 = scratch[7 * block : 8 * block]
    value = scratch[start : start + block]
    by_x = scratch[start + block : start + 2 * block]
    by_y = scratch[start + 2 * block : start + 3 * block]
    for q in range(108):
        value[q] = a0 * v0[q] + a1 * v1[q] + a2 * v2[q] + a3 * v3[q]
        by_y[q] = d0 * v0[q] + d1 * v1[q] + d2 * v2[q] + d3 * v3[q]
        by_x[q] = a0 * x0[q] + a1 * x1[q] + a2 * x2[q] + a3 * x3[q]
    last = start + 3 * block
    u0 = scratch[last : last + row]
    u1 = scratch[last + row : last + 2 * row]
    u2 = scratch[last + 2 * row : last + 3 * row]
    u3 = scratch[last + 3 * row : last + 4 * row]
    a0 = 0.5 * (0.5 - ta) * (0.5 - ta)
    a1 = 0.75 - ta * ta
    a2 = 0.5 * (0.5 + ta) * (0.5 + ta)
    d0 = (ta - 0.5) * slope_a
    d1 = -2.0 * ta * slope_a
    d2 = (ta + 0.5) * slope_a
    for q in range(36):
        u0[q] = a0 * value[q] + a1 * value[q + 36] + a2 * value[q + 72]
        u1[q] = a0 * by_x[q] + a1 * by_x[q + 36] + a2 * by_x[q + 72]
        u2[q] = a0 * by_y[q] + a1 * by_y[q + 36] + a2 * by_y[q + 72]
        u3[q] = d0 * value[q] + d1 * value[q + 36] + d2 * value[q + 72]
    a0 = 0.5 * (0.5 - tb) * (0.5 - tb)
    a1 = 0.75 - tb * tb
    a2 = 0.5 * (0.5 + tb) * (0.5 + tb)
    d0 = (tb - 0.5) * slope_b
    d1 = -2.0 * tb * slope_b
    d2 = (tb + 0.5) * slope_b
    for q in range(12):
        functions[0, q] = a0 * u0[q] + a1 * u0[q + 12] + a2 * u0[q + 24]
        functions[1, q] = a0 * u1[q] + a1 * u1[q + 12] + a2 * u1[q + 24]
        functions[2, q] = a0 * u2[q] + a1 * u2[q + 12] + a2 * u2[q + 24]
        functions[3, q] = a0 * u3[q] + a1 * u3[q + 12] + a2 * u3[q + 24]
        functions[4, q] = d0 * u0[q] + d1 * u0[q + 12] + d2 * u0[q + 24]


@kernel
def _aligned_errors(solved, eps, gamma, table, out, errors):
    """Force error over |F| of the films ``solved`` at one eccentricity."""
    for j in range(gamma.shape[0]):
        interpolate_aligned(eps, gamma[j], table, 0, out)
        size = math.exp(out[0] - solved[j, 0])
        turn = out[3] - solved[j, 1]
        dx = size * math.cos(turn) - 1.0
        dy = size * math.sin(turn)
        errors[j] = math.sqrt(dx * dx + dy * dy)


@kernel
def _tilted_errors(solved, eps, gamma, share, table, scratch, functions, errors):
    """The larger of force error over |F| and moment error over |F| L/2 of the films ``solved`` at one eccentricity."""
    n = share.shape[0]
    for j in range(gamma.shape[0]):
        for k in range(n):
            for m in range(n):
                interpolate_tilted(eps, gamma[j], share[k], share[m], table, scratch, functions)
                value = functions[0]
                true = solved[j, k, m]
                size = math.exp(value[0] - true[0])
                turn = value[1] - true[1]
                dx = size * math.cos(turn) - 1.0
                dy = size * math.sin(turn)
                mx = size * value[2] - true[2]
                my = size * value[3] - true[3]
                errors[j, k, m] = math.sqrt(max(dx * dx + dy * dy, mx * mx + my * my))
