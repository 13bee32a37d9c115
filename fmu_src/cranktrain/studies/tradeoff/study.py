"""The whole study: families over scenes, references with their own error, and what it comes to."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.store.kept import Kept
from cranktrain.studies.peers.other_solvers import SCIPY
from cranktrain.studies.tradeoff.families import FAMILIES, StudyScene
from cranktrain.studies.tradeoff.measure import measured
from cranktrain.studies.tradeoff.pareto import cost_at, marked
from cranktrain.studies.tradeoff.point import NUMERICAL, OUTPUTS, Point, in_scene
from cranktrain.studies.tradeoff.reference import error_estimate, reference_case

RPM = math.pi / 30.0
REPEATS = 3
"""Runs of a point in a full study, whose median is its cost."""
TARGETS = (1.0e-3, 1.0e-5)
"""Errors at which own points are compared with SciPy's."""

Estimates = dict[str, dict[str, float | None]]


@dataclass(frozen=True)
class Study:
    """What was measured.

    ``estimates`` gives each scene's error of its reference by output; ``speedups`` what the best own point costs beside
    the best of SciPy, by scene and error.
    """

    scenes: tuple[StudyScene, ...]
    points: tuple[Point, ...]
    estimates: Estimates
    speedups: dict[str, dict[str, Any]]

    def as_dict(self) -> dict[str, Any]:
        """The study as JSON holds it; the reference's error is the largest of all scenes."""
        worst: dict[str, float | None] = {}
        for name in OUTPUTS:
            found = [value for entry in self.estimates.values() if (value := entry.get(name)) is not None]
            worst[name] = max(found) if found else None
        return {
            "points": [point.as_dict() for point in self.points],
            "reference": {"error_estimate": worst, "scenes": self.estimates},
            "against_scipy": self.speedups,
        }


def default_scenes(quick: bool) -> list[StudyScene]:
    """The six at 2000 rev/min; in a full study also near its resonance, and the V8 at its nominal speed."""
    wanted = [("diesel_i6", 2000.0)] if quick else [("diesel_i6", 2000.0), ("diesel_i6", 2200.0), ("diesel_v8", 1800.0)]
    return [StudyScene(f"{name} {rpm:g}", load_engine(name), rpm * RPM, Settings()) for name, rpm in wanted]


def scenes_of(path: str, quick: bool) -> list[StudyScene]:
    """Scenes of a scene file: each of its speeds, in a quick study the first; its levels where it fixes them."""
    from cranktrain.studies.scene import load_scene

    scene = load_scene(path)
    if scene.pressure is not None:
        warnings.warn(
            f"{scene.path.name}: the study runs on the built-in pressure trace, not on gas.pressure_file", stacklevel=2
        )
    plain = Settings()
    settings = Settings(
        crank=scene.crank or plain.crank, bearings=scene.bearings or plain.bearings, block=scene.block,
        pistons=scene.pistons, big_ends=scene.big_ends, damper=scene.damper, gas_load=scene.load,
    )  # fmt: skip
    speeds = scene.speeds[:1] if quick else scene.speeds
    return [
        StudyScene(f"{scene.name} {speed / RPM:.0f}", scene.engine, speed, settings, scene.cutoff) for speed in speeds
    ]


def chosen_families(names: Sequence[str] | None, quick: bool) -> list[str]:
    """Families to be measured; ``InputError`` for one that does not exist."""
    for name in names or ():
        if name not in FAMILIES:
            raise InputError(f"--family '{name}' does not exist; {nearest(name, FAMILIES)}")
    return list(names or FAMILIES)


def study(
    scenes: Sequence[StudyScene],
    families: Sequence[str],
    quick: bool = False,
    store: Kept | None = None,
    say: Callable[[str], None] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Study:
    """Measure the families in the scenes; what is in the store is not run again.

    Parameters
    ----------
    say : told each run before it starts
    progress : called with the share of runs done
    """
    kept = store or Kept("tradeoff")
    repeats = 1 if quick else REPEATS
    plan = [(scene, family, FAMILIES[family](scene, quick)) for family in families for scene in scenes]
    total = repeats * sum(len(entries) for _, _, entries in plan) + len(scenes)
    done = 0

    def advance() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done / max(total, 1))

    estimates: Estimates = {}
    for scene in scenes:
        if say is not None:
            say(f"{scene.name}: reference")
        estimates[scene.name] = {
            name: value
            for name, value in error_estimate(reference_case(scene.case, quick), kept, say).items()
            if name in OUTPUTS
        }
        advance()
    points: list[Point] = []
    for scene, _, entries in plan:
        told = None if say is None else _prefixed(say, scene.name)
        for point in measured(entries, kept, repeats, told, advance):
            points.append(replace(point, parameters={"scene": scene.name, **point.parameters}))
    return Study(
        tuple(scenes), tuple(marked(points)), estimates, {s.name: speedups(in_scene(points, s.name)) for s in scenes}
    )


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
    own: list[tuple[float, float]] = []
    scipy: dict[str, list[tuple[float, float]]] = {}
    for point in points:
        method = str(point.parameters["integrator"])
        cost = point.seconds_per_simulated_second
        errors = [value for name in outputs if (value := point.error[name]) is not None]
        if point.parameters["error_kind"] != NUMERICAL or not point.usable or cost is None or not errors:
            continue
        if method in SCIPY:
            scipy.setdefault(f"{method}, {point.parameters['scaling']}", []).append((max(errors), cost))
        elif "scaling" not in point.parameters:
            own.append((max(errors), cost))
    if not own or not scipy:
        return None
    ours = cost_at(target, *zip(*own, strict=True))
    theirs = {name: cost_at(target, *zip(*rows, strict=True)) for name, rows in scipy.items()}
    reached = {name: cost for name, cost in theirs.items() if cost is not None}
    best = min(reached, key=reached.__getitem__) if reached else None
    ratio = reached[best] / ours if best is not None and ours else None
    return {"own": ours, "scipy": theirs, "scipy_best": best, "ratio": ratio}


def _prefixed(say: Callable[[str], None], name: str) -> Callable[[str], None]:
    return lambda stage: say(f"{name}: {stage}")
