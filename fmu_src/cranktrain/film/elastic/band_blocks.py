"""Band LU for right-hand sides in blocks of eight: the inner loops have a length the compiler knows.

The matrix of a film that transports its fill upwind is an M-matrix by columns (positive diagonal, no positive entry
beside it, column sums ≥ 0), so its factors exist without pivoting and stay bounded. Rows of ruptured nodes are almost
empty; empty places are skipped.

Layout: ``a[i, width + k]`` is A[i, i + k] for k = −width..width; behind it zeros up to a multiple of four upper
entries, see :func:`band_columns`.
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel

BLOCK = 8
"""Right-hand sides side by side."""


def band_columns(width: int) -> int:
    """Length of one row of the band: lower part, diagonal, and the upper part filled up to a multiple of four."""
    return width + 1 + 4 * ((width + 3) // 4)


@kernel
def factor_blocks(a, n, width):
    """Factor A = L U in place without pivoting; returns 0, or 1 at a pivot that is not positive."""
    padded = a.shape[1] - width - 1
    for j in range(n):
        upper = a[j]
        pivot = upper[width]
        if not pivot > 0.0:
            return 1
        inverse = 1.0 / pivot
        upper[width] = inverse
        reach = 0.0
        for k in range(width + 1, width + 1 + padded):
            reach += abs(upper[k])
        last = width if j + width < n else n - 1 - j
        for i in range(1, last + 1):
            row = a[j + i]
            share = row[width - i]
            if share == 0.0:
                continue
            share *= inverse
            row[width - i] = share
            if reach == 0.0:
                continue
            for k in range(0, padded, 4):
                to = width - i + 1 + k
                at = width + 1 + k
                c0 = row[to] - share * upper[at]
                c1 = row[to + 1] - share * upper[at + 1]
                c2 = row[to + 2] - share * upper[at + 2]
                c3 = row[to + 3] - share * upper[at + 3]
                row[to] = c0
                row[to + 1] = c1
                row[to + 2] = c2
                row[to + 3] = c3
    return 0


@kernel
def solve_blocks(a, n, width, b):
    """Solve with the factors of :func:`factor_blocks` for eight right-hand sides ``b`` (n, 8), in place."""
    for j in range(n):
        first = width if j >= width else j
        here = b[j]
        c0 = here[0]
        c1 = here[1]
        c2 = here[2]
        c3 = here[3]
        c4 = here[4]
        c5 = here[5]
        c6 = here[6]
        c7 = here[7]
        for i in range(1, first + 1):
            share = a[j, width - i]
            if share != 0.0:
                above = b[j - i]
                c0 -= share * above[0]
                c1 -= share * above[1]
                c2 -= share * above[2]
                c3 -= share * above[3]
                c4 -= share * above[4]
                c5 -= share * above[5]
                c6 -= share * above[6]
                c7 -= share * above[7]
        here[0] = c0
        here[1] = c1
        here[2] = c2
        here[3] = c3
        here[4] = c4
        here[5] = c5
        here[6] = c6
        here[7] = c7
    for j in range(n - 1, -1, -1):
        last = width if j + width < n else n - 1 - j
        here = b[j]
        c0 = here[0]
        c1 = here[1]
        c2 = here[2]
        c3 = here[3]
        c4 = here[4]
        c5 = here[5]
        c6 = here[6]
        c7 = here[7]
        for i in range(1, last + 1):
            share = a[j, width + i]
            if share != 0.0:
                below = b[j + i]
                c0 -= share * below[0]
                c1 -= share * below[1]
                c2 -= share * below[2]
                c3 -= share * below[3]
                c4 -= share * below[4]
                c5 -= share * below[5]
                c6 -= share * below[6]
                c7 -= share * below[7]
        inverse = a[j, width]
        here[0] = c0 * inverse
        here[1] = c1 * inverse
        here[2] = c2 * inverse
        here[3] = c3 * inverse
        here[4] = c4 * inverse
        here[5] = c5 * inverse
        here[6] = c6 * inverse
        here[7] = c7 * inverse
