"""Comparison of the page's engine with another engine or run-up, on equal axes, with a table of peaks."""

from __future__ import annotations

import html
from collections.abc import Sequence

import numpy as np
import panel as pn

from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.results.run_up.run_up import RunUp
from cranktrain_lab.explore.charts import DEG, OrdersChart, orders_of, side_by_side
from cranktrain_lab.explore.live import ORDERS, Curves


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
