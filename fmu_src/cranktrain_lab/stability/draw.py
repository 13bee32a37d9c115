"""Pictures of stability maps, and the Markdown page of all with explanations, sources and deviations from theory.

A picture has the stability as background, contours of the measure, and curves of theory and product.
"""

import textwrap
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.results.figures import save_figure
from cranktrain_lab.stability.stability_map import Array, Axis, StabilityMap

UNSTABLE = "#c8553d"
COLOURS = ("#12355b", "#a02c7a", "#2f7d3c", "#b07a12", "#444444", "#0b7f8a", "#7a3b12", "#5a4fcf")
"""Colours of curves by label. A numerical curve has the colour of the theoretical curve of the same case."""
MARKERS = ("o", "s", "^", "D", "v", "P")
WRAP = 135


def map_figure(found: StabilityMap) -> Any:
    """Draw a map with legend and explanation below."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    figure = Figure(figsize=(9.2, 7.6), dpi=130)
    text = [line for part in found.explanation.strip().splitlines() for line in textwrap.wrap(part.strip(), WRAP)]
    curves = len(found.theory) + len(found.numerical) + 1
    below = 0.024 * ((curves + 1) // 2) + 0.0215 * len(text) + 0.125
    ax = figure.add_axes((0.095, below, 0.79, 0.935 - below))
    plot_map(ax, found, figure)
    handles, labels = ax.get_legend_handles_labels()
    if not found.stable.all():
        handles.append(Patch(facecolor=UNSTABLE, alpha=0.4))
        labels.append(found.failure)
    bottom = 0.0215 * len(text) + 0.025
    figure.legend(
        handles, labels, loc="lower left", bbox_to_anchor=(0.085, bottom), ncol=2, frameon=False, fontsize=8
    )  # fmt: skip
    figure.text(0.095, 0.02, "\n".join(text), fontsize=8, va="bottom", linespacing=1.25, color="#333333")
    return figure


def plot_map(ax: Any, found: StabilityMap, figure: Any) -> None:
    """Draw the map into ``ax``; ``figure`` gets a colour bar if there is a measure."""
    x, y = _edges(found.columns), _edges(found.rows)
    if found.measure is not None:
        finite = found.measure[np.isfinite(found.measure)]
        low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
        shown = ax.pcolormesh(
            x, y, np.ma.masked_invalid(found.measure), cmap="Greys", vmin=low, vmax=max(high, low + 1e-12),
            alpha=0.3, rasterized=True,
        )  # fmt: skip
        box = ax.get_position()
        bar = figure.add_axes((box.x1 + 0.015, box.y0, 0.018, box.height))
        figure.colorbar(shown, cax=bar).set_label(found.measure_label, fontsize=9)
        bar.tick_params(labelsize=8)
    from matplotlib.colors import ListedColormap

    ground = np.ma.masked_where(found.stable, np.ones(found.stable.shape))
    colour = ListedColormap([UNSTABLE])
    ax.pcolormesh(x, y, ground, cmap=colour, vmin=0.0, vmax=1.0, alpha=0.3, linewidth=0.0, rasterized=True)
    labels = list(dict.fromkeys(boundary.label for boundary in (*found.theory, *found.numerical)))
    colours = {label: COLOURS[k % len(COLOURS)] for k, label in enumerate(labels)}
    for boundary in found.theory:
        ax.plot(*boundary.points.T, color=colours[boundary.label], lw=1.8, label=f"theory: {boundary.label}", zorder=3)
    for k, boundary in enumerate(found.numerical):
        ax.plot(
            *boundary.points.T, MARKERS[k % len(MARKERS)], color=colours[boundary.label], ms=5 + 1.5 * (k % 2),
            mfc="none", mew=1.3, ls="none", label=f"found: {boundary.label}", zorder=4,
        )  # fmt: skip
    for own, axis in ((ax.xaxis, found.columns), (ax.yaxis, found.rows)):
        _scale(own, axis)
    ax.set(xlabel=found.columns.label, ylabel=found.rows.label, xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    ax.set_title(found.title, fontsize=11, loc="left")
    ax.grid(alpha=0.25)


def _scale(own: Any, axis: Axis) -> None:
    """Set a logarithmic scale if the axis requires it, with plain numbers for a small range."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    if not axis.log:
        return
    own.axes.set_xscale("log") if own.axis_name == "x" else own.axes.set_yscale("log")
    if axis.values[-1] < 300.0 * axis.values[0]:
        own.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        own.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        own.set_minor_formatter(NullFormatter())


def save_map(folder: Path, found: StabilityMap) -> list[Path]:
    """Write ``NAME.png`` and ``NAME.svg`` into ``folder``. Return their paths."""
    return [save_figure(map_figure(found), folder / f"{found.name}{suffix}") for suffix in (".png", ".svg")]


def _edges(axis: Axis) -> Array:
    """Return the borders (n + 1,) of the cells around an axis' values."""
    values = np.log(axis.values) if axis.log else axis.values
    if values.size == 1:
        borders = np.array([values[0] - 0.5, values[0] + 0.5])
    else:
        middle = 0.5 * (values[1:] + values[:-1])
        borders = np.concatenate(([2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]))
    return np.asarray(np.exp(borders) if axis.log else borders)


HEAD = """\
# Where methods fail

Made by

    cranktrain stability --output docs/stability --page docs/stability.md

Each map sets what the running model's own kernels and integrators do, found by bisection, beside theory in plain
NumPy: closed forms, and eigenvalues and stability functions from the films' tangents and the methods' tables.
Deviations are relative, in the parameter that was bisected. `cranktrain stability --map NAME` makes one map,
`--quick` coarse ones; computed maps are kept, so that an interrupted run goes on. All data comes as JSON with
`--json`; the method of each map stands in its module under `fmu_src/cranktrain_lab/stability/`.
"""


def page(maps: Sequence[StabilityMap], pictures: Sequence[str]) -> str:
    """Return the Markdown page of some maps; ``pictures`` are the pictures' paths relative to the page."""
    parts = [HEAD]
    parts.append("| map | largest difference of what was found from theory |\n| --- | --- |")
    for found in maps:
        parts[-1] += f"\n| [{found.name}](#{found.name}) | {shown_deviation(found)} |"
    for found, picture in zip(maps, pictures, strict=True):
        parts.append(f"## {found.name}\n\n![{found.title}]({picture})")
        parts.append("\n".join(f"* {line.strip()}" for line in found.explanation.strip().splitlines()))
        rows = [("theory", b) for b in found.theory] + [("found", b) for b in found.numerical]
        table = "| curve | | from |\n| --- | --- | --- |"
        for kind, boundary in rows:
            # Points of the curve without a value have a verdict in words.
            counts = Counter(verdict for verdict in boundary.verdicts if " " in verdict)
            told = "".join(f"; {verdict}: {n} of {len(boundary.verdicts)}" for verdict, n in sorted(counts.items()))
            table += f"\n| {_cell(boundary.label)} | {kind} | {_cell(boundary.source + told)} |"
        parts.append(table)
    return "\n\n".join(part.strip() for part in parts) + "\n"


def shown_deviation(found: StabilityMap) -> str:
    """Return a map's largest deviation between theory and product as text."""
    return "no theory" if found.max_deviation is None else f"{100.0 * found.max_deviation:.2g} %"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
