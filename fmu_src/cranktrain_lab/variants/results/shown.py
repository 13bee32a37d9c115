"""Engineers' units of outputs."""

from __future__ import annotations

import math

SHOWN = {"rad": ("deg", 180.0 / math.pi), "Pa": ("MPa", 1e-6), "m": ("um", 1e6)}
"""Engineers' units of outputs, and their factors."""


def shown_unit(unit: str) -> tuple[str, float]:
    """Unit in which people read an output, and the factor to it."""
    return SHOWN.get(unit, (unit, 1.0))
