"""The verb ``modal``: frequencies of crankshaft, cranktrain and block."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cranktrain.cli import console
from cranktrain.cli.bodies import own_mesh, wants_flexible_block
from cranktrain.cli.console import stages
from cranktrain.cli.functions import verb
from cranktrain.cli.run_options import engine_of, gas_of, request_of
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.core.units import RPM
from cranktrain.engine.drive_line_chain import read_drive_line
from cranktrain.engine.file import engine_provenance
from cranktrain.engine.firing import firing_summary, firing_text
from cranktrain.engine.levels import CRANKS, described
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain.results.views.frequencies import Frequencies
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option

if TYPE_CHECKING:
    from cranktrain.engine.torsional_chain import Chain


DESCRIPTION = """\
Free crankshaft and cranktrain frequencies beside the reference's, and critical speeds.

Two states of the cranktrain are shown. At rest it stands on stand-in springs, with its thrust bearing closed. In
motion it vibrates about the settled cycle of a run, whose films lock its journals: these are the modes that a run-up's
peaks belong to. Critical speeds are those of the orders that excite the first torsional mode, each with its excitation
over the largest one.

ENGINE may also be a table of discs and shafts (TOML or CSV, see cranktrain.engine.torsional_chain):
its natural frequencies, damping ratios, and rotations of the discs over the largest.
"""


@dataclass(frozen=True, kw_only=True)
class Modal(words.Pressures, words.Meshes):
    """Question of :func:`modal`."""

    damper: Annotated[bool, Option(help="also damped modes of the cranktrain with the engine's torsional damper")] = (
        False
    )
    crank: Annotated[
        words.CrankWord,
        Option(
            "LEVEL",
            f"{described(CRANKS.values())}; default solid; frequencies of other levels are compared with solid where "
            "that is made already",
            words=CRANKS.keys,
        ),
    ] = "solid"
    block: words.Block = "ground"
    block_mesh: words.OwnBlock | None = None
    bearings: Annotated[
        words.MainsWord,
        Option("LEVEL", "of the mains, for modes in motion (default as simulate)", words=words.mains),
    ] = "auto"
    speed_rpm: Annotated[
        float | None,
        between(SLOWEST_RPM, FASTEST_RPM, "rev/min"),
        Option("RPM", "speed for modes in motion, rev/min (default: combustion.best_speed)", "--speed"),
    ] = None


@verb(Modal, DESCRIPTION)
def modal(named: str | Path | Engine, ask: Modal) -> Frequencies:
    """Frequencies of the free crankshaft and the cranktrain, critical speeds, quality of the reduction."""
    from cranktrain.engine.torsional_chain import is_chain
    from cranktrain.studies import modal as study
    from cranktrain.studies.torsion.chain_modes import chain_report

    if not isinstance(named, Engine) and is_chain(named):
        return Frequencies.of(chain_report(_whole_chain(named)), "modal")
    engine = engine_of(named, ask)
    wants_flexible_block(engine, ask.block, own_mesh(ask.block_mesh, ask.mesh_unit))
    speed = engine.best_speed if ask.speed_rpm is None else ask.speed_rpm * RPM
    if ask.pressure is not None and ask.crank != "solid":
        raise InputError("--pressure drives the cycle of modes in motion, of --crank solid only; leave one of them out")
    gas = gas_of(request_of(ask, speed / RPM), engine)
    with stages(engine.name) as tell:
        report = study.modal(
            engine, ask.crank, ask.block, ask.damper,
            mesh=ask.mesh, block_mesh=ask.block_mesh, mesh_unit=ask.mesh_unit,
            bearings=ask.bearings, speed=speed, gas=gas, say=tell,
        )  # fmt: skip
    report["firing"] = firing_summary(engine)
    return Frequencies.of(report, "modal", engine=engine, named=named, mesh=ask.mesh)


def show(report: Frequencies) -> None:
    """Print the frequencies of a table of discs and shafts, of a crank of a lower level, or of the solid crank."""
    from cranktrain.studies.torsion.chain_modes import chain_table
    from cranktrain.studies.torsion.level_frequencies import level_tables
    from cranktrain.studies.torsion.line_modes import line_table

    if "engine" not in report.beside:
        console.show(chain_table(report))
        return
    engine, named = report.beside["engine"], report.beside["named"]
    print(firing_text(engine))
    if "left_out" in report:
        which = "All lists but those in motion and with added bodies" if "with_additions" in report else "All lists"
        print(f"{which} leave out the added {', '.join(report['left_out'])}.")
    if "level" not in report:
        _show_solid(engine, named, report)
        return
    for table in (*level_tables(engine, report), line_table(report["drive_line"])):
        console.show(table)
    if not report["compared_with_solid"] and report.beside["mesh"] is None:
        print(f"Not compared with the solid crank, which is not made yet; cranktrain reduce {named} makes it.")


def _show_solid(engine: Engine, named: str, report: Frequencies) -> None:
    """Print the frequencies of the solid crank, at rest and in motion."""
    from cranktrain.results.tables import block_tables, frequency_tables, named_text
    from cranktrain.studies.added_modes import additions_table
    from cranktrain.studies.in_motion.report import TORSIONAL, motion_table, springs_text, states_text
    from cranktrain.studies.torsion.damped_modes import damper_table
    from cranktrain.studies.torsion.line_modes import line_table

    motion, block = report["in_motion"], report.get("block")
    for table in [*frequency_tables(engine, report), *(block_tables(block) if block is not None else ())]:
        console.show(table)
    print(named_text(report["cranktrain"], report["sought_to_hz"]))
    console.show(line_table(report["drive_line"]))
    console.show(motion_table(motion))
    print(f"No modes in motion: {motion['failed']}" if "failed" in motion else f"{TORSIONAL}.")
    print(states_text(report))
    if "stand_in_springs" in report:
        print(springs_text(report["stand_in_springs"]))
    if "with_additions" in report:
        console.show(additions_table(report["with_additions"]))
    if "damper" in report:
        console.show(damper_table(report["damper"]))
    _say_quality("Reduction", report["reduction"])
    if block is not None:
        _say_quality("Block", block["reduction"])
    if count := sum(origin == "calibrated" for *_, origin, _ in engine_provenance(named)):
        print(f"{count} values of the engine file are calibrated; cranktrain report lists them with what they fit.")


def _whole_chain(path: str | Path) -> "Chain":
    """Table of discs and shafts as a complete system; ``InputError`` for a drive line names the option for it."""
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
