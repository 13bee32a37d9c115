"""What a run's levels need besides the crankshaft: block, film tables, elastic bores; from the cache or made now."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cranktrain.dynamics.model.arrays import Parts
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import PlainBearing
from cranktrain.film.laws.register import bearing_law
from cranktrain.film.table.database import FilmTable, TableSettings
from cranktrain.store.film_tables import film_table

Progress = Callable[[str], None]

_TABLES: dict[TableSettings, FilmTable] = {}


def level_parts(
    engine: Engine, settings: Settings, say: Progress, resolution: str = "default", block_mesh: str | Path | None = None
) -> Parts:
    """Parts of a run; ``settings`` have nothing left open.

    Parameters
    ----------
    say : told each stage of long work
    resolution : of the main bearings' film table, see :class:`cranktrain.film.table.database.TableSettings`
    block_mesh : the user's own mesh of the block

    Raises
    ------
    InputError
        an engine that lacks what a level needs, a mesh that cannot be used
    """
    block = bore = table = floating = None
    if settings.block == "flexible":
        from cranktrain.structure.block.reduction import block_loads, reduced_block, running_block

        tilting = bearing_law(settings.bearings).tilt or engine.main_roller is not None
        bare = reduced_block(engine, block_mesh, progress=say)
        block = running_block(engine, bare, block_loads(engine, tilting=tilting))
    if settings.bearings == "ehd":
        from cranktrain.film.laws.ehd import SHAPES
        from cranktrain.structure.block.bore import block_bore_compliance
        from cranktrain.structure.block.saddle import bore_compliance

        if block is None:
            bore = bore_compliance(engine, SHAPES, with_motion=True, progress=say)
        else:
            # A flexible block carries the motion of its bores itself.
            bore = block_bore_compliance(engine, SHAPES, mesh_file=block_mesh, progress=say)
    if settings.bearings == "table":
        table = _film_table(engine.plain_mains, say, resolution)
    if settings.big_ends == "table" and engine.big_end_bearing is not None:
        floating = _film_table(engine.big_end_bearing, say, tilt=False)
    return Parts(table=table, bore=bore, big_end_table=floating, block=block)


def _film_table(bearing: PlainBearing, say: Progress, resolution: str = "default", tilt: bool = True) -> FilmTable:
    """Film table of a bearing; read or made once in a process."""
    settings = TableSettings(bearing.width / bearing.diameter, bearing.groove, resolution, tilt=tilt)

    def shown(done: int, count: int) -> None:
        if 10 * done // count > 10 * (done - 1) // count:
            say(f"film table of L/D {settings.length_ratio:.4g}: {100 * done // count} %")

    if settings not in _TABLES:
        _TABLES[settings] = film_table(settings, progress=shown, say=say)[0]
    return _TABLES[settings]
