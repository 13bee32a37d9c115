"""Selection of the fidelity levels that an engine's FMU contains.

Nearly all levels are made in seconds. Two take minutes at the first build: the film tables of level ``table``, of main
bearings and big ends, and the finite elements of block level ``flexible``. They are made for an FMU only if they are
requested or its start values need them. A level that an FMU does not contain is refused at initialization.

An FMU with levels ``basic`` has no bearing level with films that are solved or read from a table, so it needs neither
their kernels nor elastic bores.
"""

from collections.abc import Sequence
from dataclasses import replace

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.kernel import kernel_name
from cranktrain.core.machine_code import kind_of
from cranktrain.core.named import resolve
from cranktrain.dynamics.model.settings import Settings, needed_parts, resolved
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import LAWS, Law
from cranktrain.fmu.description import Interface

BASIC, USUAL, ALL = "basic", "usual", "all"
SLOW = {
    "table": ("table", "big_end_table"),
    "flexible": ("block",),
}
"""Levels whose data take minutes to make, each with the parts of a run that only this level needs."""
WHERE = {"table": "bearing.level and big_end.level table", "flexible": "block.level flexible"}
"""Text for each slow level: the FMU's parameters and the value that chooses the level."""
WORDS = (BASIC, USUAL, ALL, *SLOW)


def carried_levels(engine: Engine, asked: str | Sequence[str] = USUAL, start: Settings | None = None) -> frozenset[str]:
    """Levels among :data:`SLOW` that an engine's FMU contains; ``InputError`` for an unknown word.

    Parameters
    ----------
    asked : ``basic`` or ``usual``: those that the start values need; ``all``; or names in :data:`SLOW`, which are
        added to the usual ones; several as a list, or as one text with commas
    start : levels at which the FMU starts; default the usual ones
    """
    given = [asked] if isinstance(asked, str) else list(asked)
    words = [word.strip() for text in given for word in text.split(",")]
    for word in words:
        if word not in WORDS:
            raise InputError(f"levels '{word}' do not exist; {nearest(word, WORDS)}")
    if BASIC in words and len(set(words)) > 1:
        raise InputError(f"levels '{BASIC}' cannot be combined with other levels; leave it or the others out")
    possible = {"flexible"} if engine.block is not None and engine.mounts is not None else set()
    possible |= {"table"} if engine.main_bearing is not None or engine.big_end_bearing is not None else set()
    needed = needed_parts(engine, resolved(start or Settings(), engine))
    at_start = {level for level, parts in SLOW.items() if any(part in needed for part in parts)}
    wanted = possible if ALL in words else possible & set(words)
    return frozenset(wanted | (possible & at_start))


def film_levels() -> frozenset[str]:
    """Bearing levels with films that are solved or read from a table."""

    def has_films(law: Law) -> bool:
        kernels = [resolve(form.kernel) for form in law.forms.values() if form.kernel]
        return any(kind_of(kernel_name(kernel)) == "films" for kernel in kernels)

    return frozenset(name for name, law in LAWS.items() if has_films(law))


def without_films(interface: Interface) -> Interface:
    """Interface without the levels of :func:`film_levels`; ``InputError`` if it starts at one of them."""
    levels = film_levels()
    for variable in interface.variables:
        if variable.choices and variable.start in levels:
            raise InputError(f"levels '{BASIC}' lack {variable.name} {variable.start}, at which the FMU starts")
    kept = [replace(v, choices=tuple(name for name in v.choices if name not in levels)) for v in interface.variables]
    return replace(interface, variables=tuple(kept))


def left_out_text(engine: Engine, carried: frozenset[str]) -> str:
    """Message about levels that an FMU leaves out, and how to include them; empty if there are none."""
    missing = [level for level in SLOW if level in carried_levels(engine, ALL) - carried]
    if not missing:
        return ""
    named = " and ".join(WHERE[level] for level in missing)
    return f"without {named}, whose data take minutes; --levels {ALL} adds them"
