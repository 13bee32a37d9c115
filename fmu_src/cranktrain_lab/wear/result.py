"""Complete computation of running in over time: from engine and schedule to results, files and a new engine file."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.core.user_file import user_path
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain.results.figures import save_figure
from cranktrain.results.plots import foot
from cranktrain.store.engine_text import engine_text, new_path
from cranktrain.store.hdf5 import WEAR
from cranktrain.store.whole_file import check_place
from cranktrain_lab.wear.history import Choices, Running, wear_history
from cranktrain_lab.wear.records import WearHistory
from cranktrain_lab.wear.run_in import fitted_relief, write_relief
from cranktrain_lab.wear.schedule import HOUR, Block, read_schedule

PICTURES = ("wear_profiles.png", "wear_over_time.png")
SHOWN = 6
"""Largest number of times at which shell profiles are drawn."""


def save_wear_pictures(folder: Path, history: WearHistory, title: str) -> list[Path]:
    """Write ``wear_profiles.png`` and ``wear_over_time.png`` into ``folder``. Return their paths."""
    figures = profiles_figure(history, title), over_time_figure(history, title)
    return [save_figure(figure, folder / name) for name, figure in zip(PICTURES, figures, strict=True)]


def profiles_figure(history: WearHistory, title: str) -> Any:
    """Draw the relief of each shell over the width at some times."""
    from matplotlib import colormaps
    from matplotlib.figure import Figure

    count = len(history.bearings)
    columns = min(count, 4)
    rows = -(-count // columns)
    figure = Figure(figsize=(3.0 * columns + 0.6, 2.5 * rows + 0.9), dpi=120, layout="constrained")
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for k, ax in enumerate(axes):
        if k >= count:
            ax.set_visible(False)
            continue
        # Draw the relief of one shell (by index in history.bearings) at up to SHOWN times.
        depth = history.deepest.max(axis=1)
        wanted = np.linspace(0.0, depth[-1], SHOWN)
        shown = sorted({int(np.abs(depth - value).argmin()) for value in wanted[:-1]} | {depth.size - 1})
        for number, row in enumerate(shown):
            colour = colormaps["viridis"](0.9 * number / max(len(shown) - 1, 1))
            ax.plot(history.zeta, 1e6 * history.profile[row, k], color=colour, label=f"{history.hours[row]:.3g} h")
        ax.set(xlim=(-1, 1), xlabel="z / half width", title=f"main {history.bearings[k]:.0f}")
        ax.grid(alpha=0.25)
    axes[0].legend(frameon=False, fontsize=7)
    for ax in axes[::columns]:
        ax.set_ylabel("relief / um")
    figure.suptitle(f"Worn shells: {title}", fontsize=12, parse_math=False)
    foot(figure, "Deepest meridian of each shell over z/(L/2), from the pulley's end (-1) to the flywheel's (1).")
    return figure


def over_time_figure(history: WearHistory, title: str) -> Any:
    """Draw depth, roughness, load fraction in contact, contact pressure, friction and volume of each bearing."""
    from matplotlib.figure import Figure

    drawn = (
        ("worn depth", "um", 1e6 * history.deepest), ("roughness", "um", 1e6 * history.sigma),
        ("load in contact", "%", 100.0 * history.contact_share),
        ("largest contact pressure", "MPa", 1e-6 * history.largest_pressure),
        ("friction power", "W", history.friction_power), ("worn volume", "mm3", 1e9 * history.volume),
    )  # fmt: skip
    figure = Figure(figsize=(11.0, 6.4), dpi=120, layout="constrained")
    for ax, (quantity, unit, values) in zip(figure.subplots(2, 3, sharex=True).ravel(), drawn, strict=True):
        # Draw values of b bearings at s times, (s, b), over the time. Jumps show changes of speed in the schedule.
        for k, number in enumerate(history.bearings):
            ax.plot(history.hours, values[:, k], lw=1.4, label=f"main {number:.0f}")
        ax.set(xlabel="time / h", ylabel=f"{quantity} / {unit}")
        ax.set_xlim(0.0, max(float(history.hours[-1]), 1e-9))
        ax.grid(alpha=0.25)
    figure.axes[0].legend(frameon=False, fontsize=7)
    figure.suptitle(f"Running in: {title}", fontsize=12, parse_math=False)
    foot(figure, "Friction and contact are means over the cycle of each time; contact pressure is its largest value.")
    return figure


def run_in_over_time(
    engine: str | Path | Engine,
    hours: float | None = None,
    schedule: str | Path | Sequence[Block] | None = None,
    *,
    speed_rpm: float | None = None,
    choices: Choices | None = None,
    output: str | Path | None = None,
    out: str | Path | None = None,
    say: Callable[[str], None] = lambda text: None,
    follow: Callable[[float], None] = lambda share: None,
) -> tuple[WearHistory, dict[str, Any]]:
    """Compute wear of an engine's main bearings over time. Return the history, and its figures for JSON.

    Raises ``InputError`` without hours and schedule, with both schedule and speed, for an engine without plain mains, a
    file of another history, or an ``out`` that exists.

    Parameters
    ----------
    engine : path, or the name of a shipped engine
    hours : end of the history; the schedule is repeated up to this time (None: once)
    schedule : file of :func:`cranktrain_lab.wear.schedule.read_schedule`, or its blocks
    speed_rpm : speed without a schedule; by default the lowest speed with oil temperatures
    output : HDF5 file of the history; an existing one is continued
    out : engine file to write, with the relief fitted to the deepest profile of all shells, and their mean roughness
    say, follow : called with each increment, and with the completed fraction of the time
    """
    base = load_engine(engine)
    new = new_path(Path(out)) if out is not None else None
    blocks = _blocks(base, hours, schedule, speed_rpm)
    path = None if output is None else user_path(output)
    if path is not None:
        check_place(path, WEAR)
    running = Running(base, choices or Choices(), say)
    history = wear_history(running, blocks, hours, path, say, follow)
    found = figures(history, base)
    if new is not None:
        bearing, sigma = base.plain_mains, float(history.sigma[-1].mean())
        rough = {"roughness": sigma, "asperity_ratio": bearing.asperity_ratio * (sigma / bearing.roughness) ** 2}
        note = f"run-in: {found['hours']:.4g} h of wear; see cranktrain run-in"
        write_relief(new, engine_text(engine).text, base, found, note, rough)
    return history, found | {"output": None if path is None else str(path), "file": None if new is None else str(new)}


def _blocks(
    engine: Engine, hours: float | None, schedule: str | Path | Sequence[Block] | None, speed_rpm: float | None
) -> Sequence[Block]:
    """Return the blocks of the schedule; raises ``InputError`` if the schedule is missing or ambiguous."""
    if hours is not None and not 0.0 < hours < math.inf:
        raise InputError(f"run-in: {hours:g} hours take no time; give a number above zero")
    if schedule is not None:
        if speed_rpm is not None:
            raise InputError("run-in: a schedule has its own speeds; leave out --speed or --schedule")
        return read_schedule(user_path(schedule)) if isinstance(schedule, str | Path) else tuple(schedule)
    if hours is None:
        raise InputError("run-in: wear over time needs hours or a schedule")
    speed = engine.oil.temperature_speeds[0] if speed_rpm is None else speed_rpm * RPM
    if not SLOWEST_RPM <= speed / RPM * (1.0 + 1e-9) <= FASTEST_RPM:
        raise InputError(f"run-in: speed {speed / RPM:g} is not within {SLOWEST_RPM:g} to {FASTEST_RPM:g} rev/min")
    return (Block(hours * HOUR, speed),)


def envelope(history: WearHistory, row: int = -1) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return m increasing |ζ| across a shell, and the deepest relief (m) of all shells and both ends at each |ζ|."""
    deepest = history.profile[row].max(axis=0)
    deepest = np.maximum(deepest, deepest[::-1])
    half = history.zeta >= 0.0
    zeta, first = np.unique(history.zeta[half], return_index=True)
    return zeta, deepest[half][first]


def figures(history: WearHistory, engine: Engine) -> dict[str, Any]:
    """Return results of a history for JSON, in engineering units; lists are by main bearing."""
    zeta, deepest = envelope(history)
    even = np.linspace(0.0, 1.0, 101)
    return {
        "engine": engine.name, "hours": float(history.hours[-1]), "settled": history.settled,
        "increments": int(history.time.size - 1),
        **fitted_relief(even, np.interp(even, zeta, deepest)),
        "mains": history.bearings.astype(int).tolist(),
        "depth_um": (1e6 * history.deepest[-1]).tolist(), "roughness_um": (1e6 * history.sigma[-1]).tolist(),
        "volume_mm3": (1e9 * history.volume[-1]).tolist(), "contact_work_j": history.contact_work[-1].tolist(),
        "contact_share": [history.contact_share[k].tolist() for k in (0, -1)],
        "friction_power_w": [history.friction_power[k].tolist() for k in (0, -1)],
        "contact_pressure_mpa": [(1e-6 * history.largest_pressure[k]).tolist() for k in (0, -1)],
        "least_gap_um": [(1e6 * history.least_gap[k]).tolist() for k in (0, -1)],
    }  # fmt: skip
