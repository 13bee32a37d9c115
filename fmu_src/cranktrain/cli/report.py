"""The verb ``report``: what is known of an engine, as one HTML file."""

from __future__ import annotations

import argparse
import os
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from cranktrain.cli.console import Interrupted, number, say, stages
from cranktrain.cli.plot_runup import add_chart_options, scale_of
from cranktrain.cli.run_options import add_source_options, engine_of, option_of
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain.store.whole_file import check_place, whole_file

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.studies.report.findings import Asked, Findings

DESCRIPTION = """\
Report of an engine as one HTML file: verdict against the limits of its file, frequencies, vibration, bearings, origins.

Origins are the sources of the engine's values. The page needs no network, can be printed, and fits the screen of a
telephone. Frequencies and torsion over the speed are computed: without --quick this takes minutes, and gigabytes of
memory for the finite elements. The other results are read from files of other verbs. A section without its data says
which commands make them; --make FOLDER runs these. The page is written after every step, so an interrupted report has
what was made. Its last section lists the time of each stage and the memory.
"""
FOLDERS = tuple(Path(place) for place in ("out/tradeoff", "out/stability", "docs/tradeoff", "docs/stability"))
"""Where results of ``tradeoff`` and ``stability`` are, which the report links to."""
METHODS = {
    "accuracy against speed of computation": ("tradeoff.html", "overall.png"),
    "stability maps": ("oil_whirl.png", "cold_start.png"),
}
"""Titles of links and the files that they lead to, the first that exists."""
RUNNING = ("drive_line", "pressure", "pressure_unit", "pressure_tdc_deg", "load")
"""Options that commands of sections take over."""
AGAIN = (
    "output",
    "run_up",
    "pictures",
    "make",
    "measured",
    "speeds",
    "orders",
    "log",
    "linear",
    "peak_to_peak",
    "quick",
)
"""Further options of the report, which its own command repeats."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("engine", metavar="ENGINE", help="name of a shipped engine (diesel_i6) or path of a .toml file")
    add("--output", metavar="FILE.html", help="default ENGINE_report.html")
    add("--run-up", metavar="FILE", help="result of 'cranktrain runup' of the engine: orders with films, axial motion")
    add(
        "--pictures", metavar="FOLDER", action="append", default=[],
        help="folder that other verbs wrote pictures and results into, by --plots or --output; may be given several "
        "times",
    )  # fmt: skip
    add(
        "--make", metavar="FOLDER",
        help="run the verbs whose data is missing, one after the other, into this folder; what it holds is kept and "
        "an interrupted run-up goes on (minutes to an hour)",
    )  # fmt: skip
    add(
        "--measured", metavar="FILE",
        help="measured orders, drawn over the computed ones: columns speed_rpm, order, amplitude, unit, zero to peak, "
        "as 'cranktrain measured' writes them, or curves over speed of a UFF file",
    )  # fmt: skip
    add_source_options(parser)
    speed = number(SLOWEST_RPM, FASTEST_RPM, "rev/min")
    add(
        "--speeds", nargs=2, type=speed, metavar=("LOW", "HIGH"),
        help="range of speeds, rev/min (default: that of oil.temperature_speeds, and a sixth beyond)",
    )  # fmt: skip
    add(
        "--load", type=number(0.0, 2.0, "of the full-load burn"), metavar="SHARE",
        help="fraction of the full-load burn (default 1)",
    )  # fmt: skip
    add_chart_options(parser)
    add("--quick", action="store_true", help="torsion at fewer speeds, linear, without inherited damping")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Compute, read and write; say what is missing."""
    from cranktrain.core.units import RPM
    from cranktrain.results.figures import check_folder
    from cranktrain.studies.constant_speed import Request
    from cranktrain.studies.report.findings import steps
    from cranktrain.studies.report.page import REPORT, missing, page, pending

    engine = engine_of(options)
    asked = _asked(options, engine)
    path = Path(options.output or f"{engine.name}_report.html")
    check_place(path, REPORT)
    if options.make is not None:
        check_folder(Path(options.make), "--make")
    choices = {key: getattr(options, key) for key in ("pressure", "pressure_unit", "pressure_tdc_deg")}
    gas = Request(speed_rpm=engine.best_speed / RPM, load=asked.load, **choices).gas(engine, option_of)
    links, found = _links(path), None

    def written(made: Findings) -> Findings:
        made = replace(made, links=links)
        with whole_file(path, REPORT) as temporary:
            temporary.write_text(page(made), encoding="utf-8")
        return made

    try:
        with stages(engine.name) as tell:
            for made in steps(asked, engine, gas, tell):
                found = written(made)
        assert found is not None
        for made in _make(found, options.make) if asked.makes else ():
            found = written(made)
        found = written(replace(found, running=False))
    except KeyboardInterrupt:
        if found is None:
            raise
        left = ", ".join(pending(found)) or "nothing"
        raise Interrupted(
            f"interrupted; {path} has what was made, without: {left}; run the same command again"
        ) from None
    lacking = missing(found)
    if not options.json:
        for title, remedy in lacking.items():
            print(f"Not in the report: {title}. To include it: {remedy}")
        print(f"Report: {path}")
    return {"report": str(path), "missing": lacking, "seconds": found.seconds}


def _asked(options: argparse.Namespace, engine: Engine) -> Asked:
    """What the options ask for, with their words; full load is told to verbs that would balance the engine's own."""
    from cranktrain.studies.report.findings import Asked, check_speeds

    folders = [Path(folder) for folder in options.pictures]
    if options.make is not None:
        folders.append(Path(options.make))
    full = ("--load", "1") if options.load is None and engine.load is not None else ()
    return Asked(
        options.engine, options.run_up, folders, options.quick, options.measured,
        None if options.speeds is None else check_speeds(*options.speeds),
        1.0 if options.load is None else options.load,
        (*_words(options, RUNNING), *full), tuple(_words(options, AGAIN)), options.make is not None,
        tuple(options.orders), scale_of(options), options.peak_to_peak,
    )  # fmt: skip


def _words(options: argparse.Namespace, fields: Sequence[str]) -> Iterator[str]:
    """Options that were given, as words of a command."""
    for field in fields:
        value = getattr(options, field)
        if value is True:
            yield option_of(field)
        elif field == "orders":
            yield from (option_of(field), ",".join(f"{one:g}" for one in value)) if value else ()
        elif field == "pictures":
            for folder in value:
                yield from (option_of(field), folder)
        elif value not in (None, False):
            yield option_of(field)
            yield from (f"{one:g}" if isinstance(one, float) else str(one) for one in _listed(value))


def _listed(value: object) -> list[object]:
    return value if isinstance(value, list) else [value]


def _links(report: Path) -> dict[str, str]:
    """Pages on the methods that exist, by their titles, as seen from the report."""
    there = {name: folder / name for folder in reversed(FOLDERS) if folder.is_dir() for name in os.listdir(folder)}
    found = {}
    for title, names in METHODS.items():
        paths = [there[name] for name in names if name in there]
        if paths:
            found[title] = quote(os.path.relpath(paths[0], report.absolute().parent).replace(os.sep, "/"))
    return found


def _make(found: Findings, folder: str) -> Iterator[Findings]:
    """Run what makes the sections that lack their data, each command once, as processes; the report after each.

    One that fails costs its section, not the report.
    """
    from cranktrain.studies.report.findings import files_of_verbs
    from cranktrain.studies.report.sections import SECTIONS

    lacking = [section for section in SECTIONS if not section.make(found)]
    commands = dict.fromkeys(text for section in lacking for text in section.making(found, folder))
    for k, command in enumerate(commands, 1):
        say(f"{k} of {len(commands)}: {command}")
        words, began = shlex.split(command)[1:], time.perf_counter()
        done = subprocess.run([sys.executable, "-m", "cranktrain.cli.main", *words], stdout=subprocess.DEVNULL)
        if done.returncode:
            say(f"cranktrain: warning: ended with code {done.returncode}, so its results are missing: {command}")
            continue
        name = f"cranktrain {words[0]}{' --damper' if '--damper' in words else ''}"
        seconds = found.seconds | {name: time.perf_counter() - began}
        found = replace(found, seconds=seconds, **files_of_verbs(found.engine, found.asked))
        yield found
