"""Band LU for right-hand sides in blocks of eight: the inner loops have a length the compiler knows.

The matrix of a film that transports its fill upwind is an M-matrix by columns (positive diagonal, no positive entry
beside it, column sums ≥ 0), so its factors exist without pivoting and stay bounded. Rows of ruptured nodes are almost
empty; empty places are skipped.

Layout: ``a[i, width + k]`` is A[i, i + k] for k = −width..width; behind it zeros up to a multiple of four upper
entries, see :func:`band_columns`.
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import add_eight, eight, four, minus, put_eight, put_four, scale_eight, scaled

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
                put_four(row, to, minus(four(row, to), scaled(share, four(upper, width + 1 + k))))
    return 0


@kernel
def solve_blocks(a, n, width, b):
    """Solve with the factors of :func:`factor_blocks` for eight right-hand sides ``b`` (n, 8), in place."""
    for j in range(n):
        first = width if j >= width else j
        total = eight(b[j], 0)
        for i in range(1, first + 1):
            share = a[j, width - i]
            if share != 0.0:
                total = add_eight(total, -share, eight(b[j - i], 0))
        put_eight(b[j], 0, total)
    for j in range(n - 1, -1, -1):
        last = width if j + width < n else n - 1 - j
        total = eight(b[j], 0)
        for i in range(1, last + 1):
            share = a[j, width + i]
            if share != 0.0:
                total = add_eight(total, -share, eight(b[j + i], 0))
        put_eight(b[j], 0, scale_eight(a[j, width], total))
