"""The verb ``report``: what is known of an engine, as one HTML file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cranktrain.cli.console import stages
from cranktrain.store.whole_file import check_place, whole_file

DESCRIPTION = """\
One HTML file of an engine: frequencies and critical speeds beside the reference's, vibration, origins of values.

It needs no network, prints, and is read on a telephone. What takes seconds is computed; the rest is read from files
of other verbs, and a section without its data says which command makes them.
"""
FOLDERS = (Path("out/tradeoff"), Path("out/stability"))
"""Where verbs write pictures if nothing else is said."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("engine", metavar="ENGINE", help="name of a shipped engine (diesel_i6) or path of a .toml file")
    add("--output", metavar="FILE.html", help="default ENGINE_report.html")
    add("--run-up", metavar="FILE", help="result of 'cranktrain runup' of the engine: orders with films, axial motion")
    add(
        "--pictures", metavar="FOLDER", action="append", default=[],
        help="folder that other verbs wrote pictures into, by --plots or --output; may be given several times "
        "(besides: out/tradeoff, out/stability)",
    )  # fmt: skip
    add("--quick", action="store_true", help="torsion at fewer speeds, linear, without inherited damping: seconds")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Compute, read and write; say what is missing."""
    from cranktrain.engine.file import load_engine
    from cranktrain.studies.report.findings import findings
    from cranktrain.studies.report.page import REPORT, missing, page

    engine = load_engine(options.engine)
    path = Path(options.output or f"{engine.name}_report.html")
    check_place(path, REPORT)
    folders = [Path(folder) for folder in options.pictures] + [folder for folder in FOLDERS if folder.is_dir()]
    with stages(engine.name) as tell:
        found = findings(options.engine, options.run_up, folders, options.quick, tell)
        lacking = missing(found)
        text = page(found)
    with whole_file(path, REPORT) as temporary:
        temporary.write_text(text, encoding="utf-8")
    if not options.json:
        for title, command in lacking.items():
            print(f"Not in the report: {title}. To have it: {command}")
        print(f"Report: {path}")
    return {"report": str(path), "missing": lacking, "seconds": found.seconds}
