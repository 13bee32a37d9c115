"""The stage solver's linear algebra against LAPACK, at every size that its unrolled loops tell apart; its memory."""

import numpy as np
import pytest
from entry import linear_algebra

from cranktrain.core.kernel import keep_record
from cranktrain.core.memory import CACHE_LINE, zeros
from cranktrain.engine.file import load_engine
from cranktrain.film.laws.bearings import bearing_parameters
from cranktrain.film.laws.rigid_bore import RigidBore, rigid_bore
from cranktrain.film.table.tilted import table_work

add_columns, add_product, dot = linear_algebra.add_columns, linear_algebra.add_product, linear_algebra.dot
factor_lu, solve_lu, invert = linear_algebra.factor_lu, linear_algebra.solve_lu, linear_algebra.invert
factor_rows, solve_rows = linear_algebra.factor_rows, linear_algebra.solve_rows
product, products = linear_algebra.product, linear_algebra.products
SIZES = [1, 2, 3, 4, 5, 6, 7, 8, 9, 27, 62]


def matrix(n, seed=0):
    return np.random.default_rng(seed + n).standard_normal((n, n))


def backward_error(a, x, b):
    """Backward error of a solution in roundings: what stable elimination bounds, whatever the condition."""
    size = np.abs(a).sum(axis=1).max() * np.abs(x).max() + np.abs(b).max()
    return np.abs(a @ x - b).max() / size / np.finfo(float).eps


@pytest.mark.parametrize("n", SIZES)
def test_lu_with_pivoting_solves_and_leaves_what_lies_outside_its_block(n):
    b, wide, pivots = np.random.default_rng(1).standard_normal(n), np.full((n + 1, n + 1), 7.0), np.zeros(n)
    for a in (matrix(n), np.roll(np.eye(n), 1, axis=0)):
        wide[:n, :n], x = a, np.append(b, 7.0)
        assert factor_lu(wide, n, pivots) == 0
        solve_lu(wide, n, pivots, x)
        assert backward_error(a, x[:n], b) < 10 * n
        assert x[n] == 7.0 and (wide[n] == 7.0).all() and (wide[:, n] == 7.0).all()


@pytest.mark.parametrize("bad", [np.zeros((3, 3)), np.ones((3, 3)), np.full((3, 3), np.nan)])
def test_what_cannot_be_factored_is_said(bad):
    assert factor_lu(bad.copy(), 3, np.zeros(3)) == 1 and factor_rows(bad.copy(), 3) == 1


@pytest.mark.parametrize("n", SIZES)
def test_lu_by_rows_and_the_inverse_where_the_symmetric_part_is_positive(n):
    """However far from symmetric. Elements grow without pivoting: a hundred times is more than they do here."""
    a, b = matrix(n), np.random.default_rng(2).standard_normal(n)
    a = a @ a.T / n + 3 * (a - a.T) / np.sqrt(n) + np.eye(n)
    wide, vectors, inverse = np.full((n + 1, n + 1), 7.0), np.full((2, n + 1), 7.0), np.full((n, n), 7.0)
    x = vectors[1]
    x[:n], wide[:n, :n] = b, a.T
    assert factor_rows(wide, n) == 0
    solve_rows(wide, n, vectors, 1)
    assert backward_error(a, x[:n], b) < 100 * n
    assert x[n] == 7.0 and (vectors[0] == 7.0).all() and (wide[n] == 7.0).all() and (wide[:, n] == 7.0).all()
    assert invert(a.copy(), n, inverse) == 0
    assert inverse @ a == pytest.approx(np.eye(n), abs=1e-13 * n)


@pytest.mark.parametrize("rows", range(1, 12))
@pytest.mark.parametrize(("start", "columns"), [(0, 5), (0, 8), (0, 19), (27, 40), (7, 7), (7, 10), (12, 20)])
def test_products_leave_columns_before_and_behind(rows, start, columns):
    rng = np.random.default_rng(columns)
    b, x, y = rng.standard_normal((rows, columns + 2)), rng.standard_normal(rows), rng.standard_normal(columns + 2)
    added, whole, alone, wanted = y.copy(), y.copy(), y.copy(), b.T @ x
    add_columns(b, x, rows, start, columns, added)
    add_product(b, x, rows, columns, whole)
    product(b, x, rows, columns, alone)
    for found, first, expected in ((added, start, y + wanted), (whole, 0, y + wanted), (alone, 0, wanted)):
        assert found[first:columns] == pytest.approx(expected[first:columns], abs=1e-13)
        assert np.array_equal(found[:first], y[:first]) and np.array_equal(found[columns:], y[columns:])


@pytest.mark.parametrize("n", [0, 1, 7, 8, 9, 15, 16, 58])
def test_a_sum_of_products_takes_so_many_numbers(n):
    x, y = np.random.default_rng(n).standard_normal((2, n + 9))
    assert dot(x, y, n) == pytest.approx(x[:n] @ y[:n], abs=1e-13)


def test_a_record_of_other_arrays_than_its_law_reads_is_refused():
    """A law that read it all the same would read memory that is not there."""
    bearing = load_engine("diesel_i6").main_bearing
    good = rigid_bore(bearing, np.tile(bearing_parameters(bearing, 0.01), (2, 1)), None, np.zeros(1))
    owner = np.zeros(1)
    assert keep_record(good, owner) > 0
    with pytest.raises(TypeError, match=RigidBore.__name__):
        keep_record(good._replace(parameters=good.parameters[0]), owner)


@pytest.mark.parametrize("n", [1, 3, 4, 5, 8, 37, 43, 60, 64])
def test_lu_on_vectors_has_the_bits_of_the_plain_loop(n: int) -> None:
    """Elimination in the order of the pivots, each product rounded by itself; what lies outside the block stays."""
    rng = np.random.default_rng(n)
    q = rng.normal(size=(n, n))
    wide = rng.normal(size=(n + 3, n + 5))
    wide[:n, :n] = q @ q.T / n + np.eye(n) + 0.3 * (q - q.T)
    plain = wide.copy()
    for i in range(n):
        for k in range(i):
            plain[i, k] *= plain[k, k]
            plain[i, k + 1 : n] -= plain[i, k] * plain[k, k + 1 : n]
        plain[i, i] = 1.0 / plain[i, i]
    assert factor_rows(wide, n) == 0
    np.testing.assert_array_equal(wide, plain)


@pytest.mark.parametrize(
    "rows, inner, columns", [(0, 5, 5), (1, 1, 1), (3, 4, 5), (4, 4, 4), (5, 3, 2), (45, 43, 45), (8, 6, 7)]
)
def test_products_of_matrices(rows, inner, columns):
    """Also such as are parts of larger ones; what lies beside the product is left alone."""
    rng = np.random.default_rng(rows)
    left, right = rng.standard_normal((rows + 1, inner + 2)), rng.standard_normal((inner + 1, columns + 3))
    out = np.full((rows + 1, columns + 2), 7.0)
    products(left, right, rows, inner, columns, out)
    expected = left[:rows, :inner] @ right[:inner, :columns]
    assert np.allclose(out[:rows, :columns], expected, rtol=0.0, atol=1e-13)
    assert np.all(out[rows:] == 7.0) and np.all(out[:, columns:] == 7.0)


@pytest.mark.parametrize("shape", [0, 1, 7, (3,), (0, 4), (2, 5, 12), (999, 777)])
def test_zeros_are_those_of_numpy_at_the_start_of_a_line(shape):
    found = zeros(shape)
    expected = np.zeros(shape)
    assert found.shape == expected.shape and found.dtype == float and found.flags.c_contiguous and not found.any()
    assert found.size == 0 or found.ctypes.data % CACHE_LINE == 0
    found[...] = 1.0
    assert found.sum() == expected.size
    assert all(array.ctypes.data % CACHE_LINE == 0 for array in table_work())  # memory of a film
