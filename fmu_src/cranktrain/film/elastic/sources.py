"""Derivatives of a film's balance of oil by what moves its surfaces: the bore's elastic shapes and the journal.

They follow from the factors of ∂R/∂H that :func:`cranktrain.film.elastic.balance.oil_balance` leaves behind.
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.core.vectors import LANES, load, store
from cranktrain.film.elastic.grid import (
    AFTER,
    BEFORE,
    COS,
    FACE_COS,
    FACE_FLUX,
    FACE_SIN,
    N_PHI,
    N_Z,
    OWN,
    SIN,
    SQUEEZE,
    V_A,
    V_B,
    V_X,
    V_Y,
    ZETA,
    A,
    B,
    X,
    Y,
)


@kernel
def shape_sources(film, per_gain, nodes, faces, first, block, columns):
    """−∂R/∂δ of eight columns of shapes, from column 8 ``block`` on, into ``columns`` (n_phi n_z, 8), in band order.

    ``per_gain`` 1/g: the shapes' velocities follow their amplitudes by the stage's own rule.
    """
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    flux = faces[FACE_FLUX]
    start = n_phi * lines
    at = 8 * block
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        up = i - 1 if i > 0 else n_phi - 1
        for j in range(n_z):
            q = i * lines + j + 1
            if film.supply[i * n_z + j] > 0.0:
                for r in range(8):
                    columns[position * n_z + j, r] = 0.0
                continue
            own = nodes[OWN, q] + per_gain * nodes[SQUEEZE, q]
            after = nodes[AFTER, q]
            before = nodes[BEFORE, q]
            out = flux[i * n_z + j]
            into = flux[up * n_z + j]
            face = start + i * n_z + j
            face_up = start + up * n_z + j
            for half in range(0, 2 * LANES, LANES):
                k = at + half
                change = into * load(film.shapes, (face_up, k)) - out * load(film.shapes, (face, k))
                change = change - own * load(film.shapes, (q, k)) - after * load(film.shapes, (q + 1, k))
                store(columns, (position * n_z + j, half), change - before * load(film.shapes, (q - 1, k)))


@kernel
def motion_sources(film, nodes, faces, first, columns):
    """−∂R/∂(x, y, a, b) and −∂R/∂(vx, vy, va, vb), all over the clearance, into ``columns`` (n_phi n_z, 8)."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    flux = faces[FACE_FLUX]
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        up = i - 1 if i > 0 else n_phi - 1
        cos = film.trig[i, COS]
        sin = film.trig[i, SIN]
        for j in range(n_z):
            q = i * lines + j + 1
            target = columns[position * n_z + j]
            if film.supply[i * n_z + j] > 0.0:
                for r in range(8):
                    target[r] = 0.0
                continue
            zeta = film.lines[j + 1, ZETA]
            own = nodes[OWN, q]
            after = nodes[AFTER, q]
            before = nodes[BEFORE, q]
            out = flux[i * n_z + j]
            into = flux[up * n_z + j]
            # A displacement closes the film: the shapes of x, y, a, b are −cos φ, −sin φ, −ζ cos φ, −ζ sin φ.
            sides = own + after + before
            tilted = own * zeta + after * film.lines[j + 2, ZETA] + before * film.lines[j, ZETA]
            by_x = out * film.trig[i, FACE_COS] - into * film.trig[up, FACE_COS]
            by_y = out * film.trig[i, FACE_SIN] - into * film.trig[up, FACE_SIN]
            target[X] = by_x + sides * cos
            target[Y] = by_y + sides * sin
            target[A] = by_x * zeta + tilted * cos
            target[B] = by_y * zeta + tilted * sin
            squeeze = nodes[SQUEEZE, q]
            target[V_X] = squeeze * cos
            target[V_Y] = squeeze * sin
            target[V_A] = squeeze * zeta * cos
            target[V_B] = squeeze * zeta * sin


@kernel
def past_sources(film, per_gain, nodes, first, block, columns):
    """−∂R/∂Δ of eight columns of shapes, from column 8 ``block`` on, into ``columns`` (n_phi n_z, 8), in band order.

    Δ moves no surface. It acts only through δ̇ = (δ − Δ)/g, with ``per_gain`` 1/g.
    """
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        for j in range(n_z):
            q = i * (n_z + 2) + j + 1
            # Supply nodes have no squeeze.
            squeeze = per_gain * nodes[SQUEEZE, q]
            for half in range(0, 2 * LANES, LANES):
                store(columns, (position * n_z + j, half), squeeze * load(film.shapes, (q, 8 * block + half)))
