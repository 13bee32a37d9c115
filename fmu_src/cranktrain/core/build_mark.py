"""Array type by which numba distinguishes the records of two copies of this package in one process.

Numba's dispatcher recognises the type of an argument by a fingerprint. For a named tuple it holds the name and the
fields, but not the class. Two FMUs with different code load two copies of the package. Without the mark, records of the
second copy would be mistaken for those of the first, and each call would determine their type in Python. An FMU's copy
has a digest in its package name.
"""

import numpy as np
from numpy.typing import NDArray

_BUILD = np.dtype([(__name__.partition(".")[0], np.uint8)])


def build_mark() -> NDArray[np.void]:
    """Empty array (0,) of a type that only this package copy has; all records passed to kernels contain it."""
    return np.zeros(0, dtype=_BUILD)
