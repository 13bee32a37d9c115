"""Film table: force, moments and damping of a rigid-bore journal film over eccentricity, squeeze direction and tilt.

A plain or fully circumferentially grooved film at ambient pressure is homogeneous in its velocities, so its
dimensionless force (:mod:`cranktrain.film.journal.film`) depends on dimensionless numbers only. In axes along and
across the line of centres, with the velocity of pure squeeze v = |v|(cos γ, sin γ) and the tilt t = (a, b), all over
the clearance:

* aligned, over (ε, γ): ln M, β, ln p̂, ln q̂ of F = −|v| M (cos(γ + β), sin(γ + β)), the largest Π = |v| p̂ and the
  flow out of both ends |v| q̂ (as in :mod:`cranktrain.film.laws.impedance`, from the two-dimensional film);
* tilted, over (ε, γ, a, b): ln M, β, the moments over |F|, and the effect of tilt rates outside the sampled family
  (:mod:`cranktrain.film.table.family`); ln p̂ in a separate array.

A velocity has four components, but a table with tilt can resolve only one direction. The family defines the sampled
rates of tilt and represents any other rate by two of its points.

The tilted films are extrapolated (Richardson) from two axial grids, with nodes concentrated at the ends by a sine. At a
strong tilt the pressure extends over a few per cent of the width, where even intervals have errors of 5 to 10 %. The
error of interpolation (:mod:`cranktrain.film.table.interpolation`) is measured at the centre of every cell.

Accuracy of a table of L/D 0.353 (``python -m benchmarks film_table``; the error is the larger of force error over |F|
and moment error over |F| L/2, against films of twice as many nodes):

* without tilt, 2000 random states: at most 0.08 % up to ε 0.95, 0.16 % up to 0.99, against films on the table's grid;
* on the family, 600 random states up to ε 0.95 and the tilt range, edge contact included: 0.4 % at the 95th percentile,
  0.03 % in the median, at most 5.3 % (against films on the table's grid 0.3, 0.03 and 1.2 %);
* at positions and velocities of a running six-cylinder engine the error of the two points is 2 % of the bearing's
  largest force at the 95th percentile, 0.02 % in the median, at most 18 % (500 states at each of 1000 to 2600 rev/min,
  films solved instead of tabled). The damping of a pure tilt rate is 15 % too large.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from hashlib import sha256

import numpy as np

from cranktrain.core.errors import InputError, SolverError, nearest
from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import PlainBearing
from cranktrain.film.contact.gap import SMOOTH, STRAIGHT, over
from cranktrain.film.journal.film import OUT_SIZE
from cranktrain.film.journal.grid import AXIAL_ROWS, STRIP, JournalGrid, journal_grid, shell_grid, solved_film
from cranktrain.film.table.family import CENTRED_TURN, LEVER
from cranktrain.film.table.interpolation import (
    ALIGNED_MAX,
    FUNCTIONS,
    GATHERED,
    LOW_SHARE,
    LOW_WIDTH,
    SCRATCH,
    STRETCH,
    TILT_STRETCH,
    TILTED_MAX,
    UNTILTED,
    TableArrays,
    aligned_spline,
    centres,
    directions,
    eccentricity_nodes,
    stretched,
    tilted_spline,
)
from cranktrain.film.table.reach import DEEPEST, reach_terms
from cranktrain.film.table.sampling import aligned_errors, sample_aligned, sample_tilted, tilted_errors

SCHEMA = 5
GROOVES = ("none", "circumferential")
RESOLUTIONS = {"coarse": (20, 28, 4), "default": (40, 54, 9), "fine": (48, 72, 11)}
"""Numbers of nodes of the tilted table in ε, γ and each of A, B (from zero to the tilt range)."""
N_ALIGNED = (49, 96)
ALIGNED_GRID = (144, 24)
TILT_GRIDS = ((64, 12), (64, 24))
"""Grid intervals (around, over the whole width) of the two films of Richardson's extrapolation."""
ONLINE_GRID = (48, 12)
AXIAL_SINE = 0.98
RUN_IN_RANGE = 1.0
"""Tilt range of an engine's bearings, at which their edges touch."""


@dataclass(frozen=True)
class TableSettings:
    """Settings of a table; equal settings give equal tables.

    length_ratio : L/D with the whole width L
    groove : none, or circumferential (zero pressure around the bore at z = 0)
    resolution : coarse, default or fine
    tilt : whether the tilted table is built
    tilt_range : largest A and B, as fraction of the possible tilt
    relief_depth, relief_share, relief_exponent : profile of the shell (depth over the clearance, width fraction)
    roughness : σ over the clearance, see :mod:`cranktrain.film.contact.gap`
    """

    length_ratio: float
    groove: str = "none"
    resolution: str = "default"
    tilt: bool = True
    tilt_range: float = 0.95
    relief_depth: float = STRAIGHT[0]
    relief_share: float = STRAIGHT[1]
    relief_exponent: float = STRAIGHT[2]
    roughness: float = SMOOTH

    def __post_init__(self) -> None:
        if not (math.isfinite(self.length_ratio) and 0.05 <= self.length_ratio <= 4.0):
            raise InputError(f"length ratio {self.length_ratio:g} of a film table is not within 0.05 to 4 (L/D)")
        if self.groove not in GROOVES:
            raise InputError(f"groove '{self.groove}' of a film table does not exist; {nearest(self.groove, GROOVES)}")
        if self.resolution not in RESOLUTIONS:
            raise InputError(f"resolution '{self.resolution}' does not exist; {nearest(self.resolution, RESOLUTIONS)}")
        if not (math.isfinite(self.tilt_range) and 0.2 <= self.tilt_range <= 1.0):
            raise InputError(f"tilt range {self.tilt_range:g} is not within 0.2 to 1 of the possible tilt")
        if not 0.0 <= self.relief_depth <= 1.0:
            raise InputError(f"relief {self.relief_depth:g} of a film table is not within 0 to 1 clearance")
        if not (0.0 < self.relief_share <= 1.0 <= self.relief_exponent <= 10.0):
            raise InputError("the relief of a film table has a share in (0, 1] and an exponent in [1, 10]")
        if not 0.0 < self.roughness < 1.0 / 6.0:
            raise InputError(f"roughness {self.roughness:g} of a film table is not within 0 to 1/6 clearance")

    @property
    def digest(self) -> str:
        """Digest of all settings and constants that the numbers of the table depend on."""
        constants = (SCHEMA, N_ALIGNED, TILT_GRIDS, ALIGNED_GRID, AXIAL_SINE, GATHERED, STRETCH, LOW_SHARE, LOW_WIDTH)
        family = (TILT_STRETCH, CENTRED_TURN, LEVER, DEEPEST, ALIGNED_MAX, TILTED_MAX, RESOLUTIONS[self.resolution])
        return sha256(repr((sorted(asdict(self).items()), constants, family)).encode()).hexdigest()

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of nodes of the tilted table in ε, γ and each tilt."""
        return RESOLUTIONS[self.resolution]

    @property
    def profile(self) -> tuple[float, float, float]:
        """Relief profile of the shell, with its depth over the clearance."""
        return self.relief_depth, self.relief_share, self.relief_exponent

    def on_shell(self, grid: JournalGrid) -> JournalGrid:
        """Return ``grid`` with the relief and roughness of this shell."""
        return shell_grid(grid, self.profile, self.roughness)

    def ends(self) -> Array:
        """Coefficients of the reach ρ of a tilted end, see :mod:`cranktrain.film.table.reach`."""
        return np.array(reach_terms(self.profile, self.roughness, TILTED_MAX))


def bearing_settings(bearing: PlainBearing, resolution: str = "default", tilt: bool = True) -> TableSettings:
    """Return the settings of the table for the films of a plain bearing."""
    depth, share, exponent = over(bearing.relief, bearing.clearance)
    numbers = (bearing.width / bearing.diameter, depth, bearing.roughness / bearing.clearance)
    ratio, depth, roughness = (float(f"{number:.12g}") for number in numbers)
    return TableSettings(
        ratio, bearing.groove, resolution, tilt, RUN_IN_RANGE,
        relief_depth=depth, relief_share=share, relief_exponent=exponent, roughness=roughness,
    )  # fmt: skip


@dataclass(frozen=True)
class FilmTable:
    """Film table with its interpolation error.

    aligned_error : (n_ε − 1, n_γ) force error at cell centres over |F|
    tilted_error : (n_ε − 1, n_γ, n_t − 1, n_t − 1) the larger of force error over |F| and moment error over |F| L/2
    """

    settings: TableSettings
    arrays: TableArrays
    aligned_error: Array
    tilted_error: Array

    @property
    def cells(self) -> int:
        """Number of cells of both tables, counting the stored quarter only."""
        return int(self.aligned_error.size + self.tilted_error.size)

    def worst(self, eccentricity: float = 1.0, tilt: float = 1.0) -> dict[str, float]:
        """Return maximum and 95th percentile of the interpolation error of cells with centres up to ``eccentricity``.

        Tilted cells count up to the fraction ``tilt`` of the range; above 1 − ``law.SHARE_MARGIN`` films are blended.
        """
        result = {}
        for name, error, top in (
            ("aligned", self.aligned_error, ALIGNED_MAX),
            ("tilted", self.tilted_error, TILTED_MAX),
        ):
            if error.size:
                chosen = error[centres(eccentricity_nodes(error.shape[0] + 1, top)) <= eccentricity]
                if name == "tilted":
                    within = tilt_shares(self.settings, middle=True) <= tilt * self.settings.tilt_range
                    chosen = chosen[:, :, within][..., within]
                result[f"{name}_max"] = float(chosen.max())
                result[f"{name}_p95"] = float(np.quantile(chosen, 0.95))
        return result


def tilt_shares(settings: TableSettings, middle: bool = False) -> Array:
    """Return the relative tilts A or B of the nodes or, if ``middle``, of the cell centres."""
    n = settings.shape[2]
    s = (np.arange(n - 1) + 0.5) / (n - 1) if middle else np.linspace(0.0, 1.0, n)
    return settings.tilt_range * np.tanh(s * math.atanh(TILT_STRETCH)) / TILT_STRETCH


def table_grid(settings: TableSettings, n_phi: int = ONLINE_GRID[0], n_z: int = ONLINE_GRID[1]) -> JournalGrid:
    """Make the grid of a tilted film with axial nodes concentrated at the ends (and at the groove).

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
    axial = np.zeros((AXIAL_ROWS, n + 1))
    axial[0, :n] = z[1:-1]
    axial[1, :n] = cell
    axial[2, :n] = weight
    axial[3] = 0.5 * (z[1:] + z[:-1])
    axial[4] = conduct
    outlet = grid.settings.copy()
    outlet[STRIP] = z[1] - z[0]
    return settings.on_shell(grid._replace(axial=axial, blocked=blocked, settings=outlet))


def aligned_grid(settings: TableSettings, n_phi: int = ALIGNED_GRID[0], n_z: int = ALIGNED_GRID[1]) -> JournalGrid:
    """Make the grid of an aligned film on half the width; with a full groove, the grid of a straight shell."""
    grid = journal_grid(n_phi, n_z, half=True)
    profile = settings.profile if settings.groove == "none" else STRAIGHT
    return shell_grid(grid, profile, settings.roughness)


def _sine(n: int) -> Array:
    t = np.linspace(-1.0, 1.0, n + 1)
    return np.sin(0.5 * math.pi * AXIAL_SINE * t) / math.sin(0.5 * math.pi * AXIAL_SINE)


def aligned_norms(settings: TableSettings) -> tuple[float, float]:
    """Return (D/L)² of the aligned film, and its flow out of the outer ends over 2 R³/L |v| q̂.

    A groove makes two films of half the width. Their common force is in the norm of the whole width, and half of the
    flow of each leaves at the outer end.
    """
    return (1.0 / settings.length_ratio**2, 1.0) if settings.groove == "none" else (4.0 / settings.length_ratio**2, 2.0)


def slab_names(settings: TableSettings) -> list[str]:
    """Return the names of the slabs, the parts of a table that are sampled independently and in any order."""
    names = [f"aligned {i}" for i in range(N_ALIGNED[0])] + [f"aligned middle {i}" for i in range(N_ALIGNED[0] - 1)]
    if settings.tilt:
        n = settings.shape[0]
        names += [f"tilted {i}" for i in range(n)] + [f"tilted middle {i}" for i in range(n - 1)]
    return names


def sample_slab(settings: TableSettings, name: str) -> Array:
    """Solve all films of one slab. Return values over directions γ, (n_γ, 4), or also over tilts, (n_γ, n_t, n_t, 13).

    Raises
    ------
    SolverError
        if a film did not converge
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
        grid = aligned_grid(settings)
        values = np.empty((n_gamma, 4))
        status = sample_aligned(eps[int(index)], gamma, aligned_norms(settings)[0], solved_film(grid), out, values)
    else:
        share = tilt_shares(settings, bool(middle))
        coarse, fine = (solved_film(table_grid(settings, *size)) for size in TILT_GRIDS)
        values = np.empty((n_gamma, len(share), len(share), FUNCTIONS + 1))
        ratio2 = 1.0 / settings.length_ratio**2
        status = sample_tilted((eps[int(index)], settings.ends()), gamma, share, ratio2, coarse, fine, out, values)
    if status < 0 or not np.isfinite(values).all():
        raise SolverError(
            f"film table, slab '{name}' (eccentricity {eps[int(index)]:.4f}): a film did not converge; "
            + ("report it with the length ratio" if aligned else "reduce the tilt range")
        )
    return values


def compile_sampling() -> None:
    """Compile the kernels of :func:`sample_slab` once, because parallel compilation would corrupt the cache."""
    one, out = np.array([0.5]), np.zeros(2 * OUT_SIZE)
    grid = journal_grid(12, 6, half=True)
    sample_aligned(0.5, one, 4.0, solved_film(grid), out, np.zeros((1, 4)))
    film = solved_film(table_grid(TableSettings(0.5), 12, 6))
    sample_tilted((0.5, TableSettings(0.5).ends()), one, one, 4.0, film, film, out, np.zeros((1, 1, 1, FUNCTIONS + 1)))


def slab_shape(settings: TableSettings, name: str) -> tuple[int, ...]:
    """Return the array shape of a slab, see :func:`sample_slab`."""
    if name.startswith("aligned"):
        return N_ALIGNED[1], 4
    _, n_gamma, n_tilt = settings.shape
    n_tilt -= "middle" in name
    return n_gamma, n_tilt, n_tilt, FUNCTIONS + 1


def table_axes(settings: TableSettings) -> Array:
    """Return the axes of :class:`cranktrain.film.table.interpolation.TableArrays`."""
    tops = [float(stretched(top)[0]) for top in (ALIGNED_MAX, TILTED_MAX)]
    return np.array(
        [1.0 / settings.length_ratio**2, settings.tilt_range, *tops, *aligned_norms(settings), *settings.ends()]
    )


def what_is_wrong(table: FilmTable) -> str:
    """Return the contradiction between a table that was read and its settings; empty if there is none."""
    n_eps, n_gamma = N_ALIGNED
    n, g, t = table.settings.shape
    tilt, axes = table.settings.tilt, table_axes(table.settings)
    wanted = {
        "aligned": (table.arrays.aligned, (4, n_eps + 2, n_gamma + 3)),
        "tilted": (table.arrays.tilted, (n + 2, g + 3, t + 2, FUNCTIONS * (t + 2)) if tilt else (1, 1, 1, 1)),
        "pressure": (table.arrays.pressure, (n + 2, g + 3, t + 2, t + 2) if tilt else (1, 1, 1, 1)),
        "axes": (table.arrays.axes, axes.shape),
        "aligned_error": (table.aligned_error, (n_eps - 1, n_gamma)),
        "tilted_error": (table.tilted_error, (n - 1, g, t - 1, t - 1) if tilt else (0, 0, 0, 0)),
    }
    for name, (array, shape) in wanted.items():
        kind = np.dtype(np.float32 if name == "tilted" else np.float64)
        if array.shape != shape or array.dtype != kind:
            return f"'{name}' is {array.dtype} of shape {array.shape}, not {kind} of {shape}"
        if not np.isfinite(array).all():
            return f"'{name}' has {np.count_nonzero(~np.isfinite(array))} values that are not finite"
    return "" if np.allclose(table.arrays.axes, axes, rtol=1e-9) else "'axes' are not those of its settings"


def assemble(settings: TableSettings, slabs: Mapping[str, Array]) -> FilmTable:
    """Make the table: fit splines to all slabs of :func:`slab_names` and measure the error at cell centres."""
    n_eps, n_gamma = N_ALIGNED
    aligned = aligned_spline(np.stack([slabs[f"aligned {i}"] for i in range(n_eps)]))
    axes = table_axes(settings)
    tilted, pressure = UNTILTED, np.zeros((1, 1, 1, 1))
    if settings.tilt:
        values = np.stack([slabs[f"tilted {i}"] for i in range(settings.shape[0])])
        tilted = tilted_spline(values[..., :FUNCTIONS]).astype(np.float32)
        pressure = tilted_spline(values[..., FUNCTIONS:], (1.0,), (1.0,))
    arrays = TableArrays(aligned, tilted, axes, pressure)
    aligned_error = np.empty((n_eps - 1, n_gamma))
    gamma = directions(n_gamma, 0.5)
    for i, eps in enumerate(centres(eccentricity_nodes(n_eps, ALIGNED_MAX))):
        aligned_errors(slabs[f"aligned middle {i}"], eps, gamma, arrays, np.zeros(16), aligned_error[i])
    tilted_error = np.empty((0, 0, 0, 0))
    if settings.tilt:
        n, n_gamma, n_tilt = settings.shape
        tilted_error = np.empty((n - 1, n_gamma, n_tilt - 1, n_tilt - 1))
        scratch, functions = np.zeros(SCRATCH), np.zeros((5, FUNCTIONS))
        gamma, share = directions(n_gamma, 0.5), tilt_shares(settings, middle=True)
        for i, eps in enumerate(centres(eccentricity_nodes(n, TILTED_MAX))):
            solved = slabs[f"tilted middle {i}"]
            tilted_errors(solved, eps, gamma, share, arrays, scratch, functions, tilted_error[i])
    return FilmTable(settings, arrays, aligned_error, tilted_error)
