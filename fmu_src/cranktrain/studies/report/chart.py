"""Curves as inline SVG that prints; where scripts run, the page reads values out under the pointer."""

from __future__ import annotations

import html
import json
import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from cranktrain.core.types import Array

WIDTH, HEIGHT = 680, 360
LEFT, RIGHT, TOP, BOTTOM = 72, 660, 14, 308
COLOURS = ("#1f5a94", "#d9822b", "#3b8f3b", "#b5373b", "#7b52ab", "#5f6b73", "#c2459a", "#1b9aa0")
NAMED = 7
"""Curves that a chart names; the others are thin and grey."""
GREY = "#b9c0c8"
MEASURED = "measured"
_MORE = {
    "others": f"<i style='background:{GREY}'></i>",
    MEASURED: "<i style='width:.6em;height:.6em;border:.1em solid #444e5a;border-radius:50%'></i>",
}
"""What stands before the names of things that have no colour of their own."""


class Axis(NamedTuple):
    """Quantity along an axis, with its unit, and the ends of what is shown."""

    label: str
    low: float
    high: float
    step: float = 0.0
    """Distance of the numbers; 0 leaves it open."""

    def ticks(self) -> list[float]:
        """Round values along the axis, about six."""
        span = self.high - self.low
        rough = span / 6.0
        power = 10.0 ** math.floor(math.log10(rough))
        step = self.step or next(m * power for m in (1.0, 2.0, 2.5, 5.0, 10.0) if m * power >= rough)
        first = math.ceil(self.low / step - 1e-9)
        return [k * step for k in range(first, math.floor(self.high / step + 1e-9) + 1)]


def line_chart(
    title: str,
    x: Array,
    curves: Mapping[str, Array],
    labels: tuple[str, str],
    step: float = 0.0,
    colours: Sequence[str] = COLOURS,
    points: Mapping[str, tuple[Array, Array]] = MappingProxyType({}),
) -> str:
    """A figure of curves (n,) over x (n,), increasing; the first NAMED in colours, in the order given.

    Parameters
    ----------
    title : caption, and what the picture is for those who do not see it
    labels : of both axes, with units
    step : of the numbers along x; 0 leaves it open
    colours : of the curves that are named
    points : measured x (k,) and y (k,) of curves, by their names
    """
    within = {name: _within(x, *measured) for name, measured in points.items()}
    every = [*curves.values(), *(y for _, y in within.values())]
    values = np.concatenate([np.asarray(y, dtype=float) for y in every])
    low, high = min(0.0, float(np.nanmin(values))), max(0.0, float(np.nanmax(values)))
    room = 0.06 * (high - low or 1.0)
    across = Axis(labels[0], float(x[0]), float(x[-1]), step)
    up = Axis(labels[1], low - (room if low < 0.0 else 0.0), high + room)
    parts = [*_frame(across, up)]
    for k, (name, y) in reversed(list(enumerate(curves.items()))):
        colour, thickness = (colours[k], 1.8) if k < NAMED else (GREY, 0.8)
        for corners in _pieces(across, up, x, y):
            parts.append(
                f'<polyline points="{corners}" fill="none" stroke="{colour}" stroke-width="{thickness}">'
                f"<title>{html.escape(name)}</title></polyline>"
            )
    for k, name in enumerate(curves):
        colour = colours[k] if k < NAMED else GREY
        for place, value in zip(*(values.tolist() for values in within.get(name, ())), strict=True):
            parts.append(
                f'<circle cx="{_x(across, place)}" cy="{_y(up, value)}" r="3.5" fill="white" stroke="{colour}" '
                f'stroke-width="1.6"><title>{html.escape(name)}, measured</title></circle>'
            )
    named = dict(list(curves.items())[:NAMED])
    more = ["others"] * (len(curves) > NAMED) + [MEASURED] * any(x.size for x, _ in within.values())
    return _figure(title, parts, across, x, named, colours, more)


def bar_chart(title: str, x: Array, bars: Mapping[str, Array], labels: tuple[str, str]) -> str:
    """A figure of groups of bars (n,) at even places x (n,), up to ``NAMED`` a group; ``labels`` as of lines."""
    pitch = float(x[1] - x[0])
    across = Axis(labels[0], float(x[0]) - pitch, float(x[-1]) + pitch, 2.0 * pitch)
    up = Axis(labels[1], 0.0, 1.06 * max(max(float(np.nanmax(y)) for y in bars.values()), 1e-30))
    width, foot = 0.8 * pitch / len(bars), _y(up, 0.0)
    parts = [*_frame(across, up)]
    for k, (name, y) in enumerate(bars.items()):
        for place, value in zip((x + (k - 0.5 * len(bars)) * width).tolist(), y.tolist(), strict=True):
            if value > 0.0:
                left, top = _x(across, place), _y(up, value)
                parts.append(
                    f'<rect x="{left}" y="{top}" width="{_x(across, place + width) - left:.1f}" '
                    f'height="{foot - top:.1f}" fill="{COLOURS[k]}"><title>{html.escape(name)}</title></rect>'
                )
    return _figure(title, parts, across, x, bars, COLOURS)


def _figure(
    title: str,
    parts: list[str],
    across: Axis,
    x: Array,
    named: Mapping[str, Array],
    colours: Sequence[str],
    more: Sequence[str] = (),
) -> str:
    """A figure with the key of its colours and what the page's script reads out; ``more``: what is in it besides."""
    pairs = zip(colours, named, strict=False)
    keys = "".join(f'<span><i style="background:{colour}"></i>{html.escape(name)}</span>' for colour, name in pairs)
    grey = "".join(f"<span>{_MORE[what]}{what}</span>" for what in more)
    data = {
        "x": [float(f"{v:.6g}") for v in x],
        "y": {name: [float(f"{v:.4g}") if math.isfinite(v) else None for v in y] for name, y in named.items()},
        "span": [across.low, across.high, LEFT, RIGHT, WIDTH],
        "label": across.label,
    }
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    return (
        f'<figure class="chart"><div class="scroll"><svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'aria-label="{html.escape(title)}">{"".join(parts)}<line class="cursor" x1="0" x2="0" y1="{TOP}" '
        f'y2="{BOTTOM}"/></svg></div><div class="keys">{keys}{grey}</div><div class="readout" aria-live="off"></div>'
        f'<figcaption>{html.escape(title)}</figcaption><script type="application/json">{text}</script></figure>'
    )


def _within(x: Array, places: Array, values: Array) -> tuple[Array, Array]:
    """Points between the ends of an axis."""
    inside = (places >= x[0]) & (places <= x[-1])
    return places[inside], values[inside]


def _frame(across: Axis, up: Axis) -> list[str]:
    """Grid, numbers and labels."""
    parts = []
    for tick in across.ticks():
        place = _x(across, tick)
        parts.append(f'<line class="grid" x1="{place}" x2="{place}" y1="{TOP}" y2="{BOTTOM}"/>')
        parts.append(f'<text x="{place}" y="{BOTTOM + 22}" text-anchor="middle">{tick:g}</text>')
    for tick in up.ticks():
        place = _y(up, tick)
        parts.append(f'<line class="grid" x1="{LEFT}" x2="{RIGHT}" y1="{place}" y2="{place}"/>')
        parts.append(f'<text x="{LEFT - 7}" y="{place + 4:.1f}" text-anchor="end">{float(f"{tick:.3g}"):g}</text>')
    middle = 0.5 * (TOP + BOTTOM)
    parts.append(
        f'<text x="{0.5 * (LEFT + RIGHT)}" y="{HEIGHT - 10}" text-anchor="middle">{html.escape(across.label)}</text>'
    )
    turned = f'transform="rotate(-90 14 {middle})"'
    parts.append(f'<text x="14" y="{middle}" text-anchor="middle" {turned}>{html.escape(up.label)}</text>')
    return parts


def _pieces(across: Axis, up: Axis, x: Array, y: Array) -> list[str]:
    """Points of a curve, in pieces where values are missing."""
    finite = np.isfinite(y)
    breaks = np.flatnonzero(np.diff(finite.astype(int))) + 1
    runs = [part for part in np.split(np.arange(len(x)), breaks) if finite[part[0]]]
    return [" ".join(f"{_x(across, x[k])},{_y(up, y[k])}" for k in part) for part in runs]


def _x(axis: Axis, value: float) -> float:
    return round(LEFT + (RIGHT - LEFT) * (value - axis.low) / (axis.high - axis.low), 1)


def _y(axis: Axis, value: float) -> float:
    return round(BOTTOM - (BOTTOM - TOP) * (value - axis.low) / (axis.high - axis.low), 1)
