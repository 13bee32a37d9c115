"""Frequencies of an engine's cranktrain and block: the output of ``cranktrain modal --json``."""

import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.engine.levels import BLOCKS, CRANKS, crank_level
from cranktrain.engine.model import Engine
from cranktrain.loads.damper import required_damper
from cranktrain.loads.gas_pressure import Gas
from cranktrain.structure.additions import check_added
from cranktrain.structure.assembly import assemble, check_crank_table, check_mesh, checked, table_crank
from cranktrain.structure.block.modal import block_report
from cranktrain.structure.block.reduction import reduced_block
from cranktrain.structure.block.shape import block_plan
from cranktrain.structure.crank.critical_speeds import critical_speeds
from cranktrain.structure.crank.level import bare_crank, complete_crank
from cranktrain.structure.crank.modal import modal_report
from cranktrain.structure.crank.reduction import kept_crankshaft, reduced_crankshaft
from cranktrain.structure.fem.own_mesh import MeshFile
from cranktrain.studies.added_modes import additions_report
from cranktrain.studies.in_motion.report import SPRING_LEVELS, motion_report, springs_report
from cranktrain.studies.torsion.damped_modes import damper_report
from cranktrain.studies.torsion.level_frequencies import level_frequencies
from cranktrain.studies.torsion.line_modes import line_report


def modal(
    engine: str | Path | Engine,
    crank: str = "solid",
    block: str = "ground",
    damper: bool = False,
    *,
    mesh: str | Path | None = None,
    block_mesh: str | Path | None = None,
    mesh_unit: str = "m",
    bearings: str = "auto",
    speed: float | None = None,
    gas: Gas | None = None,
    say: Callable[[str], None] = lambda stage: None,
) -> dict[str, Any]:
    """Frequencies of the free crankshaft and the cranktrain, at rest and in motion, critical speeds, quality.

    Bodies and connections that an engine file adds are included in the solid crank's modes ``with_additions`` and
    ``in_motion``. All other lists leave them out; their names are in ``left_out``.

    Raises ``InputError`` for unknown or contradictory levels, parts that the engine lacks, and a wrong mesh.

    Parameters
    ----------
    engine : name of a shipped engine, path of an engine file, or an engine
    crank : crank level. Other levels than ``solid`` give only the crank's frequencies. They are compared with those of
        the solid crank if it is in the cache, given by ``mesh``, or needed to make the level. A crank from a table is
        not compared
    block : ``flexible`` also gives the block's own modes
    damper : True to add the cranktrain with the engine's torsional damper and its damping
    mesh, block_mesh : the user's own meshes; ``mesh`` at level ``torsional`` also a table of discs and shafts
    mesh_unit : of their coordinates: m, mm or in
    bearings, speed : level of the mains and speed (rad/s) of the modes in motion; None: the usual level, and the speed
        of the largest heat per cycle
    gas : measured pressures of that run in place of the built-in trace
    say : receives the name of each stage of long work
    """
    given = engine if isinstance(engine, Engine) else load_engine(engine)
    check_added(given, mesh is not None, block_mesh is not None)
    found = given.without_additions
    if not given.line_on_crank:
        warnings.warn(
            f"the drive line begins at '{given.drive_line.start}'; lists of modes at rest have it on the crank's "
            "flywheel, without the bodies between",
            stacklevel=2,
        )
    solid = crank_level(crank).name == list(CRANKS)[-1]
    if block not in BLOCKS:
        raise InputError(f"block level '{block}' does not exist; {nearest(block, BLOCKS)}")
    flexible = block != "ground"
    _check_extras(found, crank, solid, damper, flexible)
    mesh, block_mesh = (None if path is None else MeshFile(path, mesh_unit) for path in (mesh, block_mesh))
    check_mesh(mesh, "journal surfaces")
    check_mesh(block_mesh, "surfaces of the block")
    check_crank_table(crank, mesh)
    start = time.perf_counter()
    levels = Settings(bearings=bearings, block=block, damper="fitted" if damper else "none")
    settings = checked(found, levels, mesh, block_mesh if flexible else None) if solid else None
    table = table_crank(found, mesh)
    needed, body = table is None and crank_level(crank).needs_solid(found), None
    if needed or (mesh is not None and table is None):
        body = reduced_crankshaft(found, mesh, progress=say, checked=solid)
    elif table is None:  # a level from dimensions is compared with a solid crank that is in the cache
        body = kept_crankshaft(found)
    made = time.perf_counter()
    own = bare_crank(found, crank, body if needed else None) if table is None else table
    line = line_report(found, complete_crank(found, crank, own))
    if not solid:
        report: dict[str, Any] = level_frequencies(found, crank, body, own)
    else:
        report = dict(modal_report(found, own))
        report["critical_speeds"] = critical_speeds(found, complete_crank(found, crank, own), gas)
        if damper:
            report["damper"] = damper_report(found, own)
        housing = reduced_block(found, block_mesh, progress=say, checked=True) if flexible else None
        if housing is not None:
            report["block"] = block_report(found, own, housing)
        if settings is not None:
            say("a cycle in motion")
            # A line that ends freely has no given speed; the connecting shaft stands for it in motion.
            driven = replace(given, drive_line_chain=None) if line["far_end"] == "free" else given
            running = assemble(driven, settings, say=say, crank_mesh=mesh, block_mesh=block_mesh if flexible else None)
            report["in_motion"] = motion_report(running, speed, gas)
            if found.main_bearing is not None:
                report["stand_in_springs"] = springs_report(assemble(found, SPRING_LEVELS, say=say, crank_mesh=mesh))
    seconds = {"reduction": made - start, "modal": time.perf_counter() - made}
    if given != found:
        added = given.additions
        report["left_out"] = [body.name for body in added.body] + [one.name for one in added.connection]
        if solid:
            report["with_additions"] = additions_report(given, own, housing)
    report["drive_line"] = line
    return {**report, "seconds": {**report.get("seconds", {}), **seconds}}


def _check_extras(engine: Engine, crank: str, solid: bool, damper: bool, flexible: bool) -> None:
    """Raise ``InputError`` for a damper or flexible block with another crank, or if the file has none."""
    if not solid and (damper or flexible):
        told = " and ".join(["--damper"] * damper + ["--block flexible"] * flexible)
        raise InputError(
            f"{told} cannot go with --crank {crank}, only with --crank solid; leave out {told} or --crank {crank}"
        )
    if damper:
        required_damper(engine)
    if flexible:
        block_plan(engine)
