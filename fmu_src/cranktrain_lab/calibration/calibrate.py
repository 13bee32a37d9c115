"""Calibration of an engine against a targets file, from the engine's bodies to a new engine file and a report.

If the engine's own values meet all targets, they are confirmed and there is no search, because a problem with more
values than targets has many solutions. Otherwise all free values are searched; dimensions act by the linearised change
of their bodies. If dimensions are free, the bodies of the result are then meshed, and the other values are fitted once
more. Values are rounded for the new file, and the report is computed from the new file with all modes of its bodies.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Progress
from cranktrain.dynamics.model.records import dimensions
from cranktrain.engine import values
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.store.engine_text import Written, engine_text, new_path, rewritten, rounded, write_new
from cranktrain.structure.assembly import assemble
from cranktrain.structure.block.reduction import complete_block, reduced_block
from cranktrain.structure.crank.modal import KINDS
from cranktrain.structure.crank.reduction import reduced_crankshaft
from cranktrain.structure.in_motion.eigenproblem import settled_means
from cranktrain.studies.in_motion.report import SPRING_LEVELS, film_springs, reference_speed, settled_simulation
from cranktrain_lab.calibration.problem import Match, Problem, at_bounds, engine_with, match, sensitivities
from cranktrain_lab.calibration.search import Found, search
from cranktrain_lab.calibration.targets import Task, load_targets
from cranktrain_lab.calibration.train import Change, FilmMeans, Train, changes

CLOSED = "thrust.closed_stiffness"
RESTS_ON = 0.05
"""Least sensitivity of a target to a value for which the target is listed as determined by this value."""
Follow = Callable[[float, float], None]
RIGID = 6
"""Number of rigid motions of a free block."""


def calibrate(
    engine: str | Path | Engine,
    targets: str | Path,
    out: str | Path | None = None,
    *,
    seed: int = 1,
    evaluations: int = 20000,
    say: Progress = lambda stage: None,
    follow: Follow = lambda share, cost: None,
) -> dict[str, Any]:
    """Calibrate an engine to targets. Return a report for JSON, and write the new engine file ``out`` if given.

    Raises ``InputError`` for unusable files, an ``out`` that exists, or dimensions that cannot be meshed.

    Parameters
    ----------
    engine, targets : paths, or the name of a shipped engine
    seed, evaluations : seed and limit of evaluations of the search
    say, follow : called with each stage, and with the completed fraction of a search and its cost

    Returns
    -------
    ``targets`` (ours, deviation, sensitivities d ln f / d ln p, determining values), ``parameters``, ``derived``,
    ``extra_modes_hz``, ``met``, ``confirmed`` (nothing searched), ``interrupted``, ``evaluations``, ``seed``, ``file``,
    ``refused`` (why the new file was not written, else None)
    """
    base, old = load_engine(engine), engine_text(engine).text
    task = load_targets(targets, base)
    if CLOSED in {p.key for p in task.parameters}:  # this value is optional in engine files
        base = replace(base, thrust=replace(base.thrust, closed_stiffness=base.thrust.closed))
    new = new_path(Path(out)) if out is not None else None
    if new is not None:
        # Raise InputError, before the search, for an engine file into which a value cannot be inserted.
        keys = [*(p.key for p in task.parameters if p.is_key), *task.derived]
        own = {key: Written(values.value(base, key), "calibrated", "") for key in keys}
        rewritten(old, base, own)
    with one_thread():
        problem, found = _fitted(base, task, seed, evaluations, say, follow)
        free = np.array([rounded(x, p.scale) for x, p in zip(found.free, task.parameters, strict=True)])
        report = report_of(problem, free)
    report |= {"engine": base.name, "seed": seed, "evaluations": found.evaluations, "interrupted": found.interrupted}
    report |= {"confirmed": found.evaluations == 0, "file": None, "refused": None}
    if new is not None:
        # If the file cannot be written, the report of the long search is returned all the same.
        try:
            write_new(new, rewritten(old, base, written_values(problem, free, report)))
            report["file"] = str(new)
        except (InputError, StoreError) as error:
            report["refused"] = str(error)
    return report


def _fitted(
    base: Engine, task: Task, seed: int, evaluations: int, say: Progress, follow: Follow
) -> tuple[Problem, Found]:
    """Return fitted values, and the problem with bodies of these values (after an interrupt: with previous bodies)."""
    start = start_values(base, task)
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
            raise InputError(f"parameters.{p.key}: {end / p.scale:g} {p.unit} is not possible: {error}") from None

    def problem(given: Mapping[str, float]) -> Problem:
        """Return the calibration problem with finite-element bodies made for given values."""
        engine = engine_with(base, task, given, {})
        check_engine(engine)
        crank = reduced_crankshaft(engine, progress=say)
        block = reduced_block(engine, progress=say) if task.flexible else None
        shares = stand_ins(engine, block, axial_hz(task)) if block is not None else {}
        if task.film_springs:
            say("stand-in springs of the films")
            shares |= film_springs(assemble(engine, SPRING_LEVELS, say=say))
        films = film_means(engine, task.flexible, say) if task.moves else None
        own = {key: given[key] for key in dimensions}
        return Problem(engine, Train(engine, crank, block, dimensions, films), task, own, shares)

    first, own = problem(start), np.array(list(start.values()))
    within = np.allclose(own, np.clip(own, first.low, first.high), rtol=1e-3, atol=0.0)
    if within and all_met(task, match(task.targets, first.modes(own))):
        return first, Found(own, 0.0, 0, False)
    say("search")
    result = search(first, own, seed, evaluations, follow)
    if not dimensions:
        return first, result
    given = {p.key: rounded(x, p.scale) for p, x in zip(task.parameters, result.free, strict=True)}
    try:
        second = problem(given)
    except KeyboardInterrupt:
        return first, result._replace(interrupted=True)
    rest = second.holding({key: given[key] for key in dimensions})
    if rest.task.parameters and not result.interrupted:
        say("search with the new bodies")
        start_again = np.array([given[p.key] for p in rest.task.parameters])
        again = search(rest, start_again, seed, evaluations // 2, follow)
        given = rest.given(again.free)
        result = again._replace(evaluations=result.evaluations + again.evaluations)
    return second, result._replace(free=np.array([given[p.key] for p in task.parameters]))


def film_means(engine: Engine, flexible: bool, say: Progress) -> FilmMeans:
    """Return mean stiffness and damping of an engine's films at full load, without tilt, at the targets' block level.

    The speed is that of the largest heat per cycle. Raises ``SolverError`` if the run fails.
    """
    say("a cycle in motion")
    settings = replace(SPRING_LEVELS, block="flexible" if flexible else "ground")
    simulation = settled_simulation(assemble(engine, settings, say=say), reference_speed(engine))
    means, hz = settled_means(simulation)
    mains, collar = simulation.model.bearings.shape[0], dimensions(simulation.model).thrust
    axial = float(-means.laws.place[collar, 0, 0]), float(-means.laws.velocity[collar, 0, 0])
    return FilmMeans(-means.laws.place[:mains, :2, :2], -means.laws.velocity[:mains, :2, :2], axial, hz)


def start_values(engine: Engine, task: Task) -> dict[str, float]:
    """Return start values (SI): the engine's own values; values without a key are fitted to the derived values."""
    start = {p.key: values.value(engine, p.key) if p.is_key else 0.5 * (p.low + p.high) for p in task.parameters}
    names = [p for p in task.parameters if not p.is_key]
    if not names:
        return start
    own = [(key, values.value(engine, key)) for key in task.derived]

    def missed(scaled: Array) -> Array:
        given = {p.key: p.low + float(x) * (p.high - p.low) for p, x in zip(names, scaled, strict=True)}
        trial = engine_with(engine, task, {**start, **given}, {})
        return np.array([values.value(trial, key) - was for key, was in own]) / [abs(was) or 1.0 for _, was in own]

    found = least_squares(missed, np.full(len(names), 0.5), bounds=(0.0, 1.0), xtol=1e-12, ftol=1e-12, gtol=1e-12)
    return start | {p.key: p.low + float(x) * (p.high - p.low) for p, x in zip(names, found.x, strict=True)}


def all_met(task: Task, found: Match) -> bool:
    """True if every target is met within its tolerance and no computed mode below the last target is unmatched."""
    near = (abs(hz / target.hz - 1.0) <= target.tolerance for target, hz in zip(task.targets, found.hz, strict=True))
    return not found.extra and all(near)


def axial_hz(task: Task) -> float:
    """Return the frequency of the first axial target, Hz, or 0."""
    return min((target.hz for target in task.targets if target.shape == "axial"), default=0.0)


def report_of(problem: Problem, free: Array) -> dict[str, Any]:
    """Return the report on free values (p,), SI, with each target and value, for JSON."""
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
                "name": target.name, "of": target.of, "basis": target.basis, "shape": target.shape,
                "target_hz": target.hz,
                "hz": float(found.hz[k]), "deviation_percent": 100.0 * deviation,
                "met": abs(deviation) <= target.tolerance,
                "tolerance_percent": 100.0 * target.tolerance, "source": target.source,
                "order": target.order or None,
                "rpm": 60.0 * float(found.hz[k]) / target.order if target.order else None,
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
        "derived": [{"key": key, "value": rounded(values.value(engine, key))} for key in task.derived],
        "extra_modes_hz": found.extra,
        "met": all_met(task, found),
    }  # fmt: skip


def written_values(problem: Problem, free: Array, report: Mapping[str, Any]) -> dict[str, Written]:
    """Return the new engine file's values by key. The note of a free value names the targets that determine it."""
    task, engine = problem.task, problem.engine_of(free)
    found = {}
    for p, x in zip(task.parameters, free, strict=True):
        if p.is_key:
            resting = [row for row in report["targets"] if p.key in row["rests_on"]] or report["targets"]
            names = ", ".join(f"{row['name']} {row['target_hz']:g} Hz" for row in resting)
            found[p.key] = Written(x, "calibrated", f"to {names}" + (f"; {p.note}" if p.note else ""))
    for key, entry in task.derived.items():
        found[key] = Written(rounded(values.value(engine, key)), "derived", entry.note or entry.formula)
    return found


def stand_ins(engine: Engine, block: ReducedBody, axial_hz: float) -> dict[str, float]:
    """Return springs that replace the block at level ``ground``, N/m: its stiffness at main bores and thrust faces.

    They are ``bore_stiffness_x``, ``bore_stiffness_y``, ``thrust_face_stiffness``, each the inverse of the compliance
    of the free block with its heads under a unit load at that interface,

        C(ω) = Σ φ² / (ω_k² − ω²)

    For the bores the static elastic stiffness is used (ω = 0, without rigid motions, because inertia balances the
    load), with the mean compliance of all mains, so that the engine file has one value for all. The thrust faces carry
    the whole axial motion. Their stiffness includes the rigid motions and is taken at the frequency of the axial mode,
    where the block moves against the crank and raises the frequency above that on ground. It is the elastic stiffness
    alone if ``axial_hz`` is 0, or above the frequency of zero dynamic stiffness.
    """
    complete = complete_block(engine, block)

    def compliance(interface: str, component: int, hz: float = 0.0) -> float:
        squares, omega2 = complete.shapes[complete.index(interface), component] ** 2, complete.omega**2
        first = 0 if hz > 0.0 else RIGID
        return float(np.sum(squares[first:] / (omega2[first:] - (2.0 * np.pi * hz) ** 2)))

    bores = [name for name in complete.interfaces if name.startswith("bore")]
    x, y = (float(1.0 / np.mean([compliance(name, k) for name in bores])) for k in (0, 1))
    thrust = compliance("thrust", 2, axial_hz)
    thrust = thrust if thrust > 0.0 else compliance("thrust", 2)
    return {"bore_stiffness_x": x, "bore_stiffness_y": y, "thrust_face_stiffness": 1.0 / thrust}
