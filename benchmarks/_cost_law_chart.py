"""Picture of ``cost_law.py``: cost against each size, with the fitted law, and variants extrapolated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import NullFormatter

from cranktrain.store.whole_file import whole_file

PANELS = {
    "modes": ("Modes of the solid crank", "modes", "ms a cycle"),
    "ports": ("Ports: 2 to 12 cylinders, springs as bearings", "ports", "ms a cycle"),
    "films": ("Films solved online: 2 to 8 cylinders", "films", "ms a cycle"),
    "grid": ("Grid of the six's films solved online", "nodes of a film", "ms a cycle"),
    "speeds": ("Speeds of a run-up, beam crank", "speeds", "processor s"),
}
COLOURS = ("#1f77b4", "#17becf", "#d62728", "#7f7f7f")


def draw(found: dict[str, Any], path: Path) -> None:
    """Five laws and the variants."""
    figure, axes = plt.subplots(2, 3, figsize=(14.0, 8.0), layout="constrained")
    for ax, (name, (title, size, cost)) in zip(axes.flat, PANELS.items(), strict=False):
        plot_law(ax, found[name], 1e3 if cost.startswith("ms") else 1.0)
        ax.set(title=title, xlabel=size, ylabel=cost)
    plot_variants(axes.flat[-1], found["variants"]["extrapolated"])
    for ax in axes.flat:
        ax.set_axisbelow(True)
        ax.grid(which="both", alpha=0.2)
    with whole_file(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")
    plt.close(figure)


def plot_law(ax: Any, law: dict[str, Any], scale: float) -> None:
    """Measured points and their straight line."""
    sizes, costs = np.array(law["sizes"], dtype=float), scale * np.array(law["seconds"])
    slope = law["exponent"]
    level = np.exp(np.mean(np.log(costs) - slope * np.log(sizes)))
    ax.loglog(sizes, costs, "o", color="#1f77b4")
    error = law["standard_error"]
    label = f"exponent {slope:.2f}" + ("" if error is None else f" ± {error:.2f}")
    ax.loglog(sizes, level * sizes**slope, "--", color="#555", lw=1.0, label=label)
    ax.legend(loc="upper left", frameon=False)
    plain_ticks(ax.xaxis, sizes)
    low, high = costs.min(), costs.max()
    ax.set_ylim(low / 1.3, high * 1.6)
    plain_ticks(ax.yaxis, nice(low / 1.3, high * 1.6))


def plot_variants(ax: Any, hours: dict[str, dict[str, float]]) -> None:
    """Processor time against the number of variants; measured where 20 are, a line beyond."""
    for (name, row), colour in zip(hours.items(), COLOURS, strict=True):
        counts = np.array([1.0, row["measured"], 10_000.0])
        cost = counts * row["seconds_each"] / 3600.0
        ax.loglog(
            counts[:2],
            cost[:2],
            "-" if row["measured"] > 1 else "o",
            color=colour,
            lw=2.0,
            label=f"{name}: {hours_of(cost[-1])}",
        )
        ax.loglog(counts[1:], cost[1:], ":", color=colour, lw=2.0)
        ax.plot(counts[-1], cost[-1], "s", color=colour, ms=5)
    ax.set(title="Variants: measured (lines), extrapolated (dots)", xlabel="variants", ylabel="processor hours")
    ax.legend(loc="upper left", fontsize=8, frameon=False)
    low, high = ax.get_ylim()
    ax.set_ylim(low, 30.0 * high)
    ax.set_xlim(0.8, 2e4)
    ax.set_xticks([1, 20, 100, 1000, 10_000], ["1", "20", "100", "1000", "10 000"])
    ax.xaxis.set_minor_formatter(NullFormatter())


def hours_of(hours: float) -> str:
    """Two digits, or whole hours."""
    return f"{hours:.2g} h" if hours < 10.0 else f"{hours:.0f} h"


def nice(low: float, high: float) -> list[float]:
    """Round numbers between two values, more of them where these are close."""
    digits = (1, 2, 5) if high > 20.0 * low else (1, 1.5, 2, 3, 4, 5, 7)
    values = [digit * 10.0**power for power in range(-4, 6) for digit in digits]
    return [value for value in values if low <= value <= high]


def plain_ticks(axis: Any, values: Any) -> None:
    """Plain numbers on a logarithmic axis."""
    axis.set_minor_formatter(NullFormatter())
    axis.set_minor_locator(plt.NullLocator())
    axis.set_ticks(values, [f"{value:g}" for value in values])
