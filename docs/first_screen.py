"""The two pictures of README's first screen; ``docs/figures.py first_screen`` makes their data and draws them.

Orders of the pulley's torsion over speed with the published critical speeds, and total error against cost.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import cranktrain as ct
from cranktrain.engine.model import Engine
from cranktrain.results.figures import save_figure
from cranktrain.results.orders.resonances import peaks
from cranktrain.results.plots import CYCLE_COLOURS, GREY, INK
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.studies.total_error.point import TotalPoint, at_scene
from cranktrain.studies.total_error.shipped import shipped

SIZE, DPI = (6.4, 5.2), 150
RUN_UPS = {
    "diesel_i6": ("In-line six, published: measured on the engine", "--from 1000 --to 2600 --step 20"),
    "diesel_v8": ("V8, published: computed by the reference", "--from 1000 --to 2400 --step 20"),
}
"""Engines of the first picture: what is published of them, and the run-up that is set beside it."""
SCENE, FAMILY = "diesel_i6 2000", "torsion"
NAMED = {
    "torsional/held/ground": "discs on a shaft",
    "solid/impedance/ground": "finite elements on quick films",
    "solid/impedance/flexible": "and a flexible block",
    "solid/table/flexible": "and films with tilt",
    "solid/ehd/flexible": "and elastic bores, oil kept",
    "solid/ehd:fine/flexible": "and finer films",
}
"""Levels that are named in the second picture: each adds to the one before."""


def result_file(root: Path, name: str) -> Path:
    """Where the run-up of an engine is kept."""
    return root / "out" / f"{name}_critical.h5"


def draw(root: Path) -> list[Path]:
    """Draw both pictures into docs/ from the run-ups in out/ and from the total errors that ship."""
    made = [save_figure(critical_speeds(root), root / "docs" / "critical_speeds.png")]
    points = shipped(ct.load_engine("diesel_i6"))
    if points is None:
        raise SystemExit("first_screen: the figures of total errors are of another engine file; run total_error first")
    figure = error_against_cost(at_scene(points.points, SCENE))
    return [*made, save_figure(figure, root / "docs" / "error_and_cost.png")]


def _figure(rows: int) -> Any:
    """An empty figure with axes one below the other, and its axes."""
    figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
    axes = figure.subplots(rows, 1, squeeze=False)[:, 0]
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.grid(color="#e6e8ec", lw=0.6)
        ax.tick_params(labelsize=9, colors=INK)
    return figure, axes


def critical_speeds(root: Path) -> Any:
    """Orders over speed of both engines, with published critical speeds."""
    figure, axes = _figure(len(RUN_UPS))
    for ax, (name, (title, _)) in zip(axes, RUN_UPS.items(), strict=True):
        plot_orders_and_published(ax, ct.load_engine(name), result_file(root, name))
        ax.set_title(title, fontsize=10.5, loc="left", color=INK)
    axes[-1].set_xlabel("speed / (rev/min)", fontsize=10)
    figure.suptitle("Critical speeds: dashed published, lines computed in motion", fontsize=12, x=0.01, ha="left")
    return figure


def published_speeds(engine: Engine) -> dict[float, float]:
    """Published critical speeds, rev/min, by order: measured ones where there are any."""
    stated = engine.published
    measured = np.array(stated.measured_critical_speeds)
    speeds = measured if measured.any() else np.array(stated.critical_speeds)
    return dict(zip(stated.critical_orders, (speeds * 30.0 / np.pi).tolist(), strict=True))


def found_peak(run_up: RunUp, order: float, published: float) -> float:
    """Speed, rev/min, of the peak of an order that lies nearest to the published one."""
    found = (peak.speed * 30.0 / np.pi for peak in peaks(run_up) if peak.order == order)
    return min(found, key=lambda rpm: abs(rpm - published))


def plot_orders_and_published(ax: Any, engine: Engine, place: Path) -> None:
    """Orders with published critical speeds, mdeg; a dashed line at each, and by how much the peak is off."""
    run_up, stored = ct.load_run(place), RunUp.load(place)
    speeds = np.asarray(run_up.speeds_rpm)
    orders = [(q, rpm) for q, rpm in published_speeds(engine).items() if speeds[0] < rpm < speeds[-1]]
    highest = 0.0
    for (order, published), colour in zip(orders, CYCLE_COLOURS, strict=False):
        amplitude = 1e3 * np.asarray(run_up["pulley.torsion", order].to("deg"))
        ax.plot(speeds, amplitude, color=colour, lw=1.5)
        found, highest = found_peak(stored, order, published), max(highest, float(amplitude.max()))
        ax.axvline(published, color=colour, lw=1.1, ls=(0, (4, 3)))
        note = f"order {order:g}\n{published:.0f}\n{found / published - 1.0:+.1%}".replace("-", "−")
        ax.annotate(
            note, (published, 1.0), xycoords=("data", "axes fraction"), xytext=(3, -2), textcoords="offset points",
            fontsize=8.5, color=colour, va="top",
        )  # fmt: skip
    ax.set_xlim(speeds[0], speeds[-1])
    ax.set_ylim(0.0, 1.6 * highest)
    ax.set_ylabel("torsion of the pulley / mdeg", fontsize=9)


def error_against_cost(points: Sequence[TotalPoint]) -> Any:
    """Total error of torsion over the processor time of a simulated second, the levels of a ladder named."""
    figure, (ax,) = _figure(1)
    known = [(p, p.cost, p.total(FAMILY)) for p in points if p.total(FAMILY)]
    ax.loglog([cost for _, cost, _ in known], [100.0 * error for *_, error in known], ".", color="#c3c8d0", ms=6)
    front = sorted((cost, 100.0 * error) for point, cost, error in known if FAMILY in point.front)
    ax.plot(*zip(*front, strict=True), color=GREY, lw=2.0, alpha=0.6, drawstyle="steps-post")
    _name_levels(ax, known)
    ax.set_xlabel("processor seconds per simulated second", fontsize=10)
    ax.set_ylabel("total error of the pulley's torsion / %", fontsize=10)
    ax.xaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_major_formatter("{x:g}")
    ax.set_title("Six at 2000 rev/min, against the best model", fontsize=10.5, loc="left", color=INK)
    figure.suptitle("Total error against cost", fontsize=12, x=0.01, ha="left")
    return figure


def _name_levels(ax: Any, known: Sequence[tuple[TotalPoint, float, float]]) -> None:
    """Mark the cheapest step of each named level, with error and cost in the legend; a ring round the default."""
    for number, (levels, words) in enumerate(NAMED.items()):
        cost, error = min((cost, 100.0 * error) for point, cost, error in known if point.levels == levels)
        label = f"{words}: {error:.2g} %, {cost:.2g} s/s"
        ax.plot([cost], [error], "o", color=CYCLE_COLOURS[number], ms=7.5, zorder=3, label=label)
    for point, cost, error in known:
        if point.default:
            label = f"default, {point.step_deg:g}°: {100.0 * error:.2g} %, {cost:.2g} s/s"
            ax.plot([cost], [100.0 * error], "o", ms=14, mfc="none", mec=INK, mew=1.6, ls="none", label=label)
    ax.legend(loc="lower left", fontsize=8.5, frameon=False, labelcolor=INK, title="cheapest step of", alignment="left")
