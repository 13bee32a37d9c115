"""Memory for kernels."""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.reduced_body import Array

CACHE_LINE = 64
"""Bytes that a processor reads at once. numpy begins where it likes, and half of all vectors of four would straddle."""


def zeros(shape: int | tuple[int, ...]) -> Array:
    """Zeros, float64, that begin where a cache line does."""
    size = math.prod(shape) if isinstance(shape, tuple) else shape
    row = np.zeros(size + CACHE_LINE // 8)
    first = -row.ctypes.data % CACHE_LINE // 8
    return row[first : first + size].reshape(shape)
