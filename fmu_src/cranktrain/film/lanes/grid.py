"""Workspace of eight elastic films that are solved at once, one in each lane, and their common tables.

The films are those of :mod:`cranktrain.film.elastic.grid` on one grid; they differ in their motion, their oil and their
memory. Internal numbers are singles. Sums of forces, a film's memory and its motion are doubles. The gap at the start
of a step is computed in doubles and its change within the step in singles, so that a thin film keeps its accuracy.

The ring of columns of every lane is cut where its film is ruptured. Columns are counted from the cut (position 0), and
the geometry of a lane is rotated accordingly.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import kernel
from cranktrain.core.types import Array
from cranktrain.film.contact.asperity import HIGHEST, SIGMA, contact_pressure
from cranktrain.film.contact.gap import open_gap
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic.grid import ElasticFilm

Singles = NDArray[np.float32]

LANES = 8
SIDES = 8
"""Number of right-hand sides solved together: residual and shapes, or positions and velocities of the journal."""
MOST_SHAPES = SIDES - 1

# Fields of nodes in LaneWork.nodes; the nodes at both ends are included.
FILM, OPEN, SLOPE, BEND, PRESSURE, VOID, FULL, MASS, WAS_VOID, WEIGHT, START = range(11)
# Field of the oil at the step's start, the constant part of MASS.
START_MASS = 24
OWN, AFTER, BEFORE, SQUEEZE, GROWTH, CONTACT, CONTACT_SLOPE, CHANGE = range(11, 19)
REDUCED, MOBILITY, THICKENING = 19, 20, 21
# Change of a node's unknown by the last Newton step; load of its pressure, for sums.
NEXT, PRESSING = 22, 23
NODE_FIELDS = 25
# Fields of faces between columns, after the node of the same number.
FACE_FILM, FACE_OPEN, FACE_SLOPE, FACE_FLOW, FACE_FLUX, FACE_EXTRA, FACE_LIMITED, FACE_START = range(8)
FACE_FIELDS = 8
# Columns of LaneWork.trig.
COS, SIN, FACE_COS, FACE_SIN = range(4)
# Columns of LaneWork.lines: ζ, width of contact, 1/(Δζ w) towards the next and the previous line.
ZETA, WIDTH, AFTER_SIDE, BEFORE_SIDE = range(4)
# Rows of LaneWork.lane, in single precision:
# FORWARD, BACKWARD: ½ω/Δφ of forward and backward rotation (1/s). SUPPLY: supply pressure over p₀.
# PER_UNIT: 1/p₀ for contact (1/Pa). PER_OIL_STEP: pressure step of the oil table.
# EXTRA_RATE: signed rate of the limited transport (1/s). SHARE: fraction of the Newton step.
# HIGHEST_PRESSURE, CHANGED, MOVED: highest pressure, mark of changed sides (0: none), largest change.
# ACTIVE, FAILED, DONE: masks. MOST: largest change of the gap.
# MOVE, PACE: displacement of the journal since the step's start and its velocity, over the clearance.
# STEP, RATE: displacements of the bore shapes since the step's start and their velocities, over the clearance.
FORWARD, BACKWARD, SUPPLY, PER_UNIT, PER_OIL_STEP, EXTRA_RATE, SHARE, HIGHEST_PRESSURE, CHANGED, MOVED = range(10)
ACTIVE, FAILED, MOST, DONE = 10, 11, 12, 13
MOVE, PACE = 14, 18
STEP = 22
RATE = STEP + SIDES
LANE_ROWS = RATE + SIDES
# Rows of LaneWork.wide, in double precision:
# PLACE, VELOCITY, START_PLACE: journal position, journal velocity, position at the step's start, over the clearance.
# SHIFT, START_SHIFT, KNOWN: bore shapes, shapes at the step's start, Δ of the stage's rule, over the clearance.
# SPEED, ETA, UNIT, OIL_ROW: speed (rad/s), viscosity (Pa s), p₀ and row of the oil table.
PLACE, VELOCITY, START_PLACE = 0, 4, 8
SHIFT, START_SHIFT, KNOWN = 12, 20, 28
SPEED, ETA, UNIT, OIL_ROW = 36, 37, 38, 39
WIDE_ROWS = 40
# Columns of LaneWork.marks. RESIDENT: the lane's ``nodes`` hold the last solution of its film.
# ALONE: the film is solved alone, because its tolerance is too fine for single precision.
CUT, PREPARED, SIGN, RESIDENT, STAGED, ALONE, MARKS = range(7)
# Columns of LaneWork.gaps, a table over u = H/σ:
# MEAN, MEAN_SLOPE, MEAN_BEND: mean gap over σ with two derivatives by u.
# PRESS, PRESS_SLOPE, AREA: contact pressure (Pa) and its derivative by u, fraction of the area in contact.
MEAN, MEAN_SLOPE, MEAN_BEND, PRESS, PRESS_SLOPE, AREA = range(6)
LOWEST_U, PER_U = -20.0, 16.0
"""First u of the table and rows per unit of u, so that interpolation has single-precision accuracy."""


class LaneWork(NamedTuple):
    """Workspace of g groups of eight films, with N columns of n lines between the ends and at most seven shapes.

    The last axis of these arrays interleaves the eight lanes: (…, m × 8).
    """

    trig: Any  # (g, N, 4 × 8) cosines and sines, rotated to each lane's cut
    shapes: Any  # (g, N (n + 2) + N n, 7 × 8) shapes at nodes, then at faces, rotated to each lane's cut
    supply: Any  # (g, N n × 8) 1 for nodes at supply pressure
    lines: Any  # (n + 2, 4) axial lines, common to all lanes
    gaps: Any  # (m, 6) table of mean gap and contact over u
    marks: Array  # (g, 8, MARKS) marks of each lane, see CUT
    nodes: Any  # (g, NODE_FIELDS, N (n + 2) × 8) fields of nodes, see FILM
    faces: Any  # (g, FACE_FIELDS, N n × 8) fields of faces, see FACE_FILM
    band: Any  # (N n, (2 n + 1) × 8) matrix of the oil balance of the present group
    columns: Any  # (N n, 8 × 8) right-hand sides and solutions, first of residual and shapes, then of the journal
    loads: Any  # (11, 16 × 8) generalised forces of solutions, first of the shapes, then of the last sources
    touching: Any  # (11, 11 × 8) derivatives of the loads at fixed pressure
    border: Any  # (7, 15 × 8) equations of the shapes
    lane: Any  # (LANE_ROWS × 8,) values of each lane in single precision, see FORWARD
    wide: Array  # (WIDE_ROWS × 8,) values of each lane in double precision, see PLACE
    sums: Array  # (16 × 8,) loads of each lane in double precision
    total: Array  # (8,) scratch for one sum in double precision
    own: Array  # (8,) numbers of the films in the lanes
    asked: Array  # (8,) 1 for lanes that the caller requested
    wanted: Array  # (8,) in: 1 for requested lanes; out: 1 for those that converged
    tangents: Array  # (8,) 1 for lanes whose tangents are requested
    status: Array  # (8,) iterations of a lane, 0 if it failed; finally its status


def _singles(*shape: int) -> Singles:
    return np.zeros(shape, dtype=np.float32)


def _lanes(*shape: int) -> Singles:
    """Return an array of eight single-precision numbers for every entry of ``shape``."""
    return _singles(*shape[:-1], LANES * shape[-1])


def lane_groups(films: int) -> int:
    """Return the number of groups of eight for ``films`` films."""
    return (films + LANES - 1) // LANES


def lane_work(film: ElasticFilm, films: int) -> LaneWork:
    """Make the workspace of ``films`` films like ``film``."""
    n_phi, n_z = int(film.constants[one.N_PHI]), int(film.constants[one.N_Z])
    lines, size, groups = n_z + 2, n_phi * n_z, lane_groups(films)
    marks = np.zeros((groups, LANES, MARKS))
    marks[:, :, CUT] = -1.0
    shared = _singles(lines, 4)
    shared[:, ZETA], shared[:, WIDTH] = film.lines[:, one.ZETA], film.lines[:, one.LINE_WIDTH]
    shared[:, AFTER_SIDE], shared[:, BEFORE_SIDE] = film.sides[one.AFTER_SIDE], film.sides[one.BEFORE_SIDE]
    points = n_phi * lines + size
    return LaneWork(
        _lanes(groups, n_phi, 4), _lanes(groups, points, MOST_SHAPES), _lanes(groups, size), shared,
        gap_table(film) if films else _singles(2, 6),
        marks, _lanes(groups, NODE_FIELDS, n_phi * lines),
        _lanes(groups, FACE_FIELDS, size), _lanes(size, 2 * n_z + 1), _lanes(size, SIDES), _lanes(11, 2 * SIDES),
        _lanes(11, 11), _lanes(MOST_SHAPES, MOST_SHAPES + SIDES), _lanes(LANE_ROWS), np.zeros(WIDE_ROWS * LANES),
        np.zeros(16 * LANES), *np.zeros((6, LANES)),
    )  # fmt: skip


def gap_table(film: ElasticFilm) -> Singles:
    """Make the table of mean gap and contact over u = H/σ, (m, 6), with the functions of a single film."""
    table = np.zeros((round((HIGHEST - LOWEST_U) * PER_U) + 2, 6))
    fill_gaps(table, film.contact, film.contact_table)
    return table.astype(np.float32)


@kernel
def fill_gaps(table, contact, contact_table):
    """Fill the ``table`` (m, 6) of :func:`gap_table`; ``contact`` and ``contact_table`` are fields of a film."""
    sigma = contact[SIGMA]
    for k in range(table.shape[0]):
        u = LOWEST_U + k / PER_U
        table[k, MEAN], table[k, MEAN_SLOPE], table[k, MEAN_BEND] = open_gap(u, 1.0)
        if sigma > 0.0:
            p, by_gap, area = contact_pressure(u * sigma, contact, contact_table)
            table[k, PRESS] = p
            table[k, PRESS_SLOPE] = by_gap * sigma
            table[k, AREA] = area
