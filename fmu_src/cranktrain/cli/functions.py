"""Functions of the library, made from questions: ``verb`` turns the fields of a question into keywords of a function.

::

    @verb(Simulate, DESCRIPTION)
    def simulate(engine: str | Path | Engine, ask: Simulate) -> Run: ...

    simulate("diesel_i6", speed_rpm=2000)         # type checkers know each keyword
    Simulate(speed_rpm=2000).answer("diesel_i6")  # the question is a value: replace, compare, send it
"""

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
    """First argument of a verb's function, such as an engine or a file.

    Attributes
    ----------
    objects : classes of the library that are accepted in addition to a text or path
    """

    name: str
    metavar: str
    help: str
    objects: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        """Description of the accepted types, for messages."""
        return " | ".join(("str", "Path", *self.objects))

    def check(self, value: Any) -> None:
        """Raise ``InputError`` for a value of another type."""
        names = {kind.__name__ for kind in type(value).__mro__}
        if not isinstance(value, str | Path) and not names & {*self.objects}:
            said = f"{self.name} is {shown(value)}, of type {type(value).__name__}"
            raise InputError(f"{said}; give one of: {self.kind} ({self.help})")


ENGINE = Subject("engine", "ENGINE", "name of a shipped engine (diesel_i6) or path of a .toml file", ("Engine",))
SCENE = Subject("scene", "SCENE", "path of a scene.toml", ("Scene",))


class Verb(NamedTuple):
    """Description of a verb: its question, help text, subject and function.

    Attributes
    ----------
    ask : class of its questions
    about : description; its first line stands in the list of verbs
    subject : first argument; None if the function takes only the question
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
        """Raise ``InputError`` for a keyword's name from before the first release; gives the present one."""
        for one in self.fields:
            was = one.option.was.lstrip("-").replace("-", "_")
            if was and was in named and was not in {other.name for other in self.fields}:
                raise InputError(f"{self.function.__name__}: '{was}' is called '{one.name}' now; write {one.name}")

    def answer(self, ask: Question, *subject: Any) -> Any:
        """Answer a question without output except warnings and a line for each long step; errors name keywords."""
        with quiet():
            try:
                return self.function(*subject, ask)
            except CranktrainError as error:
                raise type(error)(in_keywords(self.ask, str(error))) from None


def verb(
    ask: Callable[P, Q], about: str, subject: Subject = ENGINE
) -> Callable[[Callable[[S, Q], R]], Callable[Concatenate[S, P], R]]:
    """Decorator: turn a function of a subject and a question into one of the subject and the question's keywords."""
    return lambda function: _library_function(function, ask, about, subject)


def verb_alone(ask: Callable[P, Q], about: str) -> Callable[[Callable[[Q], R]], Callable[P, R]]:
    """Decorator: turn a function of a question into one of the question's keywords."""
    return lambda function: _library_function(function, ask, about, None)


def verb_of(function: Callable[..., Any]) -> Verb:
    """Description of a function that :func:`verb` made."""
    known: Verb = function.verb  # type: ignore[attr-defined]
    return known


@contextmanager
def quiet() -> Iterator[None]:
    """Show no progress bars, only a line on stderr for each step that takes more than a second."""
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
    """Decorator of other functions of the library: a wrong call raises ``InputError`` with a message of one line."""

    @wraps(function)
    def called(*given: P.args, **named: P.kwargs) -> R:
        _bound(function.__name__, signature(function), given, named)
        return function(*given, **named)

    return called


def _bound(name: str, expected: Signature, given: Sequence[Any], named: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of a call by name; ``InputError`` for an unknown keyword gives the nearest one."""
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
    """Signature with all keywords: first positional ones, then required ones."""
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
    """Docstring of a verb's function: description, errors, and keywords with their help."""
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
