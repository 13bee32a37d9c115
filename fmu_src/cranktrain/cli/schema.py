"""The verb ``schema``: the JSON schema of a kind of file, for editors."""

from __future__ import annotations

import argparse
import json
from typing import Any

from cranktrain.cli.console import say
from cranktrain.store.whole_file import marked, whole_file
from cranktrain.studies.file_schemas import FILE_KINDS, file_schema

DESCRIPTION = f"""\
The JSON schema of a kind of file: {", ".join(FILE_KINDS)}.

An editor that knows it completes keys, shows ranges and marks wrong values. Name it in the first line of a file,
#:schema ./engine.schema.json
"""
KIND = marked("JSON schema", "http://json-schema.org/")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    parser.add_argument("kind", metavar="KIND", help=f"of file: {', '.join(FILE_KINDS)}")
    parser.add_argument(
        "--output", metavar="FILE", help="write it to a file, engine.schema.json, in place of printing it"
    )


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Make the schema; print it or write it."""
    schema = file_schema(options.kind)
    text = json.dumps(schema, indent=1, allow_nan=False)
    if options.output:
        with whole_file(options.output, KIND) as path:
            path.write_text(text + "\n", encoding="utf-8")
        say(f"wrote {options.output}")
    elif not options.json:
        print(text)
    return schema
