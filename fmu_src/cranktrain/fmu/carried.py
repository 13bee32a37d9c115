"""Which fidelity levels the FMU of an engine carries.

Nearly all levels are made in seconds. Two take minutes at the first build: the film tables of level ``table``, of main
bearings and big ends, and the finite elements of block level ``flexible``. They are made for an FMU that is asked to
carry them, or whose start values need them. A level that an FMU does not carry is refused at initialization.
"""

from __future__ import annotations

from collections.abc import Sequence

from cranktrain.core.errors import InputError, nearest
from cranktrain.dynamics.model.settings import Settings, needed_parts, resolved
from cranktrain.engine.model import Engine

USUAL, ALL = "usual", "all"
SLOW = {
    "table": ("table", "big_end_table"),
    "flexible": ("block",),
}
"""Levels whose data take minutes, and the parts of a run that only they need."""
WHERE = {"table": "bearing.level and big_end.level table", "flexible": "block.level flexible"}
"""What the FMU calls them."""
WORDS = (USUAL, ALL, *SLOW)


def carried_levels(engine: Engine, asked: str | Sequence[str] = USUAL, start: Settings | None = None) -> frozenset[str]:
    """Levels among :data:`SLOW` that an FMU of the engine carries; ``InputError`` for an unknown word.

    Parameters
    ----------
    asked : ``usual``: those that the start values need; ``all``; or names of :data:`SLOW`, which are added to the usual
        ones; several are a list, or one text with commas
    start : levels at which the FMU starts; not given: the usual ones
    """
    given = [asked] if isinstance(asked, str) else list(asked)
    words = [word.strip() for text in given for word in text.split(",")]
    for word in words:
        if word not in WORDS:
            raise InputError(f"levels '{word}' do not exist; {nearest(word, WORDS)}")
    possible = {"flexible"} if engine.block is not None and engine.mounts is not None else set()
    possible |= {"table"} if engine.main_bearing is not None or engine.big_end_bearing is not None else set()
    needed = needed_parts(engine, resolved(start or Settings(), engine))
    at_start = {level for level, parts in SLOW.items() if any(part in needed for part in parts)}
    wanted = possible if ALL in words else possible & set(words)
    return frozenset(wanted | (possible & at_start))


def left_out_text(engine: Engine, carried: frozenset[str]) -> str:
    """Levels that an FMU leaves out although the engine has them, and how to get them; empty if there are none."""
    missing = [level for level in SLOW if level in carried_levels(engine, ALL) - carried]
    if not missing:
        return ""
    named = " and ".join(WHERE[level] for level in missing)
    return f"without {named}, whose data take minutes; --levels {ALL} adds them"
