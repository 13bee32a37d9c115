"""Band LU factorisation for right-hand sides in blocks of eight, so that inner loops have a fixed length.

The matrix of a film that transports its fill upwind is an M-matrix by columns (positive diagonal, no positive entry
off the diagonal, column sums ≥ 0), so its factors exist without pivoting and stay bounded. Rows of ruptured nodes are
almost empty; zero entries are skipped.

Layout: ``a[i, width + k]`` is A[i, i + k] for k = −width..width, followed by zeros that fill the upper entries to a
multiple of four, see :func:`band_columns`.
"""

from cranktrain.core.kernel import kernel
from cranktrain.core.vectors import LANES, load, store

BLOCK = 8
"""Number of right-hand sides in a block."""


def band_columns(width: int) -> int:
    """Return the row length of the band: lower part, diagonal, and upper part filled to a multiple of four."""
    return width + 1 + 4 * ((width + 3) // 4)


@kernel
def factor_blocks(a, n, width):
    """Factor A = L U in place without pivoting. Return 0, or 1 at a pivot that is not positive."""
    padded = a.shape[1] - width - 1
    for j in range(n):
        pivot = a[j, width]
        if not pivot > 0.0:
            return 1
        inverse = 1.0 / pivot
        a[j, width] = inverse
        reach = 0.0
        for k in range(width + 1, width + 1 + padded):
            reach += abs(a[j, k])
        last = width if j + width < n else n - 1 - j
        if reach == 0.0:
            for i in range(1, last + 1):
                a[j + i, width - i] *= inverse
        elif padded == 2 * LANES:
            # The row of the pivot is kept in local variables, so that it stays in registers.
            near = load(a, (j, width + 1))
            far = load(a, (j, width + 1 + LANES))
            for i in range(1, last + 1):
                share = a[j + i, width - i]
                if share != 0.0:
                    share *= inverse
                    a[j + i, width - i] = share
                    to = width - i + 1
                    store(a, (j + i, to), load(a, (j + i, to)) - share * near)
                    store(a, (j + i, to + LANES), load(a, (j + i, to + LANES)) - share * far)
        else:
            for i in range(1, last + 1):
                share = a[j + i, width - i]
                if share != 0.0:
                    share *= inverse
                    a[j + i, width - i] = share
                    for k in range(0, padded, LANES):
                        to = width - i + 1 + k
                        store(a, (j + i, to), load(a, (j + i, to)) - share * load(a, (j, width + 1 + k)))
    return 0


@kernel
def solve_blocks(a, n, width, b):
    """Solve with the factors of :func:`factor_blocks` for eight right-hand sides ``b`` (n, 8), in place.

    The nearest rows are processed last, because only these depend on the previous row.
    """
    for j in range(n):
        low = load(b, (j, 0))
        high = load(b, (j, LANES))
        for k in range(width - min(j, width), width):
            share = a[j, k]
            if share != 0.0:
                low = low - share * load(b, (j - width + k, 0))
                high = high - share * load(b, (j - width + k, LANES))
        store(b, (j, 0), low)
        store(b, (j, LANES), high)
    for j in range(n - 1, -1, -1):
        low = load(b, (j, 0))
        high = load(b, (j, LANES))
        for i in range(min(width, n - 1 - j), 0, -1):
            share = a[j, width + i]
            if share != 0.0:
                low = low - share * load(b, (j + i, 0))
                high = high - share * load(b, (j + i, LANES))
        store(b, (j, 0), a[j, width] * low)
        store(b, (j, LANES), a[j, width] * high)
