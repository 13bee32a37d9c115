"""Cranktrain, combustion and valve train as FMUs under the reference master: ``python benchmarks/virtual_engine.py``.

Of an engine (``[RPM [diesel_i6|diesel_v8 [WAY ...]]]``, and start values of the valve train, ``NAME=VALUE``), by
scheme, reconstruction and communication step in degrees of crank angle: RMS of the difference of the pulley's torsion
from the same physics at FINEST over the RMS of its alternating part there, over the last of CYCLES cycles; the error of
the mean shaft torque; the power residual; and processor time over simulated time. ``late`` is Jacobi's scheme as a
plain master has it: the combustion answers for the begin of the step, and the cranktrain holds what it gets. With
schemes ``intermediate`` and ``stages`` the cranktrain is an FMU of FMI 3.0; with ``stages`` nothing is reconstructed.
Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

import cranktrain as ct
from cranktrain.core.reduced_body import Array
from cranktrain_lab.coupling.modules import COMBUSTION, VALVETRAIN
from cranktrain_lab.coupling.run import Coupled, Steps, run
from cranktrain_lab.coupling.schemes import INSIDE
from cranktrain_lab.coupling.virtual_engine import Partners, summary, virtual_engine

CYCLES = 8
FINEST = 0.125
STEPS_DEG = 0.5, 0.75, 1.0, 1.5, 3.0
WAYS = {
    "gauss-seidel, own": ("gauss-seidel", "own", {}),
    "jacobi, own": ("jacobi", "own", {}),
    "iterative, own": ("iterative", "own", {}),
    "gauss-seidel, linear": ("gauss-seidel", "linear", {}),
    "jacobi, linear": ("jacobi", "linear", {}),
    "jacobi, quadratic": ("jacobi", "quadratic", {}),
    "gauss-seidel, hold": ("gauss-seidel", "hold", {}),
    "jacobi, hold": ("jacobi", "hold", {}),
    "jacobi, late": ("jacobi", "hold", {COMBUSTION: {"inputs.at": "end"}}),
    "intermediate, own": ("intermediate", "own", {}),
    "intermediate, linear": ("intermediate", "linear", {}),
    "intermediate, hold": ("intermediate", "hold", {}),
    "stages": ("stages", "own", {}),
}
MODULES = {"diesel_i6": ("combustion_i6", "valvetrain_i6"), "diesel_v8": ("combustion_v8", "valvetrain_v8")}
SAMPLES = round(720 / STEPS_DEG[-1])
"""Points of a cycle at which runs are compared: those that all communication steps meet."""


class Fmus(NamedTuple):
    """FMUs of an engine; ``calling`` is the cranktrain of FMI 3.0."""

    cranktrain: Path
    combustion: Path
    valvetrain: Path
    calling: Path


def built(name: str, folder: Path) -> Fmus:
    """An engine's FMUs, into a folder."""
    combustion, valvetrain = (ct.build_fmu(module, folder) for module in MODULES[name])
    calling = folder / "fmi3"
    calling.mkdir()
    cranktrains = [
        ct.build_fmu(name, where, film_table=False, block=False, fmi=fmi)
        for fmi, where in (("2.0", folder), ("3.0", calling))
    ]
    return Fmus(cranktrains[0], combustion, valvetrain, cranktrains[1])


def coupled(fmus: Fmus, speed: float, way: str, step_deg: float, train: dict[str, float]) -> tuple[Coupled, float]:
    """One run, and its processor time over simulated time; ``train`` are start values of the valve train."""
    scheme, reconstruction, own = WAYS[way]
    values = {**own, VALVETRAIN: train}
    step = math.radians(step_deg) / speed
    cranktrain = fmus.calling if scheme in INSIDE else fmus.cranktrain
    engine = virtual_engine(
        Partners(cranktrain, fmus.combustion, values, fmus.valvetrain), speed, scheme, reconstruction, step
    )
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
    name = sys.argv[2] if len(sys.argv) > 2 else "diesel_i6"
    if name not in MODULES:
        print(f"virtual_engine: no combustion ships for '{name}'; valid: {', '.join(MODULES)}", file=sys.stderr)
        return 2
    ways = [word for word in sys.argv[3:] if "=" not in word] or list(WAYS)
    try:
        train = {key: float(value) for key, sign, value in (word.partition("=") for word in sys.argv[3:]) if sign}
    except ValueError as error:
        print(f"virtual_engine: start values of the valve train are NAME=NUMBER: {error}", file=sys.stderr)
        return 2
    if not WAYS.keys() >= set(ways):
        print(f"virtual_engine: ways are {'; '.join(WAYS)}", file=sys.stderr)
        return 2
    speed = rpm * math.pi / 30.0
    with tempfile.TemporaryDirectory() as folder:
        fmus = built(name, Path(folder))
        finest, _ = coupled(fmus, speed, "gauss-seidel, own", FINEST, train)
        torsion, torque = (last_cycle(finest, f"cranktrain.{name}") for name in ("pulley.torsion", "shaft.torque"))
        swing = float(np.std(torsion))
        figures: dict[str, object] = {
            "finest": {"mean_torque": float(torque.mean()), "torsion_rms_mdeg": 1e3 * math.degrees(swing)}
        }
        for way in ways:
            rows = {}
            for step in STEPS_DEG:
                print(f"virtual engine: {way}, {step:g} deg", file=sys.stderr, flush=True)
                found, factor = coupled(fmus, speed, way, step, train)
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
