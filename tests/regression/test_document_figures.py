"""The parts that ``docs/figures.py`` writes have their marks, each in one place, and no mark is without a maker."""

import re
from pathlib import Path

import pytest
from scripts import script

from cranktrain.engine.file import load_engine
from cranktrain.studies.total_error.shipped import shipped

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture(scope="module")
def figures():
    return script("docs/figures.py")


def test_marks_and_makers_belong_together(figures):
    marked = {
        (path.relative_to(DOCS).as_posix(), part)
        for path in DOCS.rglob("*.md")
        for part in re.findall(r"<!-- figures: (\w+) -->", path.read_text("utf-8"))
    }
    assert marked == {(document, part) for part, (document, _) in figures.MADE.items()}


@pytest.mark.parametrize("engine", ["diesel_i6", "diesel_v8"])
def test_tables_of_total_error_are_those_of_the_shipped_figures(figures, engine):
    page = (DOCS / "tradeoff.md").read_text("utf-8")
    found = shipped(load_engine(engine))
    assert found is not None
    assert all(table in page for table in figures.total_tables(found.points))
