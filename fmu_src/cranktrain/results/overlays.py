"""Pictures of several results: cycles and orders of runs, or orders of run-ups over speed."""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.dynamics.outputs.register import nearest_output
from cranktrain.results.figures import HIGHEST, save_figure
from cranktrain.results.orders.harmonics import last_cycle, order_spectrum
from cranktrain.results.orders.resonances import peaks
from cranktrain.results.plots import GREY, largest
from cranktrain.results.run_up.common_speeds import on_common_speeds
from cranktrain.results.run_up.plot_data import BROADEST, figure_of, quantity_of
from cranktrain.results.run_up.plots import DECADES, ORDER_COLOURS
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.results.views.time_series import TimeSeries

Results = Mapping[str, TimeSeries] | Mapping[str, RunUp]
MOST = 6
"""Largest number of results in a picture."""
FEW = 3
"""Largest number of speeds of a run-up whose curves are drawn with a mark at every speed."""
PANELS = 4
"""Number of orders of run-ups drawn by default."""
TOLD = (
    "crank", "bearings", "big_ends", "block", "pistons", "damper", "boundary", "steady", "integrator", "step", "load",
    "film_temperature", "gas",
)  # fmt: skip
"""Attributes that distinguish results in a legend, in this order."""
STYLES = ("-", "--", "-.", ":", (0, (6, 1, 1, 1, 1, 1)), (0, (1, 2)))


def legend_names(results: Mapping[str, TimeSeries | RunUp]) -> list[str]:
    """Legend text of each result: engine and differing attributes; also the file name if these are not unique."""
    found = list(results.values())
    engines = [str(one.attributes.get("engine", "engine")) for one in found]
    parts = [[name] for name in engines]
    if all(isinstance(one, TimeSeries) for one in found):
        speeds = [float(one.attributes.get("speed", math.nan)) / RPM for one in found]
        if len({round(rpm, 3) for rpm in speeds}) > 1 and not math.isnan(sum(speeds)):
            _add(parts, [f"{rpm:.5g} rev/min" for rpm in speeds])
    for key in TOLD:
        values = [one.attributes.get(key) for one in found]
        if len(set(values)) > 1 and None not in values:  # a coupled run does not know its levels
            _add(parts, [f"{key.replace('_', ' ')} {setting_text(key, value)}" for value in values])
    names = [", ".join(part) for part in parts]
    if len(set(names)) < len(names):
        files = [Path(path).name for path in results]
        files = files if len(set(files)) == len(files) else list(results)
        names = [f"{name}, {file}" for name, file in zip(names, files, strict=True)]
    return names


def _add(parts: Sequence[list[str]], texts: Sequence[str]) -> None:
    for part, text in zip(parts, texts, strict=True):
        part.append(text)


def setting_text(key: str, value: Any) -> str:
    """Text of a result's setting; an internal step in degrees, a speed in rev/min."""
    if key == "step":
        return f"{math.degrees(value):.4g} deg"
    if key == "speed":
        return f"{value / RPM:.5g} rev/min"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def check_overlaid(results: Mapping[str, TimeSeries | RunUp], outputs: Sequence[str]) -> None:
    """Refuse results of different kinds, too many results, and outputs that a result does not have; ``InputError``."""
    if len(results) > MOST:
        raise InputError(f"{len(results)} files: a picture can tell {MOST} apart; name fewer")
    kinds = {isinstance(one, RunUp): path for path, one in results.items()}
    if len(kinds) > 1:
        raise InputError(f"{kinds[True]} is a run-up and {kinds[False]} a run at one speed; name results of one kind")
    for path, one in results.items():
        there = one.amplitudes if isinstance(one, RunUp) else one.outputs
        for name in outputs:
            if name not in there:
                raise InputError(f"{path}: output '{name}' is not in this result; {nearest_output(name, there)}")


def cycle_overlay(runs: Mapping[str, TimeSeries], output: str) -> Any:
    """Figure of an output over the last cycle of several runs, above its orders; rad shown in degrees.

    Between both is the difference of two runs, the second less the first.
    """
    shown = quantity_of(output)
    per_unit = "" if shown.unit == "1" else f" / {shown.unit}"
    two = len(runs) == 2
    figure = figure_of(9.5, 9.2 if two else 7.2)
    above, *middle, below = figure.subplots(2 + two, 1)
    width = 0.42 / len(runs)
    cycles = [shown.scale * last_cycle(run.angle, np.asarray(run[output]), from_zero=True) for run in runs.values()]
    angle = np.linspace(0.0, 720.0, cycles[0].size + 1)
    for k, (name, cycle) in enumerate(zip(legend_names(runs), cycles, strict=True)):
        own = {"color": ORDER_COLOURS[k], "label": name}
        above.plot(angle, np.append(cycle, cycle[0]), lw=1.5, ls=STYLES[k], **own)
        orders, sizes = order_spectrum(cycle, HIGHEST)
        below.bar(np.asarray(orders) + (k - 0.5 * (len(runs) - 1)) * width, sizes, width=width, **own)
    for ax in middle:
        apart = cycles[1] - cycles[0]
        ax.plot(angle, np.append(apart, apart[0]), lw=1.2, color=GREY)
        ax.set_ylabel(f"difference{per_unit}")
    for ax in (above, *middle):
        ax.set(xlim=(0, 720), xticks=np.arange(0, 721, 120), xlabel="crank angle over the last cycle / deg")
    above.set_ylabel(output.rpartition(".")[2].replace("_", " ") + per_unit)
    below.set(xlim=(0, HIGHEST + 0.5), xticks=np.arange(0, HIGHEST + 0.1, 1.5))
    below.set(xlabel="order / oscillations per revolution", ylabel=f"zero to peak{per_unit}")
    for ax in figure.axes:
        ax.grid(alpha=0.25)
    _legend(figure, above)
    figure.suptitle(f"{output} over the last cycle, and its orders", fontsize=12, parse_math=False)
    return figure


def order_overlay(
    run_ups: Mapping[str, RunUp], output: str, orders: Sequence[float] = (), log: bool | None = None,
    peak_to_peak: bool = False,
) -> Any:  # fmt: skip
    """Figure of an output's orders over speed, one panel each: the given orders, or the strongest of all run-ups.

    A dotted line is the difference of two run-ups, its phase included.
    """
    quantity = quantity_of(output)
    quantity = quantity.peak_to_peak if peak_to_peak else quantity
    shown = sorted(orders) or _strongest(run_ups, output)
    figure = figure_of(10.5, 1.6 + 2.6 * len(shown))
    axes = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    names = legend_names(run_ups)
    pair = on_common_speeds(*run_ups.values()) if len(run_ups) == 2 else ()
    for ax, order in zip(axes, shown, strict=True):
        top = 0.0
        for k, (name, run_up) in enumerate(zip(names, run_ups.values(), strict=True)):
            sizes = quantity.scale * np.abs(run_up.order(order, output))
            top = max(top, largest(sizes))
            mark = "o" if run_up.speeds.size < FEW else None
            style = {"marker": mark, "ms": 4, "lw": 1.6, "ls": STYLES[k], "color": ORDER_COLOURS[k], "label": name}
            ax.plot(run_up.speeds_rpm, sizes, **style)
        for a, b in [pair] if pair and pair[0].speeds.size else []:
            apart = quantity.scale * np.abs(b.order(order, output) - a.order(order, output))
            ax.plot(a.speeds_rpm, apart, lw=1.2, ls=":", color=GREY, label="difference")
        if log:
            ax.set_yscale("log")
            ax.set_ylim(10.0**-DECADES * (top or 1.0), 1.6 * (top or 1.0))
        else:
            ax.set_ylim(0.0, 1.06 * (top or 1.0))
        ax.set_title(f"order {order:g}", fontsize=10, loc="left")
        ax.set_ylabel(quantity.unit)
        ax.grid(alpha=0.25)
    axes[-1].set_xlabel("engine speed / rev/min")
    _legend(figure, axes[0])
    title = quantity.name[0].upper() + quantity.name[1:]
    figure.suptitle(f"{title}, orders over the speed", fontsize=12, parse_math=False)
    return figure


def save_overlays(
    folder: Path, results: Results, outputs: Sequence[str], orders: Sequence[float] = (), log: bool | None = None,
    peak_to_peak: bool = False,
) -> list[Path]:  # fmt: skip
    """Write one picture per output of results of one kind into ``folder``; returns the paths."""
    check_overlaid(results, outputs)
    runs = {path: one for path, one in results.items() if isinstance(one, TimeSeries)}
    run_ups = {path: one for path, one in results.items() if isinstance(one, RunUp)}
    made = {
        name: cycle_overlay(runs, name) if runs else order_overlay(run_ups, name, orders, log, peak_to_peak)
        for name in outputs
    }
    return [save_figure(figure, folder / file_name(name)) for name, figure in made.items()]


def file_name(output: str) -> str:
    """File name of the picture of an output."""
    return f"overlay_{re.sub('[^0-9a-z]+', '_', output.lower()).strip('_')}.png"


def _strongest(run_ups: Mapping[str, RunUp], output: str) -> list[float]:
    """Orders to be drawn: those with the highest resonances relative to their run-up, then the largest amplitudes."""
    ranks: dict[float, tuple[float, float]] = {}
    for run_up in run_ups.values():
        sharp = {peak.order: peak.amplitude for peak in reversed(peaks(run_up, output)) if not peak.damping > BROADEST}
        sizes = {order: largest(np.abs(run_up.order(order, output))) for order in run_up.orders.tolist()}
        tops = [max(of.values(), default=0.0) or 1.0 for of in (sharp, sizes)]
        for order in sizes:
            own = sharp.get(order, 0.0) / tops[0], sizes[order] / tops[1]
            ranks[order] = max(own, ranks.get(order, own))
    common = set.intersection(*(set(one.orders.tolist()) for one in run_ups.values()))
    return sorted(sorted(common, key=lambda order: ranks[order], reverse=True)[:PANELS])


def _legend(figure: Any, ax: Any) -> None:
    """Draw the legend of a figure below its axes."""
    handles, names = ax.get_legend_handles_labels()
    figure.legend(handles, names, frameon=False, fontsize=8.5, loc="outside lower center", ncols=1)
