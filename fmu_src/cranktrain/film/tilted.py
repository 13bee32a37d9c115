"""Films that feel the journal's tilt: their data, their memory, and the law that solves Reynolds' equation in the loop.

A journal is described by the displacement of its middle (x, y) and that of its end at ζ = 1 against the middle (a, b),
m, with velocities in space, in any axes; forces on these four are (F_x, F_y, Q_x, Q_y), N, with Q = ∫ ζ dF. Asperities
carry beside the film (:mod:`cranktrain.film.asperity`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.engine import PlainBearing
from cranktrain.film.journal import (
    OUT_SIZE,
    JournalGrid,
    JournalWork,
    cold_start,
    film_observables,
    journal_film,
    journal_grid,
    journal_work,
)
from cranktrain.film.journal_contact import N_OUT, TORQUE, JournalContact, bearing_contact, journal_contact
from cranktrain.film.parabolic import friction_torque
from cranktrain.kernel import kernel
from cranktrain.reduced_body import Array

# What a tilted film writes: forces (4), tangents by place and by velocity (4 × 4 each), and figures.
BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION, PASSES, P_MAX, FLOW, SIZE = 4, 20, 36, 37, 38, 39, 40, 41


class FilmArrays(NamedTuple):
    """Data of the tilted films, the same for every main bearing."""

    grid: JournalGrid
    contact: JournalContact


class FilmWork(NamedTuple):
    """Memory of the films; results never depend on what it holds."""

    journal: JournalWork
    active: Array  # (b, N, m) active set of each film
    place: Array  # (b, 4)
    velocity: Array  # (b, 4)
    film: Array  # (36,) dimensionless result
    contact: Array  # (25,)
    plane: Array  # (16,) a film without tilt


def film_arrays(bearing: PlainBearing, tilted: bool) -> FilmArrays:
    """Data of the films of one bearing; where nothing is tilted the least that has the same type."""
    grid = journal_grid(48, 8) if tilted else journal_grid(12, 4)
    return FilmArrays(grid, bearing_contact(bearing))


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
    )


@kernel
def reynolds_force(films, work, i, c, viscosity, radius, width, speed, out):
    """Force of the film of journal i at ``work.place[i]``, ``work.velocity[i]``; ``speed`` is its own (rad/s).

    ``out`` is laid out as the columns above; P_MAX and FLOW are left to :func:`tilted_observables`.
    """
    place = work.place[i]
    velocity = work.velocity[i]
    half = 0.5 * speed
    ratio = 2.0 * radius / width
    passes = journal_film(
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
    out[PASSES] = passes


@kernel
def tilted_observables(films, work, c, viscosity, radius, width, out):
    """Largest pressure (Pa) and side flow (m³/s) of the film that was solved last."""
    highest, flow = film_observables(films.grid, work.journal)
    out[P_MAX] = 12.0 * viscosity * (radius / c) * (radius / c) * highest
    out[FLOW] = 2.0 * c * radius * radius * radius / width * flow
