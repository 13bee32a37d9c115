"""Combustion beside the cranktrain: ``python benchmarks/combustion_coupling.py [torsional|solid]``, scheme by step.

Both simulations, which the FMUs step as well, exchange angle, speed, volumes and pressures at 2000 rev/min.
``jacobi``: both step at once and combustion turns the angle on (``inputs.at = begin``); ``gauss-seidel``: the
cranktrain steps first and combustion takes its angle (``end``); ``late``: both step at once, the angle is not turned on
and the cranktrain is not told which angle the pressures belong to, which is wrong.
Of each, by communication step in degrees of crank angle, over a cycle after CYCLES cycles: RMS of the difference of the
pulley's torsion from a Gauss–Seidel run at ``FINE_DEG`` over the RMS of its alternating part, and the error of the mean
shaft torque. ``indicated_nm`` is combustion's own mean torque, ``real_time_factor`` processor time over simulated time,
of both together. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
import time
from dataclasses import dataclass, replace

import numpy as np

import cranktrain as ct
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.modules.combustion.file import load
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.register import module_files

SPEED = 2000.0 * math.pi / 30.0
STEPS_DEG = 0.5, 1.0, 2.0, 4.0
FINE_DEG = 0.125
CYCLES = 16
SAMPLES = round(720 / STEPS_DEG[-1])
"""Points of a cycle at which runs are compared: those that all communication steps meet."""
NAMES = "crank.angle", "crank.speed", "pulley.torsion", "shaft.torque"
DEVIATIONS, TAKEN = ("volume_deviation", "volume_deviation_rate"), "deviation_taken"


@dataclass(frozen=True)
class Scheme:
    """How a master steps the two: cranktrain first or both at once; what combustion makes of the angle, and tells."""

    crank_first: bool
    inputs_at: str
    tells: bool = True


SCHEMES = {"jacobi": Scheme(False, "begin"), "gauss-seidel": Scheme(True, "end"), "late": Scheme(False, "end", False)}


def run(level: str, step_deg: float, scheme: Scheme) -> tuple[Array, Array, float, float]:
    """Torsion (rad) and shaft torque (N m) of the last cycle, (SAMPLES,), real-time factor, indicated torque (N m)."""
    assembly = ct.assemble(ct.load_engine("diesel_i6"), Settings(crank=level, gas_source="input"))
    crank = Simulation(assembly.engine, assembly.body, assembly.settings, parts=assembly.parts)
    settings = replace(load(module_files()["combustion_i6"]), inputs_at=scheme.inputs_at, angle_source="input")
    gas = CombustionSimulation(settings)
    crank.inputs[0] = gas.inputs[0] = SPEED
    gas.initialize()
    cylinders = [f"cylinder[{i + 1}]." for i in range(gas.n_cylinders)]
    own = ["pressure.angle", *(head + name for name in ("pressure", TAKEN) for head in cylinders)]
    back = ["crank.angle", "crank.speed", *(head + name for name in DEVIATIONS for head in cylinders)]
    given, taken = (list(map(names.index, own)) for names in (gas.output_names, crank.input_names))
    motion, moved = (list(map(names.index, back)) for names in (crank.output_names, gas.input_names))
    shown = [crank.output_names.index(name) for name in NAMES]
    crank.inputs[taken] = gas.outputs[given]
    crank.initialize()
    h = math.radians(step_deg) / SPEED
    count = round(720 / step_deg)
    kept = np.empty((count, len(NAMES)))
    begin = time.process_time()
    for k in range(CYCLES * count):
        found = crank.outputs[motion]
        crank.inputs[taken] = gas.outputs[given]
        crank.inputs[taken[0]] *= scheme.tells
        crank.step((k + 1) * h)
        gas.inputs[moved] = crank.outputs[motion] if scheme.crank_first else found
        gas.step((k + 1) * h)
        kept[k % count] = crank.outputs[shown]
    factor = (time.process_time() - begin) / (CYCLES * count * h)
    every = count // SAMPLES
    _, _, torsion, torque = kept[every - 1 :: every].T
    return torsion, torque, factor, float(gas.outputs[gas.output_names.index("indicated.torque_mean")])


def main() -> int:
    """Measure and print."""
    level = sys.argv[1] if len(sys.argv) > 1 else "torsional"
    torsion, torque, _, indicated = run(level, FINE_DEG, SCHEMES["gauss-seidel"])
    swing, mean = float(np.std(torsion)), float(torque.mean())
    figures: dict[str, object] = {
        "reference": {"mean_torque_nm": mean, "indicated_nm": indicated, "torsion_rad": swing}
    }
    for name, scheme in SCHEMES.items():
        rows = {}
        for step in STEPS_DEG:
            print(f"combustion_coupling: {name}, {step:g} deg", file=sys.stderr, flush=True)
            found, load_torque, factor, _ = run(level, step, scheme)
            rows[f"{step:g}"] = {
                "torsion": float(np.sqrt(np.mean((found - torsion) ** 2))) / swing,
                "mean_torque": float(load_torque.mean()) / mean - 1.0,
                "real_time_factor": factor,
            }
        figures[name] = rows
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
