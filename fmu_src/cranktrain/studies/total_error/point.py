"""A measured choice of levels and step: cost per simulated second, and parts of its total error."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from cranktrain.film.laws.register import bearing_law

PARTS = ("model", "numerical", "settling")


@dataclass(frozen=True)
class Split:
    """Total error of one output family and its parts, each a distance between two cycles.

    Attributes
    ----------
    total : the run's last cycle against that of the best model
    model : a fine run of the same model against the best one
    numerical : the run against that fine run
    settling : change of the run by one more cycle

    ``|model − numerical| ≤ total ≤ model + numerical`` by the triangle inequality. Settling is a separate error: all of
    them may still change by as much.
    """

    total: float
    model: float
    numerical: float
    settling: float


@dataclass(frozen=True)
class TotalPoint:
    """A choice of levels and step at one speed, with measured errors and cost.

    Attributes
    ----------
    cost : processor seconds per simulated second of a settled cycle; None if the run failed
    errors : by family; None if the model, or the best one, lacks its outputs
    default : True for the default choice of a run
    status : ok, or "failed: why"
    front : families in which no other point at this speed is both cheaper and more accurate
    seconds, cycles : processor seconds and cycles until the outputs repeated
    repeats : period in cycles; 0 if the outputs do not repeat
    """

    scene: str
    speed_rpm: float
    crank: str
    bearings: str
    block: str
    integrator: str
    step_deg: float
    cost: float | None
    errors: Mapping[str, Split | None]
    default: bool = False
    status: str = "ok"
    front: tuple[str, ...] = ()
    seconds: float | None = None
    cycles: int | None = None
    repeats: int | None = None

    @property
    def levels(self) -> str:
        """Levels of crank, bearings and block."""
        return f"{self.crank}/{self.bearings}/{self.block}"

    @property
    def label(self) -> str:
        """Text of the choice, with the integrator if it is not the usual one of the bearings."""
        method = "" if self.integrator == bearing_law(self.bearings).integrator else f" {self.integrator}"
        return f"{self.levels}{method} {self.step_deg:g}°"

    def total(self, family: str) -> float | None:
        """Total error of an output family, or None if the choice does not have the family's outputs."""
        found = self.errors.get(family)
        return None if found is None or self.status != "ok" or self.cost is None else found.total

    def as_dict(self) -> dict[str, Any]:
        """Dictionary of the point for JSON."""
        return {"label": self.label, **asdict(self)}


@dataclass(frozen=True)
class Best:
    """Best model of a scene: name, method, step, and cost of a settled cycle."""

    name: str
    integrator: str
    step_deg: float
    fine_grid: bool
    cost: float


def point_of(entry: Mapping[str, Any]) -> TotalPoint:
    """Point from the dictionary of :meth:`TotalPoint.as_dict`."""
    errors = {name: None if parts is None else Split(**parts) for name, parts in entry["errors"].items()}
    known = {name: value for name, value in entry.items() if name not in ("label", "errors", "front")}
    return TotalPoint(**known, errors=errors, front=tuple(entry["front"]))


def at_scene(points: Iterable[TotalPoint], scene: str) -> list[TotalPoint]:
    """Measured choices (points) that belong to one scene."""
    return [point for point in points if point.scene == scene]


def shown(points: Iterable[TotalPoint], family: str) -> list[TotalPoint]:
    """Measured choices (points) that have the outputs of a family, cheapest first."""
    return sorted((p for p in points if p.total(family) is not None), key=lambda p: p.cost or 0.0)


def percent(value: float) -> str:
    """Text of a relative error in per cent."""
    return f"{100.0 * value:.2g} %"
