"""How the thrust collar of the six moves at high speeds, and what decides it: ``python -m benchmarks.collar``.

Level ``impedance``, to the end of settling or 48 cycles, with one value changed at a time. Of each case: after how many
cycles the run repeats (0: not), how far the collar goes to either side, the pulley's axial range of each recorded cycle
and the largest thrust force. ``growth`` shifts the crank by 1 nm along its axis and tells by how much its axial motion
then differs, over the RMS of its alternating part, in each of the next cycles. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np
from benchmarks._engine_run import engine_and_body

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.model.state import POSITION, offset
from cranktrain.dynamics.settled.cycles import Recorder
from cranktrain.dynamics.simulation import Simulation, simulate
from cranktrain.engine.model import Engine
from cranktrain.film.laws import thrust

RPM = math.pi / 30.0
BEFORE, AFTER, SHIFT = 12, 8, 1.0e-9
"""Cycles before the crank is shifted and after, and by how much, m."""


def cases(engine: Engine) -> dict[str, tuple[Engine, Settings]]:
    """One change at a time."""
    usual = Settings()

    def collar(**changes: float) -> tuple[Engine, Settings]:
        return replace(engine, thrust=replace(engine.thrust, **changes)), usual

    return {
        "as it is": (engine, usual),
        "step 0.5 deg": (engine, replace(usual, step=math.radians(0.5))),
        "sdirk4, 1 deg": (engine, replace(usual, integrator="sdirk4", step=math.radians(1.0))),
        "film does not rupture": (engine, usual),
        "clearance 0.15 mm": collar(clearance=0.15e-3),
        "clearance 0.3 mm": collar(clearance=0.3e-3),
        "taper 10 um": collar(taper=10.0e-6),
        "contact damping x 10": collar(damping=10.0 * engine.thrust.damping),
        "structural damping 4 %": (replace(engine, damping=replace(engine.damping, ratio=0.04)), usual),
        "oil 80 degC": (engine, replace(usual, oil_temperature=353.15)),
    }


def moved(engine: Engine, body: ReducedBody, settings: Settings, speed: float) -> dict[str, Any]:
    """Figures of one case at a speed (rad/s)."""
    run = simulate(engine, body, settings, speed)
    place, force = run.outputs["thrust.displacement"], run.outputs["thrust.force"]
    axial = run.outputs["pulley.axial"][1:].reshape(-1, run.per_cycle)
    return {
        "repeats_every_cycles": run.settling.repeats,
        "cycles": run.settling.cycles,
        "collar_um": [1e6 * float(place.min()), 1e6 * float(place.max())],
        "pulley_range_um": (1e6 * np.ptp(axial, axis=1)).tolist(),
        "force_kn": 1e-3 * float(np.abs(force).max()),
    }


def growth(engine: Engine, body: ReducedBody, speed: float) -> list[float]:
    """Difference of two runs by cycle, one of which is shifted."""
    runs = []
    start = None
    for shift in (0.0, SHIFT):
        simulation = Simulation(engine, body, Settings())
        simulation.inputs[0] = speed
        simulation.initialize()
        h = communication_step(speed, simulation.settings.step)
        recorder = Recorder(simulation, h, round(4.0 * math.pi / speed / h))
        if start is None:
            recorder.cycles(BEFORE)
            start = simulation.state
        state = start.copy()
        thrust_port = simulation.model.ports[2 * simulation.model.bearings.shape[0], :6]
        first = offset(POSITION, simulation.model.omega2.size)
        state[first : first + 6] += shift * thrust_port / (thrust_port @ thrust_port)
        simulation.state = state
        rows = np.empty((AFTER * recorder.per_cycle, simulation.outputs.size))
        recorder.take(rows, BEFORE * recorder.per_cycle)
        axial = rows[:, simulation.output_names.index("pulley.axial")]
        runs.append(axial.reshape(AFTER, -1))
    apart = np.sqrt(np.mean((runs[1] - runs[0]) ** 2, axis=1)) / np.std(runs[0], axis=1)
    return [float(value) for value in apart]


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.collar", description=__doc__)
    parser.add_argument("--speeds", type=float, nargs="+", default=[2200.0, 2380.0, 2600.0], metavar="N")
    chosen = parser.parse_args()
    engine, body = engine_and_body()
    ambient = thrust.AMBIENT
    result: dict[str, Any] = {}
    for rpm in chosen.speeds:
        rows: dict[str, Any] = {"growth": growth(engine, body, rpm * RPM)}
        for name, (changed, settings) in cases(engine).items():
            thrust.AMBIENT = 1e9 if name == "film does not rupture" else ambient
            rows[name] = moved(changed, body, settings, rpm * RPM)
            print(f"collar: {rpm:g} rev/min, {name}: {rows[name]}", file=sys.stderr, flush=True)
        result[f"{rpm:g}"] = rows
    print(json.dumps(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
