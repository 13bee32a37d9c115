"""JSON schemas of the files that people write, made of the tables by which the program reads them.

An editor that knows the schema of a TOML file completes keys, shows what a value measures and its range, and marks what
the program would refuse. What needs the whole file (whether parts fit together) is the program's alone.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.json_schema import json_schema
from cranktrain.engine.entries import rules
from cranktrain.engine.file import engine_table
from cranktrain.modules.combustion import file as combustion
from cranktrain.modules.valve_train import file as valve_train
from cranktrain.structure.fem.superelement_file import SuperelementTable
from cranktrain.studies.harness.tables import HarnessTable
from cranktrain.studies.scene import SceneTable


class FileKind(NamedTuple):
    """A kind of file: title of its schema, and its table."""

    title: str
    table: Callable[[], Any]


FILE_KINDS = {
    "engine": FileKind("Engine file of cranktrain", engine_table),
    "scene": FileKind("Scene of cranktrain", lambda: SceneTable),
    "harness": FileKind("Harness file of cranktrain", lambda: HarnessTable),
    "superelement": FileKind("Superelement of cranktrain", lambda: SuperelementTable),
    "combustion": FileKind("Combustion module of cranktrain", lambda: combustion.FILE.document),
    "valve-train": FileKind("Valve train module of cranktrain", lambda: valve_train.FILE.document),
}


def file_schema(kind: str) -> dict[str, Any]:
    """JSON schema, draft 7, of a kind of file; ``InputError`` for one that does not exist."""
    if kind not in FILE_KINDS:
        raise InputError(f"no kind of file is named '{kind}'; {nearest(kind, FILE_KINDS)}")
    title, table = FILE_KINDS[kind]
    return json_schema(table(), title, rules())
