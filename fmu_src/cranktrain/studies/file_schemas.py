"""JSON schemas of the users' files, made from the tables with which the program reads them.

An editor with the schema of a TOML file completes keys, shows the quantity of a value and its range, and marks input
that the program would refuse. Only the program makes checks that need the whole file (whether parts fit together).
"""

from typing import Any, NamedTuple

from cranktrain import lab
from cranktrain.core.errors import InputError, nearest
from cranktrain.core.named import resolve

DRAFT = "http://json-schema.org/draft-07/schema#"


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
    import msgspec

    from cranktrain.engine.entries import rules

    if kind not in FILE_KINDS:
        raise InputError(f"no kind of file is named '{kind}'; {nearest(kind, FILE_KINDS)}")
    title, place = FILE_KINDS[kind]
    found = resolve(place)
    top = found if isinstance(found, type) else found()
    (_,), tables = msgspec.json.schema_components((top,), ref_template="#/definitions/{name}")
    further = rules()
    tables = {name: {**_without_null(table), **further.get(name, {})} for name, table in tables.items()}
    whole = tables.pop(top.__name__)
    return {"$schema": DRAFT, **whole, "title": title, "definitions": tables}


def _without_null(schema: Any) -> Any:
    """Schema without null (TOML has none) and without OpenAPI discriminators; numbers with a unit may be texts."""
    if isinstance(schema, list):
        return [_without_null(entry) for entry in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {key: entry for key, entry in schema.items() if key != "discriminator" and (key, entry) != ("default", None)}
    if "anyOf" in kept:
        kept["anyOf"] = [entry for entry in kept["anyOf"] if entry != {"type": "null"}]
        if len(kept["anyOf"]) == 1:
            kept |= kept.pop("anyOf")[0]
    if kept.get("type") == "number" and "pattern" in kept:
        kept["type"] = ["number", "string"]  # a value is a number or a text with unit; msgspec lists numbers only
    return {key: _without_null(entry) for key, entry in kept.items()}
