"""Settled runs of the total-error study: last cycle, its change by one more cycle, and cost per simulated time.

A run continues until its outputs repeat, as in ``cranktrain simulate``. A reference run has expensive cycles; it starts
from the settled motion of the same run with a long step on the usual grid. Cycles without correction follow, with all
films solved anew. The first of them gives the settling error, and the median of their processor times is the cost of a
settled cycle. Finished runs are stored at once.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

import numpy as np

from cranktrain.core.errors import CranktrainError
from cranktrain.core.reduced_body import Array
from cranktrain.core.types import Progress
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.model.state import SHAFT_ANGLE
from cranktrain.dynamics.motion.film_memory import memory_offset
from cranktrain.dynamics.settled.judging import TOLERANCE
from cranktrain.dynamics.settled.motion import motion_of, put_motion
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.model import Engine
from cranktrain.film.elastic.grid import ElasticGrid
from cranktrain.results.whole_run import whole
from cranktrain.store.kept import Kept, digest
from cranktrain.structure.assembly import assemble
from cranktrain.studies.total_error.families import Cycle, wanted
from cranktrain_lab.tradeoff.runs import at_start, timed

FINE_SETTLE = 3.0e-4
"""Largest settling error of reference runs, as a fraction."""
FINE_GRID = ElasticGrid(96, 16, 0.3)
"""Grid of elastic films in reference runs. Least film heights differ by up to 3 % from a grid of 96 x 24 (the
shipped six at 2000 rev/min)."""
TIMED_SECONDS, TIMED_CYCLES, FEWEST_CYCLES = 0.4, 20, 3
"""Processor seconds, largest and least number of cycles in the timing of cycles without correction."""
COARSE_DEG = 4.0
"""Step (degrees) of the coarse run whose settled motion is the start of a reference run."""
SLOW = 2.0
"""Processor seconds of a cycle above which the cycle is timed only once."""


@dataclass(frozen=True)
class Job:
    """Input of one settled run.

    ``reference``: settle to ``FINE_SETTLE`` from the motion at a long step, without cycles that follow; ``fine_grid``:
    use ``FINE_GRID``.
    """

    engine: Engine
    speed: float
    settings: Settings
    reference: bool = False
    fine_grid: bool = False


@dataclass(frozen=True)
class Settled:
    """Stored data of a run.

    Attributes
    ----------
    last, after : last cycle, and the cycle without correction that follows, see :data:`.families.Cycle`; both are the
        last cycle if none follows
    cost : processor seconds per simulated second of a settled cycle with all films solved anew; the mean of the whole
        run if no cycle follows
    seconds : processor seconds of the whole run until its outputs repeated
    cycles, repeats : number of cycles of this run, and period of its motion in cycles, 0 if it is not periodic
    """

    last: Cycle
    after: Cycle
    cost: float
    seconds: float
    cycles: int
    repeats: int


def settled(job: Job, store: Kept, say: Progress | None = None) -> Settled:
    """Return a run from the store, or run it; raises ``CranktrainError`` for a failed run (failures are stored too)."""
    key = digest(__file__, job)
    failed = store.entry(key)
    if failed is not None:
        raise CranktrainError(failed["failed"])
    kept = store.arrays(key)
    if kept is None:
        try:
            kept = _run(job, say or (lambda stage: None))
        except CranktrainError as problem:
            store.keep(key, {"failed": " ".join(str(problem).split())})
            raise
        store.keep_arrays(key, kept)
    names = [str(name) for name in kept["names"]]
    cost, seconds, cycles, repeats = kept["figures"].tolist()
    last, after = (dict(zip(names, kept[part], strict=True)) for part in ("last", "after"))
    return Settled(last, after, cost, seconds, int(cycles), int(repeats))


def _run(job: Job, say: Progress) -> dict[str, Array]:
    """Run a job and return the arrays to store: output names, last and following cycle, and figures of cost."""
    made = assemble(job.engine, job.settings, say=say)
    parts = made.parts
    if job.fine_grid and parts.bore is not None:
        parts = parts._replace(bore=replace(parts.bore, grid=FINE_GRID))
    simulation = at_start(made, made.settings, job.speed, parts=parts)
    if job.reference:
        coarse = at_start(made, replace(made.settings, step=math.radians(COARSE_DEG)), job.speed)
        whole(run_cycles(coarse, None, TOLERANCE, None, None))
        _go_on_from(simulation, coarse)
    begin = time.process_time()
    result = whole(run_cycles(simulation, None, FINE_SETTLE if job.reference else TOLERANCE, None, None))
    seconds = time.process_time() - begin
    shown = set(simulation.shown_outputs)
    names = [name for name in wanted(job.engine) if name in shown]
    places = [simulation.output_names.index(name) for name in names]
    last = np.array([result.outputs[name][-result.per_cycle :] for name in names])
    after, cost = last, seconds / (result.settling.cycles * result.per_cycle * result.step)
    if not job.reference:
        rows, cost = _plain_cycles(simulation, result.per_cycle, result.step)
        after = np.ascontiguousarray(rows[:, places].T)
    figures = [cost, seconds, result.settling.cycles, result.settling.repeats]
    return {
        "names": np.array(names), "last": last, "after": after,
        "figures": np.array(figures, dtype=float),
    }  # fmt: skip


def _go_on_from(simulation: Simulation, other: Simulation) -> None:
    """Set the state of ``simulation`` to the motion of ``other`` (same model), with film memory if the grids agree."""
    state, known = simulation.state, other.state
    put_motion(state, motion_of(known, simulation.model.omega2.size))
    state[SHAFT_ANGLE] = known[SHAFT_ANGLE]
    kept, others = (memory_offset(run.model, run.model.bearings.shape[0]) for run in (simulation, other))
    state[kept:] = known[others:]
    if kept == others:
        films = memory_offset(simulation.model, 0)
        state[films:kept] = known[films:kept]
    simulation.state = state


def _plain_cycles(simulation: Any, per_cycle: int, h: float) -> tuple[Array, float]:
    """Run cycles without correction. Return outputs (samples, outputs) of the first cycle, and cost per second."""
    first, costs = np.empty((0, 0)), list[float]()
    rows = np.empty((per_cycle, simulation.outputs.size))
    while not _enough(costs):
        costs.append(timed(simulation, h, len(costs) * per_cycle, rows))
        if len(costs) == 1:
            first = rows.copy()
    return first, median(costs) / (per_cycle * h)


def _enough(costs: list[float]) -> bool:
    """True if these processor times of cycles suffice to determine the cost of a cycle."""
    if not costs:
        return False
    if costs[0] > SLOW or len(costs) >= TIMED_CYCLES:
        return True
    return len(costs) >= FEWEST_CYCLES and sum(costs) >= TIMED_SECONDS
