"""Names of types that all packages share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Progress = Callable[[str], None]
"""Told the stage of long work before it starts."""
