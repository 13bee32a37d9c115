"""SciPy's stiff solvers on our own equations with impedance films, from a compiled right-hand side and Jacobian.

The equations and the measuring are those of ``benchmarks/tradeoff.py``, measured anew: the six at 2000 rev/min from a
settled cycle, judged over the last of three against a fine step.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import scipy
from benchmarks.other_solvers.entries import other_entry
from benchmarks.other_solvers.solver import OtherSolver
from benchmarks.peer_programs.equal_error import Point, beside, listed

from cranktrain.store.kept import Kept
from cranktrain_lab.tradeoff.families import StudyScene
from cranktrain_lab.tradeoff.level_points import reference_case
from cranktrain_lab.tradeoff.measure import Entry
from cranktrain_lab.tradeoff.measure import measured as points_of
from cranktrain_lab.tradeoff.point import NUMERICAL
from cranktrain_lab.tradeoff.study import default_scenes

OWN = {"esdirk47": (6.0, 5.0, 4.0), "esdirk4": (6.0, 4.0, 2.5, 1.5, 1.0)}
OTHER = {
    ("scipy:LSODA", "each"): (1e-3, 3e-4, 1e-4), ("scipy:LSODA", "floored"): (1e-3, 3e-4, 1e-4),
    ("scipy:BDF", "each"): (1e-2, 1e-3), ("scipy:Radau", "each"): (1e-2, 1e-3),
}  # fmt: skip
"""Tolerances by solver and how they are scaled."""
CYCLES, ROUNDS = 3, 3
ERRORS = (1e-2, 1e-3, 1e-4, 1e-5)


def entries(scene: StudyScene) -> tuple[list[Entry], list[Entry]]:
    """Ours and SciPy's."""
    case = replace(scene.case, cycles=CYCLES)
    reference = reference_case(case)

    own = []
    for name, steps in OWN.items():
        for step in steps:
            settings = replace(case.settings, integrator=name, step=math.radians(step))
            entry = Entry("integrators", f"{name} {step:g}°", replace(case, settings=settings), reference, NUMERICAL)
            own.append(entry)
    other = [
        other_entry(
            f"{method.partition(':')[2]} {tolerance:g}, {scaling}", case, reference,
            OtherSolver(method, tolerance, scaling),
        )
        for (method, scaling), tolerances in OTHER.items()
        for tolerance in tolerances
    ]  # fmt: skip
    return own, other


def measured() -> dict[str, Any]:
    """Errors and costs of both; runs that fail are listed with what they said."""
    own, other = entries(default_scenes(quick=True)[0])
    with TemporaryDirectory() as folder:
        found = points_of([*own, *other], Kept(Path(folder)), ROUNDS)
    points: list[Point] = []
    failed = {}
    for point in found:
        error, seconds = point.error["pulley_torsion"], point.seconds_per_simulated_second
        if point.status == "ok" and error is not None and seconds is not None:
            points.append(Point(point.label, error, seconds))
        else:
            failed[point.label] = point.status
    names = {entry.label for entry in own}
    ours = [point for point in points if point.setting in names]
    others = [point for point in points if point.setting not in names]
    return {
        "program": f"SciPy {scipy.__version__}",
        "compared": "reduced crank of the six with rods on impedance films: torsion of the pulley",
        "cost": "processor time of a simulated second",
        "own": listed(ours),
        "other": listed(others),
        "failed": failed,
        "at_equal_error": beside(ours, others, ERRORS),
        "not_comparable": "SciPy's solvers are given the derivative and a Jacobian by differences, both compiled; the "
        "loop over steps of BDF and Radau is Python's",
    }
