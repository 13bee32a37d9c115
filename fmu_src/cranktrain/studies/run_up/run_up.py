"""Execution of a run-up: orders of pulley and other outputs over speed, stored as speeds are finished.

If a file of the same run exists, the run-up continues from it, and the speeds in the file are not run again.
"""

import math
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path

import numpy as np

from cranktrain import __version__
from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.sources import source_digest
from cranktrain.core.units import RPM
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.run_up.run_up import TORSION, RunUp, check_run_up_target, merged
from cranktrain.store.journal import journal_place
from cranktrain.store.side_by_side import processors
from cranktrain.studies.run_up import steady
from cranktrain.studies.run_up.sequence import Failed, steady_speeds
from cranktrain.studies.run_up.starts import drop_starts, keep_start, kept_starts
from cranktrain.studies.run_up.steady import CycleStart, Job, SteadySpeed
from cranktrain.studies.run_up.workers import Workers, cluster_workers, local_workers

SAME = 1.0e-9
"""Relative difference below which two speeds are equal."""
WRITE_EVERY = 5.0
"""Interval, s, between writings of the file; speeds finished in between are stored in its journal."""
ASKED, CODE = "digest_asked", "digest_code"
"""Attributes of a file that identify its request and the code that ran it."""


@dataclass
class Outcome:
    """Outcome of a run-up: its result, and speeds that failed.

    Attributes
    ----------
    run_up : all speeds in the file
    resumed : speeds that were in the file before
    failed : speeds without a result, with reasons
    seconds : wall time
    workers : number of workers
    starts : steady motions at the speeds that were run, now or before an interruption
    """

    run_up: RunUp | None = None
    resumed: int = 0
    failed: list[Failed] = field(default_factory=list)
    seconds: float = 0.0
    workers: int = 0
    starts: list[CycleStart] = field(default_factory=list)


@dataclass(frozen=True)
class Means:
    """Options for the execution of a run-up.

    Attributes
    ----------
    workers : number of processes; by default that of processors
    scheduler : address of a Dask cluster's scheduler, in place of processes
    refine : largest error of a straight line between two speeds over an order's largest amplitude; 0: no refinement
    anew : replace a file of another run, and run all speeds again
    """

    workers: int | None = None
    scheduler: str | None = None
    refine: float = 0.0
    anew: bool = False


def run_up(
    job: Job,
    speeds: Sequence[float],
    path: Path,
    means: Means,
    attributes: dict[str, str | int | float],
    tell: Callable[[str, float], None] = lambda text, share: None,
    outcome: Outcome | None = None,
) -> Outcome:
    """Compute steady cycles at many speeds (rad/s), stored in a file after each speed.

    ``tell`` receives the state of the work and the fraction done. ``outcome`` contains the finished speeds, however the
    work ends. Raises ``InputError`` for a file of another run, or a path that must not be replaced, and
    ``SolverError`` if workers are lost, or no speed has a result.
    """
    outcome = Outcome() if outcome is None else outcome
    began = time.perf_counter()
    own = digests(job)
    tie = " ".join(own.values())
    store = Store(path, {**attributes, **own}, means.anew)
    outcome.run_up, outcome.resumed = store.run_up, 0 if store.run_up is None else store.run_up.speeds.size
    if means.anew:
        drop_starts(path)
    outcome.starts += [start for start in kept_starts(path, tie) if store.holds(start.speed)]
    try:
        if wanted := _missing(store, speeds, means, outcome):
            with _workers(job, means, len(wanted)) as workers:
                outcome.workers = workers.count
                while wanted:
                    count, round_began = len(wanted), time.perf_counter()
                    for done, found in enumerate(steady_speeds(workers, wanted, outcome.starts), 1):
                        outcome.failed += [found] if isinstance(found, Failed) else []
                        if isinstance(found, SteadySpeed):
                            keep_start(path, tie, found.start)
                            store.keep(found)
                        left = (time.perf_counter() - round_began) * (count - done) / done
                        tell(f"{done} of {count} speeds, {_clock(left)} left", done / count)
                    wanted = _missing(store, speeds, means, outcome)
        if all(map(store.holds, speeds)):
            drop_starts(path)
    finally:
        store.write()
        outcome.run_up, outcome.seconds = store.run_up, time.perf_counter() - began
    if outcome.run_up is None:
        raise SolverError(
            f"no speed gave a result; at {outcome.failed[0].speed / RPM:g} rev/min: {outcome.failed[0].reason}"
        )
    return outcome


def digests(job: Job) -> dict[str, str]:
    """Digests of all inputs of the result at a speed, one of the request and one of the code."""
    made, trace = job.made, (job.gas or GasTrace.from_engine(job.made.engine)).values
    bodies = [made.body.digest, made.parts.block.digest if made.parts.block is not None else ""]
    # Two film temperatures have old names in digests, so that existing files stay valid.
    films = {"engine": False, "heat-balance": True}.get(job.film_temperature, job.film_temperature)
    choices = [job.settle, job.highest_order, job.outputs, films, job.damper_balance]
    asked = repr((made.engine, sorted(asdict(made.settings).items()), bodies, trace, choices))
    return {ASKED: sha256(asked.encode()).hexdigest(), CODE: source_digest(steady.__file__, deferred=True)}


def check_replaced(path: Path) -> None:
    """Refuse to replace a file with results of steady cycles; ``InputError``."""
    if path.is_file() and path.stat().st_size and (held := RunUp.load(path)).cycles.any():
        raise InputError(f"{path}: holds steady cycles ({_what(held)}); name another --output, or replace it by --anew")


class Store:
    """File of a run-up; after each finished speed either the complete file or its journal is written."""

    def __init__(self, path: Path, attributes: dict[str, str | int | float], anew: bool) -> None:
        self._path, self._attributes = path, {**attributes, "version": __version__}
        check_run_up_target(path)
        self._held: RunUp | None = None
        if path.is_file() and path.stat().st_size and not anew:
            self._held = RunUp.load(path)
            held = self._held.attributes
            if any(held.get(name) != attributes[name] for name in (ASKED, CODE)):
                other = "another run-up" if held.get(ASKED) != attributes[ASKED] else "a run-up of another version"
                raise InputError(
                    f"{path}: holds {other} ({_what(self._held)}); name another --output, or replace it by --anew"
                )
        self._waiting: list[RunUp] = []
        self._written = -math.inf
        self._unwritten = journal_place(path).is_file() and self._held is not None

    @property
    def run_up(self) -> RunUp | None:
        """Run-up of all finished speeds; None if no speed is finished."""
        if self._waiting:
            self._held = merged([*([self._held] if self._held is not None else []), *self._waiting])
            self._waiting = []
        return self._held

    def holds(self, speed: float) -> bool:
        """True if a speed (rad/s) is finished."""
        run_up = self.run_up
        return run_up is not None and bool(np.any(np.abs(run_up.speeds - speed) <= SAME * speed))

    def keep(self, found: SteadySpeed) -> None:
        """Store one finished speed: in the journal if the file was written recently, else in the file."""
        one = RunUp(
            speeds=np.array([found.speed]),
            orders=0.5 * np.arange(1, next(iter(found.amplitudes.values())).size + 1, dtype=np.float64),
            amplitudes={name: values[None] for name, values in found.amplitudes.items()},
            extremes={name: values[None] for name, values in found.extremes.items()},
            cycles=np.array([found.cycles]),
            repeats=np.array([found.repeats]),
            left=np.array([found.left]),
            parting=np.array([found.parting]),
            attributes=self._attributes,
        )
        self._waiting.append(one)
        self._unwritten = True
        if time.monotonic() - self._written < WRITE_EVERY:
            one.add_to_journal(self._path)
        else:
            self.write()

    def write(self) -> None:
        """Write the file with all finished speeds."""
        if self._unwritten and (run_up := self.run_up) is not None:
            run_up.save(self._path)
            self._unwritten, self._written = False, time.monotonic()


def _what(run_up: RunUp) -> str:
    names = ("engine", "crank", "bearings", "block", "damper", "settle")
    return ", ".join(f"{name} {run_up.attributes.get(name, 'unknown')}" for name in names)


def _workers(job: Job, means: Means, speeds: int) -> AbstractContextManager[Workers]:
    if means.scheduler is not None:
        return cluster_workers(job, means.scheduler)
    return local_workers(job, max(1, min(means.workers or processors(), speeds)))


def _missing(store: Store, speeds: Sequence[float], means: Means, outcome: Outcome) -> list[float]:
    """Speeds to run: the requested speeds, then refinements between them, without those that failed in this run."""
    lost = [failed.speed for failed in outcome.failed]
    asked = [speed for speed in speeds if not store.holds(speed) and speed not in lost]
    if asked or store.run_up is None or not means.refine or len(speeds) < 2:
        return asked
    between = speeds_between(store.run_up, means.refine, float(np.min(np.diff(speeds))))
    return [speed for speed in between if not store.holds(speed) and speed not in lost]


def _clock(seconds: float) -> str:
    minutes, seconds = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{seconds:02d}" if minutes >= 60 else f"{minutes}:{seconds:02d}"


FINEST = 8
"""Largest number of parts into which a step between two requested speeds is divided."""
MATTERS = 0.05
"""Fraction of the largest amplitude of all orders above which an order's curvature counts."""


def speeds_between(run_up: RunUp, tolerance: float, step: float) -> list[float]:
    """Middles (rad/s) of the steps next to speeds with too large a curvature of an order's torsion.

    In the middle of a step h, a parabola through three speeds deviates from the line by an eighth of h² times the
    curvature (a quarter of the second difference). Speeds without a periodic motion are left out, because their
    amplitudes of one cycle do not lie on a curve.

    Parameters
    ----------
    tolerance : of this deviation, over the largest amplitude of the order
    step : requested step of the run-up, rad/s; no step gets shorter than an eighth of it
    """
    periodic = (run_up.repeats >= 1) & np.isfinite(run_up.amplitudes[TORSION]).all(axis=1)
    speeds, sizes = run_up.speeds[periodic], np.abs(run_up.amplitudes[TORSION][periodic])
    if speeds.size < 3:
        return []
    h = np.diff(speeds)
    slopes = np.diff(sizes, axis=0) / h[:, None]
    curvature = np.abs(np.diff(slopes, axis=0)) / (0.5 * (h[1:] + h[:-1]))[:, None]
    largest = sizes.max(axis=0)
    counts = largest >= MATTERS * largest.max()
    # The curvature of a step between two speeds is the larger curvature at its two ends.
    bent = np.zeros((h.size, int(counts.sum())))
    bent[:-1] = curvature[:, counts]
    bent[1:] = np.maximum(bent[1:], curvature[:, counts])
    off = (0.125 * h[:, None] ** 2 * bent / largest[counts]).max(axis=1)
    split = (off > tolerance) & (h > 1.5 * step / FINEST) & (h < 1.5 * step)
    return [float(0.5 * (a + b)) for a, b in zip(speeds[:-1][split], speeds[1:][split], strict=True)]
