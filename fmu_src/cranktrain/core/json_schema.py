"""JSON schemas (draft 7) of the tables that :mod:`cranktrain.core.typed_file` reads, for editors and checkers."""

from collections.abc import Mapping
from typing import Any

import msgspec

from cranktrain.core.typed_file import Table

DRAFT = "http://json-schema.org/draft-07/schema#"


def json_schema(kind: type[Table], title: str, further: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """JSON schema of a file whose top-level table is ``kind``; ``further`` has more rules of tables by class name."""
    (_,), tables = msgspec.json.schema_components((kind,), ref_template="#/definitions/{name}")
    tables = {name: {**_without_null(table), **further.get(name, {})} for name, table in tables.items()}
    whole = tables.pop(kind.__name__)
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
