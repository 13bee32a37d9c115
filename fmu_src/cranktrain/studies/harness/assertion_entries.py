"""Entries of what is asked of a scenario: of time series, of orders, of power, and of how the run ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain.studies.harness.entries import BY_FAILURE, ENDS, MEASURES, ORDER, RMS, Assertion, Bounds, Ending
from cranktrain.studies.harness.measures import named
from cranktrain.studies.harness.places import Times, table_of, variable
from cranktrain.studies.typed_table import NUMBER, TEXT

_BOUNDS = ("expected", "tolerance", "absolute", "least", "most")
_ASSERTION = {
    **dict.fromkeys(("name", "output", "residual", "what", "unit", "ratio_to"), TEXT),
    **dict.fromkeys((*_BOUNDS, "order", "over_cycles"), NUMBER),
}
_ENDING = {"how": TEXT, "of": TEXT, "says": TEXT, "within_s": NUMBER}


def assertion(
    at: str, table: Mapping[str, Any], units: Mapping[str, Any], times: Times, scenario: str, names: Sequence[str]
) -> Assertion:
    """An assertion of a scenario, ``names`` being those of all; ``InputError``."""
    table_of(table, _ASSERTION | times.keys("from", "to"), at)
    if ("output" in table) == ("residual" in table):
        raise InputError(f'{at}: give output = "unit.variable", or residual = "gas", a power bond\'s')
    measure = table.get("what", ORDER if "order" in table else RMS if "residual" in table else "")
    if measure not in MEASURES:
        said = f"what '{measure}' does not exist" if measure else "what is missing"
        raise InputError(f"{at}: {said}; {nearest(measure, MEASURES)}")
    order = float(table.get("order", 0.0))
    if (measure == ORDER) != ("order" in table):
        raise InputError(f"{at}: order = 0.5, 1, 1.5, … goes with what = 'order', and with nothing else")
    if measure == ORDER and not (order > 0.0 and (2.0 * order).is_integer()):
        raise InputError(f"{at}: order {order:g} is not 0.5, 1, 1.5, …")
    cycles, begin, end = table.get("over_cycles"), *times.span(table, at)
    if cycles is not None:
        if begin > 0.0 or end < float("inf"):
            raise InputError(f"{at}: over_cycles and a time from or to exclude each other; leave one out")
        if times.speed is None:
            raise InputError(f"{at}: over_cycles needs speed_rpm; give it, or from_s and to_s")
        times.of({"at_cycles": cycles}, "at", f"{at}: over_cycles")
        if not cycles > 0:
            raise InputError(f"{at}: over_cycles {cycles:g} must be above zero")
    if measure == ORDER and (begin > 0.0 or end < float("inf") or cycles not in (None, 1)):
        raise InputError(f"{at}: an order is that of the last cycle; leave the window out")
    other = table.get("ratio_to", "")
    if other and (other == scenario or other not in names):
        raise InputError(f"{at}: ratio_to: '{other}' is no other scenario; {nearest(other, names)}")
    output = variable(table["output"], f"{at}: output", units) if "output" in table else None
    unit = named(table.get("unit", ""), at)
    return Assertion(
        table.get("name", ""), output, table.get("residual", ""), measure, order,
        None if cycles is None else float(cycles), begin, end, _bounds(at, table), unit, other,
    )  # fmt: skip


def _bounds(at: str, table: Mapping[str, Any]) -> Bounds:
    found = Bounds(*(None if table.get(key) is None else float(table[key]) for key in _BOUNDS))
    if found.expected is None:
        if found.least is None and found.most is None:
            raise InputError(f"{at}: nothing is expected; give expected and tolerance, or least and most")
        if found.relative is not None or found.absolute is not None:
            raise InputError(f"{at}: a tolerance goes with expected; give it, or leave the tolerance out")
        if found.least is not None and found.most is not None and found.least > found.most:
            raise InputError(f"{at}: least {found.least:g} is above most {found.most:g}")
        return found
    if found.least is not None or found.most is not None:
        raise InputError(f"{at}: expected and least or most exclude each other; leave one out")
    if (found.relative is None) == (found.absolute is None):
        raise InputError(f"{at}: give tolerance, a share of what is expected, or absolute, in its unit")
    if min(value for value in (found.relative, found.absolute) if value is not None) < 0.0:
        raise InputError(f"{at}: a tolerance must not be below zero")
    return found


def ending(
    given: Sequence[tuple[str, Mapping[str, Any]]], units: Mapping[str, Any], times: Times, step: float, where: str
) -> Ending:
    """How a scenario is to end: to the end where nothing is said; ``step`` (s) is the tolerance of a time."""
    if not given:
        return Ending()
    if len(given) > 1:
        raise InputError(f"{where}: {len(given)} entries of [[scenario.ends]]; a run ends once")
    at, table = given[0]
    table_of(table, _ENDING | times.keys("at"), at)
    how, unit = table.get("how", BY_FAILURE), table.get("of", "")
    if how not in ENDS:
        raise InputError(f"{at}: how '{how}' does not exist; {nearest(how, ENDS)}")
    if how != BY_FAILURE and len(table) > 1:
        raise InputError(f"{at}: of, says and a time go with how = '{BY_FAILURE}'; leave them out")
    if unit and unit not in units:
        raise InputError(f"{at}: there is no unit '{unit}'; {nearest(unit, units)}")
    timed = any(key in table for key in times.keys("at"))
    tolerance = float(table.get("within_s", 1.001 * step))
    return Ending(how, unit, times.of(table, "at", at) if timed else None, tolerance, table.get("says", ""))
