"""Fields of a question: declared once, read from scripts and from the command line.

A question is a frozen dataclass whose fields are typed by aliases such as ``Annotated[float, between(0.0, 2.0, "…"),
Option("SHARE", "fraction of …")]``. :func:`fields_of` reads the declarations; :meth:`Field.checked` checks a value of a
script, :meth:`Field.read` a text of the command line.
"""

import inspect
import math
import numbers
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, ClassVar, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from msgspec import Meta

from cranktrain.core.errors import InputError, as_float, nearest, shown, within
from cranktrain.core.user_file import is_number, user_path

T = TypeVar("T")
_FIELDS: "dict[type[Any], tuple[Field, ...]]" = {}
POSITIVE = Meta(gt=0)
"""Bounds of a number that must be positive."""
ANY = Meta(extra={"what": "any"})
"""Annotation of a number that may be infinite."""


@dataclass(frozen=True)
class Option:
    """Option of the command line for a field: the data that its type does not contain.

    Attributes
    ----------
    metavar : placeholder of the value
    help : help text, or a function that makes it from a register; ``{default}`` is replaced by the default
    name : of the option; by default the field's name, with ``--no-`` before it if the default is True
    words : valid words, or a function that returns them, for registers with more words than the type states
    bare : value of an option that is given without a value
    also : names and helps of second options for the same field
    count : exact number of values
    repeated : True if the option may be given several times, one value each
    place : True for a positional argument
    short : second name of one letter
    was : option name before the first release, which is refused with the present one
    convert : function that reads a text, if the type is not sufficient; a script may give the parts as a sequence
    """

    metavar: str | tuple[str, ...] = ""
    help: str | Callable[[], str] = ""
    name: str = ""
    words: tuple[str, ...] | Callable[[], Iterable[str]] | None = None
    bare: Any = None
    also: tuple[tuple[str, str], ...] = ()
    count: int = 0
    repeated: bool = False
    place: bool = False
    convert: Callable[[str], Any] | None = None
    short: str = ""
    was: str = ""


@dataclass(frozen=True)
class Given:
    """Mark of a type that only scripts can give (array or function); it is checked by the function that reads it."""

    help: str


@dataclass(frozen=True, kw_only=True)
class Question:
    """Base class of all questions. Values are checked when a question is made; ``InputError`` names the keyword.

    ``apart`` lists fields of which at most one may be given, ``one_needed`` those of which exactly one must be;
    ``heading`` is the title over a group's options in the help.
    """

    apart: ClassVar[tuple[tuple[str, ...], ...]] = ()
    one_needed: ClassVar[tuple[str, ...]] = ()
    heading: ClassVar[str] = ""
    answerer: ClassVar[Callable[..., Any]]

    def answer(self, *subject: Any) -> Any:
        """Result of the verb's function for this question, and its first argument such as an engine or a scene."""
        return type(self).answerer(self, *subject)

    def __post_init__(self) -> None:
        for one in fields_of(type(self)):
            try:
                object.__setattr__(self, one.name, one.checked(getattr(self, one.name)))
            except InputError as error:
                raise InputError(in_keywords(type(self), str(error))) from None
        for names in filter(None, (*self.apart, self.one_needed)):
            given = [name for name in names if getattr(self, name) not in (None, False, ())]
            if len(given) > 1:
                raise InputError(f"--{given[0]} does not go with --{given[1]}; leave one of them out".replace("--", ""))
        if self.one_needed and not given:
            raise InputError(f"one of {', '.join(self.one_needed)} is missing; give one of them")


@dataclass(frozen=True)
class Field:
    """A field of a question.

    Attributes
    ----------
    kinds : types of the value, without None and without annotations
    optional, many : True if the value may be None; if it is a sequence of values
    default : ``MISSING`` if a value is required
    bounds : range of a number
    given : help on arrays and functions that a script may give; empty if it may not
    owner : group that declares the field
    """

    name: str
    kinds: tuple[Any, ...]
    optional: bool
    many: bool
    default: Any
    bounds: Meta | None
    option: Option
    given: str
    owner: type[Any]

    @property
    def required(self) -> bool:
        """True if a value must be given."""
        return self.default is MISSING

    @property
    def is_switch(self) -> bool:
        """True if the value is true or false, so that the option has no value."""
        return bool in self.kinds and self.option.bare is None and self.option.convert is None

    @property
    def names(self) -> tuple[str, ...]:
        """Option names; empty for an argument without one."""
        if self.option.place:
            return ()
        usual = f"--{'no-' if self.default is True else ''}{self.name.replace('_', '-')}"
        return (self.option.name or usual, *(name for name, _ in self.option.also))

    @property
    def renamed(self) -> str:
        """Message on a name of the option from before the first release."""
        if self.option.was.startswith("--no-"):
            return f"{self.option.was} is the default now; leave it out, or give {self.names[0]} for the opposite"
        return f"{self.option.was} is called {self.names[0]} now; write {self.names[0]}"

    @property
    def words(self) -> tuple[str, ...]:
        """Valid words of the value; empty if it is not a word."""
        if self.option.words is not None:
            return tuple(self.option.words() if callable(self.option.words) else self.option.words)
        return tuple(word for kind in self.kinds if get_origin(kind) is Literal for word in get_args(kind))

    @property
    def number(self) -> type | None:
        """Type of a number; None if the value is not a number."""
        return next((kind for kind in (float, int) if kind in self.kinds), None)

    @property
    def help(self) -> str:
        """Help text for the command line."""
        default = f"{self.default:g}" if isinstance(self.default, float) else str(self.default)
        text = self.option.help
        return (text if isinstance(text, str) else text()).replace("{default}", default)

    @property
    def kind(self) -> str:
        """Description of the value's type, for messages."""
        said = [str(getattr(kind, "__name__", kind)) for kind in self.kinds if get_origin(kind) is not Literal]
        if self.words and (len(said) < len(self.kinds) or not said):
            said = [one for one in said if one != "str"] + [f"Literal[{', '.join(map(repr, self.words))}]"]
        if self.given:
            said = [one for one in said if one in ("str", "Path", "float", "int")] + ["array or function"]
        text = " | ".join(said)
        if self.many:
            text = f"Sequence[{text}]" if self.option.count or self.option.repeated else f"{text} | Sequence[{text}]"
        return f"{text} | None" if self.optional else text

    @property
    def wanted(self) -> str:
        """Text of the valid values, for the message on a wrong value."""
        if bool in self.kinds and len(self.kinds) == 1:
            return "True or False"
        said = ["a whole number" if self.number is int else "a number"] if self.number else []
        if self.words:
            said.append(f"one of: {', '.join(self.words)}")
        elif self.given:
            return f"{'a number' if said else 'a path'}, an array or a function"
        elif str in self.kinds and not said:
            said.append("a text")
        return " or ".join(said) if len(said) < 3 else ", ".join(said)

    def checked(self, value: Any) -> Any:
        """Checked value from a script, in the form of the question; ``InputError`` names the keyword."""
        usual = None if self.required else self.default
        if value is usual or (type(value) is type(usual) and value == usual):
            if value is None and self.required:
                raise InputError(f"{self.name} is missing; it is: {self.help}")
            return value
        if value is None:
            if self.optional:
                return None
            raise InputError(f"{self.name} is None; leave it out, or give {self.wanted} ({self.help})")
        if self.option.convert is not None and not isinstance(value, bool):
            text = value if isinstance(value, str) else ",".join(map(str, _listed(value)))
            return self._converted(text, f"{self.name} ")
        if not self.many:
            return self._one(value)
        values = _listed(value)
        if self.option.count and len(values) != self.option.count:
            raise InputError(f"{self.name} has {len(values)} values; give {self.option.count}: {self.help}")
        return tuple(map(self._one, values))

    def read(self, text: str, label: str = "") -> Any:
        """Value from a text of the command line; ``InputError`` begins with the label."""
        start = f"{label} " if label else ""
        if self.option.convert is not None:
            return self._converted(text, start)
        if text in self.words:
            return text
        if self.number is None:
            return self._worded(text, label)
        try:
            value = self.number(text)
        except ValueError:
            raise InputError(f"{start}{shown(text)} is not {self.wanted}") from None
        return self._bounded(value, start)

    def refuse(self, value: Any, label: str) -> None:
        """Raise ``InputError`` for an unknown word, or a number outside its bounds."""
        if isinstance(value, str) and self.option.convert is not None:
            self._converted(value, f"{label}: ")
        elif isinstance(value, str) and self.words:
            self._worded(value, label)
        elif self.number is not None and isinstance(value, int | float):
            self._bounded(value, f"{label} ")

    def _converted(self, text: str, start: str) -> Any:
        try:
            assert self.option.convert is not None
            return self.option.convert(text)
        except (InputError, ValueError) as error:
            raise InputError(f"{start}{error}") from None

    def _one(self, value: Any) -> Any:
        """Checked single value from a script."""
        classes = tuple(kind for kind in self.kinds if isinstance(kind, type) and kind not in (bool, int, float))
        if isinstance(value, bool) and bool in self.kinds:
            return (self.option.bare if value else self.default) if self.option.bare is not None else value
        if isinstance(value, Path) and Path in self.kinds:
            return str(user_path(value))
        if isinstance(value, str) and (self.words or str in self.kinds):
            return self._worded(value, self.name)
        if isinstance(value, numbers.Real) and not isinstance(value, bool) and self.number is not None:
            number = as_float(value) if isinstance(value, int) and abs(value) > sys.float_info.max else value
            if self.number is float or float(number) % 1.0 == 0.0:
                return self._bounded(self.number(number), f"{self.name} ")
        elif isinstance(value, classes) or (self.given and not isinstance(value, str | Path | numbers.Real)):
            return value
        said = f", of type {type(value).__name__}"
        raise InputError(f"{self.name} is {shown(value)}{said}; give {self.wanted} ({self.help})")

    def _worded(self, text: str, label: str) -> str:
        """Checked text: one of the valid words, if there are any, or a path with ``~`` replaced by the home folder."""
        if self.words and text not in self.words and not (str in self.kinds and self.option.words is None):
            if self.number is not None:
                raise InputError(f"{label} is {shown(text)}, of type str; give {self.wanted} ({self.help})")
            raise InputError(f"{label} '{text}' does not exist; {nearest(text, self.words)}".lstrip())
        return str(user_path(text)) if Path in self.kinds and text.startswith("~") else text

    def _bounded(self, value: Any, start: str) -> Any:
        if self.bounds is ANY:
            return value
        if self.bounds is not None and self.bounds.ge is not None and self.bounds.le is not None:
            within(start.rstrip(), value, self.bounds.ge, self.bounds.le, (self.bounds.extra or {}).get("what", ""))
        elif self.bounds is not None and self.bounds.gt is not None and not self.bounds.gt < value < math.inf:
            raise InputError(f"{start}{value:g} must be above zero")
        elif not is_number(value):
            raise InputError(f"{start}is not a finite number")
        return value


def fields_of(question: type[Any]) -> tuple[Field, ...]:
    """Fields of a question: first its own fields, then the fields of its groups."""
    if question not in _FIELDS:
        hints = get_type_hints(question, include_extras=True)
        known = {one.name: one for one in fields(question)}
        owners = {name: group for group in reversed(question.__mro__) for name in _own(group)}
        order = [*_own(question), *(name for base in question.__bases__ for name in _with_groups(base))]
        names = dict.fromkeys(name for name in order if name in known)
        _FIELDS[question] = tuple(_field(name, hints[name], known[name].default, owners[name]) for name in names)
    return _FIELDS[question]


def in_keywords(question: type, text: str) -> str:
    """Text with the options of the command line replaced by keywords."""
    named = {option: one.name for one in fields_of(question) for option in one.names}
    return re.sub(r"--[a-z][a-z0-9-]*[a-z0-9]", lambda found: named.get(found[0], found[0]), text)


def several(value: T | Sequence[T] | None) -> tuple[T, ...]:
    """List of values of a field that accepts one or several, which a question stores as a tuple."""
    found: tuple[T, ...] = () if value is None else tuple(_listed(value))
    return found


def paths(value: str | Path | Sequence[str | Path] | None) -> list[str]:
    """List of paths of a field that accepts one or several."""
    return [] if value is None else list(map(str, _listed(value)))


def _own(group: type) -> list[str]:
    return list(inspect.get_annotations(group))


def _with_groups(group: type) -> list[str]:
    """Names of the fields that a group declares, after those of its base groups."""
    return [*(name for base in group.__bases__ for name in _with_groups(base)), *_own(group)]


def _field(name: str, hint: Any, default: Any, owner: type) -> Field:
    kinds, marks, many = list[Any](), list[Any](), False

    def walk(part: Any) -> None:
        nonlocal many
        if get_origin(part) is Annotated:
            marks.extend(part.__metadata__)
            if not isinstance(part.__metadata__[0], Given):
                walk(part.__origin__)
        elif get_origin(part) in (Union, UnionType):
            for one in get_args(part):
                walk(one)
        elif get_origin(part) is Sequence:
            many = True
            walk(get_args(part)[0])
        else:
            kinds.append(part)

    walk(hint)
    bounds = next((mark for mark in marks if isinstance(mark, Meta)), None)
    option = next((mark for mark in marks if isinstance(mark, Option)), Option())
    given = next((mark.help for mark in marks if isinstance(mark, Given)), "")
    plain = tuple(dict.fromkeys(kind for kind in kinds if kind is not NoneType))
    return Field(name, plain, NoneType in kinds, many, default, bounds, option, given, owner)


def _listed(value: Any) -> list[Any]:
    """List of a single value, or of the values of a sequence or array."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        return list(value)
    found = value.tolist() if hasattr(value, "tolist") else value
    return found if isinstance(found, list) else [found]
