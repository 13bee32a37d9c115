"""Models of the total-error study: levels of crank × bearings × block, each at a few steps, and the best model.

Valid combinations of levels come from the registers. Combinations that a run refuses are left out, and so are a
flexible block with a crank or bearings that cannot follow it, and films with tilt on a crank whose journals do not
tilt.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.settings import Settings, check_levels, resolved
from cranktrain.engine.levels import BLOCKS, CRANKS, crank_level
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import CHEAP, DEAR, DEAREST, MODERATE, bearing_law
from cranktrain.studies.output_levels import bearing_ladder
from cranktrain.studies.total_error.families import FAMILIES
from cranktrain_lab.tradeoff.families import StudyScene

STEPS_DEG = {CHEAP: (6.0, 5.0, 3.0, 1.0), MODERATE: (6.0, 5.0, 3.0, 1.0), DEAR: (5.0, 2.5), DEAREST: (2.0,)}
"""Integrator steps (degrees) of a model, by the class of cost of its bearings. All steps share many sample angles."""
QUICK_DEG = (5.0, 2.5)
QUICK = (CHEAP, MODERATE)
"""Classes of cost of the bearings that a quick study includes."""
FINE, FINE_DEG = "esdirk47", {CHEAP: 0.5, MODERATE: 0.5, DEAR: 1.0, DEAREST: 1.0}
"""Integrator and steps (degrees) of reference runs, whose error is far below the least total error in a table."""
WORK = {CHEAP: 1.0, MODERATE: 3.0, DEAR: 30.0, DEAREST: 100.0}
"""Approximate work of a run relative to bearings of the cheapest class, by class of cost; for progress reports."""


class Method(NamedTuple):
    """Integrator and its step in degrees of crank angle."""

    integrator: str
    step_deg: float


@dataclass(frozen=True)
class Model:
    """Engine at a speed (rad/s) with settings of the fidelity levels; the integrator's step is chosen separately."""

    engine: Engine
    speed: float
    settings: Settings

    @property
    def name(self) -> str:
        """Levels of crank, bearings and block as text, for example ``torsional/linear/ground``."""
        return f"{self.settings.crank}/{self.settings.bearings}/{self.settings.block}"

    @property
    def cost(self) -> str:
        """Class of cost of the model's bearing level."""
        return bearing_law(self.settings.bearings).cost

    @property
    def work(self) -> float:
        """Approximate work of a run relative to a run with springs and dampers as bearings on a block on ground."""
        return WORK[self.cost] * (1.0 if self.settings.block == "ground" else 1.5)

    @property
    def usual(self) -> Method:
        """Default integrator and step of the model."""
        return Method(self.settings.integrator, bearing_law(self.settings.bearings).step_deg)

    @property
    def fine(self) -> Method:
        """Integrator and step of the fine run from which the model's numerical errors are measured."""
        return Method(FINE, FINE_DEG[self.cost])

    def methods(self, quick: bool) -> list[Method]:
        """Return methods to measure: the default integrator at several steps, and ``FINE`` at the usual step."""
        steps = QUICK_DEG if quick else STEPS_DEG[self.cost]
        found = [Method(self.settings.integrator, step) for step in steps]
        return list(dict.fromkeys([*found, self.usual, Method(FINE, self.usual.step_deg)]))

    def at(self, method: Method) -> Settings:
        """Return settings with this method; the bound of a film's change per step, if any, is reduced with the step."""
        law = bearing_law(self.settings.bearings)
        change = law.film_change
        if change < 1.0:
            change *= min(1.0, method.step_deg / law.step_deg)
        chosen = replace(
            self.settings, integrator=method.integrator, step=math.radians(method.step_deg), film_change=change,
            newton_tolerance=None,
        )  # fmt: skip
        return resolved(chosen, self.engine)


def every_model(scene: StudyScene) -> Iterator[Model]:
    """Yield all models of a scene's engine, the lowest levels first and the best model last."""
    ladder = bearing_ladder(scene.engine.rollers_only)
    for crank, bearings, block in product(CRANKS, ladder, BLOCKS):
        if goes_together(scene.engine, crank, bearings, block):
            yield model(scene, crank, bearings, block)


def models(scene: StudyScene, quick: bool) -> list[Model]:
    """Return the models of a scene to measure; a quick study omits bearings of classes of cost not in ``QUICK``."""
    found = [one for one in every_model(scene) if not quick or one.cost in QUICK]
    return [one for one in found if any(family.answered(one.settings, one.engine) for family in FAMILIES.values())]


def best_model(scene: StudyScene) -> Model:
    """Return the model with the highest levels of crank, bearings and block, which is the reference of all others."""
    return list(every_model(scene))[-1]


def default_model(scene: StudyScene) -> Model:
    """Return the model of a run at default levels, except those that the scene's settings fix."""
    s = resolved(scene.settings, scene.engine)
    return model(scene, s.crank, s.bearings, s.block)


def model(scene: StudyScene, crank: str, bearings: str, block: str) -> Model:
    """Return the scene's engine at these levels, with the default integrator of the levels."""
    plain, guided = Settings(), "guided" if block == "flexible" else "rigid"
    chosen = replace(
        scene.settings, crank=crank, bearings=bearings, block=block, pistons=guided, integrator=plain.integrator,
        step=plain.step, control=plain.control, tolerance=plain.tolerance, newton_tolerance=None, film_change=None,
    )  # fmt: skip
    return Model(scene.engine, scene.speed, resolved(chosen, scene.engine))


def goes_together(engine: Engine, crank: str, bearings: str, block: str) -> bool:
    """True if these levels of crank, bearings and block can be combined in one model of the engine."""
    law, row = bearing_law(bearings), crank_level(crank)
    try:
        check_levels(resolved(Settings(crank=crank, bearings=bearings, block=block), engine), engine)
    except InputError:
        return False
    follows = block == "ground" or (row.elastic and law.carries)
    return follows and (row.bends or not law.tilt)
