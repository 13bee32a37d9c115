"""The verb ``modal``: frequencies of crankshaft, cranktrain and block."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING, Any

from cranktrain.cli.bodies import add_block_options, wants_flexible_block
from cranktrain.cli.console import number, of_words, one_of, show, stages
from cranktrain.cli.run_options import add_source_options, engine_of, gas_of, request_of
from cranktrain.core.errors import InputError
from cranktrain.engine.drive_line_chain import read_drive_line
from cranktrain.engine.file import engine_provenance
from cranktrain.engine.firing import firing_summary, firing_text
from cranktrain.engine.levels import CRANKS, described
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain.film.laws.register import MAINS, bearing_levels

if TYPE_CHECKING:
    from cranktrain.engine.torsional_chain import Chain

RPM = math.pi / 30.0

DESCRIPTION = """\
Free crankshaft and cranktrain frequencies beside the reference's, and critical speeds.

Two states of the cranktrain are shown. At rest it stands on stand-in springs, with its thrust bearing closed. In
motion it vibrates about the settled cycle of a run, whose films lock its journals: these are the modes that a run-up's
peaks belong to. Critical speeds are those of the orders that excite the first torsional mode, each with its excitation
over the largest one.

ENGINE may also be a table of discs and shafts (TOML or CSV, see cranktrain.engine.torsional_chain):
its natural frequencies, damping ratios, and rotations of the discs over the largest.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options to those that all verbs of an engine have."""
    add = parser.add_argument
    add("--damper", action="store_true", help="also damped modes of the cranktrain with the engine's torsional damper")
    level = add(
        "--crank", default="solid", metavar="LEVEL",
        help=f"{described(CRANKS.values())}; default solid; frequencies of other levels are compared with solid where "
        "that is made already",
    )  # fmt: skip
    of_words(level, CRANKS)
    add_block_options(parser, running=False)
    mains = add("--bearings", default="auto", metavar="LEVEL",
        help="of the mains, for modes in motion (default as simulate)")  # fmt: skip
    of_words(mains, ("auto", *bearing_levels(*MAINS)))
    add("--speed", dest="speed_rpm", type=number(SLOWEST_RPM, FASTEST_RPM, "rev/min"), metavar="RPM",
        help="speed for modes in motion, rev/min (default: combustion.best_speed)")  # fmt: skip
    add_source_options(parser)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Frequencies of the free crankshaft and the cranktrain, critical speeds, quality of the reduction."""
    from cranktrain.engine.torsional_chain import is_chain
    from cranktrain.results.tables import block_tables, frequency_tables, named_text
    from cranktrain.studies import modal as study
    from cranktrain.studies.added_modes import additions_table
    from cranktrain.studies.in_motion.report import TORSIONAL, motion_table, springs_text, states_text
    from cranktrain.studies.torsion.chain_modes import chain_report, chain_table
    from cranktrain.studies.torsion.damped_modes import damper_table
    from cranktrain.studies.torsion.level_frequencies import level_tables
    from cranktrain.studies.torsion.line_modes import line_table

    if is_chain(options.engine):
        report = chain_report(_whole_chain(options.engine))
        if not options.json:
            show(chain_table(report))
        return report
    engine = engine_of(options)
    one_of("--crank", options.crank, CRANKS)
    wants_flexible_block(engine, options)
    speed = engine.best_speed if options.speed_rpm is None else options.speed_rpm * RPM
    if options.pressure is not None and options.crank != "solid":
        raise InputError("--pressure drives the cycle of modes in motion, of --crank solid only; leave one of them out")
    gas = gas_of(request_of(options, speed / RPM), engine)
    with stages(engine.name) as tell:
        report = study.modal(
            engine, options.crank, options.block, options.damper,
            mesh=options.mesh, block_mesh=options.block_mesh, mesh_unit=options.mesh_unit,
            bearings=options.bearings, speed=speed, gas=gas, say=tell,
        )  # fmt: skip
    report["firing"] = firing_summary(engine)
    if options.json:
        return report
    print(firing_text(engine))
    if "left_out" in report:
        print(f"These are modes of crank and block alone, without the added {', '.join(report['left_out'])}.")
    if "level" in report:
        for table in (*level_tables(engine, report), line_table(report["drive_line"])):
            show(table)
        if not report["compared_with_solid"] and options.mesh is None:
            # The name of an engine of the user's own is no argument of a command; the path of its file is.
            given = engine.name if isinstance(options.engine, Engine) else options.engine
            print(f"Not compared with the solid crank, which is not made yet; cranktrain reduce {given} makes it.")
        return report
    motion, block = report["in_motion"], report.get("block")
    for table in [*frequency_tables(engine, report), *(block_tables(block) if block is not None else ())]:
        show(table)
    print(named_text(report["cranktrain"], report["sought_to_hz"]))
    show(line_table(report["drive_line"]))
    show(motion_table(motion))
    print(f"No modes in motion: {motion['failed']}" if "failed" in motion else f"{TORSIONAL}.")
    print(states_text(report))
    if "stand_in_springs" in report:
        print(springs_text(report["stand_in_springs"]))
    if "with_additions" in report:
        show(additions_table(report["with_additions"]))
    if options.damper:
        show(damper_table(report["damper"]))
    _say_quality("Reduction", report["reduction"])
    if block is not None:
        _say_quality("Block", block["reduction"])
    if count := sum(origin == "calibrated" for *_, origin, _ in engine_provenance(options.engine)):
        print(f"{count} values of the engine file are calibrated; cranktrain report lists them with what they fit.")
    return report


def _whole_chain(path: str) -> Chain:
    """Table that is a system by itself; a drive line is refused with the option that takes it, ``InputError``."""
    from cranktrain.engine.torsional_chain import read_chain

    try:
        return read_chain(path)
    except InputError:
        try:
            read_drive_line(path)
        except InputError:
            pass
        else:
            raise InputError(
                f"{path}: is a drive line that begins at the flywheel of an engine; give cranktrain modal ENGINE "
                f"--drive-line {path}"
            ) from None
        raise


def _say_quality(what: str, quality: dict[str, Any]) -> None:
    if "max_relative_error" not in quality:
        print(f"{what}: reduced by another program, {quality['modes']} modes")
        return
    print(
        f"{what}: {quality['dofs_full']} degrees of freedom reduced to {quality['modes']} modes, largest error against "
        f"the full model {100.0 * quality['max_relative_error']:.2g} % (to 1000 Hz)"
    )
