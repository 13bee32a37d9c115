"""Engine file of a choice of the knobs: the old file's text with changed values and their origin."""

import math
import tomllib
from collections.abc import Mapping, Sequence
from datetime import date
from hashlib import sha256
from pathlib import Path
from typing import Any

from cranktrain import __version__
from cranktrain.core.errors import InputError
from cranktrain.core.user_file import ending, user_path
from cranktrain.engine import values as places
from cranktrain.engine.file import engine_of, engine_path
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import UNITS
from cranktrain.store.engine_text import Written, rewritten
from cranktrain.store.whole_file import check_place, whole_file
from cranktrain_lab.explore.knobs import FIRING, LOAD, Chosen, Knob, changes_of, chosen_engine

Source = str | Path | Engine


class Change:
    """Changed value of an engine file, with old and new value as text."""

    def __init__(self, engine: Engine, key: str, value: Any) -> None:
        self.key, self.value = key, value
        if key == FIRING:
            self.old, self.new = (_order(one) for one in (engine.cylinders.firing_order, value))
            return
        rule = places.quantity(engine, key)
        unit = rule.unit or next(iter(UNITS[rule.dimension]))
        scale, own = UNITS[rule.dimension][unit], "" if unit == "1" else f" {unit}"
        self.old, self.new = (f"{one / scale:.6g}{own}" for one in (places.value(engine, key), value))

    def __str__(self) -> str:
        return f"{self.key}: {self.old} -> {self.new}"


def changes(engine: Engine, knobs: Sequence[Knob], chosen: Chosen) -> list[Change]:
    """Return the values that a choice changes in the engine file, in the order of the knobs (load excluded)."""
    return [Change(engine, key, value) for key, value in changes_of(engine, knobs, chosen).items()]


def engine_text(source: Source, engine: Engine, knobs: Sequence[Knob], chosen: Chosen) -> str:
    """Return the text of the engine file for a choice of the knobs.

    Comments, origins and notes of the source file are kept. Changed values have the origin *chosen*, and their notes
    contain the old value. An engine in memory is written completely.

    Raises ``InputError`` if nothing is changed, or for an entry that is not of the form ``name = ...`` in its table.
    """
    found = changes(engine, knobs, chosen)
    if not found:
        load = "; the load is none of an engine file" if LOAD in chosen.values else ""
        raise InputError(f"no value of the engine file is changed{load}; turn a knob first")
    if isinstance(source, Engine):
        return _head(engine.name, "", found) + chosen_engine(source, knobs, chosen).to_toml()
    path = engine_path(source)
    text = path.read_text("utf-8")
    document = tomllib.loads(text)
    written: Mapping[str, Written] = {
        one.key: Written(one.value, "chosen", f"cranktrain explore: {one.old} before{_was(document, one.key)}")
        for one in found
    }
    return _head(path.name, sha256(text.encode()).hexdigest()[:16], found) + rewritten(text, engine, written)


def write_engine(source: Source, engine: Engine, knobs: Sequence[Knob], chosen: Chosen, target: str | Path) -> Path:
    """Write a new engine file of a choice, verify it by reading it back, and return its path.

    On ``InputError`` nothing is written.
    """
    path = user_path(target)
    if path.exists():
        raise InputError(f"{path}: exists and is not overwritten; give another name")
    if ending(path) != ".toml":
        raise InputError(f"{path}: an engine file ends in .toml; give such a name")
    check_place(path)
    text = engine_text(source, engine, knobs, chosen)
    whole = engine
    if not isinstance(source, Engine):
        old = engine_path(source)
        whole = engine_of(tomllib.loads(old.read_text("utf-8")), path.name, old.parent)
    wanted = chosen_engine(whole, knobs, chosen)
    found = engine_of(tomllib.loads(text), path.name, path.absolute().parent)
    for change in changes(engine, knobs, chosen):
        same = _order(found.cylinders.firing_order) == change.new if change.key == FIRING else (
            math.isclose(places.value(found, change.key), change.value, rel_tol=1e-9))  # fmt: skip
        if not same:
            raise InputError(f"{path}: {change.key} would not be {change.new} there; write the value by hand")
    if found.body != wanted.body:
        raise InputError(f"{path}: the engine file names files beside it; write the new one beside it too")
    with whole_file(path) as place:
        place.write_text(text, "utf-8")
    return path


def _head(name: str, digest: str, found: Sequence[Change]) -> str:
    """Return the comment with the source and the list of changes."""
    of = f" (SHA-256 {digest}…)" if digest else ""
    lines = [
        f"# Written by cranktrain explore {__version__} on {date.today().isoformat()} from {name}{of}.",
        "# Changed:",
    ]
    return "\n".join([*lines, *(f"#   {change}" for change in found)]) + "\n\n"


def _was(document: Mapping[str, Any], key: str) -> str:
    """Return origin and note of a key's old value, in brackets."""
    table, _, entry = key.partition("[")[0].partition(".")
    old = document.get(table, {}).get(entry)
    if not isinstance(old, dict):
        return " (the default)"
    note = f": {old['note']}" if old.get("note") else ""
    return f" ({old['origin']}{note})"


def _order(order: Sequence[int]) -> str:
    return "-".join(map(str, order))
