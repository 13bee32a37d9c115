"""Whole study of accuracy against speed: families over scenes, and references with their error."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.store.kept import Kept
from cranktrain.studies.scene import Scene, load_scene
from cranktrain_lab.tradeoff.families import FAMILIES, StudyScene
from cranktrain_lab.tradeoff.measure import Entry, measured
from cranktrain_lab.tradeoff.pareto import marked
from cranktrain_lab.tradeoff.point import OUTPUTS, Point
from cranktrain_lab.tradeoff.reference import error_estimate, reference_case

REPEATS = 3
"""Number of runs of a point in a full study. The median of their times is the point's cost."""

Estimates = dict[str, dict[str, float | None]]


@dataclass(frozen=True)
class Study:
    """Results of a study.

    ``estimates`` gives each scene's error of its reference by output.
    """

    scenes: tuple[StudyScene, ...]
    points: tuple[Point, ...]
    estimates: Estimates

    def as_dict(self) -> dict[str, Any]:
        """Return the study as a dictionary for JSON, with the largest reference error of all scenes."""
        worst: dict[str, float | None] = {}
        for name in OUTPUTS:
            found = [value for entry in self.estimates.values() if (value := entry.get(name)) is not None]
            worst[name] = max(found) if found else None
        return {
            "points": [point.as_dict() for point in self.points],
            "reference": {"error_estimate": worst, "scenes": self.estimates},
        }


def default_scenes(quick: bool) -> list[StudyScene]:
    """Return default scenes: the shipped six at 2000 rev/min; full studies add its resonance, and the V8."""
    wanted = [("diesel_i6", 2000.0)] if quick else [("diesel_i6", 2000.0), ("diesel_i6", 2200.0), ("diesel_v8", 1800.0)]
    return [StudyScene(f"{name} {rpm:g}", load_engine(name), rpm * RPM, Settings()) for name, rpm in wanted]


def scenes_of(path: str | Path | Scene, quick: bool) -> list[StudyScene]:
    """Return scenes of a scene file, one per speed (quick: the first speed only), at the levels that the file fixes."""
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
    """Return the functions of the families to measure; raises ``InputError`` for an unknown family name."""
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
    others: Callable[[StudyScene, bool], Sequence[Entry]] | None = None,
) -> Study:
    """Measure the families of choices in the scenes. Runs in the store are not repeated.

    Parameters
    ----------
    say : told each run before it starts
    progress : called with the share of runs done
    others : of a scene, and whether the study is quick: entries of other solvers beside the family ``integrators``
    """
    kept = store or Kept("tradeoff")
    repeats = 1 if quick else REPEATS
    plan = [(scene, FAMILIES[family](scene, quick)) for family in families for scene in scenes]
    if others is not None and "integrators" in families:
        plan += [(scene, list(others(scene, quick))) for scene in scenes]
    total = repeats * sum(len(entries) for _, entries in plan) + len(scenes)
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
    for scene, entries in plan:
        told = None if say is None else _prefixed(say, scene.name)
        for point in measured(entries, kept, repeats, told, advance):
            points.append(replace(point, parameters={"scene": scene.name, **point.parameters}))
    return Study(tuple(scenes), tuple(marked(points)), estimates)


def _prefixed(say: Callable[[str], None], name: str) -> Callable[[str], None]:
    return lambda stage: say(f"{name}: {stage}")
