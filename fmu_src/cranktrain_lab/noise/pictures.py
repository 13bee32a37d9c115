"""Pictures of noise: third-octave levels, levels of a panel over speed and frequency, levels on the surface."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.results.figures import save_figure
from cranktrain.results.pictures.moving_surface import MovingSurface
from cranktrain.results.plots import BLUE, GREY, ORANGE, wrapped
from cranktrain.results.run_up.plots import ORDER_COLOURS
from cranktrain_lab.noise.radiation import POWER_REFERENCE, VELOCITY_REFERENCE, a_weighting, level
from cranktrain_lab.noise.recording import Recorded
from cranktrain_lab.noise.result import NoiseResult

BANDS_PICTURE, WATERFALL_PICTURE = "noise_bands.png", "noise_waterfall.png"
SHOWN_DB = 60.0
"""Range of a colour scale of levels over speed and frequency, dB."""
MAP_DB = 40.0
"""Range of the colour scale of a surface, dB."""
PIXELS = 400
"""Number of frequencies of a picture over speed and frequency."""


def save_pictures(folder: Path, result: NoiseResult, assumption: str, panel: str | None) -> list[Path]:
    """Write the bands and, for three speeds or more, the levels over speed and frequency; returns the paths."""
    made = [(BANDS_PICTURE, bands_figure(result, assumption))]
    if len(result.runs) > 2:
        made.append((WATERFALL_PICTURE, waterfall_figure(result, assumption, panel)))
    return [save_figure(figure, folder / name) for name, figure in made]


def bands_figure(result: NoiseResult, assumption: str) -> Any:
    """Third-octave levels of the sound power of all panels, and of each panel, at the loudest speed."""
    from matplotlib.figure import Figure

    loudest = max(result.runs, key=lambda run: float(np.sum(_weighted(result, run, assumption))))
    bands = result.bands(loudest)
    powers = bands.sums(loudest.frequency, result.power_lines(loudest, assumption))
    whole = level(powers.sum(axis=0), POWER_REFERENCE)
    of_panels = level(powers, POWER_REFERENCE)
    figure = Figure(figsize=(10.5, 5.4), dpi=120, layout="constrained")
    ax = figure.subplots()
    x = np.arange(bands.nominal.size)
    top = 5.0 * np.ceil(np.max(whole) / 5.0 + 0.2)
    low = top - SHOWN_DB
    open_bands = result.unchecked(loudest, bands) if not result.finer else np.zeros(x.size, dtype=bool)
    shown = np.where(whole > low, whole, low)
    ax.bar(
        x, shown - low, bottom=low, color=np.where(open_bands, GREY, BLUE), alpha=0.35, width=0.9, label="all panels"
    )
    for k, (name, colour) in enumerate(zip(result.panels.names, ORDER_COLOURS * 3, strict=False)):
        values = np.where(np.isfinite(of_panels[k]) & (of_panels[k] > low), of_panels[k], np.nan)
        ax.plot(x, values, "o-", ms=3.0, lw=1.0, color=colour, label=name)
    ax.set(xticks=x, ylim=(low, top), xlabel="third-octave band / Hz", ylabel="sound power level / dB re 1 pW")
    ax.set_xticklabels([f"{hz:g}" for hz in bands.nominal], rotation=60)
    ax.grid(axis="y", color="#d8dde3", linewidth=0.6)
    ax.legend(frameon=False, fontsize=8.5, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    title = f"{result.attributes['title']}, {loudest.speed_rpm:g} rev/min: {ASSUMED[assumption]}"
    figure.suptitle(wrapped(title, 10.0, 11.0), fontsize=11, parse_math=False)
    return figure


ASSUMED = {
    "one": "equivalent radiated power, radiation efficiency 1",
    "plate": "radiation efficiency of baffled plates (Maidanik, Leppington)",
}
"""Text on each assumption."""


def waterfall_figure(result: NoiseResult, assumption: str, panel: str | None) -> Any:
    """A-weighted level of a panel's sound power, or that of all panels (None), over speed and frequency, with orders.

    Lines are half orders; a pixel has the colour of the nearest line.
    """
    from matplotlib.figure import Figure

    rows, speeds = result.panels.chosen(panel), np.array([run.speed_rpm for run in result.runs])
    highest = min(float(result.bands(run).high[-1]) for run in result.runs)
    frequency = np.linspace(0.0, highest, PIXELS)
    values = np.empty((PIXELS, len(result.runs)))
    for k, run in enumerate(result.runs):
        power = result.power_lines(run, assumption)[rows].sum(axis=0)
        lines = level(power * a_weighting(run.frequency), POWER_REFERENCE)
        nearest = np.clip(np.rint(frequency * run.period).astype(int) - 1, 0, lines.size - 1)
        values[:, k] = lines[nearest]
    top = float(np.max(values))
    figure = Figure(figsize=(10.0, 6.2), dpi=120, layout="constrained")
    ax = figure.subplots()
    colours = ax.pcolormesh(
        speeds, frequency, values, cmap="viridis", vmin=top - SHOWN_DB, vmax=top, shading="nearest", rasterized=True
    )
    for order in _shown_orders(highest, float(speeds[-1])):
        ax.plot(speeds, order * speeds / 60.0, color="white", lw=0.5, ls=":", alpha=0.7)
        y = min(order * speeds[-1] / 60.0, highest)
        ax.annotate(f"{order:g}", (60.0 * y / order, y), xytext=(2, 0), textcoords="offset points", fontsize=8,
                    color=ORANGE, annotation_clip=False)  # fmt: skip
    ax.set(xlim=(speeds[0], speeds[-1]), ylim=(0.0, highest), xlabel="engine speed / rev/min; dotted: orders")
    ax.set_ylabel("frequency / Hz")
    figure.colorbar(colours, ax=ax, extend="min", pad=0.06).set_label("sound power level of a line / dB(A) re 1 pW")
    what = f"panel '{panel}'" if panel else "all panels"
    title = f"{result.attributes['title']}: {what}; {ASSUMED[assumption]}"
    figure.suptitle(wrapped(title, 9.5, 11.0), fontsize=11, parse_math=False)
    return figure


def _shown_orders(highest: float, speed_rpm: float) -> list[float]:
    """About eight orders that reach the highest frequency at a speed: multiples of a round number."""
    most = 60.0 * highest / speed_rpm
    step = next((one for one in (1.0, 2.0, 3.0, 6.0, 12.0, 24.0, 48.0) if most / one <= 8.0), 96.0)
    return np.arange(step, most + step, step).tolist()


def _weighted(result: NoiseResult, run: Recorded, assumption: str) -> Array:
    """A-weighted power of the third-octave bands (b,), W."""
    weighted = result.power_lines(run, assumption).sum(axis=0) * a_weighting(run.frequency)
    return result.bands(run).sums(run.frequency, weighted)


def loudest_band(result: NoiseResult, assumption: str) -> float:
    """Nominal frequency, Hz, of the band with the largest A-weighted power of any run."""
    best = [(float(power.max()), float(result.bands(run).nominal[power.argmax()])) for run in result.runs
            for power in (_weighted(result, run, assumption),)]  # fmt: skip
    return max(best)[1]


def surface_map(result: NoiseResult, hz: float | None, order: float | None) -> MovingSurface:
    """Surface coloured by the level of its normal velocity, in a third-octave band or at an order; a frame a speed.

    Raises ``InputError`` for a frequency or order that a run does not contain.
    """
    panels, count = result.panels, len(result.runs)
    if not len(panels.triangles):
        raise InputError("a reduced block has no surface to draw; leave --map out, or give its mesh by --block-mesh")
    values = np.empty((count, len(panels.points)), dtype=np.float32)
    captions = []
    for k, run in enumerate(result.runs):
        chosen, said = _lines_of(result, run, hz, order)
        amplitude = run.lines[chosen] @ panels.normal
        values[k] = level(0.5 * (np.abs(amplitude) ** 2).sum(axis=0) + 1e-300, VELOCITY_REFERENCE**2)
        captions.append(f"{run.speed_rpm:g} rev/min, {said}: largest {values[k].max():.0f} dB")
    top = float(np.ceil(values.max()))
    what = f"third-octave band of {hz:g} Hz" if hz is not None else f"order {order:g}"
    return MovingSurface(
        title=f"{result.attributes['title']}: {what}",
        points=panels.points,
        triangles=panels.triangles.astype(np.int32),
        shapes=np.zeros((1, len(panels.points), 3), dtype=np.float32),
        coordinates=np.zeros((count, 1)),
        turn=np.zeros(count),
        values=values,
        quantity="normal velocity / dB re 1 nm/s",
        limits=(top - MAP_DB, top),
        captions=tuple(captions),
        scale="block at rest",
        seconds=max(2.0, 0.5 * count),
    )


def _lines_of(
    result: NoiseResult, run: Recorded, hz: float | None, order: float | None
) -> tuple[NDArray[np.intp], str]:
    """Numbers of a run's lines in a band or at an order, and a text; ``InputError`` if there is none."""
    if order is not None:
        number = round(order * run.speed_rpm / 60.0 * run.period)
        if not 1 <= number <= run.frequency.size or run.frequency[number - 1] > result.highest:
            top = result.bands(run).high[-1] * 60.0 / run.speed_rpm
            raise InputError(
                f"order {order:g} lies outside the lines of {run.speed_rpm:g} rev/min; give 0.5 to {top:.0f}"
            )
        return np.array([number - 1]), f"{run.frequency[number - 1]:.1f} Hz"
    bands = result.bands(run)
    assert hz is not None
    inside = (hz >= bands.low) & (hz < bands.high)
    if not inside.any():
        raise InputError(
            f"{hz:g} Hz lies outside the bands of {run.speed_rpm:g} rev/min; give {bands.low[0]:.3g} to "
            f"{bands.high[-1]:.4g} Hz"
        )
    low, high = float(bands.low[inside][0]), float(bands.high[inside][0])
    found = np.flatnonzero((run.frequency >= low) & (run.frequency < high))
    if not found.size:
        raise InputError(
            f"the band of {hz:g} Hz holds no line of {run.speed_rpm:g} rev/min, whose lines are multiples of "
            f"{1.0 / run.period:.3g} Hz; take another band"
        )
    return found, f"{low:.0f} to {high:.0f} Hz"
