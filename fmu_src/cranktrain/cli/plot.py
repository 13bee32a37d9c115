"""The verb ``plot``: pictures of a run-up's file, with measured orders laid over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cranktrain.cli import console
from cranktrain.cli.console import say
from cranktrain.cli.functions import Subject, verb
from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.user_file import user_path
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, paths

if TYPE_CHECKING:
    from cranktrain.results.orders.measured import Measured
    from cranktrain.results.orders.resonances import Peak
    from cranktrain.results.run_up.run_up import RunUp

DESCRIPTION = """\
Pictures of a run-up: orders and twist over speed, named resonances, waterfall, colour map, Campbell diagram, motion.

The modes of the Campbell diagram are at rest, on the bearings' stand-in springs; the torsional mode in motion is in the
pictures of `cranktrain runup --plots`.

Twist, pulley against flywheel, is drawn where the file has the output flywheel.torsion.

Further files are laid over the first, all results of runup or all of simulate, with a colour a file: cycle and orders
of runs, or the strongest orders over the speed, a panel each. Other engines are allowed; the legend names the engines
and the choices that differ. A single result of simulate is drawn likewise.

Measured orders are read from a text file with the columns speed_rpm, order, amplitude, unit (phase_deg, band),
amplitudes zero to peak, or from curves over speed of a UFF file; `cranktrain measured --orders --output` writes such a
table. Their deviations from the computed orders are printed.
"""
FILE = Subject("file", "FILE.h5", "result of cranktrain runup or simulate")


@dataclass(frozen=True)
class Plot(words.Charts):
    """Question of :func:`plot`."""

    others: Annotated[
        words.File | Sequence[words.File], Option("OTHER.h5", "results of the same kind, laid over it", place=True)
    ] = ()
    _: KW_ONLY
    plots: Annotated[words.File, Option("DIR", "folder for the pictures (default plots)")] = "plots"
    measured: Annotated[
        words.File | None, Option("FILE", "measured orders, drawn over the computed ones; table or UFF 58")
    ] = None
    with_damper: Annotated[
        words.File | None, Option("FILE.h5", "run-up of the same engine with its damper, drawn below it")
    ] = None
    outputs: Annotated[
        str | None,
        Option(
            "NAMES",
            "of results laid over each other and of results of simulate: outputs, a picture each, separated by commas "
            "(default pulley.torsion)",
        ),
    ] = None
    engine: Annotated[
        words.File | Engine | None, Option("ENGINE", "engine file, if the one that the run-up names has moved")
    ] = None


@verb(Plot, DESCRIPTION, FILE)
def plot(file: str | Path, ask: Plot) -> VerbResult:
    """Draw all results of a file; with modes over the speed if the engine file is available."""
    from cranktrain.results.orders.measured import read_measured_orders
    from cranktrain.results.run_up.run_up import RunUp
    from cranktrain.store.hdf5 import is_run_up

    log = ask.logarithmic
    if ask.others or not is_run_up(user_path(file)):
        return _overlaid(str(user_path(file)), ask, log)
    if ask.outputs is not None:
        raise InputError("--outputs goes with several files, or with a result of simulate; leave it out")
    run_up = RunUp.load(user_path(file))
    for order in words.orders_of(ask.orders):
        run_up.order(order)  # refuses one that the file does not have
    damped = RunUp.load(ask.with_damper) if ask.with_damper else None
    measured = read_measured_orders(ask.measured) if ask.measured else None
    folder = pictures_folder(ask.plots)
    name = ask.engine or str(run_up.attributes.get("engine", ""))
    engine = None
    try:
        engine = load_engine(name)
    except CranktrainError as error:
        if ask.engine:
            raise
        say(f"cranktrain: warning: no published speeds and no Campbell diagram: {error}; give --engine")
    rows = told_deviations(run_up, measured) if measured else []
    paths = draw(folder, run_up, engine, measured, damped, style=ask)
    return VerbResult.of({"plots": paths, "deviations": rows} if measured else {"plots": paths}, "plot")


def show(found: VerbResult) -> None:
    """Print deviations from measured orders, and the pictures' paths."""
    from cranktrain.results.orders.deviations import deviation_table

    if found.get("deviations"):
        console.show(deviation_table(found["deviations"]))
    print("\n".join(found["plots"]))


def _overlaid(file: str, ask: Plot, log: bool | None) -> VerbResult:
    """Draw several results of one kind together, one picture for each output."""
    from cranktrain.results.figures import check_folder
    from cranktrain.results.overlays import file_name, save_overlays
    from cranktrain.results.run_up.run_up import TORSION, RunUp
    from cranktrain.results.views.loaded import load_run

    for name in ("measured", "with_damper", "engine"):
        if getattr(ask, name) is not None:
            raise InputError(f"--{name.replace('_', '-')} goes with one run-up; leave it out, or name that file alone")
    files = [file, *paths(ask.others)]
    if twice := [path for path in dict.fromkeys(files) if files.count(path) > 1]:
        raise InputError(f"{twice[0]} is named twice; name different files")
    results: dict[str, Any] = {path: load_run(path) for path in files}
    if ask.orders and not all(isinstance(one, RunUp) for one in results.values()):
        raise InputError("--orders goes with run-ups; a run's picture has all its orders")
    outputs = [name for name in (ask.outputs or TORSION).split(",") if name]
    folder = Path(ask.plots)
    check_folder(folder, pictures=[file_name(name) for name in outputs])
    made = save_overlays(folder, results, outputs, words.orders_of(ask.orders), log, ask.peak_to_peak)
    return VerbResult.of({"plots": [str(path) for path in made]}, "plot")


def told_deviations(run_up: RunUp, measured: Measured) -> list[dict[str, Any]]:
    """Deviations of the computed from the measured orders; prints doubts about the measurement."""
    from cranktrain.results.orders.deviations import check_measured, deviations, of_another_engine

    check_measured(run_up, measured)
    rows = deviations(run_up, measured)
    if not rows:
        say("cranktrain: warning: the run-up has none of the measured orders")
    elif doubt := of_another_engine(rows):
        say(f"cranktrain: warning: {doubt}")
    return rows


def pictures_folder(path: str | Path) -> Path:
    """Folder for pictures; ``InputError`` if they cannot be written there."""
    from cranktrain.results.figures import check_folder
    from cranktrain.results.run_up.figures import file_names

    folder = Path(path)
    check_folder(folder, pictures=file_names())
    return folder


def draw(
    folder: Path,
    run_up: RunUp,
    engine: Engine | None,
    measured: Measured | None = None,
    damped: RunUp | None = None,
    motion: Sequence[Peak] = (),
    style: words.Charts | None = None,
) -> list[str]:
    """Draw a run-up, with ``motion`` the peaks of the torsional mode in motion; returns the pictures' paths.

    ``style`` says how orders are drawn.
    """
    from cranktrain.results.run_up.figures import save_run_up_pictures
    from cranktrain.results.run_up.plot_data import Beside
    from cranktrain.results.strength.iacs_m68 import has_sections, shaft_stresses
    from cranktrain.studies.run_up.modes import run_up_modes

    chosen: dict[str, Any] = (
        {} if style is None else {"orders": words.orders_of(style.orders), "log": style.logarithmic}
    )
    beside = Beside(engine, None, measured, motion, **chosen)
    if engine is not None:
        try:
            beside = beside._replace(modes=run_up_modes(engine, run_up))
        except CranktrainError as error:
            say(f"cranktrain: warning: no Campbell diagram: {error}")
        if has_sections(engine):
            try:
                beside = beside._replace(stresses=shaft_stresses(engine, run_up))
            except CranktrainError as error:
                say(f"cranktrain: warning: no stress of shafts: {error}")
    title = engine.name if engine is not None else str(run_up.attributes.get("engine", "run-up"))
    doubled = style is not None and style.peak_to_peak
    return [str(path) for path in save_run_up_pictures(folder, run_up, beside, title, damped, doubled)]
