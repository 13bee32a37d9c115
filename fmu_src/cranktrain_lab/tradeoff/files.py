"""Output files of a study, each written completely or not at all."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from cranktrain.results.figures import save_figure
from cranktrain.store.whole_file import marked, whole_file
from cranktrain_lab.tradeoff.chart import family_figure, overall_figure
from cranktrain_lab.tradeoff.choice import choice_text
from cranktrain_lab.tradeoff.page import page
from cranktrain_lab.tradeoff.point import OTHERS, OUTPUTS
from cranktrain_lab.tradeoff.study import Study

_NAME = "file of cranktrain tradeoff"
TEXTS = {
    "tradeoff.html": marked(_NAME, "<title>Accuracy against speed"),
    "points.csv": marked(_NAME, "family,label,seconds_per_simulated_second"),
    "choice.txt": marked(_NAME, "What to choose, from the measured points."),
}
FIRST_COLUMNS = ("scene", "error_kind", "speed_rpm", "crank", "bearings", "block", "integrator", "step_deg", "modes")


def write_files(study: Study, folder: Path) -> list[Path]:
    """Write charts (PNG and SVG), page, points and choice. Return their paths."""
    scenes = [scene.name for scene in study.scenes]
    families = list(dict.fromkeys(point.family for point in study.points))
    figures = {family: family_figure(study.points, family, scenes) for family in families}
    figures["overall"] = overall_figure(study.points, scenes)
    texts = {"tradeoff.html": page(study), "points.csv": points_csv(study), "choice.txt": choice_text(study)}
    endings = (".png", ".svg")
    written = [save_figure(figure, folder / f"{name}{end}") for name, figure in figures.items() for end in endings]
    for name, text in texts.items():
        with whole_file(folder / name, TEXTS[name]) as path:
            path.write_text(text, encoding="utf-8")
        written.append(folder / name)
    return sorted(written)


def points_csv(study: Study) -> str:
    """Return all points as a table: label, cost, errors, status, then further parameters."""
    names = {name for point in study.points for name in point.parameters}
    rest = sorted(names - set(FIRST_COLUMNS))
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(
        ["family", "label", "seconds_per_simulated_second", *(f"error_{name}" for name in (*OUTPUTS, *OTHERS)),
         "status", "pareto", *FIRST_COLUMNS, *rest]
    )  # fmt: skip
    for point in study.points:
        errors = [point.error.get(name) for name in OUTPUTS] + [point.other_errors.get(name) for name in OTHERS]
        table.writerow(
            [point.family, point.label, point.seconds_per_simulated_second, *errors, point.status, point.pareto,
             *(point.parameters.get(name) for name in (*FIRST_COLUMNS, *rest))]
        )  # fmt: skip
    return text.getvalue()
