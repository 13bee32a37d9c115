"""Output families with a picture in the chart of total error, whose outputs are judged together."""

from collections.abc import Mapping
from dataclasses import dataclass

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.outputs.register import output_counts, output_names
from cranktrain.engine.levels import Levels
from cranktrain.engine.model import Engine
from cranktrain.studies.output_levels import plain_name, refuse_beyond

Cycle = Mapping[str, Array]
"""Last cycle of a run: outputs by name, each (samples,) at the ends of equal intervals."""


@dataclass(frozen=True)
class Family:
    """Family of outputs that are judged together.

    Attributes
    ----------
    name, title : for files and tables, and for pictures
    outputs : names without the number of a member; several are the axes of one vector
    alternating : True if means are left out, because they depend on earlier cycles
    """

    name: str
    title: str
    outputs: tuple[str, ...]
    alternating: bool = False

    def members(self, engine: Engine) -> list[tuple[str, ...]]:
        """Outputs of an engine's runs that belong to the family, grouped by member."""
        found: dict[str, list[str]] = {}
        for name in output_names(output_counts(engine)):
            if plain_name(name) in self.outputs:
                found.setdefault(name.partition("]")[0] if "]" in name else "", []).append(name)
        return [tuple(names) for names in found.values()]

    def answered(self, settings: Settings, engine: Engine) -> bool:
        """True if a model at these complete levels has the outputs of the family."""
        s = settings
        levels = Levels(s.crank, s.bearings, s.block, s.big_ends, s.pistons, s.damper)
        try:
            refuse_beyond(levels, self.outputs, engine=engine)
        except InputError:
            return False
        return True


FAMILIES: dict[str, Family] = {
    row.name: row
    for row in (
        Family("torsion", "torsion of the pulley", ("pulley.torsion",)),
        Family(
            "axial", "axial motion of the pulley", ("pulley.axial",), alternating=True
        ),  # a sliding spline has a memory
        Family("forces", "forces of the main bearings", ("bearing.force.x", "bearing.force.y")),
        Family("film", "least film of the main bearings", ("bearing.film_thickness_min",)),
        Family("cover", "acceleration of the cover", ("cover.acceleration",)),
    )
}
"""All output families by name; each has a picture in the chart of total error."""


def wanted(engine: Engine) -> list[str]:
    """Outputs of an engine's runs that belong to at least one family."""
    return [name for family in FAMILIES.values() for member in family.members(engine) for name in member]
