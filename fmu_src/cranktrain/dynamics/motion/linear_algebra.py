"""Small dense linear algebra for the stage solver, as kernels without allocation."""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.vectors import LANES, load, store, subtract_1x4, subtract_4x4, subtract_column, unpack


@kernel
def factor_lu(a, n, pivots):
    """LU-factorise the leading n × n block of ``a`` in place, with partial pivoting. Return 0, or 1 if singular."""
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
    """Solve A x = b with the factors of A from :func:`factor_lu`, in place on ``b``."""
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
def factor_rows(a, n):
    """LU-factorise the leading n × n block in place without pivoting. Return 0, or 1 if a pivot vanishes.

    Made for the stage's I − H J: H and −J have positive definite symmetric parts, so pivots stay away from zero. Four
    pivots are made, then subtracted from all rows below, four rows at once, which are independent. Each product is
    rounded by itself and in order, so the result is bitwise that of a plain loop. The diagonal is kept inverted.
    """
    return factor_by_fours(a, n, False)


@kernel
def factor_sparse_rows(a, n):
    """LU-factorise a matrix with many zeros without pivoting; rows that four pivots do not change are skipped."""
    return factor_by_fours(a, n, True)


@inlined_kernel
def factor_by_fours(a, n, sparse):
    """LU-factorise by four pivots at a time; if ``sparse``, rows that would not change are skipped."""
    k = 0
    while k + 3 < n:
        if factor_block(a, n, k, k + 4) != 0:
            return 1
        i = k + 4
        while i < n:
            height = 4 if i + 3 < n else 1
            if not sparse or reaches(a, i, height, k):
                eliminate(a, n, i, height, k)
            i += height
        k += 4
    return factor_block(a, n, k, n)


@inlined_kernel
def reaches(a, i, height, k):
    """True if four pivots from k on change the ``height`` rows from i on."""
    size = 0.0
    for r in range(i, i + height):
        size += abs(a[r, k]) + abs(a[r, k + 1]) + abs(a[r, k + 2]) + abs(a[r, k + 3])
    return size != 0.0


@inlined_kernel
def eliminate(a, n, i, height, k):
    """Subtract the four pivots from k on from the ``height`` rows (4 or 1) from i on."""
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
    if height == 4:
        while j + 3 < n:
            subtract_4x4(a, a, a, i, k, j)
            j += 4
        for c in range(j, n):
            subtract_column(a, a, a, i, k, c)
        return
    while j + 3 < n:
        subtract_1x4(a, a, a, i, k, j)
        j += 4
    for c in range(j, n):
        f0, f1, f2, f3 = a[i, k], a[i, k + 1], a[i, k + 2], a[i, k + 3]
        a[i, c] = a[i, c] - f0 * a[k, c] - f1 * a[k + 1, c] - f2 * a[k + 2, c] - f3 * a[k + 3, c]


@inlined_kernel
def factor_block(a, n, start, end):
    """Make pivots ``start`` to ``end`` and subtract their rows from later rows. Return 0, or 1 if a pivot vanishes."""
    for r in range(start, end):
        for p in range(start, r):
            f0 = a[r, p] * a[p, p]
            a[r, p] = f0
            for c in range(p + 1, end):
                a[r, c] -= f0 * a[p, c]
        if not abs(a[r, r]) > 1.0e-9:
            return 1
        a[r, r] = 1.0 / a[r, r]
    # Only the last block has fewer than four rows, and no columns follow it.
    j = end
    while j + 3 < n:
        first = load(a, (start, j))
        second = load(a, (start + 1, j)) - a[start + 1, start] * first
        third = load(a, (start + 2, j)) - a[start + 2, start] * first - a[start + 2, start + 1] * second
        fourth = load(a, (start + 3, j)) - a[start + 3, start] * first - a[start + 3, start + 1] * second
        store(a, (start + 1, j), second)
        store(a, (start + 2, j), third)
        store(a, (start + 3, j), fourth - a[start + 3, start + 2] * third)
        j += LANES
    for r in range(start + 1, end):
        for p in range(start, r):
            for c in range(j, n):
                a[r, c] -= a[r, p] * a[p, c]
    return 0


@kernel
def solve_rows(a, n, vectors, v):
    """Solve Aᵀ x = b with the factors of A by :func:`factor_rows`, in place on the first n numbers of ``vectors[v]``.

    The transposed system is solved because it runs along rows in both passes; callers keep their matrix transposed.
    """
    b = vectors[v]
    fours = n - n % LANES
    for k in range(0, fours, LANES):
        for p in range(k, k + LANES):
            b[p] *= a[p, p]
            for c in range(p + 1, k + LANES):
                b[c] -= a[p, c] * b[p]
        for j in range(k + LANES, fours, LANES):
            subtract_1x4(vectors, vectors, a, v, k, j)
        for c in range(fours, n):
            b[c] = b[c] - b[k] * a[k, c] - b[k + 1] * a[k + 1, c] - b[k + 2] * a[k + 2, c] - b[k + 3] * a[k + 3, c]
    for p in range(fours, n):
        b[p] *= a[p, p]
        for c in range(p + 1, n):
            b[c] -= a[p, c] * b[p]
    for p in range(n - 1, fours - 1, -1):
        for c in range(p):
            b[c] -= a[p, c] * b[p]
    k = fours
    while k > 0:
        k -= LANES
        for p in range(k + LANES - 1, k, -1):
            for c in range(k, p):
                b[c] -= a[p, c] * b[p]
        for j in range(0, k, LANES):
            subtract_1x4(vectors, vectors, a, v, k, j)


@kernel
def add_product(transposed, x, rows, columns, y):
    """y += Bᵀ x for B (rows, columns); B is kept transposed, so that the sum runs over contiguous rows, four at once.

    Eight columns at a time stay in registers. The last eight overlap the others; all are computed from the old y.
    """
    if columns < 2 * LANES:
        add_narrow(transposed, x, rows, columns, y)
        return
    add_columns(transposed, x, rows, 0, columns, y)


@kernel
def add_columns(transposed, x, rows, start, columns, y):
    """y += Bᵀ x for the columns from ``start`` on; other columns are neither read nor written."""
    last = columns - 2 * LANES
    if last < start:
        for i in range(rows):
            for j in range(start, columns):
                y[j] += x[i] * transposed[i, j]
        return
    first_of_last, second_of_last = eight_columns(transposed, x, rows, last, y)
    for j in range(start, last, 2 * LANES):
        first, second = eight_columns(transposed, x, rows, j, y)
        store(y, j, first)
        store(y, j + LANES, second)
    store(y, last, first_of_last)
    store(y, last + LANES, second_of_last)


@inlined_kernel
def eight_columns(transposed, x, rows, j, y):
    """Columns j to j + 7 of y + Bᵀ x, as two vectors."""
    first = load(y, j)
    second = load(y, j + LANES)
    i = 0
    while i + 3 < rows:
        x0, x1, x2, x3 = x[i], x[i + 1], x[i + 2], x[i + 3]
        first += (
            x0 * load(transposed, (i, j))
            + x1 * load(transposed, (i + 1, j))
            + x2 * load(transposed, (i + 2, j))
            + x3 * load(transposed, (i + 3, j))
        )
        second += (
            x0 * load(transposed, (i, j + LANES))
            + x1 * load(transposed, (i + 1, j + LANES))
            + x2 * load(transposed, (i + 2, j + LANES))
            + x3 * load(transposed, (i + 3, j + LANES))
        )
        i += 4
    while i < rows:
        first += x[i] * load(transposed, (i, j))
        second += x[i] * load(transposed, (i, j + LANES))
        i += 1
    return first, second


@inlined_kernel
def add_narrow(transposed, x, rows, columns, y):
    """y += Bᵀ x for a matrix B with fewer than eight columns."""
    if columns < LANES:
        for i in range(rows):
            for j in range(columns):
                y[j] += x[i] * transposed[i, j]
        return
    last = columns - LANES
    first = load(y, 0)
    second = load(y, last)
    for i in range(rows):
        first += x[i] * load(transposed, (i, 0))
        second += x[i] * load(transposed, (i, last))
    store(y, 0, first)
    store(y, last, second)


@kernel
def dot(x, y, n):
    """Σ x y of n numbers, as eight independent sums that are added at the end."""
    if n < 2 * LANES:
        total = 0.0
        for k in range(n):
            total += x[k] * y[k]
        return total
    first = load(x, 0) * load(y, 0)
    second = load(x, LANES) * load(y, LANES)
    i = 2 * LANES
    while i + 7 < n:
        first += load(x, i) * load(y, i)
        second += load(x, i + LANES) * load(y, i + LANES)
        i += 2 * LANES
    a, b, c, d = unpack(first + second)
    total = a + b + (c + d)
    for k in range(i, n):
        total += x[k] * y[k]
    return total


@kernel
def product(transposed, x, rows, columns, y):
    """y = Bᵀ x for B (rows, columns)."""
    for j in range(columns):
        y[j] = 0.0
    add_product(transposed, x, rows, columns, y)


@kernel
def products(left, right, rows, inner, columns, out):
    """``out`` (rows, columns) = ``left`` (rows, inner) ``right`` (inner, columns), four rows at once."""
    fours = rows - rows % LANES
    for i in range(0, fours, LANES):
        for r in range(i, i + LANES):
            for j in range(columns):
                out[r, j] = 0.0
        subtract_block(out, left, right, i, 0, inner, columns)
        for r in range(i, i + LANES):
            for j in range(columns):
                out[r, j] = -out[r, j]
    for i in range(fours, rows):
        product(right, left[i], inner, columns, out[i])


@kernel
def subtract_block(out, left, right, i, start, end, columns):
    """Subtract ``left[:, start:end] right[start:end, :columns]`` from ``out`` in the four rows from i on."""
    wide = columns - columns % LANES
    k = start
    while k + 3 < end:
        for j in range(0, wide, LANES):
            subtract_4x4(out, left, right, i, k, j)
        for j in range(wide, columns):
            subtract_column(out, left, right, i, k, j)
        k += LANES
    while k < end:
        for r in range(i, i + LANES):
            subtract_row(out[r], left[r, k], right[k], columns)
        k += 1


@inlined_kernel
def subtract_row(row, factor, other, columns):
    """Subtract ``factor`` times ``other`` from ``row``."""
    for j in range(columns):
        row[j] -= factor * other[j]


@kernel
def invert(a, n, inverse):
    """Invert the n × n matrix ``a`` (destroyed), without pivoting. Return 0, or 1 if a pivot vanishes.

    All columns are solved for together, four rows at once, so that the first step after a start, or of another length,
    takes no longer than one with many iterations.
    """
    if factor_rows(a, n) != 0:
        return 1
    for i in range(n):
        for j in range(n):
            inverse[i, j] = 0.0
        inverse[i, i] = 1.0
    # Forward substitution: row k of the lower factor ends at its diagonal.
    fours = n - n % LANES
    for i in range(n):
        first = 0
        if i < fours:
            first = i - i % LANES
            if i == first:
                subtract_block(inverse, a, inverse, i, 0, i, i)
        for k in range(first, i):
            subtract_row(inverse[i], a[i, k], inverse[k], k + 1)
    for i in range(n - 1, -1, -1):
        last = n
        if i < fours:
            last = i - i % LANES + LANES
            if i == last - 1:
                subtract_block(inverse, a, inverse, last - LANES, last, n, n)
        for k in range(i + 1, last):
            subtract_row(inverse[i], a[i, k], inverse[k], n)
        for j in range(n):
            inverse[i, j] *= a[i, i]
    return 0
