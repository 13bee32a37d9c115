"""The real engine at constant speed, run and judged alike in every benchmark: six cycles, the last one evaluated.

Outputs are kept every 3 degrees or the next multiple of the step, whatever the internal step, so no method pays for
more outputs than another. The error of a run is the RMS of the difference to the reference over the last cycle
divided by the RMS of the reference's alternating part.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median

import numpy as np
from numpy.typing import NDArray

from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.engine import Engine, load_engine
from cranktrain.reduced_body import ReducedBody
from cranktrain.structure.reduction import running_body

Array = NDArray[np.float64]

SPEED = 2000.0 * math.pi / 30.0
CYCLES = 6
COMMUNICATION_DEG = 3.0
GRID_DEG = 1.0
QUANTITIES = ("pulley.torsion", "pulley.axial")
REFERENCE_STEP_DEG, REFERENCE_TOLERANCE = 0.125, 1.0e-12
SIMULATED = CYCLES * 4.0 * math.pi / SPEED


@dataclass(frozen=True)
class Run:
    """Values (2, samples) of the two quantities at the ends of ``interval_deg`` over the last cycle, and what it took.

    ``process`` and ``wall`` are seconds per simulated second; ``counters`` those of the simulation's workspace.
    """

    values: Array
    interval_deg: float
    process: float
    wall: float
    counters: Array


def engine_and_body() -> tuple[Engine, ReducedBody]:
    """The in-line six and its crankshaft as the FMU carries it, from the cache where it is there."""
    engine = load_engine("diesel_i6")
    return engine, running_body(engine)


def started(engine: Engine, body: ReducedBody, settings: Settings) -> Simulation:
    """Simulation at the speed of the benchmarks, at its start."""
    simulation = Simulation(engine, body, settings)
    simulation.inputs[0] = SPEED
    simulation.initialize()
    return simulation


def run(engine: Engine, body: ReducedBody, settings: Settings, interval_deg: float | None = None) -> Run:
    """Run the six cycles; only the stepping is timed."""
    simulation = started(engine, body, settings)
    step_deg = math.degrees(settings.step)
    interval_deg = interval_deg or step_deg * math.ceil(COMMUNICATION_DEG / step_deg - 1.0e-9)
    per_cycle = round(720.0 / interval_deg)
    places = [simulation.output_names.index(name) for name in QUANTITIES]
    times = 4.0 * math.pi / SPEED / per_cycle * np.arange(1, CYCLES * per_cycle + 1)
    values = np.empty((times.size, 2))
    process, wall = time.process_time(), time.perf_counter()
    for k, t in enumerate(times):
        simulation.step(t)
        values[k] = simulation.outputs[places]
    process, wall = time.process_time() - process, time.perf_counter() - wall
    return Run(
        values[-per_cycle:].T, interval_deg, process / SIMULATED, wall / SIMULATED, simulation.work.counters.copy()
    )


def reference(engine: Engine, body: ReducedBody, bearings: str) -> tuple[Array, Array]:
    """Reference (2, 720), one value per degree, and how far it is from the run with twice the step, (2,)."""
    fine, coarse = (
        run(
            engine,
            body,
            Settings(
                bearings=bearings,
                integrator="sdirk4",
                step=math.radians(factor * REFERENCE_STEP_DEG),
                newton_tolerance=REFERENCE_TOLERANCE,
            ),
            GRID_DEG,
        )
        for factor in (1.0, 2.0)
    )
    return fine.values, errors(coarse.values, GRID_DEG, fine.values)


def errors(values: Array, interval_deg: float, exact: Array) -> Array:
    """Relative errors (2,) of values (2, samples) kept every ``interval_deg`` of the last cycle."""
    every = round(interval_deg / GRID_DEG)
    difference = values - exact[:, every - 1 :: every]
    return np.asarray(np.sqrt(np.mean(difference**2, axis=1)) / np.std(exact, axis=1))


def interleaved(cases: Sequence[Callable[[], Run]], repeats: int) -> list[tuple[Run, float, float]]:
    """Run all cases in turn, ``repeats`` times; each with the medians of its process and wall time per simulated s.

    In turn, because the machine's speed drifts: neighbours in a round see the same machine.
    """
    rounds = [[case() for case in cases] for _ in range(repeats)]
    return [
        (runs[0], median(r.process for r in runs), median(r.wall for r in runs)) for runs in zip(*rounds, strict=True)
    ]


def cost_at(error: float, found: Sequence[float], cost: Sequence[float]) -> float | None:
    """Cost at an error by log-log interpolation between runs (cheapest first); None where no run reaches it.

    Of runs with the same or more error at more cost none counts; nothing is extrapolated to smaller errors, and above
    the largest error the cheapest run stands.
    """
    front: list[tuple[float, float]] = []
    for e, c in sorted(zip(found, cost, strict=True), key=lambda pair: pair[1]):
        if not front or e < front[-1][0]:
            front.append((e, c))
    if front[0][0] <= error:
        return front[0][1]
    for (e0, c0), (e1, c1) in pairwise(front):
        if e1 <= error:
            share = math.log(e0 / error) / math.log(e0 / e1)
            return math.exp(math.log(c0) + share * math.log(c1 / c0))
    return None
