"""Charts of one bearing at one crank angle: orbit, unrolled film, and polar load diagram."""

import math

import numpy as np
from bokeh.models import ColorBar, ColumnDataSource, FixedTicker, HoverTool, LinearColorMapper, Range1d

from cranktrain.core.types import Array
from cranktrain.engine.limits import BIG_END
from cranktrain.results.orders.harmonics import ComplexArray
from cranktrain.results.summary import NOT_RESOLVED
from cranktrain_lab.explore.charts import COLOURS, empty_plot
from cranktrain_lab.explore.inside.cycle import FRAME_DEG, BearingLook

SHELL, JOURNAL = "on the shell", "on the journal"
SIDES = (SHELL, JOURNAL)
"""Choices of axes of a polar load diagram: axes of the shell, and axes of the crank."""
_ROOM = 1.12
"""Ratio of a square chart's half width to the largest value of its curve."""
_DEG, _KN, _MPA, _MM = 180.0 / math.pi, 1.0e-3, 1.0e-6, 1.0e3


class _Square:
    """Square chart of a plane curve over a cycle, with a mark at the present crank angle."""

    _look: BearingLook

    def __init__(self, across: str, up: str, unit: str) -> None:
        self.plot = empty_plot(" ", across, up, match_aspect=True)
        # Bokeh keeps scales equal only for ranges that follow data, so two corner points define the range.
        self._corners = ColumnDataSource({"x": [], "y": []})
        corners = self.plot.scatter("x", "y", source=self._corners, alpha=0.0)
        for ends in (self.plot.x_range, self.plot.y_range):
            ends.renderers, ends.range_padding = [corners], 0.0
        self.curve = ColumnDataSource({"x": [], "y": []})
        self.start, self.point, self.arm = (ColumnDataSource({"x": [], "y": []}) for _ in range(3))
        self.plot.line("x", "y", source=self.curve, color=COLOURS[0], line_width=1.5)
        self.plot.line("x", "y", source=self.arm, color=COLOURS[1], line_width=1.5)
        self.plot.scatter("x", "y", source=self.start, size=9, line_color="black", fill_color=None)
        dot = self.plot.scatter("x", "y", source=self.point, size=10, color=COLOURS[1])
        self.plot.add_tools(HoverTool(renderers=[dot], tooltips=[("x", f"@x {unit}"), ("y", f"@y {unit}")]))

    def draw(self, curve: ComplexArray, start: int, reach: float) -> None:
        """Draw a closed curve (n,), with a ring at sample ``start``, in a square of half width ``reach``."""
        closed = np.append(curve, curve[:1])
        self.curve.data = {"x": closed.real, "y": closed.imag}
        self.start.data = {"x": [curve[start].real], "y": [curve[start].imag]}
        self._corners.data = {"x": [-reach, reach], "y": [-reach, reach]}

    def mark(self, value: complex, arm: bool) -> None:
        """Mark the value at the present crank angle, with a line from the origin if ``arm``."""
        self.point.data = {"x": [value.real], "y": [value.imag]}
        self.arm.data = {"x": [0.0, value.real], "y": [0.0, value.imag]} if arm else {"x": [], "y": []}


class OrbitChart(_Square):
    """Chart of the orbit of the journal's centre in the clearance circle."""

    def __init__(self) -> None:
        super().__init__("x over the clearance", "y over the clearance", "")
        angle = np.linspace(0.0, 2.0 * math.pi, 181)
        self.plot.line(np.cos(angle), np.sin(angle), color="#444444", line_dash="dashed", legend_label="clearance")
        self.plot.legend.label_text_font_size, self.plot.legend.location = "11px", "top_right"
        self.plot.legend.background_fill_alpha = 0.5

    def choose(self, look: BearingLook) -> None:
        """Show a bearing with an orbit."""
        self._look = look
        self.draw(look.orbit, look.sample(0), _ROOM * max(1.0, float(np.abs(look.orbit).max())))

    def show(self, frame: int) -> None:
        """Mark a frame."""
        look = self._look
        here = complex(look.orbit[look.sample(frame)])
        self.mark(here, arm=False)
        self.plot.title.text = (
            f"{look.title}: orbit, clearance {1e6 * look.clearance:.0f} µm; {frame * FRAME_DEG}°: eccentricity "
            f"{abs(here):.3f}"
        )


class PolarChart(_Square):
    """Polar load diagram of a bearing."""

    def __init__(self) -> None:
        super().__init__("load, kN", "load, kN", "kN")
        self._load: ComplexArray = np.zeros(1, dtype=complex)
        self._words = ""

    def choose(self, look: BearingLook, side: str) -> None:
        """Show the load of a bearing on its shell or on its journal."""
        self._look = look
        self._load = _KN * (look.shell if side == SHELL else look.journal)
        of_rod = look.name.startswith(BIG_END)
        axes = ("across the rod", "along the rod") if of_rod else ("across the engine", "upwards")
        if side == JOURNAL:
            axes = "in the crank's axes, x", "in the crank's axes, y"
        self.plot.xaxis.axis_label, self.plot.yaxis.axis_label = (f"{one}, kN" for one in axes)
        self._words = side
        self.draw(self._load, look.sample(0), _ROOM * max(float(np.abs(self._load).max()), 1.0e-9))

    def show(self, frame: int) -> None:
        """Mark a frame."""
        look = self._look
        here = complex(self._load[look.sample(frame)])
        self.mark(here, arm=True)
        self.plot.title.text = (
            f"{look.title}: load {self._words}; {frame * FRAME_DEG}°: {abs(here):.1f} of "
            f"{float(np.abs(self._load).max()):.1f} kN"
        )


class FilmChart:
    """Chart of the unrolled film pressure, with a rectangle for the cell of each node."""

    _look: BearingLook

    def __init__(self) -> None:
        self.plot = empty_plot(
            " ", "angle in the shell, deg", "across the shell, mm", x_range=Range1d(-180, 180), y_range=Range1d(-1, 1)
        )
        self.plot.xaxis.ticker = FixedTicker(ticks=list(range(-180, 181, 60)))
        self.plot.grid.visible = False
        self._colours = LinearColorMapper(palette="Viridis256", low=0.0, high=1.0)
        names = ("left", "right", "bottom", "top", "p")
        self.cells: ColumnDataSource = ColumnDataSource({name: [] for name in names})
        colour = {"field": "p", "transform": self._colours}  # edges have the colour too, to hide seams between cells
        quads = self.plot.quad(
            left="left", right="right", bottom="bottom", top="top", source=self.cells,
            line_color=colour, fill_color=colour,
        )  # fmt: skip
        self.peak = ColumnDataSource({"x": [], "y": []})
        self.plot.scatter("x", "y", source=self.peak, marker="x", size=10, color="white", line_width=2)
        self.plot.add_layout(ColorBar(color_mapper=self._colours, title="MPa", width=10, padding=6), "right")
        self.plot.add_tools(HoverTool(renderers=[quads], tooltips=[("pressure", "@p{0.00} MPa")]))

    def choose(self, look: BearingLook) -> None:
        """Show a bearing with film pressure; the colour scale covers its whole cycle."""
        self._look = look
        assert look.film is not None
        self._colours.high = max(_MPA * float(look.film.pressure.max()), 1.0e-9)
        half = 0.5 * _MM * look.width
        self.plot.y_range.start, self.plot.y_range.end = -half, half
        of_rod = look.name.startswith(BIG_END)
        zero = "0 across the rod, 90 towards the small end" if of_rod else "0 across the engine, 90 upwards"
        self.plot.xaxis.axis_label = f"angle in the shell, deg; {zero}"

    def show(self, frame: int) -> None:
        """Show a frame."""
        look = self._look
        assert look.film is not None
        begin, end = look.film.cells(frame)
        pressure = _MPA * np.asarray(look.film.pressure[frame], dtype=float)
        sides = 0.5 * _MM * look.width * look.film.sides
        self.cells.data = cell_columns(_DEG * begin, _DEG * end, sides, pressure)
        i, j = np.unravel_index(int(pressure.argmax()), pressure.shape)
        middle = (_DEG * 0.5 * (begin[i] + end[i]) + 180.0) % 360.0 - 180.0
        self.peak.data = {"x": [middle], "y": [0.5 * (sides[j] + sides[j + 1])]}
        self.plot.title.text = (
            f"{look.title}: film pressure; {frame * FRAME_DEG}°: greatest node {pressure.max():.1f} of "
            f"{self._colours.high:.1f} MPa{', on one line alone: not resolved' if single_line(pressure) else ''}"
        )


def single_line(pressure: Array) -> bool:
    """True if the largest of n × m nodal pressures is alone on one axial line, so the film is not resolved."""
    i, j = np.unravel_index(int(pressure.argmax()), pressure.shape)
    beside = np.pad(pressure[i], 1)[[j, j + 2]]
    return bool(pressure[i, j] > 0.0 and 1.0 - beside.mean() / pressure[i, j] > NOT_RESOLVED)


def cell_columns(begin: Array, end: Array, sides: Array, pressure: Array) -> dict[str, Array]:
    """Return rectangles of n × m cells; cells across ±180 deg are split in two.

    Parameters
    ----------
    begin, end : (n,) deg
    sides : (m + 1,)
    pressure : (n, m)
    """
    shift = 360.0 * np.floor((begin + 180.0) / 360.0)
    left, right = begin - shift, end - shift
    across = right > 180.0
    lefts = np.concatenate((left, np.full(int(across.sum()), -180.0)))
    rights = np.concatenate((np.minimum(right, 180.0), right[across] - 360.0))
    rows = np.concatenate((pressure, pressure[across]))
    count = len(sides) - 1
    return {
        "left": np.repeat(lefts, count), "right": np.repeat(rights, count), "bottom": np.tile(sides[:-1], len(rows)),
        "top": np.tile(sides[1:], len(rows)), "p": rows.ravel(),
    }  # fmt: skip
