"""What results have in common: packages that are loaded when they are used, tables for notebooks, pictures."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cranktrain.core.errors import InputError

EXTRAS = {"plotly.graph_objects": "interactive", "xarray": "xarray"}
"""Modules of optional packages, and the extra of this package that installs them."""


def optional(module: str, asked: str) -> Any:
    """A module of an optional package; ``InputError`` that says how to install it."""
    try:
        return import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise InputError(f"{asked} needs {package}; pip install {package}, or cranktrain[{EXTRAS[module]}]") from None


def html_table(title: str, header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Table of a notebook; texts are escaped."""
    head = "".join(f"<th>{html.escape(str(one))}</th>" for one in header)
    body = "".join(f"<tr>{''.join(f'<td>{html.escape(str(one))}</td>' for one in row)}</tr>" for row in rows)
    return f"<table><caption>{html.escape(title)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def for_notebook(figure: Any) -> Any:
    """The same figure, which a notebook shows."""
    from cranktrain.results.in_hand.notebook_figure import NotebookFigure

    figure.__class__ = NotebookFigure
    return figure


def interactive_lines(x: ArrayLike, lines: Mapping[str, ArrayLike], across: str, up: str, title: str) -> Any:
    """Plotly figure of lines over x by their names; ``across`` and ``up`` name the axes with their units."""
    plotly = optional("plotly.graph_objects", "iplot")
    traces = [plotly.Scatter(x=np.asarray(x), y=np.asarray(y), name=name, mode="lines") for name, y in lines.items()]
    figure = plotly.Figure(traces)
    figure.update_layout(title=title, xaxis_title=across, yaxis_title=up)
    return figure
