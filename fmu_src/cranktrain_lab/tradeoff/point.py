"""Measured point of the study: a choice, its cost per simulated second, its errors; and the Pareto front of points."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from cranktrain.studies.total_error.families import FAMILIES
from cranktrain.studies.total_error.point import TotalPoint, shown

OUTPUTS = ("pulley_torsion", "pulley_axial", "bearing_film")
"""Outputs whose errors are used to compare points."""
OTHERS = ("shaft_torque", "bearing_force")
"""Further outputs whose errors are stored."""
NUMERICAL, MODEL, TOP, INPUT = "numerical", "model", "top", "input"
"""Kinds of error, by reference: the same model with a finer step; the next finer level; the top level, or the finest
value of a varied setting; the same model with exact inputs."""
UNSETTLED = ("start_unsettled", "reference_start_unsettled")
"""Names of parameters of a point whose run or reference run started from a motion that is not periodic."""


@dataclass(frozen=True)
class Point:
    """Choice with measured errors and cost.

    Attributes
    ----------
    family, label : varied quantity, and name of this choice
    parameters : the choice in numbers and names. ``error_kind`` names the reference of the error; ``settling`` is the
        largest change of an output of ``OUTPUTS`` over the last cycle (None after one cycle); ``solver`` names a solver
        other than the stage solver; ``start_unsettled`` and ``reference_start_unsettled`` are the settling errors of
        the initial motion of the run and of its reference, if that motion does not repeat
    seconds_per_simulated_second : processor seconds; None if the run failed
    error : relative error of each of ``OUTPUTS``: RMS of the difference over the last cycle over the RMS of the
        reference's alternating part, for films the largest of all mains; None if the level lacks the output
    other_errors : the same for ``OTHERS``; for bearing forces the largest of all mains
    status : ok, unstable, or "failed: why"
    pareto : True if no other point of its scene and kind of error is both cheaper and more accurate
    """

    family: str
    label: str
    parameters: Mapping[str, Any]
    seconds_per_simulated_second: float | None
    error: Mapping[str, float | None]
    status: str = "ok"
    pareto: bool = False
    other_errors: Mapping[str, float | None] = field(default_factory=dict)

    @property
    def worst(self) -> float | None:
        """Largest of the point's errors, or None if no output has an error."""
        found = [value for value in self.error.values() if value is not None]
        return max(found) if found else None

    @property
    def solver(self) -> str:
        """Name of the solver that ran the point, if it is not the stage solver, else empty."""
        return str(self.parameters.get("solver", ""))

    @property
    def unsettled(self) -> float | None:
        """Larger settling error of the starts of run and reference run. None if both starts are periodic."""
        found = [self.parameters[name] for name in UNSETTLED if self.parameters.get(name) is not None]
        return max(found, default=None)

    @property
    def group(self) -> tuple[str, str]:
        """Scene and kind of error of the point. Points are compared within the same group only."""
        return str(self.parameters.get("scene", "")), str(self.parameters["error_kind"])

    @property
    def usable(self) -> bool:
        """True if cost and error are available."""
        return self.status == "ok" and self.seconds_per_simulated_second is not None and self.worst is not None

    def as_dict(self) -> dict[str, Any]:
        """Return the point as a dictionary for JSON."""
        return asdict(self)


def in_scene(points: Iterable[Point], scene: str) -> list[Point]:
    """Return the points of one scene."""
    return [point for point in points if point.parameters.get("scene") == scene]


def pareto_front(costs: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Return indices of the non-dominated choices, cheapest first.

    A choice is dominated by a choice that is no worse in both and better in one. Of equal choices the first is kept.
    """
    front: list[int] = []
    for index in sorted(range(len(costs)), key=lambda k: (costs[k], errors[k], k)):
        if not front or errors[index] < errors[front[-1]]:
            front.append(index)
    return front


def marked(points: Sequence[Point]) -> list[Point]:
    """Return points with ``pareto`` set, by cost and largest error, within each scene and kind of error.

    Errors against the next finer level have no front, because each level has another reference.
    """
    groups: dict[tuple[str, str], list[int]] = defaultdict(list)
    for index, point in enumerate(points):
        if point.usable and point.parameters["error_kind"] != MODEL:
            groups[point.group].append(index)
    front = set()
    for members in groups.values():
        costs = [points[k].seconds_per_simulated_second or 0.0 for k in members]
        errors = [points[k].worst or 0.0 for k in members]
        front |= {members[k] for k in pareto_front(costs, errors)}
    return [replace(point, pareto=index in front) for index, point in enumerate(points)]


def with_fronts(points: Sequence[TotalPoint]) -> list[TotalPoint]:
    """Return the points of one speed, with ``front`` set to the output families in whose Pareto front a point is."""
    fronts = {family: set(map(id, front(points, family))) for family in FAMILIES}
    return [replace(p, front=tuple(name for name, found in fronts.items() if id(p) in found)) for p in points]


def front(points: Iterable[TotalPoint], family: str) -> list[TotalPoint]:
    """Return the Pareto front of a speed's points in cost and total error of an output family, cheapest first."""
    own = shown(points, family)
    return [own[k] for k in pareto_front([p.cost or 0.0 for p in own], [p.total(family) or 0.0 for p in own])]
