"""The verb ``schema``: the JSON schema of a kind of file, for editors."""

import json
from dataclasses import KW_ONLY, dataclass
from typing import Annotated, Any

from cranktrain.cli.console import say
from cranktrain.cli.functions import verb_alone
from cranktrain.results.views.found import VerbResult
from cranktrain.store.whole_file import marked, whole_file
from cranktrain.studies.file_schemas import FILE_KINDS, file_schema
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question

DESCRIPTION = f"""\
The JSON schema of a kind of file: {", ".join(FILE_KINDS)}.

An editor that knows it completes keys, shows ranges and marks wrong values. Name it in the first line of a file,
#:schema ./engine.schema.json
"""
KIND = marked("JSON schema", "http://json-schema.org/")


@dataclass(frozen=True)
class Schema(Question):
    """Question of :func:`schema`."""

    kind: Annotated[str, Option("KIND", f"of file: {', '.join(FILE_KINDS)}", place=True)]
    _: KW_ONLY
    output: Annotated[
        words.File | None, Option("FILE", "write it to a file, engine.schema.json, in place of printing it")
    ] = None


@verb_alone(Schema, DESCRIPTION)
def schema(ask: Schema) -> VerbResult:
    """Make the schema, and write it to a file if one is named."""
    made = file_schema(ask.kind)
    if ask.output:
        with whole_file(ask.output, KIND) as path:
            path.write_text(_text(made) + "\n", encoding="utf-8")
        say(f"wrote {ask.output}")
    return VerbResult.of(made, "schema", written=bool(ask.output))


def show(made: VerbResult) -> None:
    """Print the schema, unless it was written."""
    if not made.beside["written"]:
        print(_text(made))


def _text(made: dict[str, Any]) -> str:
    return json.dumps(made, indent=1, allow_nan=False)
