"""Evaluation of assertions on a run: values found, and whether they meet the requirement."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.results.orders.harmonics import CYCLE, last_cycle, order_spectrum
from cranktrain_lab.coupling.run import Coupled
from cranktrain_lab.coupling.unit import Port
from cranktrain_lab.harness.assertion_entries import refuse_unresolved
from cranktrain_lab.harness.entries import (
    BY_FAILURE,
    FINAL,
    LARGEST,
    LEAST,
    MEAN,
    ORDER,
    RMS,
    SWING,
    TO_THE_END,
    Assertion,
    Bounds,
    Ending,
    Harness,
)
from cranktrain_lab.harness.measures import MEASURED, of_unit

WORDS = {
    FINAL: "final value", MEAN: "mean", LEAST: "minimum", LARGEST: "maximum", SWING: "peak to peak", RMS: "RMS",
}  # fmt: skip


class Outcome(NamedTuple):
    """Result of an assertion.

    Attributes
    ----------
    name, quantity : name of the assertion, and measured quantity in words
    expected : requirement in words
    found : number or text that was found, or None
    unit : unit of measurement of the number
    passed : True if the value meets the requirement
    remark : reason if there is no number
    bounds : requirement as numbers
    """

    name: str
    quantity: str
    expected: str
    found: float | str | None
    unit: str
    passed: bool
    remark: str = ""
    bounds: Bounds | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the outcome as a dictionary for JSON."""
        numbers = {} if self.bounds is None else {k: v for k, v in vars(self.bounds).items() if v is not None}
        expected: Any = numbers or self.expected
        return {
            "name": self.name, "quantity": self.quantity, "expected": expected, "found": self.found,
            "unit": self.unit, "passed": self.passed, **({"remark": self.remark} if self.remark else {}),
        }  # fmt: skip


class Ran(NamedTuple):
    """Run of a scenario, reason of an early end (else empty), wall time (s), and whether it was interrupted.

    ``besides``: True if it ended for lack of disk space or memory, which is not a failure of a unit.
    """

    found: Coupled | None
    ended: str
    seconds: float
    interrupted: bool = False
    besides: bool = False


def judge(
    assertion: Assertion, runs: Mapping[str, Ran], scenario: str, harness: Harness, ports: Mapping[str, Port]
) -> Outcome:
    """Evaluate an assertion of a scenario on its run; ``ports`` describe all outputs by name ``unit.variable``."""
    quantity, unit = _quantity(assertion, ports)
    remark, found = "", None
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # overflow of a value is reported below
            found = _measured(assertion, runs[scenario], harness, ports)
            if assertion.ratio_to:
                found = _ratio(found, assertion, runs[assertion.ratio_to], harness, ports)
    except InputError as error:
        found, remark = None, str(error)
    if found is not None and not math.isfinite(found):
        found, remark = None, "is not a number, or too large for one"
    if assertion.ratio_to:
        quantity, unit = f"{quantity}, over that of '{assertion.ratio_to}'", ""
    passed = found is not None and _within(found, assertion.bounds)
    expected = _expected(assertion.bounds, unit)
    return Outcome(assertion.name or quantity, quantity, expected, found, unit, passed, remark, assertion.bounds)


def _ratio(
    found: float, assertion: Assertion, other: Ran, harness: Harness, ports: Mapping[str, Port]
) -> float:  # fmt: skip
    """Return the ratio of a number to another scenario's number; raises ``InputError`` if the other has none."""
    name = assertion.ratio_to
    ending = next(one.ending for one in harness.scenarios if one.name == name)
    if not judge_ending(ending, other).passed:
        raise InputError(f"scenario '{name}' did not end as it was to, so nothing is compared with it")
    try:
        reference = _measured(assertion, other, harness, ports)
    except InputError as error:
        raise InputError(f"scenario '{name}': {error}") from None
    if reference == 0.0:
        raise InputError(f"is zero in scenario '{name}'")
    return found / reference


def judge_ending(ending: Ending, ran: Ran) -> Outcome:
    """Compare the end of a run with the required end."""
    found = ran.ended or TO_THE_END
    if ending.how != BY_FAILURE:
        return Outcome("end", "end of the run", TO_THE_END, found, "", not ran.ended)
    time = float(ran.found.times[-1]) if ran.found is not None else 0.0
    parts = ["a failure" + (f" of {ending.unit}" if ending.unit else "")]
    parts += [f"at {ending.at:.6g} s ± {ending.tolerance:.3g} s"] if ending.at is not None else []
    parts += [f"that says '{ending.says}'"] if ending.says else []
    named = not ending.unit or ran.ended.startswith((f"{ending.unit},", f"{ending.unit}:", f"{ending.unit} "))
    timely = ending.at is None or abs(time - ending.at) <= ending.tolerance
    passed = bool(ran.ended) and not ran.besides and named and timely and ending.says.lower() in ran.ended.lower()
    remark = "" if passed or not ran.ended else f"the last communication point is {time:.6g} s"
    return Outcome("end", "end of the run", " ".join(parts), found, "", passed, remark)


def _quantity(assertion: Assertion, ports: Mapping[str, Port]) -> tuple[str, str]:
    """Return the quantity that an assertion tests, in words, and its unit of measurement."""
    if assertion.output is None:
        name, unit = f"residual of {assertion.residual}", "W"
    else:
        name = ".".join(assertion.output)
        unit = ports[name].unit
    measure = f"order {assertion.order:g}" if assertion.measure == ORDER else WORDS[assertion.measure]
    window = ""
    if assertion.cycles is not None:
        window = ", last cycle" if assertion.cycles == 1.0 else f", last {assertion.cycles:g} cycles"
    elif assertion.begin > 0.0 or assertion.end < math.inf:
        window = f", {assertion.begin:.6g} s to {'the end' if math.isinf(assertion.end) else f'{assertion.end:.6g} s'}"
    return f"{name}, {measure}{window}", assertion.unit or unit


def _measured(assertion: Assertion, ran: Ran, harness: Harness, ports: Mapping[str, Port]) -> float:
    """Return the number that an assertion tests; raises ``InputError`` with the reason if there is none."""
    run = ran.found
    if run is None:
        raise InputError("the run did not start")
    times = run.times
    if assertion.output is None:
        values, port = run.residuals[assertion.residual], MEASURED["W"]
        times = times[1:]
    else:
        name = ".".join(assertion.output)
        if name not in run.names:
            raise InputError("was not recorded")
        values, port = run.of(name), ports[name]
    if assertion.unit:
        factor, shift = of_unit(port, assertion.unit)
        values = factor * values + shift
    if assertion.measure == ORDER:
        return float(order_amplitudes(harness, run, values, assertion.order)[-1])
    begin, end = assertion.begin, assertion.end
    if assertion.cycles is not None:
        assert harness.speed is not None
        begin, end = times[-1] - assertion.cycles * 4.0 * math.pi / harness.speed, math.inf
    room = 1e-9 * float(times[-1])
    chosen = (times >= begin - room) & (times <= end + room)
    if not chosen.any():
        end = float(times[-1]) if len(times) else 0.0
        if end < assertion.begin:
            raise InputError(f"the run ended at {end:.6g} s, before the window")
        raise InputError("no communication point lies in the window; take a longer one, or shorter steps")
    return _of_window(assertion.measure, times[chosen], values[chosen])


def _of_window(measure: str, times: Array, values: Array) -> float:
    """Return a measure of a time series; means are time averages."""
    if measure == FINAL:
        return float(values[-1])
    if measure in (LEAST, LARGEST, SWING):
        least, largest = float(values.min()), float(values.max())
        return {LEAST: least, LARGEST: largest, SWING: largest - least}[measure]
    weighed = values if measure == MEAN else values**2
    span = times[-1] - times[0]
    mean = float(np.trapezoid(weighed, times) / span) if span > 0.0 else float(weighed[-1])
    return mean if measure == MEAN else math.sqrt(mean)


def order_amplitudes(harness: Harness, run: Coupled, values: Array, highest: float) -> Array:
    """Return zero-to-peak amplitudes (k,) of the orders 0.5, 1, …, ``highest`` of the last cycle.

    ``InputError`` if there is no whole cycle, or if communication points are too far apart for the highest order.
    """
    if harness.angle is not None:
        angle = run.of(".".join(harness.angle))
    else:
        assert harness.speed is not None
        angle = harness.speed * run.times
    angle = angle[-len(values) :]
    points = int(np.count_nonzero(angle > angle[-1] - (1.0 - 1e-9) * CYCLE))
    refuse_unresolved(highest, points)
    return order_spectrum(last_cycle(angle, values, max(1440, 4 * math.ceil(highest))), highest)[1]


def _within(found: float, bounds: Bounds) -> bool:
    if bounds.expected is None:
        above = bounds.least is None or found >= bounds.least
        return above and (bounds.most is None or found <= bounds.most)
    return abs(found - bounds.expected) <= bounds.room


def _expected(bounds: Bounds, unit: str) -> str:
    """Return a requirement in words."""
    end = f" {unit}" if unit else ""
    if bounds.expected is not None:
        share = f"{100.0 * (bounds.relative or 0.0):g} %"
        return f"{bounds.expected:.6g}{end} ± {share if bounds.absolute is None else f'{bounds.absolute:.4g}{end}'}"
    if bounds.least is None:
        return f"at most {bounds.most:.6g}{end}"
    if bounds.most is None:
        return f"at least {bounds.least:.6g}{end}"
    return f"{bounds.least:.6g} to {bounds.most:.6g}{end}"
