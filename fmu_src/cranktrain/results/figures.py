"""Pictures of a run: torsion and its orders, loads of the mains, journal orbits, least films over the crank angle.

Orbits are seen from the flywheel, with x to the right and y up; the crank rotates counter-clockwise.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.user_file import ending, user_path
from cranktrain.engine.model import Engine
from cranktrain.results import plots
from cranktrain.results.orders.harmonics import last_cycle, order_spectrum
from cranktrain.store.whole_file import check_place, marked, whole_file

if TYPE_CHECKING:
    from cranktrain.dynamics.cycle_run import Result


SAMPLES = 1440
"""Number of points of a cycle in a picture, half a degree apart."""


MOTION_PICTURES = ("pulley_torsion.png",)
FILM_PICTURES = ("main_loads.png", "orbits.png", "least_films.png")
"""File names of the pictures of bearings: loads (every run), orbits and films (runs with moving journals)."""
HIGHEST = 12.0
"""Highest order in a picture of orders."""
PICTURE = marked("picture of cranktrain", "Cranktrain")


def check_folder(folder: Path, option: str = "--plots", pictures: Iterable[str] = ()) -> None:
    """Create a folder for pictures; ``InputError`` before any work if the folder or a picture cannot be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        raise InputError(f"{folder}: cannot be written to; name another folder for {option}") from None
    for name in pictures:
        check_place(folder / name, PICTURE)


def save_figure(figure: Any, path: str | Path) -> Path:
    """Write a picture as PNG or SVG, by the ending of its path, completely or not at all; returns the path.

    Raises ``InputError`` for another ending, and for an existing file that is not a picture of this program.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    target = user_path(path)
    if ending(target) not in (".png", ".svg"):
        raise InputError(f"{path}: pictures end with .png or .svg; name it {target.with_suffix('.png').name}")
    with whole_file(target, PICTURE) as temporary:
        if ending(target) == ".svg":
            FigureCanvasSVG(figure).print_svg(str(temporary), metadata={"Date": None, "Creator": "Cranktrain"})
        else:
            FigureCanvasAgg(figure).print_png(str(temporary), metadata={"Software": "Cranktrain"})
    return target


def save_run_pictures(folder: Path, run: Result, engine: Engine, title: str, films: bool) -> list[Path]:
    """Write pictures of a run's last cycle into ``folder``; returns their paths.

    With ``films`` the pictures of journals that move in their bearings are included.
    """
    torsion = last_cycle(run.angle, run.outputs["pulley.torsion"])
    figures = [(MOTION_PICTURES[0], motion_figure(torsion, "pulley.torsion", "rad", title))]
    if films:
        made = (load_figure(run, engine, title), orbit_figure(run, engine, title), film_figure(run, engine, title))
        figures += zip(FILM_PICTURES, made, strict=True)
    return [save_figure(figure, folder / name) for name, figure in figures]


def motion_figure(cycle: Array, name: str, unit: str, title: str) -> Any:
    """Figure of one output, (n,) uniform samples of a cycle in its ``unit``, above its orders; rad shown in degrees."""
    from matplotlib.figure import Figure

    if unit == "rad":
        cycle, unit = np.degrees(cycle), "deg"
    figure = Figure(figsize=(8.0, 6.4), dpi=120, layout="constrained")
    above, below = figure.subplots(2, 1)
    plots.plot_cycle(above, cycle, name, unit)
    plots.plot_orders(below, *order_spectrum(cycle, HIGHEST), name, unit)
    figure.suptitle(plots.wrapped(title, 7.6, 11.0), fontsize=11, parse_math=False)
    return figure


def load_figure(run: Result, engine: Engine, title: str) -> Any:
    """Figure of the resultant load on each main bearing over the last cycle."""
    from matplotlib.figure import Figure

    angle = np.linspace(0.0, 720.0, SAMPLES, endpoint=False)
    loads: dict[str, Array] = {}
    for name in [f"bearing[{i + 1}]" for i in range(len(engine.crankshaft.main_widths))]:
        x, y = (_cycle(run, f"{name}.force.{axis}") for axis in "xy")
        loads[_title(name)] = np.hypot(x, y)
    figure = Figure(figsize=(11.5, 4.8), dpi=120, layout="constrained")
    ax = figure.subplots()
    plots.plot_loads(ax, angle, loads, _firing(engine))
    ax.set_xlabel("crank angle over the last cycle / deg; dotted: firing of the cylinder with the number above")
    figure.suptitle(f"Loads on the main bearings: {title}", fontsize=12, parse_math=False)
    return figure


_ORBITS = (
    "x / c across the engine, y / c upwards, seen from the flywheel: the crank turns counter-clockwise. Ring: start of "
    "the cycle. Dots: firing dead centres, with number those of the cylinders beside the bearing."
)


def orbit_figure(run: Result, engine: Engine, title: str) -> Any:
    """Figure of the orbits of all main journals, and below them of crank pins whose big ends have films."""
    from matplotlib.figure import Figure

    mains = [f"bearing[{i + 1}]" for i in engine.plain_numbers]
    ends = _floating(run, engine)
    if ends:
        rows = [mains, ends]
    else:
        half = math.ceil(len(mains) / 2) if len(mains) > 4 else len(mains)
        rows = [row for row in (mains[:half], mains[half:]) if row]
    columns = max(map(len, rows))
    cell = 2.2  # width of a clearance circle with title and margins, inches
    width = cell * columns + 1.3
    heading = plots.wrapped(f"Journal orbits in the clearance circle: {title}", width, 12.0)
    note = plots.wrapped(_ORBITS, width, 8.5)
    above, below = 0.55 + 0.2 * (heading.count("\n") + 1), 0.45 + 0.16 * (note.count("\n") + 1)
    height = (cell + 0.2) * len(rows) + above + below
    figure = Figure(figsize=(width, height), dpi=120)
    left, right, bottom, top = 0.45 / width, 1.0 - 0.95 / width, below / height, 1.0 - above / height
    grid = figure.add_gridspec(
        len(rows), 2 * columns, left=left, right=right, bottom=bottom, top=top, wspace=0.25, hspace=0.2
    )
    marks = {"start": 0, **{str(k + 1): round(at / 720.0 * SAMPLES) % SAMPLES for k, at in enumerate(_firing(engine))}}
    line: Any = None
    for r, names in enumerate(rows):
        first = columns - len(names)  # centred rows put the picture of a crank pin between those of its mains
        for k, name in enumerate(names):
            ax = figure.add_subplot(grid[r, first + 2 * k : first + 2 * k + 2])
            bearing = engine.big_end_bearing if name.startswith("big_end") else engine.main_bearing
            assert bearing is not None  # a big end with a film has a table [big_end_bearing] in the engine file
            clearance = bearing.clearance
            x, y = (_cycle(run, f"{name}.position.{axis}") / clearance for axis in "xy")
            line = plots.plot_orbit(ax, x, y, _title(name), marks, _beside(engine, name))
            if k > 0:
                ax.set_yticks([])
            if r + 1 < len(rows) and len(rows[r + 1]) == len(names):
                ax.set_xticks([])
    beside = figure.add_axes((1.0 - 0.75 / width, bottom + 0.06, 0.14 / width, top - bottom - 0.12))
    bar = figure.colorbar(line, cax=beside)
    bar.set_ticks(list(range(0, 721, 120)))
    bar.set_label("crank angle / deg", fontsize=9)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=8, length=2)
    figure.text(0.5, 1.0 - 0.12 / height, heading, fontsize=12, ha="center", va="top", parse_math=False)
    figure.text(0.5, 0.12 / height, note, fontsize=8.5, ha="center", va="bottom", color=plots.INK)
    return figure


def film_figure(run: Result, engine: Engine, title: str) -> Any:
    """Figure of the least film of all main bearings, and of big ends with films, over the last cycle."""
    from matplotlib.figure import Figure

    mains = [f"bearing[{i + 1}]" for i in engine.plain_numbers]
    ends = _floating(run, engine)
    groups = [(mains, "main bearings"), *([(ends, "big ends")] if ends else [])]
    # Films are drawn without smoothing, so that their least values equal those of the summary.
    angle = np.degrees(run.angle) % 720.0
    last = np.flatnonzero(run.angle > run.angle[-1] - 4.0 * math.pi + 1e-9)
    order = last[np.argsort(angle[last])]
    figure = Figure(figsize=(11.5, 1.2 + 3.3 * len(groups)), dpi=120, layout="constrained")
    axes = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
    for ax, (names, what) in zip(axes, groups, strict=True):
        films = {_title(name): run.outputs[f"{name}.film_thickness_min"][order] for name in names}
        bearing = engine.big_end_bearing if what == "big ends" else engine.main_bearing
        plots.plot_least_films(ax, angle[order], films, _firing(engine), bearing.contact_height if bearing else 0.0)
        ax.set_title(what, fontsize=10, loc="left", pad=14)
    axes[-1].set_xlabel("crank angle over the last cycle / deg; dotted: firing of the cylinder with the number above")
    figure.suptitle(f"Least oil film: {title}", fontsize=12, parse_math=False)
    return figure


def _cycle(run: Result, name: str) -> Array:
    """Last cycle of an output, resampled from crank angle 0 on; a run ends only near angle 0, as its shaft twists."""
    first = round(float(run.angle[-1]) / (4.0 * math.pi) * SAMPLES) % SAMPLES
    return np.roll(last_cycle(run.angle, run.outputs[name], SAMPLES), first)


def _floating(run: Result, engine: Engine) -> list[str]:
    """Names of the big ends with films."""
    names = [f"big_end[{c + 1}]" for c in range(engine.n_cylinders)]
    return [name for name in names if np.any(run.outputs[f"{name}.eccentricity"])]


def _firing(engine: Engine) -> list[float]:
    """Firing angle of each cylinder, deg."""
    return [math.degrees(angle) for angle in engine.firing_angles]


def _title(name: str) -> str:
    """Title of a bearing in pictures."""
    family, number = name.rstrip("]").split("[")
    return f"{'big end' if family == 'big_end' else 'main'} {number}"


def _beside(engine: Engine, name: str) -> Sequence[str]:
    """Numbers of the cylinders next to a bearing: neighbouring throws of a main bearing, or cylinder of a big end."""
    family, number = name.rstrip("]").split("[")
    if family == "big_end":
        return [number]
    return [str(c + 1) for c, pin in enumerate(engine.cylinders.pins) if int(number) - 1 <= pin <= int(number)]
