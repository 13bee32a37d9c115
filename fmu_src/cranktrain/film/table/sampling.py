"""Kernels that sample the film table at one eccentricity, for every direction and tilt, and measure its error.

Tilted films are extrapolated (Richardson) from two axial divisions; their velocities are those of
:mod:`cranktrain.film.table.family`.
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import four
from cranktrain.core.spline import SECOND, VALUE
from cranktrain.film.journal.film import DAMPING, OUT_SIZE, film_observables, journal_film
from cranktrain.film.journal.grid import Motion
from cranktrain.film.table import interpolation as at
from cranktrain.film.table.family import LEVER, turning
from cranktrain.film.table.interpolation import interpolate_aligned, interpolate_tilted, tilted_place, towards
from cranktrain.film.table.reach import reach


@kernel
def sample_aligned(eps, gamma, ratio2, film, out, values):
    """Sample four aligned functions at one eccentricity, in ``values`` (n_γ, 4). The result is negative on failure.

    ``film`` is a JournalFilm, ``out`` (36,) scratch.
    """
    status = 0
    for j in range(gamma.shape[0]):
        cos = math.cos(gamma[j])
        sin = math.sin(gamma[j])
        motion = Motion(eps, 0.0, 0.0, 0.0, cos, sin, 0.0, 0.0)
        if journal_film(film.grid, ratio2, motion, film.work, film.active, out) < 0:
            status = -1
        radial = -(out[0] * cos + out[1] * sin)
        across = -(out[1] * cos - out[0] * sin)
        values[j, at.LN_FORCE] = 0.5 * math.log(radial * radial + across * across)
        values[j, at.TURN] = math.atan2(across, radial)
        highest, flow = film_observables(film.grid, film.work)
        values[j, at.LN_ALIGNED_PRESSURE] = math.log(highest)
        values[j, at.LN_FLOW] = math.log(flow)
    return status


@kernel
def sample_tilted(where, gamma, share, ratio2, coarse, fine, out, values):
    """Sample tilted functions and ln p̂ at one eccentricity, in ``values`` (n_γ, n_t, n_t, 13); negative on failure.

    ``where`` is the eccentricity and the coefficients of the reach that limits possible tilts.

    ``coarse`` and ``fine`` are JournalFilms; ``out`` (72,) receives the results of both films.
    """
    n = share.shape[0]
    eps, ends = where
    reach2, _ = reach(eps, ends)
    rate, _ = turning(eps)
    status = 0
    first = out[:OUT_SIZE]
    second = out[OUT_SIZE:]
    for k in range(n):
        for m in range(n):
            b = share[m] * math.sqrt(reach2 - eps * eps)
            a = share[k] * (math.sqrt(reach2 - b * b) - eps)
            coarse.active[0, 0] = -1.0
            fine.active[0, 0] = -1.0
            for j in range(gamma.shape[0]):
                cos = math.cos(gamma[j])
                sin = math.sin(gamma[j])
                motion = Motion(eps, 0.0, a, b, cos, sin, -sin * rate * b, sin * rate * a)
                if journal_film(coarse.grid, ratio2, motion, coarse.work, coarse.active, first) < 0:
                    status = -1
                if journal_film(fine.grid, ratio2, motion, fine.work, fine.active, second) < 0:
                    status = -1
                for q in range(OUT_SIZE):
                    first[q] = -(second[q] + (second[q] - first[q]) / 3.0)
                value = values[j, k, m]
                _functions(motion, rate, LEVER * rate * eps * share[k], first, value)
                highest, _ = film_observables(fine.grid, fine.work)
                value[at.FUNCTIONS] = math.log(highest)
    return status


@kernel
def _functions(motion, rate, lever, film, value):
    """Compute all functions (FUNCTIONS,) of a tilted film, in ``value``; ``film``: its result, sign reversed."""
    fr, ft, qr, qt = four(film, 0)
    radial = fr * motion.vx + ft * motion.vy
    across = ft * motion.vx - fr * motion.vy
    force = math.sqrt(radial * radial + across * across)
    value[at.LN_FORCE] = math.log(force)
    value[at.TURN] = math.atan2(across, radial)
    value[at.MOMENT_R] = qr / force
    value[at.MOMENT_T] = qt / force
    # R is the damping by w minus the family's slope at the lever.
    for q in range(4):
        by_r, by_t, by_a, by_b = four(film, DAMPING + 4 * q)
        value[at.REST + 2 * q] = (by_a - lever * by_r) / force
        value[at.REST + 2 * q + 1] = (by_b - lever * (by_t + rate * (motion.tx * by_b - motion.ty * by_a))) / force


@kernel
def aligned_errors(solved, eps, gamma, table, out, errors):
    """Compute the table's force error over |F| against films ``solved`` at one eccentricity."""
    for j in range(gamma.shape[0]):
        interpolate_aligned(eps, math.cos(gamma[j]), math.sin(gamma[j]), table, at.LN_FORCE, out)
        size = math.exp(out[VALUE] - solved[j, at.LN_FORCE])
        turn = out[SECOND] - solved[j, at.TURN]
        dx = size * math.cos(turn) - 1.0
        dy = size * math.sin(turn)
        errors[j] = math.sqrt(dx * dx + dy * dy)


@kernel
def tilted_errors(solved, eps, gamma, share, table, scratch, functions, errors):
    """Compute the larger of force error over |F| and moment error over |F| L/2 against films ``solved`` at one ε."""
    n = share.shape[0]
    for k in range(n):
        for m in range(n):
            tilted_place(eps, share[k], share[m], table, scratch)
            for j in range(gamma.shape[0]):
                direction = towards(math.cos(gamma[j]), math.sin(gamma[j]), table)
                interpolate_tilted(direction, table, scratch, functions, False)
                value = functions[0]
                true = solved[j, k, m]
                size = math.exp(value[at.LN_FORCE] - true[at.LN_FORCE])
                turn = value[at.TURN] - true[at.TURN]
                dx = size * math.cos(turn) - 1.0
                dy = size * math.sin(turn)
                mx = size * value[at.MOMENT_R] - true[at.MOMENT_R]
                my = size * value[at.MOMENT_T] - true[at.MOMENT_T]
                errors[j, k, m] = math.sqrt(max(dx * dx + dy * dy, mx * mx + my * my))
