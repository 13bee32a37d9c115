"""The verb ``report``: what is known of an engine, as one HTML file."""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import say, stages
from cranktrain.cli.run_options import add_source_options, engine_of, option_of
from cranktrain.store.whole_file import check_place, whole_file

if TYPE_CHECKING:
    from cranktrain.studies.report.findings import Findings

DESCRIPTION = """\
Report of an engine as one HTML file: frequencies and critical speeds beside the reference's, vibration, origins.

Origins are the sources of the engine's values. The page needs no network, can be printed, and fits the screen of a
telephone. Results that take only seconds are computed; the others are read from files of other verbs. A section without
its data says which commands make them; --make FOLDER runs these.
"""
FOLDERS = tuple(Path(place) for place in ("out/tradeoff", "out/stability", "docs/tradeoff", "docs/stability"))
"""Where pictures of ``tradeoff`` and ``stability`` are, if nothing else is said."""
SOURCES = ("drive_line", "pressure", "pressure_unit", "pressure_tdc_deg")
RUNNING = ("runup", "simulate", "stress", "fatigue")
"""Verbs of the commands of ``--make`` that take a measured pressure and a drive line."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("engine", metavar="ENGINE", help="name of a shipped engine (diesel_i6) or path of a .toml file")
    add("--output", metavar="FILE.html", help="default ENGINE_report.html")
    add("--run-up", metavar="FILE", help="result of 'cranktrain runup' of the engine: orders with films, axial motion")
    add(
        "--pictures", metavar="FOLDER", action="append", default=[],
        help="folder that other verbs wrote pictures and run-ups into, by --plots or --output; may be given several "
        f"times (besides: {', '.join(map(str, FOLDERS))})",
    )  # fmt: skip
    add(
        "--make", metavar="FOLDER",
        help="run the verbs whose data is missing, one after the other, into this folder; what it holds is kept and "
        "an interrupted run-up goes on (minutes to an hour)",
    )  # fmt: skip
    add(
        "--measured", metavar="FILE.csv",
        help="measured orders, drawn over the computed ones: columns speed_rpm, order, amplitude, unit, zero to peak",
    )  # fmt: skip
    add_source_options(parser)
    add("--quick", action="store_true", help="torsion in seconds: fewer speeds, linear, without inherited damping")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Compute, read and write; say what is missing."""
    from cranktrain.results.figures import check_folder
    from cranktrain.studies.constant_speed import RPM, Request
    from cranktrain.studies.report.findings import files_of_verbs, findings
    from cranktrain.studies.report.page import REPORT, missing, page

    engine = engine_of(options)
    choices = {key: getattr(options, key) for key in ("pressure", "pressure_unit", "pressure_tdc_deg")}
    gas = Request(speed_rpm=engine.rated_speed / RPM, **choices).gas(engine, option_of)
    path = Path(options.output or f"{engine.name}_report.html")
    check_place(path, REPORT)
    folders = [Path(folder) for folder in options.pictures]
    if options.make is not None:
        check_folder(Path(options.make), "--make")
        folders.append(Path(options.make))
    folders += [folder for folder in FOLDERS if folder.is_dir()]
    with stages(engine.name) as tell:
        found = findings(options.engine, options.run_up, folders, options.quick, tell, options.measured, engine, gas)
    if options.make is not None:
        seconds = _make(found, options)
        found = replace(found, seconds=found.seconds | seconds, **files_of_verbs(engine, options.run_up, folders))
    lacking = missing(found)
    with whole_file(path, REPORT) as temporary:
        temporary.write_text(page(found), encoding="utf-8")
    if not options.json:
        for title, remedy in lacking.items():
            print(f"Not in the report: {title}. To include it: {remedy}")
        print(f"Report: {path}")
    return {"report": str(path), "missing": lacking, "seconds": found.seconds}


def _make(found: Findings, options: argparse.Namespace) -> dict[str, float]:
    """Run what makes the sections that lack their data, each command once, as processes; their seconds.

    One that fails costs its section, not the report.
    """
    from cranktrain.studies.report.sections import SECTIONS

    lacking = [section for section in SECTIONS if not section.make(found)]
    commands = dict.fromkeys(
        text for section in lacking for text in section.making(options.engine, options.make, found.engine)
    )
    sources = {option_of(key): getattr(options, key) for key in SOURCES if getattr(options, key) is not None}
    given = [str(word) for pair in sources.items() for word in pair]
    seconds = {}
    for k, command in enumerate(commands, 1):
        say(f"{k} of {len(commands)}: {command}")
        words, began = shlex.split(command)[1:], time.perf_counter()
        words += given if words[0] in RUNNING else []
        done = subprocess.run([sys.executable, "-m", "cranktrain.cli.main", *words], stdout=subprocess.DEVNULL)
        if done.returncode:
            say(f"cranktrain: warning: ended with code {done.returncode}, so its results are missing: {command}")
        else:
            seconds[f"cranktrain {words[0]}{' --damper' if '--damper' in words else ''}"] = time.perf_counter() - began
    return seconds
