"""Pictures of bearings: polar load diagrams of a cycle, and the worst bearing over speed."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.engine.limits import BIG_END, MAIN, BearingLimits
from cranktrain.results.bearings.cycle import BearingCycle, BearingReport
from cranktrain.results.bearings.tables import FAMILIES
from cranktrain.results.figures import save_figure
from cranktrain.results.orders.harmonics import ComplexArray
from cranktrain.results.plots import BLUE, GREY, ORANGE, foot, plot_closed, wrapped

OVER_SPEED = "bearings_over_speed.png"
_COLOURS = {MAIN: BLUE, BIG_END: ORANGE}


def speed_name(speed_rpm: float) -> str:
    """Text for a speed in names of pictures."""
    return f"{speed_rpm:.0f}rpm"


def polar_names(name: str) -> tuple[str, str]:
    """File names of the polar load diagrams of one run: loads on shells, loads on journals."""
    return f"shell_loads_{name}.png", f"journal_loads_{name}.png"


def save_polar_pictures(folder: Path, report: BearingReport, name: str) -> list[Path]:
    """Write the polar load diagrams of a report, with the run's name in the file names; returns their paths."""
    rpm = report.speed / RPM
    title = f"{report.engine.title}, {rpm:.0f} rev/min"
    if name != speed_name(rpm):
        title += f" ({name})"
    figures = polar_figure(report, title, journals=False), polar_figure(report, title, journals=True)
    return [save_figure(figure, folder / file) for file, figure in zip(polar_names(name), figures, strict=True)]


def polar_figure(report: BearingReport, title: str, journals: bool) -> Any:
    """Polar load diagrams of all bearings; loads on the shells, or on the journals if ``journals`` is true."""
    from matplotlib.figure import Figure

    rows = [row for row in (report.mains, report.big_ends) if row]
    columns = max(map(len, rows))
    figure = Figure(figsize=(2.3 * columns + 1.0, 2.75 * len(rows) + 1.1), dpi=120, layout="constrained")
    axes = figure.subplots(len(rows), columns, squeeze=False)
    line: Any = None
    for row, bearings in zip(axes, rows, strict=True):
        loads = [1e-3 * (b.on_journal if journals else b.on_shell if b.on_rod is None else b.on_rod) for b in bearings]
        reach = 1.06 * max(float(np.abs(np.concatenate([load.real, load.imag])).max()) for load in loads)
        for k, ax in enumerate(row):
            if k >= len(bearings):
                ax.set_visible(False)
                continue
            line = plot_polar_load(ax, bearings[k], loads[k], reach)
            if k > 0:
                ax.set_yticklabels([])
        row[0].set_ylabel("load / kN", fontsize=9)
    bar = figure.colorbar(line, ax=axes, shrink=0.7, pad=0.01, ticks=list(range(0, 721, 120)))
    bar.set_label("crank angle / deg", fontsize=9)
    what = "journals" if journals else "shells"
    heading = wrapped(f"Loads on the {what}: {title}", figure.get_size_inches()[0], 12.0)
    figure.suptitle(heading, fontsize=12, parse_math=False)
    own = (
        "axes turn with the crank and are those at rest at crank angle 0"
        if journals
        else "mains: x across the engine, y upwards; big ends: y along the rod to its small end"
    )
    foot(figure, f"kN; {own}. Ring: crank angle 0. Dot: largest load.", 9.0)
    return figure


def plot_polar_load(ax: Any, bearing: BearingCycle, load: ComplexArray, reach: float) -> Any:
    """Draw a load (n,), kN, over a cycle, coloured by the crank angle, in a square of half width ``reach``.

    Returns the line object for a colour bar.
    """
    ax.axhline(0.0, color=GREY, lw=0.5)
    ax.axvline(0.0, color=GREY, lw=0.5)
    line = plot_closed(ax, load.real, load.imag, np.degrees(bearing.angle), lw=1.4)
    start, most = load[int(bearing.angle.argmin())], load[int(np.abs(load).argmax())]
    ax.plot(start.real, start.imag, "o", ms=6.5, mfc="none", mec="black", mew=1.0)
    ax.plot(most.real, most.imag, "o", ms=4.0, color="black")
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    ax.tick_params(labelsize=7, length=2)
    ax.grid(alpha=0.25)
    name = f"{'big end' if bearing.family == BIG_END else 'main'} {bearing.number}"
    ax.set_title(f"{name}: {abs(most):.1f} kN at {math.degrees(bearing.load.angle):.0f}°", fontsize=9)
    return line


def save_over_speed(
    folder: Path,
    title: str,
    speeds: Sequence[Mapping[str, Any]],
    limits: BearingLimits | None,
    gaps: Sequence[float] = (),
) -> Path:
    """Write a picture of the worst bearing and of friction over speed, from one :func:`bearings_dict` per speed.

    ``gaps`` are speeds without a result, rev/min, at which lines are interrupted. Returns the path.
    """
    from matplotlib.figure import Figure

    ends = [found["speed_rpm"] for found in speeds]
    places = np.searchsorted(ends, gaps)
    rpm = np.insert(np.array(ends, dtype=float), places, gaps)

    def broken(values: Sequence[float]) -> Array:
        """Values at all speeds, with NaN at the gaps."""
        return np.insert(np.array(values, dtype=float), places, math.nan)

    figure = Figure(figsize=(10.0, 7.0), dpi=120, layout="constrained")
    axes = figure.subplots(2, 2, sharex=True).ravel()
    panels = {
        "min_film_um": ("least film / µm", "film", 1e6),
        "max_pressure_mpa": ("largest film pressure / MPa", "pressure", 1e-6),
        "specific_load_mpa": ("largest specific load / MPa", "specific_load", 1e-6),
    }
    for ax, (key, (label, what, scale)) in zip(axes, panels.items(), strict=False):
        for family, words in FAMILIES.items():
            values = [found["worst"][family][key] for found in speeds]
            if values[0] is None:
                continue
            ax.plot(rpm, broken(values), "o-", ms=4, color=_COLOURS[family], label=words)
        for limit, words, colour in _limits(limits, what):
            ax.axhline(scale * limit, color=colour, ls="--", lw=1.2, label=words)
        ax.set_ylabel(label)
    for family, words in FAMILIES.items():
        powers = [found["friction_power_w"][family] for found in speeds]
        if powers[0] is not None:
            axes[3].plot(rpm, 1e-3 * broken(powers), "o-", ms=4, color=_COLOURS[family], label=f"{words} / kW")
    if speeds[0]["fmep_bar"] is not None:
        axes[3].plot(
            rpm, broken([found["fmep_bar"] for found in speeds]), "s--", ms=4, color="black", label="all, fmep / bar"
        )
    axes[3].set_ylabel("friction power / kW; fmep / bar")
    for ax in axes:
        ax.set_ylim(bottom=0.0)
        ax.grid(alpha=0.25)
        ax.legend(frameon=False, fontsize=8)
    for ax in axes[2:]:
        ax.set_xlabel("speed / rev/min")
    figure.suptitle(f"Worst bearing over speed: {title}", fontsize=12, parse_math=False)
    return save_figure(figure, folder / OVER_SPEED)


def _limits(limits: BearingLimits | None, what: str) -> list[tuple[float, str, str]]:
    """Limits (SI) with names and colours; one common limit if both families have the same."""
    found = {family: limits.of(family, what) if limits else 0.0 for family in FAMILIES}
    if found[MAIN] == found[BIG_END] != 0.0:
        return [(found[MAIN], "limit", "black")]
    return [(found[family], f"limit, {words}", _COLOURS[family]) for family, words in FAMILIES.items() if found[family]]
