"""Common functions of results: import of optional packages, tables for notebooks, pictures."""

import html
from collections.abc import Mapping, Sequence
from importlib import import_module
from itertools import cycle
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cranktrain.core.errors import InputError

EXTRAS = {"bokeh.plotting": "explore", "xarray": "xarray"}
"""Extra of this package that installs each optional module."""


def optional(module: str, asked: str) -> Any:
    """Import a module of an optional package; ``InputError`` with the way to install it."""
    try:
        return import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise InputError(f"{asked} needs {package}; pip install {package}, or cranktrain[{EXTRAS[module]}]") from None


def html_table(title: str, header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """HTML table for a notebook, with escaped texts."""
    head = "".join(f"<th>{html.escape(str(one))}</th>" for one in header)
    body = "".join(f"<tr>{''.join(f'<td>{html.escape(str(one))}</td>' for one in row)}</tr>" for row in rows)
    return f"<table><caption>{html.escape(title)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def for_notebook(figure: Any) -> Any:
    """Convert a figure to one that notebooks display."""
    from cranktrain.results.views.notebook_figure import NotebookFigure

    figure.__class__ = NotebookFigure
    return figure


def interactive_lines(x: ArrayLike, lines: Mapping[str, ArrayLike], across: str, up: str, title: str) -> Any:
    """Bokeh figure of named lines over x; ``across`` and ``up`` are labels of the axes with units."""
    from cranktrain.results.plots import CYCLE_COLOURS

    figure = optional("bokeh.plotting", "iplot").figure(
        title=title, x_axis_label=across, y_axis_label=up, width=900, height=420,
        tooltips=[("", "$name"), (across, "$x{0.[000]}"), (up, "$y{0.[000000]}")],
    )  # fmt: skip
    for colour, (name, y) in zip(cycle(CYCLE_COLOURS[:-1]), lines.items(), strict=False):
        figure.line(np.asarray(x), np.asarray(y), name=name, legend_label=name, color=colour, line_width=1.5)
    figure.legend.click_policy = "hide"
    return figure
