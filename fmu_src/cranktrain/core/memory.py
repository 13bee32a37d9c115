"""Aligned arrays for kernels."""

import math

import numpy as np

from cranktrain.core.reduced_body import Array

CACHE_LINE = 64
"""Bytes of a cache line. Without alignment half of all vectors of four doubles would cross a line's border."""


def zeros(shape: int | tuple[int, ...]) -> Array:
    """Array of zeros, float64, that starts at the beginning of a cache line."""
    size = math.prod(shape) if isinstance(shape, tuple) else shape
    row = np.zeros(size + CACHE_LINE // 8)
    first = -row.ctypes.data % CACHE_LINE // 8
    return row[first : first + size].reshape(shape)
