"""Band LU factorisation of eight matrices in lanes, without pivoting, for eight right-hand sides each.

Each lane computes the same as :mod:`cranktrain.film.elastic.band_blocks` for one matrix. Entries that are zero in all
lanes are skipped, which does not change the result of any lane.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.singles import all_eight, any_lane, choose, eight, minus_product, put_eight

DEAD = 1.0e-25
"""Magnitude below which solutions are set to zero, far below the resolution of single precision."""


@kernel
def factor_lanes(a, n, width, lane, failed):
    """Factor in place, with inverse diagonals. A lane with a pivot that is not positive gets 1 in ``lane[failed]``."""
    bad = eight(lane, failed)
    for j in range(n):
        pivot = eight(a, (j, width))
        fits = pivot > 0.0
        bad = choose(fits, bad, all_eight(1.0))
        inverse = 1.0 / choose(fits, pivot, all_eight(1.0))
        put_eight(a, (j, width), inverse)
        last = width if j + width < n else n - 1 - j
        for i in range(1, last + 1):
            share = eight(a, (j + i, width - i))
            if any_lane(share != 0.0):
                share = share * inverse
                put_eight(a, (j + i, width - i), share)
                for k in range(1, width + 1):
                    to = width - i + k
                    put_eight(a, (j + i, to), minus_product(eight(a, (j + i, to)), share, eight(a, (j, width + k))))
    put_eight(lane, failed, bad)


@kernel
def solve_lanes(a, n, width, b):
    """Solve with the factors of :func:`factor_lanes` for eight right-hand sides ``b`` (n, 8 × 8), in place."""
    for j in range(n):
        _row(a, b, j, width, (-min(j, width), 0, 1), all_eight(1.0))
    for j in range(n - 1, -1, -1):
        _row(a, b, j, width, (min(width, n - 1 - j), 0, -1), eight(a, (j, width)))


@inlined_kernel
def _row(a, b, j, width, others, inverse):
    """Subtract the contributions of rows at the distances ``others`` from row j, and multiply by the inverse pivot."""
    first, end, step = others
    b0 = eight(b, (j, 0))
    b1 = eight(b, (j, 1))
    b2 = eight(b, (j, 2))
    b3 = eight(b, (j, 3))
    b4 = eight(b, (j, 4))
    b5 = eight(b, (j, 5))
    b6 = eight(b, (j, 6))
    b7 = eight(b, (j, 7))
    for away in range(first, end, step):
        share = eight(a, (j, width + away))
        if any_lane(share != 0.0):
            to = j + away
            b0 = minus_product(b0, share, eight(b, (to, 0)))
            b1 = minus_product(b1, share, eight(b, (to, 1)))
            b2 = minus_product(b2, share, eight(b, (to, 2)))
            b3 = minus_product(b3, share, eight(b, (to, 3)))
            b4 = minus_product(b4, share, eight(b, (to, 4)))
            b5 = minus_product(b5, share, eight(b, (to, 5)))
            b6 = minus_product(b6, share, eight(b, (to, 6)))
            b7 = minus_product(b7, share, eight(b, (to, 7)))
    _put(
        b,
        j,
        (
            inverse * b0,
            inverse * b1,
            inverse * b2,
            inverse * b3,
            inverse * b4,
            inverse * b5,
            inverse * b6,
            inverse * b7,
        ),
    )


@kernel
def _put(b, j, row):
    """Write the eight right-hand sides of a row."""
    b0, b1, b2, b3, b4, b5, b6, b7 = row
    put_eight(b, (j, 0), _flushed(b0))
    put_eight(b, (j, 1), _flushed(b1))
    put_eight(b, (j, 2), _flushed(b2))
    put_eight(b, (j, 3), _flushed(b3))
    put_eight(b, (j, 4), _flushed(b4))
    put_eight(b, (j, 5), _flushed(b5))
    put_eight(b, (j, 6), _flushed(b6))
    put_eight(b, (j, 7), _flushed(b7))


@inlined_kernel
def _flushed(value):
    """Replace values below ``DEAD`` by zero, because processors are slow with denormal numbers."""
    return choose((value > DEAD) | (value < -DEAD), value, all_eight(0.0))
