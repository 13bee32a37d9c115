"""The verb ``export``: result and run-up files as CSV, Parquet or NumPy's archive."""

from __future__ import annotations

import argparse
from typing import Any

from cranktrain.cli.console import bar, say

DESCRIPTION = """\
Write a result or run-up file as a table: CSV, Parquet (needs pyarrow) or NumPy's archive.

The table of a run has one row per sample; that of a run-up one row per speed, with amplitude and phase of every order.
Values are in SI units, which the headings name: "pulley.torsion [rad]". An existing file is replaced only if it is a
table written by cranktrain.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    parser.add_argument("file", metavar="FILE.h5", help="result of simulate or run, or a run-up")
    parser.add_argument("--to", required=True, metavar="TABLE", help="table.csv, table.parquet or table.npz")
    parser.add_argument("--group", default="", metavar="NAME", help="group of a scene's file, e.g. 2000rpm")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Write the table; its size, and what of the file is not in it."""
    from cranktrain.results.export import export

    with bar(f"{options.to}") as advance:
        found = export(options.file, options.to, options.group, advance)
    if found["left_out"]:
        say(f"left out, because not sampled over time: {', '.join(found['left_out'])}")
    if not options.json:
        print(f"{found['table']}: {found['rows']} rows, {found['columns']} columns")
    return found
