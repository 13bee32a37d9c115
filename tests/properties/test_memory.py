"""Memory for kernels begins where a cache line does: vectors of four then lie within one."""

import numpy as np
import pytest

from cranktrain.core.memory import CACHE_LINE, zeros
from cranktrain.film.table.tilted import table_work


@pytest.mark.parametrize("shape", [0, 1, 7, (3,), (0, 4), (2, 5, 12), (999, 777)])
def test_zeros_are_those_of_numpy_at_the_start_of_a_line(shape):
    found = zeros(shape)
    expected = np.zeros(shape)
    assert found.shape == expected.shape and found.dtype == float and found.flags.c_contiguous and not found.any()
    assert found.size == 0 or found.ctypes.data % CACHE_LINE == 0
    found[...] = 1.0
    assert found.sum() == expected.size


def test_the_memory_of_a_film_does():
    assert all(array.ctypes.data % CACHE_LINE == 0 for array in table_work())
