"""Records at their address: kernels see the arrays that Python sees, inner records too, whoever calls them."""

from typing import NamedTuple

import numpy as np
import pytest

from cranktrain.core import record_types
from cranktrain.core.kernel import compiler, kernel, record


class Inner(NamedTuple):
    values: np.ndarray
    factor: float


@record
class Outer(NamedTuple):
    count: int
    first: Inner
    table: np.ndarray
    second: Inner


def outer(scale=1.0):
    return Outer(3, Inner(np.arange(3.0), scale), np.ones((2, 3)), Inner(np.zeros(3), 2.0))


@kernel
def add_row(inner, row):
    for k in range(row.shape[0]):
        inner.values[k] += inner.factor * row[k]


@kernel
def work(given, rows):
    for i in range(rows):
        add_row(given.second, given.table[i])
        given.table[i, 0] += given.first.factor
    return given.second.values[0] + given.count


def test_a_kernel_works_on_the_arrays_of_inner_records():
    mine = outer()
    assert work(mine, 2) == 4.0 + 3
    assert mine.second.values.tolist() == [4.0, 4.0, 4.0]
    assert mine.table.tolist() == [[2.0, 1.0, 1.0], [2.0, 1.0, 1.0]]
    assert mine.first.values.tolist() == [0.0, 1.0, 2.0]


def test_records_of_other_numbers_are_told_apart():
    """Also more of them than images are kept, and such that lie where a former one lay."""
    for k in range(60):
        mine = outer(float(k))
        work(mine, 1)
        assert mine.table[0, 0] == 1.0 + k
    assert len(record_types._images) <= 16


def test_what_a_kernel_writes_is_read_anew():
    """Members are constant while kernels run, the arrays' values are not."""

    @kernel
    def sums(given):
        total = 0.0
        for i in range(given.table.shape[0]):
            given.first.values[0] = i + 1.0
            total += given.first.values[0] * given.table[i, 0]
        return total

    assert sums(outer()) == 3.0


def test_a_type_is_told_by_class_and_members():
    same, other = outer(), outer()._replace(table=np.ones(3))
    numba = compiler()
    assert numba.typeof(same) == numba.typeof(outer()) != numba.typeof(other)
    assert numba.typeof(same).mangling_args != numba.typeof(other).mangling_args


def test_a_member_that_no_kernel_reads_is_named():
    @kernel
    def first(given):
        return given.table[0, 0]

    with pytest.raises(TypeError, match="'count' of Outer is a str, which no kernel reads"):
        first(outer()._replace(count="text"))
    assert first(outer()) == 1.0
