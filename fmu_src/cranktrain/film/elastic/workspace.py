"""Workspace of elastic films that are solved at once, and tables and geometry in the layout of their kernels.

The same kernels solve eight films in singles, one in each lane of the vector registers, or one film in doubles
(:mod:`cranktrain.core.side_by_side`). The films are those of :mod:`cranktrain.film.elastic.grid` on one grid; they
differ in their motion, their oil and their memory. Sums of forces, a film's memory and its motion are doubles. The gap
at the start of a step is computed in doubles and its change within the step by itself, so that a thin film keeps its
accuracy in singles.

The ring of columns of every lane of singles is cut where its film is ruptured. Columns are counted from the cut
(position 0), and the geometry of a lane is rotated accordingly. The geometry of a single film is not rotated; its
columns enter the matrix in an order that keeps the ring closed, see :func:`cranktrain.film.elastic.newton.arrange`.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.side_by_side import SINGLES, lane_count
from cranktrain.core.types import Array
from cranktrain.film.contact.asperity import HIGHEST, SIGMA, contact_pressure
from cranktrain.film.contact.gap import open_gap
from cranktrain.film.elastic import grid as at
from cranktrain.film.elastic.grid import BLOCK, ElasticFilm

LANES = SINGLES
"""Number of films in a group that is solved in singles."""

# Fields of nodes in LaneWork.nodes; the nodes at both ends are included.
# FILM, OPEN, SLOPE, BEND: distance of the surfaces, mean gap and its two derivatives by this distance.
# PRESSURE, VOID, FULL: pressure over p₀, void fraction (≤ 0), 1 for full nodes.
# MASS, START_MASS, WAS_VOID: oil of void nodes in the balance and at the step's start, 1 for nodes void at the start.
# WEIGHT: see cranktrain.film.elastic.weights. START: distance of the surfaces at the step's start. GROWTH: ∂H/∂t.
FILM, OPEN, SLOPE, BEND, PRESSURE, VOID, FULL, MASS, WAS_VOID, WEIGHT, START = range(11)
# OWN, AFTER, BEFORE, SQUEEZE: factors of ∂R/∂H. CHANGE: change of the distance by the last Newton step.
OWN, AFTER, BEFORE, SQUEEZE, GROWTH, CONTACT, CONTACT_SLOPE, CHANGE = range(11, 19)
# Oil, with pressures over p₀: reduced pressure and its derivative by pressure, relative increase of viscosity.
REDUCED, MOBILITY, THICKENING = 19, 20, 21
# Change of a node's unknown by the last Newton step; load of its pressure, for sums.
NEXT, PRESSING, START_MASS = 22, 23, 24
# Compressible oil: ρ/ρ₀ − 1, its derivative by pressure, and its value at the step's start.
COMPRESSED, DENSE, START_COMPRESSED = 25, 26, 27
NODE_FIELDS = 28
# Fields of faces between columns, after the node of the same number.
# FACE_FILM, FACE_START: distance of the surfaces now and at the step's start. FACE_OPEN, FACE_SLOPE: mean gap, slope.
# FACE_FLOW, FACE_FLUX, FACE_EXTRA: flow, its derivative by the distance, correction of the transport.
# FACE_LIMITED: limited correction per unit of rate. FACE_AHEAD: weight of the downstream node's compression.
FACE_FILM, FACE_OPEN, FACE_SLOPE, FACE_FLOW, FACE_FLUX, FACE_EXTRA, FACE_LIMITED, FACE_START, FACE_AHEAD = range(9)
FACE_FIELDS = 9
# Columns of LaneWork.trig.
COS, SIN, FACE_COS, FACE_SIN = range(4)
# Columns of LaneWork.lines: ζ, width of contact, 1/(Δζ w) towards the next and the previous line.
ZETA, WIDTH, AFTER_SIDE, BEFORE_SIDE = range(4)
# Rows of LaneWork.lane:
# FORWARD, BACKWARD: ½ω/Δφ of forward and backward rotation (1/s). SUPPLY: supply pressure over p₀.
# PER_UNIT: 1/p₀ for contact (1/Pa). EXTRA_RATE: signed rate of the limited transport (1/s).
# SHARE: fraction of the Newton step. HIGHEST_PRESSURE, CHANGED, MOVED: highest pressure, mark of changed sides (0:
# none), largest change. ACTIVE, FAILED, DONE: masks. MOST: largest change of the gap.
# MOVE, PACE: displacement of the journal since the step's start and its velocity, over the clearance.
FORWARD, BACKWARD, SUPPLY, PER_UNIT, EXTRA_RATE, SHARE, HIGHEST_PRESSURE, CHANGED, MOVED = range(9)
ACTIVE, FAILED, MOST, DONE = 9, 10, 11, 12
MOVE, PACE = 13, 17
LANE_ROWS = 21
# Rows of LaneWork.steps: last Newton step and velocities of the bore shapes, over the clearance.
STEP, RATE = 0, 1
# Rows of LaneWork.wide, in double precision:
# PLACE, VELOCITY, START_PLACE: journal position, journal velocity, position at the step's start, over the clearance.
# SPEED, ETA, UNIT, OIL_ROW: speed (rad/s), viscosity (Pa s), p₀ and row of the oil table.
PLACE, VELOCITY, START_PLACE = 0, 4, 8
SPEED, ETA, UNIT, OIL_ROW = 12, 13, 14, 15
WIDE_ROWS = 16
# Rows of LaneWork.shifts: bore shapes, shapes at the step's start, Δ of the stage's rule, over the clearance.
SHIFT, START_SHIFT, KNOWN = range(3)
# Columns of LaneWork.marks. RESIDENT: the lane's ``nodes`` hold the last solution of its film.
# ALONE: the film is solved alone, because its tolerance is too fine for single precision.
CUT, PREPARED, SIGN, RESIDENT, STAGED, ALONE, MARKS = range(7)
# Columns of LaneWork.gaps, a table over u = H/σ:
# MEAN, MEAN_SLOPE, MEAN_BEND: mean gap over σ with two derivatives by u.
# PRESS, PRESS_SLOPE, AREA: contact pressure (Pa) and its derivative by u, fraction of the area in contact.
MEAN, MEAN_SLOPE, MEAN_BEND, PRESS, PRESS_SLOPE, AREA = range(6)
LOWEST_U, PER_U, FINE_PER_U = -20.0, 16.0, 64.0
"""First u of the table, and rows per unit of u, so that interpolation has the accuracy of singles or of doubles."""


class LaneWork(NamedTuple):
    """Workspace of g groups of L = 8 films in singles or of one film in doubles (L = 1).

    The films have N columns of n lines between the ends. S is the number of shapes plus one, rounded up to whole blocks
    of eight. Arrays marked with * are of singles if L = 8. The last axis interleaves the lanes: (…, m L).
    """

    trig: Any  # (g, N, 4 L) * cosines and sines, rotated to each lane's cut
    shapes: Any  # (g, N (n + 2) + N n, S L) * shapes at nodes, then at faces, rotated to each lane's cut
    supply: Any  # (g, N n L) * 1 for nodes at supply pressure
    lines: Any  # (n + 2, 4) * axial lines, common to all lanes
    gaps: Any  # (m, 6) * table of mean gap and contact over u
    marks: Array  # (g, L, MARKS) marks of each lane, see CUT
    nodes: Any  # (g, NODE_FIELDS, N (n + 2) L) * fields of nodes, see FILM
    faces: Any  # (g, FACE_FIELDS, N n L) * fields of faces, see FACE_FILM
    rows: Any  # (N,) int64: place of each column in the matrix of the oil balance
    band: Any  # (N n, (2 w + 1) L) * matrix of the oil balance of the present group; w = n if L = 8, else up to 2 n
    columns: Any  # (N n, S L) * right-hand sides and solutions, first of residual and shapes, then of the journal
    loads: Any  # (3 + S, (S + 8) L) * generalised forces of solutions, first of the shapes, then of the last sources
    touching: Any  # (3 + S, (3 + S) L) * derivatives of the loads at fixed pressure
    border: Any  # (S, (S + 8) L) * equations of the shapes; right-hand sides begin at column S
    lane: Any  # (LANE_ROWS L,) * values of each lane, see FORWARD
    steps: Any  # (2, S L) * values of each shape and lane, see STEP
    wide: Array  # (WIDE_ROWS L,) values of each lane, see PLACE
    shifts: Array  # (3, S L) values of each shape and lane, see SHIFT
    vectors: Array  # (2, S) journal position and shapes as ``node_films`` wants them
    sums: Array  # ((12 + S) L,) loads of each lane
    total: Array  # (L,) scratch for one sum
    own: Array  # (L,) numbers of the films in the lanes
    asked: Array  # (L,) 1 for lanes that the caller requested
    wanted: Array  # (L,) in: 1 for requested lanes; out: 1 for those that converged
    tangents: Array  # (L,) 1 for lanes whose tangents are requested
    status: Array  # (L,) iterations of a lane, 0 if it failed; finally its status


def lane_work(film: ElasticFilm, films: int = 1, *, singles: bool = False) -> LaneWork:
    """Make the workspace of ``films`` films like ``film``: in doubles each a group, with ``singles`` eight a group."""
    n_phi, n_z = int(film.constants[at.N_PHI]), int(film.constants[at.N_Z])
    lanes = LANES if singles else 1
    lines, size, groups = n_z + 2, n_phi * n_z, -(-films // lanes)
    most = film.shapes.shape[1]

    def z(*shape: int) -> NDArray[Any]:
        # Vectors of eight singles that begin at a multiple of 64 bytes never lie in two cache lines.
        size = 8 // (1 + singles) * lanes * math.prod(shape)
        room = np.zeros(size + 64, dtype=np.uint8)
        start = -room.ctypes.data % 64
        numbers = room[start : start + size].view(np.float32 if singles else np.float64)
        return numbers.reshape(*shape[:-1], lanes * shape[-1])

    marks = np.zeros((groups, lanes, MARKS))
    marks[:, :, CUT] = -1.0
    shared = np.column_stack([film.lines[:, at.ZETA], film.lines[:, at.LINE_WIDTH], *film.sides])
    width, per_u = (n_z, PER_U) if singles else (2 * n_z, FINE_PER_U)
    gaps = np.zeros((round((HIGHEST - LOWEST_U) * per_u) + 2 if films else 2, 6))
    if films:
        fill_gaps(gaps, per_u, film.contact, film.contact_table)
    return LaneWork(
        z(groups, n_phi, 4), z(groups, n_phi * lines + size, most), z(groups, size),
        np.ascontiguousarray(shared.astype(z(0).dtype)), gaps.astype(z(0).dtype),
        marks, z(groups, NODE_FIELDS, n_phi * lines), z(groups, FACE_FIELDS, size), np.arange(n_phi),
        z(size, 2 * width + 1), z(size, most), z(3 + most, most + BLOCK), z(3 + most, 3 + most),
        z(most, most + BLOCK), z(LANE_ROWS), z(2, most), np.zeros(WIDE_ROWS * lanes), np.zeros((3, most * lanes)),
        np.zeros((2, most)), np.zeros((12 + most) * lanes), *np.zeros((6, lanes)),
    )  # fmt: skip


@kernel
def fill_gaps(table, per_u, contact, contact_table):
    """Fill a ``table`` (m, 6) of mean gap and contact over u = H/σ, with ``per_u`` rows per unit of u.

    ``contact`` and ``contact_table`` are fields of a film.
    """
    sigma = contact[SIGMA]
    for k in range(table.shape[0]):
        u = LOWEST_U + k / per_u
        table[k, MEAN], table[k, MEAN_SLOPE], table[k, MEAN_BEND] = open_gap(u, 1.0)
        if sigma > 0.0:
            p, by_gap, area = contact_pressure(u * sigma, contact, contact_table)
            table[k, PRESS] = p
            table[k, PRESS_SLOPE] = by_gap * sigma
            table[k, AREA] = area


@inlined_kernel
def shape_count(film, work):
    """Return the number of shapes in loops; in singles seven, known to a compiler, zeros for a film that has fewer."""
    return BLOCK - 1 if lane_count(work.nodes) > 1 else int(film.constants[at.N_SHAPES])


@kernel
def rows_per_u(table):
    """Return the rows per unit of u of a table of gaps."""
    return FINE_PER_U if lane_count(table) == 1 else PER_U
