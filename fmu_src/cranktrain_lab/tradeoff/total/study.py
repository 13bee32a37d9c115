"""Total-error study: each model and step is compared with the best model, and its error is split into parts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from cranktrain.core.errors import CranktrainError
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings, needed_parts
from cranktrain.engine.file import load_engine
from cranktrain.store.kept import Kept
from cranktrain.studies.total_error.families import FAMILIES, Cycle
from cranktrain.studies.total_error.point import Best, TotalPoint
from cranktrain_lab.tradeoff.families import StudyScene
from cranktrain_lab.tradeoff.pareto import with_fronts
from cranktrain_lab.tradeoff.total.choices import FINE, Method, Model, best_model, default_model, models
from cranktrain_lab.tradeoff.total.distance import split
from cranktrain_lab.tradeoff.total.measure import FINE_SETTLE, Job, Settled, settled

SPEEDS_RPM = (1000.0, 2000.0)
"""Default speeds, rev/min, of the shipped six-cylinder engine if no scene is given."""


@dataclass(frozen=True)
class TotalStudy:
    """Results of the study: points of all scenes, and the best model of each scene as reference."""

    scenes: tuple[StudyScene, ...]
    points: tuple[TotalPoint, ...]
    best: dict[str, Best]

    @property
    def pictures(self) -> list[tuple[str, str]]:
        """Pairs of scene and family for which at least one point has a total error."""
        return [
            (scene.name, family)
            for scene in self.scenes
            for family in FAMILIES
            if any(p.scene == scene.name and p.total(family) is not None for p in self.points)
        ]


def total_scenes(quick: bool) -> list[StudyScene]:
    """Return the default scenes: the shipped six-cylinder engine at ``SPEEDS_RPM``; quick: at the last speed only."""
    engine = load_engine("diesel_i6")
    speeds = SPEEDS_RPM[1:] if quick else SPEEDS_RPM
    return [StudyScene(f"{engine.name} {rpm:g}", engine, rpm * RPM, Settings()) for rpm in speeds]


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
    work = _Work(quick, store or Kept("total"), say or (lambda stage: None), progress or (lambda share: None))
    plans = [(scene, models(scene, quick)) for scene in scenes]
    work.total = sum(_weight(one) * (2 + len(one.methods(quick))) for _, found in plans for one in found)
    work.total += sum(_weight(best_model(scene)) * BEST_WEIGHT for scene in scenes)
    points, best = list[TotalPoint](), dict[str, Best]()
    for scene, found in plans:
        reference, best[scene.name] = work.best(scene)
        own = [point for one in found for point in work.points(scene, one, reference)]
        points += with_fronts(own)
    return TotalStudy(tuple(scenes), tuple(points), best)


BEST_WEIGHT = 8.0
"""Approximate work of the reference run, relative to a run of the same model at the usual step."""


def _weight(model: Model) -> float:
    """Return the approximate work of a model's run relative to a run with springs and dampers as bearings."""
    return model.work * (1.0 if model.settings.block == "ground" else 1.5)


class _Work:
    """Runs of a study, with their store, and the work done so far for progress reports."""

    def __init__(self, quick: bool, store: Kept, say: Callable[[str], None], progress: Callable[[float], None]) -> None:
        self.quick, self.store, self.say, self.progress = quick, store, say, progress
        self.total, self.done = 1.0, 0.0

    def best(self, scene: StudyScene) -> tuple[Cycle, Best]:
        """Return last cycle and description of the best model's run; full studies use a fine grid and a fine step."""
        top = best_model(scene)
        method = Method(FINE, top.usual.step_deg) if self.quick else top.fine
        settings = top.at(method)
        finer = not self.quick and "bore" in needed_parts(scene.engine, settings)
        self.say(f"{scene.name}: reference {top.name}")
        job = Job(scene.engine, scene.speed, settings, FINE_SETTLE, fine_grid=finer, goes_on=False)
        run = settled(job, self.store, self.say)
        self._advance(BEST_WEIGHT * _weight(top))
        return run.last, Best(top.name, method.integrator, method.step_deg, finer, run.cost)

    def points(self, scene: StudyScene, model: Model, reference: Cycle) -> list[TotalPoint]:
        """Return the measured points of a model, one for each integrator and step."""
        fine = self._settled(scene, model, model.fine, FINE_SETTLE, f"{model.name}, fine")
        self._advance(2.0 * _weight(model))
        found = []
        for method in model.methods(self.quick):
            what = f"{model.name}, {method.integrator} {method.step_deg:g} deg"
            run = self._settled(scene, model, method, None, what)
            self._advance(_weight(model))
            found.append(self._point(scene, model, method, run, fine, reference))
        return found

    def _point(
        self, scene: StudyScene, model: Model, method: Method, run: Settled | str, fine: Settled | str, reference: Cycle
    ) -> TotalPoint:
        """Return the point of a run; its status is the reason if this run or the fine run failed."""
        s, known = model.settings, dict[str, Any]()
        failed = next((one for one in (run, fine) if isinstance(one, str)), None)
        errors: dict[str, Any] = dict.fromkeys(FAMILIES)
        if failed is not None:
            known = {"status": f"failed: {failed}"}
        if isinstance(run, Settled):
            known |= {"seconds": run.seconds, "cycles": run.cycles, "repeats": run.repeats}
        if isinstance(run, Settled) and isinstance(fine, Settled):
            errors = {
                name: split(family, scene.engine, run.last, run.after, fine.last, reference)
                if family.answered(s, scene.engine) else None
                for name, family in FAMILIES.items()
            }  # fmt: skip
        default = model == default_model(scene) and method == model.usual
        cost = run.cost if isinstance(run, Settled) else None
        return TotalPoint(
            scene.name, round(scene.speed / RPM, 6), s.crank, s.bearings, s.block, method.integrator, method.step_deg,
            cost, errors, default, **known,
        )  # fmt: skip

    def _settled(
        self, scene: StudyScene, model: Model, method: Method, settle: float | None, what: str
    ) -> Settled | str:
        """Return a settled run of a model, or the error message if the run failed."""
        self.say(f"{scene.name}: {what}")
        job = Job(scene.engine, scene.speed, model.at(method))
        if settle is not None:
            job = Job(scene.engine, scene.speed, model.at(method), settle, goes_on=False)
        try:
            return settled(job, self.store, self.say)
        except CranktrainError as problem:
            return str(problem)

    def _advance(self, weight: float) -> None:
        self.done += weight
        self.progress(min(1.0, self.done / self.total))
