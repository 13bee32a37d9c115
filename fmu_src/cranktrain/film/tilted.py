"""Films that feel the journal's tilt: their data, their memory, and the law that solves Reynolds' equation in the loop.

A journal is described by the displacement of its middle (x, y) and that of its end at ζ = 1 against the middle (a, b),
m, with velocities in space, in any axes; forces on these four are (F_x, F_y, Q_x, Q_y), N, with Q = ∫ ζ dF. Asperities
carry beside the film (:mod:`cranktrain.film.asperity`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.engine import PlainBearing
from cranktrain.errors import InputError
from cranktrain.film.aligned_law import aligned_observables
from cranktrain.film.bore_compliance import BoreCompliance
from cranktrain.film.database import FilmTable, table_grid
from cranktrain.film.elastic_grid import FRICTION_TORQUE, N_PHI, N_SHAPES, ElasticFilm, ElasticWork
from cranktrain.film.elastic_law import (
    IN_LOOP as ELASTIC_GRID,
)
from cranktrain.film.elastic_law import (
    SMALLEST,
    ElasticMemory,
    elastic_arrays,
    elastic_force,
    elastic_memory,
    elastic_solve,
    no_elastic_film,
)
from cranktrain.film.journal import OUT_SIZE, film_observables, journal_film
from cranktrain.film.journal_contact import N_OUT, TORQUE, JournalContact, bearing_contact, journal_contact
from cranktrain.film.journal_grid import JournalGrid, JournalWork, cold_start, journal_grid, journal_work
from cranktrain.film.parabolic import friction_torque
from cranktrain.film.parameters import CLEARANCE, RADIUS, VISCOSITY, WIDTH
from cranktrain.film.table_interpolation import TableArrays
from cranktrain.film.table_law import TABLE, TableWork, table_force, table_work, tilted_pressure
from cranktrain.kernel import call_kernel, kernel, kernel_address
from cranktrain.reduced_body import Array

IntArray = NDArray[np.int64]

# What a tilted film writes: forces (4), tangents by place and by velocity (4 × 4 each), and figures.
BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION, PASSES, P_MAX, FLOW, GAP, SIZE = 4, 20, 36, 37, 38, 39, 40, 41, 42

IN_LOOP = (48, 8)
"""Intervals around and across of films that are solved in the loop: forces within 0.2 %, moments 0.3 % at p95."""


class FilmArrays(NamedTuple):
    """Data of the tilted films, the same for every main bearing."""

    grid: JournalGrid
    contact: JournalContact
    table: TableArrays
    elastic: ElasticFilm
    force: IntArray  # (1,) address of the level's force law


class FilmWork(NamedTuple):
    """Memory of the films; results never depend on what it holds."""

    journal: JournalWork
    active: Array  # (b, N, m) active set of each film
    place: Array  # (b, 4)
    velocity: Array  # (b, 4)
    film: Array  # (36,) dimensionless result
    contact: Array  # (25,)
    plane: Array  # (16,) a film without tilt
    table: TableWork
    solved: Array  # (1,) films that lay outside the table since the count was last taken
    elastic: ElasticWork
    memory: ElasticMemory  # of the elastic films


def film_arrays(
    bearing: PlainBearing, level: str, viscosity: float, table: FilmTable | None, bore: BoreCompliance | None
) -> FilmArrays:
    """Data of the films of one bearing at ``viscosity`` (Pa s); what a level does not read is of the least size.

    Raises
    ------
    InputError
        level ``table`` without a table, or with one of another bearing; ``ehd`` without the bore's compliance
    """
    arrays = TableArrays(np.zeros((1, 1, 1)), np.zeros((1, 1, 1, 1)), np.zeros(8))
    grid = journal_grid(*IN_LOOP) if level == "reynolds" else journal_grid(12, 6)
    if level == "table":
        ratio = bearing.width / bearing.diameter
        if table is None:
            raise InputError(f"bearing level 'table' needs a film table of L/D {ratio:.4g}; make it by film-table")
        made = table.settings
        if abs(made.length_ratio - ratio) > 1.0e-6 or made.groove != bearing.groove or not made.tilt:
            raise InputError(
                f"film table of L/D {made.length_ratio:.6g}, groove {made.groove}, "
                f"{'with' if made.tilt else 'no'} tilt does not fit the bearing, L/D {ratio:.6g}, "
                f"groove {bearing.groove}; make one by film-table"
            )
        arrays, grid = table.arrays, table_grid(made, *IN_LOOP)
    elastic = no_elastic_film()
    if level == "ehd":
        if bore is None:
            raise InputError("bearing level 'ehd' needs the bore's compliance; make it by structure.saddle")
        elastic = elastic_arrays(bearing, viscosity, bore, ELASTIC_GRID)
    return FilmArrays(grid, bearing_contact(bearing), arrays, elastic, np.zeros(1, dtype=np.int64))


def film_work(films: FilmArrays, bearings: int) -> FilmWork:
    """Memory for the films of ``bearings`` journals."""
    return FilmWork(
        journal=journal_work(films.grid),
        active=np.array([cold_start(films.grid)] * bearings),
        place=np.zeros((bearings, 4)),
        velocity=np.zeros((bearings, 4)),
        film=np.zeros(OUT_SIZE),
        contact=np.zeros(N_OUT),
        plane=np.zeros(16),
        table=table_work(),
        solved=np.zeros(1),
        elastic=(ELASTIC_GRID if films.elastic.constants[N_PHI] == ELASTIC_GRID.n_phi else SMALLEST).work(
            int(films.elastic.constants[N_SHAPES])
        ),
        memory=elastic_memory(films.elastic, bearings),
    )


def compile_force(films: FilmArrays, work: FilmWork, level: str, parameters: Array) -> None:
    """Compile the force law of a level that feels tilt, and leave its address in ``films.force``."""
    if level in FORCES:
        films.force[0] = kernel_address(FORCES[level], films, work, parameters, 0, 0.0, 1.0, 0.0, True, np.zeros(SIZE))


@kernel
def tilted_force(films, work, parameters, i, speed, cos, sin, tangents, out):
    """Force of the film of journal i at ``work.place[i]``, ``work.velocity[i]``, by the level's law; 0, or a failure.

    Parameters
    ----------
    parameters : of the bearing, see :mod:`cranktrain.film.parameters`
    speed : the journal's own, rad/s
    cos, sin : of the frame's angle
    tangents : bool; without, a law may leave those of its last call
    out : laid out as the columns above; P_MAX and FLOW are left to :func:`tilted_observables`
    """
    return call_kernel(films.force[0], (films, work, parameters, i, speed, cos, sin, tangents, out))  # type: ignore[call-arg]


@kernel
def reynolds_force(films, work, parameters, i, speed, cos, sin, tangents, out):
    """Reynolds' equation of a rigid bore, solved in place."""
    c = parameters[CLEARANCE]
    viscosity = parameters[VISCOSITY]
    radius = parameters[RADIUS]
    width = parameters[WIDTH]
    place = work.place[i]
    velocity = work.velocity[i]
    half = 0.5 * speed
    ratio = 2.0 * radius / width
    out[PASSES] = journal_film(
        films.grid, ratio * ratio, place[0] / c, place[1] / c, place[2] / c, place[3] / c,
        (velocity[0] + half * place[1]) / c, (velocity[1] - half * place[0]) / c,
        (velocity[2] + half * place[3]) / c, (velocity[3] - half * place[2]) / c,
        work.journal, work.active[i], work.film,
    )  # fmt: skip
    film = work.film
    scale = 6.0 * viscosity * radius * width * (radius / c) * (radius / c)
    for k in range(4):
        out[k] = scale * film[k]
    scale /= c
    for k in range(16):
        out[BY_VELOCITY + k] = scale * film[BY_VELOCITY + k]
    # The velocity of pure squeeze depends on the place through the surface speeds.
    for r in range(4):
        for pair in range(0, 4, 2):
            k = 4 * r + pair
            out[BY_PLACE + k] = scale * (film[BY_PLACE + k] - half * film[BY_VELOCITY + k + 1])
            out[BY_PLACE + k + 1] = scale * (film[BY_PLACE + k + 1] + half * film[BY_VELOCITY + k])
    rough_force(films, work, i, c, viscosity, radius, width, speed, out)
    return 0


@kernel
def tabled_force(films, work, parameters, i, speed, cos, sin, tangents, out):
    """The same read from the table; films outside it are solved, and counted in ``work.solved``."""
    c = parameters[CLEARANCE]
    viscosity = parameters[VISCOSITY]
    radius = parameters[RADIUS]
    width = parameters[WIDTH]
    place = work.place[i]
    velocity = work.velocity[i]
    status = table_force(
        place[0], place[1], place[2], place[3], velocity[0], velocity[1], velocity[2], velocity[3], 0.5 * speed, c,
        6.0 * viscosity * radius * width * (radius / c) * (radius / c), films.table, films.grid, work.journal,
        work.active[i], work.table, out,
    )  # fmt: skip
    if status != TABLE:
        work.solved[0] += 1.0
    out[PASSES] = status
    rough_force(films, work, i, c, viscosity, radius, width, speed, out)
    return 0


@kernel
def elastic_bearing_force(films, work, parameters, i, speed, cos, sin, tangents, out):
    """Film in an elastic bore that remembers its oil; asperities are in its Newton. Without tangents: no force either.

    A film that failed gives forces that are no numbers, which end the stage.
    """
    place = work.place[i]
    status = elastic_solve(
        films.elastic, work.elastic, work.memory, i, place, work.velocity[i], speed, cos, sin, tangents
    )
    if tangents:
        elastic_force(work.memory.out[i], status, cos, sin, out)
        out[FRICTION] = work.memory.out[i, FRICTION_TORQUE]
        out[ECCENTRICITY] = (place[0] * place[0] + place[1] * place[1]) ** 0.5 / parameters[CLEARANCE]
        out[PASSES] = 0.0
    return status


@kernel
def rough_force(films, work, i, c, viscosity, radius, width, speed, out):
    """Add what asperities carry, and the friction torque of film and asperities."""
    place = work.place[i]
    eps = (place[0] * place[0] + place[1] * place[1]) ** 0.5 / c
    out[FRICTION] = friction_torque(eps, out[0], out[1], place[0], place[1], viscosity, radius, width, c, speed)
    contact = work.contact
    rough = films.contact
    journal_contact(
        place[0], place[1], place[2], place[3], radius * speed, rough.constants, rough.table, rough.slices,
        rough.gauss, contact,
    )  # fmt: skip
    for k in range(20):
        out[k] += contact[k]
    out[FRICTION] += contact[TORQUE]
    out[ECCENTRICITY] = eps


@kernel
def tilted_observables(films, work, i, c, viscosity, radius, width, speed, tabled, out):
    """Largest pressure (Pa) and side flow (m³/s) of the film of journal i, whose force was found last.

    Where it was read from a table: pressure from the table with tilt, flow of the aligned film.
    """
    if tabled and out[PASSES] == TABLE:
        place = work.place[i]
        velocity = work.velocity[i]
        _, out[FLOW] = aligned_observables(
            place[0], place[1], velocity[0], velocity[1], 0.5 * speed, c, viscosity, radius, width, films.table,
            work.plane,
        )  # fmt: skip
        out[P_MAX] = tilted_pressure(
            place[0], place[1], place[2], place[3], velocity[0], velocity[1], 0.5 * speed, c, viscosity, radius,
            films.table, work.table,
        )  # fmt: skip
        return
    highest, flow = film_observables(films.grid, work.journal)
    out[P_MAX] = 12.0 * viscosity * (radius / c) * (radius / c) * highest
    out[FLOW] = 2.0 * c * radius * radius * radius / width * flow


FORCES = {"table": tabled_force, "reynolds": reynolds_force, "ehd": elastic_bearing_force}
