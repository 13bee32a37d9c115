"""Models of the study, as crank × bearings × block, each at a few steps, with the best model as reference.

Valid combinations of levels come from the registers. Combinations that a run refuses are left out, and so are a
flexible block with a crank or bearings that cannot follow it, and films with tilt on a crank whose journals do not
tilt.
"""

from __future__ import annotations

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
"""Steps of a model by its bearings' class of cost: all with many samples of a cycle in common."""
QUICK_DEG = (5.0, 2.5)
QUICK = (CHEAP, MODERATE)
"""Classes of cost of a quick study."""
FINE, FINE_DEG = "esdirk47", {CHEAP: 0.5, MODERATE: 0.5, DEAR: 1.0, DEAREST: 1.0}
"""Method and steps of runs that others are compared with: their error is far below the least total error of a table."""
WORK = {CHEAP: 1.0, MODERATE: 3.0, DEAR: 30.0, DEAREST: 100.0}
"""Approximate relative work of a run by its bearings' class of cost, for progress."""


class Method(NamedTuple):
    """Integrator and step."""

    integrator: str
    step_deg: float


@dataclass(frozen=True)
class Model:
    """Engine at fidelity levels, without integrator step."""

    engine: Engine
    speed: float
    settings: Settings

    @property
    def name(self) -> str:
        """Crank, bearings and block for people."""
        return f"{self.settings.crank}/{self.settings.bearings}/{self.settings.block}"

    @property
    def cost(self) -> str:
        """Class of cost of its bearings."""
        return bearing_law(self.settings.bearings).cost

    @property
    def work(self) -> float:
        """What a run takes beside one of springs and dampers, about."""
        return WORK[self.cost]

    @property
    def usual(self) -> Method:
        """Method and step of a run that chooses none."""
        return Method(self.settings.integrator, bearing_law(self.settings.bearings).step_deg)

    @property
    def fine(self) -> Method:
        """Method and step of the run that its numerical errors are measured against."""
        return Method(FINE, FINE_DEG[self.cost])

    def methods(self, quick: bool) -> list[Method]:
        """Methods and steps to measure: the usual integrator's, and the fine runs' own where that is another."""
        steps = QUICK_DEG if quick else STEPS_DEG[self.cost]
        found = [Method(self.settings.integrator, step) for step in steps]
        return list(dict.fromkeys([*found, self.usual, Method(FINE, self.usual.step_deg)]))

    def at(self, method: Method) -> Settings:
        """Settings with a method and step; where closing films bound the steps, a finer step has a finer bound."""
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
    """Models of a scene's engine, the lowest levels first, the best one last."""
    ladder = bearing_ladder(scene.engine.rollers_only)
    for crank, bearings, block in product(CRANKS, ladder, BLOCKS):
        if goes_together(scene.engine, crank, bearings, block):
            yield model(scene, crank, bearings, block)


def models(scene: StudyScene, quick: bool) -> list[Model]:
    """Models that are points of a chart; a quick study leaves films that are solved online out."""
    found = [one for one in every_model(scene) if not quick or one.cost in QUICK]
    return [one for one in found if any(family.answered(one.settings, one.engine) for family in FAMILIES.values())]


def best_model(scene: StudyScene) -> Model:
    """The top level of each kind that the engine has: what all are compared with."""
    return list(every_model(scene))[-1]


def default_model(scene: StudyScene) -> Model:
    """The model that a run takes where the user, or the scene, chooses nothing."""
    s = resolved(scene.settings, scene.engine)
    return model(scene, s.crank, s.bearings, s.block)


def model(scene: StudyScene, crank: str, bearings: str, block: str) -> Model:
    """The scene's engine at these levels and the integrator that is usual there."""
    plain, guided = Settings(), "guided" if block == "flexible" else "rigid"
    chosen = replace(
        scene.settings, crank=crank, bearings=bearings, block=block, pistons=guided, integrator=plain.integrator,
        step=plain.step, control=plain.control, tolerance=plain.tolerance, newton_tolerance=None, film_change=None,
    )  # fmt: skip
    return Model(scene.engine, scene.speed, resolved(chosen, scene.engine))


def goes_together(engine: Engine, crank: str, bearings: str, block: str) -> bool:
    """True if these levels make a meaningful model."""
    law, row = bearing_law(bearings), crank_level(crank)
    try:
        check_levels(resolved(Settings(crank=crank, bearings=bearings, block=block), engine), engine)
    except InputError:
        return False
    follows = block == "ground" or (row.elastic and law.carries)
    return follows and (row.bends or not law.tilt)
