"""Other solvers' part of the trade-off study: what is measured of them, and what SciPy's cost beside ours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from benchmarks.other_solvers.solver import SCIPY, OtherSolver
from benchmarks.peer_programs.equal_error import Point as Setting
from benchmarks.peer_programs.equal_error import cost_at

from cranktrain.film.laws.register import bearing_law
from cranktrain_lab.tradeoff.case import COMMUNICATION_DEG, Case
from cranktrain_lab.tradeoff.families import StudyScene
from cranktrain_lab.tradeoff.level_points import reference_case
from cranktrain_lab.tradeoff.measure import Entry
from cranktrain_lab.tradeoff.point import NUMERICAL, OUTPUTS, Point

TOLERANCES = {
    ("scipy:BDF", "each"): (1e-2, 1e-3),
    ("scipy:Radau", "each"): (1e-2, 1e-3, 1e-4),
    ("scipy:LSODA", "each"): (1e-3, 1e-4, 1e-5),
    ("scipy:LSODA", "floored"): (1e-3, 3e-4, 1e-4, 1e-6),
}
"""SciPy's, full study. BDF floored misses the error at a higher cost; Radau floored did not finish at 1e-2."""
RADAU_DEG = (3.0, 1.0, 0.5)
EXPLICIT_DEG = {"runge-kutta-4": (0.1, 0.01, 0.0015), "central-differences": (0.1, 0.01, 0.0005)}
"""Explicit steps: two that one would try, and one that the stiffest film allows."""
EXPLICIT_CYCLES = 1
FEW = {("scipy:LSODA", "each"): (1e-3,)}
"""SciPy's, quick study."""
TARGETS = (1.0e-3, 1.0e-5)
"""Errors at which own points are compared with SciPy's."""


def holds(scene: StudyScene) -> bool:
    """Whether the first-order equations hold a scene's model."""
    levels = scene.case.levels
    return not bearing_law(levels.bearings).tilt and levels.block == "ground" and levels.damper == "none"


def other_entries(scene: StudyScene, quick: bool) -> list[Entry]:
    """Entries of the other solvers in a scene; none where their equations do not hold its model."""
    if not holds(scene):
        return []
    case = scene.case
    reference = reference_case(case, quick)
    entries = []
    for method, steps in EXPLICIT_DEG.items():
        for step in steps[:2] if quick else steps:
            own = replace(_stepped(case, step), interval_deg=COMMUNICATION_DEG, cycles=EXPLICIT_CYCLES)
            entries.append(other_entry(f"{method} {step:g}°", own, reference, OtherSolver(method)))
    for step in RADAU_DEG[2:] if quick else RADAU_DEG:
        entries.append(other_entry(f"radau-5 {step:g}°", _stepped(case, step), reference, OtherSolver("radau-5")))
    for (method, scaling), tolerances in (FEW if quick else TOLERANCES).items():
        for tolerance in tolerances:
            suffix = "" if scaling == "each" else ", floored"
            label = f"SciPy {method.removeprefix('scipy:')} {tolerance:g}{suffix}"
            entries.append(other_entry(label, case, reference, OtherSolver(method, tolerance, scaling)))
    return entries


def other_entry(label: str, case: Case, reference: Case, solver: OtherSolver) -> Entry:
    """Entry of a case that another solver runs; one that chooses its own steps keeps outputs at the usual interval."""
    more: dict[str, Any] = {"integrator": solver.method, "solver": solver.name, "scaling": solver.scaling}
    if solver.tolerance is not None:
        case = replace(case, interval_deg=COMMUNICATION_DEG)
        more |= {"step_deg": None, "tolerance": solver.tolerance}
    return Entry("integrators", label, case, reference, NUMERICAL, more, solver)


def _stepped(case: Case, step_deg: float) -> Case:
    return replace(case, settings=replace(case.settings, step=math.radians(step_deg)))


def speedups(points: Sequence[Point]) -> dict[str, Any]:
    """Best own cost beside SciPy's best at each of ``TARGETS``, from the numerical points of one scene.

    The error is the larger one of pulley torsion and axial motion; ``with_films`` counts the least film's as well.
    """
    result: dict[str, Any] = {}
    for target in TARGETS:
        entry = _compared(points, target, ("pulley_torsion", "pulley_axial"))
        if entry is not None:
            result[f"{target:g}"] = {**entry, "with_films": _compared(points, target, OUTPUTS)}
    return result


def _compared(points: Sequence[Point], target: float, outputs: Sequence[str]) -> dict[str, Any] | None:
    """Cost of the best own point and of SciPy's at an error; None where one is missing."""
    own: list[Setting] = []
    scipy: dict[str, list[Setting]] = {}
    for point in points:
        cost = point.seconds_per_simulated_second
        errors = [value for name in outputs if (value := point.error[name]) is not None]
        if point.parameters["error_kind"] != NUMERICAL or not point.usable or cost is None or not errors:
            continue
        setting = Setting(point.label, max(errors), cost)
        if str(point.parameters["integrator"]) in SCIPY:
            scipy.setdefault(point.solver, []).append(setting)
        elif not point.solver:
            own.append(setting)
    if not own or not scipy:
        return None
    ours = cost_at(own, target)
    theirs = {name: cost_at(rows, target) for name, rows in scipy.items()}
    reached = {name: cost for name, cost in theirs.items() if cost is not None}
    best = min(reached, key=reached.__getitem__) if reached else None
    ratio = reached[best] / ours if best is not None and ours else None
    return {"own": ours, "scipy": theirs, "scipy_best": best, "ratio": ratio}
