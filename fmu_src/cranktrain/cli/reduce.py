"""The verb ``reduce``: the reduced crankshaft, and block, made where they are not stored, and their quality."""

from __future__ import annotations

import argparse
from typing import Any

from cranktrain.cli.bodies import add_block_options, bare_crankshaft, checked_block, own_meshes, wants_flexible_block
from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine

DESCRIPTION = "Make and check the reduced crankshaft, and block, kept in the cache; write them elsewhere."


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options to those that all verbs of an engine have."""
    parser.add_argument("--rebuild", action="store_true", help="compute even where a stored model exists")
    parser.add_argument(
        "--output", metavar="FILE", help="also write the crankshaft: .h5, .npz, or a folder of Matrix Market files"
    )
    parser.add_argument("--block-output", metavar="FILE", help="also write the block; needs --block flexible")
    add_block_options(parser, running=False)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Make the reduced crankshaft, and block, where they are not stored yet, and report their quality."""
    from cranktrain.store.bodies import check_body_place, export_body
    from cranktrain.structure.assembly import table_crank
    from cranktrain.structure.crank.reduction import stored_path
    from cranktrain.structure.fem.own_body import is_body

    engine = load_engine(options.engine)
    own_meshes(options)
    if options.output is not None:
        check_body_place(options.output)
    flexible = wants_flexible_block(engine, options)
    if options.block_output is not None:
        if not flexible:
            raise InputError("--block-output needs --block flexible; on ground there is no block")
        check_body_place(options.block_output)
    table = table_crank(engine, options.mesh)
    body, seconds = bare_crankshaft(engine, options, options.rebuild, checked=True) if table is None else (table, 0.0)
    own = table is not None or (options.mesh and is_body(options.mesh))
    result = {
        "path": str(options.mesh if own else stored_path(engine, options.mesh)),
        "modes": body.n_modes,
        "mass_kg": body.mass,
        "elastic_hz": body.frequencies_hz[6:16].tolist(),
        "quality": dict(body.quality),
        "seconds": seconds,
    }
    if options.output is not None:
        result["output"] = str(export_body(options.output, body))
    if not options.json:
        _show(engine, body, result)
    if flexible:
        result["block"] = _block_quality(engine, options)
    return result


def _show(engine: Engine, body: ReducedBody, result: dict[str, Any]) -> None:
    """Print what the crankshaft is worth."""
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


def _dofs(body: ReducedBody) -> str:
    """Degrees of freedom of the full model, where the body tells them."""
    return f"{body.quality['dofs_full']:.0f} degrees of freedom, " if "dofs_full" in body.quality else ""


def _show_errors(body: ReducedBody, result: dict[str, Any]) -> None:
    """Print its first modes and how well they are known."""
    quality = body.quality
    print("first elastic modes / Hz: " + ", ".join(f"{hz:.1f}" for hz in result["elastic_hz"]))
    if {"max_relative_error", "static_error"} <= quality.keys():
        print(f"error of the reduced frequencies to 1000 Hz: {100.0 * quality['max_relative_error']:.2g} %")
        print(f"error of the static stiffness of the interfaces: {100.0 * quality['static_error']:.2g} %")
    elif "rigid_hz" in quality:
        print(f"frequency of rigid motions in the given stiffness: {quality['rigid_hz']:.2g} Hz")


def _block_quality(engine: Engine, options: argparse.Namespace) -> dict[str, Any]:
    """Make the reduced block where it is not stored yet; what the verb ``reduce`` says of it."""
    from cranktrain.store.bodies import export_body
    from cranktrain.structure.block.reduction import running_block, stored_path
    from cranktrain.structure.fem.own_body import is_body

    own, body = options.block_mesh, checked_block(engine, options, options.rebuild)
    running = running_block(engine, body)
    result = {
        "path": str(own if own and is_body(own) else stored_path(engine, own)),
        "modes": body.n_modes,
        "running_modes": running.n_modes,
        "mass_kg": body.mass,
        "elastic_hz": body.frequencies_hz[6:16].tolist(),
        "quality": dict(body.quality),
    }
    if options.block_output is not None:
        result["output"] = str(export_body(options.block_output, body))
    if not options.json:
        print(
            f"{engine.name} block: {body.mass:.1f} kg, {_dofs(body)}{body.n_modes} modes, {running.n_modes} in the "
            "running model"
        )
        _show_errors(body, result)
        print(f"kept in {result['path']}")
        if "output" in result:
            print(f"written to {result['output']}")
    return result
