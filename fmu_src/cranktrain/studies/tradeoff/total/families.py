"""Output families that the chart of total error has a picture for, and how far two runs are apart in each.

Distance of two cycles y and z in a family: of each member m (an output, or the axes of one vector) the RMS of the
difference over the RMS of the reference's alternating part, and of these the largest,

    |y − z| = max_m  ( Σ_axes mean (y − z)² / Σ_axes var y_ref )^½ .

With the reference's own scale in all of them this is a norm, so that distances add up along any way of runs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.outputs.register import output_counts, output_names
from cranktrain.engine.levels import Levels
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.studies.answers import plain_name, refuse_beyond

Cycle = Mapping[str, Array]
"""Last cycle of a run: outputs by name, each (samples,) at the ends of even intervals."""


@dataclass(frozen=True)
class Family:
    """Outputs that are judged together.

    Attributes
    ----------
    name, title : for files and tables, and for pictures
    outputs : names without the number of a member; several are the axes of one vector
    """

    name: str
    title: str
    outputs: tuple[str, ...]

    def members(self, engine: Engine) -> list[tuple[str, ...]]:
        """Outputs of an engine's runs that belong to it, those of one member together."""
        found: dict[str, list[str]] = {}
        for name in output_names(output_counts(engine)):
            if plain_name(name) in self.outputs:
                found.setdefault(name.partition("]")[0] if "]" in name else "", []).append(name)
        return [tuple(names) for names in found.values()]

    def answered(self, settings: Settings, engine: Engine) -> bool:
        """Whether a model at these levels, nothing left open, has these outputs."""
        s = settings
        levels = Levels(s.crank, s.bearings, s.block, s.big_ends, s.pistons, s.damper)
        try:
            refuse_beyond(levels, self.outputs, engine=engine)
        except InputError:
            return False
        return bearing_law(s.bearings).carries or not any(name.startswith("bearing") for name in self.outputs)


FAMILIES: dict[str, Family] = {
    row.name: row
    for row in (
        Family("torsion", "torsion of the pulley", ("pulley.torsion",)),
        Family("axial", "axial motion of the pulley", ("pulley.axial",)),
        Family("forces", "forces of the main bearings", ("bearing.force.x", "bearing.force.y")),
        Family("film", "least film of the main bearings", ("bearing.film_thickness_min",)),
        Family("cover", "acceleration of the cover", ("cover.acceleration",)),
    )
}
"""One row a picture."""


def wanted(engine: Engine) -> list[str]:
    """Outputs of an engine's runs that any family judges."""
    return [name for family in FAMILIES.values() for member in family.members(engine) for name in member]


def distance(family: Family, engine: Engine, one: Cycle, other: Cycle, reference: Cycle) -> float | None:
    """How far two cycles are apart in a family, over the reference's alternating part; None where one lacks it.

    Cycles of different numbers of samples are compared where both have one. A member that does not move in the
    reference says nothing.
    """
    largest = None
    for names in family.members(engine):
        if any(name not in cycle for cycle in (one, other, reference) for name in names):
            return None
        square = sum(float(np.mean((_common(one[n], other[n]) - _common(other[n], one[n])) ** 2)) for n in names)
        scale = sum(float(np.var(reference[n])) for n in names)
        if scale > 0.0:
            largest = max(largest or 0.0, math.sqrt(square / scale))
    return largest


def _common(values: Array, other: Array) -> Array:
    """Samples where another cycle of the same length has some as well."""
    every = values.size // math.gcd(values.size, other.size)
    return values[every - 1 :: every]
