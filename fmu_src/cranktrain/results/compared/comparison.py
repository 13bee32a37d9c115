"""Comparison of two results, or of a result and measured orders, with a verdict within tolerances."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.dynamics.outputs.register import nearest_output
from cranktrain.results.columns import NOTHING, cell
from cranktrain.results.compared import rows
from cranktrain.results.figures import save_figure
from cranktrain.results.orders.deviations import check_speeds_measured, deviations
from cranktrain.results.orders.measured import MeasuredOrders
from cranktrain.results.overlays import check_overlaid, cycle_overlay, order_overlay
from cranktrain.results.run_up.common_speeds import at_speeds, on_common_speeds
from cranktrain.results.run_up.figures import order_figure
from cranktrain.results.run_up.peak_figures import harmonic_figure
from cranktrain.results.run_up.plot_data import Beside, quantity_of
from cranktrain.results.run_up.run_up import TORSION, RunUp, with_twist
from cranktrain.results.tables import Table
from cranktrain.results.views.found import VerbResult
from cranktrain.results.views.loaded import LoadedRun
from cranktrain.results.views.time_series import TimeSeries

Compared = TimeSeries | RunUp | MeasuredOrders
SHOWN = 4
"""Number of rows of each quantity in the table, those with the largest differences."""
NEAR = 1.01
"""Largest ratio between the speed of a run and the nearest measured speed."""
OWN_UNIT = "cranktrain/"
"""Beginning of the names of a coupled run's outputs that an uncoupled run has too."""
OUTCOMES = frozenset(
    {"ended", "cycles", "repeats_every_cycles", "settling_left", "settling_left_by_family", "cycles_part_by"}
)
"""Attributes of a result that are no settings."""


class Comparison(VerbResult):
    """Differences of a result B from A; ``ct.compare`` returns it.

    Its keys are ``passed``, ``a`` and ``b`` (names), ``settings`` that differ, ``tolerances``, ``differences`` (a row
    for each compared number, see :mod:`cranktrain.results.compared.rows`) and ``left_out`` (outputs that grow).
    """

    @property
    def within(self) -> bool:
        """True if all differences are within their tolerances."""
        return bool(self["passed"])

    @property
    def worst(self) -> dict[str, Any] | None:
        """Row whose difference is the largest in tolerances; None without rows."""
        return max(self["differences"], key=_excess, default=None)

    def plot(self, path: str | Path | None = None, output: str = "") -> Any:
        """Figure of both results laid over each other and their difference, of an output or of the worst one."""
        sides = dict(self.beside["sides"])
        (_, a), (name, b) = sides.items()
        drawn = "output" if isinstance(a, TimeSeries) else "order"
        own = (one for one in self["differences"] if one["quantity"] == drawn)
        output = output or str(max(own, key=_excess, default={"output": TORSION})["output"])
        if isinstance(a, MeasuredOrders):
            quantity, beside = (
                quantity_of(output),
                Beside(measured=a, orders=tuple(a[output])),
            )
            figure = (order_figure if b.speeds.size > 1 else harmonic_figure)(b, quantity, beside, name)
        elif isinstance(a, RunUp):
            figure = order_overlay(sides, output)
        else:
            figure = cycle_overlay(sides, output)
        if path is not None:
            save_figure(figure, path)
        return figure

    def table(self) -> Table:
        """Table of the largest differences of each quantity, in tolerances."""
        texts = []
        for quantity in self["tolerances"]:
            own = sorted((one for one in self["differences"] if one["quantity"] == quantity), key=_excess, reverse=True)
            texts += [_texts(one) for one in own[:SHOWN]]
        header = ("verdict", "quantity", "output", "order", "rev/min", "A", "B", "unit", "difference / %")
        return Table(f"{self['b']} against {self['a']}, largest differences", header, tuple(texts))


def compared(sides: Mapping[str, Compared], outputs: Sequence[str], tolerances: Mapping[str, float]) -> Comparison:
    """Comparison of two results or of a result and a measurement, which is always A; ``InputError``.

    ``outputs`` are the compared outputs, all if empty; ``tolerances`` are those of each quantity.
    """
    ordered = dict(sorted(sides.items(), key=lambda one: not isinstance(one[1], MeasuredOrders)))
    (first, a), (second, b) = ordered.items()
    left_out: list[str] = []
    if isinstance(b, MeasuredOrders):
        raise InputError(
            f"{first} and {second} are both measured orders; name a result of simulate or runup as one of them"
        )
    if isinstance(a, MeasuredOrders):
        a, b, known = _beside_measured(a, b, second)
        differences = list(rows.measured_rows(deviations(b, a)))
    else:
        check_overlaid({first: a, second: b}, ())
        if isinstance(a, RunUp) and isinstance(b, RunUp):
            a, b = with_twist(a), with_twist(b)
            differences = _of_run_ups({first: a, second: b}, outputs)
            known = [{*one.amplitudes, *one.extremes} for one in (a, b)]
        else:
            a, b = _uncoupled(a), _uncoupled(b)
            differences, left_out, known = _of_runs({first: a, second: b}, outputs)
    for name in outputs:
        for path, own in zip(ordered, known, strict=True):
            if name not in own:
                raise InputError(f"{path}: output '{name}' is not compared; {nearest_output(name, own)}")
    differences = [one for one in differences if not outputs or one["output"] in outputs or not one["output"]]
    if not any(one["output"] for one in differences):
        raise InputError(
            f"{first} and {second} have no output in common that can be compared; name results with equal outputs"
        )
    for one in differences:
        one["tolerance"] = tolerances[one["quantity"]]
        one["passed"] = bool(abs(one["difference"]) <= one["tolerance"]) or one["tolerance"] == math.inf
    found = {
        "passed": all(one["passed"] for one in differences), "a": first, "b": second, "tolerances": dict(tolerances),
        "differences": differences, "settings": _settings(a, b), "left_out": left_out,
    }  # fmt: skip
    return Comparison.of(found, "compare", sides={first: a, second: b})


def _uncoupled(run: Any) -> TimeSeries:
    """Run whose outputs have the names of an uncoupled run, if they are those of a coupled run's cranktrain."""
    outputs = {name.removeprefix(OWN_UNIT): values for name, values in run.outputs.items()}
    return run if outputs.keys() == run.outputs.keys() else LoadedRun(run.time, run.angle, outputs, run.attributes)


def _cycles(path: str, run: Any, outputs: Sequence[str]) -> tuple[dict[str, Array], list[str]]:
    """Last cycles of a run, and outputs that grow; ``InputError`` with the run's name if it has no whole cycle."""
    try:
        return rows.cycles(run, outputs)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _of_runs(
    runs: Mapping[str, TimeSeries], outputs: Sequence[str]
) -> tuple[list[rows.Row], list[str], list[set[str]]]:  # fmt: skip
    """Differences of two runs, outputs that are left out because they grow, and the outputs of each run."""
    (own, grow), (others, grow_too) = (_cycles(path, run, outputs) for path, run in runs.items())
    noise = rows.noise_of(own, others)
    speed = rows.mean_speed(next(iter(runs.values())))
    differences = [
        *rows.output_rows(own, others, noise),
        *rows.order_rows(rows.at_one_speed(speed, own), rows.at_one_speed(speed, others), noise),
    ]
    return differences, sorted({*grow, *grow_too}), [set(own), set(others)]


def _of_run_ups(run_ups: Mapping[str, RunUp], outputs: Sequence[str]) -> list[rows.Row]:
    """Differences of two run-ups in the range of speeds that they share."""
    a, b = run_ups.values()
    x, y = on_common_speeds(a, b)
    if not x.speeds.size:
        ends = (f"{path} is from {one.speeds_rpm[0]:.6g} to {one.speeds_rpm[-1]:.6g}" for path, one in run_ups.items())
        raise InputError(f"{', '.join(ends)} rev/min, without a speed in common; name run-ups whose speeds overlap")
    noise = rows.noise_of(a.amplitudes, b.amplitudes, a.extremes, b.extremes)
    low, high = float(x.speeds[0]), float(x.speeds[-1])
    a, b = (at_speeds(one, one.speeds[(one.speeds >= low) & (one.speeds <= high)]) for one in (a, b))
    extremes = {name: values for name, values in x.extremes.items() if rows.is_compared(name, outputs)}
    missing = np.flatnonzero(x.with_result != y.with_result)
    counts = int(x.with_result.sum()), int(y.with_result.sum())
    more = {"speed_rpm": float(x.speeds_rpm[missing[0]])} if missing.size else {}
    lost = rows.row("speeds", "", counts, missing.size / x.speeds.size, **more)
    return [
        lost, *rows.output_rows(extremes, y.extremes, noise), *rows.order_rows(x, y, noise),
        *rows.peak_rows(a, b, noise),
    ]  # fmt: skip


def _beside_measured(
    measured: MeasuredOrders, result: TimeSeries | RunUp, name: str
) -> tuple[MeasuredOrders, RunUp, list[set[str]]]:
    """Measured orders, a result as a run-up, and the outputs of both; ``InputError`` if they share no speed."""
    if isinstance(result, TimeSeries):
        cycles, _ = _cycles(name, _uncoupled(result), ())
        speed = rows.mean_speed(result)
        result = rows.at_one_speed(speed, cycles)
        check_speeds_measured(measured, speed / NEAR, speed * NEAR, name)
        measured = _at_speed(measured, speed)
    else:
        check_speeds_measured(measured, float(result.speeds[0]), float(result.speeds[-1]), name)
    result = with_twist(result)
    return measured, result, [set(measured), set(result.amplitudes)]


def _at_speed(measured: MeasuredOrders, speed: float) -> MeasuredOrders:
    """Measured orders at one speed, rad/s, interpolated; those that were not measured near it are left out."""
    found = MeasuredOrders()
    for output, by_order in measured.items():
        for order, (speeds, sizes) in by_order.items():
            if speeds[0] <= speed * NEAR and speeds[-1] >= speed / NEAR:
                turning = np.interp(speed, speeds, sizes * np.exp(1j * measured.phases[output][order]))
                found.put(
                    output, order, [(speed, float(np.interp(speed, speeds, sizes)), float(np.angle(turning)), math.nan)]
                )
    return found


def _settings(a: Compared, b: Compared) -> list[dict[str, Any]]:
    """Settings that differ between two results, with both values; None where a result has no such setting."""
    if isinstance(a, MeasuredOrders) or isinstance(b, MeasuredOrders):
        return []
    names = sorted({*a.attributes, *b.attributes} - OUTCOMES)
    pairs = ((name, a.attributes.get(name), b.attributes.get(name)) for name in names)
    return [{"name": name, "a": own, "b": other} for name, own, other in pairs if own != other]


def _excess(one: Mapping[str, Any]) -> tuple[float, float]:
    """Difference of a row in tolerances, then itself; infinite for one that is not a number."""
    size, tolerance = abs(one["difference"]), one["tolerance"]
    if math.isnan(size):
        return math.inf, math.inf
    return (math.inf if size > 0.0 and tolerance == 0.0 else size / (tolerance or 1.0)), size


def _texts(one: Mapping[str, Any]) -> tuple[str, ...]:
    """Texts of a row of the table."""
    order = NOTHING if one["order"] is None else f"{one['order']:g}"
    apart = f"{cell(100.0 * one['difference'], '+.3g')} of {100.0 * one['tolerance']:.3g}"
    return (
        "passed" if one["passed"] else "FAILED", one["quantity"], one["output"] or NOTHING, order,
        cell(one["speed_rpm"], ".0f"), cell(one["a"], ".4g"), cell(one["b"], ".4g"), one["unit"] or NOTHING, apart,
    )  # fmt: skip
