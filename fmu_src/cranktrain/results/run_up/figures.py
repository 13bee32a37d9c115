"""Figures of a run-up over its speeds: orders, waterfall, Campbell diagram, parts of the axial motion."""

import math
from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.units import RPM
from cranktrain.results.figures import save_figure
from cranktrain.results.orders.deviations import deviations, deviations_said
from cranktrain.results.orders.resonances import Peak
from cranktrain.results.plots import foot, largest
from cranktrain.results.run_up import plots
from cranktrain.results.run_up.peak_figures import harmonic_figure, history_figure
from cranktrain.results.run_up.plot_data import (
    ALONG,
    PARTS,
    TORSIONAL,
    TWISTING,
    Beside,
    Quantity,
    figure_of,
    shown_orders,
    unsteady,
    worthy,
)
from cranktrain.results.run_up.run_up import AXIAL, TWIST, RunUp, frequency_map, half_range, order_map, with_twist
from cranktrain.results.strength.iacs_m68 import plot_stress

MAP_COLUMNS, MAP_ROWS = 400, 300
"""Number of columns (speeds) and rows (orders or frequencies) of a colour map."""
STILL = 1e-12
"""Amplitudes below this value, m, count as no motion."""
PART_NAMES = {
    "crank": "own vibration, pulley against collar",
    "bearing": "collar in its clearance",
    "engine": "thrust faces, with the engine on its mounts",
}


def file_names() -> list[str]:
    """File names of all possible pictures of a run-up."""
    motions = [f"{name}_{kind}.png" for name in ("torsion", "axial") for kind in ("orders", "histories", "harmonics")]
    others = ("axial_parts", "waterfall", "campbell", "damper", "shaft_stress", "twist_orders", "colour_map")
    return [*motions, *(f"{name}.png" for name in others)]


def save_run_up_pictures(
    folder: Path, run_up: RunUp, beside: Beside, title: str, damped: RunUp | None = None, peak_to_peak: bool = False
) -> list[Path]:
    """Write all pictures for which a run-up has data into ``folder``; returns their paths.

    ``damped`` is a run-up of the same engine with its damper, drawn below the run-up without it. With ``peak_to_peak``
    amplitudes of orders are peak to peak instead of zero to peak.
    """
    run_up = with_twist(run_up)
    torsional, twisting, along = (
        quantity.peak_to_peak if peak_to_peak else quantity for quantity in (TORSIONAL, TWISTING, ALONG)
    )
    figures: dict[str, Any] = {"torsion_orders": order_figure(run_up, torsional, beside, title)}
    if TWIST in run_up.amplitudes:
        figures["twist_orders"] = order_figure(run_up, twisting, beside, title)
    if AXIAL in run_up.amplitudes:
        figures["axial_orders"] = order_figure(run_up, along, beside, title)
        if all(output in run_up.amplitudes for output in PARTS.values()):
            figures["axial_parts"] = parts_figure(run_up, along, beside, title)
    highest_hz = beside.highest_hz(run_up)
    figures["waterfall"] = waterfall_figure(run_up, torsional, beside, title, highest_hz)
    mapped = twisting if TWIST in run_up.amplitudes else torsional
    figures["colour_map"] = map_figure(run_up, mapped, beside, title, highest_hz)
    if beside.modes is not None:
        figures["campbell"] = campbell_figure(run_up, beside, title)
    for quantity, sizes, name in ((TORSIONAL, torsional, "torsion"), (ALONG, along, "axial")):
        if quantity.output in run_up.amplitudes:
            figures[f"{name}_histories"] = history_figure(run_up, quantity, title, beside)
            figures[f"{name}_harmonics"] = harmonic_figure(run_up, sizes, beside, title)
    if beside.stresses:
        figures["shaft_stress"] = stress_figure(run_up, beside.stresses, title)
    if damped is not None:
        figures["damper"] = damper_figure(run_up, damped, torsional, beside, title)
    return [save_figure(figure, folder / f"{name}.png") for name, figure in figures.items()]


def order_figure(run_up: RunUp, quantity: Quantity, beside: Beside, title: str) -> Any:
    """Figure of the orders of an output over speed."""
    figure = figure_of(11.5, 6.0)
    _draw_orders(figure.subplots(), run_up, quantity, beside, shown_orders(run_up, quantity, beside))
    figure.suptitle(f"Orders over the speed: {title}", fontsize=12, parse_math=False)
    foot(figure, _legend(run_up, beside, quantity))
    return figure


def stress_figure(run_up: RunUp, stresses: Sequence[Mapping[str, Any]], title: str) -> Any:
    """Figure of the stress of each drive-line shaft over speed, with the limits of IACS UR M68."""
    figure = figure_of(9.5, 1.5 + 3.0 * len(stresses))
    axes = figure.subplots(len(stresses), 1, sharex=True, squeeze=False)[:, 0]
    for ax, entry in zip(axes, stresses, strict=True):
        plot_stress(ax, run_up.speeds_rpm, entry)
    axes[0].legend(frameon=False, fontsize=8.5)
    axes[-1].set_xlabel("engine speed / rev/min")
    figure.suptitle(f"Torsional vibration stress, IACS UR M68: {title}", fontsize=12, parse_math=False)
    return figure


def map_figure(run_up: RunUp, quantity: Quantity, beside: Beside, title: str, highest_hz: float) -> Any:
    """Figure with colour maps over speed, one of orders and one of frequencies up to ``highest_hz``."""
    figure = figure_of(11.5, 5.2)
    left, right = figure.subplots(1, 2)
    speeds = np.linspace(run_up.speeds[0], run_up.speeds[-1], MAP_COLUMNS)
    hz = np.linspace(0.0, highest_hz, MAP_ROWS)
    of_orders = quantity.scale * order_map(run_up, quantity.output, speeds)
    of_hz = quantity.scale * frequency_map(run_up, quantity.output, speeds, hz)
    marks, log = beside.measured_marks(quantity, run_up.orders.tolist()), beside.logarithmic(run_up, quantity)
    plots.plot_map(left, speeds / RPM, run_up.orders, of_orders, "order", log, marks, along_orders=True)
    colours = plots.plot_map(right, speeds / RPM, hz, of_hz, "frequency / Hz", log, marks)
    bar = figure.colorbar(colours, ax=(left, right), pad=0.01)
    bar.set_label(f"{quantity.name} / {quantity.unit}")
    figure.suptitle(f"Orders and frequencies over the speed: {title}", fontsize=12, parse_math=False)
    if marks:
        foot(
            figure,
            f"Circles: measured, filled with the colour of their amplitude. {_deviating(run_up, beside, quantity)}",
        )
    return figure


def parts_figure(run_up: RunUp, quantity: Quantity, beside: Beside, title: str) -> Any:
    """Figure of the axial motion's parts: orders over speed of each part, with separate scales."""
    figure = figure_of(11.5, 9.5)
    orders = shown_orders(run_up, quantity, Beside(orders=beside.orders))
    size = quantity.name.partition(", ")[2]
    # Parts without motion are left out, such as the engine's motion on ground.
    moving = {name: output for name, output in PARTS.items() if largest(np.abs(run_up.amplitudes[output])) > STILL}
    axes = figure.subplots(max(len(moving), 1), 1, sharex=True, squeeze=False)[:, 0]
    for ax, (name, output) in zip(axes, moving.items(), strict=False):
        curves = [
            plots.Curve(order, run_up.speeds_rpm, quantity.scale * np.abs(run_up.order(order, output)))
            for order in orders
        ]
        plots.plot_orders_over_speed(ax, curves, [], size, quantity.unit, log=bool(beside.log))
        ax.set_title(f"{name}: {PART_NAMES[name]}", fontsize=10, loc="left")
    for ax in axes[:-1]:
        ax.set_xlabel("")
    figure.suptitle(f"Parts of the pulley's axial motion: {title}", fontsize=12, parse_math=False)
    return figure


def damper_figure(run_up: RunUp, damped: RunUp, quantity: Quantity, beside: Beside, title: str) -> Any:
    """Figure of orders without damper above orders with damper, on the same scale."""
    figure = figure_of(11.5, 9.5)
    axes = figure.subplots(2, 1, sharex=True, sharey=True)
    orders = shown_orders(run_up, quantity, beside)
    top = quantity.scale * largest(*(np.abs(part.torsion) for part in (run_up, damped)))
    for ax, part, name in ((axes[0], run_up, "without damper"), (axes[1], damped, "with damper")):
        own = beside if part is run_up else beside._replace(motion=(), measured=None)
        _draw_orders(ax, part, quantity, own, orders, top)
        ax.set_title(name, fontsize=10, loc="left")
    axes[0].set_xlabel("")
    figure.suptitle(f"What the torsional damper takes off: {title}", fontsize=12, parse_math=False)
    foot(figure, _legend(run_up, beside, quantity))
    return figure


def waterfall_figure(run_up: RunUp, quantity: Quantity, beside: Beside, title: str, highest_hz: float) -> Any:
    """Waterfall figure: spectra over frequency up to ``highest_hz``, offset by their speed."""
    figure = figure_of(10.0, 8.0)
    every = max(1, math.ceil(run_up.speeds.size / 60))
    sizes = quantity.scale * np.abs(run_up.amplitudes[quantity.output][::every])
    plots.plot_waterfall(
        figure.subplots(), run_up.speeds_rpm[::every], run_up.orders, sizes, quantity.unit,
        shown_orders(run_up, quantity, Beside(orders=beside.orders)), highest_hz,
        marks := beside.measured_marks(quantity, run_up.orders.tolist()), beside.logarithmic(run_up, quantity),
    )  # fmt: skip
    figure.suptitle(f"Waterfall of the {quantity.name}: {title}", fontsize=12, parse_math=False)
    if marks:
        foot(figure, f"Circles: measured, with 95 % bands. {_deviating(run_up, beside, quantity)}")
    return figure


def campbell_figure(run_up: RunUp, beside: Beside, title: str) -> Any:
    """Campbell figure: frequencies over speed with rays of orders, and the amplitude of torsion along the rays."""
    assert beside.modes is not None
    figure = figure_of(11.5, 7.5)
    orders = shown_orders(run_up, TORSIONAL, beside)
    sizes = {order: (run_up.speeds_rpm, TORSIONAL.scale * np.abs(run_up.order(order))) for order in orders}
    published = beside.published(TORSIONAL)
    ax, rays = figure.subplots(), sorted({*orders, *published})
    marks = beside.measured_marks(TORSIONAL, orders)
    plots.plot_campbell(ax, beside.modes, rays, beside.highest_hz(run_up), sizes, published, marks)
    motion = [(peak.speed / RPM, peak.motion_hz) for peak in beside.motion if math.isfinite(peak.motion_hz)]
    if motion:
        ax.plot(*zip(*motion, strict=True), "D", ms=6, mfc="white", mec=plots.RED, mew=1.4, zorder=6,
                label="torsional in motion")  # fmt: skip
        ax.legend(frameon=False, fontsize=8.5, loc="upper left")
    figure.suptitle(f"Campbell diagram, modes at rest on stand-in springs: {title}", fontsize=12, parse_math=False)
    foot(
        figure,
        "Lines: modes at rest, on ground, collar closed, as the turning crank has them. Rays: orders; area of their "
        "circles: torsion of the pulley." + (" Diamonds: its torsional mode in motion." if motion else "")
        + (" Crosses: published critical speeds." if published else "")
        + (f" Rings: measured torsion, thin ones its band. {_deviating(run_up, beside, TORSIONAL)}" if marks else ""),
    )  # fmt: skip
    return figure


def _draw_orders(
    ax: Any, run_up: RunUp, quantity: Quantity, beside: Beside, orders: Sequence[float], top: float = 0.0
) -> None:
    """Draw orders over speed with labelled peaks."""
    sizes = quantity.scale * np.abs(run_up.amplitudes[quantity.output])
    speeds = run_up.speeds_rpm
    curves = [
        plots.Curve(order, speeds, quantity.scale * np.abs(run_up.order(order, quantity.output)),
                    beside.measured_of(quantity, order), beside.band_of(quantity, order))
        for order in orders
    ]  # fmt: skip
    others = [] if beside.orders else [sizes[:, k] for k in np.flatnonzero(~np.isin(run_up.orders, orders))]
    whole = quantity.scale * half_range(run_up, run_up.amplitudes[TWIST]) if quantity.output == TWIST else None
    colours = dict(zip(orders, cycle(plots.ORDER_COLOURS), strict=False))
    labels = []
    for peak in worthy(run_up, quantity, orders, beside):
        rpm = peak.speed / RPM
        curve = quantity.scale * np.abs(run_up.order(peak.order, quantity.output))
        height = float(np.interp(rpm, speeds[np.isfinite(curve)], curve[np.isfinite(curve)]))
        labels.append(plots.Label(rpm, height, _named(peak, beside, quantity), colours[peak.order]))
    log, published = beside.logarithmic(run_up, quantity), beside.published(quantity)
    plots.plot_orders_over_speed(ax, curves, others, quantity.name, quantity.unit, labels, published, top, whole, log)
    # Each unsteady speed is shaded up to halfway to its neighbours.
    borders = np.concatenate((speeds[:1], 0.5 * (speeds[1:] + speeds[:-1]), speeds[-1:]))
    for k in np.flatnonzero(unsteady(run_up)):
        ax.axvspan(borders[k], borders[k + 1], color="#f1e3d3", lw=0.0, zorder=0)


def _named(peak: Peak, beside: Beside, quantity: Quantity) -> str:
    """Label of a peak: order, speed, torsional mode in motion or else the peak's frequency, and note on a mean cycle.

    Modes at rest are left out, because modes of the running crank differ from them.
    """
    hz = beside.motion_hz(peak, quantity)
    of = f"in motion {hz:.0f} Hz" if math.isfinite(hz) else f"{peak.hz:.0f} Hz"
    return f"{peak.order:g}: {peak.speed / RPM:.0f} rev/min\n{of}{'' if peak.periodic else ', mean cycle'}"


def _legend(run_up: RunUp, beside: Beside, quantity: Quantity) -> str:
    parts = [] if beside.orders else ["Grey: further orders."]
    if quantity.output == TWIST:
        parts.append("Black: all orders together, from their range over a cycle.")
    if quantity.kind == "torsional" and any(math.isfinite(peak.motion_hz) for peak in beside.motion):
        parts.append("In motion: torsional mode of the run itself, about its settled cycle.")
    if beside.published(quantity):
        parts.append("Triangles on the axis: published critical speeds of an order.")
    if quantity.output in (beside.measured or {}):
        parts.append("Circles: measured, lines through them 95 % bands.")
        parts.append(_deviating(run_up, beside, quantity))
    if np.any(unsteady(run_up)):
        parts.append("Shaded: speeds at which no cycle repeats the one before, orders and peaks of a mean cycle.")
    return " ".join(parts)


def _deviating(run_up: RunUp, beside: Beside, quantity: Quantity) -> str:
    """Line of text on the deviations of an output's orders from measured orders."""
    measured = beside.measured
    if measured is None or quantity.output not in measured:
        return ""
    return deviations_said([row for row in deviations(run_up, measured) if row["output"] == quantity.output])
