"""Whole pictures of a run-up: orders over speed, waterfall, Campbell diagram, histories and harmonics at its peaks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.engine.model import Engine
from cranktrain.results import run_up_plots as plots
from cranktrain.results.figures import save_figure
from cranktrain.results.measured_orders import Measured
from cranktrain.results.modes_over_speed import ModesOverSpeed
from cranktrain.results.resonances import Peak, peaks
from cranktrain.results.run_up import AXIAL, TORSION, RunUp

RPM = 30.0 / math.pi
COLOURED, LABELLED, SPEEDS_SHOWN = 8, 8, 6
"""Orders with a colour of their own besides the published ones, peaks with a name, speeds with their own picture."""
WORTH = 0.05
"""Share of the largest amplitude from which a peak has a name, or one of a published order does anyway."""
NEAR = 0.08
"""Share of a mode's frequency within which a peak is called its own."""
HISTORY = 1440
"""Points of a cycle in a picture."""
PARTS = {"crank": "axial.crank", "bearing": "axial.bearing", "engine": "axial.engine"}


class Quantity(NamedTuple):
    """Output with its name and unit in pictures, that unit's size, and the kind of the modes that it shows."""

    output: str
    name: str
    unit: str
    scale: float
    kind: str


TORSIONAL = Quantity(TORSION, "torsion of the pulley, zero to peak", "deg", 180.0 / math.pi, "torsional")
ALONG = Quantity(AXIAL, "axial motion of the pulley, zero to peak", "µm", 1e6, "axial")


class Beside(NamedTuple):
    """What a run-up's pictures show besides: its engine's published speeds, modes over speed, measured orders."""

    engine: Engine | None = None
    modes: ModesOverSpeed | None = None
    measured: Measured | None = None

    def published(self, quantity: Quantity) -> dict[float, float]:
        """Published critical speeds, rev/min, by order; they are of the first torsional mode."""
        if self.engine is None or quantity.kind != "torsional":
            return {}
        p = self.engine.published
        return {order: speed * RPM for order, speed in zip(p.critical_orders, p.critical_speeds, strict=True)}

    def measured_of(self, quantity: Quantity, order: float) -> tuple[Array, Array] | None:
        """Measured speeds (k,) rev/min and amplitudes (k,) of an order, in the picture's unit."""
        found = (self.measured or {}).get(quantity.output, {}).get(order)
        return None if found is None else (found[0] * RPM, found[1] * quantity.scale)


def file_names() -> list[str]:
    """Names of all pictures that there may be."""
    motions = [f"{name}_{kind}.png" for name in ("torsion", "axial") for kind in ("orders", "histories", "harmonics")]
    return [*motions, "waterfall.png", "campbell.png", "damper.png"]


def save_run_up_pictures(
    folder: Path, run_up: RunUp, beside: Beside, title: str, damped: RunUp | None = None
) -> list[Path]:
    """Write all pictures that a run-up has data for into ``folder``; returns their paths.

    ``damped`` is a run-up of the same engine with its damper, drawn below that without.
    """
    figures: dict[str, Any] = {"torsion_orders": order_figure(run_up, TORSIONAL, beside, title)}
    if AXIAL in run_up.amplitudes:
        figures["axial_orders"] = order_figure(run_up, ALONG, beside, title)
    figures["waterfall"] = waterfall_figure(run_up, TORSIONAL, title)
    if beside.modes is not None:
        figures["campbell"] = campbell_figure(run_up, beside, title)
    for quantity, name in ((TORSIONAL, "torsion"), (ALONG, "axial")):
        if quantity.output in run_up.amplitudes:
            figures[f"{name}_histories"] = history_figure(run_up, quantity, title)
            figures[f"{name}_harmonics"] = harmonic_figure(run_up, quantity, beside, title)
    if damped is not None:
        figures["damper"] = damper_figure(run_up, damped, beside, title)
    return [save_figure(figure, folder / f"{name}.png") for name, figure in figures.items()]


def order_figure(run_up: RunUp, quantity: Quantity, beside: Beside, title: str) -> Any:
    """Orders of an output over the speed."""
    figure = _figure(11.5, 6.0)
    _draw_orders(figure.subplots(), run_up, quantity, beside, shown_orders(run_up, quantity, beside))
    figure.suptitle(f"Orders over the speed: {title}", fontsize=12, parse_math=False)
    figure.text(0.01, 0.008, _legend(beside, quantity), fontsize=8, color=plots.INK)
    return figure


def damper_figure(run_up: RunUp, damped: RunUp, beside: Beside, title: str) -> Any:
    """Orders without damper above those with it, to the same scale."""
    figure = _figure(11.5, 9.5)
    axes = figure.subplots(2, 1, sharex=True, sharey=True)
    orders = shown_orders(run_up, TORSIONAL, beside)
    top = TORSIONAL.scale * max(float(np.abs(part.torsion).max()) for part in (run_up, damped))
    for ax, part, name in ((axes[0], run_up, "without damper"), (axes[1], damped, "with damper")):
        own = beside if part is run_up else beside._replace(modes=None, measured=None)
        _draw_orders(ax, part, TORSIONAL, own, orders, top)
        ax.set_title(name, fontsize=10, loc="left")
    axes[0].set_xlabel("")
    figure.suptitle(f"What the torsional damper takes off: {title}", fontsize=12, parse_math=False)
    figure.text(0.01, 0.005, _legend(beside, TORSIONAL), fontsize=8, color=plots.INK)
    return figure


def waterfall_figure(run_up: RunUp, quantity: Quantity, title: str) -> Any:
    """Spectra over the frequency, one above the other by their speed."""
    figure = _figure(10.0, 8.0)
    every = max(1, math.ceil(run_up.speeds.size / 60))
    sizes = quantity.scale * np.abs(run_up.amplitudes[quantity.output][::every])
    plots.plot_waterfall(
        figure.subplots(), run_up.speeds_rpm[::every], run_up.orders, sizes, quantity.unit,
        shown_orders(run_up, quantity, Beside()), 500.0,
    )  # fmt: skip
    figure.suptitle(f"Waterfall of the {quantity.name}: {title}", fontsize=12, parse_math=False)
    return figure


def campbell_figure(run_up: RunUp, beside: Beside, title: str) -> Any:
    """Frequencies over the speed with rays of orders, and how strong torsion is along them."""
    assert beside.modes is not None
    figure = _figure(11.5, 7.5)
    orders = shown_orders(run_up, TORSIONAL, beside)
    sizes = {order: (run_up.speeds_rpm, TORSIONAL.scale * np.abs(run_up.order(order))) for order in orders}
    published = beside.published(TORSIONAL)
    plots.plot_campbell(figure.subplots(), beside.modes, sorted({*orders, *published}), 500.0, sizes, published)
    figure.suptitle(f"Campbell diagram: {title}", fontsize=12, parse_math=False)
    figure.text(
        0.01, 0.008,
        "Frequencies as the turning crank has them; modes keep their name through crossings. Rays: orders, as broad as "
        "the pulley's torsion is large." + (" Crosses: published critical speeds." if published else ""),
        fontsize=8, color=plots.INK,
    )  # fmt: skip
    return figure


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


def shown_orders(run_up: RunUp, quantity: Quantity, beside: Beside) -> list[float]:
    """Orders with a colour of their own: those of the largest amplitudes, and those with a published speed."""
    sizes = np.abs(run_up.amplitudes[quantity.output]).max(axis=0)
    largest = {float(run_up.orders[k]) for k in np.argsort(-sizes)[:COLOURED]}
    speeds = run_up.speeds_rpm
    within = {o for o, rpm in beside.published(quantity).items() if speeds[0] <= rpm <= speeds[-1]}
    return sorted(largest | (within & set(run_up.orders.tolist())))


def worthy(run_up: RunUp, quantity: Quantity, orders: Sequence[float], beside: Beside) -> list[Peak]:
    """Peaks that have a name: high ones, and those of orders with a published speed near it."""
    found = [peak for peak in peaks(run_up, quantity.output) if peak.order in orders]
    largest = max((peak.amplitude for peak in found), default=0.0)
    published = beside.published(quantity)
    return [
        peak
        for peak in found
        if peak.amplitude >= WORTH * largest or abs(peak.speed * RPM / published.get(peak.order, math.inf) - 1.0) < NEAR
    ][:LABELLED]


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


def _draw_orders(
    ax: Any, run_up: RunUp, quantity: Quantity, beside: Beside, orders: Sequence[float], top: float = 0.0
) -> None:
    """Orders over speed with names of their peaks."""
    sizes = quantity.scale * np.abs(run_up.amplitudes[quantity.output])
    speeds = run_up.speeds_rpm
    curves = [
        plots.Curve(order, speeds, quantity.scale * np.abs(run_up.order(order, quantity.output)),
                    beside.measured_of(quantity, order))
        for order in orders
    ]  # fmt: skip
    others = [sizes[:, k] for k, order in enumerate(run_up.orders.tolist()) if order not in orders]
    colours = dict(zip(orders, plots._colours(len(orders)), strict=True))
    labels = [
        plots.Label(
            peak.speed * RPM, quantity.scale * peak.amplitude, _named(peak, beside, quantity), colours[peak.order]
        )
        for peak in worthy(run_up, quantity, orders, beside)
    ]
    plots.plot_orders_over_speed(
        ax, curves, others, quantity.name, quantity.unit, labels, beside.published(quantity), top
    )


def _named(peak: Peak, beside: Beside, quantity: Quantity) -> str:
    """Order, speed, and the mode that it meets there: the nearest of the kind that the output shows."""
    text = f"{peak.order:g}: {peak.speed * RPM:.0f} rev/min"
    mode = beside.modes.nearest(peak.order, peak.speed, quantity.kind) if beside.modes is not None else None
    if mode is None or abs(peak.hz / mode.hz - 1.0) > NEAR:
        return f"{text}\n{peak.hz:.0f} Hz"
    return f"{text}\n{mode.mode}, {mode.hz:.0f} Hz"


def _measured_at(beside: Beside, quantity: Quantity, run_up: RunUp, at: int, orders: Array) -> Array | None:
    """Measured amplitudes (k,) of orders at a speed, not a number where none was measured within half a step."""
    speeds = run_up.speeds_rpm
    reach = 0.5 * float(np.diff(speeds).mean()) + 1e-6 if speeds.size > 1 else 1.0
    found = np.full(orders.size, math.nan)
    for k, order in enumerate(orders.tolist()):
        measured = beside.measured_of(quantity, order)
        if measured is not None:
            nearest = int(np.argmin(np.abs(measured[0] - speeds[at])))
            if abs(measured[0][nearest] - speeds[at]) <= reach:
                found[k] = measured[1][nearest]
    return found if np.any(np.isfinite(found)) else None


def _legend(beside: Beside, quantity: Quantity) -> str:
    parts = ["Grey: further orders."]
    if beside.published(quantity):
        parts.append("Triangles on the axis: published critical speeds of an order.")
    if quantity.output in (beside.measured or {}):
        parts.append("Circles: measured.")
    return " ".join(parts)


def _at(run_up: RunUp, at: int, order: float) -> str:
    return f"{run_up.speeds_rpm[at]:.0f} rev/min, peak of order {order:g}"


def _figure(width: float, height: float) -> Any:
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    # A line of text below the axes needs room.
    return Figure(figsize=(width, height), dpi=120, layout=ConstrainedLayoutEngine(rect=(0.0, 0.03, 1.0, 0.97)))


def _grid(count: int) -> tuple[Any, list[Any]]:
    """Figure with so many axes, two a row."""
    rows = math.ceil(count / 2)
    figure = _figure(11.5, 1.0 + 2.5 * rows)
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
