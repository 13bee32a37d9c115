"""Errors that reach a user: one line with what is wrong, where, and what to do.

Every error derives from :class:`CranktrainError`; the command line prints its text and exits with code 2, the FMU
raises it with the same text.
"""

import math
from collections.abc import Iterable
from difflib import get_close_matches

LONGEST_LINE = 1200
"""Largest number of characters of a message. Longer messages are cut in the middle, because the end says what to do."""
LONGEST_SHOWN = 80
"""Largest number of characters of a value in a message."""


class CranktrainError(Exception):
    """Wrong input or a failed computation, described in one line; unprintable characters are escaped."""

    def __str__(self) -> str:
        text = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in super().__str__())
        return text if len(text) <= LONGEST_LINE else f"{text[: LONGEST_LINE - 300]} … {text[-290:]}"


class InputError(CranktrainError):
    """Input that cannot be used: a file, a value, a name."""


class StoreError(CranktrainError):
    """A stored file that is missing, corrupt, stale or foreign."""


class SolverError(CranktrainError):
    """A step that could not be completed; the state stays at the last good time."""


def shown(value: object) -> str:
    """Text of a file's value for a message, cut to ``LONGEST_SHOWN`` characters."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # Python refuses to print integers of thousands of digits
        return "a value too long to show"
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}…"


def as_float(value: float) -> float:
    """The number in double precision; ±infinity for an integer too large for ``float``."""
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def within(where: str, value: float, low: float, high: float, what: str) -> None:
    """Raise ``InputError`` if a number is out of bounds; ``what`` is the number's unit and any alternative value."""
    if not low <= value <= high:
        said = f"{value:g}" if isinstance(value, float) or abs(value) < 10**15 else shown(value)
        raise InputError(f"{where} {said} is not within {low:g} to {high:g} {what}".rstrip())


def nearest(name: str, valid: Iterable[str]) -> str:
    """Hint for a message: the name in ``valid`` closest to ``name``, ignoring case, or all names if none is close."""
    names = [str(v) for v in valid]
    small = {one.lower(): one for one in reversed(names)}
    close = get_close_matches(name, names, n=1, cutoff=0.5)
    folded = [small[one] for one in get_close_matches(name.lower(), small, n=1, cutoff=0.5)]
    # A name that differs only in case is closer than a name that differs in a letter.
    if folded and (not close or folded[0].lower() == name.lower()):
        close = folded
    return f"did you mean '{close[0]}'?" if close else "valid: " + ", ".join(names)
