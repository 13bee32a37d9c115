"""Derivatives of a film's oil balance by the elastic shapes of the bore and by the motion of the journal.

These follow from the factors of ∂R/∂H computed by :func:`cranktrain.film.elastic.balance.oil_balance`.
"""

from cranktrain.core.kernel import kernel
from cranktrain.core.vectors import LANES, load, store
from cranktrain.film.elastic import grid as at


@kernel
def shape_sources(film, per_gain, nodes, faces, first, block, columns):
    """Compute −∂R/∂δ of eight columns of shapes from column 8 ``block`` on, in ``columns`` (n_phi n_z, 8), band order.

    ``per_gain`` is 1/g, because the rates of the shapes follow from their amplitudes by the stage's rule.
    """
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    lines = n_z + 2
    flux = faces[at.FACE_FLUX]
    start = n_phi * lines
    wanted = 8 * block
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
            own = nodes[at.OWN, q] + per_gain * nodes[at.SQUEEZE, q]
            after = nodes[at.AFTER, q]
            before = nodes[at.BEFORE, q]
            out = flux[i * n_z + j]
            into = flux[up * n_z + j]
            face = start + i * n_z + j
            face_up = start + up * n_z + j
            for half in range(0, 2 * LANES, LANES):
                k = wanted + half
                change = into * load(film.shapes, (face_up, k)) - out * load(film.shapes, (face, k))
                change = change - own * load(film.shapes, (q, k)) - after * load(film.shapes, (q + 1, k))
                store(columns, (position * n_z + j, half), change - before * load(film.shapes, (q - 1, k)))


@kernel
def motion_sources(film, nodes, faces, first, columns):
    """Compute −∂R/∂(x, y, a, b) and −∂R/∂(vx, vy, va, vb), all over the clearance, in ``columns`` (n_phi n_z, 8)."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    lines = n_z + 2
    flux = faces[at.FACE_FLUX]
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        up = i - 1 if i > 0 else n_phi - 1
        cos = film.trig[i, at.COS]
        sin = film.trig[i, at.SIN]
        for j in range(n_z):
            q = i * lines + j + 1
            target = columns[position * n_z + j]
            if film.supply[i * n_z + j] > 0.0:
                for r in range(8):
                    target[r] = 0.0
                continue
            zeta = film.lines[j + 1, at.ZETA]
            own = nodes[at.OWN, q]
            after = nodes[at.AFTER, q]
            before = nodes[at.BEFORE, q]
            out = flux[i * n_z + j]
            into = flux[up * n_z + j]
            # A displacement closes the film, so the shapes of x, y, a, b are −cos φ, −sin φ, −ζ cos φ, −ζ sin φ.
            sides = own + after + before
            tilted = own * zeta + after * film.lines[j + 2, at.ZETA] + before * film.lines[j, at.ZETA]
            by_x = out * film.trig[i, at.FACE_COS] - into * film.trig[up, at.FACE_COS]
            by_y = out * film.trig[i, at.FACE_SIN] - into * film.trig[up, at.FACE_SIN]
            target[at.X] = by_x + sides * cos
            target[at.Y] = by_y + sides * sin
            target[at.A] = by_x * zeta + tilted * cos
            target[at.B] = by_y * zeta + tilted * sin
            squeeze = nodes[at.SQUEEZE, q]
            target[at.V_X] = squeeze * cos
            target[at.V_Y] = squeeze * sin
            target[at.V_A] = squeeze * zeta * cos
            target[at.V_B] = squeeze * zeta * sin
