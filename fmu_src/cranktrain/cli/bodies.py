"""Bodies that the command line's verbs ask for: crankshaft and block, from the cache or made now, stage by stage."""

from __future__ import annotations

import argparse
import time
from typing import TYPE_CHECKING

from cranktrain.cli.console import of_words, one_of, stages
from cranktrain.core.errors import InputError
from cranktrain.engine.levels import BLOCKS, described
from cranktrain.engine.model import Engine
from cranktrain.structure.fem.own_mesh import MeshFile

if TYPE_CHECKING:
    from cranktrain.core.reduced_body import ReducedBody


def add_block_options(parser: argparse.ArgumentParser, running: bool = True) -> None:
    """Options that say what the crank runs in; ``running``: the block of a run follows the engine's mains."""
    usual = "ground, flexible where the mains are rollers" if running else "ground"
    level = parser.add_argument(
        "--block", default="auto" if running else "ground", metavar="LEVEL",
        help=f"{described(BLOCKS.values())}; default {usual}",
    )  # fmt: skip
    of_words(level, ("auto", *BLOCKS) if running else BLOCKS)
    own = parser.add_mutually_exclusive_group()
    own.add_argument(
        "--block-mesh",
        metavar="FILE",
        help="own block (.msh, .inp, .unv, .bdf) with named surfaces; needs --block flexible",
    )
    own.add_argument(
        "--block-body", dest="block_mesh", metavar="FILE",
        help="own reduced block in place of a mesh: .h5, .npz or folder of reduce --block-output, or a superelement of "
        "another program (.toml)",
    )  # fmt: skip


def own_meshes(options: argparse.Namespace) -> None:
    """Let the user's own meshes, where there are any, know their unit; ``InputError`` for one that does not exist."""
    for name in ("mesh", "block_mesh"):
        if getattr(options, name, None) is not None:
            setattr(options, name, MeshFile(getattr(options, name), options.mesh_unit))


def bare_crankshaft(
    engine: Engine, options: argparse.Namespace, rebuild: bool = False, checked: bool = False
) -> tuple[ReducedBody, float]:
    """Bare reduced crankshaft and the seconds it took, with the stages shown."""
    from cranktrain.structure.assembly import check_mesh
    from cranktrain.structure.crank.reduction import reduced_crankshaft

    check_mesh(options.mesh, "journal surfaces")
    start = time.perf_counter()
    with stages(f"{engine.name}: crankshaft") as say:
        body = reduced_crankshaft(engine, options.mesh, progress=say, rebuild=rebuild, checked=checked)
    return body, time.perf_counter() - start


def wants_flexible_block(engine: Engine, options: argparse.Namespace) -> bool:
    """Whether the block is to be flexible; refuses what the engine or the options do not allow before any work."""
    from cranktrain.structure.assembly import check_mesh
    from cranktrain.structure.block.shape import block_plan

    one_of("--block", options.block, BLOCKS)
    if options.block == "ground":
        if options.block_mesh is not None:
            raise InputError("--block-mesh needs --block flexible; on ground there is no block")
        return False
    block_plan(engine)
    check_mesh(options.block_mesh, "surfaces of the block")
    return True


def checked_block(engine: Engine, options: argparse.Namespace, rebuild: bool) -> ReducedBody:
    """Bare reduced block, with the stages shown."""
    from cranktrain.structure.block.reduction import reduced_block

    with stages(f"{engine.name}: block") as say:
        return reduced_block(engine, options.block_mesh, progress=say, rebuild=rebuild, checked=True)
