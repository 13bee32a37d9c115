"""The study as one HTML file: no network, no library; hover for a point, switch scenes, errors and families."""

from __future__ import annotations

import html
import json
from importlib.resources import files

from cranktrain.results.page_head import page_head
from cranktrain.studies.tradeoff.chart import KINDS, NAMES
from cranktrain.studies.tradeoff.study import Study

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
)


def page(study: Study) -> str:
    """The page's text, with the points inside."""
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
    # A closing tag inside a script would end it.
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    title = ", ".join(scene.name for scene in study.scenes)
    template = files("cranktrain.studies.tradeoff").joinpath("page.html").read_text(encoding="utf-8")
    template = template.replace("@HEAD@", page_head("tradeoff", f"Accuracy against speed: {title}"))
    return template.replace("@TITLE@", html.escape(title)).replace("@DATA@", text)
