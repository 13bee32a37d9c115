"""Calibration of an engine against a targets file, from its bodies to a new engine file and a report.

First all free values are searched; dimensions act by the linearised change of their bodies. Where there are such, the
bodies of the result are then meshed, and what is not a dimension is fitted once more. Values are rounded as they are
written, and the report is about what the new file gives in all modes of its bodies.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.file import engine_path, load_engine
from cranktrain.engine.model import Engine
from cranktrain.store.whole_file import whole_file
from cranktrain.structure.block.reduction import reduced_block
from cranktrain.structure.crank.modal import KINDS
from cranktrain.structure.crank.reduction import reduced_crankshaft
from cranktrain.structure.fem.factor import one_thread
from cranktrain.studies.calibration import values
from cranktrain.studies.calibration.engine_text import NEW, Written, new_path, rewritten, rounded
from cranktrain.studies.calibration.geometry import Change, changes
from cranktrain.studies.calibration.problem import Problem, at_bounds, engine_with, match, sensitivities
from cranktrain.studies.calibration.search import Found, search
from cranktrain.studies.calibration.stand_ins import stand_ins
from cranktrain.studies.calibration.targets import Task, load_targets
from cranktrain.studies.calibration.train import Train

RESTS_ON = 0.05
"""A target rests on the values whose sensitivity is at least this."""
Say = Callable[[str], None]
Follow = Callable[[float, float], None]


def calibrate(
    engine: str | Path,
    targets: str | Path,
    out: str | Path | None = None,
    *,
    seed: int = 1,
    evaluations: int = 20000,
    say: Say = lambda stage: None,
    follow: Follow = lambda share, cost: None,
) -> dict[str, Any]:
    """Values of an engine that meet targets: a report, JSON-able, and a new engine file where ``out`` is given.

    Raises ``InputError``: files that cannot be used, an ``out`` that exists, dimensions that cannot be meshed.

    Parameters
    ----------
    engine, targets : paths, or the name of a shipped engine
    seed, evaluations : of the search
    say, follow : told each stage, and the share of a search with its cost

    Returns
    -------
    ``targets`` (ours, deviation, sensitivities d ln f / d ln p, what each rests on), ``parameters``, ``derived``,
    ``extra_modes_hz``, ``met``, ``interrupted``, ``evaluations``, ``seed``, ``file``
    """
    base, path = load_engine(engine), engine_path(engine)
    task = load_targets(targets, base)
    new = new_path(Path(out)) if out is not None else None
    with one_thread():
        problem, found = _fitted(base, task, seed, evaluations, say, follow)
        free = np.array([rounded(x, p.scale) for x, p in zip(found.free, task.parameters, strict=True)])
        report = report_of(problem, free)
    report |= {"engine": base.name, "seed": seed, "evaluations": found.evaluations, "interrupted": found.interrupted}
    if new is not None:
        written = written_values(problem, free, report)
        with whole_file(new, NEW) as temporary:
            temporary.write_text(rewritten(path.read_text("utf-8"), base, written), encoding="utf-8")
        load_engine(new)
    return {**report, "file": str(new) if new is not None else None}


def _fitted(base: Engine, task: Task, seed: int, evaluations: int, say: Say, follow: Follow) -> tuple[Problem, Found]:
    """What is found, and the problem at the bodies that belong to it."""
    start = {p.key: values.value(base, p.key) if p.is_key else 0.5 * (p.low + p.high) for p in task.parameters}
    before = engine_with(base, task, start, {})
    dimensions = dict[str, list[Change]]()
    for p in task.parameters:
        end = p.low if start[p.key] - p.low > p.high - start[p.key] else p.high
        after = engine_with(base, task, {**start, p.key: end}, {})
        try:
            check_engine(after)
            tell = lambda stage, text=f"{p.key} {end / p.scale:g} {p.unit}": say(f"{text}: {stage}")  # noqa: E731
            if found := changes(before, after, end - start[p.key], task.flexible, tell):
                dimensions[p.key] = found
        except InputError as error:
            raise InputError(f"parameters.{p.key}: {end / p.scale:g} {p.unit} cannot be: {error}") from None

    def problem(given: Mapping[str, float]) -> Problem:
        """Problem at the bodies of given values."""
        engine = engine_with(base, task, given, {})
        check_engine(engine)
        crank = reduced_crankshaft(engine, progress=say)
        block = reduced_block(engine, progress=say) if task.flexible else None
        shares = stand_ins(engine, block, axial_hz(task)) if block is not None else {}
        own = {key: given[key] for key in dimensions}
        return Problem(engine, Train(engine, crank, block, dimensions), task, own, shares)

    first = problem(start)
    say("search")
    result = search(first, np.array(list(start.values())), seed, evaluations, follow)
    if not dimensions:
        return first, result
    given = {p.key: rounded(x, p.scale) for p, x in zip(task.parameters, result.free, strict=True)}
    second = problem(given)
    rest = second.holding({key: given[key] for key in dimensions})
    if rest.task.parameters and not result.interrupted:
        say("search with the new bodies")
        start_again = np.array([given[p.key] for p in rest.task.parameters])
        again = search(rest, start_again, seed, evaluations // 2, follow)
        given = rest.given(again.free)
        result = again._replace(evaluations=result.evaluations + again.evaluations)
    return second, result._replace(free=np.array([given[p.key] for p in task.parameters]))


def axial_hz(task: Task) -> float:
    """Frequency of the first axial target, Hz; 0 where there is none."""
    return min((target.hz for target in task.targets if target.shape == "axial"), default=0.0)


def report_of(problem: Problem, free: Array) -> dict[str, Any]:
    """What free values (p,), SI, give: each target, each value; JSON-able."""
    task, modes = problem.task, problem.modes(free)
    found = match(task.targets, modes)
    slopes = sensitivities(problem, free, modes, found.places)
    keys, bound = [p.key for p in task.parameters], at_bounds(task.parameters, free)
    rows: list[dict[str, Any]] = []
    for k, target in enumerate(task.targets):
        deviation = float(found.hz[k] / target.hz - 1.0)
        order = np.argsort(-np.abs(slopes[k]))
        rows.append(
            {
                "name": target.name, "of": target.of, "shape": target.shape, "target_hz": target.hz,
                "hz": float(found.hz[k]), "deviation_percent": 100.0 * deviation,
                "met": abs(deviation) <= target.tolerance,
                "tolerance_percent": 100.0 * target.tolerance, "source": target.source,
                "shares": dict(zip((*KINDS, "block"), modes[target.of].shares[found.places[k]].tolist(), strict=True)),
                "sensitivities": dict(zip(keys, slopes[k].tolist(), strict=True)),
                "rests_on": [keys[j] for j in order if abs(slopes[k, j]) >= RESTS_ON],
            }
        )  # fmt: skip
    engine = problem.engine_of(free)
    return {
        "targets": rows,
        "parameters": [
            {"key": p.key, "value": x / p.scale, "low": p.low / p.scale, "high": p.high / p.scale, "unit": p.unit,
             "at_bound": p.key in bound}
            for p, x in zip(task.parameters, free, strict=True)
        ],
        "derived": [{"key": d.key, "value": rounded(values.value(engine, d.key))} for d in task.derived],
        "extra_modes_hz": found.extra,
        "met": all(row["met"] for row in rows),
    }  # fmt: skip


def written_values(problem: Problem, free: Array, report: Mapping[str, Any]) -> dict[str, Written]:
    """Values that a new engine file states, by key; a free one names the targets that rest on it, or all."""
    task, engine = problem.task, problem.engine_of(free)
    found = {}
    for p, x in zip(task.parameters, free, strict=True):
        if p.is_key:
            resting = [row for row in report["targets"] if p.key in row["rests_on"]] or report["targets"]
            names = ", ".join(f"{row['name']} {row['target_hz']:g} Hz" for row in resting)
            found[p.key] = Written(x, "calibrated", f"to {names}" + (f"; {p.note}" if p.note else ""))
    for d in task.derived:
        found[d.key] = Written(rounded(values.value(engine, d.key)), "derived", d.note or d.formula)
    return found
