"""Kernels that make the film table: films of one eccentricity at every direction and tilt, and the table's error there.

Tilted films are extrapolated (Richardson) from two axial divisions; their velocities are those of
:mod:`cranktrain.film.table.family`.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel
from cranktrain.film.journal.film import DAMPING, OUT_SIZE, film_observables, journal_film
from cranktrain.film.table.family import LEVER, turning
from cranktrain.film.table.interpolation import (
    FUNCTIONS,
    LN_ALIGNED_PRESSURE,
    LN_FLOW,
    LN_FORCE,
    MOMENT_R,
    MOMENT_T,
    REST,
    TURN,
    interpolate_aligned,
    interpolate_tilted,
    tilted_place,
)


@kernel
def sample_aligned(eps, gamma, ratio2, grid, work, active, out, values):
    """Solve the aligned table's four functions at one eccentricity, (n_γ, 4); negative where a film failed."""
    status = 0
    for j in range(gamma.shape[0]):
        cos = math.cos(gamma[j])
        sin = math.sin(gamma[j])
        if journal_film(grid, ratio2, eps, 0.0, 0.0, 0.0, cos, sin, 0.0, 0.0, work, active, out) < 0:
            status = -1
        radial = -(out[0] * cos + out[1] * sin)
        across = -(out[1] * cos - out[0] * sin)
        values[j, LN_FORCE] = 0.5 * math.log(radial * radial + across * across)
        values[j, TURN] = math.atan2(across, radial)
        highest, flow = film_observables(grid, work)
        values[j, LN_ALIGNED_PRESSURE] = math.log(highest)
        values[j, LN_FLOW] = math.log(flow)
    return status


@kernel
def sample_tilted(
    eps, gamma, share, ratio2, coarse, coarse_work, coarse_active, fine, fine_work, fine_active, out, values
):
    """Solve all functions and ln p̂ at one eccentricity, ``values`` (n_γ, n_t, n_t, 13); negative where a film failed.

    ``out`` (72,) holds the results of both films.
    """
    n = share.shape[0]
    rate, _ = turning(eps)
    status = 0
    first = out[:OUT_SIZE]
    second = out[OUT_SIZE:]
    for k in range(n):
        for m in range(n):
            b = share[m] * math.sqrt(1.0 - eps * eps)
            a = share[k] * (math.sqrt(1.0 - b * b) - eps)
            coarse_active[0, 0] = -1.0
            fine_active[0, 0] = -1.0
            for j in range(gamma.shape[0]):
                cos = math.cos(gamma[j])
                sin = math.sin(gamma[j])
                wx = -sin * rate * b
                wy = sin * rate * a
                if (
                    journal_film(coarse, ratio2, eps, 0.0, a, b, cos, sin, wx, wy, coarse_work, coarse_active, first)
                    < 0
                ):
                    status = -1
                if journal_film(fine, ratio2, eps, 0.0, a, b, cos, sin, wx, wy, fine_work, fine_active, second) < 0:
                    status = -1
                for q in range(OUT_SIZE):
                    first[q] = -(second[q] + (second[q] - first[q]) / 3.0)
                radial = first[0] * cos + first[1] * sin
                across = first[1] * cos - first[0] * sin
                force = math.sqrt(radial * radial + across * across)
                value = values[j, k, m]
                value[LN_FORCE] = math.log(force)
                value[TURN] = math.atan2(across, radial)
                value[MOMENT_R] = first[2] / force
                value[MOMENT_T] = first[3] / force
                # R: what the damping by w has more than the family's slope at the lever.
                lever = LEVER * rate * eps * share[k]
                for q in range(4):
                    row = DAMPING + 4 * q
                    by_r = first[row]
                    by_t = first[row + 1] + rate * (a * first[row + 3] - b * first[row + 2])
                    value[REST + 2 * q] = (first[row + 2] - lever * by_r) / force
                    value[REST + 2 * q + 1] = (first[row + 3] - lever * by_t) / force
                highest, _ = film_observables(fine, fine_work)
                value[FUNCTIONS] = math.log(highest)
    return status


@kernel
def aligned_errors(solved, eps, gamma, table, out, errors):
    """Force error over |F| of the films ``solved`` at one eccentricity."""
    for j in range(gamma.shape[0]):
        interpolate_aligned(eps, math.cos(gamma[j]), math.sin(gamma[j]), table, 0, out)
        size = math.exp(out[0] - solved[j, 0])
        turn = out[3] - solved[j, 1]
        dx = size * math.cos(turn) - 1.0
        dy = size * math.sin(turn)
        errors[j] = math.sqrt(dx * dx + dy * dy)


@kernel
def tilted_errors(solved, eps, gamma, share, table, scratch, functions, errors):
    """The larger of force error over |F| and moment error over |F| L/2 of the films ``solved`` at one eccentricity."""
    n = share.shape[0]
    for k in range(n):
        for m in range(n):
            tilted_place(eps, share[k], share[m], table, scratch)
            for j in range(gamma.shape[0]):
                interpolate_tilted(math.cos(gamma[j]), math.sin(gamma[j]), table, scratch, functions)
                value = functions[0]
                true = solved[j, k, m]
                size = math.exp(value[0] - true[0])
                turn = value[1] - true[1]
                dx = size * math.cos(turn) - 1.0
                dy = size * math.sin(turn)
                mx = size * value[2] - true[2]
                my = size * value[3] - true[3]
                errors[j, k, m] = math.sqrt(max(dx * dx + dy * dy, mx * mx + my * my))
