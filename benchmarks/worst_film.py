"""Elastic films at their worst state, on grids from coarse to fine: ``python -m benchmarks.worst_film``.

The engine runs some cycles from its start on each grid (``ehd`` and ``ehd:fine`` name those of the levels), by default
with its damper, so that the motion has a period and the last cycles differ by the grid alone. Of each main: least film,
largest pressure and, at that pressure, its drop from the peak to the axial lines beside it, with the errors against the
finest grid, which stands last. ``--relief`` gives the shells other depths of relief for a run on the grid of the loop.
Prints one JSON object. ``--levels`` runs the cases of CASES in place of one engine, on the grids of both levels and the
finest, and prints the largest errors of each case as it ends, a line of JSON each: they are the film errors that the
register of levels states. ``--levels block`` runs the cases that have this word in their name.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import sys
import tempfile
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import cranktrain as ct
from cranktrain.core.errors import SolverError
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.film.elastic.grid import ElasticGrid
from cranktrain.film.laws.ehd import FINE, IN_LOOP
from cranktrain.film.laws.pressure_peak import PEAK, PEAK_ANGLE, PEAK_DROP, pressure_peaks
from cranktrain.structure.assembly import assemble

Array = NDArray[np.float64]
LEVELS = {"ehd": IN_LOOP, "ehd:fine": FINE}
FINEST = "96x24x0.3"
GRIDS = (*LEVELS, "48x8", "48x12", "48x16", "96x16", FINEST)
PER_CYCLE = 288
CASES = {
    "`diesel_i6`, 1000 rev/min, damper": ("diesel_i6", 1000.0, {"damper": "fitted"}),
    "`diesel_i6`, 2000 rev/min": ("diesel_i6", 2000.0, {}),
    "`diesel_i6`, 2000 rev/min, flexible block": ("diesel_i6", 2000.0, {"block": "flexible"}),
    "`diesel_i6`, 2380 rev/min, damper": ("diesel_i6", 2380.0, {"damper": "fitted"}),
    "new four, 86 x 86 mm, 4500 rev/min": ("i4 86 86", 4500.0, {}),
    "new V6 of 60 degrees, 90 x 86 mm, 3000 rev/min": ("v6_60 90 86", 3000.0, {}),
    "four of 82 x 86 mm, 4500 rev/min, flexible block": (
        "examples/four_with_balancers.toml",
        4500.0,
        {"block": "flexible"},
    ),
}
"""Engine, rev/min and levels of the cases by which the errors of the levels are known.

An engine is a name or a file, without its added bodies, or layout, bore and stroke (mm) of one that ``cranktrain new``
writes."""
CASE_CYCLES = 3


def grid_of(text: str) -> ElasticGrid:
    """A level, ``48x8`` or ``48x8x0.5``: nodes around, across, and their gathering at the ends (else the loop's)."""
    if text in LEVELS:
        return LEVELS[text]
    n_phi, n_z, *edge = text.split("x")
    return ElasticGrid(int(n_phi), int(n_z), float(edge[0]) if edge else IN_LOOP.edge)


def started(engine: Engine, speed: float, grid: ElasticGrid, levels: dict[str, Any]) -> Simulation:
    """The engine on elastic films of a grid, with other ``levels`` such as that of the damper, at its start."""
    made = assemble(engine, Settings(bearings="ehd", **levels))
    bore = made.parts.bore
    assert bore is not None
    parts = made.parts._replace(bore=replace(bore, grid=grid))
    run = Simulation(made.engine, made.body, made.settings, None, parts)
    run.inputs[0] = speed * math.pi / 30.0
    run.initialize()
    return run


def cycle(run: Simulation) -> Array:
    """Least films of the mains over one cycle, (PER_CYCLE, b), m."""
    names, begin = list(run.output_names), run.time
    at = [names.index(f"bearing[{i + 1}].film_thickness_min") for i in range(len(run.model.bearings))]
    least = np.zeros((PER_CYCLE, len(at)))
    for k in range(PER_CYCLE):
        run.step(begin + (k + 1) * 4.0 * math.pi / run.inputs[0] / PER_CYCLE)
        least[k] = run.outputs[at]
    return least


def figures(run: Simulation) -> dict[str, list[float]]:
    """What one cycle gives, of each main."""
    least = cycle(run)
    peaks = pressure_peaks(run.model.films.entry)
    assert peaks is not None
    return {
        "least_film_um": (1e6 * least.min(axis=0)).round(3).tolist(),
        "at_deg": ((least.argmin(axis=0) + 1) * 720.0 / PER_CYCLE).tolist(),
        "largest_pressure_mpa": (1e-6 * peaks[:, PEAK]).round(1).tolist(),
        "pressure_at_deg": np.degrees(peaks[:, PEAK_ANGLE]).round(1).tolist(),
        "pressure_drop": peaks[:, PEAK_DROP].round(3).tolist(),
    }


def errors(found: dict[str, Any], finest: dict[str, Any]) -> dict[str, Any]:
    """Figures of a grid with their errors; without errors where a run has failed.

    A film that is closed on both grids has no error, and one that is closed on the finest alone null.
    """
    if "failed" in found or "failed" in finest:
        return found
    compared = {}
    for name in ("least_film_um", "largest_pressure_mpa"):
        pairs = zip(found[name], finest[name], strict=True)
        compared[f"error_of_{name}"] = [
            round(own / exact - 1.0, 4) if exact else None if own else 0.0 for own, exact in pairs
        ]
    return {**found, **compared}


def measured(engine: Engine, speed: float, grid: ElasticGrid, levels: dict[str, str], cycles: int) -> dict[str, Any]:
    """Figures of the last cycle of a run on a grid; ``failed`` where the run ends before."""
    run = started(engine, speed, grid, levels)
    try:
        for _ in range(cycles - 1):
            cycle(run)
        return figures(run)
    except SolverError as error:
        return {"failed": str(error)}


def engine_of(text: str) -> Engine:
    """An engine of ``CASES``."""
    layout: Any
    layout, *sizes = text.split()
    if not sizes:
        return load_engine(layout).without_additions
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        return ct.new_engine("made", layout=layout, bore_mm=float(sizes[0]), stroke_mm=float(sizes[1]))


def level_errors(engine: Engine, speed: float, levels: dict[str, str]) -> dict[str, Any]:
    """Of each level in a case: largest error of any main's least film and of its largest pressure, and those mains."""
    rows = [measured(engine, speed, grid_of(text), levels, CASE_CYCLES) for text in (*LEVELS, FINEST)]
    found: dict[str, Any] = {}
    for level, row in zip(LEVELS, rows, strict=False):
        compared = errors(row, rows[-1])
        for what in ("least_film_um", "largest_pressure_mpa"):
            if f"error_of_{what}" not in compared:
                found[level] = {"failed": row.get("failed", rows[-1].get("failed"))}
                continue
            off = [math.inf if error is None else error for error in compared[f"error_of_{what}"]]
            worst = max(range(len(off)), key=lambda i: abs(off[i]))
            found.setdefault(level, {})[what] = {"error": off[worst], "main": worst + 1}
    return found


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.worst_film", description=__doc__)
    parser.add_argument("--engine", default="diesel_i6", help="name or file")
    parser.add_argument("--speed", type=float, default=2380.0, metavar="RPM")
    parser.add_argument("--damper", default="fitted", help="none or fitted")
    parser.add_argument("--cycles", type=int, default=4, help="of each run")
    parser.add_argument("--grids", nargs="+", default=GRIDS, metavar="48x8", help="the finest one last")
    parser.add_argument("--relief", type=float, nargs="*", default=(), metavar="UM", help="other depths of relief, um")
    parser.add_argument("--levels", nargs="*", metavar="WORD", help="largest errors of both levels, by cases")
    chosen = parser.parse_args()
    if chosen.levels is not None:
        for name, (case, speed, choices) in CASES.items():
            if all(word in name for word in chosen.levels):
                print(f"worst_film: {name}", file=sys.stderr, flush=True)
                print(json.dumps({"case": name, **level_errors(engine_of(case), speed, choices)}), flush=True)
        return 0
    engine, levels = load_engine(chosen.engine), {"damper": chosen.damper}
    found = {}
    for text in chosen.grids:
        print(f"worst_film: {text}", file=sys.stderr, flush=True)
        found[text] = measured(engine, chosen.speed, grid_of(text), levels, chosen.cycles)
    grids = {text: errors(row, found[chosen.grids[-1]]) for text, row in found.items()}
    depths = {}
    for depth in chosen.relief:
        bearing = replace(engine.plain_mains, relief_depth=1e-6 * depth)
        relieved = replace(engine, main_bearing=bearing)
        depths[f"{depth:g}"] = measured(relieved, chosen.speed, IN_LOOP, levels, chosen.cycles)
    print(json.dumps({"grids": grids, "relief_um": depths}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
