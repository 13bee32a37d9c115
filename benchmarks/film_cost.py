"""How the cost of films grows with grid, shapes, crank modes and bearings: ``python benchmarks/film_cost.py [PNG]``.

Films of one main bearing along its orbit in the running six (see ``_film_orbit.py``): microseconds per film with
tangents, from where it stood a degree before, beside the error of its force against the finest grid of its family. Then
the whole engine at 2000 rev/min and default settings by level of main bearings, over one cycle after run-in, its
processor time split into films and the rest; the same against the number of crank modes; and the films of 1 to 7
bearings in turn. Processor time, medians of interleaved repeats. Prints one JSON object and draws PNG (where not given:
out/film_cost.png).
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from _engine_run import engine_and_body
from _film_cost_chart import draw
from _film_orbit import (
    RUNNING,
    STEPS,
    Array,
    Orbit,
    OrbitFilms,
    elastic_films,
    engine_orbit,
    interleaved,
    plane_films,
    rigid_films,
    softest,
    started,
)
from _film_share import FilmTimer

from cranktrain.core.reduced_body import truncate
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.model import Engine
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.elastic.grid import ElasticGrid
from cranktrain.film.laws.ehd import IN_LOOP as ELASTIC_IN_LOOP
from cranktrain.film.laws.ehd import SHAPES
from cranktrain.film.laws.rigid_bore import IN_LOOP as RIGID_IN_LOOP
from cranktrain.film.table.database import FilmTable, bearing_settings
from cranktrain.store.film_tables import film_table
from cranktrain.structure.block.saddle import bore_compliance
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft, running_loads

OUT = Path(__file__).resolve().parents[1] / "out"
JOURNAL = 1
"""main[2]: its edges stay clear of the rigid bore; where edges touch, no grid is another's judge."""
LEVELS = ("linear", "impedance", "table", "reynolds", "ehd")
RIGID_GRIDS, RIGID_FINEST = ((24, 6), (32, 8), (48, 8), (64, 12), (96, 16)), (144, 24)
ELASTIC_GRIDS, ELASTIC_FINEST = ((24, 8), (36, 6), (48, 6), (48, 8), (72, 8), (96, 12)), (120, 16)
SHAPE_COUNTS = (0, 1, 3, 5, 7, 8, 9, 11, 13, 15)
CUTOFFS_HZ = (500.0, 1000.0, 3000.0, 5000.0, 8000.0, 12000.0, 20000.0)
MOST_BEARINGS, SWEEP_STEPS = 7, 180
REPEATS, ENGINE_REPEATS = 3, 3
CYCLE = 4.0 * math.pi / RUNNING


def rounded(value: float) -> float:
    """The value to four significant digits."""
    return float(f"{value:.4g}")


def errors(films: Array, finest: Array) -> dict[str, float]:
    """RMS of the difference of forces, and of moments, over the cycle, over that of the finest."""
    difference = films - finest
    return {
        f"{name}_error": rounded(np.linalg.norm(difference[..., part]) / np.linalg.norm(finest[..., part]))
        for name, part in (("force", slice(0, 2)), ("moment", slice(2, 4)))
    }


def grid_part(engine: Engine, orbits: dict[str, Orbit], table: FilmTable, bore: BoreCompliance) -> dict[str, Any]:
    """Cost and error of one film against its grid, and of those that have none."""
    rigid, elastic = (orbits[level].journals(slice(JOURNAL, JOURNAL + 1)) for level in ("reynolds", "ehd"))

    def on(shapes: int, size: tuple[int, int]) -> OrbitFilms:
        return elastic_films(engine, elastic if shapes else rigid, softest(bore, shapes), ElasticGrid(*size))

    families: dict[str, tuple[Callable[[tuple[int, int]], OrbitFilms], Any, Any, Any]] = {
        "reynolds": (partial(rigid_films, engine, rigid), RIGID_GRIDS, RIGID_FINEST, RIGID_IN_LOOP),
        "elastic_0_shapes": (partial(on, 0), ELASTIC_GRIDS, ELASTIC_FINEST, None),
        f"elastic_{SHAPES}_shapes": (
            partial(on, SHAPES), ELASTIC_GRIDS, ELASTIC_FINEST, (ELASTIC_IN_LOOP.n_phi, ELASTIC_IN_LOOP.n_z),
        ),
    }  # fmt: skip
    cases: list[Callable[[], None]] = []
    rows: list[dict[str, Any]] = []
    result: dict[str, Any] = {}
    for name, (make, sizes, finest, in_loop) in families.items():
        reference = make(finest)
        reference.call()
        result[name] = []
        for size in sizes:
            films = make(size)
            films.call()
            # Nodes that carry an unknown: ends carry none.
            nodes = size[0] * (size[1] - 1 if name == "reynolds" else size[1])
            row = {"grid": list(size), "nodes": nodes, "in_loop": size == in_loop}
            rows.append(row | errors(films.forces, reference.forces))
            result[name].append(rows[-1])
            cases.append(films.call)
        if name == "reynolds":
            exact = reference.forces
    tabled = rigid_films(engine, rigid, table=table)
    tabled.call()
    mapped = plane_films(engine, rigid, "impedance")
    mapped.call()
    for name, films in (("table", tabled), ("impedance", mapped)):
        result[name] = errors(films.forces, exact)
        rows.append(result[name])
        cases.append(films.call)
    result["table"]["not_from_table"] = int(tabled.films.solved[0])
    for row, seconds in zip(rows, interleaved(cases, REPEATS), strict=True):
        row["us"] = rounded(1e6 * seconds / STEPS)
    return result


def shapes_part(engine: Engine, orbit: Orbit, bore: BoreCompliance) -> list[dict[str, Any]]:
    """Cost of an elastic film on the grid of the loop against the number of local shapes."""
    journal = orbit.journals(slice(JOURNAL, JOURNAL + 1))
    cases = [elastic_films(engine, journal, softest(bore, count)).call for count in SHAPE_COUNTS]
    return [
        {"shapes": count, "us": rounded(1e6 * seconds / STEPS)}
        for count, seconds in zip(SHAPE_COUNTS, interleaved(cases, REPEATS), strict=True)
    ]


def bearings_part(
    engine: Engine, orbits: dict[str, Orbit], table: FilmTable, bore: BoreCompliance
) -> dict[str, list[float]]:
    """Microseconds of one evaluation of the films of 1 to 7 equal journals on equal orbits."""

    def equal(level: str) -> Orbit:
        return orbits[level].journals(slice(JOURNAL, JOURNAL + 1)).repeated(MOST_BEARINGS)

    most = {
        "table": rigid_films(engine, equal("reynolds"), table=table),
        "reynolds": rigid_films(engine, equal("reynolds")),
        "ehd": elastic_films(engine, equal("ehd"), bore),
    }
    cases = [films.first(count, SWEEP_STEPS).call for films in most.values() for count in range(1, MOST_BEARINGS + 1)]
    taken = np.array(interleaved(cases, REPEATS)) * 1e6 / SWEEP_STEPS
    return {
        name: [rounded(us) for us in row]
        for name, row in zip(most, np.split(taken, len(most)), strict=True)
    }  # fmt: skip


class Cycle:
    """One cycle of a running simulation, the same at every call."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation, self.state = simulation, simulation.state
        self.counters = simulation.work.counters

    def __call__(self) -> None:
        """Run it from its start at communication steps of the default size."""
        simulation = self.simulation
        simulation.state = self.state
        self.counters[:] = 0.0
        step, begin = simulation.settings.step / RUNNING, simulation.time
        for k in range(round(CYCLE / step)):
            simulation.step(begin + (k + 1) * step)


def levels_part(engine: Engine, cycles: dict[str, Cycle], orbit: Orbit) -> dict[str, dict[str, Any]]:
    """Real-time factor of the engine by level, its films and the rest."""
    plane = [plane_films(engine, orbit, level).call for level in LEVELS[:2]]
    per_film = [seconds / (STEPS * orbit.count) for seconds in interleaved(plane, REPEATS)]
    taken = interleaved(list(cycles.values()), ENGINE_REPEATS)
    result = {}
    for k, (level, cycle) in enumerate(cycles.items()):
        steps, stages, iterations = cycle.counters[:3]
        row: dict[str, Any] = {
            "integrator": cycle.simulation.settings.integrator,
            "real_time_factor": rounded(taken[k] / CYCLE),
            "sub_steps": int(steps),
            "stages": int(stages),
            "evaluations_per_film": int(iterations),
            "rejected_steps": int(cycle.counters[3]),
        }
        if level in LEVELS[:2]:
            # Too short to be timed one by one: evaluations times cost.
            share = iterations * orbit.count * per_film[k] / taken[k]
        else:
            films = cycle.simulation.model.films
            outside = films.solved[0]
            with FilmTimer(films) as timer:
                began = time.perf_counter()
                cycle()
                share = timer.seconds / (time.perf_counter() - began)
                row |= timer.by_action(orbit.count)
            if level == "table":
                row["share_not_from_table"] = rounded((films.solved[0] - outside) / (iterations * orbit.count))
        row["films"] = rounded(share * row["real_time_factor"])
        row["rest"] = rounded((1.0 - share) * row["real_time_factor"])
        row["film_share"] = rounded(share)
        result[level] = row
    return result


def modes_part(engine: Engine) -> list[dict[str, Any]]:
    """Real-time factor against the number of crank modes, statics under the loads exact in each."""
    complete = complete_crankshaft(engine, reduced_crankshaft(engine))
    loaded = running_loads(engine)
    bodies = [truncate(complete, cutoff, loaded) for cutoff in CUTOFFS_HZ]
    cycles = [Cycle(started(engine, body, level)) for level in LEVELS[:2] for body in bodies]
    factors = np.split(np.array(interleaved(cycles, REPEATS)) / CYCLE, 2)
    return [
        {"modes": body.n_modes, "cutoff_hz": cutoff, **dict(zip(LEVELS[:2], map(rounded, pair), strict=True))}
        for body, cutoff, pair in zip(bodies, CUTOFFS_HZ, zip(*factors, strict=True), strict=True)
    ]


def measure() -> dict[str, Any]:
    """All parts."""
    engine, body = engine_and_body()
    table, _, _ = film_table(bearing_settings(engine.plain_mains))
    bore = bore_compliance(engine, SHAPES, with_motion=True)

    def say(what: str) -> None:
        print(f"film_cost: {what} ({time.process_time():.0f} s so far)", file=sys.stderr, flush=True)

    say("engine to its run-in")
    cycles = {level: Cycle(started(engine, body, level, table, bore)) for level in LEVELS}
    say("orbits")
    orbits = {level: engine_orbit(cycles[level].simulation) for level in ("reynolds", "ehd")}
    result: dict[str, Any] = {"speed_rpm": 2000, "modes": body.n_modes, "journal": f"main[{JOURNAL + 1}]"}
    say("grids")
    result["grids"] = grid_part(engine, orbits, table, bore)
    say("bore shapes")
    local = bore_compliance(engine, max(SHAPE_COUNTS))
    result["shapes"] = shapes_part(engine, orbits["reynolds"], local)
    say("bearings")
    result["bearings"] = bearings_part(engine, orbits, table, bore)
    say("levels")
    result["levels"] = levels_part(engine, cycles, orbits["reynolds"])
    say("crank modes")
    result["crank_modes"] = modes_part(engine)
    return result


def main() -> int:
    """Measure, draw, print."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else OUT / "film_cost.png"
    result = measure()
    draw(result, path)
    print(json.dumps({**result, "chart": path.name}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
