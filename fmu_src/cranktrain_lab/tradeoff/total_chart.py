"""Pictures of total error against cost: all choices, their Pareto front, and the parts of the errors on this front.

Left: total error over cost. Colours show the bearing level, forms of marks the crank level, filled marks a flexible
block. A line joins the steps of one model. Right: the choices of the front and the default, one in each row, with the
parts of their errors.
"""

import math
from collections.abc import Sequence
from typing import Any

from cranktrain.engine.levels import CRANKS
from cranktrain.film.laws.register import MAINS, bearing_levels
from cranktrain.studies.total_error.families import Family
from cranktrain.studies.total_error.point import PARTS, TotalPoint, at_scene, shown
from cranktrain_lab.tradeoff.chart import name_points
from cranktrain_lab.tradeoff.point import front
from cranktrain_lab.tradeoff.study import TotalStudy
from cranktrain_lab.tradeoff.total_choice import ACCURACIES, percent, rate

COLOURS = ("#8a8f98", "#c58b00", "#1f77b4", "#2ca02c", "#8e44ad", "#d62728", "#17a2a2", "#7f4f24")
"""Colours of bearing levels, the lowest level first."""
MARKS = ("v", "D", "s", "o", "P", "X")
"""Marks (matplotlib) of crank levels, the lowest level first."""
PART_STYLES = {"model": ("s", "#1f77b4"), "numerical": ("o", "#e07b00"), "settling": ("^", "#2ca02c")}
INK, PALE = "#22262b", "#9aa1aa"
FARTHEST = 10.0
"""Largest relative error in charts. Larger errors mean a useless result and are drawn at the top edge."""
LEAST = 1.0e-5
"""Least relative error in charts. Smaller parts of an error are drawn at this value."""
GAIN = 0.98
"""Ratio of errors of two neighbours on the Pareto front above which the more expensive one gets no label."""
COST = "processor seconds per simulated second of a settled cycle"


def total_figure(study: TotalStudy, scene: str, family: Family) -> Any:
    """Return the figure of one output family in one scene (an engine at one speed)."""
    from matplotlib.figure import Figure

    points = at_scene(study.points, scene)
    own, best = shown(points, family.name), study.best[scene]
    best_of = front(points, family.name)
    # Choices of a Pareto front to label, cheapest first; each must reduce the error by GAIN or more.
    listed: list[TotalPoint] = []
    for point in best_of:
        if not listed or (point.total(family.name) or 0.0) < GAIN * (listed[-1].total(family.name) or 0.0):
            listed.append(point)
    rows = listed + [p for p in own if p.default and p not in listed]
    height = max(6.0, 0.36 * len(rows) + 2.6)
    figure = Figure(figsize=(14.2, height), dpi=120)
    left, right = figure.subplots(1, 2, gridspec_kw={"width_ratios": (1.0, 0.62)})
    figure.subplots_adjust(left=0.062, right=0.985, wspace=0.68, top=1.0 - 0.86 / height, bottom=0.98 / height)
    numbers = {id(point): str(k) for k, point in enumerate(listed, 1)}
    plot_points(left, own, family.name, best_of)
    plot_parts(right, rows, family.name, numbers)
    figure.text(
        0.012, 1.0 - 0.3 / height, f"Total error of the {family.title}: {scene} rev/min", fontsize=13, color=INK,
        weight="bold", parse_math=False,
    )  # fmt: skip
    grid = ", fine grid" if best.fine_grid else ""
    worst = ", the worst bearing's" if len(family.members(study.scenes[0].engine)) > 1 else ""
    figure.text(
        0.012, 1.0 - 0.55 / height,
        f"against {best.name}, {best.integrator} at {best.step_deg:g}°{grid}, settled; error: RMS of the difference "
        f"over the last cycle over the RMS of the alternating part{worst}",
        fontsize=8.5, color="#555c66", parse_math=False,
    )  # fmt: skip
    _legend(figure, own)
    labels = [(p.cost or 0.0, _height(p, family.name), numbers[id(p)]) for p in listed]
    name_points(figure, [(left, labels)], fontsize=8.5)
    return figure


def plot_points(ax: Any, points: Sequence[TotalPoint], family: str, listed: Sequence[TotalPoint]) -> None:
    """Draw the total errors of all choices over cost, the Pareto front ``listed``, and a ring around the default."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    colours, marks = _colours(), _marks()
    for model in dict.fromkeys((p.levels, p.integrator) for p in points):
        line = sorted((p for p in points if (p.levels, p.integrator) == model), key=lambda p: -p.step_deg)
        x, y = [p.cost for p in line], [_height(p, family) for p in line]
        colour = colours[line[0].bearings]
        face = colour if line[0].block != "ground" else "white"
        ax.plot(
            x, y, color=colour, lw=0.7, marker=marks[line[0].crank], ms=5.5, mfc=face, mec=colour, mew=1.1, alpha=0.95,
            zorder=3,
        )  # fmt: skip
    ax.plot([p.cost for p in listed], [_height(p, family) for p in listed], color=INK, lw=3.0, alpha=0.22, zorder=2)
    for point in points:
        if point.default:
            ax.plot(point.cost, _height(point, family), "o", ms=14, mfc="none", mec=INK, mew=1.4, zorder=4)
    ax.set(xscale="log", yscale="log")
    ax.margins(x=0.06)
    heights = [_height(p, family) for p in points]
    low, high = min(*heights, ACCURACIES[-1]), max(*heights, ACCURACIES[0])
    ax.set_ylim(low / (high / low) ** 0.07, high * (high / low) ** 0.07)
    for accuracy in ACCURACIES:
        ax.axhline(accuracy, color=PALE, lw=0.9, ls=(0, (4, 3)), zorder=1)
    _percents(ax.yaxis)
    ax.xaxis.set(
        major_locator=LogLocator(10.0, subs=(1.0,)), major_formatter=FuncFormatter(lambda value, _: f"{value:g}"),
        minor_formatter=NullFormatter(),
    )  # fmt: skip
    ax.set_xlabel(COST, fontsize=9)
    ax.set_ylabel("total error", fontsize=9)
    _quiet(ax)


def plot_parts(ax: Any, rows: Sequence[TotalPoint], family: str, numbers: dict[int, str]) -> None:
    """Draw the parts of the total error of each choice, one choice per row, the cheapest at the top."""
    for k, point in enumerate(rows):
        parts = point.errors[family]
        if parts is None:
            continue
        values = {name: max(getattr(parts, name), LEAST) for name in PARTS}
        ax.plot([min(values.values()), parts.total], [k, k], color="#d5d9de", lw=2.0, zorder=1, solid_capstyle="butt")
        for name, (mark, colour) in PART_STYLES.items():
            ax.plot(values[name], k, mark, color=colour, ms=5.5, zorder=3)
        ax.plot(max(parts.total, LEAST), k, "|", color=INK, ms=15, mew=2.4, zorder=4)
        ax.annotate(
            percent(parts.total), (1.0, k), xycoords=("axes fraction", "data"), xytext=(-5, 0),
            textcoords="offset points", ha="right", va="center", fontsize=8, color=INK,
        )  # fmt: skip
        number, label = numbers.get(id(point), "–"), f"{point.label}{' (default)' if point.default else ''}"
        # Each text left of the row has its right end, points from the axis, and its font weight.
        texts = (number, -7, "bold"), (rate(point.cost), -24, "normal"), (label, -76, "normal")
        for text, place, weight in texts:
            ax.annotate(
                text, (0.0, k), xycoords=("axes fraction", "data"), xytext=(place, 0), textcoords="offset points",
                ha="right", va="center", fontsize=8, color=INK, weight=weight, parse_math=False,
            )  # fmt: skip
    ax.set_yticks(range(len(rows)), [""] * len(rows))
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.set_xscale("log")
    low, high = ax.get_xlim()
    ax.set_xlim(low, high * (high / low) ** 0.2)  # room for the percentages at the right
    _percents(ax.xaxis, high)
    ax.set_xlabel("error and its parts", fontsize=9)
    beside = ", and the default" if any(id(point) not in numbers for point in rows) else ""
    ax.set_title(f"choices on the front{beside}", fontsize=9, loc="left", color=INK)
    _quiet(ax)
    ax.tick_params(axis="y", length=0)


def _height(point: TotalPoint, family: str) -> float:
    return min(point.total(family) or 0.0, FARTHEST)


def _colours() -> dict[str, str]:
    levels = bearing_levels(*MAINS)
    return {level: COLOURS[k % len(COLOURS)] for k, level in enumerate(levels)}


def _marks() -> dict[str, str]:
    return {level: MARKS[k % len(MARKS)] for k, level in enumerate(CRANKS)}


def _legend(figure: Any, points: Sequence[TotalPoint]) -> None:
    """Draw a line of legend keys below both charts of a figure."""
    from matplotlib.lines import Line2D

    def key(label: str, **style: Any) -> Any:
        return Line2D([], [], ls="none", ms=6, label=label, **style)

    bearings = [level for level in _colours() if any(p.bearings == level for p in points)]
    cranks = [level for level in _marks() if any(p.crank == level for p in points)]
    blocks = dict.fromkeys(p.block for p in points)
    keys = [key(level, marker="o", color=_colours()[level]) for level in bearings]
    keys += [key(level, marker=_marks()[level], mfc="none", mec=INK) for level in cranks]
    keys += [key(f"block {b}", marker="o", mec=INK, mfc="white" if b == "ground" else INK) for b in blocks]
    if any(p.default for p in points):
        keys.append(key("default", marker="o", mfc="none", mec=INK, mew=1.4))
        keys[-1].set_markersize(11)
    keys.append(Line2D([], [], color=INK, lw=3, alpha=0.22, label="Pareto front"))
    height = figure.get_figheight()
    style = {"fontsize": 8, "frameon": False, "handletextpad": 0.3, "borderaxespad": 0.0}
    figure.legend(
        handles=keys, loc="lower left", bbox_to_anchor=(0.012, 0.12 / height), ncols=len(keys), columnspacing=0.9,
        **style,
    )  # fmt: skip
    parts = [key("total", marker="|", color=INK, mew=2.4)]
    parts += [key(name, marker=mark, color=colour) for name, (mark, colour) in PART_STYLES.items()]
    figure.legend(
        handles=parts, loc="lower right", bbox_to_anchor=(0.985, 0.12 / height), ncols=len(parts), columnspacing=1.2,
        **style,
    )  # fmt: skip


def _percents(axis: Any, highest: float = math.inf) -> None:
    """Label the ticks of an axis in per cent, up to the value ``highest``."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(10.0, subs=(1.0, 3.0) if high / low < 1.0e3 else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{100.0 * value:g} %" if value <= highest else ""))
    axis.set_minor_formatter(NullFormatter())


def _quiet(ax: Any) -> None:
    ax.tick_params(labelsize=8, colors="#444b55")
    ax.grid(which="major", color="#e8eaee", lw=0.8, zorder=0)
    ax.set_axisbelow(True)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        ax.spines[side].set_color("#b4bac3")
