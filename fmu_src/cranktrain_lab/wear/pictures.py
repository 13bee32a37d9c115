"""Pictures of a wear history: profiles of the shells, and depth, roughness, contact and friction over time."""

from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.results.figures import save_figure
from cranktrain.results.plots import foot
from cranktrain_lab.wear.records import WearHistory

PICTURES = ("wear_profiles.png", "wear_over_time.png")
SHOWN = 6
"""Largest number of times at which shell profiles are drawn."""


def save_wear_pictures(folder: Path, history: WearHistory, title: str) -> list[Path]:
    """Write ``wear_profiles.png`` and ``wear_over_time.png`` into ``folder``. Return their paths."""
    figures = profiles_figure(history, title), over_time_figure(history, title)
    return [save_figure(figure, folder / name) for name, figure in zip(PICTURES, figures, strict=True)]


def profiles_figure(history: WearHistory, title: str) -> Any:
    """Draw the relief of each shell over the width at some times."""
    from matplotlib.figure import Figure

    count = len(history.bearings)
    columns = min(count, 4)
    rows = -(-count // columns)
    figure = Figure(figsize=(3.0 * columns + 0.6, 2.5 * rows + 0.9), dpi=120, layout="constrained")
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for k, ax in enumerate(axes):
        if k >= count:
            ax.set_visible(False)
            continue
        plot_profiles(ax, history, k)
    axes[0].legend(frameon=False, fontsize=7)
    for ax in axes[::columns]:
        ax.set_ylabel("relief / um")
    figure.suptitle(f"Worn shells: {title}", fontsize=12, parse_math=False)
    foot(figure, "Deepest meridian of each shell over z/(L/2), from the pulley's end (-1) to the flywheel's (1).")
    return figure


def plot_profiles(ax: Any, history: WearHistory, bearing: int) -> None:
    """Draw the relief of one shell (by index in ``history.bearings``) at up to ``SHOWN`` times."""
    from matplotlib import colormaps

    depth = history.deepest.max(axis=1)
    wanted = np.linspace(0.0, depth[-1], SHOWN)
    shown = sorted({int(np.abs(depth - value).argmin()) for value in wanted[:-1]} | {depth.size - 1})
    for number, row in enumerate(shown):
        colour = colormaps["viridis"](0.9 * number / max(len(shown) - 1, 1))
        ax.plot(history.zeta, 1e6 * history.profile[row, bearing], color=colour, label=f"{history.hours[row]:.3g} h")
    ax.set(xlim=(-1, 1), xlabel="z / half width", title=f"main {history.bearings[bearing]:.0f}")
    ax.grid(alpha=0.25)


def over_time_figure(history: WearHistory, title: str) -> Any:
    """Draw depth, roughness, load fraction in contact, contact pressure, friction and volume of each bearing."""
    from matplotlib.figure import Figure

    drawn = (
        ("worn depth", "um", 1e6 * history.deepest), ("roughness", "um", 1e6 * history.sigma),
        ("load in contact", "%", 100.0 * history.contact_share),
        ("largest contact pressure", "MPa", 1e-6 * history.largest_pressure),
        ("friction power", "W", history.friction_power), ("worn volume", "mm3", 1e9 * history.volume),
    )  # fmt: skip
    figure = Figure(figsize=(11.0, 6.4), dpi=120, layout="constrained")
    for ax, (quantity, unit, values) in zip(figure.subplots(2, 3, sharex=True).ravel(), drawn, strict=True):
        plot_over_time(ax, history, values, quantity, unit)
    figure.axes[0].legend(frameon=False, fontsize=7)
    figure.suptitle(f"Running in: {title}", fontsize=12, parse_math=False)
    foot(figure, "Friction and contact are means over the cycle of each time; contact pressure is its largest value.")
    return figure


def plot_over_time(ax: Any, history: WearHistory, values: Any, quantity: str, unit: str) -> None:
    """Draw values of b bearings at s times, (s, b), over the time. Jumps show changes of speed in the schedule."""
    for k, number in enumerate(history.bearings):
        ax.plot(history.hours, values[:, k], lw=1.4, label=f"main {number:.0f}")
    ax.set(xlabel="time / h", ylabel=f"{quantity} / {unit}")
    ax.set_xlim(0.0, max(float(history.hours[-1]), 1e-9))
    ax.grid(alpha=0.25)
