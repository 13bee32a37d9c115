"""Options of a verb as keywords of its function."""

from __future__ import annotations

import argparse
import re
from functools import cache
from typing import Any, NamedTuple

from cranktrain.cli import main
from cranktrain.cli.verbs import FUNCTIONS

OF_OTHERS = {
    "engines": "engines", "bearing": "Bearing", "schema": "schema", "vary": "vary", "optimize": "optimize",
    "explore": "explore",
}  # fmt: skip
"""Verbs that the library has in another form, or not as a function: a schema is for editors."""
NAMES = {"new": "new_engine", "run": "run_scene", "measured": "analyse_measured"}
"""Functions that are not called as their verbs are: ``measured`` is a package of the library."""
GIVEN = {"pressure": "Pressures", "load_torque_nm": "LoadValues"}
"""Keywords that also take arrays and functions, see :mod:`cranktrain.loads.given_pressure` and
:mod:`cranktrain.dynamics.load_torque`."""
GIVEN_HELP = {
    "pressure": "or an array over one cycle (Pa), (angle, pressure), a dict by cylinder, or a function of the crank "
    "angle (rad) and the speed (rad/s)",
    "load_torque_nm": "or an array over 720 degrees, or a function of the loaded end's angle (rad) and speed (rad/s)",
}
NOT_FOR_SCRIPTS = ("json", "help")
OBJECTS = {"engine": "Engine", "scene": "Scene"}
"""Keywords that also take an object of the library."""


class Keyword(NamedTuple):
    """A keyword of a function.

    Attributes
    ----------
    kind : annotation
    default : None also where it is required
    options : of the command line that set it; empty for a positional argument
    action : that reads the first of these
    """

    name: str
    kind: str
    default: Any
    required: bool
    help: str
    options: tuple[str, ...]
    action: argparse.Action

    @property
    def positional(self) -> bool:
        """Whether it is an argument by place."""
        return not self.options

    @property
    def many(self) -> bool:
        """Whether its value is a list."""
        return (isinstance(self.action.nargs, int) and self.action.nargs > 0) or (
            self.action.nargs in ("+", "*") or isinstance(self.action, argparse._AppendAction)
        )  # fmt: skip


def verbs() -> tuple[str, ...]:
    """Verbs that have a function."""
    return tuple(verb for verb in (*main.ENGINE_VERBS, *main.VERBS) if verb not in OF_OTHERS and verb not in FUNCTIONS)


def function_name(verb: str) -> str:
    """Name of a verb's function."""
    return NAMES.get(verb, verb.replace("-", "_"))


@cache
def parser_of(verb: str) -> argparse.ArgumentParser:
    """Parser of a verb."""
    (choices,) = (one.choices for one in main._parser(verb)._actions if isinstance(one, argparse._SubParsersAction))
    found = choices[verb]
    assert isinstance(found, argparse.ArgumentParser)
    return found


@cache
def keywords(verb: str) -> dict[str, Keyword]:
    """Keywords of a verb's function, by name: positional ones first, then those that are required."""
    parser = parser_of(verb)
    found: dict[str, Keyword] = {}
    for action in parser._actions:
        name = action.dest
        if name in NOT_FOR_SCRIPTS:
            continue
        text = _help(action)
        if name in found:  # a second option for the same thing
            more = f"; or {text}" if not text.startswith("refused") else ""
            found[name] = found[name]._replace(help=found[name].help + more)
            continue
        default = parser.get_default(name)
        required = action.required and action.nargs not in ("?", "*")
        options = tuple(action.option_strings)
        found[name] = Keyword(name, _kind(action, default, required), default, required, text, options, action)
    named = option_names(verb)
    found = {name: one._replace(help=in_keywords(one.help, named)) for name, one in found.items()}
    return dict(sorted(found.items(), key=lambda one: (bool(one[1].options), not one[1].required)))


@cache
def option_names(verb: str) -> dict[str, str]:
    """Keyword of each option of a verb."""
    return {option: action.dest for action in parser_of(verb)._actions for option in action.option_strings}


def in_keywords(text: str, named: dict[str, str]) -> str:
    """A text of the command line with keywords in place of options."""
    return re.sub(r"--[a-z][a-z-]*[a-z]", lambda found: named.get(found[0], found[0]), text)


def _help(action: argparse.Action) -> str:
    """Help of an option on one line."""
    text = " ".join((action.help or str(action.metavar or action.dest)).replace("%%", "%").split())
    words = getattr(action, "words", ())
    if takes_given(action):
        text = f"{text}; {GIVEN_HELP[action.dest]}"
    # The annotation lists the words, and the verb's help says what each of them means.
    return re.sub(r" \([^()]*\)(?=;)", "", text) if words and text.startswith(words[0]) else text


def _kind(action: argparse.Action, default: Any, required: bool) -> str:
    """Annotation of a keyword."""
    words = getattr(action, "words", None) or action.choices
    if isinstance(action, argparse._StoreTrueAction | argparse._StoreFalseAction):
        return "bool" if default is not None else "bool | None"
    if words:
        kind = f"Literal[{', '.join(map(repr, words))}]".replace("'", '"')
    elif action.type is None:
        kind = "str" if action.nargs is None and _is_word(action) else "str | Path"
    else:
        kind = str(getattr(action.type, "annotation", None) or getattr(action.type, "__name__", "str"))
        kind = kind.replace("'", '"')
    if action.dest in OBJECTS:
        kind = f"{kind} | {OBJECTS[action.dest]}"
    if isinstance(action.nargs, int) or isinstance(action, argparse._AppendAction):
        kind = f"Sequence[{kind}]"
    elif action.nargs in ("+", "*"):
        kind = f"{kind} | Sequence[{kind}]"
    elif action.nargs == "?" and action.const is not None:
        kind = f"{kind} | bool"
    if takes_given(action):
        kind = f"{kind} | {GIVEN[action.dest]}"
    return f"{kind} | None" if default is None and not required else kind


def takes_given(action: argparse.Action) -> bool:
    """Whether an option's keyword also takes arrays and functions; that of measured channels does not."""
    return action.dest in GIVEN and (action.type is None or action.type is float)


def _is_word(action: argparse.Action) -> bool:
    """Whether a text of an option is a word, no path."""
    shown = str(action.metavar or "")
    return not re.search(r"FILE|FOLDER|DIR|TABLE|ENGINE|SCENE|TARGETS|OUT", shown)
