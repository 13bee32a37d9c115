"""Cost and errors of communication points that are finer than the internal step: through FMPy at 12,000 rows a second.

``python benchmarks/dense_output.py [ENGINE [LEVEL=VALUE …]]`` builds the native FMU of an engine, ``diesel_i6`` without
one, and runs it with ``fmpy.simulate_fmu`` at 2000 rev/min, one row each degree, ``solver.dense_output`` on and off.
Parameters follow as ``block.level=flexible``. Prints one JSON object: processor seconds to a second of engine (the
slope between a short and a longer run, so the start does not count), and errors of some outputs, root mean square over
their range, against a run of a tenth of the step, over the second cycle.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, simulate_fmu

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from cranktrain.fmu.build import build_fmu

ROWS, CYCLE = 12_000, 0.06
"""Rows a second, and seconds of a cycle at 2000 rev/min."""
SHORT, LONG, TIMES = 0.05, 0.55, 3
FINE = {"solver.step": 0.1 * 0.04363323129985824, "solver.dense_output": "off"}
OUTPUTS = (
    "pulley.torsion", "flywheel.torsion", "shaft.torque", "bearing[2].force.x", "bearing[2].force.y",
    "bearing[2].film_thickness_min", "big_end[1].force.y", "torque.friction",
)  # fmt: skip


def run(folder: str, stop: float, values: dict[str, Any]) -> tuple[float, Any]:
    """Processor seconds of a run, and its rows."""
    begin = time.process_time()
    found = simulate_fmu(
        folder, stop_time=stop, output_interval=1.0 / ROWS, output=OUTPUTS, start_values=values, validate=False
    )
    return time.process_time() - begin, found


def cost(folder: str, values: dict[str, Any]) -> float:
    """Processor seconds to a second of engine."""
    short, long = (min(run(folder, stop, values)[0] for _ in range(TIMES)) for stop in (SHORT, LONG))
    return (long - short) / (LONG - SHORT)


def errors(folder: str, values: dict[str, Any], fine: Any) -> dict[str, float]:
    """Of each output over the second cycle, root mean square over its range."""
    found = run(folder, 2.0 * CYCLE, values)[1]
    last = slice(round(CYCLE * ROWS), None)
    return {
        name: round(float(np.sqrt(np.mean((found[name][last] - fine[name][last]) ** 2)) / np.ptp(fine[name][last])), 6)
        for name in OUTPUTS
        if np.ptp(fine[name][last]) > 0.0
    }


def main(engine: str = "diesel_i6", *levels: str) -> int:
    """Measure and print."""
    values: dict[str, Any] = dict(level.split("=", 1) for level in levels)
    films = values.get("bearing.level") == "table"
    with tempfile.TemporaryDirectory() as place:
        slow = {"table": films, "flexible": values.get("block.level") == "flexible"}
        parts = {"levels": [level for level, wanted in slow.items() if wanted] or "usual"}
        path = build_fmu(engine, Path(place), platforms=("linux64",), **parts)
        folder = extract(str(path))
        fine = run(folder, 2.0 * CYCLE, values | FINE)[1]
        figures = {
            dense: {
                "processor_seconds_per_second": round(cost(folder, chosen), 3),
                "errors": errors(folder, chosen, fine),
            }
            for dense in ("on", "off")
            for chosen in (values | {"solver.dense_output": dense},)
        }
    print(json.dumps({"engine": engine, "levels": values, "rows_per_second": ROWS, "dense_output": figures}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
