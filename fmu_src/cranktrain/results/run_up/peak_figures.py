"""Figures of a run-up at its highest peaks: motion over a cycle, and its orders."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from cranktrain.results.orders.measured_points import motion_of
from cranktrain.results.run_up import plots
from cranktrain.results.run_up.plot_data import PARTS, Beside, Quantity, figure_of, unsteady, worthy
from cranktrain.results.run_up.run_up import AXIAL, RunUp

SPEEDS_SHOWN = 6
HISTORY = 1440
"""Number of points at which a motion is drawn over a cycle."""


def history_figure(run_up: RunUp, quantity: Quantity, title: str, beside: Beside | None = None) -> Any:
    """Figure of the motion over a cycle at the speeds of the largest peaks, as sum of the orders without mean.

    Measured orders with phases in ``beside`` are drawn as a measured motion with its band.
    """
    places = peak_speeds(run_up, quantity)
    figure, axes = _grid(len(places))
    angle = np.arange(HISTORY + 1, dtype=np.float64) * (4.0 * math.pi / HISTORY)
    turn = np.exp(1j * np.outer(run_up.orders, angle))
    for ax, (at, order) in zip(axes, places, strict=True):
        motion = quantity.scale * (run_up.amplitudes[quantity.output][at] @ turn).real
        own = None if beside is None else motion_of(beside.points_at(quantity, run_up, at), angle)
        measured = None if own is None else (quantity.scale * own[0], quantity.scale * own[1])
        plots.plot_history(ax, np.degrees(angle), motion, quantity.unit, _at(run_up, at, order), measured)
        if measured is not None:
            ax.legend(frameon=False, fontsize=8)
    _share_scale(axes)
    _under(figure, axes, "crank angle / deg")
    name = quantity.name.partition(",")[0]
    figure.suptitle(f"History of the {name} at its peaks, without the mean: {title}", fontsize=12, parse_math=False)
    return figure


def harmonic_figure(run_up: RunUp, quantity: Quantity, beside: Beside, title: str) -> Any:
    """Figure of orders at the speeds of the largest peaks; axial motion is divided into its parts if known."""
    places = peak_speeds(run_up, quantity)
    figure, axes = _grid(len(places))
    keep = run_up.orders <= 12.0
    orders = run_up.orders[keep]
    parts = {name: output for name, output in PARTS.items() if output in run_up.amplitudes}
    for ax, (at, order) in zip(axes, places, strict=True):
        bars = {"pulley": quantity.scale * np.abs(run_up.amplitudes[quantity.output][at, keep])}
        if quantity.output == AXIAL:
            bars |= {name: quantity.scale * np.abs(run_up.amplitudes[out][at, keep]) for name, out in parts.items()}
        measured, band = np.full((2, orders.size), math.nan)
        for point in beside.points_at(quantity, run_up, at):
            measured[orders == point.order] = quantity.scale * point.amplitude
            band[orders == point.order] = quantity.scale * point.band
        if np.isfinite(measured).any():
            bars["measured"] = measured
        plots.plot_harmonics(ax, orders, bars, quantity.unit, _at(run_up, at, order), band)
    _share_scale(axes)
    named = {container.get_label(): container for ax in axes for container in ax.containers}
    if len(named) > 1:
        axes[0].legend(list(named.values()), list(named), frameon=False, fontsize=8)
    _under(figure, axes, "order / oscillations per revolution")
    figure.suptitle(f"Orders of the {quantity.name}, at its peaks: {title}", fontsize=12, parse_math=False)
    return figure


def peak_speeds(run_up: RunUp, quantity: Quantity) -> list[tuple[int, float]]:
    """Speed index and order of the largest peaks, sorted by speed. Without peaks return the largest amplitude's."""
    found: dict[int, float] = {}
    for peak in worthy(run_up, quantity, run_up.orders.tolist(), Beside()):
        at = int(np.argmin(np.abs(run_up.speeds - peak.speed)))
        if all(abs(run_up.speeds[other] / run_up.speeds[at] - 1.0) > 0.02 for other in found):
            found[at] = peak.order
        if len(found) == SPEEDS_SHOWN:
            break
    if not found:
        sizes = np.nan_to_num(np.abs(run_up.amplitudes[quantity.output]))
        place = np.unravel_index(sizes.argmax(), sizes.shape)
        found[int(place[0])] = float(run_up.orders[place[1]])
    return sorted(found.items())


def _at(run_up: RunUp, at: int, order: float) -> str:
    mean = ", mean cycle" if unsteady(run_up)[at] else ""
    return f"{run_up.speeds_rpm[at]:.0f} rev/min, peak of order {order:g}{mean}"


def _grid(count: int) -> tuple[Any, list[Any]]:
    """Figure with a number of axes, two per row."""
    rows = math.ceil(count / 2)
    figure = figure_of(11.5, 1.0 + 2.5 * rows)
    axes = figure.subplots(rows, min(count, 2), squeeze=False).ravel().tolist()
    for ax in axes[count:]:
        ax.set_axis_off()
    return figure, axes[:count]


def _share_scale(axes: Sequence[Any]) -> None:
    """Set the same vertical scale for all axes."""
    low, high = (pick(ax.get_ylim()[k] for ax in axes) for k, pick in ((0, min), (1, max)))
    for ax in axes:
        ax.set_ylim(low, high)


def _under(figure: Any, axes: Sequence[Any], text: str) -> None:
    """Label the horizontal axis of the lowest axes in each column."""
    for ax in axes[-2:]:
        ax.set_xlabel(text)
