"""Picture of a study: percentiles over the speed or distributions, sensitivities of outputs, and the Pareto front."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from cranktrain.results.run_up.plot_data import figure_of
from cranktrain_lab.variants.results import statistics

MOST_OUTPUTS, MOST_VALUES = 6, 12
"""Largest numbers of outputs in a figure, and of values per output."""
BLUE, LIGHT, RED = "#2b6ca3", "#9cc3e3", "#b5403a"
SHOWN = {"rad": ("deg", 180.0 / math.pi), "Pa": ("MPa", 1e-6), "m": ("um", 1e6)}
"""Customary engineering unit of each SI unit, and factor from the SI unit to the customary unit."""


def variants_figure(variants: Any) -> Any:
    """Draw the figure of :class:`.variants.Variants`: percentiles, sensitivities, and the Pareto front."""
    outputs = variants.outputs[:MOST_OUTPUTS]
    front = tuple(variants.about["pareto"])
    rows = len(outputs) + bool(front)
    bars = min(len(variants.names), MOST_VALUES)
    figure = figure_of(11.0, rows * max(2.6, 0.7 + 0.26 * bars) + 0.5)
    axes = figure.subplots(rows, 2, squeeze=False, width_ratios=(1.6, 1.0))
    found = variants.sensitivities()
    for (left, right), name in zip(axes, outputs, strict=False):
        unit, factor = shown_unit(variants.output(name).unit)
        label = name if unit == "1" else f"{name} / {unit}"
        if variants.output(name).over_speed and variants.speeds_rpm.size > 1:
            least, low, middle, high, most = factor * variants.percentiles(name, (5, 25, 50, 75, 95))
            left.fill_between(variants.speeds_rpm, least, most, color=LIGHT, alpha=0.45, lw=0, label="5 to 95 %")
            left.fill_between(variants.speeds_rpm, low, high, color=LIGHT, lw=0, label="25 to 75 %")
            left.plot(variants.speeds_rpm, middle, color=BLUE, lw=1.6, label="median")
            left.set(xlabel="speed / (rev/min)", ylabel=label, xlim=(variants.speeds_rpm[0], variants.speeds_rpm[-1]))
            left.legend(frameon=False, fontsize=7, ncols=3, loc="best")
            left.grid(alpha=0.25)
        else:
            values = factor * variants[name]
            good = values[np.isfinite(values)]
            left.hist(good, bins="auto" if np.ptp(good) > 0.0 else 1, color=LIGHT) if good.size else None
            for share, line in zip(
                np.percentile(good, (5, 50, 95)) if good.size else (), ("--", "-", "--"), strict=False
            ):
                left.axvline(share, color=BLUE, ls=line, lw=1.2)
            left.set(xlabel=f"{label}; lines: 5, 50, 95 %", ylabel="variants")
            left.grid(alpha=0.25)
        _draw_sensitivities(right, found[name], name)
    if front:
        _draw_front(axes[-1], variants, front)
    about = variants.about
    lost = f", {len(variants.failed)} failed" if variants.failed else ""
    left_out = len(variants.outputs) - len(outputs)
    more = f"; {left_out} outputs more are not drawn" if left_out else ""
    title = f"{about['title']}: {len(variants)} variants of {about['engine']}, {about['method']}{lost}{more}"
    figure.suptitle(title, fontsize=11, parse_math=False)
    return figure


def _draw_sensitivities(ax: Any, records: Sequence[dict[str, Any]], name: str) -> None:
    """Draw bars of Sobol indices or of rank regression coefficients, the largest on top."""
    sobol = "total" in records[0]
    key = "total" if sobol else "rank_coefficient"
    shown = sorted(records, key=lambda record: abs(np.nan_to_num(record[key])))[-MOST_VALUES:]
    places = np.arange(len(shown))
    sizes = [np.nan_to_num(record[key]) for record in shown]
    if sobol:
        ax.barh(places + 0.19, sizes, 0.36, color=LIGHT, xerr=[record["total_error"] for record in shown],
                error_kw={"lw": 0.8}, label="total")  # fmt: skip
        first = [record["first"] for record in shown]
        ax.barh(places - 0.19, first, 0.36, color=BLUE,
                xerr=[one["first_error"] for one in shown], error_kw={"lw": 0.8}, label="first order")  # fmt: skip
        ax.legend(frameon=False, fontsize=7, loc="lower right")
        ax.set(xlim=(min(0.0, *sizes), None), xlabel=f"Sobol indices of {name}")
    else:
        ax.barh(places, sizes, 0.6, color=[BLUE if size >= 0.0 else RED for size in sizes])
        ax.axvline(0.0, color="0.3", lw=0.8)
        ax.set(xlim=(-1.05, 1.05), xlabel=f"rank regression coefficients for {name}")
    ax.set_yticks(places, [record["value"] for record in shown], fontsize=7)
    ax.grid(alpha=0.25, axis="x")


def _draw_front(axes: Any, variants: Any, names: tuple[str, ...]) -> None:
    """Draw variants in the planes of the first two outputs and of the first and last output, with the front marked."""
    costs = np.stack([variants[name] for name in names], axis=1)
    front = statistics.pareto_front(costs)
    for ax, other in zip(axes, (1, len(names) - 1), strict=True):
        if ax is axes[1] and len(names) == 2:
            ax.set_axis_off()
            continue
        labels, scaled = [], []
        for k in (0, other):
            unit, factor = shown_unit(variants.output(names[k]).unit)
            labels.append(names[k] if unit == "1" else f"{names[k]} / {unit}")
            scaled.append(factor * costs[:, k])
        ax.plot(*scaled, ".", color=LIGHT, ms=3, label="variants")
        line = "o-" if len(names) == 2 else "o"
        ax.plot(scaled[0][front], scaled[1][front], line, color=RED, ms=4, lw=1.0, label=f"Pareto front, {front.size}")
        ax.set(xlabel=labels[0], ylabel=labels[1])
        ax.legend(frameon=False, fontsize=7)
        ax.grid(alpha=0.25)


def shown_unit(unit: str) -> tuple[str, float]:
    """Return the customary unit of an output, and the factor from SI."""
    return SHOWN.get(unit, (unit, 1.0))
