"""Figures of the crankshaft's surface coloured by von Mises stress, seen from above the pulley."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array
from cranktrain.results.figures import save_figure
from cranktrain.results.strength.stress import CrankStress

STRESS_PICTURES = ("stresses.png", "stress_envelope.png")
SHOWN_DEG = tuple(range(0, 720, 90))
"""Crank angles of the pictures, deg, as in figure 7.7 of the reference."""
COLOURS = "turbo"
_TURN, _LEAN = math.radians(28.0), math.radians(22.0)
_HOTTEST = 5
"""Number of hot spots labelled in the picture of the envelope."""


def save_stress_pictures(folder: Path, stress: CrankStress, title: str) -> list[Path]:
    """Write pictures of the surface at eight crank angles and of the envelope into ``folder``; returns the paths."""
    figures = (cycle_figure(stress, title), envelope_figure(stress, title))
    return [save_figure(figure, folder / name) for name, figure in zip(STRESS_PICTURES, figures, strict=True)]


def cycle_figure(stress: CrankStress, title: str) -> Any:
    """Figure of the von Mises stress at 0, 90 … 630° on one scale, with the crank drawn at its crank angle."""
    from matplotlib.figure import Figure

    samples = np.array([stress.nearest(math.radians(angle)) for angle in SHOWN_DEG])
    values = 1e-6 * stress.von_mises(samples)
    top = float(np.quantile(values, 0.999))
    figure = Figure(figsize=(13.0, 12.0), dpi=130, layout="constrained")
    axes = figure.subplots(4, 2)
    for ax, sample, angle, value in zip(axes.T.flat, samples, SHOWN_DEG, values, strict=True):
        colours = draw_surface(ax, stress, value, top, float(stress.angle[sample]))
        ax.set_title(f"{angle}°, greatest {value.max():.0f} MPa", fontsize=10)
    bar = figure.colorbar(colours, ax=axes, shrink=0.5, aspect=40, extend="max", pad=0.02)
    bar.set_label("von Mises stress / MPa")
    figure.suptitle(f"Stress of the crankshaft: {title}", fontsize=12, parse_math=False)
    return figure


def envelope_figure(stress: CrankStress, title: str) -> Any:
    """Figure of each node's greatest von Mises stress over the cycle with hot spots, and its maximum over angle."""
    from matplotlib.figure import Figure

    envelope = 1e-6 * stress.envelope[0]
    figure = Figure(figsize=(11.5, 9.0), dpi=130, layout="constrained")
    above, below = figure.subplots(2, 1, height_ratios=(2.2, 1.0))
    colours = draw_surface(above, stress, envelope, float(np.quantile(envelope, 0.999)), 0.0)
    figure.colorbar(colours, ax=above, shrink=0.8, extend="max").set_label("greatest von Mises stress / MPa")
    spots = stress.hot_spots()[:_HOTTEST]
    place = projected(np.array([spot.place for spot in spots]), 0.0)
    for k, (spot, (x, y, _)) in enumerate(zip(spots, place, strict=True)):
        above.plot(x, y, "o", mfc="none", mec="black", ms=9)
        above.annotate(str(k + 1), (x, y), xytext=(7, 7), textcoords="offset points", fontsize=9, weight="bold")
        text = f"{k + 1}  {spot.feature}: {1e-6 * spot.stress:.0f} MPa at {math.degrees(spot.angle):.0f}°"
        above.text(0.0, -0.04 - 0.055 * k, text, transform=above.transAxes, fontsize=9, va="top")
    below.plot(np.degrees(stress.angle), 1e-6 * stress.greatest[0], color="#1f5fa8")
    below.set(xlim=(0, 720), xticks=range(0, 721, 90), xlabel="crank angle / deg")
    below.set_ylabel("greatest von Mises / MPa")
    below.grid(color="#d8dde3", linewidth=0.6)
    figure.suptitle(f"Stress of the crankshaft over the cycle: {title}", fontsize=12, parse_math=False)
    return figure


def projected(points: Array, angle: float) -> Array:
    """Coordinates (s, 3) in the picture, m: right, up, towards the viewer; the crank is rotated by ``angle`` rad."""
    x = math.cos(angle) * points[:, 0] - math.sin(angle) * points[:, 1]
    y = math.sin(angle) * points[:, 0] + math.cos(angle) * points[:, 1]
    right = math.cos(_TURN) * points[:, 2] - math.sin(_TURN) * x
    near = -math.sin(_TURN) * points[:, 2] - math.cos(_TURN) * x
    cos, sin = math.cos(_LEAN), math.sin(_LEAN)
    return np.column_stack((right, cos * y - sin * near, sin * y + cos * near))


def draw_surface(ax: Any, stress: CrankStress, values: NDArray[Any], top: float, angle: float) -> Any:
    """Draw the surface coloured by ``values`` (s,) up to ``top``; returns the object for a colour bar."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    place = projected(stress.surface.points, angle)
    corners = place[stress.surface.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    facing = normal[:, 2] / np.where(size > 0.0, size, 1.0)
    seen = np.flatnonzero(facing > 0.0)
    seen = seen[np.argsort(corners[seen, :, 2].mean(axis=1))]
    scale = ScalarMappable(Normalize(0.0, top), colormaps[COLOURS])
    colour = scale.to_rgba(values[stress.surface.triangles[seen]].mean(axis=1))
    colour[:, :3] *= (0.55 + 0.45 * facing[seen])[:, None]
    polygons = PolyCollection(list(corners[seen, :, :2]), facecolors=colour, edgecolors=colour, linewidths=0.2)
    ax.add_collection(polygons)
    low, high = place[:, :2].min(axis=0), place[:, :2].max(axis=0)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    ax.axis("off")
    return scale
