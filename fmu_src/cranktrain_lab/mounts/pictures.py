"""Pictures of an engine on its mounts: forces and motion by order over speed, start and stop in time."""

from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.results.figures import save_figure
from cranktrain.results.free_forces import largest
from cranktrain.results.plots import BLUE, ORANGE, foot
from cranktrain.results.run_up.plots import ORDER_COLOURS
from cranktrain_lab.mounts.modes import NAMES
from cranktrain_lab.mounts.study import SCALES, UNITS, Passage, Study

PICTURES = ("mount_forces.png", "mount_motion.png", "mount_start.png", "mount_stop.png")
"""File names of the pictures."""


def save_pictures(folder: Path, of: Study, passages: list[Passage]) -> list[Path]:
    """Write the pictures of a study into a ``folder``; returns their paths."""
    figures = [(PICTURES[0], forces_figure(of)), (PICTURES[1], motion_figure(of))]
    figures += [(f"mount_{one.name}.png", passage_figure(of, one)) for one in passages]
    return [save_figure(figure, folder / name) for name, figure in figures]


def forces_figure(of: Study) -> Any:
    """Force on the frame, and the largest force of a single mount, by order over speed."""
    panels = {
        "sum of all mounts on the frame": of.response.frame[:, :, None, :3],
        "largest force of one mount": of.response.mounts[..., :3],
    }
    figure, axes = _panels(len(panels), 1, (8.0, 7.0))
    for ax, (title, values) in zip(axes.flat, panels.items(), strict=True):
        sizes = [[max(map(largest, order)) for order in speed] for speed in values]
        _orders(ax, of, np.array(sizes), title, "force / N")
    return _titled(figure, of, "Forces of the mounts on the frame, zero to peak")


def motion_figure(of: Study) -> Any:
    """Motion of the engine's centre by order over speed, in six directions."""
    figure, axes = _panels(3, 2, (10.0, 8.0))
    for k, ax in enumerate(axes.T.flat):
        _orders(ax, of, SCALES[k] * np.abs(of.response.centre[:, :, k]), NAMES[k], f"amplitude / {UNITS[k]}")
    return _titled(figure, of, "Motion of the engine's centre, zero to peak")


def passage_figure(of: Study, one: Passage) -> Any:
    """Roll, bounce and the most loaded mount in time; dashed: the largest of a periodic cycle at the speed."""
    force = np.linalg.norm(one.run.mounts[:, :, :3], axis=2)
    worst = int(force.max(axis=0).argmax())
    panels: list[tuple[str, str, Array, Array]] = [
        (NAMES[k], UNITS[k], SCALES[k] * one.run.centre[:, k], SCALES[k] * one.centre[:, k]) for k in (1, 5)
    ]
    panels.append((f"force of mount {worst + 1}", "N", force[:, worst], one.mounts[:, worst]))
    figure, axes = _panels(len(panels), 1, (8.0, 8.0))
    first = float(one.run.speed[0])
    for ax, (name, unit, run, cycles) in zip(axes.flat, panels, strict=True):
        ax.plot(one.run.time, run, color=BLUE, lw=1.0)
        ax.plot((one.speeds - first) / (one.rate * RPM), cycles, color=ORANGE, lw=1.4, ls="--")
        ax.set(xlabel="time / s", ylabel=f"{name} / {unit}", xlim=(0.0, one.run.time[-1]))
        ax.grid(alpha=0.25)
    low, high = sorted((first / RPM, float(one.run.speed[-1]) / RPM))
    foot(figure, "Dashed: largest absolute value of a periodic cycle at the speed of this time.")
    return _titled(
        figure, of, f"{one.name.capitalize()}, {low:.0f} to {high:.0f} rev/min at {abs(one.rate):.0f} rev/min per s"
    )


def _panels(rows: int, columns: int, size: tuple[float, float]) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=120, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


def _orders(ax: Any, of: Study, values: Array, title: str, unit: str) -> None:
    """Draw amplitudes (s, o) over the speed."""
    for o, order in enumerate(of.orders):
        ax.plot(of.speeds / RPM, values[:, o], color=ORDER_COLOURS[o % len(ORDER_COLOURS)], lw=1.5, label=f"{order:g}")
    ax.set(xlabel="speed / rev/min", ylabel=unit, ylim=(0.0, None), xlim=(of.speeds[0] / RPM, of.speeds[-1] / RPM))
    ax.set_title(title, fontsize=10, loc="left")
    ax.grid(alpha=0.25)
    ax.legend(title="order", frameon=False, fontsize=8, title_fontsize=8)


def _titled(figure: Any, of: Study, text: str) -> Any:
    figure.suptitle(f"{of.engine.title}: {text}", fontsize=11, parse_math=False)
    return figure
