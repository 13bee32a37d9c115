"""Running a verb with the keywords of a script."""

from __future__ import annotations

import argparse
import importlib
import numbers
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import wraps
from inspect import signature
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ParamSpec, TypeVar

from cranktrain.cli import main
from cranktrain.cli.library.keywords import (
    OBJECTS,
    Keyword,
    in_keywords,
    keywords,
    option_names,
    parser_of,
    takes_given,
)
from cranktrain.core.errors import CranktrainError, InputError, as_float, nearest, shown
from cranktrain.engine.model import Engine
from cranktrain.fmu.native.first_use import made_at_first_use
from cranktrain.results.in_hand.found import Found, Frequencies
from cranktrain.store.waits import LINES
from cranktrain.structure.assembly import Assembly
from cranktrain.studies.scene import Scene

P = ParamSpec("P")
R = TypeVar("R")


def of_verb(function: Callable[P, R]) -> Callable[P, R]:
    """Decorator of the library's functions: a wrong call is one line, as any other wrong input."""
    names, name = list(signature(function).parameters), function.__name__

    @wraps(function)
    def called(*given: P.args, **named: P.kwargs) -> R:
        for key in named:
            if key not in names:
                raise InputError(f"{name}: unknown keyword '{key}'; {nearest(key, names)}")
        try:
            signature(function).bind(*given, **named)
        except TypeError as error:
            raise InputError(f"{name}: {_missing(str(error))}; see help(ct.{name})") from None
        return function(*given, **named)

    return called


def call(verb: str, given: Mapping[str, Any]) -> Any:
    """What a verb finds with these values of its keywords; errors name keywords.

    Silent but for warnings, and a line on stderr for each step that takes more than a second.
    """
    known = keywords(verb)
    with ExitStack() as stack:
        options = argparse.Namespace(json=True)
        for name, keyword in known.items():
            setattr(options, name, _value(keyword, given[name], stack))
        _check_groups(verb, options)
        said = LINES.set(False)
        try:
            module = importlib.import_module(main.module_name(verb))
            stack.enter_context(made_at_first_use())
            found = getattr(module, "answer", module.run)(main.with_homes(options))
        except CranktrainError as error:
            raise type(error)(in_keywords(str(error), option_names(verb))) from None
        finally:
            LINES.reset(said)
    if isinstance(found, dict):
        return (Frequencies if verb == "modal" else Found).of(found, verb)
    return found


def _value(keyword: Keyword, value: Any, stack: ExitStack) -> Any:
    """A value as the command line's parser would give it; ``InputError``."""
    default = keyword.default
    if isinstance(default, list | tuple) and isinstance(value, list | tuple) and list(value) == list(default):
        return default if isinstance(default, tuple) else list(default)
    if value is None or (type(value) is type(default) and value == default):
        if value is None and keyword.required:
            raise InputError(f"{keyword.name} is missing; it is: {keyword.help}")
        if value is None and default is not None:
            raise InputError(f"{keyword.name} is None; leave it out, or give {keyword.kind} ({keyword.help})")
        return value
    if keyword.many:
        listed = list(value) if isinstance(value, Sequence) and not isinstance(value, str) else _listed(value)
        count = keyword.action.nargs
        if isinstance(count, int) and len(listed) != count:
            raise InputError(f"{keyword.name} has {len(listed)} values; give {count}: {keyword.help}")
        return [_one(keyword, one, stack) for one in listed]
    return _one(keyword, value, stack)


def _listed(value: Any) -> list[Any]:
    """A single value, or an array of them, as a list."""
    found = value.tolist() if hasattr(value, "tolist") else value
    return found if isinstance(found, list) else [found]


def _one(keyword: Keyword, value: Any, stack: ExitStack) -> Any:
    """One value of a keyword; an engine becomes a file that lasts as long as the call."""
    name, kind = keyword.name, keyword.action.type
    if isinstance(value, int) and abs(value) > sys.float_info.max:
        value = as_float(value)  # infinite, which every option refuses
    if isinstance(keyword.action, argparse._StoreTrueAction | argparse._StoreFalseAction):
        if not isinstance(value, bool):
            raise InputError(f"{name} is {shown(value)}; give True or False")
        return value
    if keyword.action.nargs == "?" and isinstance(value, bool):
        return keyword.action.const if value else keyword.default
    if isinstance(value, Engine) and name == "engine":
        return _file_of(value, stack)
    if (isinstance(value, Scene) and name == "scene") or (isinstance(value, Assembly) and "Assembly" in keyword.kind):
        return value
    if takes_given(keyword.action) and not isinstance(value, str | Path | numbers.Real):
        return value  # checked where it is read
    if kind is None:
        if not isinstance(value, str | Path):
            wanted = "a path, an array or a function" if takes_given(keyword.action) else "a text"
            raise _wrong(keyword, value, f"one of: {keyword.kind}" if name in OBJECTS else wanted)
        return str(value)
    annotation = getattr(kind, "annotation", getattr(kind, "__name__", "str"))
    if annotation in ("float", "int"):
        return _number(keyword, value, annotation)
    if isinstance(value, Sequence) and not isinstance(value, str):
        value = ",".join(map(str, value))
    if isinstance(value, bool) or not isinstance(value, str | numbers.Real):
        raise _wrong(keyword, value, keyword.kind)
    return _read(keyword, value)


def _number(keyword: Keyword, value: Any, annotation: str) -> Any:
    """A number within the option's bounds."""
    whole = annotation == "int"
    wanted = "a whole number" if whole else "a number"
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or (whole and float(value) % 1.0 != 0.0):
        raise _wrong(keyword, value, wanted)
    return _read(keyword, int(float(value)) if whole else float(value))


def _read(keyword: Keyword, value: Any) -> Any:
    """A value read by the option's type."""
    kind: Any = keyword.action.type
    try:
        return kind(value)
    except argparse.ArgumentTypeError as error:
        raise InputError(f"{keyword.name} {error}") from None
    except (ValueError, TypeError):
        raise _wrong(keyword, value, keyword.kind) from None


def _wrong(keyword: Keyword, value: Any, wanted: str) -> InputError:
    """The error of a value of a wrong kind."""
    kind = type(value).__name__
    return InputError(f"{keyword.name} is {shown(value)}, of type {kind}; give {wanted} ({keyword.help})")


def _file_of(engine: Engine, stack: ExitStack) -> str:
    """File of an engine that was loaded, built or changed in Python: reading it checks it."""
    folder = stack.enter_context(TemporaryDirectory(prefix="cranktrain-engine-"))
    path = Path(folder) / f"{engine.name if isinstance(engine.name, str) else 'engine'}.toml"
    path.write_text(engine.to_toml(), encoding="utf-8")
    return str(path)


def _check_groups(verb: str, options: argparse.Namespace) -> None:
    """Refuse keywords that exclude one another, and a group of which one is needed."""
    parser = parser_of(verb)
    for group in parser._mutually_exclusive_groups:
        names = list(dict.fromkeys(action.dest for action in group._group_actions))
        given = [name for name in names if getattr(options, name) not in (None, parser.get_default(name))]
        if len(given) > 1:
            raise InputError(f"{given[0]} does not go with {given[1]}; leave one of them out")
        if group.required and not given:
            raise InputError(f"one of {', '.join(names)} is missing; give one of them")


def _missing(text: str) -> str:
    """A message of Python about a call in plain words."""
    if text.startswith("missing a required"):
        return f"{text.rpartition(': ')[2].strip(chr(39))} is missing"
    return text
