"""Reduced bodies that an engine file takes from files of their own."""

from __future__ import annotations

from pathlib import Path

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.engine.model import Engine


def read_added(engine: Engine) -> dict[str, ReducedBody]:
    """The bodies of an engine that lie in files, by name; ``InputError`` where one is not there or no body."""
    from cranktrain.structure.fem.own_body import is_body, read_body

    found = {}
    for table in engine.body:
        if table.file:
            if not (Path(table.file).exists() and is_body(table.file)):
                raise InputError(
                    f"body '{table.name}': {table.file} is no reduced body; write one by 'cranktrain reduce'"
                )
            found[table.name] = read_body(table.file)
    return found
