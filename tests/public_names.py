"""What users may rely on, as lines of text: names, parameters, options, variables, keys of files.

``python tests/public_names.py`` writes them to ``tests/data/public`` at a release. What stands there stays until the
next major release (``docs/public.md``, ``tests/regression/test_public_names.py``); further lines may come at any time.
"""

from __future__ import annotations

import argparse
import inspect
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cranktrain as ct

PLACE = Path(__file__).parent / "data" / "public"
KEYWORD = inspect.Parameter.KEYWORD_ONLY
STARRED = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
REQUIRED = "required"


def library() -> Iterator[str]:
    """Names of ``ct``, their parameters with kind and default, and public attributes of classes."""
    for name in sorted(ct.__all__):
        thing = getattr(ct, name)
        yield name
        if inspect.isclass(thing):
            yield from (f"{name}.{one}" for one in sorted(vars(thing)) if not one.startswith("_"))
        if callable(thing) and not (inspect.isclass(thing) and issubclass(thing, Exception)):
            yield from (f"{name}({parameter}" for parameter in _parameters(thing))
        if inspect.isclass(thing):
            for method, value in sorted(vars(thing).items()):
                if not method.startswith("_") and inspect.isfunction(value):
                    yield from (f"{name}.{method}({parameter}" for parameter in _parameters(value))


def _parameters(thing: Callable[..., Any]) -> Iterator[str]:
    for name, parameter in inspect.signature(thing).parameters.items():
        kind = "keyword" if parameter.kind is KEYWORD else "plain"
        if name == "self" or parameter.kind in STARRED:
            continue
        default = parameter.default
        stated = REQUIRED if default is parameter.empty else f"= {default!r}" if _is_plain(default) else "= an object"
        yield f"{name}) {kind}, {stated}"


def _is_plain(value: Any) -> bool:
    return value is None or isinstance(value, str | bool | int | float) or value == ()


def command_line() -> Iterator[str]:
    """Verbs, their arguments, options and choices; those of ``build_fmu.py`` are those of ``fmu``."""
    from cranktrain.cli.main import _parser
    from cranktrain.cli.verbs import VERBS

    whole = _parser(*VERBS)
    yield from _options("", whole)
    for verb, parser in sorted(parsers_of(whole)):
        yield from _options(verb, parser)


def parsers_of(whole: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Parsers of verbs, and of the kinds of a family, by name."""
    for action in whole._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, parser in action.choices.items():
                yield name, parser
                yield from ((f"{name} {kind}", one) for kind, one in parsers_of(parser))


def _options(verb: str, parser: argparse.ArgumentParser) -> Iterator[str]:
    yield verb or "cranktrain"
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction) or action.help == argparse.SUPPRESS:
            continue
        for name in sorted(action.option_strings) or [str(action.metavar or action.dest)]:
            yield f"{verb} {name}".strip()
            yield from sorted(f"{verb} {name} {choice}".strip() for choice in action.choices or ())


def fmu_variables() -> Iterator[str]:
    """Variables of the FMUs: name, causality, type, unit."""
    from cranktrain.fmu.archive import DESCRIPTION
    from cranktrain.fmu.description import read_interface
    from cranktrain.modules.register import MODULES

    folders = {"cranktrain": DESCRIPTION} | {name: module.folder for name, module in MODULES.items()}
    for model, folder in sorted(folders.items()):
        for variable in read_interface(folder, DESCRIPTION).variables:
            words = (variable.name, variable.causality, variable.type, variable.unit or "")
            yield f"{model}: {' '.join(words)}".rstrip()


def file_keys() -> Iterator[str]:
    """Keys of the files that users write, by kind, as the schemas have them."""
    from cranktrain.studies.file_schemas import FILE_KINDS, file_schema

    for kind in sorted(FILE_KINDS):
        schema = file_schema(kind)
        yield from sorted({f"{kind}: {key}" for key in _keys(schema, schema, "", ())})


def _keys(schema: dict[str, Any], whole: dict[str, Any], at: str, seen: tuple[str, ...]) -> Iterator[str]:
    if reference := schema.get("$ref"):
        if reference not in seen:
            found: Any = whole
            for word in reference.removeprefix("#/").split("/"):
                found = found[word]
            yield from _keys(found, whole, at, (*seen, reference))
        return
    properties = schema.get("properties", {})
    if "origin" in properties:
        return  # of a value: its unit, its note
    for key, inner in properties.items():
        yield f"{at}{key}"
        yield from _keys(inner, whole, f"{at}{key}.", seen)
    if isinstance(schema.get("items"), dict):
        yield from _keys(schema["items"], whole, at, seen)
    for inner in [*schema.get("anyOf", ()), *schema.get("oneOf", ()), *schema.get("allOf", ())]:
        yield from _keys(inner, whole, at, seen)


KINDS: dict[str, Callable[[], Iterator[str]]] = {
    "library": library, "command_line": command_line, "fmu_variables": fmu_variables, "file_keys": file_keys,
}  # fmt: skip
"""Kinds of public names, each a file of its name, and who lists them."""


def pinned(kind: str) -> list[str]:
    """Lines of the last release."""
    return (PLACE / f"{kind}.txt").read_text("utf-8").splitlines()


def main() -> int:
    """Write the present lines."""
    PLACE.mkdir(parents=True, exist_ok=True)
    for kind, lines in KINDS.items():
        (PLACE / f"{kind}.txt").write_text("\n".join(lines()) + "\n", "utf-8")
    return 0


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))
    sys.exit(main())
