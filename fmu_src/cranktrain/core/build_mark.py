"""A mark by which numba tells the records of two copies of this package in one process apart.

A dispatcher finds the type of an argument by a fingerprint, which sees the name and the fields of a named tuple and not
its class. With two copies of the package loaded, as two FMUs of different code have them, records of the second would
be taken for those of the first, miss, and be typed in Python at each call. An FMU's copy bears a digest in its name.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_BUILD = np.dtype([(__name__.partition(".")[0], np.uint8)])


def build_mark() -> NDArray[np.void]:
    """Empty array (0,) of a type that is this copy's own: one member of each record that Python hands to a kernel."""
    return np.zeros(0, dtype=_BUILD)
