"""The one jit decorator of the running model, and the rules its kernels keep.

A kernel must also compile ahead of time into a library without Python: the caller owns all memory, no ``np.linalg``,
no exceptions (integer status codes), no ``reshape``, no global mutable state, no parallel loops.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` in the native-safe subset, cached on disk."""
    return njit(cache=True, error_model="numpy", fastmath=False, boundscheck=False)(function)
