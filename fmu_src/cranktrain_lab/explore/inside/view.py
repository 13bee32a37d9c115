"""Part of the page with the view inside: crank, orbit, film and load at one crank angle."""

import html

import panel as pn

from cranktrain.core.errors import CranktrainError
from cranktrain_lab.explore.charts import push, side_by_side, unused
from cranktrain_lab.explore.inside.charts import SIDES, FilmChart, OrbitChart, PolarChart
from cranktrain_lab.explore.inside.crank_surface import STRESSES
from cranktrain_lab.explore.inside.crank_view import CrankChart
from cranktrain_lab.explore.inside.cycle import FRAME_DEG, BearingLook, InsideCycle

PRESS = (
    "Nothing to look into yet. Choose crank, bearings and speed under <b>Full model</b> and press <b>Look inside</b>: "
    "one speed runs until its cycles repeat. Or start the page with a cycle that was saved, or with a result of "
    "<tt>cranktrain simulate</tt>: <tt>cranktrain explore ENGINE --inside FILE.h5</tt>."
)
NO_STRESS = {
    "beam": "A beam crank has forces in its cuts and no stresses at a surface; take crank solid.",
    "torsional": "A torsional crank twists only, so it has no stresses at a surface; take crank solid.",
    "rigid": "A rigid crank has no stresses; take crank solid.",
}
TICK_MS = 120
"""Time between two frames of the animation, ms."""
ENLARGEMENTS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Choices of enlargement relative to the initial one."""


class InsideView:
    """View with slider, choices and charts of a cycle, or with a line of instructions if there is no cycle.

    Attributes
    ----------
    view : Panel object
    boxes : charts to push in a notebook
    """

    def __init__(self, cycle: InsideCycle | None = None) -> None:
        self.orbit, self.film, self.polar = OrbitChart(), FilmChart(), PolarChart()
        self.crank: CrankChart | None = None
        self.cycle: InsideCycle | None = None
        self._head = pn.pane.HTML("", sizing_mode="stretch_width")
        self.player = pn.widgets.Player(
            name="crank angle, deg", start=0, end=720 - FRAME_DEG, step=FRAME_DEG, interval=TICK_MS, loop_policy="loop",
            show_loop_controls=False, show_value=True, visible_buttons=["previous", "play", "pause", "next"],
            sizing_mode="stretch_width", height=75, min_width=300,
        )  # fmt: skip
        self.player.param.watch(lambda event: self.show(), "value")
        self.bearing = pn.widgets.Select(name="bearing", width=140)
        self.bearing.param.watch(lambda event: self._choose_bearing(), "value")
        self.side = pn.widgets.Select(name="load", options=list(SIDES), width=140)
        self.side.param.watch(lambda event: self._choose_bearing(), "value")
        self.stress = pn.widgets.Select(
            name="colours", options={words: name for name, words in STRESSES.items()}, width=230
        )
        self.stress.param.watch(lambda event: self._choose_stress(), "value")
        self.enlargement = pn.widgets.Select(name="deformation", width=140)
        self.enlargement.param.watch(lambda event: self._choose_stress(), "value")
        self._quiet = False
        self._charts = side_by_side([self.orbit.plot, self.film.plot, self.polar.plot])
        self.boxes = list(self._charts.objects)
        self._no_crank, self._no_orbit, self._no_film = (
            pn.pane.HTML("", sizing_mode="stretch_width", visible=False) for _ in range(3)
        )
        self._crank_box = pn.Column(sizing_mode="stretch_width")
        # A Bokeh pane takes its visibility from its figure, so the columns around panes are shown and hidden.
        self._orbit_box, self._film_box, polar = (pn.Column(box, sizing_mode="stretch_width") for box in self.boxes)
        self._charts.objects = [
            self._crank_box,
            pn.Column(self._orbit_box, self._no_orbit, sizing_mode="stretch_width"),
            pn.Column(self._film_box, self._no_film, sizing_mode="stretch_width"),
            polar,
        ]
        self._save = pn.widgets.Button(name="Save this cycle", width=140)
        self._save.on_click(lambda event: self._write())
        self._saved = pn.pane.HTML("", sizing_mode="stretch_width")
        controls = pn.FlexBox(
            self.bearing, self.side, self.stress, self.enlargement, pn.Column(pn.Spacer(height=14), self._save)
        )
        self._body = pn.Column(
            self.player, controls, self._saved, self._charts, sizing_mode="stretch_width", visible=False
        )
        self.view = pn.Column(self._head, self._body, sizing_mode="stretch_width", min_width=350)
        self._head.object = f"<p>{PRESS}</p>"
        if cycle is not None:
            self.take(cycle)

    @property
    def frame(self) -> int:
        """Index of the present frame."""
        return int(self.player.value) // FRAME_DEG

    @property
    def look(self) -> BearingLook:
        """Bearing that the charts show."""
        assert self.cycle is not None
        return next(one for one in self.cycle.bearings if one.name == self.bearing.value)

    def take(self, cycle: InsideCycle) -> None:
        """Show a cycle."""
        self.cycle, self._quiet, self._saved.object = cycle, True, ""
        levels = ", ".join(f"{name.replace('_', ' ')} {level}" for name, level in cycle.levels.items() if level)
        words = f"<b>{html.escape(cycle.engine)} at {cycle.rpm:.0f} rev/min</b>; {html.escape(levels)}"
        self._head.object = words + (f"<br>{html.escape(cycle.note)}" if cycle.note else "")
        before = self.bearing.value
        self.bearing.options = {one.title: one.name for one in cycle.bearings}
        kept = before if before in self.bearing.options.values() else cycle.bearings[0].name
        self.bearing.value = kept
        surface = cycle.surface
        if surface is None:
            self.crank = None
            level = cycle.levels.get("crank", "")
            text = cycle.note or NO_STRESS.get(level, f"Crank level {level} has no stresses; take crank solid.")
            self._no_crank.object, self._no_crank.visible = _line(text), True
            self._crank_box.objects = [self._no_crank]
        else:
            self.crank = CrankChart(surface, f"Crankshaft at {cycle.rpm:.0f} rev/min")
            self._crank_box.objects = [self.crank.view]
            own = surface.enlargement
            self.enlargement.options = {f"× {float(f'{own * k:.2g}'):g}": own * k for k in ENLARGEMENTS}
            self.enlargement.value = own
        self.stress.visible = self.enlargement.visible = surface is not None
        self._quiet = False
        if surface is not None:
            self._choose_stress()
        self._choose_bearing()
        self._body.visible = True

    def show(self) -> None:
        """Show the present crank angle in all charts."""
        if self.cycle is None or self._quiet:
            return
        frame = self.frame
        with pn.io.hold():
            if self.crank is not None:
                self.crank.show(frame)
            if self._orbit_box.visible:
                self.orbit.show(frame)
            if self._film_box.visible:
                self.film.show(frame)
            self.polar.show(frame)
        push(self.boxes)

    def _choose_bearing(self) -> None:
        if self._quiet or self.cycle is None:
            return
        look, level = self.look, self.cycle.level_of(self.look)
        self._orbit_box.visible, self._film_box.visible = look.orbit.size > 0, look.film is not None
        self._no_orbit.object = (
            ""
            if look.orbit.size
            else _line(f"{look.title}: bearing level {level} has no film, so there is no orbit in a clearance.")
        )
        self._no_film.object = "" if look.film is not None else _line(self._film_words(look, level))
        self._no_orbit.visible, self._no_film.visible = not look.orbit.size, look.film is None
        if look.orbit.size:
            self.orbit.choose(look)
        if look.film is not None:
            self.film.choose(look)
        self.polar.choose(look, self.side.value)
        self.show()

    def _film_words(self, look: BearingLook, level: str) -> str:
        """Return the reason why there is no film pressure."""
        assert self.cycle is not None
        if self.cycle.note:
            return self.cycle.note
        if not look.orbit.size:
            return f"{look.title}: bearing level {level} has no film, so there is no film pressure."
        taken = "ehd" if look.name.startswith("big_end") else "reynolds or ehd"
        return (
            f"{look.title}: level {level} reads the film's force from a map or a table and solves no pressure; "
            f"take {taken}."
        )

    def _choose_stress(self) -> None:
        if self.crank is not None and not self._quiet:
            self.crank.enlarge(float(self.enlargement.value))
            self.crank.choose(self.stress.value)

    def _write(self) -> None:
        """Save the cycle under an unused name."""
        assert self.cycle is not None
        try:
            path = self.cycle.save(unused(f"{self.cycle.engine}_{self.cycle.rpm:.0f}rpm_inside", "_", ".h5"))
        except (CranktrainError, OSError) as error:
            self._saved.object = f"<span style='color:#b00020'>{html.escape(str(error))}</span>"
            return
        self._saved.object = html.escape(f"{path.absolute()} written; --inside {path} shows it again")


def _line(text: str) -> str:
    return f"<p style='color:#444;padding:12px;border:1px solid #ddd'>{html.escape(text, quote=False)}</p>"
