"""Band LU factorisation of the matrices of all lanes, without pivoting, for eight right-hand sides at a time.

The matrix of a film that transports its fill upwind is an M-matrix by columns (positive diagonal, no positive entry
off the diagonal, column sums ≥ 0), so its factors exist without pivoting and stay bounded. Rows of ruptured nodes are
almost empty. Entries that are zero in all lanes are skipped, which does not change the result of any lane.

Layout: entry ``(i, width + k)`` is A[i, i + k] for k = −width..width.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.side_by_side import any_lane, choose, get, minus_product, put

DEAD = 1.0e-25
"""Magnitude below which solutions are set to zero, far below the resolution of single precision."""


@kernel
def factor_lanes(a, n, width, lane, failed):
    """Factor in place, with inverse diagonals. A lane with a pivot that is not positive gets 1 in ``lane[failed]``."""
    bad = get(lane, failed)
    for j in range(n):
        pivot = get(a, (j, width))
        fits = pivot > 0.0
        bad = choose(fits, bad, 1.0)
        inverse = 1.0 / choose(fits, pivot, 1.0)
        put(a, (j, width), inverse)
        last = width if j + width < n else n - 1 - j
        for i in range(1, last + 1):
            share = get(a, (j + i, width - i))
            if any_lane(share != 0.0):
                share = share * inverse
                put(a, (j + i, width - i), share)
                for k in range(1, width + 1):
                    to = width - i + k
                    put(a, (j + i, to), minus_product(get(a, (j + i, to)), share, get(a, (j, width + k))))
    put(lane, failed, bad)


@kernel
def solve_lanes(a, n, width, b, first):
    """Solve with the factors of :func:`factor_lanes` for eight columns of ``b`` (n, ·) from ``first`` on, in place."""
    for j in range(n):
        _row(a, b, first, j, width, (-min(j, width), 0, 1), 1.0)
    for j in range(n - 1, -1, -1):
        _row(a, b, first, j, width, (min(width, n - 1 - j), 0, -1), get(a, (j, width)))


@inlined_kernel
def _row(a, b, r, j, width, others, inverse):
    """Subtract the contributions of rows at the distances ``others`` from row j, and multiply by the inverse pivot."""
    begin, end, step = others
    b0 = get(b, (j, r))
    b1 = get(b, (j, r + 1))
    b2 = get(b, (j, r + 2))
    b3 = get(b, (j, r + 3))
    b4 = get(b, (j, r + 4))
    b5 = get(b, (j, r + 5))
    b6 = get(b, (j, r + 6))
    b7 = get(b, (j, r + 7))
    for away in range(begin, end, step):
        share = get(a, (j, width + away))
        if any_lane(share != 0.0):
            to = j + away
            b0 = minus_product(b0, share, get(b, (to, r)))
            b1 = minus_product(b1, share, get(b, (to, r + 1)))
            b2 = minus_product(b2, share, get(b, (to, r + 2)))
            b3 = minus_product(b3, share, get(b, (to, r + 3)))
            b4 = minus_product(b4, share, get(b, (to, r + 4)))
            b5 = minus_product(b5, share, get(b, (to, r + 5)))
            b6 = minus_product(b6, share, get(b, (to, r + 6)))
            b7 = minus_product(b7, share, get(b, (to, r + 7)))
    put(b, (j, r), _flushed(inverse * b0))
    put(b, (j, r + 1), _flushed(inverse * b1))
    put(b, (j, r + 2), _flushed(inverse * b2))
    put(b, (j, r + 3), _flushed(inverse * b3))
    put(b, (j, r + 4), _flushed(inverse * b4))
    put(b, (j, r + 5), _flushed(inverse * b5))
    put(b, (j, r + 6), _flushed(inverse * b6))
    put(b, (j, r + 7), _flushed(inverse * b7))


@inlined_kernel
def _flushed(value):
    """Replace values below ``DEAD`` by zero, because processors are slow with denormal numbers."""
    return choose((value > DEAD) | (value < -DEAD), value, 0.0)
