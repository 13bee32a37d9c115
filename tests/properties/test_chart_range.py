"""Charts of reports over the whole range of numbers: what is drawn stays on the paper, and the page is valid."""

import json
import re

import numpy as np
import pytest

from cranktrain.studies.report.chart import BOTTOM, HEIGHT, bar_chart, line_chart, map_chart

VALUES = (1.7e308, -1.7e308, 5e-324, 0.0, np.nan, np.inf, 1.0)


def on_paper(text):
    for corners in re.findall(r'points="([^"]*)"', text):
        for corner in corners.split():
            assert -1.0 <= float(corner.split(",")[1]) <= HEIGHT
    assert not re.search(r"\b(nan|inf)\b", re.sub(r'aria-label="[^"]*"', "", text))
    for held in re.findall(r'<script type="application/json">(.*?)</script>', text):
        json.loads(held, parse_constant=lambda word: pytest.fail(word))


@pytest.mark.parametrize("first", VALUES)
@pytest.mark.parametrize("second", VALUES)
def test_a_curve_of_any_values_has_its_chart(first, second):
    x, y = np.arange(3.0), np.array([first, second, second])
    with np.errstate(all="raise", under="ignore"):
        on_paper(line_chart("any", x, {"y": y}, ("x", "y"), points={"y": (x, y)}))
        on_paper(bar_chart("any", x, {"y": y}, ("x", "y"), points={"y": (y, np.abs(y))}))
    map_chart("any", x, x, np.abs(np.tile(y, (3, 1))), ("x", "y", "z"))


def test_large_values_are_drawn_at_the_end_of_the_axis():
    text = line_chart("large", np.arange(3.0), {"y": np.array([0.0, 1.7e308, 0.0])}, ("x", "y"))
    heights = [float(corner.split(",")[1]) for corner in re.search(r'points="([^"]*)"', text)[1].split()]
    assert heights[0] == BOTTOM and heights[1] < 0.2 * BOTTOM
