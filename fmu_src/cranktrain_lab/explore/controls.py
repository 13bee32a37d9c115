"""Sliders of knobs, and headings of groups of knobs."""

import html
from typing import Any

import numpy as np
import panel as pn

from cranktrain_lab.explore.knobs import LOAD, Knob

KNOBS_WIDTH = 300
NO_ARROWS = ".bk-spin-wrapper .bk-spin-btn-up, .bk-spin-wrapper .bk-spin-btn-down { display: none !important; }"
"""Style that hides the arrows of number fields next to sliders, because they would cover digits."""


def heading(text: str) -> Any:
    """Return the heading of a group of knobs."""
    return pn.pane.HTML(f"<b style='border-bottom:1px solid #ccc;display:block'>{text}</b>", width=KNOBS_WIDTH - 20)


def slider_of(knob: Knob) -> Any:
    """Return the slider of a knob, in the knob's unit, with a number field."""
    low, high, own = (knob.shown(value) for value in (knob.low, knob.high, knob.own))
    place = int(np.floor(np.log10(max(own, 1e-12)))) - 2
    step, digits = (1.0, 0) if knob.key == LOAD else (10.0**place, max(0, 1 - place))
    # A slider has values at whole steps from its start, and the engine's own value must be one of them.
    start, end = (own + step * np.trunc((edge - own) / step) for edge in (low, high))
    # Panel renders titles as mark-up, and names of shafts are user input.
    title = html.escape(f"{knob.title}, {knob.unit}" if knob.unit else knob.title)
    slider = pn.widgets.EditableFloatSlider(
        name=title, value=own, start=start, end=end, step=step, fixed_start=start, fixed_end=end,
        format=f"0.{'0' * digits}" if digits else "0", width=KNOBS_WIDTH - 30, tooltips=False,
    )  # fmt: skip
    for number in slider.select(pn.widgets.FloatInput):
        number.stylesheets = [*number.stylesheets, NO_ARROWS]
    return slider
