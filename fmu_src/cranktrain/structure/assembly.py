"""Assembly of a run from an engine and its settings: body of the crank, block, film tables, elastic bores.

Command line, studies, FMU build and library all use this module, so a fidelity level has the same meaning everywhere.
Parts are kept as long as the process lives, and on disk if making them takes long.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from threadpoolctl import threadpool_limits

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Progress
from cranktrain.core.user_file import TABLES, ending, file_exists
from cranktrain.dynamics.model.arrays import Parts
from cranktrain.dynamics.model.settings import Settings, check_levels, needed_parts, resolved
from cranktrain.dynamics.simulation import Simulation, fitted_engine
from cranktrain.dynamics.topology.bearings import film_parts
from cranktrain.dynamics.topology.laws import data_of
from cranktrain.dynamics.topology.values import Topology
from cranktrain.engine.connections import Film
from cranktrain.engine.levels import CRANKS, crank_level
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import PlainBearing
from cranktrain.film.laws.register import bearing_law
from cranktrain.store.bodies import FOLDER_HEADER
from cranktrain.structure.additions import check_added, read_added

if TYPE_CHECKING:
    from cranktrain.film.elastic.bore_compliance import BoreCompliance
    from cranktrain.film.table.database import FilmTable

_KEPT: dict[Any, Any] = {}


@dataclass(frozen=True)
class Assembly:
    """Parts of a run.

    Attributes
    ----------
    engine : engine as passed to :func:`assemble`
    settings : complete and checked
    body : crankshaft of the running model at its level, with all that is fixed to it
    parts : further data that the levels need
    """

    engine: Engine
    settings: Settings
    body: ReducedBody
    parts: Parts


def assemble(
    engine: Engine,
    settings: Settings,
    *,
    say: Progress = lambda stage: None,
    crank_mesh: str | Path | None = None,
    block_mesh: str | Path | None = None,
    table_resolution: str = "default",
    cutoff_hz: float | None = None,
    inherit: bool = True,
) -> Assembly:
    """Make the parts of a run with these settings, or read them from the cache.

    Raises ``InputError`` before any computation: levels that do not exist, need parts that the engine lacks, or cannot
    be combined; a mesh file that is missing or that no chosen level uses. Later: a mesh that cannot be used.

    Parameters
    ----------
    say : called with the name of each long stage before it starts
    crank_mesh : user's own mesh of the crankshaft, for levels that use a mesh; level ``rigid`` uses its mass
    block_mesh : user's own mesh of the block; needs block level ``flexible``
    table_resolution : of the main bearings' film table, see :class:`cranktrain.film.table.database.TableSettings`
    cutoff_hz : cut-off of the crank's modes; None for the value of the engine file
    inherit : if true, a crank without films takes its damping from the next higher level
    """
    settings = checked(engine, settings, crank_mesh, block_mesh)
    cut = engine
    if cutoff_hz is not None:
        cut = replace(engine, reduction=replace(engine.reduction, running_cutoff_hz=cutoff_hz))
    body = running_crank(fitted_engine(cut, settings), settings.crank, say=say, mesh=crank_mesh, inherit=inherit)
    parts = _parts(engine, settings, say, table_resolution, block_mesh)
    return Assembly(engine, settings, body, parts._replace(bodies=read_added(engine)))


def checked(
    engine: Engine,
    settings: Settings,
    crank_mesh: str | Path | None = None,
    block_mesh: str | Path | None = None,
) -> Settings:
    """Complete settings; ``InputError`` for settings that :func:`assemble` would refuse before any work."""
    settings = resolved(settings, engine)
    check_levels(settings, engine)
    if crank_mesh is not None and not crank_level(settings.crank).takes_mesh:
        users = ", ".join(row.name for row in CRANKS.values() if row.takes_mesh)
        raise InputError(
            f"crank level '{settings.crank}' is made from dimensions; use an own mesh with crank levels {users}"
        )
    check_mesh(crank_mesh, "journal surfaces")
    check_crank_table(settings.crank, crank_mesh)
    check_added(engine, crank_mesh is not None, block_mesh is not None)
    if block_mesh is not None and settings.block == "ground":
        raise InputError("a mesh of the block needs block 'flexible'; on ground there is no block")
    check_mesh(block_mesh, "surfaces of the block")
    if settings.block == "flexible":
        from cranktrain.structure.block.shape import block_plan
        from cranktrain.structure.fem.own_body import is_body

        block_plan(engine)
        if block_mesh is not None and "bore" in needed_parts(engine, settings) and is_body(block_mesh):
            raise InputError(
                f"{block_mesh}: bearings '{settings.bearings}' need the shapes of the block's bores, which a reduced "
                "body does not hold; give its mesh by --block-mesh, or take bearings table"
            )
    return settings


def check_crank_table(level: str, mesh: str | Path | None) -> None:
    """Refuse a crank of discs and shafts (table or stored body) at a level other than ``torsional``; ``InputError``."""
    if mesh is None or crank_level(level).inherits:
        return
    from cranktrain.structure.fem.own_body import is_body

    tabled = ending(mesh) in (".toml", *TABLES) and not is_body(mesh)
    if tabled or _stored_table(mesh) is not None:
        raise InputError(f"{mesh}: a table of discs and shafts serves crank level torsional, not '{level}'")


def table_crank(engine: Engine, mesh: str | Path | None) -> ReducedBody | None:
    """Bare crankshaft of discs and shafts from a table or stored body. Return None if ``mesh`` is neither."""
    if mesh is None:
        return None
    from cranktrain.engine.torsional_chain import is_chain, read_chain
    from cranktrain.structure.crank.chain import chain_body
    from cranktrain.structure.crank.reduction import own_crankshaft

    if is_chain(mesh):
        return chain_body(engine, read_chain(mesh))
    return None if _stored_table(mesh) is None else own_crankshaft(engine, mesh)


def _stored_table(mesh: str | Path) -> ReducedBody | None:
    """Stored body made from a table of discs and shafts. Return None if the file ``mesh`` is anything else."""
    from cranktrain.store.bodies import import_body, is_stored_body

    if not is_stored_body(mesh):
        return None
    try:
        body = import_body(mesh)
    except InputError:  # an unreadable body is reported later, by the function that reads it for the run
        return None
    return body if body.shafts else None


def check_mesh(mesh: str | Path | None, surfaces: str) -> None:
    """Refuse a user's own mesh or reduced body whose file is missing; ``InputError``."""
    if mesh is None or file_exists(mesh) or file_exists(Path(mesh) / FOLDER_HEADER):
        return
    if ending(mesh) in ("", ".h5", ".npz"):
        raise InputError(f"{mesh}: no such reduced body; write one by 'cranktrain reduce ENGINE --output'")
    raise InputError(f"{mesh}: no such mesh file; give a .msh, .inp, .unv or .bdf file with named {surfaces}")


def running_crank(
    engine: Engine,
    level: str,
    *,
    say: Progress = lambda stage: None,
    mesh: str | Path | None = None,
    inherit: bool = True,
) -> ReducedBody:
    """Crankshaft of the running model at a crank level; ``engine`` includes the housing of its damper.

    ``mesh`` is the user's own mesh. With ``inherit`` a crank of level ``torsional`` takes the damping of the level
    above. Raises ``InputError``.
    """

    def make() -> ReducedBody:
        from cranktrain.structure.crank import level as crank
        from cranktrain.structure.crank.reduction import reduced_crankshaft

        if (table := table_crank(engine, mesh)) is not None:
            return crank.running_crank(engine, level, table)
        if mesh is not None:
            bare = crank.bare_crank(engine, level, reduced_crankshaft(engine, mesh, progress=say), say)
        else:
            # The bare crankshaft does not depend on the pulley and its damper, except if shaft stiffnesses are
            # tuned to the solid crankshaft in motion.
            tuned = engine.reduction.torsional_source == "solid-in-motion"
            key = "bare crank", engine if tuned else replace(engine, pulley=None), level  # type: ignore[arg-type]
            bare = _once(key, lambda: crank.bare_crank(engine, level, progress=say))
        return crank.running_crank(engine, level, bare)

    # One thread gives the same bytes on every machine. A run-up is continued only if the crank's digest is unchanged.
    @threadpool_limits.wrap(limits=1, user_api="blas")
    def complete() -> ReducedBody:
        row, body = crank_level(level), make()
        if not row.inherits or body.brings_damping:
            return body
        if engine.damping.torsional_ratios:
            from cranktrain.structure.in_motion.inherited_damping import with_stated_damping

            return with_stated_damping(engine, body)
        if not inherit:
            return body
        return _inherited(engine, body, row.inherits, say)

    return complete() if mesh is not None else _once(("complete crank", engine, level, inherit), complete)


def _inherited(engine: Engine, body: ReducedBody, above: str, say: Progress) -> ReducedBody:
    """Running ``body`` with the damping of the next finer crank level (``above``) in motion, kept in the cache.

    If the level above does not run, the body is unchanged and ``say`` gets a message. Raises ``InputError`` if a part
    is missing that the level above needs.
    """
    from cranktrain.store.kept import Kept, digest
    from cranktrain.structure.in_motion.inherited_damping import (
        Decay,
        felt,
        measured_decay,
        settings_above,
        with_damping,
    )

    driven = felt(engine)
    kept, key = Kept("inherited"), digest(__file__, driven, above)
    entry = kept.entry(key)
    if entry is None:
        say(f"damping of crank level '{above}'")
        try:
            made = assemble(driven, settings_above(above))
            found = measured_decay(Simulation(driven, made.body, made.settings, parts=made.parts))
        except SolverError as error:
            say(f"crank level '{above}' does not run, so the crank keeps its structural damping: {error}")
            return body
        entry = {"hz": found.hz.tolist(), "ratio": found.ratio.tolist(), "speed": found.speed}
        kept.keep(key, entry)
    return with_damping(engine, body, above, Decay(np.array(entry["hz"]), np.array(entry["ratio"]), entry["speed"]))


def _parts(engine: Engine, settings: Settings, say: Progress, resolution: str, block_mesh: str | Path | None) -> Parts:
    """Block, elastic bores and film tables of a run."""
    block = bore = table = floating = None
    flexible, wanted = settings.block == "flexible", needed_parts(engine, settings)
    if flexible:
        tilting = bearing_law(settings.bearings).tilt or engine.main_roller is not None
        block = running_block(engine, tilting, say, block_mesh, bore="bore" in wanted)
    if "bore" in wanted:
        bore = elastic_bore(engine, flexible, say, block_mesh)
    if "table" in wanted:
        table = main_table(engine, say, resolution)
    if "big_end_table" in wanted:
        floating = big_end_table(engine, say)
    eye = big_end_bore(engine, say) if "big_end_bore" in wanted else None
    own = film_tables_of(engine, say, resolution)
    return Parts(table=table, bore=bore, big_end_table=floating, big_end_bore=eye, block=block, film_tables=own)


def running_block(
    engine: Engine,
    tilting: bool,
    say: Progress = lambda stage: None,
    mesh: str | Path | None = None,
    bore: bool = False,
) -> ReducedBody:
    """Block of the running model; ``tilting`` is true if the main bearings also load the block by moments.

    With ``bore`` a reduction of the block also stores the elastic shapes of its bore, see :func:`elastic_bore`.
    """

    def make() -> ReducedBody:
        from cranktrain.structure.block.bore import bore_beside
        from cranktrain.structure.block.reduction import block_loads, reduced_block, running_block

        bare = reduced_block(engine, mesh, progress=say, beside=bore_beside(engine, mesh) if bore else None)
        return running_block(engine, bare, block_loads(engine, tilting=tilting))

    return make() if mesh is not None else _once(("block", engine, tilting), make)


def elastic_bore(
    engine: Engine, flexible: bool, say: Progress = lambda stage: None, mesh: str | Path | None = None
) -> Any:
    """Elastic bore of the main bearings: bore of a bearing saddle on ground, bore of the block if it is flexible.

    The modes of a flexible block include the rigid motion of its bores. A saddle's shapes include this motion.
    """

    def make() -> Any:
        from cranktrain.film.laws.ehd import SHAPES
        from cranktrain.structure.block.bore import block_bore_compliance
        from cranktrain.structure.block.saddle import bore_compliance

        if flexible:
            return block_bore_compliance(engine, SHAPES, mesh_file=mesh, progress=say)
        return bore_compliance(engine, SHAPES, with_motion=True, progress=say)

    return make() if mesh is not None else _once(("bore", engine, flexible), make)


def main_table(engine: Engine, say: Progress = lambda stage: None, resolution: str = "default") -> FilmTable:
    """Film table of the main bearings."""
    return _film_table(engine.plain_mains, say, resolution)


def film_tables(topology: Topology, say: Progress = lambda stage: None, resolution: str = "default") -> tuple[Any, ...]:
    """Film tables of a topology's films at level ``table``, for ``Parts.film_tables``; read from the cache or computed.

    Raises ``InputError`` if the data of a connection do not describe a film.

    Parameters
    ----------
    topology : bodies and connections of a script
    say : called with the progress
    resolution : resolution of the tables, see :class:`cranktrain.film.table.database.TableSettings`
    """
    found = [data_of(connection) for connection in topology.connections if connection.law == "film"]
    return _film_tables(found, say, resolution)


def film_tables_of(
    engine: Engine, say: Progress = lambda stage: None, resolution: str = "default"
) -> tuple[FilmTable, ...]:
    """Film tables of the films at level ``table`` that the engine file adds as connections."""
    return _film_tables(
        [table.film for table in engine.additions.connection if table.film is not None], say, resolution
    )


def _film_tables(films: Sequence[Film], say: Progress, resolution: str = "default") -> tuple[FilmTable, ...]:
    """One film table for all films of level ``table`` with the same proportions."""
    found = [_film_table(film, say, resolution) for film in films if "table" in film_parts(film, ())]
    return tuple({id(table): table for table in found}.values())  # films of equal proportions share one


def big_end_table(engine: Engine, say: Progress = lambda stage: None) -> FilmTable:
    """Film table of the big ends, which do not tilt; ``InputError`` if the engine has no big-end bearing."""
    if engine.big_end_bearing is None:
        raise InputError(f"engine '{engine.name}' has no [big_end_bearing]; add it, or leave big ends rigid")
    return _film_table(engine.big_end_bearing, say, tilt=False)


def big_end_bore(engine: Engine, say: Progress = lambda stage: None) -> BoreCompliance:
    """Elastic bore of the big ends, from the rod's eye; ``InputError`` if the engine has no big-end bearing."""

    def make() -> BoreCompliance:
        from cranktrain.film.laws.ehd import SHAPES
        from cranktrain.structure.rod.eye import eye_compliance

        return eye_compliance(engine, SHAPES, progress=say)

    return cast("BoreCompliance", _once(("big-end bore", engine.big_end_bearing, engine.rod), make))


def _film_table(bearing: PlainBearing, say: Progress, resolution: str = "default", tilt: bool = True) -> FilmTable:
    from cranktrain.film.table.database import bearing_settings

    settings = bearing_settings(bearing, resolution, tilt)

    def shown(done: int, count: int) -> None:
        if 10 * done // count > 10 * (done - 1) // count:
            say(f"film table of L/D {settings.length_ratio:.4g}: {100 * done // count} %")

    def make() -> FilmTable:
        from cranktrain.store.film_tables import film_table

        return film_table(settings, progress=shown, say=say)[0]

    return _once(("table", settings), make)


def _once(key: Any, make: Callable[[], Any]) -> Any:
    """Result of ``make``, computed once in a process."""
    if key not in _KEPT:
        _KEPT[key] = make()
    return _KEPT[key]
