"""Choice of levels by measured total errors: the cheapest pair within a scene's accuracy of the best model.

The figures ship with the package (:mod:`cranktrain.studies.total_error.shipped`). They are for complete choices of
levels and step, over all frequencies. At each speed of a scene, the larger error of the two neighbouring measured
speeds is used. Some scenes are not covered and get no figures: another engine, speeds beyond the measured ones, outputs
without a chart, damper, floating big ends, part load, a measured trace, heat balance of films.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cranktrain.core.types import Array
from cranktrain.studies.output_levels import plain_name
from cranktrain.studies.total_error.families import FAMILIES
from cranktrain.studies.total_error.point import TotalPoint, percent
from cranktrain.studies.total_error.shipped import Shipped, shipped

if TYPE_CHECKING:
    from cranktrain.studies.planning.ladder import Pair
    from cranktrain.studies.scene import Scene


@dataclass(frozen=True)
class ChartedChoice:
    """Choice of levels and step, with its errors and cost over a scene's speeds and outputs.

    Attributes
    ----------
    total, model : largest total error, and the largest model error
    models : the largest model error of each family of outputs
    cost : mean processor seconds per simulated second of a settled cycle
    """

    crank: str
    bearings: str
    block: str
    label: str
    total: float
    model: float
    cost: float
    models: Mapping[str, float]

    def of_outputs(self, scene: Scene) -> Array:
        """Model error of each of a scene's outputs, which must have charts, (outputs,)."""
        return np.array([self.models[family] for family in _families(scene, once=False)])

    @property
    def pair(self) -> Pair:
        """Crank level and bearing level."""
        return self.crank, self.bearings

    @property
    def plain(self) -> str:
        """Text of the choice, without the integrator if it is the usual one of the bearings."""
        return f"{self.crank}/{self.bearings}/{self.block} {self.label.rpartition(' ')[2]}"

    def __str__(self) -> str:
        """Text of the choice with its figures."""
        return f"{self.label}, {percent(self.total)} at {self.cost:.2g} processor seconds per second"


@dataclass(frozen=True)
class Charted:
    """Measured errors and costs of all choices of levels that apply to a scene.

    Attributes
    ----------
    chosen : the cheapest choice within the accuracy among those that the scene allows; None if there is none
    closest : the choice with the least total error among those that the scene allows
    elsewhere : the cheapest choice within the accuracy on another block than the scene's, if ``chosen`` is None
    best : name of the best model
    speeds_rpm : measured speeds that count
    current : whether the sources are still those that measured the figures
    """

    chosen: ChartedChoice | None
    closest: ChartedChoice
    elsewhere: ChartedChoice | None
    best: str
    speeds_rpm: tuple[float, ...]
    current: bool

    @property
    def against(self) -> str:
        """Text on the reference model and the speeds of the measured errors."""
        speeds = ", ".join(f"{rpm:g}" for rpm in self.speeds_rpm)
        old = "" if self.current else ", by earlier sources"
        return f"against {self.best}, measured at {speeds} rev/min{old}"

    def shortfall(self, accuracy: float) -> list[str]:
        """Text lines: one on the closest choices if no choice is within ``accuracy``; otherwise an empty list."""
        if self.chosen is not None:
            return []
        line = f"no measured choice serves {percent(accuracy)} {self.against}; closest {self.closest}"
        return [line if self.elsewhere is None else f"{line}; with block {self.elsewhere.block} {self.elsewhere}"]


def charted(scene: Scene, allowed: Callable[[Pair], bool], figures: Shipped | None = None) -> Charted | None:
    """Shipped errors and costs for a scene, or None if they do not cover it; ``allowed`` is true for allowed levels."""
    known = figures or shipped(scene.engine)
    families = _families(scene)
    # Shipped errors were measured under these conditions.
    usual = (scene.damper, scene.big_ends, scene.load, scene.film_temperature) == ("none", "rigid", 1.0, "engine")
    free = scene.integrator is None and scene.step is None and scene.cutoff is None
    plain = usual and free and scene.pressure is None and not scene.stress
    if known is None or not families or not plain:
        return None
    speeds = around(scene.speeds_rpm, known.speeds_rpm)
    measured = [] if speeds is None else choices(known.points, speeds, families)
    measured = [one for one in measured if allowed(one.pair)]
    own = [one for one in measured if one.block == scene.block]
    if speeds is None or not own:
        return None
    chosen = _cheapest(own, scene.accuracy)
    if chosen is not None and scene.budget is not None and chosen.cost > scene.budget:
        chosen = None
    elsewhere = None if chosen is not None else _cheapest(measured, scene.accuracy)
    best = next(point.scene for point in known.points if point.speed_rpm == speeds[0])
    closest = min(own, key=lambda one: one.total)
    return Charted(chosen, closest, elsewhere, known.best[best].name, speeds, known.current)


def around(wanted: Sequence[float], measured: Sequence[float]) -> tuple[float, ...] | None:
    """Measured speeds at or next to the wanted speeds; None if a wanted speed is outside the measured range."""
    found = set[float]()
    for speed in wanted:
        below = [one for one in measured if one <= speed * (1.0 + 1e-6)]
        above = [one for one in measured if one >= speed * (1.0 - 1e-6)]
        if not below or not above:
            return None
        found |= {max(below), min(above)}
    return tuple(sorted(found))


def _families(scene: Scene, once: bool = True) -> list[str]:
    """Output families of a scene's outputs, each family ``once`` or one entry per output; empty if one has no chart."""
    found = []
    for output in map(plain_name, scene.outputs):
        family = next((name for name, row in FAMILIES.items() if output in row.outputs), None)
        if family is None:
            return []
        found.append(family)
    return list(dict.fromkeys(found)) if once else found


def choices(points: Sequence[TotalPoint], speeds: Sequence[float], families: Sequence[str]) -> list[ChartedChoice]:
    """Measured choices that provide all output families at all speeds."""
    groups: dict[str, list[TotalPoint]] = {}
    for point in points:
        if point.speed_rpm in speeds:
            groups.setdefault(point.label, []).append(point)
    found = []
    for label, own in groups.items():
        parts = [(f, point.errors[f]) for point in own for f in families if point.total(f) is not None]
        if len(parts) < len(speeds) * len(families):
            continue
        models: dict[str, float] = {}
        for family, part in parts:
            models[family] = max(models.get(family, 0.0), min(part.model, part.total) if part else 0.0)
        total, cost = max(part.total for _, part in parts if part), sum(point.cost or 0.0 for point in own) / len(own)
        first = own[0]
        found.append(
            ChartedChoice(
                first.crank, first.bearings, first.block, label, total, max(models.values()), cost, models
            )
        )  # fmt: skip
    return found


def _cheapest(choices: Sequence[ChartedChoice], accuracy: float) -> ChartedChoice | None:
    return min((one for one in choices if one.total <= accuracy), key=lambda one: one.cost, default=None)
