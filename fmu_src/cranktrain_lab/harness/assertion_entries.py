"""Parsing of a scenario's assertions on time series, orders, power, and the end of the run."""

from collections.abc import Mapping, Sequence
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain_lab.harness.entries import BY_FAILURE, MEASURES, ORDER, RMS, SWING, Assertion, Bounds, Ending, Scenario
from cranktrain_lab.harness.measures import Times, named, variable
from cranktrain_lab.harness.tables import AssertTable, At, EndsTable


def assertion(
    at: str, table: AssertTable, units: Mapping[str, Any], times: Times, scenario: str, names: Sequence[str]
) -> Assertion:
    """Return an assertion of a scenario from its TOML table; ``names`` are those of all scenarios; ``InputError``."""
    if (table.output is None) != bool(table.residual):
        raise InputError(f'{at}: give output = "unit.variable", or residual = "gas", the name of a power bond')
    order, cycles, other = table.order, table.over_cycles, table.ratio_to
    measure = table.what or (ORDER if order is not None else RMS if table.residual else "")
    if not measure:
        raise InputError(f"{at}: what is missing; {nearest(measure, MEASURES)}")
    if (measure == ORDER) != (order is not None):
        raise InputError(f"{at}: order = 0.5, 1, 1.5, … goes with what = 'order', and with nothing else")
    if order is not None and not (order > 0.0 and (2.0 * order).is_integer()):
        raise InputError(f"{at}: order {order:g} is not 0.5, 1, 1.5, …")
    begin, end = times.span(table, at)
    if cycles is not None:
        if begin > 0.0 or end < float("inf"):
            raise InputError(f"{at}: over_cycles and a time from or to exclude each other; leave one out")
        if times.speed is None:
            raise InputError(f"{at}: over_cycles needs speed_rpm; give it, or from_s and to_s")
        times.of(At(at_cycles=cycles), "at", f"{at}: over_cycles")
        if not cycles > 0:
            raise InputError(f"{at}: over_cycles {cycles:g} must be above zero")
    if measure == ORDER and (begin > 0.0 or end < float("inf") or cycles not in (None, 1)):
        raise InputError(f"{at}: an order is always taken over the last cycle; leave the window out")
    if other and (other == scenario or other not in names):
        others = [one for one in names if one != scenario]
        near = nearest(other, others) if others else "add one to compare with, or leave ratio_to out"
        raise InputError(f"{at}: ratio_to: '{other}' is no other scenario; {near}")
    output = None if table.output is None else variable(table.output, f"{at}: output", units)
    unit, bounds = named(table.unit, at), _bounds(at, table)
    if measure in (RMS, SWING):
        refuse_below_zero(measure, bounds, at)
    return Assertion(table.name, output, table.residual, measure, order or 0.0, cycles, begin, end, bounds, unit, other)


def check_ratios(scenarios: Sequence[Scenario], cycle: float | None) -> None:
    """Raise ``InputError`` for a ratio to a scenario that ends before the asserted window; ``cycle`` in s or None."""
    stops = {one.name: one.way.stop for one in scenarios}
    for scenario in scenarios:
        for k, one in enumerate(scenario.assertions, 1):
            needed = one.begin if one.cycles is None else one.cycles * (cycle or 0.0)
            if one.measure == ORDER:
                needed = cycle or 0.0
            if one.ratio_to and needed > stops[one.ratio_to] * (1.0 + 1e-9):
                raise InputError(
                    f"scenario '{scenario.name}': assert {k}: ratio_to: '{one.ratio_to}' takes "
                    f"{stops[one.ratio_to]:.6g} s, the window needs {needed:.6g} s; let it take longer"
                )


def refuse_below_zero(measure: str, bounds: Bounds, at: str) -> None:
    """Raise ``InputError`` if the bounds require a negative value of a measure that is never negative."""
    if bounds.largest < 0.0:
        raise InputError(
            f"{at}: {measure} is never below zero, so that none is at most {bounds.largest:g}; correct the bound"
        )


def refuse_unresolved(order: float, points: float) -> None:
    """Raise ``InputError`` for an order of which an oscillation has fewer than two points; ``points`` per cycle."""
    if 4.0 * order > points * (1.0 + 1e-6):
        raise InputError(
            f"order {order:g} needs a communication point every {180.0 / order:.4g} deg or less; "
            f"they are {720.0 / points:.4g} deg apart"
        )


def _bounds(at: str, table: AssertTable) -> Bounds:
    found = Bounds(table.expected, table.tolerance, table.absolute, table.least, table.most)
    if found.expected is None:
        if found.least is None and found.most is None:
            raise InputError(f"{at}: no expected value; give expected and tolerance, or least and most")
        if found.relative is not None or found.absolute is not None:
            raise InputError(f"{at}: a tolerance goes with expected; give it, or leave the tolerance out")
        if found.least is not None and found.most is not None and found.least > found.most:
            raise InputError(f"{at}: least {found.least:g} is above most {found.most:g}")
        return found
    if found.least is not None or found.most is not None:
        raise InputError(f"{at}: expected and least or most exclude each other; leave one out")
    if (found.relative is None) == (found.absolute is None):
        raise InputError(f"{at}: give tolerance, a fraction of the expected value, or absolute, in its unit")
    if min(value for value in (found.relative, found.absolute) if value is not None) < 0.0:
        raise InputError(f"{at}: a tolerance must not be below zero")
    if found.relative is not None and not found.expected:
        raise InputError(f"{at}: expected is 0, of which every fraction is 0; give absolute, in its unit")
    if found.relative is not None and found.relative >= 1.0:
        raise InputError(
            f"{at}: tolerance {found.relative:g} is {100.0 * found.relative:g} % of the expected value, which zero "
            "meets too; give a fraction below 1, 0.05 for 5 %, or least and most"
        )
    return found


def ending(
    given: Sequence[tuple[str, EndsTable]], units: Mapping[str, Any], times: Times, step: float, where: str
) -> Ending:
    """Return the required end of a scenario, by default a complete run; ``step`` (s) is the tolerance of a time."""
    if not given:
        return Ending()
    if len(given) > 1:
        raise InputError(f"{where}: {len(given)} entries of [[scenario.ends]]; give one, because a run ends once")
    at, table = given[0]
    timed = table.at_s is not None or table.at_cycles is not None
    if table.how != BY_FAILURE and (timed or table.of or table.says is not None or table.within_s is not None):
        raise InputError(f"{at}: of, says and a time go with how = '{BY_FAILURE}'; leave them out")
    if table.of and table.of not in units:
        raise InputError(f"{at}: there is no unit '{table.of}'; {nearest(table.of, units)}")
    tolerance = 1.001 * step if table.within_s is None else table.within_s
    return Ending(table.how, table.of, times.of(table, "at", at) if timed else None, tolerance, table.says or "")
