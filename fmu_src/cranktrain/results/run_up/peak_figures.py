"""Pictures of a run-up at its highest peaks: motion over a cycle, and its orders."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.results.run_up import plots
from cranktrain.results.run_up.run_up import AXIAL, RunUp
from cranktrain.results.run_up.shown import PARTS, Beside, Quantity, figure_of, unsteady, worthy

SPEEDS_SHOWN = 6
HISTORY = 1440
"""Points of a cycle."""


def history_figure(run_up: RunUp, quantity: Quantity, title: str) -> Any:
    """Motion over a cycle at the speeds of the largest peaks, of the orders that the run-up holds; without the mean."""
    places = peak_speeds(run_up, quantity)
    figure, axes = _grid(len(places))
    angle = np.arange(HISTORY + 1) * (4.0 * math.pi / HISTORY)
    turn = np.exp(1j * np.outer(run_up.orders, angle))
    for ax, (at, order) in zip(axes, places, strict=True):
        motion = quantity.scale * (run_up.amplitudes[quantity.output][at] @ turn).real
        plots.plot_history(ax, np.degrees(angle), motion, quantity.unit, _at(run_up, at, order))
    _share_scale(axes)
    _under(figure, axes, "crank angle / deg")
    name = quantity.name.partition(",")[0]
    figure.suptitle(f"History of the {name} at its peaks, without the mean: {title}", fontsize=12, parse_math=False)
    return figure


def harmonic_figure(run_up: RunUp, quantity: Quantity, beside: Beside, title: str) -> Any:
    """Orders at the speeds of the largest peaks; of axial motion in its parts, where the run-up has them."""
    places = peak_speeds(run_up, quantity)
    figure, axes = _grid(len(places))
    keep = run_up.orders <= 12.0
    orders = run_up.orders[keep]
    parts = {name: output for name, output in PARTS.items() if output in run_up.amplitudes}
    for ax, (at, order) in zip(axes, places, strict=True):
        bars = {"pulley": quantity.scale * np.abs(run_up.amplitudes[quantity.output][at, keep])}
        if quantity.output == AXIAL:
            bars |= {name: quantity.scale * np.abs(run_up.amplitudes[out][at, keep]) for name, out in parts.items()}
        if (measured := _measured_at(beside, quantity, run_up, at, orders)) is not None:
            bars["measured"] = measured
        plots.plot_harmonics(ax, orders, bars, quantity.unit, _at(run_up, at, order))
    _share_scale(axes)
    named = {container.get_label(): container for ax in axes for container in ax.containers}
    if len(named) > 1:
        axes[0].legend(list(named.values()), list(named), frameon=False, fontsize=8)
    _under(figure, axes, "order / oscillations per revolution")
    figure.suptitle(f"Orders of the {quantity.name}, at its peaks: {title}", fontsize=12, parse_math=False)
    return figure


def peak_speeds(run_up: RunUp, quantity: Quantity) -> list[tuple[int, float]]:
    """Index of the speed and order of the largest peaks, by speed, no two at one; the largest motion where none is."""
    found: dict[int, float] = {}
    for peak in worthy(run_up, quantity, run_up.orders.tolist(), Beside()):
        at = int(np.argmin(np.abs(run_up.speeds - peak.speed)))
        if all(abs(run_up.speeds[other] / run_up.speeds[at] - 1.0) > 0.02 for other in found):
            found[at] = peak.order
        if len(found) == SPEEDS_SHOWN:
            break
    if not found:
        sizes = np.abs(run_up.amplitudes[quantity.output])
        place = np.unravel_index(sizes.argmax(), sizes.shape)
        found[int(place[0])] = float(run_up.orders[place[1]])
    return sorted(found.items())


def _measured_at(beside: Beside, quantity: Quantity, run_up: RunUp, at: int, orders: Array) -> Array | None:
    """Measured amplitudes (k,) of orders at a speed, not a number where none was measured within half a step.

    Of a speed that was measured several times it is the mean.
    """
    speeds = run_up.speeds_rpm
    reach = 0.5 * float(np.diff(speeds).mean()) + 1e-6 if speeds.size > 1 else 1.0
    found = np.full(orders.size, math.nan)
    for k, order in enumerate(orders.tolist()):
        measured = beside.measured_of(quantity, order)
        if measured is not None:
            nearest = measured[0][np.argmin(np.abs(measured[0] - speeds[at]))]
            if abs(nearest - speeds[at]) <= reach:
                found[k] = measured[1][measured[0] == nearest].mean()
    return found if np.any(np.isfinite(found)) else None


def _at(run_up: RunUp, at: int, order: float) -> str:
    mean = ", mean cycle" if unsteady(run_up)[at] else ""
    return f"{run_up.speeds_rpm[at]:.0f} rev/min, peak of order {order:g}{mean}"


def _grid(count: int) -> tuple[Any, list[Any]]:
    """Figure with so many axes, two a row."""
    rows = math.ceil(count / 2)
    figure = figure_of(11.5, 1.0 + 2.5 * rows)
    axes = figure.subplots(rows, min(count, 2), squeeze=False).ravel().tolist()
    for ax in axes[count:]:
        ax.set_axis_off()
    return figure, axes[:count]


def _share_scale(axes: Sequence[Any]) -> None:
    """One scale for all axes."""
    low, high = (pick(ax.get_ylim()[k] for ax in axes) for k, pick in ((0, min), (1, max)))
    for ax in axes:
        ax.set_ylim(low, high)


def _under(figure: Any, axes: Sequence[Any], text: str) -> None:
    """Name the horizontal axis below the last of each column."""
    for ax in axes[-2:]:
        ax.set_xlabel(text)
