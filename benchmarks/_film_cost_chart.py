"""Chart of ``film_cost.py``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import NullFormatter

from cranktrain.film.laws.ehd import IN_LOOP
from cranktrain.store.whole_file import whole_file

FAMILIES = {
    "reynolds": ("reynolds", "#1f77b4", "o"),
    "elastic_0_shapes": ("mass-conserving, rigid bore", "#ff7f0e", "s"),
    "elastic_7_shapes": ("mass-conserving, 7 bore shapes (ehd)", "#d62728", "^"),
}
SINGLE = {"table": ("table with tilt", "#2ca02c", "D"), "impedance": ("impedance map (no tilt)", "#7f7f7f", "v")}
LEVEL_COLOURS = {"table": "#2ca02c", "reynolds": "#1f77b4", "ehd": "#d62728"}


def draw(result: dict[str, Any], path: Path) -> None:
    """Six panels: grid, error, shapes; levels, crank modes, bearings."""
    figure, axes = plt.subplots(2, 3, figsize=(15.0, 9.0), layout="constrained")
    plot_grids(axes[0, 0], result["grids"])
    plot_errors(axes[0, 1], result["grids"])
    plot_shapes(axes[0, 2], result["shapes"])
    plot_levels(axes[1, 0], result["levels"])
    plot_modes(axes[1, 1], result["crank_modes"], result["modes"])
    plot_bearings(axes[1, 2], result["bearings"])
    for ax in axes.flat:
        ax.set_axisbelow(True)
        ax.grid(which="both", alpha=0.2)
    with whole_file(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")
    plt.close(figure)


def slope(ax: Any, x: tuple[float, float], y: float, power: int, name: str) -> None:
    """Guide of a power law through (x[0], y)."""
    end = y * (x[1] / x[0]) ** power
    ax.loglog(x, (y, end), color="#555", lw=0.9, ls="--")
    ax.annotate(name, (x[1], end), textcoords="offset points", xytext=(4, -3), fontsize=8, color="#555")


def number(value: float) -> str:
    """Two significant digits, never a power of ten."""
    return f"{value:.0f}" if value >= 9.95 else f"{value:.2g}"


def ticks(axis: Any, values: list[float]) -> None:
    """Plain numbers on a logarithmic axis."""
    axis.set_minor_formatter(NullFormatter())
    axis.set_ticks(values, [f"{value:g}" for value in values])


def plot_grids(ax: Any, grids: dict[str, Any]) -> None:
    """Microseconds per film over the nodes of its grid."""
    for name, (label, colour, mark) in FAMILIES.items():
        rows = grids[name]
        ax.loglog([r["nodes"] for r in rows], [r["us"] for r in rows], marker=mark, color=colour, label=label)
        for r in rows:
            if r["in_loop"]:
                ax.plot(r["nodes"], r["us"], "o", ms=14, mfc="none", mec="black")
    for name, (label, colour, _) in SINGLE.items():
        ax.axhline(grids[name]["us"], color=colour, ls=":", label=label)
    cheapest, dearest = grids["reynolds"][0], grids["elastic_0_shapes"][-1]
    for power, name in ((1, "∝ nodes"), (2, "∝ nodes²")):
        slope(ax, (cheapest["nodes"], 0.7 * dearest["nodes"]), 0.5 * cheapest["us"], power, name)
    ticks(ax.xaxis, [100, 200, 500, 1000, 2000])
    ax.set_xlabel("nodes that carry an unknown / 1")
    ax.set_ylabel("processor time per film with tangents / µs")
    ax.set_title("Cost over the grid (ring: in the loop)", fontsize=10, loc="left")
    ax.set_ylim(0.01, 2000.0)
    ax.legend(fontsize=7.5, frameon=False, loc="lower right", ncols=2)


def plot_errors(ax: Any, grids: dict[str, Any]) -> None:
    """Error of the force over its cost."""
    for name, (label, colour, mark) in FAMILIES.items():
        rows = grids[name]
        ax.loglog([r["us"] for r in rows], [r["force_error"] for r in rows], marker=mark, color=colour, label=label)
        for r in rows:
            if r in (rows[0], rows[-1]) or r["in_loop"]:
                ax.annotate(
                    "×".join(map(str, r["grid"])), (r["us"], r["force_error"]), textcoords="offset points",
                    xytext=(8, 4), fontsize=7, color=colour,
                )  # fmt: skip
            if r["in_loop"]:
                ax.plot(r["us"], r["force_error"], "o", ms=14, mfc="none", mec="black")
    for name, (label, colour, mark) in SINGLE.items():
        row = grids[name]
        ax.loglog(row["us"], row["force_error"], marker=mark, color=colour, label=label, ls="none", ms=8)
    ax.set_xlabel("processor time per film with tangents / µs")
    ax.set_ylabel("RMS error of the force over the cycle / 1")
    ax.set_title("Error over cost, each family against its finest grid", fontsize=10, loc="left")
    ax.legend(fontsize=7.5, frameon=False, loc="lower left")


def plot_shapes(ax: Any, rows: list[dict[str, Any]]) -> None:
    """Microseconds per elastic film over the number of its shapes."""
    ax.plot([r["shapes"] for r in rows], [r["us"] for r in rows], marker="^", color=FAMILIES["elastic_7_shapes"][1])
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("bore shapes / 1")
    ax.set_ylabel("processor time per film with tangents / µs")
    grid = f"{IN_LOOP.n_phi}×{IN_LOOP.n_z}"
    ax.set_title(f"Elastic film of {grid} nodes over its local bore shapes", fontsize=10, loc="left")


def plot_levels(ax: Any, levels: dict[str, Any]) -> None:
    """Real-time factor by level, films and the rest."""
    for k, row in enumerate(levels.values()):
        for shift, part, colour in ((-0.2, "films", "#1f77b4"), (0.2, "rest", "#b0b7c0")):
            ax.bar(k + shift, row[part], 0.38, color=colour, label=part if k == 0 else None)
            ax.annotate(
                number(row[part]), (k + shift, row[part]), textcoords="offset points", xytext=(0, 2), ha="center",
                fontsize=8,
            )  # fmt: skip
    ax.axhline(1.0, color="black", lw=0.8, ls="--")
    ax.set_yscale("log")
    ax.set_ylim(top=3.0 * max(row["real_time_factor"] for row in levels.values()))
    names = [f"{level}\n{row['integrator']}\n{number(row['real_time_factor'])}" for level, row in levels.items()]
    ax.set_xticks(range(len(levels)), names)
    ax.set_ylabel("processor s per simulated s / 1")
    ax.set_title("The six at 2000 rev/min by level of its mains (sum below)", fontsize=10, loc="left")
    ax.legend(fontsize=8, frameon=False, loc="upper left")


def plot_modes(ax: Any, rows: list[dict[str, Any]], default: int) -> None:
    """Real-time factor over the number of crank modes."""
    modes = [r["modes"] for r in rows]
    for level, colour, mark in (("impedance", "#7f7f7f", "v"), ("linear", "#9467bd", "P")):
        ax.loglog(modes, [r[level] for r in rows], marker=mark, color=colour, label=f"{level} bearings")
        for r in rows:
            if r["modes"] == default:
                ax.plot(r["modes"], r[level], "o", ms=14, mfc="none", mec="black")
    for power, name in ((1, "∝ modes"), (2, "∝ modes²")):
        slope(ax, (modes[0], 1.6 * modes[0]), 0.75 * rows[0]["linear"], power, name)
    ticks(ax.xaxis, [float(m) for m in modes])
    ticks(ax.yaxis, [v for v in (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0) if ax.get_ylim()[0] < v < ax.get_ylim()[1]])
    ax.set_xlabel("modes of the crank / 1")
    ax.set_ylabel("processor s per simulated s / 1")
    ax.set_title("The six over its crank modes (ring: default)", fontsize=10, loc="left")
    ax.legend(fontsize=8, frameon=False, loc="upper left")


def plot_bearings(ax: Any, sweeps: dict[str, list[float]]) -> None:
    """Microseconds of all films over their number."""
    for level, us in sweeps.items():
        counts = list(range(1, len(us) + 1))
        ax.loglog(counts, us, marker="o", color=LEVEL_COLOURS[level], label=level)
        ax.loglog(counts, [us[0] * b for b in counts], color="#555", lw=0.9, ls="--")
    ticks(ax.xaxis, [float(b) for b in counts])
    ax.set_xlabel("bearings / 1")
    ax.set_ylabel("all films once, with tangents / µs")
    ax.set_title("Films of 1 to 7 bearings in turn (dashed: in proportion)", fontsize=10, loc="left")
    ax.legend(fontsize=8, frameon=False, loc="upper left")
