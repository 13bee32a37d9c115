"""Steps and modes that levels of the block's surfaces need: ``python -m benchmarks.noise_steps``.

The arguments ``[ENGINE [LEVEL [INTEGRATOR]]]`` name an engine or its file (the six by default), in its flexible block
at its best speed, the level of its mains and the integrator. Third-octave levels of the radiated power (efficiency 1)
are compared with those of a quarter of the default step, and with those of all the block's modes. Errors are the
largest of all bands with so many steps per period of their upper edge. The cost of recording is the processor time of a
recorded run over that of the same run without the block's rows. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np

from cranktrain.dynamics.simulation import Simulation, fitted_engine
from cranktrain.engine.file import load_engine
from cranktrain.results.strength.recorded_cycle import recorded_cycle
from cranktrain.studies.constant_speed import Request
from cranktrain_lab.noise.radiation import POWER_REFERENCE, level
from cranktrain_lab.noise.recording import recorded
from cranktrain_lab.noise.result import STEPS, NoiseResult
from cranktrain_lab.noise.study import CUTOFF_HZ, default_step, noise_assembly

CUTOFFS = (700.0, 1500.0, 2000.0, 2500.0, 3000.0, 6000.0)
COARSER = (4.0, 2.5, 1.0, 0.5)
"""Steps over the default one."""
REPEATS = 5


def say(text: str) -> None:
    """Print a line on stderr."""
    print(f"noise_steps: {text}", file=sys.stderr, flush=True)


def bands_of(result: NoiseResult, number: int) -> tuple[Any, Any]:
    """Upper edges (b,), Hz, and levels (b,), dB, of a result's run."""
    run = result.runs[number]
    bands = result.bands(run)
    power = bands.sums(run.frequency, result.power_lines(run, "one").sum(axis=0))
    return bands.high, level(power, POWER_REFERENCE)


def study(name: str, bearings: str = "auto", integrator: str | None = None) -> dict[str, Any]:
    """Errors by steps and by modes, and the cost of recording."""
    engine = load_engine(name)
    rpm = round(engine.best_speed * 30.0 / math.pi)
    request = Request(speed_rpm=rpm, block="flexible", bearings=bearings, integrator=integrator)  # type: ignore[arg-type]
    usual = default_step(rpm, CUTOFF_HZ)

    def silent(text: str) -> None:
        return None

    made, panels = noise_assembly(engine, request, CUTOFF_HZ, {}, say)
    found: dict[str, Any] = {
        "engine": engine.name,
        "bearings": made.settings.bearings,
        "integrator": made.settings.integrator,
        "speed_rpm": rpm,
        "step_deg": usual,
    }
    runs = []
    for share in (0.25, *COARSER):
        say(f"{engine.name}, {made.settings.bearings}: {share * usual:g} deg")
        begin = time.process_time()
        runs.append(recorded(made, request, None, share * usual, silent))
        found[f"seconds at {share:g} steps"] = round(time.process_time() - begin, 2)
    result = NoiseResult(panels, tuple(runs), CUTOFF_HZ)
    _, finest = bands_of(result, 0)
    for k, share in enumerate(COARSER, 1):
        high, own = bands_of(result, k)
        steps = len(runs[k].velocity) / (high * runs[k].period)
        errors = np.abs(own - finest[: own.size])
        for least in (2.0, STEPS, 8.0):
            kept = np.isfinite(own) & (steps >= least)
            found[f"error_db at {share:g} steps, {least:g} a period"] = round(float(errors[kept].max(initial=0.0)), 3)
    for cutoff in CUTOFFS:
        say(f"{engine.name}: modes to {cutoff:g} Hz")
        other, own_panels = noise_assembly(engine, request, cutoff, {}, silent)
        run = recorded(other, request, None, usual, silent)
        # Bands up to the default cut-off, whatever is kept.
        _, own = bands_of(NoiseResult(own_panels, (run,), CUTOFF_HZ), 0)
        found[f"modes to {cutoff:g} Hz"] = [round(float(value), 2) if np.isfinite(value) else None for value in own]
    found["cost_ratio"] = cost(made, request, usual)
    return found


def cost(made: Any, request: Request, degrees: float) -> float:
    """Processor time with the block's rows over that without, least of several runs each."""
    settings = replace(made.settings, step=math.radians(degrees))

    def plain() -> None:
        simulation = Simulation(made.engine, made.body, settings, None, made.parts)
        simulation.inputs[0] = request.speed
        recorded_cycle(simulation, fitted_engine(made.engine, settings), request.settle)

    def with_rows() -> None:
        recorded(made, request, None, degrees, lambda text: None)

    least = []
    for run in (plain, with_rows):
        seconds = []
        for _ in range(REPEATS):
            begin = time.process_time()
            run()
            seconds.append(time.process_time() - begin)
        least.append(min(seconds))
    return round(least[1] / least[0], 3)


def main(names: list[str]) -> int:
    """Measure and print."""
    print(json.dumps(study(*(names or ["diesel_i6"])), indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
