"""Customary engineering units of outputs."""

from __future__ import annotations

import math

SHOWN = {"rad": ("deg", 180.0 / math.pi), "Pa": ("MPa", 1e-6), "m": ("um", 1e6)}
"""Customary engineering unit of each SI unit, and factor from the SI unit to the customary unit."""


def shown_unit(unit: str) -> tuple[str, float]:
    """Return the customary unit of an output, and the factor from SI."""
    return SHOWN.get(unit, (unit, 1.0))
