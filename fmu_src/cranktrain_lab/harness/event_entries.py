"""Parsing of a scenario's events: steps, ramps, signals, misfires, noise, drop-outs and faults."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain_lab.harness.entries import NAN, Change, Dropout, Fault, Noise
from cranktrain_lab.harness.measures import Times, named, variable
from cranktrain_lab.harness.tables import At, Signal

Entries = Sequence[tuple[str, Any]]
"""Entries of a scenario, each with its name in messages and its TOML table."""


def changes(given: Mapping[str, Entries], units: Mapping[str, Any], times: Times, where: str) -> tuple[Change, ...]:
    """Return all changes of inputs, sorted by time; raises ``InputError`` if two changes of one input overlap."""
    found: list[Change] = []
    for at, table in given["step"]:
        target, unit = _target(at, table, units)
        time = times.before_end(table, "at", at)
        found.append(Change(target, time, time, table.value, unit))
    for at, table in given["ramp"]:
        target, unit = _target(at, table, units)
        found.append(Change(target, *times.span(table, at, endless=False), table.value, unit))
    for at, table in given["signal"]:
        found += _signal(at, table, units, times)
    for at, table in given["misfire"]:  # a cylinder without fuel, from a time on or between two times
        begin, end = times.event(table, at)
        target, other = (("", f"cylinder[{table.cylinder}].{name}") for name in ("fuel_mass", "air_ratio"))
        found.append(Change(target, begin, begin, 0.0, other=other))
        if math.isfinite(end):
            found.append(Change(target, end, end, None, other=other))
    found.sort(key=lambda change: (change.target, change.begin, change.end))
    for one, next_ in pairwise(found):
        if one.target == next_.target and next_.begin < one.end:
            raise InputError(
                f"{where}: {'.'.join(one.target).lstrip('.')} is changed twice between {next_.begin:.6g} s and "
                f"{one.end:.6g} s; changes of one input must not overlap"
            )
    return tuple(found)


def _target(at: str, table: Any, units: Mapping[str, Any]) -> tuple[tuple[str, str], str]:
    return variable(table.input, f"{at}: input", units), named(table.unit, at)


def _signal(at: str, table: Signal, units: Mapping[str, Any], times: Times) -> list[Change]:
    """Return the changes of an input that goes linearly from point to point; two points at one time are a jump."""
    target, unit = _target(at, table, units)
    if (table.times_s is None) == (table.times_cycles is None):
        raise InputError(f"{at}: give times_s or times_cycles, and values")
    values, in_s = table.values, table.times_s is not None
    points = (table.times_s if in_s else table.times_cycles) or []
    if len(points) != len(values) or not points:
        raise InputError(f"{at}: {len(points)} times for {len(values)} values; give one for each")
    place = [times.of(At(at_s=point) if in_s else At(at_cycles=point), "at", at) for point in points]
    if any(one > next_ for one, next_ in pairwise(place)):
        raise InputError(f"{at}: {'times_s' if in_s else 'times_cycles'} must not decrease")
    begins = [place[0], *place[:-1]]
    return [Change(target, begin, end, value, unit) for begin, end, value in zip(begins, place, values, strict=True)]


def noises(given: Entries, units: Mapping[str, Any], times: Times) -> tuple[Noise, ...]:
    """Return the noise on inputs."""
    found = []
    for at, table in given:
        target, unit = _target(at, table, units)
        if table.rms < 0 or table.seed < 0:
            raise InputError(f"{at}: rms and seed must not be below zero")
        found.append(Noise(target, *times.event(table, at), table.rms, unit, table.seed))
    return tuple(found)


def dropouts(given: Entries, units: Mapping[str, Any], times: Times) -> tuple[Dropout, ...]:
    """Return drop-outs of connections; raises ``InputError`` if two drop-outs of one input overlap."""
    found: list[Dropout] = []
    for at, table in given:
        target = variable(table.input, f"{at}: input", units)
        one = Dropout(target, *times.event(table, at), table.gives)
        for other in found:
            if other.target == one.target and one.begin < other.end and other.begin < one.end:
                raise InputError(f"{at}: {table.input} has drop-outs that overlap; let one follow the other")
        found.append(one)
    return tuple(found)


def faults(given: Entries, units: Mapping[str, Any], times: Times, where: str) -> tuple[Fault, ...]:
    """Return faults of units, at most one per unit."""
    found: dict[str, Fault] = {}
    for at, table in given:
        unit, kind = table.of, table.kind
        if unit not in units:
            raise InputError(f"{at}: there is no unit '{unit}'; {nearest(unit, units)}")
        if table.output and kind != NAN:
            raise InputError(f"{at}: output belongs to kind = '{NAN}'; leave it out")
        if unit in found:
            raise InputError(f"{where}: unit {unit} has two faults; give each its own scenario")
        found[unit] = Fault(unit, times.before_end(table, "at", at), kind, table.output)
    return tuple(found.values())
