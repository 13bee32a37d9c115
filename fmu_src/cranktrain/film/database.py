"""Film table: force, moments and damping of a rigid-bore journal film over eccentricity, squeeze direction and tilt.

A plain or fully circumferentially grooved film at ambient pressure is homogeneous in its velocities, so its
dimensionless force (:mod:`cranktrain.film.journal`) depends on numbers only. In axes along and across the line of
centres, with the velocity of pure squeeze v = |v|(cos γ, sin γ) and the tilt t = (a, b), all over the clearance:

* aligned, over (ε, γ): ln M, β, ln p̂, ln q̂ of F = −|v| M (cos(γ + β), sin(γ + β)), the largest Π = |v| p̂ and the
  flow out of both ends |v| q̂ (as in :mod:`cranktrain.film.impedance`, from the two-dimensional film);
* tilted, over (ε, γ, a, b): ln M, β, the moments over |F|, the damping ∂(F, Q)/∂w over |F|/|v|, and ln p̂.

A velocity has four components and a table with tilt room for one direction: the tilted film is sampled where the tilt
turns with the line of centres, w_ref = v_t ε³/(ε⁴ + δ⁴) e_z×t, and the rest w − w_ref acts through the damping. A
journal whose tilt stands still while both surfaces turn is on that family (for ε ≫ δ); near the centre, where the line
of centres may turn at any rate, δ keeps the family finite. The damping is that of the oil that carries on the family:
good to a few per cent while |w − w_ref| < ½ |v|, poor beyond |v|, where the law solves the film instead.

The tilted films are extrapolated (Richardson) from two axial divisions, spaced by a sine towards the ends: at a strong
tilt the pressure stands within a few per cent of the width, where even intervals err by 5 to 10 %. The
interpolation (:mod:`cranktrain.film.table_interpolation`) is measured against the same films at every cell's centre.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from hashlib import sha256

import numpy as np

from cranktrain.errors import InputError, SolverError, nearest
from cranktrain.film.journal import DAMPING, OUT_SIZE, film_observables, journal_film
from cranktrain.film.journal_grid import JournalGrid, cold_start, journal_grid, journal_work
from cranktrain.film.table_interpolation import (
    ALIGNED_MAX,
    D_FW,
    D_WW,
    FUNCTIONS,
    GATHERED,
    LN_ALIGNED_PRESSURE,
    LN_FLOW,
    LN_FORCE,
    LN_PRESSURE,
    LOW_SHARE,
    LOW_WIDTH,
    MOMENT_R,
    MOMENT_T,
    SCRATCH,
    STRETCH,
    TILT_STRETCH,
    TILTED_MAX,
    TURN,
    TableArrays,
    aligned_spline,
    centres,
    directions,
    eccentricity_nodes,
    interpolate_aligned,
    interpolate_tilted,
    stretched,
    tilted_spline,
)
from cranktrain.kernel import kernel
from cranktrain.reduced_body import Array

SCHEMA = 1
GROOVES = ("none", "circumferential")
RESOLUTIONS = {"coarse": (20, 28, 4), "default": (40, 56, 5), "fine": (48, 72, 6)}
"""Nodes over ε, γ and (from zero to the tilt range) each of A, B of the tilted table."""
N_ALIGNED = (49, 96)
ALIGNED_GRID = (144, 24)
TILT_GRIDS = {"none": ((64, 8), (64, 16)), "circumferential": ((64, 12), (64, 24))}
"""Intervals around and over the whole width of the two films that are extrapolated."""
ONLINE_GRID = (48, 12)
AXIAL_SINE = 0.98
CENTRED_TURN = 0.15
"""δ: eccentricity below which the tilt of the sampled family no longer turns with the line of centres."""
RATES = (1.0, 2.0)
"""|w − w_ref| / |v| where the law begins and ends to hand over to the film solved in place."""


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
        """Maximum and 95th percentile of the interpolation error of cells with centres up to ``eccentricity``."""
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
        coarse, fine = (table_grid(settings, *size) for size in TILT_GRIDS[settings.groove])
        values = np.empty((n_gamma, len(share), len(share), FUNCTIONS))
        status = _sample_tilted(
            eps[int(index)], gamma, share, 1.0 / settings.length_ratio**2, coarse, journal_work(coarse),
            cold_start(coarse), fine, journal_work(fine), cold_start(fine), out, values,
        )  # fmt: skip
    if status < 0 or not np.isfinite(values).all():
        raise SolverError(
            f"film table, slab '{name}' (eccentricity {eps[int(index)]:.4f}): a film did not converge; "
            + ("report it with the length ratio" if aligned else "reduce the tilt range")
        )
    return values


def compile_sampling() -> None:
    """Compile what :func:`sample_slab` calls: processes that compile at the same time spoil each other's cache."""
    one, out = np.array([0.5]), np.zeros(2 * OUT_SIZE)
    grid = journal_grid(12, 6, half=True)
    _sample_aligned(0.5, one, 4.0, grid, journal_work(grid), cold_start(grid), out, np.zeros((1, 4)))
    grid = table_grid(TableSettings(0.5), 12, 6)
    work, active = journal_work(grid), cold_start(grid)
    _sample_tilted(0.5, one, one, 4.0, grid, work, active, grid, work, active, out, np.zeros((1, 1, 1, FUNCTIONS)))


def assemble(settings: TableSettings, slabs: Mapping[str, Array]) -> FilmTable:
    """Fit the splines through all slabs of :func:`slab_names` and measure their error at cell centres."""
    n_eps, n_gamma = N_ALIGNED
    aligned = aligned_spline(np.stack([slabs[f"aligned {i}"] for i in range(n_eps)]))
    tops = [float(stretched(top)[0]) for top in (ALIGNED_MAX, TILTED_MAX)]
    axes = np.array([1.0 / settings.length_ratio**2, settings.tilt_range, *tops, *aligned_norms(settings), *RATES])
    tilted = np.zeros((1, 1, 1, 1))
    if settings.tilt:
        tilted = tilted_spline(np.stack([slabs[f"tilted {i}"] for i in range(settings.shape[0])]))
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
        values[j, LN_FORCE] = 0.5 * math.log(radial * radial + across * across)
        values[j, TURN] = math.atan2(across, radial)
        highest, flow = film_observables(grid, work)
        values[j, LN_ALIGNED_PRESSURE] = math.log(highest)
        values[j, LN_FLOW] = math.log(flow)
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
