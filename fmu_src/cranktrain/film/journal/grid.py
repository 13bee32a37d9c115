"""Grid of a journal film (nodes, cells, weights, grooves) and memory of one solution.

In plain bores the nodes are concentrated at the least film by Sommerfeld's substitution cos ψ = (cos γ + m)/(1 + m cos
γ), uniform in γ. Direction and amount m of this concentration follow the journal. Nodes of grooved bores are fixed.
Axial nodes are concentrated at the edges, where a tilted film is thinnest and the pressure of a wide film drops. Source
and force have the same weight, so that damping is symmetric. The weight is the mean of the finite-volume cell and of a
quadrature of fourth order. For the parabola of a short bearing the force would be n⁻² too low with the first weight and
as much too high with the second (which also changes the solution); with the mean only the next order remains.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array
from cranktrain.film.contact.gap import SMOOTH, relief
from cranktrain.film.journal.blocks import LANES

SWIFT_STIEBER, FULL, GUEMBEL = 0, 1, 2
RUPTURES = {"reynolds": SWIFT_STIEBER, "full": FULL, "guembel": GUEMBEL}
PRESETS = {"loop": (64, 12), "default": (96, 16), "fine": (192, 32)}
"""Presets of the grid: circumferential intervals, axial intervals over the full width."""
GRADING = 0.85
"""Ratio of the concentration m of the circumferential nodes to the eccentricity."""
EDGE_GRADING = 0.7
"""Weight a of the sine in the axial spacing ζ(s) = (1 − a) s + a sin(π s/2): 0 is uniform, 1 Chebyshev's."""

WIDE, WIDEST = 4.0, 1000.0
"""Range of B/D within which the concentration of axial nodes at the ends increases with B/D."""

# Rows of JournalGrid.circle and JournalWork.angle; then rows of JournalGrid.axial, entries of settings, of squeeze.
COS, SIN, FACE_COS, FACE_SIN = range(4)
ZETA, CELL, WEIGHT, FACE_ZETA, PER_DISTANCE, PROFILE, FACE_PROFILE, AXIAL_ROWS = range(8)
RUPTURE, NODE_GRADING, SIDES, STRIP, ROUGHNESS, EDGE = range(6)
V_X, V_Y, W_X, W_Y, RATIO2 = range(5)


class JournalGrid(NamedTuple):
    """Grid of a journal film; all arrays are float64.

    circle : (4, N) cos γ, sin γ of nodes and of the faces after them (rows COS to FACE_SIN); for fixed nodes γ is φ
    spacing : (2, N) cell width of a node and distance across the face after it, in γ
    axial : (7, n + 1) ζ of nodes, cell width, weight of source and force, ζ of the face before a node, 1/distance
        there, relief of the shell over the clearance at nodes and faces (rows ZETA to FACE_PROFILE)
    blocked : (N, m) 1 for nodes with zero pressure (grooves) and for padding beyond n
    settings : (6,) rupture, grading (0: nodes at rest), sides (1, or 2: half the width by symmetry), strip in ζ at an
        end that no node's weight covers, roughness σ and relief at the edge over the clearance
    shear : (3, 8) ζ, weight and relief of the sampling points of the film's shear
    """

    circle: Array
    spacing: Array
    axial: Array
    blocked: Array
    settings: Array
    shear: Array


class Motion(NamedTuple):
    """Position and velocity of a journal over the clearance: floats, in any axes.

    Eccentricity (ex, ey) of its middle, tilt (tx, ty): displacement of the axis at ζ = +1; velocities of pure squeeze
    (vx, vy) and (wx, wy) of both, 1/s.
    """

    ex: float
    ey: float
    tx: float
    ty: float
    vx: float
    vy: float
    wx: float
    wy: float


class JournalWork(NamedTuple):
    """Memory of one film solution; ``journal_film`` writes pressure, gap derivatives and conductances to it."""

    angle: Array  # (4, N) cos φ, sin φ of nodes and faces, rows COS to FACE_SIN
    width: Array  # (2, N) cell width and distance, in φ
    conduct: Array  # (2, N, m + 1) conductances, circumferential (face after) and axial (face before)
    slope: Array  # (2, N, m + 1) derivatives of the conductances by the distance of the surfaces
    growth: Array  # (2, N, m) first and second derivative of the mean gap by the distance of the surfaces, at nodes
    matrix: Array  # (2, N, m + 1) diagonal and axial coupling
    around: Array  # (N, m) coupling of each column's nodes to the next column
    used: Array  # (N,) number of unknowns of each column
    inverse: Array  # (N, m, m) inverse pivot blocks, see cranktrain.film.journal.blocks.Ring
    border: Array  # (N, m, m) factors of a closed ring, see cranktrain.film.journal.blocks.Ring
    source: Array  # (N, m) source of each cell
    pressure: Array  # (N, m) pressure of each node
    unit: Array  # (N, m, 4) sources, then pressures, by the four unit velocities
    adjoint: Array  # (N, m, 4) sources, then solutions, of the tangents' adjoint problem
    carried: Array  # (m, m) scratch
    squeeze: Array  # (5,) (vx, vy, wx, wy) of the Motion, (D/L)²


class JournalFilm(NamedTuple):
    """Grid of a journal film together with the memory of its solution."""

    grid: JournalGrid
    work: JournalWork
    active: Array  # (N, m) active set of the last solution


def journal_grid(
    n_phi: int = PRESETS["default"][0],
    n_z: int = PRESETS["default"][1],
    *,
    half: bool = False,
    rupture: str = "reynolds",
    grading: float = GRADING,
    grooves: tuple[tuple[float, float], ...] = (),
    fed_at_widest: bool = False,
    sealed: bool = False,
    ratio: float = 0.0,
) -> JournalGrid:
    """Make the grid of a journal film.

    Parameters
    ----------
    n_phi, n_z : intervals around (12 to 4096) and over the full width (6 to 512); odd numbers are rounded up
    half : solve half the width by symmetry; for films without tilt (t = w = 0)
    rupture : reynolds, guembel (full film, negative pressure ignored) or full
    grading : ratio of m to the eccentricity in the substitution, in [0, 1); 0 gives fixed nodes
    grooves : axial grooves as (centre, extent) in rad, pressure zero; nodes are then fixed in the bore
    fed_at_widest : keep the pressure at zero on the line of the widest gap (opposite to the concentration of nodes), as
        an oil groove there would
    sealed : no flow over the ends, so pressure is uniform over the width, as in an infinitely long bearing
    ratio : B/D, if known; above ``WIDE`` axial nodes are concentrated so that they resolve the pressure drop at the
        ends, which extends over about a radius

    Raises
    ------
    InputError
        if the grid is too coarse, the rupture does not exist, or grooves overlap
    """
    if not (12 <= n_phi <= 4096 and 6 <= n_z <= 512):
        raise InputError(f"film grid {n_phi} × {n_z} is not possible; take 12 to 4096 around and 6 to 512 across")
    if rupture not in RUPTURES:
        raise InputError(f"cavitation '{rupture}' does not exist; {nearest(rupture, RUPTURES)}")
    n_phi += n_phi % 2
    n_z += n_z % 2
    if grooves:
        face, node, blocked_columns = _grooved_nodes(n_phi, grooves)
        grading = 0.0
    else:
        node = 2.0 * math.pi * np.arange(n_phi) / n_phi
        face = node + math.pi / n_phi
        blocked_columns = np.zeros(n_phi)
        blocked_columns[n_phi // 2] = fed_at_widest  # γ = π whatever the grading
    after = np.roll(node, -1)
    after[-1] += 2.0 * math.pi
    behind = np.roll(face, 1)
    behind[0] -= 2.0 * math.pi
    circle = np.array([np.cos(node), np.sin(node), np.cos(face), np.sin(face)])
    spacing = np.array([face - behind, after - node])
    axial, strip = _axial_lines(n_z, half, sealed, ratio)
    n = axial.shape[1] - 1
    padded = -(-n // LANES) * LANES
    blocked = np.ones((circle.shape[1], padded))
    blocked[:, :n] = blocked_columns[:, None]
    settings = np.array([RUPTURES[rupture], grading, 2.0 if half else 1.0, strip, SMOOTH, 0.0])
    shear = np.concatenate([np.polynomial.legendre.leggauss(8), np.zeros((1, 8))])
    return JournalGrid(circle, spacing, axial, blocked, settings, shear)


def _axial_lines(n_z: int, half: bool, sealed: bool, ratio: float) -> tuple[Array, float]:
    """Return axial nodes, cells, faces of a straight shell, (AXIAL_ROWS, n + 1), and the uncovered strip at an end."""
    step = 2.0 / n_z
    first = n_z // 2 if half else 1
    n = n_z - first
    s: Array = np.asarray(-1.0 + step * np.arange(n_z + 1))
    node, weight = axial_nodes(s, ratio)
    weight *= step
    face = 0.5 * (node[1:] + node[:-1])
    weight[[1, -2]] *= 1.0 + 1.0 / 6.0
    weight[[2, -3]] *= 1.0 - 1.0 / 24.0
    axial = np.zeros((AXIAL_ROWS, n + 1))
    axial[0, :n] = node[first:n_z]
    axial[1, :n] = face[first:] - face[first - 1 : -1]
    axial[2, :n] = 0.5 * (axial[1, :n] + weight[first:n_z])
    axial[3] = face[first - 1 :]
    axial[4] = 1.0 / (node[first:] - node[first - 1 : -1])
    if sealed:
        axial[1, :n] *= 2.0 / (face[-1] - face[0])
        axial[2] = axial[1]
        axial[4, [0, n]] = 0.0
    strip = 1.0 - 0.5 * (axial[2, 0] if half else 0.0) - (1.0 if half else 0.5) * axial[2, (1 if half else 0) : n].sum()
    if half:
        axial[1:3, 0] *= 0.5
        axial[4, 0] = 0.0
    return axial, strip


def shell_grid(grid: JournalGrid, profile: tuple[float, float, float], roughness: float) -> JournalGrid:
    """Return ``grid`` with the axial ``profile`` of a shell and the ``roughness`` of its surfaces.

    ``profile`` is depth over the clearance, width fraction and exponent, ``roughness`` is σ over the clearance (0 for
    smooth surfaces), both as in :mod:`cranktrain.film.contact.gap`.
    """
    axial, settings, shear = grid.axial.copy(), grid.settings.copy(), grid.shear.copy()
    for row, of in ((PROFILE, ZETA), (FACE_PROFILE, FACE_ZETA)):
        axial[row] = _reliefs(tuple(axial[of].tolist()), profile)
    shear[2] = _reliefs(tuple(shear[0].tolist()), profile)
    settings[ROUGHNESS], settings[EDGE] = max(roughness, SMOOTH), profile[0]
    return grid._replace(axial=axial, settings=settings, shear=shear)


@cache
def _reliefs(zetas: tuple[float, ...], profile: tuple[float, float, float]) -> tuple[float, ...]:
    return tuple(relief(zeta, profile) for zeta in zetas)


def axial_nodes(s: Array, ratio: float) -> tuple[Array, Array]:
    """Return ζ(s) and dζ/ds for uniform s in [−1, 1]."""
    if ratio <= WIDE:
        grading = EDGE_GRADING
        node = (1.0 - grading) * s + grading * np.sin(0.5 * math.pi * s)
        return node, 1.0 - grading + grading * 0.5 * math.pi * np.cos(0.5 * math.pi * s)
    # ζ = tanh βs/tanh β, with β so that the step at the ends is the same fraction of the diameter for any width.
    low, high = 0.1, 20.0
    for _ in range(60):
        beta = 0.5 * (low + high)
        steep = beta * (1.0 - math.tanh(beta) ** 2) / math.tanh(beta) > (1.0 - EDGE_GRADING) * WIDE / min(ratio, WIDEST)
        low, high = (beta, high) if steep else (low, beta)
    node = np.tanh(beta * s) / math.tanh(beta)
    node[[0, -1]] = -1.0, 1.0
    return node, beta * (1.0 - np.tanh(beta * s) ** 2) / math.tanh(beta)


def _grooved_nodes(n_phi: int, grooves: tuple[tuple[float, float], ...]) -> tuple[Array, Array, Array]:
    """Return faces, nodes and blocked columns of a bore with axial grooves; groove edges are nodes, lands are even."""
    turn = 2.0 * math.pi
    ordered = sorted(((centre - 0.5 * extent) % turn, extent) for centre, extent in grooves)
    edges: list[float] = []
    for k, (start, extent) in enumerate(ordered):
        following = ordered[k + 1][0] if k + 1 < len(ordered) else ordered[0][0] + turn
        if not 0.0 < extent < turn or start + extent >= following:
            raise InputError(
                f"the groove of {math.degrees(extent):g} deg at {math.degrees(start + 0.5 * extent):g} deg reaches the "
                f"next one; make it narrower than {math.degrees(following - start):g} deg or set them further apart"
            )
        edges += [start, start + extent]
    node: list[float] = []
    blocked: list[float] = []
    lands = sum([*edges, edges[0] + turn][2 * k + 2] - edges[2 * k + 1] for k in range(len(ordered)))
    for k, (start, extent) in enumerate(ordered):
        stop = [*edges, edges[0] + turn][2 * k + 2]
        land = stop - start - extent
        count = max(6, round(n_phi * land / lands))
        node += [start, *(start + extent + land * np.arange(count) / count).tolist()]
        blocked += [1.0, 1.0, *([0.0] * (count - 1))]
    nodes = np.array(node)
    after = np.roll(nodes, -1)
    after[-1] += turn
    return 0.5 * (nodes + after), nodes, np.array(blocked)


def journal_work(grid: JournalGrid) -> JournalWork:
    """Make the memory of ``journal_film`` on ``grid``."""
    columns, m = grid.blocked.shape
    return JournalWork(
        np.zeros((4, columns)), np.zeros((2, columns)), np.zeros((2, columns, m + 1)), np.zeros((2, columns, m + 1)),
        np.zeros((2, columns, m)), np.zeros((2, columns, m + 1)), np.zeros((columns, m)), np.zeros(columns),
        np.zeros((columns, m, m)), np.zeros((columns, m, m)), np.zeros((columns, m)), np.zeros((columns, m)),
        np.zeros((columns, m, 4)), np.zeros((columns, m, 4)), np.zeros((m, m)), np.zeros(5),
    )  # fmt: skip


def cold_start(grid: JournalGrid) -> Array:
    """Return an active set that stands for no initial guess, (N, m); ``journal_film`` updates it in place."""
    return np.full(grid.blocked.shape, -1.0)


def solved_film(grid: JournalGrid) -> JournalFilm:
    """Make a film on ``grid`` with new memory."""
    return JournalFilm(grid, journal_work(grid), cold_start(grid))
