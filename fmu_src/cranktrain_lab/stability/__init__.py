"""Stability maps, which show where numerical methods fail, by the product's own kernels and by theory.

One module per map, each with ``compute(quick, progress)``; :data:`MAPS` finds it by name and imports it when called.
"""

from collections.abc import Callable
from functools import partial
from importlib import import_module

from cranktrain_lab.stability.stability_map import Axis, Boundary, Progress, StabilityMap

__all__ = ["MAPS", "Axis", "Boundary", "Progress", "StabilityMap"]

NAMES = (
    "step_film_stiffness", "contact_ringing", "oil_whirl", "rotating_damping", "variable_inertia", "cosimulation",
    "combustion_steps", "mode_truncation", "cold_start",
)  # fmt: skip


def _compute(name: str, quick: bool, progress: Progress) -> StabilityMap:
    computed: StabilityMap = import_module(f"{__name__}.{name}").compute(quick, progress)
    return computed


MAPS: dict[str, Callable[[bool, Progress], StabilityMap]] = {name: partial(_compute, name) for name in NAMES}
"""Functions that compute the maps, by name, with arguments ``quick`` (coarse map, some 20 s) and ``progress``."""
