"""The study of total error as one HTML file: no network, no library; point at a mark for its figures and parts."""

from __future__ import annotations

import html
import json
from importlib.resources import files

from cranktrain.engine.levels import CRANKS
from cranktrain.film.laws.register import MAINS, bearing_levels
from cranktrain.results.page_head import page_head
from cranktrain.studies.total_error.families import FAMILIES
from cranktrain.studies.tradeoff.total.chart import COLOURS
from cranktrain.studies.tradeoff.total.choice import ACCURACIES
from cranktrain.studies.tradeoff.total.study import TotalStudy


def page(study: TotalStudy) -> str:
    """The page's text, with the points inside."""
    data = {
        "points": [point.as_dict() for point in study.points],
        "scenes": [scene.name for scene in study.scenes],
        "families": {name: family.title for name, family in FAMILIES.items()},
        "best": {
            name: f"{one.name}, {one.integrator} at {one.step_deg:g}°{', fine grid' if one.fine_grid else ''}"
            for name, one in study.best.items()
        },
        "accuracies": ACCURACIES,
        "bearings": dict(zip(bearing_levels(*MAINS), COLOURS, strict=False)),
        "cranks": list(CRANKS),
    }
    # A closing tag inside a script would end it.
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    title = ", ".join(scene.name for scene in study.scenes)
    template = files("cranktrain.studies.tradeoff.total").joinpath("page.html").read_text(encoding="utf-8")
    template = template.replace("@HEAD@", page_head("tradeoff", f"Total error against cost: {title}"))
    return template.replace("@TITLE@", html.escape(title)).replace("@DATA@", text)
