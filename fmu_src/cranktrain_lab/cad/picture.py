"""Picture of a crank found in a STEP file, from the side and along its axis, with dimensions."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.types import Array
from cranktrain.results.figures import save_figure
from cranktrain.results.plots import BLUE, GREY, INK, ORANGE, foot
from cranktrain_lab.cad.recognition import RecognisedCrank

GREEN, RED = "#3a8f5c", "#b0413e"
PALE = "#dfe3e8"


def plot_side(ax: Any, found: RecognisedCrank) -> None:
    """Draw the crank from the side: mains, pins and ends coloured, with dimensions in mm."""
    _silhouette(ax, found, (2, 1))
    size = 2.0 * found.mains[0].cylinder.radius
    for what, journals, colour in (("main", found.mains, BLUE), ("pin", found.pins, ORANGE)):
        for number, journal in enumerate(journals, 1):
            own, y = journal.cylinder, journal.cylinder.axis[1]
            ax.fill_between([own.start, own.end], y - own.radius, y + own.radius, color=colour, alpha=0.35, lw=0)
            text = f"{what}[{number}]\n{2 * own.radius:.2f} x {journal.width:.2f}"
            ax.annotate(text, (own.middle, y), ha="center", va="center", fontsize=5.5, color=INK)
    for name, cylinder, colour in (("pulley", found.nose, GREEN), ("flywheel", found.flange, RED)):
        if cylinder is not None:
            low, high = cylinder.start, cylinder.end
            ax.fill_between([low, high], -cylinder.radius, cylinder.radius, color=colour, alpha=0.35, lw=0)
            text = f"{name}\n{2 * cylinder.radius:.2f} x {high - low:.2f}"
            ax.annotate(text, (0.5 * (low + high), cylinder.radius + 0.1 * size), ha="center", fontsize=6, color=colour)
    ax.axhline(0.0, color=GREY, lw=0.6, ls="-.")
    ax.set(xlabel="z from the middle of main[1] / mm", ylabel="y / mm", aspect="equal")
    ax.set_title("RecognisedCrank: diameter x width between webs / mm", fontsize=10, loc="left")


def plot_end(ax: Any, found: RecognisedCrank) -> None:
    """Draw the crank along its axis from the flywheel: throws with their angles, deg."""
    _silhouette(ax, found, (0, 1))
    places: dict[tuple[int, int], list[int]] = {}
    for number, pin in enumerate(found.pins, 1):
        x, y = pin.cylinder.axis
        places.setdefault((round(10 * x), round(10 * y)), []).append(number)
        ax.plot([0.0, x], [0.0, y], color=ORANGE, lw=1.2)
        ax.plot(*_circle(pin.cylinder.axis, pin.cylinder.radius), color=ORANGE, lw=1.2)
    ax.plot(*_circle((0.0, 0.0), found.mains[0].cylinder.radius), color=BLUE, lw=1.2)
    for numbers in places.values():
        x, y = found.pins[numbers[0] - 1].cylinder.axis
        angle = (np.degrees(np.arctan2(-x, y)) + 0.005) % 360.0
        text = f"pin {', '.join(map(str, numbers))}\n{np.hypot(x, y):.2f} mm, {angle:.2f} deg"
        ax.annotate(text, (x, y), ha="center", va="center", fontsize=6, color=INK)
    ax.set(xlabel="x / mm", ylabel="y / mm", aspect="equal")
    ax.set_title("Throws from the flywheel's end", fontsize=10, loc="left")


def save_found(path: Path, found: RecognisedCrank, notes: Sequence[str]) -> Path:
    """Write the picture of a found crank, with notes below the drawing."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14.0, 5.2), dpi=150, layout="constrained")
    side, end = figure.subplots(1, 2, width_ratios=(2.6, 1.0))
    plot_side(side, found)
    plot_end(end, found)
    fillets = [f for one in (*found.mains, *found.pins) for f in one.fillets if f > 0.0]
    text = f"fillets {min(fillets):.2f} to {max(fillets):.2f} mm" if fillets else "no fillets"
    foot(figure, ". ".join([f"{found.solid.path.name}: {text}", *notes]))
    return save_figure(figure, path)


def _silhouette(ax: Any, found: RecognisedCrank, axes: tuple[int, int]) -> None:
    from matplotlib.collections import PolyCollection

    corners = found.solid.nodes[found.solid.triangles][:, :, list(axes)]
    ax.add_collection(PolyCollection(list(corners), facecolors=PALE, edgecolors="none", rasterized=True))
    ax.autoscale_view()


def _circle(centre: tuple[float, float], radius: float) -> tuple[Array, Array]:
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    return centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)
