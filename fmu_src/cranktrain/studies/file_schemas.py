"""JSON schemas of the users' files, made from the tables with which the program reads them.

An editor with the schema of a TOML file completes keys, shows the quantity of a value and its range, and marks input
that the program would refuse. Only the program makes checks that need the whole file (whether parts fit together).
"""

from typing import Any, NamedTuple

from cranktrain import lab
from cranktrain.core.errors import InputError, nearest
from cranktrain.core.named import resolve


class FileKind(NamedTuple):
    """Kind of a user's file: title of the schema, and the table of its keys or a function that makes it."""

    title: str
    table: str


FILE_KINDS = {
    "engine": FileKind("Engine file of cranktrain", "cranktrain.engine.file:engine_table"),
    "scene": FileKind("Scene of cranktrain", "cranktrain.studies.scene:SceneTable"),
    "superelement": FileKind(
        "Superelement of cranktrain", "cranktrain.structure.fem.superelement_file:SuperelementTable"
    ),
    "combustion": FileKind("Combustion module of cranktrain", "cranktrain.modules.combustion.file:FILE.document"),
    "valve-train": FileKind("Valve train module of cranktrain", "cranktrain.modules.valve_train.file:FILE.document"),
    **{name: FileKind(*row) for name, row in lab.FILE_KINDS.items()},
}


def file_schema(kind: str) -> dict[str, Any]:
    """JSON schema, draft 7, of a kind of file; ``InputError`` for an unknown kind."""
    from cranktrain.core.json_schema import json_schema
    from cranktrain.engine.entries import rules

    if kind not in FILE_KINDS:
        raise InputError(f"no kind of file is named '{kind}'; {nearest(kind, FILE_KINDS)}")
    title, table = FILE_KINDS[kind]
    found = resolve(table)
    return json_schema(found if isinstance(found, type) else found(), title, rules())
