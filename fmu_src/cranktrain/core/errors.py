"""Errors that reach a user: one line that says what, where and what to do.

Every error derives from :class:`CranktrainError`; the command line prints its text and exits with code 2, the FMU
raises it with the same text.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


class CranktrainError(Exception):
    """Wrong input or a failed computation, described in one line."""


class InputError(CranktrainError):
    """Input that cannot be used: a file, a value, a name."""


class StoreError(CranktrainError):
    """A stored file that is missing, corrupt, stale or foreign."""


class SolverError(CranktrainError):
    """A step that could not be completed; the state stays at the last good time."""


def nearest(name: str, valid: Iterable[str]) -> str:
    """Say which of ``valid`` is closest to ``name``, or list them all where none is close."""
    names = [str(v) for v in valid]
    close = get_close_matches(name, names, n=1, cutoff=0.5)
    return f"did you mean '{close[0]}'?" if close else "valid: " + ", ".join(names)
