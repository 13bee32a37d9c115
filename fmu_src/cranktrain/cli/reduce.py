"""The verb ``reduce``: the reduced crankshaft, and block, made if they are not stored, and their quality."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cranktrain.cli.bodies import bare_crankshaft, checked_block, own_mesh, wants_flexible_block
from cranktrain.cli.functions import verb
from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult
from cranktrain.structure.fem.own_mesh import MeshFile
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option

DESCRIPTION = "Make and check the reduced crankshaft, and block, kept in the cache; write them elsewhere."


@dataclass(frozen=True, kw_only=True)
class Reduce(words.Meshes):
    """Question of :func:`reduce`."""

    anew: Annotated[bool, Option(help="compute even where a stored model exists", was="--rebuild")] = False
    output: Annotated[
        words.File | None, Option("FILE", "also write the crankshaft: .h5, .npz, or a folder of Matrix Market files")
    ] = None
    block_output: Annotated[words.File | None, Option("FILE", "also write the block; needs --block flexible")] = None
    block: words.Block = "ground"
    block_mesh: words.OwnBlock | None = None


@verb(Reduce, DESCRIPTION)
def reduce(named: str | Path | Engine, ask: Reduce) -> VerbResult:
    """Make the reduced crankshaft and block if they are not stored yet, and report their quality."""
    from cranktrain.store.bodies import check_body_place, export_body
    from cranktrain.structure.assembly import table_crank
    from cranktrain.structure.crank.reduction import stored_path
    from cranktrain.structure.fem.own_body import is_body

    engine = load_engine(named)
    mesh, block_mesh = own_mesh(ask.mesh, ask.mesh_unit), own_mesh(ask.block_mesh, ask.mesh_unit)
    if ask.output is not None:
        check_body_place(ask.output)
    flexible = wants_flexible_block(engine, ask.block, block_mesh)
    if ask.block_output is not None:
        if not flexible:
            raise InputError("--block-output needs --block flexible; on ground there is no block")
        check_body_place(ask.block_output)
    table = table_crank(engine, mesh)
    body, seconds = bare_crankshaft(engine, mesh, ask.anew, checked=True) if table is None else (table, 0.0)
    own = table is not None or (mesh and is_body(mesh))
    result = {
        "path": str(mesh if own else stored_path(engine, mesh)),
        "modes": body.n_modes,
        "mass_kg": body.mass,
        "elastic_hz": body.frequencies_hz[6:16].tolist(),
        "quality": dict(body.quality),
        "seconds": seconds,
    }
    if ask.output is not None:
        result["output"] = str(export_body(ask.output, body))
    beside: dict[str, Any] = {"engine": engine, "body": body}
    if flexible:
        result["block"], beside["block"] = _block_quality(engine, block_mesh, ask)
    return VerbResult.of(result, "reduce", **beside)


def show(result: VerbResult) -> None:
    """Print the quality of the reductions of crankshaft and block."""
    engine, body = result.beside["engine"], result.beside["body"]
    quality = body.quality
    print(f"{engine.name} crankshaft: {body.mass:.1f} kg, {_dofs(body)}{body.n_modes} modes")
    _show_errors(body, result)
    if "slice_mass_error" in quality:
        print(f"error of modal mass in the terms of rotation, to 1000 Hz: {100.0 * quality['slice_mass_error']:.2g} %")
    if {"tied_raises_first", "other_mass_shifts_first"} <= quality.keys():
        tied, shift = quality["tied_raises_first"], quality["other_mass_shifts_first"]
        print(f"rigidly tied journals (RBE2) would raise the first mode by {100.0 * tied:.0f} %")
        other = "lumped" if engine.reduction.consistent_mass else "consistent"
        print(f"{other} mass would shift the first mode by {100.0 * shift:+.2f} %")
    print(f"kept in {result['path']}")
    if "output" in result:
        print(f"written to {result['output']}")
    if "block" in result:
        _show_block(engine, result.beside["block"], result["block"])


def _dofs(body: ReducedBody) -> str:
    """Text with the degrees of freedom of the full model, if known."""
    return f"{body.quality['dofs_full']:.0f} degrees of freedom, " if "dofs_full" in body.quality else ""


def _show_errors(body: ReducedBody, result: dict[str, Any]) -> None:
    """Print the first natural frequencies of a body and their errors."""
    quality = body.quality
    print("first elastic modes / Hz: " + ", ".join(f"{hz:.1f}" for hz in result["elastic_hz"]))
    if {"max_relative_error", "static_error"} <= quality.keys():
        print(f"error of the reduced frequencies to 1000 Hz: {100.0 * quality['max_relative_error']:.2g} %")
        print(f"error of the static stiffness of the interfaces: {100.0 * quality['static_error']:.2g} %")
    elif "rigid_hz" in quality:
        print(f"frequency of rigid motions in the given stiffness: {quality['rigid_hz']:.2g} Hz")


def _block_quality(engine: Engine, own: MeshFile | None, ask: Reduce) -> tuple[dict[str, Any], ReducedBody]:
    """Make the reduced block if it is not stored yet. Return its quality, and the block."""
    from cranktrain.store.bodies import export_body
    from cranktrain.structure.block.reduction import running_block, stored_path
    from cranktrain.structure.fem.own_body import is_body

    body = checked_block(engine, own, ask.anew)
    result = {
        "path": str(own if own and is_body(own) else stored_path(engine, own)),
        "modes": body.n_modes,
        "running_modes": running_block(engine, body).n_modes,
        "mass_kg": body.mass,
        "elastic_hz": body.frequencies_hz[6:16].tolist(),
        "quality": dict(body.quality),
    }
    if ask.block_output is not None:
        result["output"] = str(export_body(ask.block_output, body))
    return result, body


def _show_block(engine: Engine, body: ReducedBody, result: dict[str, Any]) -> None:
    """Print the quality of the reduced block."""
    print(
        f"{engine.name} block: {body.mass:.1f} kg, {_dofs(body)}{body.n_modes} modes, {result['running_modes']} in the "
        "running model"
    )
    _show_errors(body, result)
    print(f"kept in {result['path']}")
    if "output" in result:
        print(f"written to {result['output']}")
