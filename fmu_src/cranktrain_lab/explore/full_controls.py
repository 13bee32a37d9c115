"""Controls of the full model on the page: levels, speeds, and background jobs.

A job computes the full model of a choice of the knobs, steady cycles in time at a few speeds, in a separate process.
Its results are written to a run-up file, which is read whenever it grows, so a stop loses no finished speed.
"""

import html
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import panel as pn

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.units import RPM
from cranktrain.engine.levels import CRANKS
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import BIG_END, MAINS, bearing_levels
from cranktrain.results.run_up.run_up import RunUp
from cranktrain_lab.explore.background import Advance, Background, Say
from cranktrain_lab.explore.inside.cycle import InsideCycle
from cranktrain_lab.explore.inside.recording import LookInside, SteadyJob
from cranktrain_lab.explore.knobs import LOAD, Knob

HIGHEST_ORDER = 24.0


@dataclass(frozen=True)
class FullRun(SteadyJob):
    """Job of a full model at all ``speeds`` (rad/s)."""

    speeds: tuple[float, ...] = field(default=(), kw_only=True)

    def work(self, path: Path, say: Say, advance: Advance) -> str:
        """Run all speeds into a run-up file. Return a remark on the first speed without a result, if any."""
        from cranktrain.structure.assembly import assemble
        from cranktrain.studies.run_up.plan import job_of
        from cranktrain.studies.run_up.run_up import Means, run_up

        request = self.request()
        settings = replace(request.settings(self.engine), gas_load=self.load)
        made = assemble(self.engine, settings, say=say)
        job = job_of(request, made, None, [], HIGHEST_ORDER)
        attributes: dict[str, str | int | float] = {"engine": self.engine.name, "crank": self.crank}
        outcome = run_up(job, list(self.speeds), path, Means(workers=1), attributes, advance)
        lost = [f"{one.speed / RPM:.0f} rev/min: {one.reason}" for one in outcome.failed]
        return f"no result at {lost[0]}" if lost else ""


def spread(low: float, high: float, count: int) -> tuple[float, ...]:
    """Return the speeds (rad/s) of a full run over a range; raises ``InputError`` for an invalid count."""
    if not 1 <= count <= 500:
        raise InputError(f"speeds of the full model: {count} is not within 1 to 500")
    return tuple(np.linspace(low, high, count).tolist()) if count > 1 else (0.5 * (low + high),)


KNOBS_WIDTH = 300
NO_ARROWS = ".bk-spin-wrapper .bk-spin-btn-up, .bk-spin-wrapper .bk-spin-btn-down { display: none !important; }"
"""Style that hides the arrows of number fields next to sliders, because they would cover digits."""


def heading(text: str) -> Any:
    """Return the heading of a group of knobs."""
    return pn.pane.HTML(f"<b style='border-bottom:1px solid #ccc;display:block'>{text}</b>", width=KNOBS_WIDTH - 20)


def said(text: str, wrong: bool = False) -> str:
    """Return a message as HTML, in red if something is ``wrong``."""
    colour = "#b00020" if wrong else "#444"
    return f"<span style='color:{colour};overflow-wrap:anywhere'>{html.escape(text)}</span>" if text else ""


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


HALF = 130
"""Width, pixels, of controls that are arranged in pairs."""


class FullControls:
    """Levels, speeds and buttons of the full model; one job at a time runs in the background.

    Parameters
    ----------
    ends : ends of the speed range of the full model, rad/s
    speed : initial speed for looking inside, rad/s
    chosen : returns the engine of the present knobs, and the load as a fraction of the full-load burn
    shown : called if the finished speeds have changed
    looked : called with a cycle to look into

    Attributes
    ----------
    found : finished speeds
    parts : Panel objects
    """

    def __init__(
        self,
        ends: tuple[float, float],
        speed: float,
        chosen: Callable[[], tuple[Engine, float]],
        shown: Callable[[], None],
        looked: Callable[[InsideCycle], None],
    ) -> None:
        self._ends, self._chosen, self._shown, self._looked = ends, chosen, shown, looked
        self.found: RunUp | None = None
        self._job: Background | None = None
        self._engine: Engine | None = None  # engine of a job that records a cycle for the view inside
        crank_levels = [name for name, level in CRANKS.items() if level.elastic]
        self._crank = pn.widgets.Select(name="crank", options=crank_levels, value="solid", width=HALF)
        self._bearings = pn.widgets.Select(name="bearings", options=["auto", *bearing_levels(*MAINS)], width=HALF)
        self._big_ends = pn.widgets.Select(
            name="big ends", options=list(bearing_levels(BIG_END)), value="rigid", width=HALF
        )
        self._count = pn.widgets.IntInput(name="speeds", value=9, start=1, end=500, width=HALF)
        self._speed = pn.widgets.IntInput(
            name="one speed, rev/min", value=round(speed / RPM / 10.0) * 10, step=50, start=20, width=HALF
        )
        self._run, self._inside, self._stop = (
            pn.widgets.Button(name=name, width=HALF) for name in ("Run full model", "Look inside", "Stop")
        )
        self._stop.disabled = True
        self._run.on_click(lambda event: self._begin(self._full_run))
        self._inside.on_click(lambda event: self._begin(self._look_inside))
        self._stop.on_click(lambda event: self._end())
        self._progress = pn.indicators.Progress(value=0, max=100, width=KNOBS_WIDTH - 30, visible=False)
        self._said = pn.pane.HTML("", width=KNOBS_WIDTH - 20)
        self.parts = [
            heading("Full model"), pn.Row(self._crank, self._bearings), pn.Row(self._big_ends, self._count),
            self._run, pn.Row(self._speed, pn.Column(pn.Spacer(height=14), self._inside)), self._stop,
            self._progress, self._said,
        ]  # fmt: skip

    @property
    def running(self) -> bool:
        """True while a job is running."""
        return self._job is not None and self._job.running

    def close(self) -> None:
        """Stop the background job, and delete the file of its results."""
        if self._job is not None:
            self._job.close()

    def look(self) -> None:
        """Receive new results of the background job; called periodically."""
        job = self._job
        if job is None:
            return
        if job.look():
            self._take(job)
        self._progress.value = int(100.0 * job.share)
        self._say(job.text, wrong=bool(job.error))
        self._run.disabled = self._inside.disabled = job.running
        self._stop.disabled = not job.running

    def _take(self, job: Background) -> None:
        """Read the results that the job has written so far."""
        if self._engine is None:
            if job.path.exists():
                with suppress(CranktrainError):
                    self.found = RunUp.load(job.path)
            self._shown()
        elif not job.running and not job.error:
            try:
                self._looked(InsideCycle.load(job.path, self._engine))
            except CranktrainError as error:
                job.error = str(error)

    def _full_run(self) -> FullRun:
        engine, load = self._chosen()
        speeds = spread(*self._ends, int(self._count.value or 0))
        self.found, self._engine = None, None
        return FullRun(engine, *self._levels(), load, speeds[0], speeds=speeds)

    def _levels(self) -> tuple[str, str, str]:
        return self._crank.value, self._bearings.value, self._big_ends.value

    def _look_inside(self) -> LookInside:
        engine, load = self._chosen()
        self._engine = engine
        if not self._speed.value:
            raise InputError("one speed, rev/min: is empty; give the speed to look inside at")
        return LookInside(engine, *self._levels(), load, self._speed.value * RPM)

    def _begin(self, make: Callable[[], FullRun | LookInside]) -> None:
        """Start a background job for the present choice of the knobs."""
        self.close()
        self._job = None
        try:
            self._job = Background(make())
        except CranktrainError as error:
            self._say(str(error), wrong=True)
            return
        self._progress.visible = True
        self.look()

    def _end(self) -> None:
        job = self._job
        if job is None:
            return
        job.stop()
        self._take(job)
        self.look()
        if self._engine is None:
            count = 0 if self.found is None else self.found.speeds.size
            self._say(f"stopped; {count} finished speeds are kept in the chart")
        else:
            self._say("stopped; the cycle was not finished")

    def _say(self, text: str, wrong: bool = False) -> None:
        self._said.object = said(text, wrong)
