"""Type aliases that all packages share."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Integers = NDArray[np.integer[Any]]
Progress = Callable[[str], None]
"""Function that receives the name of each stage of a long computation before the stage starts."""
