"""Default names of result files: they tell all options that differ from the usual, so that no run replaces another."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Any

LEVELS = ("crank", "bearings")
"""Options whose values speak for themselves."""
APART = ("speed_rpm", "output", "plots", "steady", "export_ssp")
"""Options that change nothing in a result's file, and those that its name tells anyway."""
LONGEST, LONGEST_NAME = 24, 120
"""Characters of a value, and of a name, beyond which a digest stands for the rest."""


SIMPLE = str, int, float, list, tuple, Path
"""Kinds of options that a command line gives."""


def result_name(engine: str, ask: Any, kind: str = "") -> str:
    """Name of a verb's result: engine, speed, what kind it is, and all of its question that is not the default."""
    words = [f"{engine}_{ask.speed_rpm:g}rpm", *([kind] if kind else [])]
    for name, value in vars(ask).items():
        if name not in APART and not _is(value, getattr(type(ask), name, None)):
            words.append(_word(name.replace("_", "-"), value))
    return f"{_short('_'.join(words), LONGEST_NAME)}.h5"


def _is(value: object, default: object) -> bool:
    """Whether an option has its default; an array or a function, which the library takes, has not."""
    return value is default or (isinstance(value, SIMPLE) and value == default)


def _word(name: str, value: object) -> str:
    """An option as a part of a file's name."""
    if isinstance(value, bool):
        return name if value else f"no-{name}"
    if not isinstance(value, SIMPLE):
        return f"{name}-own"
    text = "+".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
    text = _short(re.sub(r"[^\w.+-]+", "-", text).strip("-."), LONGEST, text)
    return text if name in LEVELS else f"{name}-{text}"


def _short(text: str, longest: int, whole: str = "") -> str:
    """Text whose end is a digest where it is too long."""
    if len(text) <= longest:
        return text
    digest = hashlib.sha256((whole or text).encode("utf-8", "surrogateescape")).hexdigest()[:8]
    return f"{text[: longest - 9]}-{digest}"
