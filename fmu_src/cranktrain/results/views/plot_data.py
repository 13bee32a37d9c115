"""What results have in common: arrays with a unit, import of optional packages, tables for notebooks, pictures."""

import html
from collections.abc import Mapping, Sequence
from importlib import import_module
from itertools import cycle
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.units import base_powers, unit_factor

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


class Series(np.ndarray):
    """Values of a run's output: a NumPy array with name and unit.

    Slices and copies keep the unit. Results of arithmetic are plain arrays, because their unit may be different.

    Attributes
    ----------
    unit : unit of the values, such as ``rad``; empty if it is not known
    name : name of the output
    """

    unit: str
    name: str

    def __new__(cls, values: Any, unit: str = "", name: str = "") -> "Series":
        """Make a view of an array, without a copy."""
        made = np.asarray(values).view(cls)
        made.unit, made.name = unit, name
        return made

    def __array_finalize__(self, source: Any) -> None:
        self.unit, self.name = getattr(source, "unit", ""), getattr(source, "name", "")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, out: Any = None, **options: Any) -> Any:
        """Apply arithmetic to the plain arrays."""
        if out is not None:
            options["out"] = tuple(_plain(one) for one in out)
        found = getattr(ufunc, method)(*map(_plain, inputs), **options)
        return out[0] if out is not None and len(out) == 1 else found

    def __reduce__(self) -> Any:
        """Pickle the array with name and unit."""
        return Series, (_plain(self), self.unit, self.name)

    def __repr__(self) -> str:
        texts = np.array2string(_plain(self), threshold=8, edgeitems=3, precision=5)
        return f"{self.name or 'values'} / {self.unit or 'no unit'}: {texts}"

    def to(self, unit: str) -> "Series":
        """Convert the values to another unit, such as ``run["pulley.torsion"].to("deg")``.

        Raises ``InputError`` for a unit that is unknown or of another dimension.
        """
        if not self.unit:
            raise InputError(f"{self.name or 'values'}: no unit is known; multiply by the factor that you need")
        own, wanted = unit_factor(self.unit), unit_factor(str(unit))
        if own.si != wanted.si and base_powers(own.si) != base_powers(wanted.si):
            raise InputError(f"'{self.name or 'values'}' is in {self.unit}, and unit '{unit}' measures something else")
        return Series((_plain(self) * own.scale + (own.zero - wanted.zero)) / wanted.scale, unit, self.name)


def _plain(value: Any) -> Any:
    """Convert a series to a plain array; other values are returned unchanged."""
    if not isinstance(value, Series):
        return value
    found: NDArray[Any] = value.view(np.ndarray)
    return found
