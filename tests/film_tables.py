"""The coarse film table that tests share, its law in clearances, and films to compare with."""

import math
from functools import cache

import numpy as np

from cranktrain.core.cache import cache_folder
from cranktrain.core.sources import source_digest
from cranktrain.film.journal.film import OUT_SIZE, journal_film
from cranktrain.film.journal.grid import Motion, cold_start, journal_work
from cranktrain.film.table import database
from cranktrain.film.table.database import TableSettings, table_grid
from cranktrain.film.table.family import CENTRED_TURN
from cranktrain.film.table.interpolation import TILT_STRETCH
from cranktrain.film.table.law import Tabled, table_force
from cranktrain.film.table.reach import reach
from cranktrain.film.table.tilted import table_work
from cranktrain.store.film_tables import film_table
from cranktrain.structure import assembly

try:
    import fcntl
except ImportError:
    fcntl = None

RATIO = 0.35
SETTINGS = TableSettings(RATIO, resolution="coarse", relief_depth=0.15, roughness=0.01)
GRID = table_grid(SETTINGS)
FILM, MEMORY = journal_work(GRID), table_work()


def coarse_mains(patch):
    """Let main bearings have coarse tables, which are made in seconds; ``patch`` is a ``pytest.MonkeyPatch``."""
    table = assembly.main_table
    patch.setattr(assembly, "main_table", lambda engine, say, resolution: table(engine, say, "coarse"))


@cache
def coarse_table():
    """The coarse table, built once for all tests and workers, and anew where sources of films have changed."""
    folder = cache_folder() / "films" / f"of_tests_{source_digest(database.__file__)}"
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as stream:
        if fcntl is not None:
            fcntl.flock(stream, fcntl.LOCK_EX)
        return film_table(SETTINGS, folder / "coarse.h5")[0]


def law(table, state, half_speed=0.0, clearance=1.0, factor=1.0, grid=GRID):
    """Output and status of the law at (x, y, ax, ay, vx, vy, wx, wy), in clearances unless told otherwise."""
    out = np.zeros(40)
    place, velocity = clearance * np.asarray(state, dtype=float).reshape(2, 4)
    film = FILM if grid is GRID else journal_work(grid)
    tabled = Tabled(table.arrays, grid, film, cold_start(grid), MEMORY)
    status = table_force(place, velocity, half_speed, clearance, factor, tabled, out, True)
    return out, status


def place(eps, angle, share_a, share_b):
    """Position and tilt, and the axes along and across the line of centres."""
    reach2, _ = reach(eps, SETTINGS.ends())
    b = share_b * math.sqrt(reach2 - eps * eps)
    a = share_a * (math.sqrt(reach2 - b * b) - eps)
    along = np.array([math.cos(angle), math.sin(angle)])
    across = np.array([-along[1], along[0]])
    return eps * along, a * along + b * across, along, across


def family(eps, angle, share_a, share_b, gamma):
    """State on the family of velocities that the table samples."""
    e, t, along, across = place(eps, angle, share_a, share_b)
    v = math.cos(gamma) * along + math.sin(gamma) * across
    rate = eps**3 / (eps**4 + CENTRED_TURN**4) * math.sin(gamma)
    return np.concatenate([e, t, v, rate * np.array([-t[1], t[0]])])


def solved(state, grids, length_ratio=RATIO):
    """Force and moments of the film itself, extrapolated from two grids whose axial intervals differ by two."""
    outs = []
    for grid in grids:
        out = np.zeros(OUT_SIZE)
        assert journal_film(grid, length_ratio**-2, Motion(*state), journal_work(grid), cold_start(grid), out) > 0
        outs.append(out[:4])
    return outs[1] + (outs[1] - outs[0]) / 3


def differences(force, state, steps):
    """Derivatives of ``force`` by fourth-order differences, one column for each component of ``state``."""
    slopes = []
    for move in np.diag(steps):
        near, far = (force(state + k * move) - force(state - k * move) for k in (1, 2))
        slopes.append((8 * near - far) / (12 * move.sum()))
    return np.array(slopes).T


def tangents(out):
    """Slopes (4, 8) of the law's output by place, tilt and both their rates."""
    return np.concatenate([out[4:20].reshape(4, 4), out[20:36].reshape(4, 4)], axis=1)


def apart(tangent, slopes):
    """Differences (., .) of tangents to slopes by differences, by place and by velocity over their largest ones."""
    blocks = np.split(np.arange(tangent.shape[1]), 2)
    return [np.abs(tangent - slopes)[:, block] / np.abs(tangent[:, block]).max() for block in blocks]


def crosses(state, steps):
    """Whether a difference step may leave the cell of a tilt axis."""

    def cell(s):
        e, t = s[:2], s[2:4]
        eps = math.hypot(*e)
        a, b = t @ e / eps, (t[1] * e[0] - t[0] * e[1]) / eps
        reach2, _ = reach(eps, SETTINGS.ends())
        shares = (
            abs(a) / (math.sqrt(reach2 - b * b) - eps),
            abs(b) / math.sqrt(reach2 - eps * eps),
        )
        q, n = TILT_STRETCH, SETTINGS.shape[2] - 1
        return [int(math.atanh(q * s / SETTINGS.tilt_range) / math.atanh(q) * n + 0.5) for s in shares]

    return any(cell(state + k * move) != cell(state) for move in np.diag(steps)[:4] for k in (-2, 2))


def path_across(table, states):
    """Largest jump of force and of tangents between neighbours, over their size."""
    outs = np.array([law(table, state)[0][:36] for state in states])
    jump = np.abs(np.diff(outs, axis=0))
    return [jump[:, part].max() / np.abs(outs[:, part]).max() for part in (slice(0, 4), slice(4, 20), slice(20, 36))]
