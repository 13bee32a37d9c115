"""Steady cycles of a run-up against the last of a long plain run: torsion, axial motion, forces, by tolerance.

    python benchmarks/long_run.py                                  # the six, 1000 to 2180 rev/min, impedance films
    python benchmarks/long_run.py --bearings table --speeds 1200 2000
    python benchmarks/long_run.py --tolerances 1e-4 1e-6 --cycles 120

Each speed starts from its neighbours 40 and 20 rev/min below, as in a run-up. Differences are RMS over the RMS of the
alternating part, the largest of a family of outputs; ``orders`` is the largest of any order over the largest order.
"""

from __future__ import annotations

import argparse
import json
import math
from typing import Any

import numpy as np

from cranktrain.dynamics.cycle_run import Result, output_judge, run_cycles
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.outputs.register import output_counts
from cranktrain.engine.file import load_engine
from cranktrain.results.orders.harmonics import order_amplitudes
from cranktrain.structure.assembly import Assembly, assemble
from cranktrain.studies.run_up.steady import CycleStart, Job, SteadyRuns

RPM = math.pi / 30.0
STEP = 20.0
SPEEDS = (1000.0, 1200.0, 1400.0, 1600.0, 1800.0, 2000.0, 2100.0, 2180.0)
SHOWN = ("pulley.torsion", "pulley.axial", "bearing.force", "thrust.force")
OUTPUTS = ("pulley.torsion", "pulley.axial", "shaft.torque")


def plain_run(runs: SteadyRuns, rpm: float, near: list[CycleStart], cycles: int) -> Result:
    """Plain cycles from the start of a speed in a run-up: its angle at time 0, which is free, is the same."""
    runs.enter(rpm * RPM, near)
    return run_cycles(runs.simulation, cycles, 1e-6, None, None)


def last_cycle(run: Result) -> dict[str, np.ndarray]:
    """Samples of the last cycle, by output."""
    return {name: values[-run.per_cycle :] for name, values in run.outputs.items()}


def differences(made: Assembly, found: Result, long: Result) -> dict[str, float]:
    """By family of outputs, and of the orders of torsion and axial motion."""
    one, other = last_cycle(found), last_cycle(long)
    judge = output_judge(output_counts(made.engine), {name: k for k, name in enumerate(other)})
    rows = [np.stack([cycle[name] for name in other], axis=1) for cycle in (other, one)]
    told = judge.left(*rows)
    for name in ("pulley.torsion", "pulley.axial"):
        a, b = (order_amplitudes(cycle[name], 24.0)[1] for cycle in (one, other))
        told[f"orders of {name}"] = float(np.abs(a - b).max() / np.abs(b).max())
    return told


def measured(runs: dict[float, SteadyRuns], made: Assembly, rpm: float, cycles: int) -> dict[str, Any]:
    """Figures of one speed, by the run-ups of each tolerance."""
    row: dict[str, Any] = {"speed_rpm": rpm}
    for tolerance, steady in runs.items():
        near = [steady.at((rpm - 2.0 * STEP) * RPM).start]
        near = [steady.at((rpm - STEP) * RPM, near).start, *near]
        long = plain_run(steady, rpm, near, cycles)
        found = steady.settled(rpm * RPM, near)
        told = differences(made, found, long)
        worst = max(told, key=lambda name: told[name])
        row[f"{tolerance:g}"] = {
            "cycles": found.settling.cycles,
            **{name: left for name, left in told.items() if name in SHOWN or name.startswith("orders")},
            "worst": [worst, told[worst]],
            "long_run_left": long.settling.worst[1],
        }
    return row


def main() -> None:
    """Print one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--engine", default="diesel_i6")
    parser.add_argument("--bearings", default="auto")
    parser.add_argument("--speeds", nargs="+", type=float, default=SPEEDS, metavar="RPM")
    parser.add_argument("--tolerances", nargs="+", type=float, default=[1e-4, 1e-5, 1e-6])
    parser.add_argument("--cycles", type=int, default=100, help="of the long run")
    chosen = parser.parse_args()
    made = assemble(load_engine(chosen.engine), Settings(bearings=chosen.bearings))
    runs = {tolerance: SteadyRuns(Job(made, None, tolerance, 24.0, OUTPUTS)) for tolerance in chosen.tolerances}
    rows = [measured(runs, made, rpm, chosen.cycles) for rpm in chosen.speeds]
    print(json.dumps({"engine": chosen.engine, "bearings": made.settings.bearings, "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
