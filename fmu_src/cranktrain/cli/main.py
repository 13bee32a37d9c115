"""The command ``cranktrain``: one verb per question, a readable table for people or one JSON object for machines.

Progress and errors go to stderr. Wrong input ends with exit code 2 and one line.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from cranktrain import __version__
from cranktrain.cli import bearing, damper, film_table, plan, roller, run, stability, tradeoff
from cranktrain.cli import simulate as simulate_command
from cranktrain.cli.bodies import add_block_options, bare_block, bare_crankshaft, wants_flexible_block
from cranktrain.cli.console import Interrupted, one_of, say, show, stages
from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.engine.file import engine_provenance, load_engine
from cranktrain.engine.model import Engine
from cranktrain.levels import CRANKS

VERBS = {
    "bearing": bearing, "film-table": film_table, "damper-optimum": damper, "roller": roller, "stability": stability,
    "tradeoff": tradeoff, "plan": plan, "run": run,
}  # fmt: skip
"""Modules of the verbs that are no question about one engine: ``DESCRIPTION``, ``add_options`` and ``run``."""


class _Parser(argparse.ArgumentParser):
    """Parser whose errors are one line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        # A moment of -1e-3 is a number, not an option.
        self._negative_number_matcher = re.compile(r"^-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$", re.IGNORECASE)

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{re.sub(r'^argument (--[-0-9a-z]+): ', chr(92) + '1 ', message)}; see {self.prog} --help")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0, or 2 for input that cannot be used."""
    try:
        options = _parser().parse_args(arguments)
        with warnings.catch_warnings():
            warnings.showwarning = lambda message, *_: say(f"cranktrain: warning: {message}")
            result = options.verb(options)
    except CranktrainError as error:
        print(f"cranktrain: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt as stop:
        text = stop if isinstance(stop, Interrupted) else "interrupted; nothing was written"
        print(f"cranktrain: {text}", file=sys.stderr)
        return 130
    if options.json:
        print(json.dumps(_finite(result), indent=2, allow_nan=False))
    return 0


def _parser() -> _Parser:
    """Parser of all verbs."""
    parser = _Parser(prog="cranktrain", description="Crankshaft dynamics of an engine.")
    parser.add_argument("--version", action="version", version=f"cranktrain {__version__}")
    verbs = parser.add_subparsers(metavar="VERB", required=True, parser_class=_Parser)

    def verb(name: str, run: Callable[[argparse.Namespace], Any], text: str) -> argparse.ArgumentParser:
        sub = verbs.add_parser(name, help=text, description=text)
        sub.add_argument(
            "engine", metavar="ENGINE", help="name of a shipped engine (diesel_i6) or path of a .toml file"
        )
        sub.add_argument("--mesh", metavar="FILE", help="own mesh (.msh, .inp, .bdf) with named journal surfaces")
        sub.add_argument(
            "--json", action="store_true", help="print one JSON object; keys carry their unit (_hz, _um, …)"
        )
        sub.set_defaults(verb=run)
        return sub

    natural = verb(
        "modal", modal, "Free crankshaft and cranktrain frequencies beside the reference's, and critical speeds."
    )
    natural.add_argument(
        "--damper", action="store_true", help="also the cranktrain with the engine's torsional damper, as it damps"
    )
    natural.add_argument(
        "--crank",
        default="solid",
        metavar="LEVEL",
        help="solid (default); or rigid, torsional, beam: frequencies of that level beside the solid's",
    )
    add_block_options(natural)
    reduced = verb("reduce", reduce, "Make and check the reduced crankshaft, and block; they are kept in the cache.")
    reduced.add_argument("--rebuild", action="store_true", help="compute even where a stored model exists")
    add_block_options(reduced)
    for name, module in VERBS.items():
        text = module.DESCRIPTION.partition("\n")[0]
        raw = argparse.RawDescriptionHelpFormatter
        sub = verbs.add_parser(name, help=text, description=module.DESCRIPTION, formatter_class=raw)
        module.add_options(sub)
        sub.add_argument("--json", action="store_true", help="print one JSON object")
        sub.set_defaults(verb=module.run)
    text = "Run cycles at constant speed; write an HDF5 result and print a summary."
    simulate_command.add_options(verb("simulate", simulate_command.simulate, text))
    return parser


def modal(options: argparse.Namespace) -> dict[str, Any]:
    """Frequencies of the free crankshaft and the cranktrain, critical speeds, quality of the reduction."""
    from cranktrain.results.tables import Table, block_tables, frequency_tables
    from cranktrain.studies import modal as study
    from cranktrain.studies.torsion.damped_modes import damper_table
    from cranktrain.studies.torsion.level_frequencies import level_tables

    engine = load_engine(options.engine)
    one_of("--crank", options.crank, CRANKS)
    wants_flexible_block(engine, options)
    with stages(engine.name) as tell:
        report = study.modal(
            engine, options.crank, options.block, options.damper,
            mesh=options.mesh, block_mesh=options.block_mesh, say=tell,
        )  # fmt: skip
    if options.json:
        return report
    if "level" in report:
        for table in level_tables(engine, report):
            show(table)
        return report
    block = report.get("block")
    for table in [*frequency_tables(engine, report), *(block_tables(block) if block is not None else ())]:
        show(table)
    if options.damper:
        show(damper_table(report["damper"]))
    _say_quality("Reduction", report["reduction"])
    if block is not None:
        _say_quality("Block", block["reduction"])
    rows = tuple((key, f"{value} {unit}", note) for key, value, unit, origin, note in _calibrated(options.engine))
    if rows:
        show(Table("Calibrated values", ("value", "", "to which number"), rows))
    return report


def _say_quality(what: str, quality: dict[str, Any]) -> None:
    print(
        f"{what}: {quality['dofs_full']} degrees of freedom to {quality['modes']} modes, largest error against "
        f"the full model {100.0 * quality['max_relative_error']:.2g} % (to 1000 Hz)"
    )


def reduce(options: argparse.Namespace) -> dict[str, Any]:
    """Make the reduced crankshaft, and block, where they are not stored yet, and report their quality."""
    from cranktrain.structure.crank.reduction import stored_path

    engine = load_engine(options.engine)
    flexible = wants_flexible_block(engine, options)
    body, seconds = bare_crankshaft(engine, options, options.rebuild)
    result = {
        "path": str(stored_path(engine, options.mesh)),
        "modes": body.n_modes,
        "mass_kg": body.mass,
        "elastic_hz": body.frequencies_hz[6:16].tolist(),
        "quality": dict(body.quality),
        "seconds": seconds,
    }
    if not options.json:
        quality = body.quality
        print(f"{body.name}: {body.mass:.1f} kg, {quality['dofs_full']:.0f} degrees of freedom, {body.n_modes} modes")
        print("first elastic modes / Hz: " + ", ".join(f"{hz:.1f}" for hz in result["elastic_hz"]))
        print(f"reduced against full to 1000 Hz: {100.0 * quality['max_relative_error']:.2g} %")
        print(f"static stiffness of the interfaces: {100.0 * quality['static_error']:.2g} %")
        print(
            f"rigidly tied journals (RBE2) would raise the first mode by {100.0 * quality['tied_raises_first']:.0f} %"
        )
        other = "lumped" if engine.reduction.consistent_mass else "consistent"
        print(f"{other} mass would shift the first mode by {100.0 * quality['other_mass_shifts_first']:+.2f} %")
        print(f"kept in {result['path']}")
    if flexible:
        result["block"] = _block_quality(engine, options)
    return result


def _block_quality(engine: Engine, options: argparse.Namespace) -> dict[str, Any]:
    """Make the reduced block where it is not stored yet; what the verb ``reduce`` says of it."""
    from cranktrain.structure.block.reduction import running_block, stored_path

    body = bare_block(engine, options, options.rebuild)
    running = running_block(engine, body)
    result = {
        "path": str(stored_path(engine, options.block_mesh)),
        "modes": body.n_modes,
        "running_modes": running.n_modes,
        "mass_kg": body.mass,
        "elastic_hz": body.frequencies_hz[6:16].tolist(),
        "quality": dict(body.quality),
    }
    if not options.json:
        quality = body.quality
        print(
            f"{body.name}: {body.mass:.1f} kg, {quality['dofs_full']:.0f} degrees of freedom, {body.n_modes} modes, "
            f"{running.n_modes} in the running model"
        )
        print("first elastic modes / Hz: " + ", ".join(f"{hz:.1f}" for hz in result["elastic_hz"]))
        print(f"reduced against full to 1000 Hz: {100.0 * quality['max_relative_error']:.2g} %")
        print(f"static stiffness of the interfaces: {100.0 * quality['static_error']:.2g} %")
        print(f"kept in {result['path']}")
    return result


def _calibrated(engine: str) -> list[tuple[str, Any, str, str, str]]:
    return [row for row in engine_provenance(engine) if row[3] == "calibrated"]


def _finite(value: Any) -> Any:
    """``value`` with what JSON cannot say (not finite) as null, and NumPy scalars as plain ones."""
    if isinstance(value, dict):
        return {str(key): _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    if hasattr(value, "tolist"):
        return _finite(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


if __name__ == "__main__":
    sys.exit(main())
