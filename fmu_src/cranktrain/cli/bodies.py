"""Crankshaft and block for the verbs of the command line, read from the cache or computed with progress shown."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.cli.console import stages
from cranktrain.core.errors import InputError
from cranktrain.engine.model import Engine
from cranktrain.structure.fem.own_mesh import MeshFile

if TYPE_CHECKING:
    from cranktrain.core.reduced_body import ReducedBody


def own_mesh(path: str | Path | None, unit: str) -> MeshFile | None:
    """User's own mesh with its unit of length; ``InputError`` for an unknown unit."""
    return None if path is None else MeshFile(path, unit)


def bare_crankshaft(
    engine: Engine, mesh: MeshFile | None, rebuild: bool = False, checked: bool = False
) -> "tuple[ReducedBody, float]":
    """Bare reduced crankshaft, and the seconds it took; shows the stages."""
    from cranktrain.structure.assembly import check_mesh
    from cranktrain.structure.crank.reduction import reduced_crankshaft

    check_mesh(mesh, "journal surfaces")
    start = time.perf_counter()
    with stages(f"{engine.name}: crankshaft") as say:
        body = reduced_crankshaft(engine, mesh, progress=say, rebuild=rebuild, checked=checked)
    return body, time.perf_counter() - start


def wants_flexible_block(engine: Engine, block: str, mesh: str | Path | None) -> bool:
    """True if the block is flexible; ``InputError`` before any work if engine or options do not allow it."""
    from cranktrain.structure.assembly import check_mesh
    from cranktrain.structure.block.shape import block_plan

    if block == "ground":
        if mesh is not None:
            raise InputError("--block-mesh needs --block flexible; on ground there is no block")
        return False
    block_plan(engine)
    check_mesh(mesh, "surfaces of the block")
    return True


def checked_block(engine: Engine, mesh: MeshFile | None, rebuild: bool) -> "ReducedBody":
    """Bare reduced block; shows the stages."""
    from cranktrain.structure.block.reduction import reduced_block

    with stages(f"{engine.name}: block") as say:
        return reduced_block(engine, mesh, progress=say, rebuild=rebuild, checked=True)
