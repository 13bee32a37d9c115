"""Engine file of an identification: the old text with identified values and their source, date and interval."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

from cranktrain import __version__
from cranktrain.core.errors import InputError
from cranktrain.engine import values as places
from cranktrain.engine.file import engine_of
from cranktrain.engine.model import Engine
from cranktrain.store.engine_text import Written, put, rewritten, rounded, write_new
from cranktrain_lab.identification.parameters import RATIOS, Sought, following

IDENTIFIED = "identified"


def identified_text(
    text: str, engine: Engine, sought: Sequence[Sought], rows: Sequence[Mapping[str, Any]], data: str, name: str,
    *, interrupted: bool = False,
) -> str:  # fmt: skip
    """Return the text of the new engine file.

    Parameters
    ----------
    text, engine : text and engine of the old file
    sought, rows : parameters, and report row of each
    data, name : names of the measured file and of the old engine file
    interrupted : True if the search ended early; values then have no intervals
    """
    if interrupted:
        rows = [{**row, "low": None} for row in rows]
    written: dict[str, Written] = {}
    notes = _notes(sought, rows, data)
    for one, row in zip(sought, rows, strict=True):
        if one.in_file and not one.key.startswith(RATIOS):
            value = rounded(one.scale * row["value"], one.scale) + one.zero
            written[one.key] = Written(value, IDENTIFIED, notes[one.key.partition("[")[0]])
            for key, number in following(engine, sought, one, value).items():
                written[key] = Written(rounded(number), "derived", f"follows {one.key} in proportion")
    ratios = [(one, row) for one, row in zip(sought, rows, strict=True) if one.key.startswith(RATIOS)]
    found = rewritten(text, engine, written)
    if ratios:
        found = _with_ratios(found, engine, ratios, data)
    others = [f"#   {row['key']} = {row['value']:.4g} {row['unit']}, {_interval(row)}: no value of an engine file"
              for one, row in zip(sought, rows, strict=True) if not one.in_file]  # fmt: skip
    head = [f"# Written by cranktrain identify {__version__} on {date.today().isoformat()} from {name} and {data}."]
    return "\n".join([*head, *others, "", ""]) + found


def _interval(row: Mapping[str, Any]) -> str:
    """Return a parameter's confidence interval in words. An interrupted search has no interval."""
    if row["low"] is None:
        return "best so far of an interrupted search, without interval"
    return f"95 % from {row['low']:.4g} to {row['high']:.4g}"


def _note(one: Sought, row: Mapping[str, Any], data: str) -> str:
    """Return the note of an identified value: data, date, interval, and the note of the measured file."""
    unit = "" if one.unit == "1" else f" {one.unit}"
    unit = unit if row["low"] is not None else ""
    return f"from {data}, {date.today().isoformat()}; {_interval(row)}{unit}" + (f"; {one.note}" if one.note else "")


def _notes(sought: Sequence[Sought], rows: Sequence[Mapping[str, Any]], data: str) -> dict[str, str]:
    """Return the note of each identified value. A list has one note for all its identified values, by number."""
    notes: dict[str, str] = {}
    for one, row in zip(sought, rows, strict=True):
        base, _, number = one.key.partition("[")
        note = _note(one, row, data)
        note = f"value {number.rstrip(']')} {note}" if number else note
        notes[base] = f"{notes[base]}; {note}" if base in notes else note
    return notes


def _with_ratios(
    text: str, engine: Engine, ratios: Sequence[tuple[Sought, Mapping[str, Any]]], data: str
) -> str:  # fmt: skip
    """Return the text with the list of damping ratios, which is added if the file has none."""
    values = list(engine.damping.torsional_ratios)
    for one, row in ratios:
        index = re.search(r"\[(\d+)\]", one.key)
        for k in range(len(values)) if index is None else [int(index[1]) - 1]:
            values[k] = float(f"{row['value'] * one.scale:.4g}")
    note = "; ".join(
        f"mode {one.key.partition('[')[2].rstrip(']') or 'all'} {_note(one, row, data)}" for one, row in ratios
    )
    listed = f"[{', '.join(f'{value:.4g}' for value in values)}]"
    lines = text.splitlines()
    put(lines, RATIOS, listed, "1", Written(0.0, IDENTIFIED, note))
    return "\n".join(lines) + "\n"


def write_identified(path: Path, text: str, beside: Path, sought: Sequence[Sought], rows: Sequence[Any]) -> None:
    """Write a new engine file and verify it by reading it back; on ``InputError`` nothing is written."""
    found = engine_of(tomllib.loads(text), path.name, beside)
    for one, row in zip(sought, rows, strict=True):
        if one.in_file:
            wanted = row["value"] * one.scale + one.zero
            if abs(places.value(found, one.key) - wanted) > 1e-3 * abs(wanted):
                raise InputError(f"{path}: {one.key} would not be {one.text(wanted)} there; write the value by hand")
    write_new(path, text)
