"""Cycles until the outputs repeat, plain and corrected, and what a run says is left against what is.

    python benchmarks/settling.py                         # both engines and blocks, 1000 to 2600 rev/min
    python benchmarks/settling.py --engines diesel_i6 --blocks ground --speeds 2000 2380

The truth is the same run settled to 1e-7. Plain cycles are counted until the worst family is within 1e-2, 1e-3
and 1e-4 of it; corrected ones as a run with that tolerance ends by its own estimate.
"""

from __future__ import annotations

import argparse
import json
import math
from typing import Any

import numpy as np

from cranktrain.dynamics.cycle_run import Result, output_judge
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.outputs.register import output_counts
from cranktrain.dynamics.settled.judging import Judge
from cranktrain.dynamics.simulation import simulate
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import assemble

TOLERANCES = (1.0e-2, 1.0e-3, 1.0e-4)
EXACT = 1.0e-7
PLAIN = 60
SPEEDS = (1000.0, 1400.0, 1600.0, 1800.0, 2000.0, 2120.0, 2200.0, 2380.0, 2600.0)


def cycles_of(result: Result) -> np.ndarray:
    """Outputs by cycle, (cycles, samples, outputs)."""
    rows = np.stack(list(result.outputs.values()), axis=1)[1:]
    return rows.reshape(-1, result.per_cycle, rows.shape[1])


def worst(judge: Judge, rows: np.ndarray, exact: np.ndarray) -> float:
    """Largest difference of a family."""
    return max(judge.left(exact, rows).values())


def measured(engine_name: str, block: str, speed_rpm: float) -> dict[str, Any]:
    """Figures of one engine, block and speed."""
    made = assemble(load_engine(engine_name), Settings(block=block))

    def run(cycles: int | None = None, settle: float = TOLERANCES[1]) -> Result:
        speed = speed_rpm * math.pi / 30.0
        return simulate(made.engine, made.body, made.settings, speed, cycles, parts=made.parts, settle=settle)

    row: dict[str, Any] = {"engine": engine_name, "block": block, "speed_rpm": speed_rpm}
    truth = run(settle=EXACT)
    if truth.settling.repeats != 1:
        found = run().settling
        return row | {"repeats_every_cycles": found.repeats, "cycles": found.cycles, "estimated_left": found.worst[1]}
    row["repeats_every_cycles"] = 1
    exact = cycles_of(truth)[-1]
    judge = output_judge(output_counts(made.engine), {name: i for i, name in enumerate(truth.outputs)})
    errors = [worst(judge, cycle, exact) for cycle in cycles_of(run(PLAIN))]
    for tolerance in TOLERANCES:
        corrected = run(settle=tolerance)
        within = [k + 1 for k, error in enumerate(errors) if error <= tolerance]
        row[f"{tolerance:g}"] = {
            "plain": within[0] if within else None,
            "corrected": corrected.settling.cycles,
            "estimated_left": corrected.settling.worst[1],
            "true_left": worst(judge, cycles_of(corrected)[-1], exact),
        }
    return row | {"sixth_plain_cycle": errors[5]}


def main() -> None:
    """Print one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--engines", nargs="+", default=["diesel_i6", "diesel_v8"])
    parser.add_argument("--blocks", nargs="+", default=["ground", "flexible"])
    parser.add_argument("--speeds", nargs="+", type=float, default=SPEEDS, metavar="RPM")
    chosen = parser.parse_args()
    rows = [measured(e, block, rpm) for e in chosen.engines for block in chosen.blocks for rpm in chosen.speeds]
    print(json.dumps({"rows": rows}, indent=1))


if __name__ == "__main__":
    main()
