"""Charts as inline SVG, which can be printed; with scripts the page shows the values at the pointer."""

import base64
import html
import json
import math
import struct
import zlib
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array

WIDTH, HEIGHT = 680, 360
LEFT, RIGHT, TOP, BOTTOM = 72, 660, 14, 308
COLOURS = ("#1f5a94", "#d9822b", "#3b8f3b", "#b5373b", "#7b52ab", "#5f6b73", "#c2459a", "#1b9aa0")
NAMED = 7
"""Largest number of curves with a name and colour in a chart; all others are thin and grey."""
GREY = "#b9c0c8"
MEASURED = "measured"
MAP_COLOURS = ((255, 255, 255), (205, 225, 240), (107, 174, 214), (33, 113, 181), (8, 48, 107), (60, 0, 60))
"""Colours of a map from the least to the largest value, even on a logarithmic scale."""
_MORE = {
    "others": f"<i style='background:{GREY}'></i>",
    MEASURED: "<i style='width:.6em;height:.6em;border:.1em solid #444e5a;border-radius:50%'></i>",
}
"""Text before names that have no colour of their own."""


class Axis(NamedTuple):
    """Axis of a chart: quantity, unit, and range."""

    label: str
    low: float
    high: float
    step: float = 0.0
    """Distance between numbers along the axis; 0: chosen automatically."""
    log: bool = False

    def ticks(self) -> list[float]:
        """About six round values along the axis; powers of ten on a logarithmic axis."""
        if self.log:
            first, last = (math.log10(end) for end in (self.low, self.high))
            return [10.0**k for k in range(math.ceil(first - 1e-9), math.floor(last + 1e-9) + 1)]
        span = self.high - self.low
        rough = span / 6.0
        power = 10.0 ** math.floor(math.log10(rough))
        step = self.step or next(m * power for m in (1.0, 2.0, 2.5, 5.0, 10.0) if m * power >= rough)
        first = math.ceil(self.low / step - 1e-9)
        return [k * step for k in range(first, math.floor(self.high / step + 1e-9) + 1)]


class Switches(NamedTuple):
    """Switches of a chart of amplitudes, logarithmic scale and peak to peak, with their first positions."""

    log: bool = False
    peak_to_peak: bool = False


LARGEST, LEAST = 1e300, 1e-290
"""Largest value that is drawn, and least range of an axis, so that no coordinate overflows."""
DECADES = 3.0
"""Range (decades) of a logarithmic scale of amplitudes below the largest one."""


def line_chart(
    title: str,
    x: Array,
    curves: Mapping[str, Array],
    labels: tuple[str, str],
    step: float = 0.0,
    colours: Sequence[str] = COLOURS,
    points: Mapping[str, tuple[Array, ...]] = MappingProxyType({}),
    switches: Switches | None = None,
    named: int = NAMED,
) -> str:
    """Figure of curves (n,) over x (n,), increasing; the first ``named`` curves have colours.

    Parameters
    ----------
    title : caption, and alternative text of the picture
    labels : of both axes, with units
    step : distance between numbers along x; 0: chosen automatically
    colours : of the named curves
    points : measured x (k,) and y (k,) by the names of curves, and half widths (k,) of their bands if known
    switches : for a chart of amplitudes, zero to peak, as the label along y must say; None: without switches
    """
    curves = {name: drawable(y) for name, y in curves.items()}
    within = {name: _within(x, *map(drawable, measured)) for name, measured in points.items()}
    low, high = _ends([*curves.values(), *(found[1] for found in within.values())])
    room = 0.06 * (high - low)
    across = Axis(labels[0], float(x[0]), max(float(x[-1]), float(x[0]) + LEAST), step)
    scales = [Axis(labels[1], low - (room if low < 0.0 else 0.0), high + room)]
    if switches is not None:
        top = high + room if high > 0.0 else 1.0
        scales.append(Axis(labels[1], 10.0**-DECADES * top, 1.3 * top, log=True))
    drawings = [
        "".join(_frame(across, up, switches is not None) + _curves(across, up, x, curves, within, colours, named))
        for up in scales
    ]
    shown = dict(list(curves.items())[:named])
    more = ["others"] * (len(curves) > named) + [MEASURED] * any(found[0].size for found in within.values())
    return _figure(title, drawings, across, x, shown, colours, more, switches)


def _curves(
    across: Axis,
    up: Axis,
    x: Array,
    curves: Mapping[str, Array],
    within: Mapping[str, tuple[Array, ...]],
    colours: Sequence[str],
    named: int,
) -> list[str]:
    """SVG of curves, the first ``named`` ones on top, and of measured points."""
    parts = []
    for k, (name, y) in reversed(list(enumerate(curves.items()))):
        colour, thickness = (colours[k], 1.8) if k < named else (GREY, 0.8)
        finite = np.isfinite(y)
        breaks = np.flatnonzero(np.diff(finite.astype(int))) + 1
        runs = [part for part in np.split(np.arange(len(x)), breaks) if finite[part[0]]]
        for corners in [" ".join(f"{_x(across, x[k])},{_y(up, y[k])}" for k in part) for part in runs]:
            parts.append(
                f'<polyline data-k="{k}" points="{corners}" fill="none" stroke="{colour}" '
                f'stroke-width="{thickness}"><title>{html.escape(name)}</title></polyline>'
            )
    for k, name in enumerate(curves):
        colour = colours[k] if k < named else GREY
        for place, value, *band in zip(*(values.tolist() for values in within.get(name, ())), strict=True):
            if not math.isfinite(place + value):
                continue
            parts += _band(f'data-k="{k}"', colour, across, up, place, value, *band)
            parts.append(
                f'<circle data-k="{k}" cx="{_x(across, place)}" cy="{_y(up, value)}" r="3.5" fill="white" '
                f'stroke="{colour}" stroke-width="1.6"><title>{html.escape(name)}, measured</title></circle>'
            )
    return parts


def bar_chart(
    title: str,
    x: Array,
    bars: Mapping[str, Array],
    labels: tuple[str, str],
    points: Mapping[str, tuple[Array, Array]] = MappingProxyType({}),
) -> str:
    """Figure of groups of bars (n,) at evenly spaced x (n,), at most ``NAMED`` in a group; ``labels`` as for lines.

    ``points``: measured values (n,) and half widths (n,) of bands next to bars by name; NaN without a value.
    """
    pitch = float(x[1] - x[0])
    across = Axis(labels[0], float(x[0]) - pitch, float(x[-1]) + pitch, 2.0 * pitch)
    bars = {name: drawable(y) for name, y in bars.items()}
    points = {name: (drawable(one[0]), drawable(one[1])) for name, one in points.items()}
    top = _ends([*bars.values(), *(one[0] for one in points.values())])[1]
    up = Axis(labels[1], 0.0, 1.06 * max(top, LEAST))
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
        measured, band = points.get(name, (np.full(len(x), math.nan),) * 2)
        middles = (x + (k + 0.5 - 0.5 * len(bars)) * width).tolist()
        for place, value, half in zip(middles, measured.tolist(), band.tolist(), strict=True):
            if math.isfinite(value) and value >= 0.0:
                parts += _band("", "#1c2733", across, up, place, value, half)
                parts.append(
                    f'<circle cx="{_x(across, place)}" cy="{_y(up, value)}" r="2.6" fill="white" stroke="#1c2733">'
                    f"<title>{html.escape(name)}, measured</title></circle>"
                )
    return _figure(title, ["".join(parts)], across, x, bars, COLOURS, [MEASURED] * bool(points))


def map_chart(title: str, x: Array, y: Array, values: Array, labels: tuple[str, str, str]) -> str:
    """Figure of values (m, n) as colours over x (n,) and y (m,), both increasing at even distances.

    Colours are logarithmic over ``DECADES`` below the largest value; NaN is white. ``labels`` are
    those of the axes and of the values, with units.
    """
    half_x, half_y = (0.5 * float(places[1] - places[0]) for places in (x, y))
    across = Axis(labels[0], float(x[0]) - half_x, float(x[-1]) + half_x)
    up = Axis(labels[1], float(y[0]) - half_y, float(y[-1]) + half_y)
    values = drawable(values)
    top = _ends([np.ravel(values)])[1]
    place = np.clip(1.0 + np.log10(np.maximum(values, 1e-30 * top) / top) / DECADES, 0.0, 1.0)
    steps = np.linspace(0.0, 1.0, len(MAP_COLOURS))
    pixels = np.stack([np.interp(place, steps, channel) for channel in np.transpose(MAP_COLOURS)], axis=-1)
    pixels[~np.isfinite(values)] = 255.0
    image = base64.b64encode(_png(pixels[::-1].round().astype(np.uint8))).decode("ascii")
    drawn = (
        f'<image x="{LEFT}" y="{TOP}" width="{RIGHT - LEFT}" height="{BOTTOM - TOP}" preserveAspectRatio="none" '
        f'style="image-rendering:pixelated" href="data:image/png;base64,{image}"/>'
    )
    parts = [drawn, *(part for part in _frame(across, up) if not part.startswith("<line"))]
    shades = ", ".join(f"rgb{colour}" for colour in MAP_COLOURS)
    key = (
        f'<span>{10.0**-DECADES * top:.2g} <i style="width:8em;height:.8em;background:linear-gradient(to right, '
        f'{shades})"></i>{top:.3g} {html.escape(labels[2])}</span>'
    )
    said = html.escape(title)
    return (
        f'<figure><div class="scroll"><svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{said}">'
        f'{"".join(parts)}</svg></div><div class="keys">{key}</div><figcaption>{said}</figcaption></figure>'
    )


def _png(pixels: NDArray[np.uint8]) -> bytes:
    """PNG file (ISO/IEC 15948) of pixels (h, w, 3), with the first row on top."""
    height, width, _ = pixels.shape
    rows = np.hstack([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)]).tobytes()
    chunks = (
        (b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows, 9)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )


def _figure(
    title: str,
    drawings: Sequence[str],
    across: Axis,
    x: Array,
    named: Mapping[str, Array],
    colours: Sequence[str],
    more: Sequence[str] = (),
    switches: Switches | None = None,
) -> str:
    """HTML figure with a legend and the values that the page's script shows; ``more`` is additional HTML.

    With ``switches`` the second drawing is the logarithmic one, and curves can be chosen in the legend.
    """
    keys = ""
    for k, (colour, name) in enumerate(zip(colours, named, strict=False)):
        key = f'<i style="background:{colour}"></i>{html.escape(name)}'
        box = f'<label><input type="checkbox" class="curve" value="{k}" checked/>{key}</label>'
        keys += f"<span>{key}</span>" if switches is None else box
    grey = "".join(f"<span>{_MORE[what]}{what}</span>" for what in more)
    data = {
        "x": [float(f"{v:.6g}") for v in x],
        "y": {name: [float(f"{v:.4g}") if math.isfinite(v) else None for v in y] for name, y in named.items()},
        "span": [across.low, across.high, LEFT, RIGHT, WIDTH],
        "label": across.label,
    }
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    turned = ""
    if switches is not None:
        boxes = (("to-pp", "peak to peak", switches.peak_to_peak), ("to-log", "logarithmic", switches.log))
        turned = "".join(
            f'<label><input type="checkbox" class="{kind}"{" checked" * on}/>{name}</label>' for kind, name, on in boxes
        )
        turned = f'<div class="switches">{turned}</div>'
    pictures = "".join(
        f'<svg class="{kind}" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{html.escape(title)}">{drawing}'
        f'<line class="cursor" x1="0" x2="0" y1="{TOP}" y2="{BOTTOM}"/></svg>'
        for kind, drawing in zip(("linear", "log"), drawings, strict=False)
    )
    return (
        f'<figure class="chart">{turned}<div class="scroll">{pictures}</div><div class="keys">{keys}{grey}</div>'
        f'<div class="readout" aria-live="off"></div>'
        f'<figcaption>{html.escape(title)}</figcaption><script type="application/json">{text}</script></figure>'
    )


def drawable(values: Array) -> Array:
    """Values that can be drawn: NaN for infinite ones, limited to ``LARGEST``."""
    values = np.asarray(values, dtype=np.float64)
    return np.where(np.isfinite(values), np.clip(values, -LARGEST, LARGEST), math.nan)


def _ends(curves: Sequence[Array]) -> tuple[float, float]:
    """Range of an axis with zero and all finite values; 0 to 1 if there are none."""
    values = np.concatenate([np.zeros(1), *curves])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    return (low, high) if high - low > LEAST else (low, low + 1.0)


def _within(x: Array, places: Array, *values: Array) -> tuple[Array, ...]:
    """Places within the range of an axis, and the values there."""
    inside = (places >= x[0]) & (places <= x[-1])
    return places[inside], *(each[inside] for each in values)


def _band(
    words: str, colour: str, across: Axis, up: Axis, place: float, value: float, half: float = math.nan
) -> list[str]:
    """Line through a measured point along its band; empty if the band is unknown."""
    if not half > 0.0:
        return []
    at, low, high = _x(across, place), _y(up, max(value - half, up.low)), _y(up, min(value + half, up.high))
    return [f'<line {words} x1="{at}" x2="{at}" y1="{low}" y2="{high}" stroke="{colour}" stroke-width="1.2"/>']


def _frame(across: Axis, up: Axis, both: bool = False) -> list[str]:
    """Grid, numbers and labels; ``both``: numbers along y for zero to peak, and doubled for peak to peak."""
    kinds = (("zp", 1.0), ("pp", 2.0)) if both else (("", 1.0),)
    parts = []
    for tick in across.ticks():
        place = _x(across, tick)
        parts.append(f'<line class="grid" x1="{place}" x2="{place}" y1="{TOP}" y2="{BOTTOM}"/>')
        parts.append(f'<text x="{place}" y="{BOTTOM + 22}" text-anchor="middle">{tick:g}</text>')
    for tick in up.ticks():
        place = _y(up, tick)
        parts.append(f'<line class="grid" x1="{LEFT}" x2="{RIGHT}" y1="{place}" y2="{place}"/>')
        parts += [
            f'<text class="{kind}" x="{LEFT - 7}" y="{place + 4:.1f}" text-anchor="end">'
            f"{float(f'{scale * tick:.3g}'):g}</text>"
            for kind, scale in kinds
        ]
    middle = 0.5 * (TOP + BOTTOM)
    parts.append(
        f'<text x="{0.5 * (LEFT + RIGHT)}" y="{HEIGHT - 10}" text-anchor="middle">{html.escape(across.label)}</text>'
    )
    turned = f'transform="rotate(-90 14 {middle})"'
    for kind, scale in kinds:
        text = up.label.replace("zero to peak", "peak to peak") if scale > 1.0 else up.label
        parts.append(
            f'<text class="{kind}" x="14" y="{middle}" text-anchor="middle" {turned}>{html.escape(text)}</text>'
        )
    return parts


def _x(axis: Axis, value: float) -> float:
    return round(LEFT + (RIGHT - LEFT) * (value - axis.low) / (axis.high - axis.low), 1)


def _y(axis: Axis, value: float) -> float:
    if axis.log:
        share = math.log10(max(value, axis.low) / axis.low) / math.log10(axis.high / axis.low)
        return round(BOTTOM - (BOTTOM - TOP) * share, 1)
    return round(BOTTOM - (BOTTOM - TOP) * (value - axis.low) / (axis.high - axis.low), 1)
