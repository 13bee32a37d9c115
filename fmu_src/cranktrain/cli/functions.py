"""Functions of the library from questions: ``verb`` makes the fields of a question the keywords of its function.

::

    @verb(Simulate, DESCRIPTION)
    def simulate(engine: str | Path | Engine, ask: Simulate) -> Run: ...

    simulate("diesel_i6", speed_rpm=2000)         # type checkers know each keyword
    Simulate(speed_rpm=2000).answer("diesel_i6")  # the question is a value: replace, compare, send it
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Any, Concatenate, NamedTuple, ParamSpec, TypeVar

from cranktrain.core.errors import CranktrainError, InputError, nearest, shown
from cranktrain.core.user_file import user_path
from cranktrain.studies.requests.fields import Field, Question, fields_of, in_keywords

P = ParamSpec("P")
S = TypeVar("S")
Q = TypeVar("Q")
R = TypeVar("R")


class Subject(NamedTuple):
    """What a question is put to: the first argument of its function.

    Attributes
    ----------
    objects : classes of the library that are taken beside a text or path
    """

    name: str
    metavar: str
    help: str
    objects: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        """Type of the value for people."""
        return " | ".join(("str", "Path", *self.objects))

    def check(self, value: Any) -> None:
        """Refuse what is of another type with ``InputError``."""
        names = {kind.__name__ for kind in type(value).__mro__}
        if not isinstance(value, str | Path) and not names & {*self.objects}:
            said = f"{self.name} is {shown(value)}, of type {type(value).__name__}"
            raise InputError(f"{said}; give one of: {self.kind} ({self.help})")


ENGINE = Subject("engine", "ENGINE", "name of a shipped engine (diesel_i6) or path of a .toml file", ("Engine",))
SCENE = Subject("scene", "SCENE", "path of a scene.toml", ("Scene",))


class Verb(NamedTuple):
    """What is known of a function of the library.

    Attributes
    ----------
    ask : class of its questions
    about : description; its first line stands in the list of verbs
    subject : None where the question is all there is
    function : the function of subject and question, whose errors name options of the command line
    """

    ask: type[Question]
    about: str
    subject: Subject | None
    function: Callable[..., Any]

    @property
    def fields(self) -> tuple[Field, ...]:
        """Fields of the question."""
        return fields_of(self.ask)

    def refuse_former(self, named: Mapping[str, Any]) -> None:
        """Refuse a keyword's name before the first release with the present one; ``InputError``."""
        for one in self.fields:
            was = one.option.was.lstrip("-").replace("-", "_")
            if was and was in named and was not in {other.name for other in self.fields}:
                raise InputError(f"{self.function.__name__}: '{was}' is called '{one.name}' now; write {one.name}")

    def answer(self, ask: Question, *subject: Any) -> Any:
        """Answer a question silently but for warnings and a line for each long step; errors name keywords."""
        with quiet():
            try:
                return self.function(*subject, ask)
            except CranktrainError as error:
                raise type(error)(in_keywords(self.ask, str(error))) from None


def verb(
    ask: Callable[P, Q], about: str, subject: Subject = ENGINE
) -> Callable[[Callable[[S, Q], R]], Callable[Concatenate[S, P], R]]:
    """Decorator: a function of a subject and a question as one of the subject and the question's keywords."""
    return lambda function: _library_function(function, ask, about, subject)


def verb_alone(ask: Callable[P, Q], about: str) -> Callable[[Callable[[Q], R]], Callable[P, R]]:
    """Decorator: a function of a question as one of the question's keywords."""
    return lambda function: _library_function(function, ask, about, None)


def verb_of(function: Callable[..., Any]) -> Verb:
    """What is known of a function that :func:`verb` made."""
    known: Verb = function.verb  # type: ignore[attr-defined]
    return known


@contextmanager
def quiet() -> Iterator[None]:
    """Show no progress but a line on stderr for each step that takes more than a second."""
    from cranktrain.fmu.native.first_use import made_at_first_use
    from cranktrain.store.waits import LINES

    before = LINES.set(False)
    try:
        with made_at_first_use():
            yield
    finally:
        LINES.reset(before)


def _library_function(function: Callable[..., Any], ask: Any, about: str, subject: Subject | None) -> Any:
    known = Verb(ask, about, subject, function)
    ask.answerer = known.answer
    expected = _signature(known, function)

    @wraps(function)
    def called(*given: Any, **named: Any) -> Any:
        known.refuse_former(named)
        bound = _bound(function.__name__, expected, given, named)
        if subject is not None:
            subject.check(first := bound.pop(subject.name))
            return known.answer(ask(**bound), str(user_path(first)) if isinstance(first, str | Path) else first)
        return known.answer(ask(**bound))

    called.verb = known  # type: ignore[attr-defined]
    called.__signature__ = expected  # type: ignore[attr-defined]
    called.__doc__ = _docstring(known)
    return called


def one_line_calls(function: Callable[P, R]) -> Callable[P, R]:
    """Decorator of other functions of the library: a wrong call is one line, as any other wrong input."""

    @wraps(function)
    def called(*given: P.args, **named: P.kwargs) -> R:
        _bound(function.__name__, signature(function), given, named)
        return function(*given, **named)

    return called


def _bound(name: str, expected: Signature, given: Sequence[Any], named: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of a call by name; ``InputError`` with the nearest keyword for one that does not exist."""
    for key in named:
        if key not in expected.parameters:
            raise InputError(f"{name}: unknown keyword '{key}'; {nearest(key, expected.parameters)}")
    try:
        return dict(expected.bind(*given, **named).arguments)
    except TypeError as error:
        text = str(error)
        if text.startswith("missing a required"):
            text = f"{text.rpartition(': ')[2].strip(chr(39))} is missing"
        raise InputError(f"{name}: {text}; see help(ct.{name})") from None


def _signature(known: Verb, function: Callable[..., Any]) -> Signature:
    """Signature with all keywords: by place first, then those that are required."""
    own = sorted(known.fields, key=lambda one: (not one.option.place, not one.required))
    parameters = [
        Parameter(
            one.name,
            Parameter.POSITIONAL_OR_KEYWORD if one.option.place else Parameter.KEYWORD_ONLY,
            default=Parameter.empty if one.required else one.default,
            annotation=one.kind,
        )
        for one in own
    ]
    if known.subject is not None:
        first = Parameter(known.subject.name, Parameter.POSITIONAL_OR_KEYWORD, annotation=known.subject.kind)
        parameters.insert(0, first)
    return Signature(parameters, return_annotation=function.__annotations__.get("return", Signature.empty))


def _docstring(known: Verb) -> str:
    """Description, errors and keywords with their help."""
    lines = [
        in_keywords(known.ask, known.about.strip()), "",
        "Raises ``InputError`` for what cannot be used, ``SolverError`` for a computation that fails.", "",
        "Parameters", "----------",
    ]  # fmt: skip
    if known.subject is not None:
        lines.append(f"{known.subject.name} : {known.subject.help}")
    for one in known.fields:
        more = "".join(f"; or {text}" for _, text in one.option.also if not text.startswith("refused"))
        given = f"; {one.given}" if one.given else ""
        lines.append(f"{one.name} : {in_keywords(known.ask, one.help + more + given)}")
    return "\n".join(lines) + "\n"
