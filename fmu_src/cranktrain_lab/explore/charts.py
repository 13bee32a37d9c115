"""Charts of an engine's torsion: orders, twist, Campbell diagram and damper heat. Knobs replace the charts' data.

The orders of another engine or run-up may stand beside them, on equal axes, with a table of peaks.
"""

import html
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import panel as pn
from bokeh.models import ColumnDataSource, Legend, LegendItem, Range1d, Span
from bokeh.plotting import figure

from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.results.orders.measured import Measured, band_of
from cranktrain.results.run_up.plots import DECADES
from cranktrain.results.run_up.run_up import TORSION, RunUp
from cranktrain_lab.explore.live import FREQUENCIES, ORDERS, Curves

DEG = 180.0 / math.pi
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#444444", "#8c6bb1")
SHOWN = len(COLOURS)
"""Largest number of orders in the chart."""
HEIGHT = 380
_BEFORE: dict[str, Any] = {"line_dash": "dashed", "line_alpha": 0.5, "line_width": 1.5}
_SMALLEST = 0.02
"""Least amplitude, relative to the largest amplitude, that has a circle in the Campbell diagram."""


def empty_plot(title: str, across: str, up: str, **more: Any) -> Any:
    """Return an empty chart with labelled axes; ``more`` are keywords of Bokeh's ``figure``."""
    plot = figure(
        title=title, height=HEIGHT, sizing_mode="stretch_width", tools="pan,box_zoom,wheel_zoom,reset,save",
        x_axis_label=across, y_axis_label=up, toolbar_location="above", min_width=300, **more,
    )  # fmt: skip
    plot.toolbar.logo, plot.toolbar.autohide = None, True
    plot.title.text_font_size = "13px"
    return plot


def _plot(title: str, up: str, scale: str = "linear") -> Any:
    """Return an empty chart over the speed; ``scale`` is the scale of the values."""
    plot = empty_plot(title, "speed, rev/min", up, y_axis_type=scale)
    if scale == "log":
        plot.y_range = Range1d(1e-6, 1.0)
    else:
        plot.y_range.only_visible = True
    return plot


def side_by_side(plots: list[Any]) -> Any:
    """Arrange charts in two columns, or in one on narrow pages."""
    columns = ":host { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); }"
    boxes = [pn.pane.Bokeh(plot, sizing_mode="stretch_width") for plot in plots]
    return pn.Column(*boxes, sizing_mode="stretch_width", stylesheets=[columns])


def in_notebook() -> bool:
    """True without a session of a server, whose pages update by themselves."""
    document = pn.state.curdoc
    return document is None or not document.session_context


def push(boxes: Sequence[Any]) -> None:
    """Push new data of charts to a notebook."""
    if in_notebook():
        pn.io.push_notebook(*boxes)


def unused(name: str, between: str, suffix: str) -> str:
    """Return the first name of a file that does not exist, of ``name``, then with numbers from 2 on."""
    numbered = (f"{name}{f'{between}{k}' if k > 1 else ''}{suffix}" for k in range(1, 10_000))
    return next(one for one in numbered if not Path(one).exists())


class OrdersChart:
    """Chart of orders of the pulley's torsion, as lines (linear), dots (harmonic balance), squares (full model).

    ``plot`` has a linear scale, ``log_plot`` a logarithmic one of the same data.
    """

    def __init__(self, title: str = "Pulley torsion by order") -> None:
        self.plot, self.log_plot = (_plot(title, "amplitude, deg", scale) for scale in ("linear", "log"))
        empty: dict[str, Any] = {"rpm": [], **{f"o{k}": [] for k in range(SHOWN)}}
        self._now, self._before, self._balance, self._full = (ColumnDataSource(dict(empty)) for _ in range(4))
        self._measured = [ColumnDataSource({"rpm": [], "y": [], "low": [], "high": []}) for _ in range(SHOWN)]
        self._items = [self._glyphs(plot) for plot in (self.plot, self.log_plot)]
        self._orders: list[float] = []

    def _glyphs(self, plot: Any) -> list[LegendItem]:
        """Draw all data into a chart. Return the entries of the chart's legend, one per order."""
        items = []
        for k, colour in enumerate(COLOURS):
            line = plot.line("rpm", f"o{k}", source=self._now, color=colour, line_width=2)
            before = plot.line("rpm", f"o{k}", source=self._before, color=colour, **_BEFORE)
            dots = plot.scatter("rpm", f"o{k}", source=self._balance, color=colour, size=4)
            full = plot.scatter(
                "rpm", f"o{k}", source=self._full, marker="square", size=9, line_color=colour, fill_color="white",
                line_width=2,
            )  # fmt: skip
            own = self._measured[k]
            bands = plot.segment("rpm", "low", "rpm", "high", source=own, color=colour, line_alpha=0.6)
            cross = plot.scatter("rpm", "y", source=own, marker="x", size=7, color=colour, line_width=1.5)
            items.append(LegendItem(label=f"order {k}", renderers=[line, before, dots, full, bands, cross]))
        plot.add_layout(Legend(items=items, orientation="vertical", label_text_font_size="11px"), "right")
        return items

    def choose(self, orders: list[float], measured: Measured | None = None) -> None:
        """Choose the orders that the chart shows, with measured values if any."""
        self._orders = orders[:SHOWN]
        points = {} if measured is None else measured.get(TORSION, {})
        for k, pair in enumerate(zip(*self._items, strict=True)):
            order = self._orders[k] if k < len(self._orders) else 0.0
            for item in pair:
                item.visible = k < len(self._orders)
                item.label = {"value": f"order {order:g}"}
            speeds, sizes = points.get(order, (np.zeros(0), np.zeros(0)))
            half = band_of(measured, TORSION, order) if order in points else None
            band = np.zeros_like(sizes) if half is None else np.nan_to_num(half)
            self._measured[k].data = {"rpm": speeds / RPM, "y": DEG * sizes, "low": DEG * (sizes - band),
                                      "high": DEG * (sizes + band)}  # fmt: skip

    def show(self, now: Curves, before: Curves | None) -> None:
        """Show the curves of the present choice, and earlier curves if given."""
        self._now.data = self._columns(now.speeds, now.orders)
        self._before.data = self._none() if before is None else self._columns(before.speeds, before.orders)
        shown = [now.order(order) for order in self._orders]
        top = DEG * max((float(np.nan_to_num(one).max()) for one in shown), default=0.0) or 1.0
        self.log_plot.y_range.update(start=10.0**-DECADES * top, end=2.0 * top)

    def show_runs(self, balance: RunUp | None, full: RunUp | None) -> None:
        """Show results of harmonic balance and of a full model, if given."""
        for source, run in ((self._balance, balance), (self._full, full)):
            source.data = self._none() if run is None else self._columns(run.speeds, orders_of(run))

    def _columns(self, speeds: Array, amplitudes: Array) -> dict[str, Any]:
        found = {"rpm": speeds / RPM}
        for k in range(SHOWN):
            shown = k < len(self._orders)
            row = amplitudes[ORDERS.index(self._orders[k])] if shown else np.full(speeds.size, np.nan)
            found[f"o{k}"] = DEG * row
        return found

    def _none(self) -> dict[str, Any]:
        return self._columns(np.zeros(0), np.zeros((len(ORDERS), 0)))


def orders_of(run: RunUp) -> Array:
    """Return amplitudes (o, s) of a run-up for the orders of the page, rad; NaN for missing orders."""
    found = np.full((len(ORDERS), run.speeds.size), np.nan)
    for k, order in enumerate(run.orders.tolist()):
        if order in ORDERS:
            found[ORDERS.index(order)] = np.abs(run.torsion[:, k])
    return found


class LineChart:
    """Chart of one curve over the speed, present and earlier, with an optional limit."""

    def __init__(self, title: str, up: str, limit: bool = False) -> None:
        self.plot, self._title = _plot(title, up), title
        self._now, self._before = (ColumnDataSource({"rpm": [], "y": []}) for _ in range(2))
        line = self.plot.line("rpm", "y", source=self._now, color=COLOURS[0], line_width=2)
        dashed = self.plot.line("rpm", "y", source=self._before, color=COLOURS[0], **_BEFORE)
        items = [LegendItem(label="now", renderers=[line]), LegendItem(label="before", renderers=[dashed])]
        self.plot.add_layout(Legend(items=items, label_text_font_size="11px"), "right")
        self._limit = Span(dimension="width", line_color=COLOURS[1], line_dash="dotted", line_width=2)
        if limit:
            self.plot.add_layout(self._limit)

    def show(self, rpm: Array, now: Array, before: tuple[Array, Array] | None, limit: float = 0.0) -> None:
        """Show values over speeds, in the chart's units."""
        self._now.data = {"rpm": rpm, "y": now}
        x, y = (np.zeros(0), np.zeros(0)) if before is None else before
        self._before.data = {"rpm": x, "y": y}
        self._limit.location = limit if limit > 0.0 else None
        if limit > 0.0:
            self.plot.title.text = f"{self._title}, limit {limit:.0f} W"


class CampbellChart:
    """Campbell diagram: torsional frequencies over the speed, lines of orders, circles by amplitudes of orders."""

    def __init__(self) -> None:
        self.plot = _plot("Campbell diagram, circles: pulley torsion by order", "frequency, Hz")
        self._modes, self._old = (ColumnDataSource({"xs": [], "ys": []}) for _ in range(2))
        self._rays = ColumnDataSource({"xs": [], "ys": []})
        self._ends = ColumnDataSource({"x": [], "y": [], "text": []})
        self._circles = ColumnDataSource({"x": [], "y": [], "size": []})
        rays = self.plot.multi_line("xs", "ys", source=self._rays, color="#bbbbbb", line_width=1)
        self.plot.text("x", "y", "text", source=self._ends, text_font_size="10px", text_color="#777777",
                       text_align="right")  # fmt: skip
        circles = self.plot.scatter("x", "y", size="size", source=self._circles, color=COLOURS[1], fill_alpha=0.35,
                                    line_alpha=0.6)  # fmt: skip
        modes = self.plot.multi_line("xs", "ys", source=self._modes, color=COLOURS[0], line_width=2)
        old = self.plot.multi_line("xs", "ys", source=self._old, color=COLOURS[0], **_BEFORE)
        items = [LegendItem(label=text, renderers=[one]) for text, one in
                 (("modes", modes), ("before", old), ("orders", rays), ("amplitude", circles))]  # fmt: skip
        self.plot.add_layout(Legend(items=items, label_text_font_size="11px"), "right")

    def show(self, now: Curves, before: Curves | None, orders: list[float]) -> None:
        """Show the present frequencies and amplitudes, and earlier frequencies."""
        rpm = now.speeds / RPM
        ends = [float(rpm[0]), float(rpm[-1])]
        top = 1.15 * float(np.nan_to_num(now.hz[:, : FREQUENCIES - 1]).max(initial=0.0)) or 1000.0
        for source, curves in ((self._modes, now), (self._old, before)):
            shown = [] if curves is None else [line for line in curves.hz.T if np.nanmin(line) <= top]
            at = [] if curves is None else (curves.hz_speeds / RPM).tolist()
            source.data = {"xs": [at] * len(shown), "ys": [line.tolist() for line in shown]}
        self._rays.data = {"xs": [ends] * len(orders), "ys": [[o * x / 60.0 for x in ends] for o in orders]}
        at = [min(ends[1], 57.0 * top / order) for order in orders]
        self._ends.data = {"x": at, "y": [o * x / 60.0 for o, x in zip(orders, at, strict=True)],
                           "text": [f"{order:g}" for order in orders]}  # fmt: skip
        self._circles.data = self._sizes(now, orders)
        self.plot.y_range.end, self.plot.y_range.start = top, 0.0

    def _sizes(self, now: Curves, orders: list[float]) -> dict[str, Any]:
        """Return circles at every third speed of each order, with area proportional to amplitude."""
        largest = max(float(np.nan_to_num(now.orders).max()), 1e-30)
        x, y, size = [], [], []
        for order in orders:
            share = now.order(order)[::3] / largest
            rpm = now.speeds[::3] / RPM
            seen = share > _SMALLEST
            x += rpm[seen].tolist()
            y += (order * rpm[seen] / 60.0).tolist()
            size += (22.0 * np.sqrt(share[seen])).tolist()
        return {"x": x, "y": y, "size": size}


class Beside:
    """View of two charts of orders with common axes, and a table of the largest amplitudes."""

    def __init__(self, title: str, other_title: str, other: Curves | RunUp) -> None:
        self._titles = title, other_title
        speeds, amplitudes = (
            (other.speeds, orders_of(other)) if isinstance(other, RunUp) else (other.speeds, other.orders)
        )
        none = np.zeros(0)
        self._other = Curves(speeds, amplitudes, none, none, none, 0.0, none, np.zeros((0, 0)), 0.0)
        self._charts = OrdersChart(title), OrdersChart(other_title)
        self._charts[1].plot.x_range, self._charts[1].plot.y_range = (
            self._charts[0].plot.x_range, self._charts[0].plot.y_range,
        )  # fmt: skip
        self._table = pn.pane.HTML("", sizing_mode="stretch_width")
        heading = pn.pane.HTML("<b>Compared: pulley torsion by order</b>", sizing_mode="stretch_width")
        self.parts = [heading, side_by_side([chart.plot for chart in self._charts]), self._table]

    def show(self, now: Curves, orders: list[float]) -> None:
        """Show these orders of both engines."""
        for chart, curves in zip(self._charts, (now, self._other), strict=True):
            chart.choose(sorted(orders))
            chart.show(curves, None)
        rows = []
        for order in sorted(orders):
            (here, at), (there, other_at) = (_peak(one, order) for one in (now, self._other))
            share = f"{100.0 * (there / here - 1.0):+.1f} %" if here > 0.0 and np.isfinite(there) else "-"
            rows.append((f"{order:g}", f"{here:.4f}", f"{at:.0f}", f"{there:.4f}", f"{other_at:.0f}", share))
        head = ("order", "deg", "rev/min", "deg", "rev/min", "difference")
        self._table.object = _table(self._titles, head, rows)


def _peak(curves: Curves, order: float) -> tuple[float, float]:
    """Return the largest amplitude (deg) of an order, and the speed (rev/min) of this peak."""
    found: Array = np.nan_to_num(curves.orders[ORDERS.index(order)], nan=-1.0)
    at = int(found.argmax())
    return (DEG * float(found[at]) if found[at] >= 0.0 else float("nan")), float(curves.speeds[at] / RPM)


def _table(titles: tuple[str, str], head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    over = f"<tr><th></th><th colspan=2>{html.escape(titles[0])}</th><th colspan=2>{html.escape(titles[1])}</th></tr>"
    cells = "".join(f"<th style='padding:0 8px'>{one}</th>" for one in head)
    body = "".join(
        "<tr>" + "".join(f"<td style='text-align:right;padding:0 8px'>{one}</td>" for one in row) + "</tr>"
        for row in rows
    )
    return f"<table>{over}<tr>{cells}</tr>{body}</table>"
