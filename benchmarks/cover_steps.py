"""Steps that the vibration of the block needs: ``python -m benchmarks.cover_steps [LEVEL...]``.

The six at 2000 rev/min in its flexible block, mains at each level. Each choice runs from the static equilibrium to the
fourth cycle, by rows of one degree or of its step where that is shorter. The acceleration of the cover there is
compared with that of ``esdirk47`` at ``FINEST`` degrees: RMS of the difference over the RMS of the alternating part.
Frequencies below which half and 99 % of the power lie are those of the reference. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
import time
from dataclasses import replace

import numpy as np

from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import Assembly, assemble

SPEED = 2000.0 * math.pi / 30.0
LEVELS, CYCLES, FINEST = ("impedance", "ehd"), 4, 0.25
CHOICES = [("esdirk3", 1.0), ("esdirk3", 0.5), ("esdirk4", 2.5), ("esdirk4", 1.0), ("esdirk47", 5.0), ("esdirk47", 2.5),
           ("esdirk47", 1.0), ("esdirk47", 0.5)]  # fmt: skip
OUTPUTS = "cover.acceleration", "pulley.torsion", "pulley.axial"
ROWS = 720


def cycle(made: Assembly, integrator: str, degrees: float) -> tuple[np.ndarray, float]:
    """Outputs (ROWS, 3) of the last cycle, and processor seconds per simulated second of all."""
    settings = replace(made.settings, integrator=integrator, step=math.radians(degrees), newton_tolerance=None)
    run = Simulation(made.engine, made.body, settings, None, made.parts)
    run.inputs[0] = SPEED
    run.initialize()
    count = max(ROWS, round(720.0 / degrees))
    h = 4.0 * math.pi / SPEED / count
    rows = np.empty((count, run.outputs.size))
    begin = time.process_time()
    for k in range(CYCLES):
        done = run.series(h, k * count + 1, rows)
        if done < count:
            run.step((k * count + done + 1) * h)  # says why
    used = time.process_time() - begin
    every = count // ROWS
    places = [run.output_names.index(name) for name in OUTPUTS]
    return rows[every - 1 :: every, places], used / (CYCLES * 4.0 * math.pi / SPEED)


def level(bearings: str) -> dict[str, object]:
    """Errors and costs of all choices."""
    made = assemble(load_engine("diesel_i6"), Settings(bearings=bearings, block="flexible"))
    best, _ = cycle(made, "esdirk47", FINEST)
    power = np.cumsum(np.abs(np.fft.rfft(best[:, 0]))[1:] ** 2)
    hz = SPEED / (4.0 * math.pi)
    below = {f"{share:.0%}": hz * (1 + int(np.searchsorted(power, share * power[-1]))) for share in (0.5, 0.99)}
    found: dict[str, object] = {"power_below_hz": below}
    for integrator, degrees in CHOICES:
        print(f"cover_steps: {bearings}, {integrator} {degrees:g} deg", file=sys.stderr, flush=True)
        series, cost = cycle(made, integrator, degrees)
        errors = np.sqrt(np.mean((series - best) ** 2, axis=0)) / np.std(best, axis=0)
        found[f"{integrator} {degrees:g}"] = {"of_real_time": cost, **dict(zip(OUTPUTS, errors.tolist(), strict=True))}
    return found


def main(names: list[str]) -> int:
    """Measure and print."""
    print(json.dumps({name: level(name) for name in names or LEVELS}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
