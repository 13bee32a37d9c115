"""Parsers of verbs, built from the fields of their questions."""

import argparse
import importlib
from collections.abc import Callable
from typing import Any, NoReturn

from cranktrain.cli.functions import Verb, verb_of
from cranktrain.core.errors import InputError
from cranktrain.studies.requests.fields import Field, Question, fields_of


def add_question(parser: argparse.ArgumentParser, known: Verb) -> None:
    """Add the positional argument of a verb, and options for the fields of its question, to its parser."""
    if known.subject is not None:
        parser.add_argument(known.subject.name, metavar=known.subject.metavar, help=known.subject.help)
    add_fields(parser, known.ask)


def add_fields(parser: argparse.ArgumentParser, ask: type[Question]) -> None:
    """Add the fields of a question to a parser."""
    groups: dict[str, Any] = {}
    for one in fields_of(ask):
        place: Any = parser
        if heading := one.owner.heading:
            if heading not in groups:
                groups[heading] = parser.add_argument_group(heading)
            place = groups[heading]
        apart = ask.one_needed if one.name in ask.one_needed else ()
        apart = apart or next((names for names in ask.apart if one.name in names), ())
        if apart:
            if apart[0] not in groups:
                groups[apart[0]] = parser.add_mutually_exclusive_group(required=apart == ask.one_needed)
            place = groups[apart[0]]
        elif one.option.also:
            place = parser.add_mutually_exclusive_group()
        _add_field(place, one)


def _add_field(place: Any, one: Field) -> None:
    """Add the options of a field."""
    option = one.option
    texts = [one.help, *(text for _, text in option.also)]
    names = one.names or ("",)
    for name, text in zip(names, texts, strict=True):
        settings: dict[str, Any] = {
            "help": text.replace("%", "%%") or None,
            "default": None if one.required else one.default,
        }
        if one.is_switch:
            settings["action"] = "store_false" if one.default is True else "store_true"
        else:
            settings |= {"type": _reader(one), "metavar": option.metavar or None} | _number_of_values(one)
            if one.words and not option.metavar:
                settings["choices"] = one.words
        if not name:
            place.add_argument(one.name, **settings)
        else:
            place.add_argument(*filter(None, (option.short, name)), dest=one.name, required=one.required, **settings)
    if option.was:
        place.add_argument(
            option.was, nargs="*", action=_Renamed, default=argparse.SUPPRESS, help=argparse.SUPPRESS, says=one.renamed
        )


class _Renamed(argparse.Action):
    """Action that refuses a former name of an option and names the present one."""

    def __init__(self, says: str, **settings: Any) -> None:
        super().__init__(**settings)
        self._says = says

    def __call__(self, *_: Any) -> NoReturn:
        raise InputError(self._says)


def _number_of_values(one: Field) -> dict[str, Any]:
    """Number of values of an option, in the form of argparse's ``nargs``."""
    option = one.option
    if option.repeated:
        return {"action": "append", "default": None if one.default is None else []}
    if option.bare is not None:
        return {"nargs": "?", "const": option.bare}
    if one.many and option.convert is None:
        return {"nargs": option.count or ("*" if option.place and not one.required else "+")}
    return {"nargs": "?"} if option.place and not one.required else {}


def _reader(one: Field) -> Callable[[str], Any]:
    """Function that converts the text of an option, for argparse, which adds the option's name to a message."""

    def read(text: str) -> Any:
        if one.words and one.number is None and one.option.convert is None and one.option.metavar:
            return text  # :func:`question` refuses a wrong word
        try:
            return one.read(text)
        except InputError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return read


def question(known: Verb, options: argparse.Namespace) -> Question:
    """Question object from parsed options; ``InputError`` for values that cannot be used."""
    for one in known.fields:
        value = getattr(options, one.name)
        for word in value if isinstance(value, list) else [value]:
            if isinstance(word, str) and one.words:
                one.refuse(word, one.names[0] if one.names else one.name)
    return known.ask(**{one.name: getattr(options, one.name) for one in known.fields})


def function_of(place: str) -> Callable[..., Any]:
    """Function of a verb, from the text ``module:function``."""
    module, name = place.split(":")
    found: Callable[..., Any] = getattr(importlib.import_module(module), name)
    return found


def run_verb(module: Any, function: Callable[..., Any], options: argparse.Namespace) -> Any:
    """Call the function of a verb with its options, print the result unless JSON is requested, and return it.

    The module of a verb has a function ``show``, which prints the result. It may have ``answer``, which takes subject
    and question and adds steps of the command line, such as writing the result to a default path. It may have ``told``,
    which converts a result to a dictionary.
    """
    known = verb_of(function)
    subject = [getattr(options, known.subject.name)] if known.subject is not None else []
    try:
        found = getattr(module, "answer", known.function)(*subject, question(known, options))
    except KeyboardInterrupt as stop:
        if not options.json and getattr(stop, "found", None) is not None:
            module.show(stop.found)  # type: ignore[attr-defined]
        raise
    if not options.json:
        module.show(found)
    return module.told(found) if hasattr(module, "told") else found
