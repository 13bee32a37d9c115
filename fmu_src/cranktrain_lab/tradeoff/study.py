"""Whole study of accuracy against speed, with two kinds of error.

Families of choices are each compared with a reference of their own, whose error is estimated. For the total error each
model and step is compared with the best model, and its error is split into parts.
"""

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from cranktrain.core.errors import CranktrainError, InputError, nearest
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings, needed_parts
from cranktrain.engine.file import load_engine
from cranktrain.store.kept import Kept
from cranktrain.studies.scene import Scene, load_scene
from cranktrain.studies.total_error.families import FAMILIES as OUTPUT_FAMILIES
from cranktrain.studies.total_error.families import Cycle
from cranktrain.studies.total_error.point import Best, TotalPoint
from cranktrain.studies.total_error.shipped import engine_digest, model_sources
from cranktrain_lab.tradeoff.families import FAMILIES, StudyScene
from cranktrain_lab.tradeoff.level_points import error_estimate, reference_case
from cranktrain_lab.tradeoff.measure import Entry, measured
from cranktrain_lab.tradeoff.models import FINE, Method, Model, best_model, default_model, models
from cranktrain_lab.tradeoff.point import OUTPUTS, Point, marked, with_fronts
from cranktrain_lab.tradeoff.settled import Job, Settled, settled, split

COMMAND = "cranktrain tradeoff --total"
SPEEDS_RPM = (1000.0, 2000.0)
"""Default speeds, rev/min, of total errors of the shipped six-cylinder engine if no scene is given."""
REPEATS = 3
"""Number of runs of a point in a full study. The median of their times is the point's cost."""
BEST_WEIGHT = 8.0
"""Approximate work of the run of the best model, relative to a run of the same model at the usual step."""

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


@dataclass(frozen=True)
class TotalStudy:
    """Results of the study: points of all scenes, and the best model of each scene as reference."""

    scenes: tuple[StudyScene, ...]
    points: tuple[TotalPoint, ...]
    best: dict[str, Best]

    def as_dict(self) -> dict[str, Any]:
        """Return the study for JSON, as shipped with the program. All scenes must have the same engine."""
        engine = self.scenes[0].engine
        return {
            "command": COMMAND,
            "what": "measured total errors against cost; see docs/tradeoff.md",
            "engine": engine.name,
            "engine_digest": engine_digest(engine),
            "sources_digest": model_sources(),
            "best": {scene: asdict(best) for scene, best in self.best.items()},
            "points": [point.as_dict() for point in self.points],
        }

    @property
    def pictures(self) -> list[tuple[str, str]]:
        """Pairs of scene and family for which at least one point has a total error."""
        return [
            (scene.name, family)
            for scene in self.scenes
            for family in OUTPUT_FAMILIES
            if any(p.scene == scene.name and p.total(family) is not None for p in self.points)
        ]


def default_scenes(quick: bool, total: bool = False) -> list[StudyScene]:
    """Return the default scenes. A ``quick`` study has one: the shipped six at 2000 rev/min.

    A full study also has the six in resonance and the V8. A study of ``total`` errors has the six at ``SPEEDS_RPM``.
    """
    of_total = [("diesel_i6", rpm) for rpm in SPEEDS_RPM]
    wanted = [("diesel_i6", 2000.0), ("diesel_i6", 2200.0), ("diesel_v8", 1800.0)]
    wanted = [("diesel_i6", 2000.0)] if quick else of_total if total else wanted
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


def chosen_families(names: Sequence[str] | None) -> list[str]:
    """Return the names of the families to measure; raises ``InputError`` for an unknown family name."""
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
    say : receives the name of each run before it starts
    progress : called with the fraction of finished runs
    others : function of a scene, and of True for a quick study, that returns entries of other solvers, which are added
        to the family ``integrators``
    """
    repeats = 1 if quick else REPEATS
    plan = [(scene, FAMILIES[family](scene, quick)) for family in families for scene in scenes]
    if others is not None and "integrators" in families:
        plan += [(scene, list(others(scene, quick))) for scene in scenes]
    work = _Work(store, say, progress, repeats * sum(len(entries) for _, entries in plan) + len(scenes))
    estimates: Estimates = {}
    for scene in scenes:
        work.say(f"{scene.name}: reference")
        found = error_estimate(reference_case(scene.case, quick), work.store, say)
        estimates[scene.name] = {name: found[name] for name in OUTPUTS}
        work.advance()
    points: list[Point] = []
    for scene, entries in plan:
        told = partial(lambda name, stage: work.say(f"{name}: {stage}"), scene.name)
        for point in measured(entries, work.store, repeats, told, work.advance):
            points.append(replace(point, parameters={"scene": scene.name, **point.parameters}))
    return Study(tuple(scenes), tuple(marked(points)), estimates)


def total_study(
    scenes: Sequence[StudyScene],
    quick: bool = False,
    store: Kept | None = None,
    say: Callable[[str], None] | None = None,
    progress: Callable[[float], None] | None = None,
) -> TotalStudy:
    """Measure all models and steps in the scenes; runs that are in the store are not repeated.

    Parameters
    ----------
    say : called with the name of each run before it starts
    progress : called with the fraction of runs done, weighted by their approximate cost
    """
    plans = [(scene, models(scene, quick), best_model(scene)) for scene in scenes]
    total = sum(one.work * (2 + len(one.methods(quick))) for _, found, _ in plans for one in found)
    work = _Work(store, say, progress, total + sum(BEST_WEIGHT * top.work for *_, top in plans))
    points, best = list[TotalPoint](), dict[str, Best]()
    for scene, found, top in plans:
        # Last cycle and description of the best model's run; full studies use a fine grid and a fine step.
        method = Method(FINE, top.usual.step_deg) if quick else top.fine
        settings = top.at(method)
        finer = not quick and "bore" in needed_parts(scene.engine, settings)
        work.say(f"{scene.name}: reference {top.name}")
        run = settled(Job(scene.engine, scene.speed, settings, reference=True, fine_grid=finer), work.store, work.say)
        work.advance(BEST_WEIGHT * top.work)
        reference, best[scene.name] = run.last, Best(top.name, method.integrator, method.step_deg, finer, run.cost)
        points += with_fronts([point for one in found for point in _model_points(work, scene, one, quick, reference)])
    return TotalStudy(tuple(scenes), tuple(points), best)


class _Work:
    """Progress of a study of ``total`` work, and the store of its finished runs."""

    def __init__(
        self, store: Kept | None, say: Callable[[str], None] | None, progress: Callable[[float], None] | None,
        total: float,
    ) -> None:  # fmt: skip
        self.store, self.say = store or Kept("tradeoff"), say or (lambda stage: None)
        self._progress, self._total, self._done = progress or (lambda share: None), total, 0.0

    def advance(self, weight: float = 1.0) -> None:
        self._done += weight
        self._progress(min(1.0, self._done / self._total))


def _model_points(work: _Work, scene: StudyScene, model: Model, quick: bool, reference: Cycle) -> Iterator[TotalPoint]:
    """Yield the measured points of a model, one for each integrator and step."""

    def done(method: Method, what: str, fine: bool = False) -> Settled | str:
        """Return a settled run, or the error message if the run failed."""
        work.say(f"{scene.name}: {model.name}, {what}")
        found: Settled | str
        try:
            found = settled(Job(scene.engine, scene.speed, model.at(method), reference=fine), work.store, work.say)
        except CranktrainError as problem:
            found = str(problem)
        work.advance((2.0 if fine else 1.0) * model.work)
        return found

    fine = done(model.fine, "fine", fine=True)
    for method in model.methods(quick):
        run = done(method, f"{method.integrator} {method.step_deg:g} deg")
        yield _total_point(scene, model, method, run, fine, reference)


def _total_point(
    scene: StudyScene, model: Model, method: Method, run: Settled | str, fine: Settled | str, reference: Cycle
) -> TotalPoint:
    """Return the point of a run; its status is the reason if this run or the fine run failed."""
    s, known = model.settings, dict[str, Any]()
    errors: dict[str, Any] = dict.fromkeys(OUTPUT_FAMILIES)
    if failed := next((one for one in (run, fine) if isinstance(one, str)), None):
        known = {"status": f"failed: {failed}"}
    if isinstance(run, Settled):
        known |= {"seconds": run.seconds, "cycles": run.cycles, "repeats": run.repeats}
    if isinstance(run, Settled) and isinstance(fine, Settled):
        errors = {
            name: split(family, scene.engine, run.last, run.after, fine.last, reference)
            if family.answered(s, scene.engine) else None
            for name, family in OUTPUT_FAMILIES.items()
        }  # fmt: skip
    default = model == default_model(scene) and method == model.usual
    return TotalPoint(
        scene.name, round(scene.speed / RPM, 6), s.crank, s.bearings, s.block, method.integrator, method.step_deg,
        run.cost if isinstance(run, Settled) else None, errors, default, **known,
    )  # fmt: skip
