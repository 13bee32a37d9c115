"""Small dense linear algebra without allocation or Python: what the stage solver needs and no more."""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.core.vectors import eliminate_1x1, eliminate_1x4, eliminate_4x4, eliminate_column


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
def invert(a, n, pivots, row, inverse):
    """Invert the n × n matrix ``a`` (destroyed) into ``inverse``; 0, or 1 if singular. ``row`` (n,) is scratch.

    All columns of the inverse are solved for together, row by row: contiguous, so that the first step after a start or
    at another length takes no longer than a hard one.
    """
    if factor_lu(a, n, pivots) != 0:
        return 1
    for i in range(n):
        for j in range(n):
            inverse[i, j] = 0.0
        inverse[i, i] = 1.0
    for k in range(n):
        p = int(pivots[k])
        if p != k:
            for j in range(n):
                inverse[k, j], inverse[p, j] = inverse[p, j], inverse[k, j]
    for i in range(1, n):
        for k in range(i):
            row[k] = -a[i, k]
        add_product(inverse, row, i, n, inverse[i])
    for i in range(n - 1, -1, -1):
        behind = n - 1 - i
        for k in range(behind):
            row[k] = -a[i, i + 1 + k]
        add_product(inverse[i + 1 :], row, behind, n, inverse[i])
        scale = 1.0 / a[i, i]
        for j in range(n):
            inverse[i, j] *= scale
    return 0


@kernel
def factor_rows(a, n):
    """LU-factorise the leading n × n block in place, row by row without pivoting; 0, or 1 if a pivot vanishes.

    For the stage's I − H J: H and −J have positive definite symmetric parts, so pivots stay away from zero. Four pivots
    are subtracted from four rows at once, each product rounded by itself and in order: the bits are those of the plain
    loop over pivots. The diagonal is kept inverted.
    """
    i = 0
    while i < n:
        height = 4 if i + 3 < n else 1
        k = 0
        while k + 3 < i:
            for r in range(i, i + height):
                f0 = a[r, k] * a[k, k]
                f1 = (a[r, k + 1] - f0 * a[k, k + 1]) * a[k + 1, k + 1]
                f2 = (a[r, k + 2] - f0 * a[k, k + 2] - f1 * a[k + 1, k + 2]) * a[k + 2, k + 2]
                f3 = (a[r, k + 3] - f0 * a[k, k + 3] - f1 * a[k + 1, k + 3] - f2 * a[k + 2, k + 3]) * a[k + 3, k + 3]
                a[r, k] = f0
                a[r, k + 1] = f1
                a[r, k + 2] = f2
                a[r, k + 3] = f3
            j = k + 4
            while j + 3 < n:
                if height == 4:
                    eliminate_4x4(a, i, k, j)
                else:
                    eliminate_1x4(a, i, k, j)
                j += 4
            for c in range(j, n):
                if height == 4:
                    eliminate_column(a, i, k, c)
                else:
                    a[i, c] = (
                        a[i, c]
                        - a[i, k] * a[k, c]
                        - a[i, k + 1] * a[k + 1, c]
                        - a[i, k + 2] * a[k + 2, c]
                        - a[i, k + 3] * a[k + 3, c]
                    )
            k += 4
        for r in range(i, i + height):
            for p in range(k, r):
                f0 = a[r, p] * a[p, p]
                a[r, p] = f0
                j = p + 1
                while j + 3 < n:
                    eliminate_1x1(a, r, p, j)
                    j += 4
                for c in range(j, n):
                    a[r, c] -= f0 * a[p, c]
            if not abs(a[r, r]) > 1.0e-9:
                return 1
            a[r, r] = 1.0 / a[r, r]
        i += height
    return 0


@kernel
def solve_rows(a, n, b):
    """Solve Aᵀ x = b with the factors of A by :func:`factor_rows`, in place on ``b``.

    The transposed system, because it walks along rows both ways; callers keep their matrix transposed.
    """
    for j in range(n):
        s = b[j] * a[j, j]
        b[j] = s
        for i in range(j + 1, n):
            b[i] -= a[j, i] * s
    for j in range(n - 1, 0, -1):
        s = b[j]
        for i in range(j):
            b[i] -= a[j, i] * s


@kernel
def add_product(transposed, x, rows, columns, y):
    """y += Bᵀ x for B (rows, columns): kept transposed, so that the sum runs over contiguous rows, four at once."""
    i = 0
    while i + 3 < rows:
        x0 = x[i]
        x1 = x[i + 1]
        x2 = x[i + 2]
        x3 = x[i + 3]
        for j in range(columns):
            y[j] += (
                x0 * transposed[i, j]
                + x1 * transposed[i + 1, j]
                + x2 * transposed[i + 2, j]
                + x3 * transposed[i + 3, j]
            )
        i += 4
    while i < rows:
        x0 = x[i]
        for j in range(columns):
            y[j] += x0 * transposed[i, j]
        i += 1


@kernel
def product(transposed, x, rows, columns, y):
    """y = Bᵀ x for B (rows, columns)."""
    for j in range(columns):
        y[j] = 0.0
    add_product(transposed, x, rows, columns, y)
