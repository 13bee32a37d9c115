"""Small dense linear algebra without allocation or Python: what the stage solver needs and no more."""

from __future__ import annotations

from cranktrain.kernel import kernel


@kernel
def factor_lu(a, n, pivots):
    """LU-factorise the leading n × n block of ``a`` in place with partial pivoting; 0, or 1 if singular."""
    for k in range(n):
        best = k
        largest = abs(a[k, k])
        for i in range(k + 1, n):
            if abs(a[i, k]) > largest:
                largest = abs(a[i, k])
                best = i
        pivots[k] = best
        if not largest > 0.0:
            return 1
        if best != k:
            for j in range(n):
                a[k, j], a[best, j] = a[best, j], a[k, j]
        inverse = 1.0 / a[k, k]
        for i in range(k + 1, n):
            factor = a[i, k] * inverse
            a[i, k] = factor
            for j in range(k + 1, n):
                a[i, j] -= factor * a[k, j]
    return 0


@kernel
def solve_lu(a, n, pivots, b):
    """Solve with the factors of :func:`factor_lu`, in place on ``b``."""
    for k in range(n):
        p = int(pivots[k])
        if p != k:
            b[k], b[p] = b[p], b[k]
    for i in range(1, n):
        s = b[i]
        for j in range(i):
            s -= a[i, j] * b[j]
        b[i] = s
    for i in range(n - 1, -1, -1):
        s = b[i]
        for j in range(i + 1, n):
            s -= a[i, j] * b[j]
        b[i] = s / a[i, i]


@kernel
def invert(a, n, pivots, column, inverse):
    """Invert the n × n matrix ``a`` (destroyed) into ``inverse``; 0, or 1 if singular."""
    if factor_lu(a, n, pivots) != 0:
        return 1
    for j in range(n):
        for i in range(n):
            column[i] = 0.0
        column[j] = 1.0
        solve_lu(a, n, pivots, column)
        for i in range(n):
            inverse[i, j] = column[i]
    return 0


@kernel
def add_product(transposed, x, rows, columns, y):
    """y += Bᵀ x for B (rows, columns): matrices are kept transposed, so the sum runs over contiguous rows."""
    for i in range(rows):
        factor = x[i]
        if factor != 0.0:
            for j in range(columns):
                y[j] += factor * transposed[i, j]


@kernel
def product(transposed, x, rows, columns, y):
    """y = Bᵀ x for B (rows, columns)."""
    for j in range(columns):
        y[j] = 0.0
    add_product(transposed, x, rows, columns, y)
