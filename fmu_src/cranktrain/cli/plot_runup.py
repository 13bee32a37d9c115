"""The verb ``plot-runup``: pictures of a run-up's file, with measured orders laid over."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import say, show, taking
from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.user_file import user_path
from cranktrain.engine.file import load_engine

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cranktrain.engine.model import Engine
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
HIGHEST = 1000.0
"""Highest order that a run-up may have."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("file", metavar="FILE.h5", help="result of cranktrain runup or simulate")
    add("others", nargs="*", default=[], metavar="OTHER.h5", help="results of the same kind, laid over it")
    add("--plots", default="plots", metavar="DIR", help="folder for the pictures (default plots)")
    add("--measured", metavar="FILE", help="measured orders, drawn over the computed ones; table or UFF 58")
    add("--with-damper", metavar="FILE.h5", help="run-up of the same engine with its damper, drawn below it")
    add_chart_options(parser)
    add("--outputs", metavar="NAMES", help="of results laid over each other and of results of simulate: outputs, a "
        "picture each, separated by commas (default pulley.torsion)")  # fmt: skip
    add("--engine", metavar="ENGINE", help="engine file, if the one that the run-up names has moved")


def add_chart_options(parser: argparse.ArgumentParser) -> None:
    """Add how orders over the speed are drawn."""
    add = parser.add_argument
    add(
        "--orders", type=order_list, default=[], metavar="LIST",
        help="orders to be drawn, separated by commas, e.g. 4.5,6 (default: the strongest)",
    )  # fmt: skip
    add(
        "--log", action="store_true",
        help="amplitudes on a logarithmic scale (default: where resonances are below a twentieth of the largest)",
    )  # fmt: skip
    add("--linear", action="store_true", help="amplitudes on a linear scale whatever they are")
    add("--peak-to-peak", action="store_true", help="amplitudes peak to peak in place of zero to peak")


def scale_of(options: argparse.Namespace) -> bool | None:
    """Whether amplitudes are drawn on a logarithmic scale; None: as the data need it. ``InputError`` for both."""
    if options.log and options.linear:
        raise InputError("--log and --linear ask for two scales; leave one of them out")
    return True if options.log else False if options.linear else None


@taking("str | Sequence[float]")
def order_list(text: str) -> list[float]:
    """Type of an option whose value are orders, multiples of a half; sorted, each once."""
    try:
        orders = [float(word) for word in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no list of orders; give numbers, e.g. 4.5,6") from None
    for order in orders:
        if not (0.5 <= order <= HIGHEST and (2.0 * order).is_integer()):
            raise argparse.ArgumentTypeError(f"order {order:g} is not a multiple of 0.5 up to {HIGHEST:g}")
    return sorted(set(orders))


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Draw what the file holds; modes over the speed where its engine is at hand."""
    from cranktrain.results.orders.measured import read_measured_orders
    from cranktrain.results.run_up.run_up import RunUp
    from cranktrain.store.hdf5 import is_run_up

    log = scale_of(options)
    if options.others or not is_run_up(user_path(options.file)):
        return _overlaid(options, log)
    if options.outputs is not None:
        raise InputError("--outputs goes with several files, or with a result of simulate; leave it out")
    run_up = RunUp.load(options.file)
    for order in options.orders:
        run_up.order(order)  # refuses one that the file does not have
    damped = RunUp.load(options.with_damper) if options.with_damper else None
    measured = read_measured_orders(options.measured) if options.measured else None
    folder = pictures_folder(options.plots)
    name = options.engine or str(run_up.attributes.get("engine", ""))
    engine = None
    try:
        engine = load_engine(name)
    except CranktrainError as error:
        if options.engine:
            raise
        say(f"cranktrain: warning: no published speeds and no Campbell diagram: {error}; give --engine")
    rows = told_deviations(run_up, measured, options.json) if measured else []
    paths = draw(folder, run_up, engine, measured, damped, style=options)
    if not options.json:
        print("\n".join(paths))
    return {"plots": paths, "deviations": rows} if measured else {"plots": paths}


def _overlaid(options: argparse.Namespace, log: bool | None) -> dict[str, Any]:
    """Draw results of one kind into one picture an output."""
    from cranktrain.results.figures import check_folder
    from cranktrain.results.overlays import file_name, save_overlays
    from cranktrain.results.run_up.run_up import TORSION, RunUp
    from cranktrain.results.views.loaded import load_run

    for name in ("measured", "with_damper", "engine"):
        if getattr(options, name) is not None:
            raise InputError(f"--{name.replace('_', '-')} goes with one run-up; leave it out, or name that file alone")
    paths = [str(options.file), *map(str, options.others)]
    if twice := [path for path in dict.fromkeys(paths) if paths.count(path) > 1]:
        raise InputError(f"{twice[0]} is named twice; name different files")
    results: dict[str, Any] = {path: load_run(path) for path in paths}
    if options.orders and not all(isinstance(one, RunUp) for one in results.values()):
        raise InputError("--orders goes with run-ups; a run's picture has all its orders")
    outputs = [name for name in (options.outputs or TORSION).split(",") if name]
    folder = Path(options.plots)
    check_folder(folder, pictures=[file_name(name) for name in outputs])
    made = save_overlays(folder, results, outputs, options.orders, log, options.peak_to_peak)
    if not options.json:
        print("\n".join(map(str, made)))
    return {"plots": [str(path) for path in made]}


def told_deviations(run_up: RunUp, measured: Measured, quiet: bool) -> list[dict[str, Any]]:
    """Deviations of the computed from the measured orders; shown unless ``quiet``."""
    from cranktrain.results.orders.deviations import check_measured, deviation_table, deviations, of_another_engine

    check_measured(run_up, measured)
    rows = deviations(run_up, measured)
    if not rows:
        say("cranktrain: warning: the run-up has none of the measured orders")
    elif doubt := of_another_engine(rows):
        say(f"cranktrain: warning: {doubt}")
    if rows and not quiet:
        show(deviation_table(rows))
    return rows


def pictures_folder(path: str) -> Path:
    """Folder in which pictures may be written; ``InputError`` where they may not."""
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
    style: argparse.Namespace | None = None,
) -> list[str]:
    """Draw a run-up, with ``motion`` peaks that have the torsional mode in motion; returns the pictures' paths.

    ``style`` are options of :func:`add_chart_options`.
    """
    from cranktrain.results.run_up.figures import save_run_up_pictures
    from cranktrain.results.run_up.plot_data import Beside
    from cranktrain.results.strength.iacs_m68 import has_sections, shaft_stresses
    from cranktrain.studies.run_up.modes import run_up_modes

    chosen = {} if style is None else {"orders": style.orders, "log": scale_of(style)}
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
