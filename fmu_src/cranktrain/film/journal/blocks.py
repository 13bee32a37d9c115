"""Block elimination for Reynolds' matrix, one block per grid column, cyclic if the pressure ring is closed.

On a grid of N columns around the bearing with n axial nodes each, the five-point matrix is block tridiagonal,

    −E_{i−1} x_{i−1} + T_i x_i − E_i x_{i+1} = b_i,    E_i diagonal, T_i tridiagonal,

closed in a ring. Each pivot block S_i = T_i − E_{i−1} S_{i−1}⁻¹ E_{i−1} is inverted explicitly. Because n is small, the
inverse costs no more than a band factorisation, and inversion and solution run over dense rows whose length is a
multiple of four, which a compiler turns into vector instructions. The matrix is symmetric, positive definite and
diagonally dominant, so no pivoting is needed. Columns without unknowns break the chain. If all neighbouring columns are
coupled, the last column becomes a border (Schur complement), which triples the cost.

Axial rows are padded with unit rows to a multiple of :data:`LANES`.
"""

from typing import Any, NamedTuple

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import ZEROS, four, plus, put_four, scaled
from cranktrain.core.reduced_body import Array

LANES = 4


class Ring(NamedTuple):
    """Factors of a ring of columns, computed by :func:`factor_ring`; m is n padded to LANES."""

    around: Array  # (N, m) coupling of columns i and i + 1; zero where a node carries no unknown
    used: Array  # (N,) number of unknowns of each column
    start: int  # column at which elimination begins
    cyclic: bool
    n: int
    inverse: Array  # (N, m, m) inverse S⁻¹ of each column's pivot block
    border: Array  # (N, m, m) S⁻¹U with the coupling U to the border; used in the cyclic case only


def _inverter(size: int) -> Any:
    """Make a kernel that inverts blocks of a padded ``size`` (0: any); a size fixed at compile time halves the time."""

    @kernel
    def invert(s, n):
        """Invert a block in place by Gauss–Jordan elimination; see the module's :func:`invert`."""
        padded = size if size > 0 else s.shape[0]
        for k in range(n):
            pivot_row = s[k]
            pivot = pivot_row[k]
            if not pivot > 0.0:
                return 1
            inverse = 1.0 / pivot
            pivot_row[k] = 1.0
            for j in range(padded):
                pivot_row[j] *= inverse
            for i in range(n):
                if i != k:
                    row = s[i]
                    share = row[k]
                    row[k] = 0.0
                    for j in range(padded):
                        row[j] -= share * pivot_row[j]
        return 0

    return invert


_invert_any = _inverter(0)
_invert_4 = _inverter(4)
_invert_8 = _inverter(8)
_invert_12 = _inverter(12)
_invert_16 = _inverter(16)
_invert_24 = _inverter(24)


@kernel
def invert(s, n):
    """Invert the symmetric positive definite leading block (n, n) of ``s`` in place; rows are padded to LANES.

    Returns 0, or 1 if a pivot is not positive.
    """
    padded = s.shape[0]
    if padded == 12:
        return _invert_12(s, n)
    if padded == 8:
        return _invert_8(s, n)
    if padded == 16:
        return _invert_16(s, n)
    if padded == 24:
        return _invert_24(s, n)
    if padded == 4:
        return _invert_4(s, n)
    return _invert_any(s, n)


@kernel
def factor_ring(ring, diagonal, axial, coupling):
    """Compute the pivot blocks of the ring, in ``ring.inverse`` and ``ring.border``.

    ``axial`` (N, ≥ m) couples nodes j − 1 and j. Nodes without an unknown have ``diagonal`` one and ``axial`` zero.
    ``coupling`` (m, m) is scratch. Returns 0, or 1 if a pivot is not positive.
    """
    around, used, start, cyclic, n, inverse, border = ring
    columns = diagonal.shape[0]
    padded = inverse.shape[1]
    before = start
    schur = inverse[(start + columns - 1) % columns]
    for step in range(columns):
        i = start + step
        if i >= columns:
            i -= columns
        last = step == columns - 1
        if used[i] == 0.0:
            before = i
            continue
        s = inverse[i]
        if not (cyclic and last):
            for j in range(padded):
                row = s[j]
                for k in range(padded):
                    row[k] = 0.0
        if cyclic and step == 0:
            for j in range(padded):
                for k in range(padded):
                    schur[j, k] = 0.0
        for j in range(padded):
            s[j, j] += diagonal[i, j]
        for j in range(1, n):
            s[j, j - 1] -= axial[i, j]
            s[j - 1, j] -= axial[i, j]
        if step > 0 and not (cyclic and last):
            e = around[before]
            known = inverse[before]
            for j in range(n):
                left = e[j]
                if left != 0.0:
                    row = s[j]
                    other = known[j]
                    for b in range(padded):
                        row[b] = row[b] - left * other[b] * e[b]
        if invert(s, n) != 0:
            return 1
        if cyclic and not last:
            # U couples this column with the border: initially at the seam of the ring, then filled in by elimination.
            seam = around[(start + columns - 1) % columns]
            for j in range(n):
                for k in range(padded):
                    coupling[j, k] = around[before, j] * border[before, j, k] if step > 0 else 0.0
                if step == 0:
                    coupling[j, j] = seam[j]
                if step == columns - 2:
                    coupling[j, j] += around[i, j]
            v = border[i]
            _multiply(s, coupling, n, v)
            for j in range(n):
                u = coupling[j]
                for k in range(n):
                    share = u[k]
                    if share != 0.0:
                        row = schur[k]
                        other = v[j]
                        for b in range(padded):
                            row[b] = row[b] - share * other[b]
        before = i
    return 0


@kernel
def _multiply(a, b, n, product):
    """Compute ``product`` = a b for (m, m) blocks with n rows in use."""
    padded = a.shape[0]
    for i in range(n):
        row = product[i]
        for k in range(padded):
            row[k] = 0.0
        for j in range(n):
            share = a[i, j]
            if share != 0.0:
                other = b[j]
                for k in range(padded):
                    row[k] = row[k] + share * other[k]


@kernel
def solve_ring(ring, x, carried):
    """Solve for one right-hand side ``x`` (N, m), in place; ``carried`` (m,) is scratch."""
    around, used, start, cyclic, n, inverse, border = ring
    columns = x.shape[0]
    padded = x.shape[1]
    end = (start + columns - 1) % columns
    inner = columns - 1 if cyclic else columns
    before = start
    for step in range(inner):
        i = start + step
        if i >= columns:
            i -= columns
        if used[i] > 0.0:
            for j in range(n):
                carried[j] = x[i, j] + (around[before, j] * x[before, j] if step > 0 else 0.0)
            if cyclic:
                for j in range(n):
                    share = carried[j]
                    for k in range(n):
                        x[end, k] += border[i, j, k] * share
            for j in range(0, padded, LANES):
                put_four(x[i], j, _row_products(inverse[i], carried, n, j))
        before = i
    if cyclic:
        for j in range(n):
            carried[j] = x[end, j]
        for j in range(0, padded, LANES):
            put_four(x[end], j, _row_products(inverse[end], carried, n, j))
    for step in range(inner - 1, -1, -1):
        i = start + step
        if i >= columns:
            i -= columns
        after = i + 1 if i + 1 < columns else 0
        if used[i] == 0.0:
            continue
        if step < inner - 1 and used[after] > 0.0:
            for k in range(n):
                carried[k] = around[i, k] * x[after, k]
            for j in range(0, padded, LANES):
                put_four(x[i], j, plus(four(x[i], j), _row_products(inverse[i], carried, n, j)))
        if cyclic:
            for j in range(n):
                total = x[i, j]
                for k in range(n):
                    total += border[i, j, k] * x[end, k]
                x[i, j] = total


@kernel
def _row_products(s, vector, n, j):
    """Return entries j to j + 3 of the product S ``vector`` for a symmetric S (m, m)."""
    total = ZEROS
    for k in range(n):
        total = plus(total, scaled(vector[k], four(s[k], j)))
    return total


@kernel
def solve_ring_four(ring, x, carried):
    """Solve for four right-hand sides ``x`` (N, m, 4) at once, in place; ``carried`` (m, 4) is scratch."""
    around, used, start, cyclic, n, inverse, border = ring
    columns = x.shape[0]
    end = (start + columns - 1) % columns
    inner = columns - 1 if cyclic else columns
    before = start
    for step in range(inner):
        i = start + step
        if i >= columns:
            i -= columns
        if used[i] > 0.0:
            here = x[i]
            for j in range(n):
                e = around[before, j] if step > 0 else 0.0
                put_four(carried[j], 0, plus(four(here[j], 0), scaled(e, four(x[before, j], 0))))
                put_four(here[j], 0, ZEROS)
            if cyclic:
                for k in range(n):
                    _add_products(border[i], carried, n, k, x[end], True)
            for j in range(n):
                _add_products(inverse[i], carried, n, j, here, False)
        before = i
    if cyclic:
        here = x[end]
        for j in range(n):
            put_four(carried[j], 0, four(here[j], 0))
            put_four(here[j], 0, ZEROS)
        for j in range(n):
            _add_products(inverse[end], carried, n, j, here, False)
    for step in range(inner - 1, -1, -1):
        i = start + step
        if i >= columns:
            i -= columns
        after = i + 1 if i + 1 < columns else 0
        if used[i] == 0.0:
            continue
        here = x[i]
        if step < inner - 1 and used[after] > 0.0:
            for j in range(n):
                put_four(carried[j], 0, scaled(around[i, j], four(x[after, j], 0)))
            for j in range(n):
                _add_products(inverse[i], carried, n, j, here, False)
        if cyclic:
            for j in range(n):
                _add_products(border[i], x[end], n, j, here, False)


@kernel
def _add_products(s, vectors, n, j, total, transposed):
    """Add row j (or column j) of S times four vectors (m, 4) to ``total[j]``."""
    sums = four(total[j], 0)
    for k in range(n):
        share = s[k, j] if transposed else s[j, k]
        sums = plus(sums, scaled(share, four(vectors[k], 0)))
    put_four(total[j], 0, sums)
