"""Entries of what happens in a scenario: steps, ramps, signals, misfires; noise, drop-outs; faults."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain.studies.harness.entries import GIVES, KINDS, LAST, NAN, Change, Dropout, Fault, Noise
from cranktrain.studies.harness.measures import named
from cranktrain.studies.harness.places import Times, need, table_of, variable
from cranktrain.studies.typed_table import NUMBER, NUMBERS, TEXT, WHOLE

Entries = Sequence[tuple[str, Mapping[str, Any]]]
_TARGET = {"input": TEXT, "unit": TEXT}


def changes(given: Mapping[str, Entries], units: Mapping[str, Any], times: Times, where: str) -> tuple[Change, ...]:
    """Changes of inputs, sorted by time; ``InputError`` where two of one input overlap."""
    found = [change for at, table in given["step"] for change in _step(at, table, units, times)]
    found += [change for at, table in given["ramp"] for change in _ramp(at, table, units, times)]
    found += [change for at, table in given["signal"] for change in _signal(at, table, units, times)]
    found += [change for at, table in given["misfire"] for change in _misfire(at, table, times)]
    found.sort(key=lambda change: (change.target, change.begin, change.end))
    for one, next_ in pairwise(found):
        if one.target == next_.target and next_.begin < one.end:
            raise InputError(
                f"{where}: {'.'.join(one.target).lstrip('.')} is changed twice between {next_.begin:.6g} s and "
                f"{one.end:.6g} s; let changes of an input follow one another"
            )
    return tuple(found)


def _target(at: str, table: Mapping[str, Any], units: Mapping[str, Any]) -> tuple[tuple[str, str], str]:
    need(table, at, "input")
    return variable(table["input"], f"{at}: input", units), named(table.get("unit", ""), at)


def _step(at: str, table: Mapping[str, Any], units: Mapping[str, Any], times: Times) -> list[Change]:
    """An input that jumps to a value."""
    table_of(table, _TARGET | times.keys("at") | {"value": NUMBER}, at)
    need(table, at, "input", "value")
    target, unit = _target(at, table, units)
    time = times.of(table, "at", at)
    return [Change(target, time, time, float(table["value"]), unit)]


def _ramp(at: str, table: Mapping[str, Any], units: Mapping[str, Any], times: Times) -> list[Change]:
    """An input that goes linearly from what it is to a value."""
    table_of(table, _TARGET | times.keys("from", "to") | {"value": NUMBER}, at)
    need(table, at, "input", "value")
    target, unit = _target(at, table, units)
    begin, end = times.of(table, "from", at, 0.0), times.of(table, "to", at)
    if not begin < end:
        raise InputError(f"{at}: from {begin:g} s must be before to {end:g} s")
    return [Change(target, begin, end, float(table["value"]), unit)]


def _signal(at: str, table: Mapping[str, Any], units: Mapping[str, Any], times: Times) -> list[Change]:
    """An input that goes linearly from point to point; two of one time are a jump."""
    table_of(table, _TARGET | {"times_s": NUMBERS, "times_cycles": NUMBERS, "values": NUMBERS}, at)
    need(table, at, "input", "values")
    target, unit = _target(at, table, units)
    keys = [key for key in ("times_s", "times_cycles") if key in table]
    if len(keys) != 1:
        raise InputError(f"{at}: give times_s or times_cycles, and values")
    values, points = table["values"], table[keys[0]]
    if len(points) != len(values) or not points:
        raise InputError(f"{at}: {len(points)} times for {len(values)} values; give one for each")
    place = [times.of({f"at_{keys[0].removeprefix('times_')}": point}, "at", at) for point in points]
    if any(one > next_ for one, next_ in pairwise(place)):
        raise InputError(f"{at}: {keys[0]} must not decrease")
    begins = [place[0], *place[:-1]]
    return [
        Change(target, begin, end, float(value), unit) for begin, end, value in zip(begins, place, values, strict=True)
    ]


def _misfire(at: str, table: Mapping[str, Any], times: Times) -> list[Change]:
    """A cylinder without fuel from a time on, or between two."""
    table_of(table, {"cylinder": WHOLE} | times.keys("from", "to"), at)
    need(table, at, "cylinder")
    begin, end = times.span(table, at)
    target = "", f"cylinder[{table['cylinder']}].fuel_mass"
    cut = Change(target, begin, begin, 0.0)
    return [cut] if math.isinf(end) else [cut, Change(target, end, end, None)]


def noises(given: Entries, units: Mapping[str, Any], times: Times) -> tuple[Noise, ...]:
    """Noise on inputs."""
    found = []
    for at, table in given:
        table_of(table, _TARGET | times.keys("from", "to") | {"rms": NUMBER, "seed": WHOLE}, at)
        need(table, at, "input", "rms")
        target, unit = _target(at, table, units)
        if table["rms"] < 0 or table.get("seed", 0) < 0:
            raise InputError(f"{at}: rms and seed must not be below zero")
        found.append(Noise(target, *times.span(table, at), float(table["rms"]), unit, table.get("seed", 0)))
    return tuple(found)


def dropouts(given: Entries, units: Mapping[str, Any], times: Times) -> tuple[Dropout, ...]:
    """Drop-outs of connections; ``InputError`` where two of one input overlap."""
    found: list[Dropout] = []
    for at, table in given:
        table_of(table, {"input": TEXT, "gives": TEXT} | times.keys("from", "to"), at)
        target, _ = _target(at, table, units)
        one = Dropout(target, *times.span(table, at), table.get("gives", LAST))
        _word(one.gives, GIVES, f"{at}: gives")
        for other in found:
            if other.target == one.target and one.begin < other.end and other.begin < one.end:
                raise InputError(f"{at}: {table['input']} drops out twice at the same time; let one follow the other")
        found.append(one)
    return tuple(found)


def faults(given: Entries, units: Mapping[str, Any], times: Times, where: str) -> tuple[Fault, ...]:
    """Faults of units, one each."""
    found: dict[str, Fault] = {}
    for at, table in given:
        table_of(table, {"of": TEXT, "kind": TEXT, "output": TEXT} | times.keys("at"), at)
        need(table, at, "of", "kind")
        unit, kind = table["of"], table["kind"]
        if unit not in units:
            raise InputError(f"{at}: there is no unit '{unit}'; {nearest(unit, units)}")
        _word(kind, KINDS, f"{at}: kind")
        if "output" in table and kind != NAN:
            raise InputError(f"{at}: output belongs to kind = '{NAN}'; leave it out")
        if unit in found:
            raise InputError(f"{where}: unit {unit} has two faults; make a scenario of each")
        found[unit] = Fault(unit, times.of(table, "at", at), kind, table.get("output", ""))
    return tuple(found.values())


def _word(value: str, valid: Sequence[str], where: str) -> None:
    if value not in valid:
        raise InputError(f"{where} '{value}' does not exist; {nearest(value, valid)}")
