"""An engine file as values with their units, origins and notes: its text, and the engine that it describes."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from cranktrain.engine.model import Engine, engine_from_dict
from cranktrain.engine.quantities import OFFSETS, UNITS
from cranktrain.engine.written import entry_text, toml_text

DIGITS, DIGITS_OF_ANGLES, DIGITS_GIVEN = 4, 9, 12
"""Numbers of significant digits: of values, of angles (more, so that firing is even), and of values stated by the user
(so many that these are not rounded)."""
FACTORS = {unit: factor for units in UNITS.values() for unit, factor in units.items()}


class Entry(NamedTuple):
    """A value of an engine file in its written unit; names, flags and counts have no unit."""

    key: str
    value: Any
    unit: str
    origin: str
    note: str

    @property
    def si(self) -> Any:
        """Value of the entry in SI units."""

        def one(value: Any) -> Any:
            numeric = isinstance(value, int | float) and self.unit not in ("", "1")
            return value * FACTORS[self.unit] + OFFSETS.get(self.unit, 0.0) if numeric else value

        return [one(value) for value in self.value] if isinstance(self.value, list) else one(self.value)

    @property
    def text(self) -> str:
        """Line of the engine file with the entry's value, unit, origin and note."""
        return entry_text(self.key, toml_text(self.value), self.unit, self.origin, self.note)


class Block(NamedTuple):
    """A table of an engine file: its name, a comment of one line, and its entries."""

    name: str
    comment: str
    entries: tuple[Entry, ...]


class Document(NamedTuple):
    """An engine file: name, title, the lines of its first comment, and its tables."""

    name: str
    title: str
    head: tuple[str, ...]
    blocks: tuple[Block, ...]

    def with_blocks(self, *blocks: Block) -> "Document":
        """Engine file with further TOML tables, which replace tables of the same name."""
        new = {block.name: block for block in blocks}
        kept = [new.pop(block.name, block) for block in self.blocks]
        return self._replace(blocks=(*kept, *new.values()))

    @property
    def engine(self) -> Engine:
        """Engine that the file describes, not yet checked."""
        tables = {block.name: {entry.key: entry.si for entry in block.entries} for block in self.blocks}
        return engine_from_dict({"name": self.name, "title": self.title, **tables})

    @property
    def text(self) -> str:
        """TOML text of the engine file."""
        lines = [*(f"# {line}".rstrip() for line in self.head), "", f'name = "{self.name}"', f'title = "{self.title}"']
        for block in self.blocks:
            lines += ["", f"# {block.comment}", f"[{block.name}]", *(entry.text for entry in block.entries)]
        return "\n".join(lines) + "\n"


def rounded(value: float, unit: str = "") -> float:
    """Number rounded to the significant digits for its unit; a whole number becomes an int."""
    return _short(float(f"{value:.{DIGITS_OF_ANGLES if unit == 'deg' else DIGITS}g}"))


def derived(key: str, value: float | Sequence[float], unit: str, note: str) -> Entry:
    """Entry of an engine file whose value follows from other values (origin ``derived``)."""
    return _entry(key, value, unit, "derived", note)


def chosen(key: str, value: Any, unit: str, note: str) -> Entry:
    """Entry of an engine file whose value is chosen by a rule of practice or by the user (origin ``chosen``)."""
    return _entry(key, value, unit, "chosen", note)


def given(key: str, value: float, unit: str, note: str, origin: str = "chosen") -> Entry:
    """Entry of an engine file for a value stated by the user, or its half or double, without rounding."""
    return Entry(key, _short(float(f"{value:.{DIGITS_GIVEN}g}")), unit, origin, note)


def _short(value: float) -> float:
    return int(value) if value == int(value) and abs(value) < 10**DIGITS else value


def _entry(key: str, value: Any, unit: str, origin: str, note: str) -> Entry:
    if unit and isinstance(value, list | tuple):
        value = [rounded(one, unit) for one in value]
    elif unit:
        value = rounded(value, unit)
    return Entry(key, list(value) if isinstance(value, tuple) else value, unit, origin, note)
