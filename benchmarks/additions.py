"""What added bodies and connections cost: ``python -m benchmarks.additions``.

The six with a crank of beams on ground and so many discs of their own, each driven by the crank through a gear mesh and
held by springs along and about all axes: eight components a disc; or with so many of its own rods and pistons as bodies
of their own, on springs and under the cylinder's gas: fifteen components a rod. Runs take turns, a cycle of 720 degrees
each time; medians of the processor time of a cycle over that without, and what one more adds, which grows as components
join a dense Newton matrix. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import time
from dataclasses import replace

import numpy as np

import cranktrain as ct
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.model import Engine

SPEED = 2000.0 * math.pi / 30.0
SAMPLES = 144


def with_rods(count: int, engine: Engine, crank: ReducedBody) -> ct.Topology:
    """The first rods and pistons as bodies."""
    frames, bodies, links, rod, ground = [], [], [], engine.rod, ct.End("ground")
    held = {"turning_stiffness": (1e4, 1e4, 0.0), "turning_damping": (10.0, 10.0, 0.0)}
    for c in range(1, count + 1):
        x, y, z = crank.positions[crank.index(f"pin[{engine.cylinders.pins[c - 1]}]")].tolist()
        slider = ct.Slider((x, y), rod.length, cylinder=c)
        frames += [ct.Frame(f"r{c}", 1.0, slider=slider), ct.Frame(f"p{c}", 1.0, slider=replace(slider, piston=True))]
        mass = rod.big_end_mass + rod.small_end_mass
        inertia = rod.inertia * np.diag([1.0, 0.2, 1.0])
        ends = {"big": (0.0, 0.0, z), "small": (0.0, rod.length, z)}
        centre = (0.0, rod.small_end_mass / mass * rod.length, z)
        bodies.append(ct.Body(f"rod[{c}]", ct.rigid_body(f"rod[{c}]", mass, inertia, centre, ends), f"r{c}"))
        piston = ct.rigid_body("p", engine.cylinders.piston_mass, 1e-3 * np.eye(3), (0, 0, z), {"pin": (0, 0, z)})
        bodies.append(ct.Body(f"piston[{c}]", piston, f"p{c}"))
        pin, big = ct.End("crank", f"pin[{engine.cylinders.pins[c - 1]}]"), ct.End(f"rod[{c}]", "big")
        small, own = ct.End(f"rod[{c}]", "small"), ct.End(f"piston[{c}]", "pin")
        joint = {"stiffness": (2e9, 2e9, 1e6), "damping": (2e4, 2e4, 1e2)}
        guide = {"stiffness": (5e8, 0.0, 1e6), "damping": (1e4, 0.0, 1e2), "turning_stiffness": (1e4, 1e4, 1e5)}
        links += [
            ct.Connection(f"big {c}", "spring", (pin, big), joint | held),
            ct.Connection(f"small {c}", "spring", (own, small), joint),
            ct.Connection(f"guide {c}", "spring", (own, ground), guide),
            ct.Connection(f"gas {c}", "gas", (own, ground), {"bore": engine.cylinders.bore, "cylinder": c}),
        ]
    return ct.Topology(tuple(frames), tuple(bodies), tuple(links))


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
    parser.add_argument("--rods", type=int, nargs="+", default=(1, 3, 6))
    parser.add_argument("--laps", type=int, default=11)
    chosen = parser.parse_args()
    made = ct.assemble(ct.load_engine("diesel_i6"), ct.Settings(crank="beam", block="ground"), inherit=False)
    z = float(made.body.positions[made.body.index("flywheel"), 2])
    runs, step = {}, 4.0 * math.pi / SPEED / SAMPLES
    tops = {("discs", count): topology(count, z) for count in (0, *chosen.discs)}
    tops |= {("rods", count): with_rods(count, made.engine, made.body) for count in chosen.rods}
    for count, top in tops.items():
        run = Simulation(made.engine, made.body, made.settings, None, made.parts._replace(topology=top))
        run.inputs[0] = SPEED
        run.initialize()
        runs[count] = run
    times: dict[tuple[str, int], list[float]] = {count: [] for count in runs}
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
    none = medians["discs", 0]
    found: dict[str, dict[str, dict[str, float]]] = {"discs": {}, "rods": {}}
    for kind, count in list(medians)[1:]:
        over = medians[kind, count] / none
        found[kind][str(count)] = {
            "of_none": round(over, 2),
            "added_by_one": round((over - 1.0) / count, 2),
            "iterations_a_cycle": round(iterations[kind, count]),
        }
    print(json.dumps({"ms_a_cycle_without": round(1e3 * none, 2)} | found, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
