"""Plots of a run-up, each drawn into the caller's axes; amplitudes are zero to peak."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.core.units import RPM
from cranktrain.results.orders.modes_over_speed import ModesOverSpeed
from cranktrain.results.plots import BLUE, GREY, INK, ORANGE, largest

GREEN, RED, PURPLE = "#3f8f4f", "#c0392b", "#7d4ba3"
KIND_COLOURS = {"bending": GREY, "torsional": RED, "axial": BLUE, "drive line": ORANGE, "added": GREEN}
ORDER_COLOURS = (BLUE, ORANGE, GREEN, RED, PURPLE, "#1b9aa0", "#8a6d3b", "#d36ba6", "#5b6f1f", "#14304f")
BAR_COLOURS = {"pulley": INK, "crank": BLUE, "bearing": ORANGE, "engine": GREEN, "measured": RED}
DECADES = 3.0
"""Number of decades that a logarithmic scale of amplitudes shows below the largest amplitude."""
WATERFALL_DECADES = 3.0
"""Number of decades that the logarithmic heights of a waterfall plot show."""
Marks = Sequence[tuple[float, Array, Array, Array]]
"""Measured orders, each with order, speeds (k,) rev/min, amplitudes (k,) and half widths of bands (k,)."""


class Label(NamedTuple):
    """Label of a point of a curve: position in units of the axes, text, colour of the curve."""

    x: float
    y: float
    text: str
    colour: str


class Curve(NamedTuple):
    """Curve of an order: amplitudes (s,) over speeds (s,) rev/min, and measured speeds (k,) and amplitudes (k,).

    ``band``: half widths (k,) of the measured amplitudes' bands.
    """

    order: float
    speeds: Array
    amplitudes: Array
    measured: tuple[Array, Array] | None = None
    band: Array | None = None


def spread(wanted: Sequence[float], apart: float, low: float, high: float) -> list[float]:
    """Positions near ``wanted`` in the same order, at least ``apart`` from each other, between ``low`` and ``high``.

    If there is not enough room, the positions are equidistant.
    """
    from scipy.optimize import isotonic_regression

    order = np.argsort(wanted, kind="stable")
    if not order.size:
        return []
    apart = min(apart, (high - low) / max(order.size - 1, 1))
    steps = apart * np.arange(order.size)
    # Positions that would touch form a group, which is centred at the mean of its wanted positions.
    places = isotonic_regression(np.asarray(wanted, dtype=float)[order] - steps).x
    found = np.empty(order.size)
    found[order] = np.clip(places, low, high - steps[-1]) + steps
    return [float(place) for place in found]


def plot_orders_over_speed(
    ax: Any,
    curves: Sequence[Curve],
    others: Sequence[Array],
    quantity: str,
    unit: str,
    labels: Sequence[Label] = (),
    published: Mapping[float, float] | None = None,
    top: float = 0.0,
    whole: Array | None = None,
    log: bool = False,
) -> None:
    """Draw orders over speed, with labels of peaks above the curves.

    Parameters
    ----------
    curves : orders with a colour and an entry in the legend; measured amplitudes are drawn as dots
    others : amplitudes (s,) of further orders, drawn grey
    labels : labels of peaks
    published : order → critical speed, rev/min, marked on the speed axis
    top : largest amplitude for which room is left
    whole : amplitudes (s,) of all orders together, drawn black
    log : use a logarithmic scale of ``DECADES``
    """
    top = max(largest(*(curve.amplitudes for curve in curves)), 1e-30, top)
    speeds = curves[0].speeds
    if whole is not None:
        ax.plot(speeds, whole, color="black", lw=1.4, label="all", zorder=3)
        top = max(top, largest(whole))
    for amplitudes in others:
        ax.plot(speeds, amplitudes, color="#c9ced6", lw=0.7, zorder=1)
    for curve, colour in zip(curves, cycle(ORDER_COLOURS), strict=False):
        ax.plot(curve.speeds, curve.amplitudes, color=colour, lw=1.6, label=f"{curve.order:g}", zorder=3)
        if curve.measured is not None:
            ax.plot(*curve.measured, "o", ms=4.5, mfc="white", mec=colour, mew=1.2, zorder=4)
            top = max(top, largest(curve.measured[1]))
            if curve.band is not None:
                rpm, sizes = curve.measured
                ax.vlines(
                    rpm, np.maximum(sizes - curve.band, 0.0), sizes + curve.band, color=colour, lw=1.0, zorder=3.5
                )
        if published and speeds[0] <= published.get(curve.order, 0.0) <= speeds[-1]:
            ax.plot(
                published[curve.order], 0.0, "^", transform=ax.get_xaxis_transform(), ms=8, mfc=colour, mec="white",
                clip_on=False, zorder=6,
            )  # fmt: skip
    if log:
        least, row = 10.0**-DECADES * top, top * 10.0 ** (0.16 * DECADES)
        ax.set(xlim=(speeds[0], speeds[-1]), ylim=(least, top * 10.0 ** ((0.38 if labels else 0.05) * DECADES)))
        ax.set_yscale("log")
    else:
        row = 1.16 * top
        ax.set(xlim=(speeds[0], speeds[-1]), ylim=(0.0, 1.38 * top if labels else 1.05 * top))
    # Draw labels in a row above all curves, each with a line to its peak.
    low, high = ax.get_xlim()
    margin = 0.063 * (high - low)
    places = spread([label.x for label in labels], 2.0 * margin, low + margin, high - margin)
    for label, place in zip(labels, places, strict=True):
        text = ax.annotate(
            label.text, (label.x, label.y), xytext=(place, row), ha="center", va="bottom", fontsize=8,
            color=label.colour, zorder=5,
            arrowprops={"arrowstyle": "-", "color": label.colour, "lw": 0.7, "shrinkA": 1.0, "shrinkB": 2.0},
        )  # fmt: skip
        text.set_in_layout(False)
    ax.set_xlabel("engine speed / rev/min")
    ax.set_ylabel(f"{quantity} / {unit}")
    ax.grid(alpha=0.25)
    ax.legend(
        frameon=False, fontsize=8.5, title="order", title_fontsize=8.5, loc="upper left", bbox_to_anchor=(1.0, 1.0)
    )


def plot_waterfall(
    ax: Any,
    speeds: Array,
    orders: Array,
    amplitudes: Array,
    unit: str,
    named: Sequence[float],
    highest_hz: float,
    measured: Marks = (),
    log: bool = False,
) -> None:
    """Draw spectra (s, o) over frequency, offset by their speed (s,), rev/min.

    ``named`` orders are drawn as rays with their number, ``measured`` orders as circles at the height of their
    amplitude above their speed, with bands. With ``log`` heights are logarithmic over ``WATERFALL_DECADES`` below the
    largest.
    """
    step = float(np.diff(speeds).mean())
    most = largest(amplitudes) or 1.0
    height = (3.0 if log else 7.0) * step

    def up(sizes: Array) -> Array:
        """Heights of amplitudes above the line of their speed, in rev/min of the vertical axis."""
        share = sizes / most
        if log:
            share = 1.0 + np.log10(np.maximum(share, 10.0**-WATERFALL_DECADES)) / WATERFALL_DECADES
        return np.asarray(height * share)

    for k in range(speeds.size - 1, -1, -1):
        hz = orders * speeds[k] / 60.0
        keep = (hz <= highest_hz) & np.isfinite(amplitudes[k])
        line = speeds[k] + up(amplitudes[k, keep])
        ax.fill_between(hz[keep], speeds[k], line, color="white", lw=0.0, zorder=2.0 - 1e-3 * k)
        ax.plot(hz[keep], line, color=BLUE, lw=0.8, zorder=2.0 - 1e-3 * k)
    ends = speeds[0] - step, speeds[-1] + 1.5 * step
    for order in named:
        hz = np.array([order * end / 60.0 for end in ends])
        ax.plot(hz, ends, color=ORANGE, lw=0.7, ls="--", alpha=0.8, zorder=3)
        # The ray of an order leaves the axes at the top (highest speed) or at the right (highest frequency).
        x, y = (hz[1], ends[1]) if hz[1] <= highest_hz else (highest_hz, 60.0 * highest_hz / order)
        if ends[0] < y <= ends[1]:
            ax.annotate(
                f"{order:g}", (x, y), xytext=(0, 2) if y == ends[1] else (3, 0), textcoords="offset points",
                ha="center" if y == ends[1] else "left", va="bottom" if y == ends[1] else "center",
                fontsize=8, color=ORANGE, annotation_clip=False,
            )  # fmt: skip
    ax.set(xlim=(0.0, highest_hz), ylim=(ends[0], ends[1] + 3.0 * step))
    ax.set_xlabel("frequency / Hz; dashed: orders")
    ax.set_ylabel("engine speed / rev/min")
    for order, rpm, sizes, band in measured:
        hz = order * rpm / 60.0
        keep = (hz <= highest_hz) & (rpm >= speeds[0]) & (rpm <= speeds[-1])
        lower, upper = (rpm + up(np.maximum(sizes + side * band, 0.0)) for side in (-1.0, 1.0))
        ax.vlines(hz[keep], lower[keep], upper[keep], color=RED, lw=1.0, zorder=3.5)
        ax.plot(hz[keep], (rpm + up(sizes))[keep], "o", ms=3.0, mfc="white", mec=RED, mew=0.8, zorder=3.6)
    least, word = (f"{10.0**-WATERFALL_DECADES * most:.3g} to ", ", logarithmic") if log else ("", "")
    ax.plot([0.985 * highest_hz] * 2, [ends[1] - height, ends[1]], color=INK, lw=1.5, zorder=6)
    ax.annotate(
        f"{least}{most:.3g} {unit}{word}", (0.985 * highest_hz, ends[1] - 0.5 * height), xytext=(-4, 0),
        textcoords="offset points", ha="right", va="center", fontsize=8, color=INK, zorder=6,
        bbox={"fc": "white", "ec": "none", "pad": 1.0},
    )  # fmt: skip


def plot_map(
    ax: Any,
    x: Array,
    y: Array,
    values: Array,
    y_label: str,
    log: bool,
    measured: Marks = (),
    along_orders: bool = False,
) -> Any:
    """Draw values (m, n) over speeds x (n,) rev/min and y (m,) as a colour map; returns it for a colour bar.

    With ``log`` the scale covers ``DECADES`` below the largest value. ``measured`` orders are circles filled with the
    colour of their amplitude; y is an order if ``along_orders`` is true, else a frequency, Hz.
    """
    from matplotlib.colors import LogNorm, Normalize

    top = largest(values) or 1.0
    least = 10.0**-DECADES * top if log else 0.0
    scale = LogNorm(least, top) if log else Normalize(least, top)
    shown = np.maximum(values, least)
    colours = ax.pcolormesh(x, y, shown, norm=scale, cmap="viridis", shading="nearest", rasterized=True)
    ax.set_xlabel("engine speed / rev/min")
    ax.set_ylabel(y_label)
    ax.set(xlim=(float(x[0]), float(x[-1])), ylim=(float(y[0]), float(y[-1])))
    for order, rpm, sizes, _ in measured:
        places = np.full(rpm.size, order) if along_orders else order * rpm / 60.0
        ax.scatter(rpm, places, s=22.0, c=np.maximum(sizes, least), norm=scale, cmap="viridis", ec="white", lw=0.7)
    return colours


def plot_campbell(
    ax: Any,
    modes: ModesOverSpeed,
    orders: Sequence[float],
    highest_hz: float,
    sizes: Mapping[float, tuple[Array, Array]] | None = None,
    published: Mapping[float, float] | None = None,
    measured: Marks = (),
) -> None:
    """Draw a Campbell diagram: frequencies at rest over speed, rays of orders, and their amplitudes.

    Parameters
    ----------
    modes : modes over speed
    orders : orders drawn as rays
    highest_hz : end of the frequency axis
    sizes : order → speeds (k,) rev/min and amplitudes (k,), drawn along its ray as circles with proportional area
    published : order → critical speed, rev/min, drawn as a cross on its ray
    measured : measured orders, drawn as circles on the same scale; thin circles are both ends of the band
    """
    speeds = modes.speeds / RPM
    low, high = float(speeds[0]), float(speeds[-1])
    shown = [k for k in range(len(modes.names)) if modes.hz[:, k].min() < highest_hz]
    for k in shown:
        ax.plot(speeds, modes.hz[:, k], color=KIND_COLOURS[modes.kinds[k]], lw=1.8, zorder=4)
    ends = [min(float(modes.hz[-1, k]), highest_hz) for k in shown]
    places = spread(ends, 0.032 * highest_hz, 0.0, highest_hz)
    for k, end, place in zip(shown, ends, places, strict=True):
        colour = KIND_COLOURS[modes.kinds[k]]
        ax.annotate(
            f"{modes.names[k]} at rest  {modes.hz[-1, k]:.0f} Hz", (high, end),
            xytext=(high + 0.02 * (high - low), place), va="center", fontsize=8, color=colour, annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.6, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip
    for order in orders:
        _ray(ax, order, low, high, highest_hz)
    most = largest(*(amplitudes for _, amplitudes in (sizes or {}).values()))
    most = most or largest(*(values for _, _, values, _ in measured)) or 1.0
    for order, (at, amplitudes) in (sizes or {}).items():
        keep = amplitudes > 0.01 * most
        ax.scatter(
            at[keep], order * at[keep] / 60.0, s=260.0 * amplitudes[keep] / most, color=ORANGE, alpha=0.35, lw=0.0,
            zorder=3,
        )  # fmt: skip
    for order, across, values, band in measured:
        keep = (values > 0.01 * most) & (across >= low) & (across <= high)
        for side, width in ((0.0, 1.1), (-1.0, 0.5), (1.0, 0.5)):
            area = 260.0 * np.maximum(values + side * band, 0.0)[keep] / most
            ax.scatter(across[keep], order * across[keep] / 60.0, s=area, fc="none", ec=RED, lw=width, zorder=3.5)
    for order, rpm in (published or {}).items():
        if low <= rpm <= high:
            ax.plot(rpm, order * rpm / 60.0, "x", ms=8, color="black", mew=1.6, zorder=6)
    ax.set(xlim=(low, high), ylim=(0.0, highest_hz))
    ax.set_xlabel("engine speed / rev/min")
    ax.set_ylabel("frequency / Hz")
    ax.grid(alpha=0.2)


def _ray(ax: Any, order: float, low: float, high: float, highest_hz: float) -> None:
    """Draw the ray of an order with its number at the upper border if the ray leaves there, else near its end."""
    ax.plot([low, high], [order * low / 60.0, order * high / 60.0], color="#9aa3ae", lw=0.8, zorder=2)
    leaves = 60.0 * highest_hz / order
    if low < leaves < high:
        at, up = (leaves, highest_hz), {"xytext": (0, 3), "va": "bottom", "ha": "center"}
    else:
        at, up = (high, order * high / 60.0), {"xytext": (-4, 2), "va": "bottom", "ha": "right"}
    if leaves > low:
        ax.annotate(
            f"{order:g}", at, textcoords="offset points", fontsize=8, color=INK, annotation_clip=False, zorder=7,
            bbox={"fc": "white", "ec": "none", "pad": 0.6, "alpha": 0.85}, **up,
        )  # fmt: skip


def plot_history(
    ax: Any, angle_deg: Array, values: Array, unit: str, title: str, measured: tuple[Array, float] | None = None
) -> None:
    """Draw a motion (n,) over one cycle of crank angles (n,), and a measured motion (n,) with its band if given."""
    if measured is not None:
        motion, band = measured
        ax.fill_between(angle_deg, motion - band, motion + band, color=ORANGE, alpha=0.25, lw=0.0)
        ax.plot(angle_deg, motion, color=ORANGE, lw=1.2, label="measured")
    ax.plot(angle_deg, values, color=BLUE, lw=1.4, label="computed")
    ax.set(xlim=(0, 720), xticks=np.arange(0, 721, 180))
    ax.set_ylabel(unit)
    ax.set_title(title, fontsize=9.5, loc="left")
    ax.grid(alpha=0.25)


def plot_harmonics(
    ax: Any, orders: Array, bars: Mapping[str, Array], unit: str, title: str, band: Array | None = None
) -> None:
    """Draw orders (k,) as groups of bars; ``bars`` maps names of ``BAR_COLOURS`` to amplitudes (k,) or NaN.

    ``band``: half widths (k,) of the measured amplitudes' bands.
    """
    width = 0.42 / max(len(bars), 1)
    for k, (name, values) in enumerate(bars.items()):
        places = orders + (k - 0.5 * (len(bars) - 1)) * width
        ax.bar(places, np.nan_to_num(values), width, color=BAR_COLOURS[name], label=name)
        if name == "measured" and band is not None:
            known = np.isfinite(values) & np.isfinite(band)
            ends = np.maximum(values - band, 0.0)[known], (values + band)[known]
            ax.vlines(places[known], *ends, color=INK, lw=1.0, zorder=4)
    ax.set(xlim=(0.0, float(orders[-1]) + 0.5), xticks=np.arange(0, orders[-1] + 0.1, 1.5))
    ax.tick_params(axis="x", labelsize=8)
    ax.set_ylabel(unit)
    ax.set_title(title, fontsize=9.5, loc="left")
    ax.grid(axis="y", alpha=0.25)
