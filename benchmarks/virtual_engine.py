"""Cranktrain, combustion and valve train as FMUs under the reference master: ``python benchmarks/virtual_engine.py``.

Of the six, by scheme, reconstruction and communication step in degrees of crank angle: RMS of the difference of the
pulley's torsion from the same physics at FINEST over the RMS of its alternating part there, over the last of CYCLES
cycles; the error of the mean shaft torque; the power residual; and processor time over simulated time. ``late`` is
Jacobi's scheme as a plain master has it: the combustion answers for the begin of the step, and the cranktrain holds
what it gets. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import cranktrain as ct
from cranktrain.core.reduced_body import Array
from cranktrain.coupling.modules import COMBUSTION
from cranktrain.coupling.run import Coupled, Steps, run
from cranktrain.coupling.virtual_engine import Partners, summary, virtual_engine

CYCLES = 8
FINEST = 0.125
STEPS_DEG = 0.5, 1.0, 1.5, 3.0
WAYS = {
    "gauss-seidel, own": ("gauss-seidel", "own", {}),
    "jacobi, own": ("jacobi", "own", {}),
    "iterative, own": ("iterative", "own", {}),
    "gauss-seidel, linear": ("gauss-seidel", "linear", {}),
    "jacobi, linear": ("jacobi", "linear", {}),
    "jacobi, quadratic": ("jacobi", "quadratic", {}),
    "jacobi, hold": ("jacobi", "hold", {}),
    "jacobi, late": ("jacobi", "hold", {COMBUSTION: {"inputs.at": "end"}}),
}
SAMPLES = round(720 / STEPS_DEG[-1])
"""Points of a cycle at which runs are compared: those that all communication steps meet."""


def coupled(fmus: tuple[Path, Path, Path], speed: float, way: str, step_deg: float) -> tuple[Coupled, float]:
    """One run, and its processor time over simulated time."""
    scheme, reconstruction, values = WAYS[way]
    step = math.radians(step_deg) / speed
    engine = virtual_engine(Partners(*fmus[:2], values, fmus[2]), speed, scheme, reconstruction, step)
    master = engine.master()
    try:
        master.initialize()
        begin, stop = time.process_time(), CYCLES * 4.0 * math.pi / speed
        found = run(master, stop, Steps(step), engine.bonds)
        return found, (time.process_time() - begin) / stop
    finally:
        master.close()


def last_cycle(found: Coupled, name: str) -> Array:
    """An output at the common points of the last cycle, (SAMPLES,)."""
    every = (len(found.times) - 1) // (CYCLES * SAMPLES)
    return found.of(name)[::every][-SAMPLES:]


def main() -> int:
    """Measure and print."""
    rpm = float(sys.argv[1]) if len(sys.argv) > 1 else 2000.0
    speed = rpm * math.pi / 30.0
    with tempfile.TemporaryDirectory() as folder:
        fmus = (
            ct.build_fmu("diesel_i6", folder, film_table=False, block=False),
            ct.build_fmu("combustion_i6", folder),
            ct.build_fmu("valvetrain_i6", folder),
        )
        finest, _ = coupled(fmus, speed, "gauss-seidel, own", FINEST)
        torsion, torque = (last_cycle(finest, f"cranktrain.{name}") for name in ("pulley.torsion", "shaft.torque"))
        swing = float(np.std(torsion))
        figures: dict[str, object] = {
            "finest": {"mean_torque": float(torque.mean()), "torsion_rms_mdeg": 1e3 * math.degrees(swing)}
        }
        for way in WAYS:
            rows = {}
            for step in STEPS_DEG:
                print(f"virtual engine: {way}, {step:g} deg", file=sys.stderr, flush=True)
                found, factor = coupled(fmus, speed, way, step)
                off = last_cycle(found, "cranktrain.pulley.torsion") - torsion
                told = summary(found, speed)
                rows[f"{step:g}"] = {
                    "torsion": float(np.sqrt(np.mean(off**2))) / swing,
                    "mean_torque": float(last_cycle(found, "cranktrain.shaft.torque").mean() / torque.mean() - 1.0),
                    "residual_w": told["coupling_residual_w"],
                    "real_time_factor": factor,
                    "sweeps_per_step": found.sweeps / found.steps,
                }
            figures[way] = rows
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
