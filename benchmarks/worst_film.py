"""Elastic films at their worst state, on grids from coarse to fine: ``python -m benchmarks.worst_film``.

An engine runs some cycles on the grid of the loop. The state that it has reached, motion, shapes of the bores and oil,
is handed to films on each other grid (the oil by interpolation), and all go on for one cycle: they differ by the grid
alone, also where the motion has no period. Of each main: least film, largest pressure and, at that pressure, its drop
from the peak to the axial lines beside it, with the errors against the finest grid, which stands last. ``--relief``
gives the shells other depths of relief for a run of its own on the grid of the loop: what a designer would do about a
film that its grid does not resolve. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import RECORDS
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.film.elastic.grid import ZETA, ElasticGrid
from cranktrain.film.laws.ehd import IN_LOOP, ElasticBore, pressure_peaks
from cranktrain.film.laws.films import MEMORY
from cranktrain.film.laws.pressure_peak import PEAK, PEAK_ANGLE, PEAK_DROP
from cranktrain.structure.assembly import assemble

Array = NDArray[np.float64]
GRIDS = ("48x8", "48x12", "48x16", "96x16", "96x24", "96x32")
PER_CYCLE = 288
TINY = 1.0e-30
"""Void share of a node that has just ruptured."""


def grid_of(text: str) -> ElasticGrid:
    """``48x8`` or ``48x8x0.5``: nodes around, across, and their gathering at the ends (else that of the loop)."""
    n_phi, n_z, *edge = text.split("x")
    return ElasticGrid(int(n_phi), int(n_z), float(edge[0]) if edge else IN_LOOP.edge)


def started(engine: Engine, speed: float, grid: ElasticGrid) -> Simulation:
    """The engine on elastic films of a grid, at its start."""
    made = assemble(engine, Settings(bearings="ehd"))
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
    at = [names.index(f"bearing[{i + 1}].film_thickness_min") for i in range(len(run.model.films.place))]
    least = np.zeros((PER_CYCLE, len(at)))
    for k in range(PER_CYCLE):
        run.step(begin + (k + 1) * 4.0 * math.pi / run.inputs[0] / PER_CYCLE)
        least[k] = run.outputs[at]
    return least


def hand_over(run: Simulation, to: Simulation, grids: tuple[ElasticGrid, ElasticGrid]) -> None:
    """Put ``to``, on the second grid, into the state of ``run``, on the first."""
    here, there = grids
    lines = [_bore(simulation).film.lines[:, ZETA] for simulation in (run, to)]
    size, count = int(run.model.films.traits[MEMORY]), len(run.model.films.place)
    state = run.state
    films = [
        np.concatenate([_interpolated(film[: here.size], here, there, *lines), film[here.size :]])
        for film in state[-size * count :].reshape(count, size)
    ]
    to.state = np.concatenate([state[: -size * count], *films])


def _bore(run: Simulation) -> ElasticBore:
    found: ElasticBore = RECORDS[int(run.model.films.entry[1])]
    return found


def _interpolated(unknowns: Array, here: ElasticGrid, there: ElasticGrid, zetas: Array, onto: Array) -> Array:
    """Node unknowns of a film on another grid: pressure and void share linearly, each on its side."""
    given = np.zeros((here.n_phi, zetas.size))
    given[:, 1:-1] = unknowns.reshape(here.n_phi, here.n_z)
    full, void = (given >= 0.0).astype(float), np.minimum(given, 0.0)
    for field in (full, void):
        field[:, 0], field[:, -1] = field[:, 1], field[:, -2]
    angles = np.append(here.angles, 2.0 * math.pi)

    def moved(field: Array) -> Array:
        across = np.array([np.interp(onto, zetas, row) for row in field])
        return np.array([np.interp(there.angles, angles, np.append(column, column[0])) for column in across.T]).T

    result = np.where(moved(full) >= 0.5, moved(np.maximum(given, 0.0)), np.minimum(moved(void), -TINY))
    return np.ravel(result[:, 1:-1])


def figures(run: Simulation) -> dict[str, list[float]]:
    """What one cycle gives, of each main."""
    least = cycle(run)
    peaks = pressure_peaks(run.model.films)
    assert peaks is not None
    return {
        "least_film_um": (1e6 * least.min(axis=0)).round(3).tolist(),
        "at_deg": ((least.argmin(axis=0) + 1) * 720.0 / PER_CYCLE).tolist(),
        "largest_pressure_mpa": (1e-6 * peaks[:, PEAK]).round(1).tolist(),
        "pressure_at_deg": np.degrees(peaks[:, PEAK_ANGLE]).round(1).tolist(),
        "pressure_drop": peaks[:, PEAK_DROP].round(3).tolist(),
    }


def errors(found: dict[str, Any], finest: dict[str, Any]) -> dict[str, Any]:
    """Figures of a grid with their errors."""
    compared = {
        f"error_of_{name}": (np.array(found[name]) / np.array(finest[name]) - 1.0).round(4).tolist()
        for name in ("least_film_um", "largest_pressure_mpa")
    }
    return {**found, **compared}


def relieved(engine: Engine, speed: float, cycles: int, depth: float) -> dict[str, Any]:
    """The engine with shells relieved by ``depth``, m, on the grid of the loop."""
    bearing = replace(engine.plain_mains, relief_depth=depth)
    run = started(replace(engine, main_bearing=bearing), speed, IN_LOOP)
    for _ in range(cycles):
        cycle(run)
    return figures(run)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.worst_film", description=__doc__)
    parser.add_argument("--engine", default="diesel_i6", help="name or file")
    parser.add_argument("--speed", type=float, default=2380.0, metavar="RPM")
    parser.add_argument("--cycles", type=int, default=4, help="run on the grid of the loop before")
    parser.add_argument("--grids", nargs="+", default=GRIDS, metavar="48x8", help="the finest one last")
    parser.add_argument("--relief", type=float, nargs="*", default=(), metavar="UM", help="other depths of relief, um")
    chosen = parser.parse_args()
    engine = load_engine(chosen.engine)
    usual = started(engine, chosen.speed, IN_LOOP)
    for _ in range(chosen.cycles):
        cycle(usual)
    found = {}
    for text in chosen.grids:
        print(f"worst_film: {text}", file=sys.stderr, flush=True)
        run = started(engine, chosen.speed, grid_of(text))
        hand_over(usual, run, (IN_LOOP, grid_of(text)))
        found[text] = figures(run)
    grids = {text: errors(row, found[chosen.grids[-1]]) for text, row in found.items()}
    depths = {f"{depth:g}": relieved(engine, chosen.speed, chosen.cycles, 1e-6 * depth) for depth in chosen.relief}
    print(json.dumps({"grids": grids, "relief_um": depths}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
