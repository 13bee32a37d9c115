"""Transformations of elastic films between the axes of the frame (journals) and of the bore."""

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import four
from cranktrain.film.elastic.grid import CLEARANCE, DAMPING, N_PHI, N_SHAPES, N_Z, PROFILE, STIFFNESS, ZETA
from cranktrain.film.elastic.grid import COS as COS_NODE
from cranktrain.film.elastic.grid import SIN as SIN_NODE


@kernel
def turn_pairs(cos, sin, vector, out):
    """Rotate the two plane vectors in ``vector`` (4,) by the angle of the given cosine and sine."""
    for pair in range(0, 4, 2):
        x = vector[pair]
        y = vector[pair + 1]
        out[pair] = cos * x - sin * y
        out[pair + 1] = sin * x + cos * y


@kernel
def force_in_frame(result, cos, sin, turn, out):
    """Transform force and tangents of a film's ``result`` to the axes of the frame, ``out[0:36]``.

    ``turn`` is the speed of the bore's axes, rad/s: velocities in them are v − turn e_z×x.
    """
    turn_pairs(cos, -sin, result, out)
    for part in range(2):
        o = STIFFNESS if part == 0 else DAMPING
        for r in range(0, 4, 2):
            for s in range(0, 4, 2):
                k = o + 4 * r + s
                xx = result[k]
                xy = result[k + 1]
                yx = result[k + 4]
                yy = result[k + 5]
                # Each block of the tangents is rotated by columns first, then by rows.
                a = xx * cos + xy * sin
                b = xy * cos - xx * sin
                c = yx * cos + yy * sin
                d = yy * cos - yx * sin
                out[k] = cos * a + sin * c
                out[k + 1] = cos * b + sin * d
                out[k + 4] = cos * c - sin * a
                out[k + 5] = cos * d - sin * b
    if turn != 0.0:
        for r in range(4):
            for s in range(0, 4, 2):
                k = 4 * r + s
                out[STIFFNESS + k] -= turn * out[DAMPING + k + 1]
                out[STIFFNESS + k + 1] += turn * out[DAMPING + k]


@kernel
def closing_rate(film, place, velocity, shapes, rates, least):
    """Return the largest relative rate of film thinning, −ḣ/max(h, ``least``) with ``least`` in m, 1/s."""
    c = film.constants[CLEARANCE]
    lines = int(film.constants[N_Z]) + 2
    n_shapes = int(film.constants[N_SHAPES])
    x, y, a, b = four(place, 0)
    vx, vy, va, vb = four(velocity, 0)
    worst = 0.0
    for i in range(int(film.constants[N_PHI])):
        cos = film.trig[i, COS_NODE]
        sin = film.trig[i, SIN_NODE]
        for line in range(lines):
            q = i * lines + line
            zeta = film.lines[line, ZETA]
            h = c * (1.0 + film.lines[line, PROFILE]) - (x + zeta * a) * cos - (y + zeta * b) * sin
            rate = (vx + zeta * va) * cos + (vy + zeta * vb) * sin
            for k in range(n_shapes):
                h += shapes[k] * film.shapes[q, k + 1]
                rate -= rates[k] * film.shapes[q, k + 1]
            worst = max(worst, rate / max(h, least))
    return worst
