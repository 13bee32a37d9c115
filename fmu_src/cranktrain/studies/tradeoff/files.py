"""Everything that a study writes into its folder, whole or not at all."""

from __future__ import annotations

import csv
import io
import os
import shutil
import tempfile
from pathlib import Path

from cranktrain.core.errors import InputError
from cranktrain.studies.tradeoff.chart import family_figure, overall_figure
from cranktrain.studies.tradeoff.choice import choice_text
from cranktrain.studies.tradeoff.page import page
from cranktrain.studies.tradeoff.point import OTHERS, OUTPUTS
from cranktrain.studies.tradeoff.study import Study

FIRST_COLUMNS = ("scene", "error_kind", "speed_rpm", "crank", "bearings", "block", "integrator", "step_deg", "modes")


def check_folder(folder: Path) -> None:
    """Make the folder, or refuse it before the work; ``InputError``."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        raise InputError(f"{folder}: no files can be written there; name another folder for --output") from None


def write_files(study: Study, folder: Path) -> list[Path]:
    """Charts (PNG and SVG), page, points and choice; returns their paths."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    check_folder(folder)
    scenes = [scene.name for scene in study.scenes]
    families = list(dict.fromkeys(point.family for point in study.points))
    figures = {family: family_figure(study.points, family, scenes) for family in families}
    figures["overall"] = overall_figure(study.points, scenes)
    made = Path(tempfile.mkdtemp(prefix=".tradeoff", dir=folder))
    try:
        for name, figure in figures.items():
            FigureCanvasAgg(figure).print_png(str(made / f"{name}.png"))
            FigureCanvasSVG(figure).print_svg(str(made / f"{name}.svg"))
        (made / "tradeoff.html").write_text(page(study), encoding="utf-8")
        (made / "points.csv").write_text(points_csv(study), encoding="utf-8")
        (made / "choice.txt").write_text(choice_text(study), encoding="utf-8")
        written = []
        for path in sorted(made.iterdir()):
            os.replace(path, folder / path.name)
            written.append(folder / path.name)
        return written
    finally:
        shutil.rmtree(made, ignore_errors=True)


def points_csv(study: Study) -> str:
    """All points as a table: label, cost, errors, status, then what else each says."""
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
