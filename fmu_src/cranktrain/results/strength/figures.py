"""Pictures of a crankshaft's fatigue: safety factors at its fillets and oil bores, and Haigh's diagram."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.engine.limits import CrankStrength
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Crankshaft
from cranktrain.results.figures import save_figure
from cranktrain.results.plots import BLUE, GREY, ORANGE
from cranktrain.results.strength.fatigue import Judgement, mean_stress_factor, mean_stress_sensitivity
from cranktrain.structure.crank.shape import stations

PICTURES = ("safety_factors.png", "haigh.png")
KINDS = {"pin": "pin fillets", "main": "journal fillets", "oil_bore": "oil bores"}
COLOURS = {"pin": BLUE, "main": ORANGE, "oil_bore": "#3d8a4d"}
_STEEL, _EDGE = "#e6e9ee", "#7b838f"


def save_pictures(
    folder: Path, engine: Engine, strength: CrankStrength, places: Sequence[Judgement], title: str, haigh: bool = True
) -> list[Path]:
    """Write ``safety_factors.png`` and, with ``haigh``, ``haigh.png`` into ``folder``; returns the paths."""
    from matplotlib.figure import Figure

    c, at = engine.crankshaft, stations(engine.crankshaft)
    height = max(c.throws) + c.web_pin_radius + max(c.web_main_radius, c.counterweight_radius) + 0.11
    side = Figure(figsize=(12.0, 10.4 * height / (at.flange[1] - at.nose[0]) + 1.1), dpi=120, layout="constrained")
    ax = side.subplots()
    plot_safety(ax, c, places)
    ax.set_title(f"Safety factors against fatigue: {title}", fontsize=12, parse_math=False)
    figures = [side]
    if haigh:
        diagram = Figure(figsize=(8.0, 5.6), dpi=120, layout="constrained")
        ax = diagram.subplots()
        plot_haigh(ax, places, mean_stress_sensitivity(strength))
        ax.set_title(f"Haigh's diagram: {title}", fontsize=11, parse_math=False)
        figures.append(diagram)
    return [save_figure(figure, folder / name) for figure, name in zip(figures, PICTURES, strict=False)]


def kind_of(name: str) -> str:
    """Kind of a place from its name, ``pin``, ``main`` or ``oil_bore``."""
    return name.rpartition(".")[2]


def place_of(c: Crankshaft, name: str) -> tuple[float, float]:
    """Position of a place in the drawing, along and across the crank, m, with its throw upwards."""
    number, at, kind = int(name.partition("[")[2].partition("]")[0]), stations(c), kind_of(name)
    if kind == "oil_bore":
        return c.pin_positions[number - 1], c.throws[number - 1] + 0.5 * c.pin_diameter
    web = at.joins[number - 1]
    if kind == "pin":
        # A pin fillet is marked at its point nearest to the crank's axis, where bending stress is largest.
        return web.span[1 if web.front else 0], c.throws[web.pins[0] - 1] - 0.5 * c.pin_diameter
    return web.span[0 if web.front else 1], 0.5 * c.main_diameter


def plot_safety(ax: Any, c: Crankshaft, places: Sequence[Judgement]) -> None:
    """Draw a side view of the crank (mm), all throws upwards, with the safety factor at every place."""
    from matplotlib import colormaps, colors

    _draw_crank(ax, c)
    values = np.array([one.safety_factor for one in places])
    norm = colors.Normalize(1.0, max(3.0, min(float(values.min()) + 1.0, 6.0)))
    spots = 1e3 * np.array([place_of(c, one.name) for one in places])
    marks = ax.scatter(
        spots[:, 0], spots[:, 1], c=values, cmap=colormaps["RdYlGn"], norm=norm, s=42, zorder=4, edgecolors="#30353c",
        linewidths=0.7,
    )  # fmt: skip
    least = int(values.argmin())
    # Numbers are written in rows above and below the crank, because marks are close together.
    top, bottom = 1e3 * (max(c.throws) + c.web_pin_radius), -1e3 * max(c.web_main_radius, c.counterweight_radius)
    for k, (x, y) in enumerate(spots):
        kind = kind_of(places[k].name)
        level = {"pin": top + 6.0, "oil_bore": top + 30.0, "main": bottom - 6.0}[kind]
        up = kind != "main"
        ax.plot([x, x], [y, level], color=_EDGE, lw=0.4, zorder=3)
        ax.text(
            x, level, f"{values[k]:.2f}", rotation=90, fontsize=8, ha="center", va="bottom" if up else "top",
            fontweight="bold" if k == least else "normal",
        )  # fmt: skip
    ax.set_aspect("equal")
    ax.set(xlabel="along the crank / mm", ylim=(bottom - 35.0, top + 75.0))
    ax.set_yticks([])
    for side in ("left", "right", "top"):
        ax.spines[side].set_visible(False)
    bar = ax.figure.colorbar(marks, ax=ax, shrink=0.7, pad=0.01)
    bar.set_label("safety factor")
    ax.text(
        0.0, 1.0, f"above: pin fillets and oil bores; below: journal fillets; least {values[least]:.2f} at "
        f"{places[least].name}. All throws are drawn upwards.",
        transform=ax.transAxes, fontsize=8.5, color="#3c4654", va="top",
    )  # fmt: skip


def _draw_crank(ax: Any, c: Crankshaft) -> None:
    """Draw outlines of nose, journals, pins, webs and flange (mm)."""
    from matplotlib.patches import Rectangle

    at = stations(c)
    parts = [(at.nose, 0.0, 0.5 * c.nose_diameter), (at.flange, 0.0, 0.5 * c.flange_diameter)]
    parts += [(span, 0.0, 0.5 * c.main_diameter) for span in at.mains]
    parts += [(span, throw, 0.5 * c.pin_diameter) for span, throw in zip(at.pins, c.throws, strict=True)]
    boxes = [(span, middle - half, middle + half) for span, middle, half in parts]
    for web, heavy in zip(at.joins, c.counterweights, strict=True):
        low = c.counterweight_radius if heavy else c.web_main_radius
        throw = max(c.throws[pin - 1] for pin in web.pins)
        boxes.append((web.span, -low if web.main else throw - c.web_pin_radius, throw + c.web_pin_radius))
    for (start, end), low, high in boxes:
        corner, size = (1e3 * start, 1e3 * low), (1e3 * (end - start), 1e3 * (high - low))
        ax.add_patch(Rectangle(corner, *size, facecolor=_STEEL, edgecolor=_EDGE, lw=0.8, zorder=1))
    ax.set_xlim(1e3 * at.nose[0] - 15.0, 1e3 * at.flange[1] + 15.0)


def plot_haigh(ax: Any, places: Sequence[Judgement], sensitivity: float) -> None:
    """Draw governing cycles (MPa), and the endurable amplitude over mean stress for each kind of place."""
    for kind, words in KINDS.items():
        own = [one for one in places if kind_of(one.name) == kind and one.amplitude > 0.0]
        if not own:
            continue
        mean, amplitude = (1e-6 * np.array([getattr(one, key) for one in own]) for key in ("mean", "amplitude"))
        ax.scatter(mean, amplitude, s=26, color=COLOURS[kind], label=f"{words}, their governing cycles", zorder=3)
        line = limit_line(own[0], sensitivity)
        ax.plot(*(1e-6 * line), color=COLOURS[kind], lw=1.5, label=f"{words}, endurable")
    worst = min(places, key=lambda one: one.safety_factor)
    ax.annotate(
        f"{worst.name}: {worst.safety_factor:.2f}", (1e-6 * worst.mean, 1e-6 * worst.amplitude), fontsize=9,
        textcoords="offset points", xytext=(8, 8),
    )  # fmt: skip
    ax.axvline(0.0, color=GREY, lw=0.8)
    reach = 1.15e-6 * max(max(abs(one.mean), one.endured) for one in places)
    ax.set(xlim=(-reach, reach), ylim=(0.0, None), ylabel="stress amplitude / MPa")
    ax.set_xlabel("mean stress / MPa, von Mises along the longest range")
    ax.grid(alpha=0.25)
    ax.legend(frameon=False, fontsize=8, loc="lower left")


def limit_line(place: Judgement, sensitivity: float) -> Array:
    """Line of mean stress and endurable amplitude (2, k), Pa, of the material at a place."""
    reversed_strength = place.endured / mean_stress_factor(place.mean / place.amplitude, sensitivity)
    ratios = np.linspace(-2.0, 3.5, 111)
    amplitudes = reversed_strength * np.array([mean_stress_factor(float(ratio), sensitivity) for ratio in ratios])
    return np.stack([ratios * amplitudes, amplitudes])
