"""What levels of film cost and how far their steps and grids are off: ``python benchmarks/film_levels.py``.

The six at 2000 rev/min, second cycle from the start. Each level at its defaults against the same with ``esdirk47`` at
0.5 degrees: real-time factor (processor time), largest difference of torsion and axial motion over their peak to peak,
relative difference of each main's least film (null where an edge touches), share of films solved outside the table. The
elastic film also on a finer grid of nodes and by another integrator. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np
from _engine_run import SPEED, engine_and_body

from cranktrain.dynamics.simulation import Parts, Settings, Simulation
from cranktrain.film.elastic.grid import ElasticGrid
from cranktrain.film.laws.ehd import SHAPES
from cranktrain.film.table.database import bearing_settings
from cranktrain.store.film_tables import film_table
from cranktrain.structure.block.saddle import bore_compliance

CYCLES, PER_CYCLE = 2.0, 288
FINE: dict[str, Any] = {
    "integrator": "esdirk47", "step": math.radians(0.5), "newton_tolerance": 3.0e-7, "film_change": 0.1,
}  # fmt: skip
FINE_GRID = ElasticGrid(96, 16, 0.3)


def main() -> int:
    """Measure and print."""
    engine, body = engine_and_body()
    table, _, _ = film_table(bearing_settings(engine.plain_mains))
    bore = bore_compliance(engine, SHAPES, with_motion=True)

    def run(level: str, grid: ElasticGrid | None = None, **choices: Any) -> dict[str, Any]:
        print(f"film_levels: {level} {choices}", file=sys.stderr, flush=True)
        parts = Parts(table=table, bore=replace(bore, grid=grid))
        simulation = Simulation(engine, body, Settings(bearings=level, **choices), parts=parts)
        simulation.inputs[0] = SPEED
        simulation.initialize()
        count, h = round(CYCLES * PER_CYCLE), 4.0 * math.pi / SPEED / PER_CYCLE
        series = np.empty((count, simulation.outputs.size))
        start = time.process_time()
        for k in range(count):
            simulation.step((k + 1) * h)
            series[k] = simulation.outputs
        used = time.process_time() - start
        place = {name: k for k, name in enumerate(simulation.output_names)}
        mains = range(1, len(engine.crankshaft.main_widths) + 1)
        films = series[:, [place[f"bearing[{i}].film_thickness_min"] for i in mains]]
        counters = simulation.work.counters
        return {
            "real_time_factor": used / (count * h),
            "steps": counters[0],
            "iterations_per_stage": counters[2] / counters[1],
            "outside_table": series[:, place["solver.online_films"]].sum() / (counters[2] * len(mains)),
            "torsion": series[-PER_CYCLE:, place["pulley.torsion"]],
            "axial": series[-PER_CYCLE:, place["pulley.axial"]],
            "least_film_um": 1e6 * films[-PER_CYCLE:].min(axis=0),
        }

    def against(this: dict[str, Any], exact: dict[str, Any]) -> dict[str, Any]:
        figures = {key: value for key, value in this.items() if np.ndim(value) == 0}
        for key in ("torsion", "axial"):
            figures[f"{key}_error"] = np.abs(this[key] - exact[key]).max() / np.ptp(exact[key])
        pairs = zip(this["least_film_um"], exact["least_film_um"], strict=True)
        figures["least_film_um"] = this["least_film_um"].round(3).tolist()
        figures["least_film_error"] = [mine / its - 1.0 if min(mine, its) > 0.0 else None for mine, its in pairs]
        return figures

    result = {}
    for level in ("impedance", "table", "reynolds", "ehd", "ehd:fine"):
        fine = run(level, **FINE)
        usual = run(level)
        result[level] = against(usual, fine)
    result["ehd:fine, finer grid against the usual"] = against(usual, run("ehd:fine", FINE_GRID))
    result["ehd:fine, esdirk47"] = against(run("ehd:fine", integrator="esdirk47"), fine)
    print(json.dumps(result, default=float))
    return 0


if __name__ == "__main__":
    sys.exit(main())
