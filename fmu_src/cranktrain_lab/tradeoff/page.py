"""Study as one interactive HTML file without network requests or libraries."""

from __future__ import annotations

from cranktrain.results.page_head import filled_page, script_data
from cranktrain_lab.tradeoff.chart import KINDS, NAMES
from cranktrain_lab.tradeoff.point import UNSETTLED
from cranktrain_lab.tradeoff.study import Study

SHOWN = (
    "speed_rpm",
    "crank",
    "bearings",
    "block",
    "modes",
    "integrator",
    "step_deg",
    "tolerance",
    "cycles",
    "repeats",
    "settling",
    *UNSETTLED,
)


def page(study: Study) -> str:
    """Return the HTML text of the page, which contains the points."""
    points = [
        {
            "scene": point.parameters.get("scene", ""),
            "kind": point.parameters["error_kind"],
            "family": point.family,
            "label": point.label,
            "cost": point.seconds_per_simulated_second,
            "errors": {**point.error, "worst": point.worst},
            "status": point.status,
            "front": point.pareto,
            "default": bool(point.parameters.get("default")),
            "other": bool(point.solver),
            "about": {name: value for name in SHOWN if (value := point.parameters.get(name)) is not None},
        }
        for point in study.points
    ]
    data = {"points": points, "kinds": KINDS, "outputs": {"worst": "largest of all outputs", **NAMES}}
    title = ", ".join(scene.name for scene in study.scenes)
    head = f"Accuracy against speed: {title}"
    return filled_page(__package__, "page.html", "tradeoff", head, title, DATA=script_data(data))
