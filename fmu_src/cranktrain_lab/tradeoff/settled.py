"""Settled runs of the total-error study: last cycle, its change by one more cycle, and cost per simulated time.

A run continues until its outputs repeat, as in ``cranktrain simulate``. A reference run has expensive cycles; it starts
from the settled motion of the same run with a long step on the usual grid. Cycles without correction follow, with all
films solved anew. The first of them gives the settling error, and the median of their processor times is the cost of a
settled cycle. Finished runs are stored at once.

The distance of two runs in an output family is, for each member m (an output, or the axes of one vector), the RMS of
the difference over the RMS of the reference's alternating part, and of these the largest,

    |y − z| = max_m  ( Σ_axes mean (y − z)² / Σ_axes var y_ref )^½ .

In families whose means depend on the history of a run, only alternating parts are compared. Cycles are resampled by
Fourier series over 720° at the reference's samples. All distances have the same scale, so they obey the triangle
inequality.
"""

import math
import time
from dataclasses import dataclass, replace
from statistics import median

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
from cranktrain.engine.model import Engine
from cranktrain.film.elastic.grid import ElasticGrid
from cranktrain.results.strength.recorded_cycle import whole
from cranktrain.store.kept import Kept, digest
from cranktrain.structure.assembly import assemble
from cranktrain.studies.total_error.families import Cycle, Family, wanted
from cranktrain.studies.total_error.point import Split
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
        # The run begins with the motion of the coarse run, and with its film memory if the grids agree.
        state, known = simulation.state, coarse.state
        put_motion(state, motion_of(known, simulation.model.omega2.size))
        state[SHAFT_ANGLE] = known[SHAFT_ANGLE]
        kept, others = (memory_offset(run.model, run.model.bearings.shape[0]) for run in (simulation, coarse))
        state[kept:] = known[others:]
        if kept == others:
            films = memory_offset(simulation.model, 0)
            state[films:kept] = known[films:kept]
        simulation.state = state
    begin = time.process_time()
    result = whole(run_cycles(simulation, None, FINE_SETTLE if job.reference else TOLERANCE, None, None))
    seconds = time.process_time() - begin
    shown = set(simulation.shown_outputs)
    names = [name for name in wanted(job.engine) if name in shown]
    places = [simulation.output_names.index(name) for name in names]
    last = np.array([result.outputs[name][-result.per_cycle :] for name in names])
    after, cost = last, seconds / (result.settling.cycles * result.per_cycle * result.step)
    if not job.reference:
        # Cycles without correction: outputs of the first, and the median of their processor times.
        costs, rows = list[float](), np.empty((result.per_cycle, simulation.outputs.size))
        while len(costs) < (1 if costs and costs[0] > SLOW else TIMED_CYCLES) and (
            len(costs) < FEWEST_CYCLES or sum(costs) < TIMED_SECONDS
        ):
            costs.append(timed(simulation, result.step, len(costs) * result.per_cycle, rows))
            if len(costs) == 1:
                after = np.ascontiguousarray(rows[:, places].T)
        cost = median(costs) / (result.per_cycle * result.step)
    figures = [cost, seconds, result.settling.cycles, result.settling.repeats]
    return {
        "names": np.array(names), "last": last, "after": after,
        "figures": np.array(figures, dtype=float),
    }  # fmt: skip


def split(family: Family, engine: Engine, last: Cycle, after: Cycle, fine: Cycle, reference: Cycle) -> Split | None:
    """Return the total error of a run in a family, and its parts; None if one of the models lacks the family's outputs.

    Parameters
    ----------
    last, after : the run's last cycle and the one that would follow
    fine : last cycle of the same model with a fine step
    reference : last cycle of the best model with a fine step
    """
    found = [
        distance(family, engine, one, other, reference)
        for one, other in ((last, reference), (fine, reference), (last, fine), (after, last))
    ]
    total, model, numerical, settling = found
    if total is None or model is None or numerical is None or settling is None:
        return None
    return Split(total, model, numerical, settling)


def distance(family: Family, engine: Engine, one: Cycle, other: Cycle, reference: Cycle) -> float | None:
    """Return the distance of two cycles in a family, relative to the reference's alternating part, or None.

    A member that is constant in the reference is ignored.
    """
    largest = None
    for names in family.members(engine):
        if any(name not in cycle for cycle in (one, other, reference) for name in names):
            return None
        square, scale = 0.0, 0.0
        for name in names:
            count = reference[name].size
            difference = resampled(one[name], count) - resampled(other[name], count)
            square += float(np.var(difference) if family.alternating else np.mean(difference**2))
            scale += float(np.var(reference[name]))
        if scale > 0.0:
            largest = max(largest or 0.0, math.sqrt(square / scale))
    return largest


def resampled(values: Array, count: int) -> Array:
    """Resample a periodic cycle, given at the ends of n equal intervals, at ``count`` intervals by Fourier series."""
    n = values.size
    if n == count:
        return values
    lines = np.fft.rfft(np.roll(values, 1)) / n  # the last sample, at the end of the cycle, is also its start
    kept = np.zeros(count // 2 + 1, dtype=complex)
    most = min(n, count) // 2
    kept[: most + 1] = lines[: most + 1]
    if min(n, count) % 2 == 0 and n != count:
        kept[most] *= 0.5 if n < count else 2.0  # the Nyquist line splits into two in the finer series
    return np.roll(np.fft.irfft(kept * count, count), -1)
