"""Recommended choices for an accuracy as text, from the measured points."""

from collections.abc import Callable, Sequence

from cranktrain_lab.tradeoff.point import NUMERICAL, TOP, Point, in_scene
from cranktrain_lab.tradeoff.study import Study

ACCURACIES = (0.1, 0.01, 0.001)
NAMED = 4
"""Largest number of runs that the text lists because their start is not periodic."""


def choice_text(study: Study) -> str:
    """Return the text of recommended choices for 10 %, 1 % and 0.1 % in each scene."""
    lines = [
        "What to choose, from the measured points. Errors are the largest of pulley torsion, pulley axial motion and",
        "least film: RMS of the difference over the last cycle over the RMS of the reference's alternating part.",
        "Numerical error (same model, finer step) and model error (against the top of a ladder) are told apart, and",
        "add.",
    ]
    for scene in study.scenes:
        points = in_scene(study.points, scene.name)
        lines += ["", scene.name]
        doubt = max((value for value in study.estimates[scene.name].values() if value is not None), default=0.0)
        if doubt > ACCURACIES[-1]:
            lines.append(
                f"  the reference itself is off by {doubt:.1e}: smaller errors say nothing. Where finer steps do not "
                "help, neighbouring motions part at this speed; choose one at which the motion repeats."
            )
        lines += unsettled_lines(points)
        for accuracy in (accuracy for accuracy in ACCURACIES if accuracy >= doubt):
            lines += [f"  {100 * accuracy:g} %"]
            lines += [f"    {line}" for line in _choices(points, accuracy)]
    return "\n".join(lines) + "\n"


def unsettled_lines(points: Sequence[Point]) -> list[str]:
    """Return text lines on runs and reference runs of a scene whose initial motion is not periodic."""
    doubtful = [point for point in points if point.unsettled is not None]
    if not doubtful:
        return []
    most = max(point.unsettled or 0.0 for point in doubtful)
    named = ", ".join(f"{point.family}: {point.label}" for point in doubtful[:NAMED])
    rest = f" and {len(doubtful) - NAMED} more" if len(doubtful) > NAMED else ""
    return [
        f"  {len(doubtful)} of {len(points)} runs, or their references, began in a motion that did not settle "
        f"({most:.1e} is left): {named}{rest}. Their errors hold for a motion that is still changing."
    ]


def _choices(points: Sequence[Point], accuracy: float) -> list[str]:
    """Return text lines with the recommended choices for an accuracy (relative error)."""
    lines = []

    def cheapest(what: str, chosen: Callable[[Point], bool], alone: bool = False) -> None:
        """Add the line for all outputs; with ``alone`` also for pulley torsion only, if the choice differs."""
        among = [point for point in points if chosen(point) and point.usable]
        if not among:
            return
        # A fidelity level that lacks an output has errors for its other outputs only.
        shown = {name for point in among for name, value in point.error.items() if value is not None}
        complete = [point for point in among if all(point.error[name] is not None for name in shown)]
        best = _cheapest(complete, accuracy, lambda point: point.worst)
        closest = min(complete or among, key=lambda point: point.worst or 0.0)
        lines.append(f"{what}: " + (_said(best) if best else f"none of those measured; closest {_said(closest)}"))
        torsion = _cheapest(among, accuracy, lambda point: point.error["pulley_torsion"])
        if alone and torsion is not None and torsion != best:
            lines.append(f"{what}, for pulley torsion alone: {_said(torsion)}")

    def of(kind: str, family: str, ladder: str | None = None) -> Callable[[Point], bool]:
        def chosen(point: Point) -> bool:
            asked = point.parameters["error_kind"] == kind and point.family == family
            return asked and ladder in (None, point.parameters.get("ladder"))

        return chosen

    cheapest("method and step", lambda p: p.parameters["error_kind"] == NUMERICAL and not p.solver)
    cheapest("crank level below solid", of(TOP, "ladder", "crank"), alone=True)
    cheapest("bearing level below the top", of(TOP, "bearings", "bearings"), alone=True)
    cheapest("block below flexible", of(TOP, "ladder", "block"), alone=True)
    cheapest("modes of the crank", of(TOP, "modes"), alone=True)
    _coarsest(points, accuracy, "coupling", "communication_deg", "communication step", lines)
    _coarsest(points, accuracy, "schemes", "communication_deg", "communication step beside the combustion", lines)
    _coarsest(points, accuracy, "pressure", "trace_deg", "spacing of the pressure trace", lines)
    _coarsest(points, accuracy, "mesh", "mesh_size_mm", "mesh of the crank", lines)
    return lines


def _cheapest(points: Sequence[Point], accuracy: float, error: Callable[[Point], float | None]) -> Point | None:
    """Return the cheapest point whose error is within the accuracy, or None."""
    within = [point for point in points if (found := error(point)) is not None and found <= accuracy]
    return min(within, key=lambda point: point.seconds_per_simulated_second or 0.0, default=None)


def _coarsest(
    points: Sequence[Point], accuracy: float, family: str, parameter: str, what: str, lines: list[str]
) -> None:
    """Add the line of the coarsest choice of a family within the accuracy."""
    among = [point for point in points if point.family == family and point.usable]
    within = [point for point in among if (point.worst or 0.0) <= accuracy]
    if within:
        # Of equally coarse choices the most accurate is used.
        best = max(within, key=lambda point: (point.parameters[parameter], -(point.worst or 0.0)))
        lines.append(f"{what}: {_said(best)}")
    elif among:
        lines.append(f"{what}: finer than any that was measured")


def _said(point: Point) -> str:
    """Return a point with cost and errors as text."""
    errors = ", ".join(
        f"{name.rpartition('_')[2]} {value:.1e}" for name, value in point.error.items() if value is not None
    )
    return f"{point.label} ({point.seconds_per_simulated_second:.2f} s/s; {errors})"
