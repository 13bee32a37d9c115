"""Output files of the total-error study, each written completely or not at all."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cranktrain.results.figures import save_figure
from cranktrain.store.whole_file import marked, whole_file
from cranktrain.studies.total_error.families import FAMILIES
from cranktrain.studies.total_error.point import PARTS, TotalPoint
from cranktrain.studies.total_error.shipped import engine_digest, model_sources
from cranktrain_lab.tradeoff.total.chart import total_figure
from cranktrain_lab.tradeoff.total.choice import choice_text
from cranktrain_lab.tradeoff.total.page import page
from cranktrain_lab.tradeoff.total.study import TotalStudy

COMMAND = "cranktrain tradeoff --total"
_NAME = f"file of {COMMAND}"
TEXTS = {
    "total.html": marked(_NAME, "<title>Total error against cost"),
    "total.csv": marked(_NAME, "scene,label,cost"),
    "total.txt": marked(_NAME, "What to choose for a total error"),
    "total.json": marked(_NAME, f'"{COMMAND}"'),
}


def write_files(study: TotalStudy, folder: Path) -> list[Path]:
    """Write charts (PNG and SVG), page, points, recommended choices and a JSON document. Return their paths."""
    written = []
    for scene, family in study.pictures:
        figure = total_figure(study, scene, FAMILIES[family])
        name = f"total-{family}-{scene.replace(' ', '-')}"
        written += [save_figure(figure, folder / f"{name}{end}") for end in (".png", ".svg")]
    texts = {
        "total.html": page(study), "total.csv": points_csv(study.points), "total.txt": choice_text(study),
        "total.json": document_text(document(study)),
    }  # fmt: skip
    for name, text in texts.items():
        with whole_file(folder / name, TEXTS[name]) as path:
            path.write_text(text, encoding="utf-8")
        written.append(folder / name)
    return sorted(written)


def points_csv(points: tuple[TotalPoint, ...]) -> str:
    """Return all points as CSV text, with label, cost, and the total error and its parts for each family."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    levels = ("crank", "bearings", "block", "integrator", "step_deg", "speed_rpm", "default", "status", "cycles")
    kinds = ("total", *PARTS)
    table.writerow(["scene", "label", "cost", *(f"{kind}_{name}" for name in FAMILIES for kind in kinds), *levels])
    for point in points:
        errors = [getattr(point.errors[name], kind, None) for name in FAMILIES for kind in kinds]
        table.writerow([point.scene, point.label, point.cost, *errors, *(getattr(point, name) for name in levels)])
    return text.getvalue()


def document(study: TotalStudy) -> dict[str, Any]:
    """Return the study for JSON, as shipped with the program. All scenes must have the same engine."""
    engine = study.scenes[0].engine
    return {
        "command": COMMAND,
        "what": "measured total errors against cost; see docs/tradeoff.md",
        "engine": engine.name,
        "engine_digest": engine_digest(engine),
        "sources_digest": model_sources(),
        "best": {scene: asdict(best) for scene, best in study.best.items()},
        "points": [point.as_dict() for point in study.points],
    }


def document_text(found: dict[str, Any]) -> str:
    """Format the document of a study as JSON text, with one line for each point."""
    head = json.dumps({name: value for name, value in found.items() if name != "points"}, indent=1, allow_nan=False)
    points = ",\n".join(json.dumps(point, allow_nan=False) for point in found["points"])
    return head[:-2] + ',\n "points": [\n' + points + "\n]}\n"
