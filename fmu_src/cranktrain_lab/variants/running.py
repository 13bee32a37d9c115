"""Execution of a study's variants in parallel, with each result stored at once and continuation of earlier runs.

Variants run in processes, not threads, because most of a torsional variant is Python and small linear algebra, which
hold the interpreter's lock. A worker keeps the model, so nothing is made or compiled per variant, and a few variants
are queued for each worker. Finished variants are in the journal of the study's folder before the next one is submitted.
"""

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from cranktrain import __version__
from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.sources import source_digest
from cranktrain.core.types import Array
from cranktrain.store.side_by_side import cluster, processors, worker_pool
from cranktrain.store.variant_files import Column, Row, VariantFiles, parquet
from cranktrain_lab.variants import models
from cranktrain_lab.variants.models import Model, answered, model_of
from cranktrain_lab.variants.study import FUNCTION, Study

AHEAD = 3
"""Number of variants queued for each worker."""
_here = threading.local()
"""Study and model in the present worker process or thread."""


@dataclass
class Outcome:
    """Summary of a study's execution, updated while it runs.

    Attributes
    ----------
    finished, resumed, failed : numbers of variants finished now, stored before, and failed now
    seconds, preparation : wall time, and part of it for making the model, s
    workers : number of workers
    reasons : reasons of failure, with numbers of variants
    """

    finished: int = 0
    resumed: int = 0
    failed: int = 0
    seconds: float = 0.0
    preparation: float = 0.0
    workers: int = 0
    reasons: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Means:
    """Settings of execution: number of processes or Dask scheduler's address, and whether to replace the folder."""

    workers: int | None = None
    scheduler: str | None = None
    anew: bool = False


def study_digest(study: Study) -> str:
    """Return a digest of all data that determine the result of a variant."""
    what = (
        study.engine, study.model, study.varied, study.outputs, study.speeds, study.derived, study.levels, study.load,
        study.design, source_digest(models.__file__, deferred=True),
        getattr(study.function, "__qualname__", ""),
    )  # fmt: skip
    return sha256(repr(what).encode()).hexdigest()


def run_variants(
    study: Study,
    folder: Path,
    means: Means,
    say: Callable[[str], None] = lambda text: None,
    tell: Callable[[str, float], None] = lambda text, share: None,
    outcome: Outcome | None = None,
) -> VariantFiles:
    """Run the variants whose results are not yet in the folder, and store each when it is finished.

    ``say`` is called with stages of making the model, ``tell`` with the state of the work and the completed fraction.

    Raises
    ------
    InputError
        a folder with other contents, a study that its model cannot compute
    SolverError
        lost workers, or failure of all variants
    """
    parquet()  # a missing package is reported before the model is made
    outcome, began = Outcome() if outcome is None else outcome, time.perf_counter()
    with threadpool_limits(limits=1, user_api="blas"):
        model = model_of(study, say)
    about = {
        "method": study.design.method, "n": study.design.n, "seed": study.design.seed, "pareto": list(study.pareto),
        "own": {one.key: one.own for one in study.varied}, "version": __version__,
    }  # fmt: skip
    files = files_of(study, model, folder, about)
    held = files.begin(study_digest(study), means.anew)
    outcome.resumed = len(held)
    outcome.preparation = time.perf_counter() - began
    values = study.design.values(study.distributions)
    left = [k for k in range(len(values)) if k not in held]
    try:
        with variant_workers(study, model, means, len(left)) as (submit, outcome.workers):
            for number, found in answers(submit, values, left, outcome.workers):
                outputs, failed = ({}, found) if isinstance(found, str) else (found, "")
                files.keep(Row(number, values[number], outputs, failed))
                outcome.finished += 1
                if failed:
                    outcome.failed += 1
                    outcome.reasons[failed] = outcome.reasons.get(failed, 0) + 1
                if outcome.finished % 10 == 0 or outcome.finished == len(left):
                    _progress(tell, outcome, len(left), began)
    finally:
        files.close()
        outcome.seconds = time.perf_counter() - began
    return files


def files_of(study: Study, model: Model, folder: Path, about: dict[str, Any]) -> VariantFiles:
    """Return the files of a study's variants in a folder, with further facts ``about`` the study."""
    engine = study.engine.name if study.engine else study.model
    about = {"title": study.title, "engine": engine, "crank": study.levels.crank, **about}
    return VariantFiles(
        folder, tuple(one.key for one in study.varied), tuple(one.unit for one in study.varied),
        tuple(Column(*vars(one).values()) for one in model.outputs), np.array(study.speeds), about,
    )  # fmt: skip


def _progress(tell: Callable[[str, float], None], outcome: Outcome, count: int, began: float) -> None:
    left = (time.perf_counter() - began) * (count - outcome.finished) / max(outcome.finished, 1)
    text = f"{outcome.finished} of {count} variants, {round(left) // 60}:{round(left) % 60:02d} left"
    tell(text + (f", {outcome.failed} failed" if outcome.failed else ""), outcome.finished / max(count, 1))


def answers(submit: Callable[[Array], Future[Any]], values: Array, left: list[int], workers: int) -> Iterator[Any]:
    """Yield the number and result of each variant when it finishes; only a few variants are submitted at a time."""
    waiting: dict[Future[Any], int] = {}
    numbers = iter(left)
    try:
        while True:
            while len(waiting) < AHEAD * workers and (number := next(numbers, None)) is not None:
                waiting[submit(values[number])] = number
            if not waiting:
                return
            done, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                yield waiting.pop(future), future.result()
    except BrokenProcessPool:
        raise SolverError("a worker process ended, killed or out of memory; use fewer --workers") from None


@contextmanager
def variant_workers(
    study: Study, model: Model, means: Means, count: int
) -> Iterator[tuple[Callable[[Array], Future[Any]], int]]:
    """Provide a function that submits variants, and the number of workers."""
    if means.scheduler is not None:
        with _cluster(study, means.scheduler) as found:
            yield found
        return
    _here.study, _here.model = study, model  # forked processes inherit them
    number = max(1, min(means.workers or processors(), count))
    if number == 1 or study.model == FUNCTION:
        with threadpool_limits(limits=1, user_api="blas"):
            yield _finished, 1
        return
    with worker_pool(number, _begin, (study,)) as pool:
        yield lambda values: pool.submit(_variant, None, values), number


def _finished(values: Array) -> Future[Any]:
    """Run a variant at once in this process. Return its finished future."""
    future: Future[Any] = Future()
    future.set_result(_variant(None, values))
    return future


@contextmanager
def _cluster(study: Study, address: str) -> Iterator[tuple[Callable[[Array], Future[Any]], int]]:
    """Provide workers of a Dask cluster; raises ``InputError`` if there is none."""
    if study.model == FUNCTION:
        raise InputError("a function of a script runs in its own process; leave scheduler out")
    with cluster(address) as (client, number):
        from distributed.scheduler import KilledWorker

        try:
            sent, pool = client.scatter(study, broadcast=True, hash=False), client.get_executor(pure=False)
            yield lambda values: pool.submit(_variant, sent, values), number
        except (KilledWorker, CancelledError):
            raise SolverError(
                f"the cluster at {address} lost its workers, see their logs; run the study again"
            ) from None


def _begin(study: Study) -> None:
    """Make the model of a study in a worker, unless it exists."""
    if getattr(_here, "study", None) != study:
        _here.study, _here.model = study, model_of(study)


def _variant(study: Study | None, values: Array) -> dict[str, Array] | str:
    """Compute a variant with the model of this worker thread."""
    if study is not None:
        _begin(study)
    keys = [one.key for one in _here.study.varied]
    return answered(_here.model, dict(zip(keys, np.asarray(values).tolist(), strict=True)))
