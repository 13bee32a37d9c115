"""The verb ``report``: all results for an engine as one HTML file."""

import os
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from urllib.parse import quote

from cranktrain.cli.console import Interrupted, say, stages
from cranktrain.cli.functions import verb
from cranktrain.cli.run_options import engine_of, option_of
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult
from cranktrain.store.whole_file import check_place, marked, whole_file
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option

if TYPE_CHECKING:
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
"""Folders with results of ``tradeoff`` and ``stability``, to which the report has links."""
METHODS = {
    "accuracy against speed of computation": ("tradeoff.html", "overall.png"),
    "stability maps": ("oil_whirl.png", "cold_start.png"),
}
"""Titles of links, each with its possible files; the link leads to the first one that exists."""
RUNNING = ("drive_line", "pressure", "pressure_unit", "pressure_tdc_deg", "load")
"""Options of the report that the commands of its sections repeat."""
AGAIN = (
    "output",
    "run_up",
    "results",
    "make",
    "measured",
    "from_rpm",
    "to_rpm",
    "orders",
    "log",
    "linear",
    "peak_to_peak",
    "quick",
)
"""Further options of the report, which its own command repeats."""


@dataclass(frozen=True, kw_only=True)
class Report(words.Pressures, words.Charts):
    """Question of :func:`report`."""

    output: Annotated[words.File | None, Option("FILE.html", "default ENGINE_report.html")] = None
    run_up: Annotated[
        words.File | None, Option("FILE", "result of 'cranktrain runup' of the engine: orders with films, axial motion")
    ] = None
    results: Annotated[
        Sequence[words.File],
        Option(
            "FOLDER",
            "folder that other verbs wrote pictures and results into, by --plots or --output; may be given several "
            "times",
            repeated=True,
            was="--pictures",
        ),
    ] = ()
    make: Annotated[
        words.File | None,
        Option(
            "FOLDER",
            "run the verbs whose data is missing, one after the other, into this folder; what it holds is kept and an "
            "interrupted run-up goes on (minutes to an hour)",
        ),
    ] = None
    measured: Annotated[
        words.File | None,
        Option(
            "FILE",
            "measured orders, drawn over the computed ones: columns speed_rpm, order, amplitude, unit, zero to peak, "
            "as 'cranktrain measured' writes them, or curves over speed of a UFF file",
        ),
    ] = None
    from_rpm: Annotated[
        words.Rpm | None,
        Option("RPM", "lowest speed, rev/min (default: lowest of oil.temperature_speeds)", "--from", was="--speeds"),
    ] = None
    to_rpm: Annotated[
        words.Rpm | None,
        Option("RPM", "highest speed, rev/min (default: a sixth above that of oil.temperature_speeds)", "--to"),
    ] = None
    load: words.Share | None = None
    quick: Annotated[bool, Option(help="torsion at fewer speeds, linear, without inherited damping")] = False


@verb(Report, DESCRIPTION)
def report(named: str | Path | Engine, ask: Report) -> VerbResult:
    """Compute and read the contents, and write the report. Return its path and the missing sections."""
    from cranktrain.core.units import RPM
    from cranktrain.results.figures import check_folder
    from cranktrain.studies.constant_speed import Request
    from cranktrain.studies.report.findings import steps
    from cranktrain.studies.report.page import REPORT, missing, page, pending

    engine = engine_of(named, ask)
    asked = _asked(_name(named, ask), ask, engine)
    path = Path(ask.output or f"{engine.name}_report.html")
    check_place(path, REPORT)
    if ask.make is not None:
        check_folder(Path(ask.make), "--make")
    choices = {key: getattr(ask, key) for key in ("pressure", "pressure_unit", "pressure_tdc_deg")}
    gas = Request(speed_rpm=engine.best_speed / RPM, load=asked.load, **choices).gas(engine, option_of)
    links, found = _links(path), None

    def written(made: "Findings") -> "Findings":
        made = replace(made, links=links)
        with whole_file(path, REPORT) as temporary:
            temporary.write_text(page(made), encoding="utf-8")
        return made

    try:
        with stages(engine.name) as tell:
            for made in steps(asked, engine, gas, tell):
                found = written(made)
        assert found is not None
        for made in _make(found, str(ask.make)) if asked.makes else ():
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
    return VerbResult.of({"report": str(path), "missing": lacking, "seconds": found.seconds}, "report")


def show(found: VerbResult) -> None:
    """Print the missing sections, and the path of the report."""
    for title, remedy in found["missing"].items():
        print(f"Not in the report: {title}. To include it: {remedy}")
    print(f"Report: {found['report']}")


def _name(named: str | Path | Engine, ask: Report) -> str:
    """Name of the engine for commands; an engine in memory is first written next to the report or its results."""
    if not isinstance(named, Engine):
        return str(named)
    folder = Path(ask.make) if ask.make is not None else Path(str(ask.output or "")).parent
    path = folder / f"{named.name}_reported.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path, marked("engine file", "[crankshaft]")) as temporary:
        temporary.write_text(named.to_toml(), encoding="utf-8")
    return str(path)


def _asked(name: str, ask: Report, engine: Engine) -> "Asked":
    """Request of the report from its options. Full load is passed on to verbs that would otherwise use the engine's."""
    from cranktrain.studies.report.findings import Asked, speed_bounds

    folders = [Path(folder) for folder in ask.results]
    if ask.make is not None:
        folders.append(Path(ask.make))
    full = ("--load", "1") if ask.load is None and engine.load is not None else ()
    return Asked(
        name, ask.run_up, folders, ask.quick, ask.measured,
        speed_bounds(engine, ask.from_rpm, ask.to_rpm),
        1.0 if ask.load is None else ask.load,
        (*_words(ask, RUNNING), *full), tuple(_words(ask, AGAIN)), ask.make is not None,
        words.orders_of(ask.orders), ask.logarithmic, ask.peak_to_peak,
    )  # fmt: skip


def _words(ask: Report, fields: Sequence[str]) -> Iterator[str]:
    """Options that were given, as arguments of a command."""
    for field in fields:
        value = getattr(ask, field)
        if value is True:
            yield option_of(field)
        elif field == "orders":
            yield from (option_of(field), ",".join(f"{one:g}" for one in value)) if value else ()
        elif field == "results":
            for folder in value:
                yield from (option_of(field), folder)
        elif value not in (None, False):
            yield option_of(field)
            listed = value if isinstance(value, tuple) else (value,)
            yield from (f"{one:g}" if isinstance(one, float) else str(one) for one in listed)


def _links(report: Path) -> dict[str, str]:
    """Links to existing pages on the methods: paths relative to the report, by title."""
    there = {name: folder / name for folder in reversed(FOLDERS) if folder.is_dir() for name in os.listdir(folder)}
    found = {}
    for title, names in METHODS.items():
        paths = [there[name] for name in names if name in there]
        if paths:
            found[title] = quote(os.path.relpath(paths[0], report.absolute().parent).replace(os.sep, "/"))
    return found


def _make(found: "Findings", folder: str) -> "Iterator[Findings]":
    """Run the commands of sections without data, each once and as a process; yields the contents after each.

    If a command fails, only its section is missing.
    """
    from cranktrain.studies.report.findings import files_of_verbs
    from cranktrain.studies.report.sections import SECTIONS

    lacking = [section for section in SECTIONS if not section.make(found)]
    commands = dict.fromkeys(text for section in lacking for text in section.making(found, folder))
    for k, command in enumerate(commands, 1):
        say(f"{k} of {len(commands)}: {command}")
        given, began = shlex.split(command)[1:], time.perf_counter()
        done = subprocess.run([sys.executable, "-m", "cranktrain.cli.main", *given], stdout=subprocess.DEVNULL)
        if done.returncode:
            say(f"cranktrain: warning: ended with code {done.returncode}, so its results are missing: {command}")
            continue
        name = f"cranktrain {given[0]}{' --damper' if '--damper' in given else ''}"
        seconds = found.seconds | {name: time.perf_counter() - began}
        found = replace(found, seconds=seconds, **files_of_verbs(found.engine, found.asked))
        yield found
