"""Films of a journal as the tests ask for them: one call, fresh memory, tangents as matrices."""

from typing import NamedTuple

import numpy as np

from cranktrain.film.journal.film import DAMPING, OUT_SIZE, STIFFNESS, journal_film
from cranktrain.film.journal.grid import Motion, cold_start, journal_grid, journal_work


class Film(NamedTuple):
    """Forces and moments (4,), ∂/∂(e, t) and ∂/∂(v, w) (4, 4), passes, and what the kernel left."""

    force: np.ndarray
    by_place: np.ndarray
    by_velocity: np.ndarray
    passes: int
    active: np.ndarray
    work: object


def film(grid, width_ratio, e, v, t=(0.0, 0.0), w=(0.0, 0.0), active=None):
    """Film at eccentricity e, tilt t and the velocities of pure squeeze v, w."""
    active = cold_start(grid) if active is None else active
    work, out = journal_work(grid), np.zeros(OUT_SIZE)
    at = Motion(*(float(x) for x in (*e, *t, *v, *w)))
    passes = journal_film(grid, float(width_ratio**-2), at, work, active, out)
    by_place, by_velocity = out[STIFFNESS:DAMPING].reshape(4, 4), out[DAMPING:].reshape(4, 4)
    return Film(out[:4], by_place, by_velocity, passes, active, work)


__all__ = ["Film", "film", "journal_grid"]
