"""Crankshafts of a case's levels, from the cache or made now; kept while the study runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import fitted_engine
from cranktrain.engine.model import Engine
from cranktrain.structure.crank.level import crank_body

Progress = Callable[[str], None]

ALL_MODES = 1.0e6
"""Cut-off (Hz) above every mode that is stored."""


def running_crank(engine: Engine, settings: Settings, cutoff_hz: float | None, say: Progress) -> ReducedBody:
    """Crankshaft of the running model at the settings' level, with what is fixed to it; cut at ``cutoff_hz``."""
    fitted = fitted_engine(engine, settings)
    if cutoff_hz is not None:
        fitted = replace(fitted, reduction=replace(fitted.reduction, running_cutoff_hz=cutoff_hz))
    key = (fitted, settings.crank)
    if key not in _CRANKS:
        _CRANKS[key] = crank_body(fitted, settings.crank, progress=say)
    return _CRANKS[key]


_CRANKS: dict[tuple[Engine, str], ReducedBody] = {}
