"""Bodies and parts of a case's levels, from the cache or made now; kept while the study runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

from cranktrain.dynamics.model import Parts, Settings
from cranktrain.dynamics.simulation import fitted_engine
from cranktrain.engine import Engine
from cranktrain.film.database import FilmTable, TableSettings
from cranktrain.film.laws import TILTED
from cranktrain.film_table import film_table
from cranktrain.reduced_body import ReducedBody

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
        _CRANKS[key] = _crank(fitted, settings.crank, say)
    return _CRANKS[key]


_CRANKS: dict[tuple[Engine, str], ReducedBody] = {}


def _crank(engine: Engine, level: str, say: Progress) -> ReducedBody:
    from cranktrain.structure.reduction import running_body

    if level in ("rigid", "solid"):  # the running model takes the rigid modes of the solid crank
        return running_body(engine, progress=say)
    from cranktrain.structure.crank_level import crank_body

    return crank_body(engine, level, progress=say)


def level_parts(engine: Engine, settings: Settings, table: str, say: Progress) -> Parts:
    """What the levels need besides the crankshaft."""
    block = None
    if settings.block == "flexible":
        from cranktrain.structure.block import block_loads, reduced_block, running_block

        tilting = settings.bearings in TILTED or engine.main_roller is not None
        block = running_block(engine, reduced_block(engine, progress=say), block_loads(engine, tilting=tilting))
    bore = None
    if settings.bearings == "ehd":
        from cranktrain.film.elastic_law import SHAPES
        from cranktrain.structure.block_bore import block_bore_compliance
        from cranktrain.structure.saddle import bore_compliance

        if block is None:
            bore = bore_compliance(engine, SHAPES, with_motion=True, progress=say)
        else:
            bore = block_bore_compliance(engine, SHAPES, progress=say)
    floating = None
    if settings.big_ends == "table" and engine.big_end_bearing is not None:
        end = engine.big_end_bearing
        floating = _table(TableSettings(end.width / end.diameter, end.groove, tilt=False))
    films = None
    if settings.bearings == "table":
        main = engine.plain_mains
        films = _table(TableSettings(main.width / main.diameter, main.groove, table))
    return Parts(table=films, bore=bore, big_end_table=floating, block=block)


@lru_cache(maxsize=4)
def _table(settings: TableSettings) -> FilmTable:
    return film_table(settings)[0]
