"""LU factorisation of band matrices without pivoting, for several right-hand sides at once.

Reynolds' equation on a grid whose axial index runs fastest gives a band as wide as one line of axial nodes, and an
M-matrix by columns, which needs no pivoting. This is the main cost of every film solver. Right-hand sides are stored as
[unknown, right-hand side], so that the inner loops run over them.
"""

from cranktrain.core.kernel import kernel


@kernel
def factor_band(a, n, width):
    """Factor A = L U in place without pivoting; ``a[i, width + k]`` is A[i, i + k]. Returns 0, or 1 at a zero pivot."""
    for j in range(n):
        pivot = a[j, width]
        if pivot == 0.0 or not abs(pivot) < 1.0e300:
            return 1
        last = width if j + width < n else n - 1 - j
        inverse = 1.0 / pivot
        upper = a[j]
        for i in range(1, last + 1):
            row = a[j + i]
            share = row[width - i] * inverse
            row[width - i] = share
            if share != 0.0:
                for k in range(1, last + 1):
                    row[width - i + k] -= share * upper[width + k]
    return 0


@kernel
def solve_band(a, n, width, b):
    """Solve with the factors of :func:`factor_band` for all columns of ``b`` (n, r), in place."""
    columns = b.shape[1]
    for j in range(n):
        first = width if j >= width else j
        here = b[j]
        for i in range(1, first + 1):
            share = a[j, width - i]
            if share != 0.0:
                above = b[j - i]
                for r in range(columns):
                    here[r] -= share * above[r]
    for j in range(n - 1, -1, -1):
        last = width if j + width < n else n - 1 - j
        here = b[j]
        for i in range(1, last + 1):
            share = a[j, width + i]
            if share != 0.0:
                below = b[j + i]
                for r in range(columns):
                    here[r] -= share * below[r]
        inverse = 1.0 / a[j, width]
        for r in range(columns):
            here[r] *= inverse
