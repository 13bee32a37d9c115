"""What added bodies and connections cost: ``python -m benchmarks.additions``.

The six with a crank of beams on ground and so many discs of their own, each driven by the crank through a gear mesh and
held by springs along and about all axes: eight components a disc. Runs take turns, a cycle of 720 degrees each time;
medians of the processor time of a cycle over that without discs, and what a disc adds, which grows as components join
a dense Newton matrix. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import time

import numpy as np

import cranktrain as ct
from cranktrain.dynamics.simulation import Simulation

SPEED = 2000.0 * math.pi / 30.0
SAMPLES = 144


def topology(discs: int, z: float) -> ct.Topology:
    """So many discs round the crank, each twice as fast."""
    frames, bodies, links = [], [], []
    for k in range(discs):
        angle, name = 2.0 * math.pi * k / max(discs, 1), f"disc[{k + 1}]"
        frames.append(ct.Frame(name, -2.0, axis=(0.24 * math.cos(angle), 0.24 * math.sin(angle))))
        body = ct.rigid_body(name, 5.0, np.diag([0.03, 0.03, 0.05]), (0.0, 0.0, -z), {"gear": (0.0, 0.0, -z)})
        bodies.append(ct.Body(name, body, name))
        ends = ct.End("crank", "flywheel"), ct.End(name, "gear")
        links.append(ct.Connection(f"mesh {k}", "gear_mesh", ends, {"stiffness": 2e8, "damping": 1e4}))
        held = {
            "stiffness": (1e8, 1e8, 1e7), "damping": (2e4, 2e4, 1e3),
            "turning_stiffness": (1e6, 1e6, 1.0), "turning_damping": (1e2, 1e2, 0.1),
        }  # fmt: skip
        links.append(ct.Connection(f"held {k}", "spring", (ct.End(name, "gear"), ct.End("ground")), held))
    return ct.Topology(tuple(frames), tuple(bodies), tuple(links))


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.additions", description=__doc__)
    parser.add_argument("--discs", type=int, nargs="+", default=(1, 2, 4, 8))
    parser.add_argument("--laps", type=int, default=11)
    chosen = parser.parse_args()
    made = ct.assemble(ct.load_engine("diesel_i6"), ct.Settings(crank="beam", block="ground"), inherit=False)
    z = float(made.body.positions[made.body.index("flywheel"), 2])
    runs, step = {}, 4.0 * math.pi / SPEED / SAMPLES
    for count in (0, *chosen.discs):
        run = Simulation(made.engine, made.body, made.settings, None, made.parts._replace(topology=topology(count, z)))
        run.inputs[0] = SPEED
        run.initialize()
        runs[count] = run
    times: dict[int, list[float]] = {count: [] for count in runs}
    iterations = dict.fromkeys(runs, 0.0)
    for lap in range(chosen.laps + 1):
        for count, run in runs.items():
            rows = np.zeros((SAMPLES, run.outputs.size))
            begin = time.process_time()
            run.series(step, lap * SAMPLES + 1, rows)
            if lap > 0:
                times[count].append(time.process_time() - begin)
                iterations[count] = float(run.work.counters[2]) / (lap + 1)
    medians = {count: statistics.median(found) for count, found in times.items()}
    found = {
        str(count): {
            "of_none": round(medians[count] / medians[0], 2),
            "added_a_disc": round((medians[count] / medians[0] - 1.0) / count, 2),
            "iterations_a_cycle": round(iterations[count]),
        }
        for count in chosen.discs
    }
    print(json.dumps({"ms_a_cycle_without": round(1e3 * medians[0], 2), "discs": found}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
