"""The verb ``export``: result and run-up files as CSV, Parquet or NumPy's archive."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cranktrain.cli.console import bar, say
from cranktrain.cli.functions import Subject, verb
from cranktrain.core.user_file import user_path
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question

DESCRIPTION = """\
Write a result or run-up file as a table: CSV, Parquet (needs pyarrow) or NumPy's archive.

The table of a run has one row per sample; that of a run-up one row per speed, with amplitude and phase of every order.
Values are in SI units, which the headings name: "pulley.torsion [rad]". An existing file is replaced only if it is a
table written by cranktrain.
"""


FILE = Subject("file", "FILE.h5", "result of simulate or run, or a run-up")


@dataclass(frozen=True, kw_only=True)
class Export(Question):
    """Question of :func:`export`."""

    to: Annotated[words.File, Option("TABLE", "table.csv, table.parquet or table.npz")]
    group: Annotated[str, Option("NAME", "group of a scene's file, e.g. 2000rpm")] = ""


@verb(Export, DESCRIPTION, FILE)
def export(file: str | Path, ask: Export) -> VerbResult:
    """Write the table. Return its size, and the parts of the file that it does not contain."""
    from cranktrain.results import export as tables

    with bar(f"{ask.to}") as advance:
        found = tables.export(str(user_path(file)), str(ask.to), ask.group, advance)
    if found["left_out"]:
        say(f"left out, because not sampled over time: {', '.join(found['left_out'])}")
    return VerbResult.of(found, "export")


def show(found: VerbResult) -> None:
    """Print the table's size."""
    print(f"{found['table']}: {found['rows']} rows, {found['columns']} columns")
