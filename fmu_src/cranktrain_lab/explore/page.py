"""Page with knobs on the left, charts on the right, and full model and engine file below the knobs."""

import html
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import panel as pn
from panel.links import Callback

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.units import RPM
from cranktrain.core.user_file import user_path
from cranktrain.engine.model import Engine
from cranktrain.results.orders.measured import Measured
from cranktrain.results.run_up.run_up import TORSION, RunUp
from cranktrain_lab.explore import charts
from cranktrain_lab.explore.balance import Balance
from cranktrain_lab.explore.charts import DEG, SHOWN
from cranktrain_lab.explore.engine_file import Source, changes, write_engine
from cranktrain_lab.explore.full_controls import KNOBS_WIDTH, FullControls, heading, said, slider_of
from cranktrain_lab.explore.inside.cycle import InsideCycle
from cranktrain_lab.explore.inside.view import InsideView
from cranktrain_lab.explore.knobs import DIGITS, Chosen, Knob, chosen_engine, firing_orders
from cranktrain_lab.explore.live import ORDERS, Curves, LiveTorsion

POLL_MS, SETTLE_MS = 300, 15
"""Polling period of background work, and time over which movements of a knob are collected, ms."""
REST = 0.4
"""Time without movement after which a knob counts as at rest, s."""
SAME = 1.0e-6
"""Relative difference below which a slider counts as at the engine's own value."""


@dataclass
class Explored:
    """Data that all open pages of a server share.

    Attributes
    ----------
    source : name or path of the engine file, or an engine in memory
    live : live model
    measured : measured orders to overlay
    balance : harmonic balance in the background, or None
    other : title, and curves or run-up, of the comparison
    inside : initial cycle for the view inside
    folder : folder in which engine files may be written
    """

    source: Source
    live: LiveTorsion
    measured: Measured | None = None
    balance: Balance | None = None
    other: tuple[str, Curves | RunUp] | None = None
    inside: InsideCycle | None = None
    folder: Path = field(default_factory=Path.cwd)
    closing: list[Callable[[], None]] = field(default_factory=list)

    def closed(self, close: Callable[[], None]) -> None:
        """Close one page and release its memory."""
        close()
        self.closing.remove(close)

    def close(self) -> None:
        """Stop background work."""
        for close in self.closing:
            close()
        if self.balance is not None:
            self.balance.close()


class Page:
    """One open page, with its choices, charts and full model."""

    def __init__(self, explored: Explored) -> None:
        self._explored, self._live = explored, explored.live
        self._history = History()
        self._balance: RunUp | None = None
        self._quiet = self._waiting = False
        self._boxes: list[Any] = []
        self._turned, self._resting = time.monotonic(), True
        self._kept = self._now = self._live.answer(Chosen())
        self._kept_of = Chosen()
        self._orders_chart, self._campbell = charts.OrdersChart(), charts.CampbellChart()
        self._twist = charts.LineChart("Twist of pulley against flywheel, half of peak to peak", "twist, deg")
        self._heat = charts.LineChart("Heat of the damper", "power, W", limit=True)
        self._make_knobs()
        self._make_rest()
        self._choose_orders()
        self._draw()
        self.view = self._layout()
        self._ask_balance()
        explored.closing.append(self.close)

    @cached_property
    def inside(self) -> InsideView:
        """View inside of a cycle. It is made on first use, because it is half of the page."""
        view = InsideView(self._explored.inside)
        self._inside_box.append(view.view)
        return view

    def engine(self) -> Engine:
        """Engine of the present knobs."""
        return chosen_engine(self._live.whole, self._live.knobs, self._history.now)

    def close(self) -> None:
        """Stop the page's full model, and remove Panel's links between sliders and numbers."""
        self._full.close()
        for slider in self._sliders.values():
            for part in slider.select():
                # Panel stores links under weak keys, but a link refers to its key and would keep the page alive.
                Callback.registry.pop(part, None)

    def _make_knobs(self) -> None:
        """Make a slider for each knob, a list of firing orders, and buttons."""
        self._sliders: dict[str, Any] = {}
        for knob in self._live.knobs:
            slider = slider_of(knob)
            slider.param.watch(lambda event, own=knob: self._turn(own, event.new), "value")
            slider.param.watch(lambda event: self._released(), "value_throttled")
            self._sliders[knob.key] = slider
        orders = firing_orders(self._live.engine)
        self._firing = pn.widgets.Select(
            name="firing order", options={"-".join(map(str, one)): one for one in orders}, value=orders[0],
            disabled=len(orders) == 1, width=KNOBS_WIDTH - 30,
        )  # fmt: skip
        self._firing.param.watch(lambda event: self._fire(event.new), "value")
        self._undo, self._redo, self._reset = (
            pn.widgets.Button(name=name, width=75, disabled=True) for name in ("Undo", "Redo", "Reset")
        )
        self._undo.on_click(lambda event: self._go_to(self._history.undo()))
        self._redo.on_click(lambda event: self._go_to(self._history.redo()))
        self._reset.on_click(lambda event: self._start_anew())

    def _make_rest(self) -> None:
        """Make the controls of status, overlay, orders, full model and engine file."""
        self._status, self._said = pn.pane.HTML("", width=KNOBS_WIDTH - 20), pn.pane.HTML("", width=KNOBS_WIDTH - 20)
        self._before = pn.widgets.Checkbox(name="show before (dashed)", value=True)
        self._before.param.watch(lambda event: self._draw(), "value")
        self._keep = pn.widgets.Button(name="Keep this as before", width=180)
        self._keep.on_click(lambda event: self._keep_before())
        # Measured orders, then the largest computed orders.
        start = [float(order) for order in (self._explored.measured or {}).get(TORSION, {}) if order in ORDERS]
        start += [order for order in self._now.largest_orders(6) if order not in start]
        self._orders = pn.widgets.MultiChoice(
            name=f"orders shown (up to {SHOWN})", options={f"{order:g}": order for order in ORDERS},
            value=sorted(start[:6]), max_items=SHOWN, sizing_mode="stretch_width", min_width=300,
        )  # fmt: skip
        self._orders.param.watch(lambda event: self._choose_orders(), "value")
        self._log = pn.widgets.Checkbox(name="logarithmic scale", value=self._now.drowned)
        self._log.param.watch(lambda event: self._scale(), "value")
        speeds = self._live.speeds
        largest = float(speeds[np.nan_to_num(self._now.twist).argmax()])
        self._full = FullControls(
            (float(speeds[0]), float(speeds[-1])), largest, self._full_choice, self._show_runs, self._look_into,
        )  # fmt: skip
        usual = charts.unused(f"{self._live.whole.name}_explored", "", ".toml")
        self._path = pn.widgets.TextInput(name="new engine file", value=usual, width=KNOBS_WIDTH - 30)
        self._write = pn.widgets.Button(name="Write engine file", width=180)
        self._write.on_click(lambda event: self._write_file())
        self._changes, self._written = (
            pn.pane.HTML("", width=KNOBS_WIDTH - 20),
            pn.pane.HTML("", width=KNOBS_WIDTH - 20),
        )

    def _layout(self) -> Any:
        """Return the layout of knobs and charts; charts are in one column on narrow pages."""
        engine = self._live.whole
        groups: dict[str, list[Any]] = {}
        for knob in self._live.knobs:
            groups.setdefault(knob.group, []).append(self._sliders[knob.key])
        groups["Engine"].append(self._firing)
        knobs = [part for name, sliders in groups.items() for part in (heading(name), *sliders)]
        left = pn.Column(
            pn.pane.HTML(f"<h2 style='margin:0'>{html.escape(engine.title)}</h2>", width=KNOBS_WIDTH - 20),
            *(pn.pane.HTML(html.escape(note), width=KNOBS_WIDTH - 20) for note in self._live.notes),
            self._status, self._said, pn.Row(self._undo, self._redo, self._reset), *knobs,
            heading("Before and after"), self._before, self._keep,
            *self._full.parts, heading("Engine file"), self._changes, self._path, self._write, self._written,
            width=KNOBS_WIDTH, styles={"border-right": "1px solid #ddd"},
        )  # fmt: skip
        plots = [self._orders_chart.plot, self._orders_chart.log_plot, self._twist.plot, self._campbell.plot]
        if engine.damper is not None:
            plots.append(self._heat.plot)
        charts_box = charts.side_by_side(plots)
        self._boxes = list(charts_box.objects)
        self._scale()
        torsion = pn.Column(
            self._orders, self._log, charts_box, *self._compared(), sizing_mode="stretch_width", min_width=350
        )
        self._inside_box = pn.Column(sizing_mode="stretch_width", min_width=350)
        self._tabs = pn.Tabs(
            ("Torsion", torsion), ("Look inside", self._inside_box), sizing_mode="stretch_width", min_width=350,
        )  # fmt: skip
        self._tabs.param.watch(lambda event: self.inside, "active")
        self._tabs.active = 0 if self._explored.inside is None else 1
        return pn.Row(left, self._tabs, sizing_mode="stretch_width")

    def _compared(self) -> list[Any]:
        """Return the comparison with the other engine or run-up, on equal axes."""
        if self._explored.other is None:
            return []
        self._beside = charts.Beside(self._live.whole.title, *self._explored.other)
        self._beside.show(self._now, self._orders.value)
        return self._beside.parts

    # Actions of the user.

    def _turn(self, knob: Knob, shown: float) -> None:
        """Handle the movement of a knob."""
        if self._quiet:
            return
        own = knob.shown(knob.own)
        value = knob.own if abs(shown - own) <= SAME * own else knob.si(float(f"{shown:.{DIGITS}g}"))
        self._history.turn(knob.key, min(max(value, knob.low), knob.high), knob.own)
        self._soon()

    def _fire(self, order: tuple[int, ...]) -> None:
        if not self._quiet:
            self._history.fire(() if order == self._live.engine.cylinders.firing_order else order)
            self._history.rest()
            self._soon()

    def _soon(self) -> None:
        """Schedule a computation. Movements of knobs until then are computed together."""
        self._turned, self._resting = time.monotonic(), False
        if charts.in_notebook():
            self._answer(moving=True)
        elif not self._waiting:
            self._waiting = True
            pn.state.curdoc.add_timeout_callback(lambda: self._answer(moving=True), SETTLE_MS)

    def _answer(self, moving: bool) -> None:
        """Compute the present choice, and draw."""
        self._waiting = False
        began = time.perf_counter()
        try:
            self._now = self._live.answer(self._history.now, moving)
        except CranktrainError as error:
            self._said.object = said(str(error), wrong=True)
            return
        self._balance = None
        with pn.io.hold():
            self._said.object = ""
            self._draw()
            spent = 1e3 * (time.perf_counter() - began)
            self._status.object = said(
                f"linear run-up of {self._now.speeds.size} speeds × {len(ORDERS)} orders: {spent:.0f} ms"
            )

    def _released(self) -> None:
        """Handle the release of a knob: add an entry to the history."""
        if not self._quiet:
            self._history.rest()
            self._tell_choice()

    def _ask_balance(self) -> None:
        if self._explored.balance is not None:
            self._explored.balance.ask(self._history.now)

    def _go_to(self, chosen: Chosen) -> None:
        """Show a choice from the history of choices."""
        self._quiet = True
        for knob in self._live.knobs:
            self._sliders[knob.key].value = knob.shown(chosen.values.get(knob.key, knob.own))
        self._firing.value = chosen.firing or self._live.engine.cylinders.firing_order
        self._quiet = False
        self._answer(moving=False)
        self._ask_balance()
        self._tell_choice()

    def _start_anew(self) -> None:
        self._history.rest()
        self._history.now = Chosen()
        self._history.rest()
        self._go_to(self._history.now)

    def _keep_before(self) -> None:
        self._kept, self._kept_of = self._live.answer(self._history.now), self._history.now
        self._draw()

    def _scale(self) -> None:
        """Show the chart of orders with the chosen scale."""
        chart = self._orders_chart
        chart.plot.visible, chart.log_plot.visible = not self._log.value, self._log.value

    def _choose_orders(self) -> None:
        self._orders_chart.choose(sorted(self._orders.value), self._explored.measured)
        self._draw()

    def _draw(self) -> None:
        """Update the charts with all present data."""
        now, before = self._now, self._kept if self._before.value and self._kept is not self._now else None
        orders = sorted(self._orders.value)
        self._orders_chart.show(now, before)
        self._orders_chart.show_runs(self._balance, self._full.found)
        rpm = now.speeds / RPM
        old = None if before is None else before.speeds / RPM
        self._twist.show(rpm, DEG * now.twist, None if before is None or old is None else (old, DEG * before.twist))
        if now.heat.size:
            kept = None if before is None or old is None else (old, before.heat)
            self._heat.show(rpm, now.heat, kept, now.heat_limit)
        self._campbell.show(now, before, orders)
        if self._explored.other is not None and hasattr(self, "_beside"):
            self._beside.show(now, orders)
        charts.push(self._boxes)

    # Results of background work.

    def look(self) -> None:
        """Receive results of background work; called periodically while the page is open."""
        if not (self._resting or self._waiting) and time.monotonic() - self._turned > REST:
            self._resting = True
            if self._now.speeds.size < self._live.speeds.size:
                self._answer(moving=False)
            self._ask_balance()
            self._tell_choice()
        balance = self._explored.balance
        if balance is not None and (found := balance.found()) is not None:
            chosen, run = found
            if chosen == self._history.now:
                self._balance = run if isinstance(run, RunUp) else None
                self._show_runs()
                if isinstance(run, str):
                    self._said.object = said(run, wrong=True)
        if self._full.running:
            self._full.look()

    def _show_runs(self) -> None:
        self._orders_chart.show_runs(self._balance, self._full.found)
        charts.push(self._boxes)

    def _full_choice(self) -> tuple[Engine, float]:
        """Return engine and load of a full model of the present choice; raises ``InputError``."""
        self._history.rest()
        return self.engine(), self._history.now.load

    def _look_into(self, cycle: InsideCycle) -> None:
        """Show a recorded cycle."""
        self.inside.take(cycle)
        self._tabs.active = 1

    def _write_file(self) -> None:
        """Write the engine file of the present choice."""
        try:
            source, live = self._explored.source, self._live
            path = self._explored.folder / user_path(self._path.value or "")
            if not path.resolve().is_relative_to(self._explored.folder.resolve()):
                raise InputError(f"{path}: lies outside of {self._explored.folder}; give a name below that folder")
            write_engine(source, live.whole, live.knobs, self._history.now, path)
        except (CranktrainError, OSError) as error:
            self._written.object = said(str(error), wrong=True)
            return
        self._written.object = said(f"{path.absolute()} written")

    # Texts of the page.

    def _tell_choice(self) -> None:
        """Update buttons and the list of changed values."""
        self._undo.disabled, self._redo.disabled = not self._history.can_undo, not self._history.can_redo
        self._reset.disabled = self._history.now == Chosen()
        try:
            found = [str(one) for one in changes(self._live.whole, self._live.knobs, self._history.now)]
        except InputError as error:
            found = [str(error)]
        rows = "".join(f"<li>{html.escape(one)}</li>" for one in found)
        self._changes.object = f"<ul style='margin:0;padding-left:18px'>{rows}</ul>" if rows else "nothing changed"


MOST = 500


class History:
    """History of choices of the knobs; the last choice is the present one.

    A movement of a knob is one choice: :meth:`turn` changes the present choice without a new entry until :meth:`rest`
    is called.
    """

    def __init__(self) -> None:
        self._past: list[Chosen] = []
        self._future: list[Chosen] = []
        self._rested, self.now = Chosen(), Chosen()

    @property
    def can_undo(self) -> bool:
        """True if there is a choice before the present one."""
        return bool(self._past) or self.now != self._rested

    @property
    def can_redo(self) -> bool:
        """True if a choice was undone last."""
        return bool(self._future)

    def turn(self, key: str, value: float, own: float) -> None:
        """Set a knob to a value (SI). The engine's own value removes the knob from the choice."""
        others = {name: held for name, held in self.now.values.items() if name != key}
        self.now = replace(self.now, values=others if value == own else {**others, key: value})

    def fire(self, order: tuple[int, ...]) -> None:
        """Set a firing order; an empty order means the engine's own."""
        self.now = replace(self.now, firing=order)

    def rest(self) -> None:
        """Store the present choice as an entry of the history."""
        if self.now != self._rested:
            self._past = [*self._past, self._rested][-MOST:]
            self._rested, self._future = self.now, []

    def undo(self) -> Chosen:
        """Go back to the choice before the present one, and return it."""
        self.rest()
        if self._past:
            self._future.append(self._rested)
            self._rested = self.now = self._past.pop()
        return self.now

    def redo(self) -> Chosen:
        """Restore the choice that was undone last, and return it."""
        if self._future and self.now == self._rested:
            self._past.append(self._rested)
            self._rested = self.now = self._future.pop()
        return self.now
