"""Default names of result files, with all options that differ from the default, so that no run replaces another."""

import hashlib
import re
from pathlib import Path
from typing import Any

LEVELS = ("crank", "bearings")
"""Options whose values appear without the option's name."""
APART = ("speed_rpm", "speeds_rpm", "output", "plots", "steady", "export_ssp")
"""Options that are left out: they do not change the result, or are in the name anyway."""
LONGEST, LONGEST_NAME = 24, 120
"""Largest number of characters of a value, and of a name; a digest replaces the rest."""


SIMPLE = str, int, float, list, tuple, Path
"""Types of values that come from a command line."""


def result_name(engine: str, ask: Any, kind: str = "") -> str:
    """Name of a verb's result: engine, speed, kind of result, and all options that differ from the default."""
    words = [f"{engine}_{ask.speed_rpm:g}rpm", *([kind] if kind else [])]
    for name, value in vars(ask).items():
        default = getattr(type(ask), name, None)
        # An array or a function, which only the library accepts, is never the default.
        if name not in APART and value is not default and not (isinstance(value, SIMPLE) and value == default):
            words.append(_word(name.replace("_", "-"), value))
    return f"{_short('_'.join(words), LONGEST_NAME)}.h5"


def _word(name: str, value: object) -> str:
    """Part of a file's name for an option."""
    if isinstance(value, bool):
        return name if value else f"no-{name}"
    if not isinstance(value, SIMPLE):
        return f"{name}-own"
    text = "+".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
    text = _short(re.sub(r"[^\w.+-]+", "-", text).strip("-."), LONGEST, text)
    return text if name in LEVELS else f"{name}-{text}"


def _short(text: str, longest: int, whole: str = "") -> str:
    """Text shortened to ``longest`` characters, with a digest as its end."""
    if len(text) <= longest:
        return text
    digest = hashlib.sha256((whole or text).encode("utf-8", "surrogateescape")).hexdigest()[:8]
    return f"{text[: longest - 9]}-{digest}"
