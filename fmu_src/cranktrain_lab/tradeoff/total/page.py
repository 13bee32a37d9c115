"""Total-error study as one HTML file without network requests; pointing at a mark shows cost and error parts."""

from __future__ import annotations

from cranktrain.engine.levels import CRANKS
from cranktrain.film.laws.register import MAINS, bearing_levels
from cranktrain.results.page_head import filled_page, script_data
from cranktrain.studies.total_error.families import FAMILIES
from cranktrain_lab.tradeoff.total.chart import COLOURS
from cranktrain_lab.tradeoff.total.choice import ACCURACIES
from cranktrain_lab.tradeoff.total.study import TotalStudy


def page(study: TotalStudy) -> str:
    """Return the HTML text of the page, which contains the points of the study."""
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
    title = ", ".join(scene.name for scene in study.scenes)
    head = f"Total error against cost: {title}"
    return filled_page(__package__, "page.html", "tradeoff", head, title, DATA=script_data(data))
