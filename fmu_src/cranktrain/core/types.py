"""Type aliases that all packages share."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Progress = Callable[[str], None]
"""Function that receives the name of each stage of a long computation before the stage starts."""
