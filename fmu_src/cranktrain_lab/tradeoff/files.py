"""Output files of a study, each written completely or not at all; the pages make no network requests."""

import csv
import io
import json
from collections.abc import Iterable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from cranktrain.engine.levels import CRANKS
from cranktrain.film.laws.register import MAINS, bearing_levels
from cranktrain.results.figures import save_figure
from cranktrain.results.page_head import filled_page, script_data
from cranktrain.store.whole_file import marked, whole_file
from cranktrain.studies.total_error.families import FAMILIES
from cranktrain.studies.total_error.point import PARTS, TotalPoint
from cranktrain_lab.tradeoff.chart import KINDS, NAMES, family_figure, overall_figure
from cranktrain_lab.tradeoff.choice import choice_text
from cranktrain_lab.tradeoff.point import OTHERS, OUTPUTS, UNSETTLED, Point
from cranktrain_lab.tradeoff.study import COMMAND, Study, TotalStudy
from cranktrain_lab.tradeoff.total_chart import COLOURS, total_figure
from cranktrain_lab.tradeoff.total_choice import ACCURACIES, total_choice_text

TEXTS = {
    name: marked(f"file of {command}", begin)
    for name, command, begin in (
        ("tradeoff.html", "cranktrain tradeoff", "<title>Accuracy against speed"),
        ("points.csv", "cranktrain tradeoff", "family,label,seconds_per_simulated_second"),
        ("choice.txt", "cranktrain tradeoff", "What to choose, from the measured points."),
        ("total.html", COMMAND, "<title>Total error against cost"),
        ("total.csv", COMMAND, "scene,label,cost"),
        ("total.txt", COMMAND, "What to choose for a total error"),
        ("total.json", COMMAND, f'"{COMMAND}"'),
    )
}
"""Text files of both studies, with the marks by which an earlier one is known."""
FIRST_COLUMNS = ("scene", "error_kind", "speed_rpm", "crank", "bearings", "block", "integrator", "step_deg", "modes")
SHOWN = (
    "speed_rpm", "crank", "bearings", "block", "modes", "integrator", "step_deg", "tolerance", "cycles", "repeats",
    "settling", *UNSETTLED,
)  # fmt: skip
"""Parameters of a point that the page shows."""


def write_files(study: Study | TotalStudy, folder: Path) -> list[Path]:
    """Write charts (PNG and SVG), page, points, recommended choices and a total error's JSON. Return their paths."""
    if isinstance(study, TotalStudy):
        figures = {
            f"total-{family}-{scene.replace(' ', '-')}": total_figure(study, scene, FAMILIES[family])
            for scene, family in study.pictures
        }
        texts = {
            "total.html": total_page(study), "total.csv": total_csv(study.points),
            "total.txt": total_choice_text(study), "total.json": document_text(study.as_dict()),
        }  # fmt: skip
    else:
        scenes = [scene.name for scene in study.scenes]
        families = dict.fromkeys(point.family for point in study.points)
        figures = {family: family_figure(study.points, family, scenes) for family in families}
        figures["overall"] = overall_figure(study.points, scenes)
        texts = {
            "tradeoff.html": page(study), "points.csv": points_csv(study.points), "choice.txt": choice_text(study)
        }  # fmt: skip
    endings = (".png", ".svg")
    written = [save_figure(figure, folder / f"{name}{end}") for name, figure in figures.items() for end in endings]
    for name, text in texts.items():
        with whole_file(folder / name, TEXTS[name]) as path:
            path.write_text(text, encoding="utf-8")
        written.append(folder / name)
    return sorted(written)


def points_csv(points: Sequence[Point]) -> str:
    """Return all points as a table: label, cost, errors, status, then further parameters."""
    names = {name for point in points for name in point.parameters}
    columns = (*FIRST_COLUMNS, *sorted(names - set(FIRST_COLUMNS)))
    errors = [f"error_{name}" for name in (*OUTPUTS, *OTHERS)]
    return _csv(
        ["family", "label", "seconds_per_simulated_second", *errors, "status", "pareto", *columns],
        (
            [point.family, point.label, point.seconds_per_simulated_second,
             *(point.error.get(name) for name in OUTPUTS), *(point.other_errors.get(name) for name in OTHERS),
             point.status, point.pareto, *(point.parameters.get(name) for name in columns)]
            for point in points
        ),
    )  # fmt: skip


def total_csv(points: Sequence[TotalPoint]) -> str:
    """Return all points of total errors as a table: label, cost, total error and its parts by family, and levels."""
    levels = ("crank", "bearings", "block", "integrator", "step_deg", "speed_rpm", "default", "status", "cycles")
    parts = [(name, kind) for name in FAMILIES for kind in ("total", *PARTS)]
    return _csv(
        ["scene", "label", "cost", *(f"{kind}_{name}" for name, kind in parts), *levels],
        (
            [point.scene, point.label, point.cost, *(getattr(point.errors[name], kind, None) for name, kind in parts),
             *(getattr(point, name) for name in levels)]
            for point in points
        ),
    )  # fmt: skip


def _csv(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([header, *rows])
    return text.getvalue()


def document_text(found: dict[str, Any]) -> str:
    """Format the document of a study as JSON text, with one line for each point."""
    head = json.dumps({name: value for name, value in found.items() if name != "points"}, indent=1, allow_nan=False)
    points = ",\n".join(json.dumps(point, allow_nan=False) for point in found["points"])
    return head[:-2] + ',\n "points": [\n' + points + "\n]}\n"


def page(study: Study) -> str:
    """Return the HTML text of the page with all points; pointing at a mark shows its figures."""
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
    return _page(study, "families.html", "Accuracy against speed", data)


def total_page(study: TotalStudy) -> str:
    """Return the HTML text of the page with all points; pointing at a mark shows cost and error parts."""
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
    return _page(study, "total.html", "Total error against cost", data)


def _page(study: Study | TotalStudy, template: str, what: str, data: dict[str, Any]) -> str:
    title = ", ".join(scene.name for scene in study.scenes)
    common = files(__package__).joinpath("common.html").read_text(encoding="utf-8")
    parts = {"COMMON": common, "DATA": script_data(data)}
    return filled_page(__package__, template, "tradeoff", f"{what}: {title}", title, **parts)
