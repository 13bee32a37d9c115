"""Laws ``reynolds`` and ``table``: fluid film and asperity contact between a tilting journal and a rigid bore."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel, law_kernel, record_reader
from cranktrain.core.lanes import four
from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import PlainBearing
from cranktrain.film.contact.gap import over
from cranktrain.film.contact.journal import (
    N_OUT,
    STIFFNESS,
    TORQUE,
    JournalContact,
    bearing_contact,
    journal_contact,
)
from cranktrain.film.journal.film import OUT_SIZE, film_observables, journal_film, shell_shear
from cranktrain.film.journal.grid import (
    ROUGHNESS,
    JournalGrid,
    JournalWork,
    Motion,
    cold_start,
    journal_grid,
    journal_work,
    shell_grid,
)
from cranktrain.film.laws.films import (
    BY_PLACE,
    BY_VELOCITY,
    ECCENTRICITY,
    FLOW,
    FORCE,
    FRICTION,
    FROZEN,
    GAP,
    OBSERVE,
    P_MAX,
    PASSES,
    RUBBING,
    SPEED,
    X,
    Y,
    widen,
)
from cranktrain.film.laws.parameters import CLEARANCE, RADIUS, VISCOSITY, WIDTH
from cranktrain.film.table.aligned import aligned_force, aligned_observables
from cranktrain.film.table.database import FilmTable, TableSettings, aligned_grid, bearing_settings, table_grid
from cranktrain.film.table.interpolation import AXES, UNTILTED, TableArrays
from cranktrain.film.table.law import TABLED, Tabled, table_force, tilted_pressure
from cranktrain.film.table.tilted import TableWork, table_work

if TYPE_CHECKING:
    from cranktrain.film.laws.bearings import Bearings

IN_LOOP = (48, 8)
"""Grid intervals (around, across) of films solved online; 95th percentile error 0.2 % of forces, 0.3 % of moments."""
ALIGNED = (96, 12)
"""Grid intervals (around, across) of films without tilt, which are solved only beyond the table's eccentricities."""


class RigidBore(NamedTuple):
    """Data and memory of the films; the memory only speeds up solutions and does not change results."""

    parameters: Array  # (b, COLUMNS), see film.laws.parameters; bearings differ in viscosity only
    grid: JournalGrid
    contact: JournalContact
    table: TableArrays
    journal: JournalWork
    active: Array  # (b, N, m) active set of each film
    film: Array  # (36,) dimensionless result
    rough: Array  # (25,) result of the asperity contact
    plane: Array  # (16,) result of a film without tilt
    tabled: TableWork
    solved: Array  # (1,) number of film evaluations outside the table


def rigid_bore(
    bearing: PlainBearing,
    parameters: Array,
    table: FilmTable | None,
    solved: Array,
    tilted: bool = True,
    size: tuple[int, int] = IN_LOOP,
) -> RigidBore:
    """Make one film per row of ``parameters`` (b, COLUMNS), read from ``table`` or, if it is None, solved online.

    ``tilted``: whether forces depend on tilt; ``size``: grid intervals (around, across) of films solved online.

    Raises
    ------
    InputError
        if the table belongs to another bearing
    """
    arrays = TableArrays(np.zeros((1, 1, 1)), UNTILTED, np.zeros(AXES))
    if table is None:
        rough = bearing.roughness / bearing.clearance
        grid = shell_grid(journal_grid(*size), over(bearing.relief, bearing.clearance), rough)
    else:
        made, wanted = table.settings, bearing_settings(bearing)
        if not fits(table, bearing, tilted):
            raise InputError(
                f"film table of {_said(made)}, {'with' if made.tilt else 'no'} tilt does not fit the bearing, "
                f"{_said(wanted)}; make one by film-table"
            )
        arrays = table.arrays
        grid = table_grid(made, *size) if tilted else aligned_grid(made, *ALIGNED)
    return RigidBore(
        parameters=parameters,
        grid=grid,
        contact=bearing_contact(bearing),
        table=arrays,
        journal=journal_work(grid),
        active=np.array([cold_start(grid)] * len(parameters)),
        film=np.zeros(OUT_SIZE),
        rough=np.zeros(N_OUT),
        plane=np.zeros(16),
        tabled=table_work(),
        solved=solved,
    )


def fits(table: FilmTable, bearing: PlainBearing, tilted: bool) -> bool:
    """True if a film table has the proportions of a bearing and, for ``tilted`` films, includes tilt."""
    made, wanted = table.settings, bearing_settings(bearing)
    same = replace(wanted, resolution=made.resolution, tilt=made.tilt, tilt_range=made.tilt_range) == made
    return same and (made.tilt or not tilted)


def fitting_table(tables: Sequence[FilmTable], bearing: PlainBearing) -> FilmTable | None:
    """Return the first of ``tables`` that fits a bearing with tilt, or None."""
    return next((table for table in tables if fits(table, bearing, True)), None)


def _said(settings: TableSettings) -> str:
    """Describe the bearing proportions of a table in words."""
    return (
        f"L/D {settings.length_ratio:.6g}, groove {settings.groove}, relief {settings.relief_depth:.4g} over "
        f"{settings.relief_share:.4g} to the power {settings.relief_exponent:.4g} and roughness "
        f"{settings.roughness:.4g} of the clearance"
    )


def reynolds_films(bearings: Bearings) -> RigidBore:
    """Make films of main bearings that are solved online."""
    return rigid_bore(bearings.plain, bearings.parameters, None, bearings.solved)


def table_films(bearings: Bearings) -> RigidBore:
    """Make films of main bearings that are read from a table."""
    return rigid_bore(bearings.plain, bearings.parameters, bearings.parts["table"], bearings.solved)


def aligned_films(bearings: Bearings) -> RigidBore:
    """Make films of big ends that are read from a table, with or without tilt."""
    return rigid_bore(bearings.plain, bearings.parameters, bearings.parts["big_end_table"], bearings.solved, False)


_SMALL = journal_grid(12, 6)
_read = record_reader(
    RigidBore(
        np.zeros((1, 1)), _SMALL, JournalContact(np.zeros(1), np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 1))),
        TableArrays(np.zeros((1, 1, 1)), UNTILTED, np.zeros(AXES)), journal_work(_SMALL),
        np.array([cold_start(_SMALL)]), np.zeros(1), np.zeros(1), np.zeros(1), table_work(), np.zeros(1),
    )
)  # fmt: skip


@law_kernel
def reynolds_law(record, action, i, place, velocity, numbers, memory, out):
    """Kernel of a film solved online by Reynolds' equation; see :mod:`cranktrain.film.laws.films`."""
    bore = _read(record)
    own = bore.parameters[i]
    c = own[CLEARANCE]
    half = 0.5 * numbers[SPEED]
    ratio = 2.0 * own[RADIUS] / own[WIDTH]
    film = bore.film
    x, y, a, b = four(place, 0)
    vx, vy, va, vb = four(velocity, 0)
    at = Motion(
        x / c, y / c, a / c, b / c, (vx + half * y) / c, (vy - half * x) / c, (va + half * b) / c, (vb - half * a) / c
    )
    out[PASSES] = journal_film(bore.grid, ratio * ratio, at, bore.journal, bore.active[i], film)
    scale = _force_unit(own)
    for k in range(4):
        out[k] = scale * film[k]
    scale /= c
    for k in range(16):
        out[BY_VELOCITY + k] = scale * film[BY_VELOCITY + k]
    # The velocity of pure squeeze depends on the position through the surface speeds.
    for r in range(4):
        for pair in range(0, 4, 2):
            k = 4 * r + pair
            out[BY_PLACE + k] = scale * (film[BY_PLACE + k] - half * film[BY_VELOCITY + k + 1])
            out[BY_PLACE + k + 1] = scale * (film[BY_PLACE + k + 1] + half * film[BY_VELOCITY + k])
    _rough_force(bore, own, place, numbers[SPEED], out)
    if action == OBSERVE:
        _solved_figures(bore, own, out)
    return 0


@law_kernel
def table_law(record, action, i, place, velocity, numbers, memory, out):
    """Kernel of a film read from the table; films outside the table are solved online and counted in ``solved``."""
    bore = _read(record)
    own = bore.parameters[i]
    half = 0.5 * numbers[SPEED]
    tabled = Tabled(bore.table, bore.grid, bore.journal, bore.active[i], bore.tabled)
    tangents = action == FORCE and numbers[FROZEN] == 0.0
    status = table_force(place, velocity, half, own[CLEARANCE], _force_unit(own), tabled, out, tangents)
    if status != TABLED:
        bore.solved[0] += 1.0
    out[PASSES] = status
    _rough_force(bore, own, place, numbers[SPEED], out)
    if action != OBSERVE:
        return 0
    if status != TABLED:
        _solved_figures(bore, own, out)
        return 0
    # The pressure comes from the table with tilt, the flow from the aligned film.
    _, out[FLOW] = aligned_observables(place, velocity, half, own, bore.table, bore.plane)
    out[P_MAX] = tilted_pressure(place, velocity, half, own, bore.table, bore.tabled)
    out[GAP] = -1.0
    return 0


@law_kernel
def aligned_law(record, action, i, place, velocity, numbers, memory, out):
    """Kernel of a film without tilt read from the table; journal and bore may both rotate (big ends)."""
    bore = _read(record)
    own = bore.parameters[i]
    half = 0.5 * numbers[SPEED]
    tabled = Tabled(bore.table, bore.grid, bore.journal, bore.active[i], bore.tabled)
    if aligned_force(place, velocity, half, own[CLEARANCE], _force_unit(own), tabled, bore.plane) != TABLED:
        bore.solved[0] += 1.0
    widen(bore.plane, out)
    at = Motion(place[X] / own[CLEARANCE], place[Y] / own[CLEARANCE], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    turning = 0.5 * (place[X] * out[Y] - place[Y] * out[X])
    rough = bore.rough
    journal_contact(place[X], place[Y], 0.0, 0.0, own[RADIUS] * numbers[RUBBING], bore.contact, rough)
    for r in range(2):
        out[r] += rough[r]
        for s in range(2):
            out[BY_PLACE + 4 * r + s] += rough[STIFFNESS + 4 * r + s]
    out[FRICTION] = rough[TORQUE] - _film_drag(bore.grid, own, at, numbers[RUBBING]) - turning
    if action == OBSERVE:
        out[P_MAX], out[FLOW] = aligned_observables(place, velocity, half, own, bore.table, bore.plane)
        out[GAP] = -1.0
    return 0


@kernel
def _force_unit(own):
    """Return the force unit 6 η R L (R/c)² (N s) of a bearing with parameters ``own``."""
    c = own[CLEARANCE]
    radius = own[RADIUS]
    return 6.0 * own[VISCOSITY] * radius * own[WIDTH] * (radius / c) * (radius / c)


@kernel
def _solved_figures(bore, own, out):
    """Write largest pressure (Pa) and side flow (m³/s) of the last solved film to P_MAX and FLOW of ``out``."""
    c = own[CLEARANCE]
    radius = own[RADIUS]
    highest, flow = film_observables(bore.grid, bore.journal)
    out[P_MAX] = 12.0 * own[VISCOSITY] * (radius / c) * (radius / c) * highest
    out[FLOW] = 2.0 * c * radius * radius * radius / own[WIDTH] * flow
    out[GAP] = -1.0


@kernel
def _rough_force(bore, own, place, speed, out):
    """Add the asperity contact to force and tangents, and write the friction torque of film and asperities."""
    c = own[CLEARANCE]
    x, y, a, b = four(place, 0)
    fx, fy, qx, qy = four(out, 0)
    at = Motion(x / c, y / c, a / c, b / c, 0.0, 0.0, 0.0, 0.0)
    rough = bore.rough
    journal_contact(x, y, a, b, own[RADIUS] * speed, bore.contact, rough)
    # The torques on journal and shell differ by e × F + t × Q.
    turning = 0.5 * (x * fy - y * fx + a * qy - b * qx)
    out[FRICTION] = rough[TORQUE] - _film_drag(bore.grid, own, at, speed) - turning
    for k in range(TORQUE):
        out[k] += rough[k]
    out[ECCENTRICITY] = math.sqrt(x * x + y * y) / c


@kernel
def _film_drag(grid, own, at, speed):
    """Return the shear torque (N m) of a filled film at the relative ``speed`` (rad/s), on the area without contact."""
    radius = own[RADIUS]
    shear = shell_shear(at, grid.shear, grid.settings[ROUGHNESS])
    return own[VISCOSITY] * radius * radius * radius * own[WIDTH] * speed / own[CLEARANCE] * shear
