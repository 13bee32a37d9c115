"""Plots of results; each function draws its data into the caller's axes."""

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from cranktrain.core.types import Array

BLUE, ORANGE, GREY = "#1f5a94", "#d9822b", "#8a8f98"
INK = "#3c4654"
CYCLE_COLOURS = ("#1f4e9c", "#1b9aa0", "#6fae3d", "#e0a21b", "#cf4a3c", "#8b3a93", "#1f4e9c")
"""Colours over the crank angle of a cycle. The last equals the first; all are visible on a light background."""


LETTER = 0.5
"""Mean width of a letter over the font size."""


def largest(*values: Array) -> float:
    """Largest finite value of some arrays, at least 0. It limits axes of curves with gaps (NaN)."""
    return max((float(np.max(one, where=np.isfinite(one), initial=0.0)) for one in values), default=0.0)


def wrapped(text: str, width: float, size: float) -> str:
    """Wrap a text to lines of a width, inches, for a font size, points."""
    return textwrap.fill(text, max(20, int(72.0 * width / (LETTER * size))))


def foot(figure: Any, text: str, size: float = 8.0) -> None:
    """Write a text below the axes of a figure with constrained layout, in as many lines as needed."""
    width, height = figure.get_size_inches()
    lines = wrapped(text, 0.97 * width, size)
    room = (1.45 * size * (lines.count("\n") + 1) + 6.0) / 72.0 / height
    figure.text(0.012, 0.5 * 6.0 / 72.0 / height, lines, fontsize=size, color=INK, va="bottom", parse_math=False)
    figure.get_layout_engine().set(rect=(0.0, room, 1.0, 1.0 - room))


def plot_cycle(ax: Any, values: Array, quantity: str, unit: str, colour: str = BLUE) -> None:
    """Draw one cycle of uniform samples (n,) over the crank angle, with the mean as a thin line."""
    n = values.size
    angle = np.arange(n + 1) * (720.0 / n)
    ax.axhline(float(values.mean()), color=GREY, lw=0.8, ls="--", label=f"mean {values.mean():.3g} {unit}")
    ax.plot(angle, np.append(values, values[0]), color=colour, lw=1.6)
    ax.set(xlim=(0, 720), xticks=np.arange(0, 721, 120), xlabel="crank angle over the last cycle / deg")
    ax.set_ylabel(f"{quantity} / {unit}")
    ax.set_title(f"{quantity}: {np.ptp(values):.3g} {unit} peak to peak", fontsize=10, loc="left")
    ax.grid(alpha=0.25)
    ax.margins(y=0.16)  # room for the legend above the highest peak
    ax.legend(frameon=False, fontsize=8, loc="upper right")


def plot_orders(ax: Any, orders: Array, amplitudes: Array, quantity: str, unit: str, highest: float = 12.0) -> None:
    """Draw order amplitudes (k,), zero-to-peak, as bars; the three strongest are labelled with their order."""
    keep = np.asarray(orders) <= highest
    x, y = np.asarray(orders)[keep], np.asarray(amplitudes)[keep]
    ax.bar(x, y, width=0.36, color=BLUE)
    for k in np.argsort(y)[-3:]:
        ax.annotate(f"{x[k]:g}", (x[k], y[k]), ha="center", va="bottom", fontsize=8)
    ax.set(
        xlim=(0, highest + 0.5), xticks=np.arange(0, highest + 0.1, 1.5), xlabel="order / oscillations per revolution"
    )
    ax.set_ylabel(f"{quantity}, zero to peak / {unit}")
    ax.margins(y=0.12)
    ax.grid(axis="y", alpha=0.25)


def plot_table(ax: Any, header: Sequence[str], rows: Sequence[Sequence[str]], title: str) -> None:
    """Draw a table of texts with one header and rows of the same length."""
    ax.axis("off")
    ax.set_title(title, fontsize=11, loc="left")
    table = ax.table(
        cellText=[list(row) for row in rows], colLabels=list(header), bbox=(0.0, 0.0, 1.0, 1.0), cellLoc="center"
    )
    table.auto_set_font_size(False)
    table.set_fontsize(9)
    table.auto_set_column_width(list(range(len(header))))
    for (row, _), cell in table.get_celld().items():
        cell.set_edgecolor("#c8ccd2")
        if row == 0:
            cell.set_facecolor("#e8eef5")
            cell.set_text_props(weight="bold")


def plot_bearing_load(ax: Any, force_x: Array, force_y: Array, name: str) -> None:
    """Draw the force on a bearing (n,) N over a cycle as a polar load diagram, in kN, y up."""
    ax.plot(1e-3 * np.append(force_x, force_x[0]), 1e-3 * np.append(force_y, force_y[0]), color=ORANGE, lw=1.2)
    ax.axhline(0.0, color=GREY, lw=0.6)
    ax.axvline(0.0, color=GREY, lw=0.6)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel="force x / kN", ylabel="force y / kN")
    ax.set_title(name, fontsize=10, loc="left")
    ax.grid(alpha=0.25)


def plot_closed(ax: Any, x: Array, y: Array, angle_deg: Array, **style: float) -> Any:
    """Draw a closed curve (n,) of a cycle, coloured by the crank angle (n,); returns the line for a colour bar."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import LinearSegmentedColormap

    closed = np.column_stack([np.append(x, x[:1]), np.append(y, y[:1])])
    colours = LinearSegmentedColormap.from_list("cycle", CYCLE_COLOURS, N=720)
    pieces = list(np.stack([closed[:-1], closed[1:]], axis=1))
    line = LineCollection(pieces, cmap=colours, capstyle="round", array=angle_deg, clim=(0.0, 720.0), **style)
    ax.add_collection(line)
    return line


def plot_orbit(ax: Any, x: Array, y: Array, name: str, marks: dict[str, int], own: Sequence[str] = ()) -> Any:
    """Draw a journal's orbit over one cycle in its clearance circle, coloured by the crank angle.

    Parameters
    ----------
    x, y : (n,) uniform samples over one cycle, journal's centre over the radial clearance
    name : name of the bearing
    marks : label → index of a marked sample, such as the firing of each cylinder; ``start`` is drawn as a ring
    own : marks that are drawn with their label, such as the cylinders next to this bearing

    Returns
    -------
    Line object of the orbit, for a colour bar in degrees of crank angle
    """
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    ax.fill(np.cos(turn), np.sin(turn), color="#f4f6f9", zorder=0)
    ax.plot(np.cos(turn), np.sin(turn), color="#3c4654", lw=1.2, zorder=1)
    for radius in (0.25, 0.5, 0.75):
        ax.plot(radius * np.cos(turn), radius * np.sin(turn), color="#d5dae1", lw=0.5, zorder=1)
    ax.plot([-1, 1, np.nan, 0, 0], [0, 0, np.nan, -1, 1], color="#d5dae1", lw=0.5, zorder=1)
    line = plot_closed(ax, x, y, np.arange(x.size, dtype=np.float64) * (720.0 / x.size), lw=1.7, zorder=3)
    for label, k in marks.items():
        if label not in ("start", *own):
            ax.plot(x[k], y[k], "o", ms=2.6, color="black", zorder=5)
    if "start" in marks:
        k = marks["start"]
        ax.plot(x[k], y[k], "o", ms=8.0, mfc="none", mec="black", mew=1.1, zorder=5)
    for label, lean in zip(own, (0.7, -0.7) if len(own) == 2 else [0.0] * len(own), strict=True):
        k = marks[label]
        ax.plot(x[k], y[k], "o", ms=5.0, color="black", mec="white", mew=0.7, zorder=6)
        inward = np.arctan2(-y[k], -x[k]) + lean  # two labels at one position are inclined in different directions
        ax.annotate(
            label, (x[k], y[k]), xytext=(10.5 * np.cos(inward), 10.5 * np.sin(inward)), textcoords="offset points",
            fontsize=8.5, weight="bold", ha="center", va="center", zorder=7,
            bbox={"boxstyle": "circle,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.75},
        )  # fmt: skip
    ax.set_aspect("equal")
    ax.set(xlim=(-1.06, 1.06), ylim=(-1.06, 1.06), xticks=(-1, 0, 1), yticks=(-1, 0, 1))
    ax.tick_params(labelsize=8, length=0, pad=1)
    for side in ax.spines.values():
        side.set_visible(False)
    ax.set_title(f"{name}   ε ≤ {np.hypot(x, y).max():.3f}", fontsize=9)
    return line


def plot_least_films(
    ax: Any, angle_deg: Array, films: dict[str, Array], firing_deg: Sequence[float], asperities: float
) -> None:
    """Draw the least film of several bearings, (n,) m each, over one cycle of increasing crank angles (n,).

    ``firing_deg`` (°) are the firing angles in the order of cylinders; ``asperities`` is the film thickness (m) at
    which surfaces touch, 0 for smooth surfaces.
    """
    from matplotlib import colormaps

    colours = colormaps["viridis"](np.linspace(0.0, 0.92, len(films)))
    for (name, film), colour in zip(films.items(), colours, strict=True):
        angle = np.concatenate([angle_deg[-1:] - 720.0, angle_deg, angle_deg[:1] + 720.0])
        least = 1e6 * film.min()
        closed = np.concatenate([film[-1:], film, film[:1]])
        ax.plot(angle, 1e6 * closed, color=colour, lw=1.4, label=f"{name}: {least:.2f} µm")
        ax.plot(angle_deg[film.argmin()], least, "v", ms=5, color=colour, mec="white", mew=0.6, zorder=4)
    top = 1e6 * max(film.max() for film in films.values())
    _mark_firing(ax, firing_deg)
    if asperities > 0.0:
        ax.axhspan(0.0, 1e6 * asperities, color=ORANGE, alpha=0.25, lw=0.0, label="asperities touch")
    ax.set(xlim=(0, 720), xticks=np.arange(0, 721, 60), ylim=(0.0, 1.05 * top))
    ax.set_ylabel("least film / µm")
    ax.grid(alpha=0.25)
    ax.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5), title="least", title_fontsize=8)


def plot_loads(ax: Any, angle_deg: Array, loads: dict[str, Array], firing_deg: Sequence[float]) -> None:
    """Draw loads of several bearings, (n,) N each, over one cycle of crank angles (n,), with maxima in the legend."""
    from matplotlib import colormaps

    colours = colormaps["viridis"](np.linspace(0.0, 0.92, len(loads)))
    for (name, load), colour in zip(loads.items(), colours, strict=True):
        closed = 1e-3 * np.append(load, load[0])
        ax.plot(np.append(angle_deg, 720.0), closed, color=colour, lw=1.4, label=f"{name}: {1e-3 * load.max():.3g} kN")
    _mark_firing(ax, firing_deg)
    ax.set(xlim=(0, 720), xticks=np.arange(0, 721, 60), ylim=(0.0, 1.05e-3 * max(map(largest, loads.values()))))
    ax.set_ylabel("load / kN")
    ax.grid(alpha=0.25)
    title = {"title": "largest", "title_fontsize": 8}
    ax.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5), **title)


def _mark_firing(ax: Any, firing_deg: Sequence[float]) -> None:
    """Mark the firing angles (°) of the cylinders in order by dotted lines with the cylinder's number above."""
    for number, at in enumerate(firing_deg, start=1):
        ax.axvline(at, color=GREY, lw=0.7, ls=":", zorder=0)
        ax.annotate(
            f"{number}", (at, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 3), textcoords="offset points",
            ha="center", fontsize=8, color="#5c6573",
        )  # fmt: skip


def plot_pressure(ax: Any, angles_deg: Array, traces: dict[str, Array]) -> None:
    """Draw cylinder pressures (n,) Pa over the crank angle after firing dead centre, with 0 in the middle."""
    order = np.argsort(np.where(angles_deg > 360.0, angles_deg - 720.0, angles_deg))
    shifted = np.where(angles_deg > 360.0, angles_deg - 720.0, angles_deg)[order]
    for (name, pressure), colour in zip(traces.items(), (BLUE, ORANGE, GREY, "black"), strict=False):
        ax.plot(shifted, 1e-6 * pressure[order], label=name, color=colour, lw=1.6)
    ax.set(xlim=(-360, 360), xticks=np.arange(-360, 361, 180), xlabel="crank angle after firing dead centre / deg")
    ax.set_ylabel("cylinder pressure, absolute / MPa")
    ax.grid(alpha=0.25)
    ax.legend(frameon=False)
