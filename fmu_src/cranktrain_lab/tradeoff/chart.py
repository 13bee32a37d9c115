"""Pictures of the study: a chart for each family, and an overall chart with Pareto front."""

from collections.abc import Callable, Sequence
from typing import Any

from cranktrain_lab.tradeoff.point import INPUT, MODEL, NUMERICAL, OUTPUTS, TOP, Point, in_scene, pareto_front

NAMES = {"pulley_torsion": "pulley torsion", "pulley_axial": "pulley axial motion", "bearing_film": "least film"}
COST = "processor s per simulated s / 1"
ERROR = "relative error, RMS over the last cycle / 1"
AXES = {
    "coupling": ("communication_deg", "communication step / deg"),
    "schemes": ("communication_deg", "communication step / deg"),
    "mesh": ("mesh_size_mm", "largest element edge / mm"),
    "pressure": ("trace_deg", "spacing of the trace's samples / deg"),
}
"""Quantity on the horizontal axis for families whose choices have nearly equal cost."""
KINDS = {
    NUMERICAL: "numerical error: same model, finer step",
    TOP: "model error: against the top of its ladder",
    MODEL: "model error: against the next level up",
    INPUT: "error of the inputs: against inputs known exactly",
}
LINES = {
    "integrators": ("integrator",), "adaptive": ("integrator", "control"), "coupling": ("reconstruction",),
    "schemes": ("scheme", "reconstruction"), "pressure": ("trace_rule",),
}  # fmt: skip
"""Parameters whose values are common to a line of a chart, by family."""
MARKS = ("o", "s", "^", "v", "D", "P", "X", "<", ">", "p", "h", "*")
LEAST = 1.0e-9
"""Least error in charts. Smaller errors are drawn at this value."""
FARTHEST = 30.0
"""Largest error in charts. Larger errors mean a useless result and are not drawn."""
MARK = 6.0
"""Half the size of a mark, in points, for placing labels."""
PLACES = (
    (-6, -9), (7, 4), (7, -11), (7, 15), (-7, -12), (-7, 6), (7, -22), (-7, 18), (-7, -24), (-22, -5), (-22, -16),
    (-22, 7), (-34, -5), (-34, -16), (-34, -27), (-34, 10), (7, 27), (7, -34), (-14, 44), (-14, -48),
)  # fmt: skip
"""Candidate positions of a label, in points from its mark."""
FAR = 14
"""Distance, in points, above which a line connects mark and label."""
Labels = list[tuple[float, float, str]]


def series(point: Point) -> str:
    """Return the name of the line to which a point belongs in a chart."""
    p = point.parameters
    if point.solver:
        return point.solver
    if point.family in LINES:
        return ", ".join(str(p[name]) for name in LINES[point.family])
    if point.family == "bearings":
        if p.get("film_grid"):
            return "grid of films in the loop"
        if point.label.startswith("table, "):
            return "resolution of the table"
    if "ladder" in p:
        ending = ", against the next one up" if p["error_kind"] == MODEL else ""
        return f"{p['ladder']} levels{ending}"
    return {"modes": "cut-off of the crank's modes", "mesh": "mesh of the crank"}.get(point.family, point.family)


def family_figure(points: Sequence[Point], family: str, scenes: Sequence[str]) -> Any:
    """Draw errors of outputs (rows) in scenes (columns) over cost, or over the chosen quantity."""
    own = [point for point in points if point.family == family and _drawn(point)]
    columns = [scene for scene in scenes if in_scene(own, scene)] or list(scenes[:1])
    rows = [name for name in OUTPUTS if any(point.error[name] for point in own)] or [OUTPUTS[0]]
    names = list(dict.fromkeys(series(point) for point in own))
    kinds = [text for kind, text in KINDS.items() if any(p.parameters["error_kind"] == kind for p in own)]

    def draw(ax: Any, r: int, c: int, handles: dict[str, Any]) -> Labels:
        if r == 0:
            ax.set_title(columns[c], fontsize=10, loc="left", parse_math=False)
        if c == 0:
            ax.set_ylabel(f"{NAMES[rows[r]]}\n{ERROR}", fontsize=8)
        if r == len(rows) - 1:
            ax.set_xlabel(AXES[family][1] if family in AXES else COST, fontsize=8)
        return plot_family(ax, in_scene(own, columns[c]), family, rows[r], names, handles)

    size = (4.6 * len(columns) + 2.6, 3.3 * len(rows) + 0.7)
    return _figure(size, (len(rows), len(columns)), draw, 7, f"{family}: {'; '.join(kinds)}")


def plot_family(
    ax: Any, points: Sequence[Point], family: str, output: str, names: Sequence[str], handles: dict[str, Any]
) -> Labels:
    """Draw one output's errors of a family, with lines of related choices, the front, and a ring at the default.

    Returns the wanted labels.
    """
    parameter = AXES[family][0] if family in AXES else None

    def place(point: Point) -> float:
        return float(point.parameters[parameter]) if parameter else _cost(point)

    shown = [point for point in points if point.error[output] is not None]
    for k, name in enumerate(names):
        line = sorted((point for point in shown if series(point) == name), key=place)
        if not line:
            continue
        x, y = [place(point) for point in line], [_level(point, output) for point in line]
        style = {"marker": MARKS[k % len(MARKS)], "color": f"C{k % 10}", "ms": 4.5}
        if line[0].parameters["error_kind"] == MODEL:
            style["mfc"] = "none"
        (handles[name],) = ax.plot(x, y, lw=1.0, ls="-" if k < 10 else "--", **style)
    if parameter is None:
        like = [point for point in shown if point.parameters["error_kind"] != MODEL]
        front = [like[k] for k in pareto_front([_cost(p) for p in like], [_level(p, output) for p in like])]
        if front:
            (handles["Pareto front"],) = ax.plot(
                [_cost(p) for p in front], [_level(p, output) for p in front], color="black", lw=2.5, alpha=0.25,
                zorder=0,
            )  # fmt: skip
    _finish(ax, shown, place, lambda point: _level(point, output), handles)
    if family not in ("ladder", "bearings", "mesh"):
        return []
    return [(place(p), _level(p, output), p.label) for p in shown if p.parameters["error_kind"] != MODEL]


def overall_figure(points: Sequence[Point], scenes: Sequence[str]) -> Any:
    """Draw all points of scenes over their cost, by kind of error, with the front marked and labelled."""
    drawn = [point for point in points if _drawn(point)]
    found = {point.parameters["error_kind"] for point in drawn}
    kinds = [kind for kind in KINDS if kind in found and kind != MODEL] or [NUMERICAL]
    columns = [scene for scene in scenes if in_scene(drawn, scene)] or list(scenes[:1])
    families = list(dict.fromkeys(point.family for point in points))

    def draw(ax: Any, r: int, c: int, handles: dict[str, Any]) -> Labels:
        ax.set_title(f"{columns[c]}\n{KINDS[kinds[r]]}", fontsize=9, loc="left", parse_math=False)
        ax.set_ylabel(f"largest of the outputs' errors\n{ERROR}", fontsize=8)
        ax.set_xlabel(COST, fontsize=8)
        shown = [p for p in in_scene(drawn, columns[c]) if p.parameters["error_kind"] == kinds[r]]
        return plot_overall(ax, shown, families, handles)

    return _figure((6.8 * len(columns) + 1.8, 4.6 * len(kinds) + 0.6), (len(kinds), len(columns)), draw, 8)


def _figure(
    size: tuple[float, float], shape: tuple[int, int], draw: Callable[..., Labels], fontsize: int, title: str = ""
) -> Any:
    """Make a figure of axes by ``draw(ax, row, column, handles)``, with a common legend and labelled points."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=130, layout="constrained")
    axes = figure.subplots(*shape, squeeze=False, sharex="col" if title else False)
    handles: dict[str, Any] = {}
    labels = [(axes[r][c], draw(axes[r][c], r, c, handles)) for c in range(shape[1]) for r in range(shape[0])]
    figure.legend(list(handles.values()), list(handles), loc="outside right upper", fontsize=fontsize, frameon=False)
    if title:
        figure.suptitle(title, fontsize=11, x=0.01, ha="left")
    name_points(figure, labels)
    return figure


def plot_overall(ax: Any, points: Sequence[Point], families: Sequence[str], handles: dict[str, Any]) -> Labels:
    """Draw the largest errors over cost, families by colour, other solvers hollow, and the front through the best.

    Returns the numbers that refer to the list of the front.
    """
    for k, family in enumerate(families):
        for hollow in (False, True):
            chosen = [p for p in points if p.family == family and bool(p.solver) == hollow]
            if not chosen:
                continue
            face = {"mfc": "none"} if hollow else {}
            name = f"{family}: other solvers" if hollow else family
            (handles[name],) = ax.plot(
                [_cost(p) for p in chosen], [_worst(p) for p in chosen], ls="none", marker=MARKS[k % len(MARKS)],
                color=f"C{k}", ms=5, **face,
            )  # fmt: skip
    front = sorted((p for p in points if p.pareto), key=_cost)
    if front:
        (handles["Pareto front"],) = ax.plot(
            [_cost(p) for p in front], [_worst(p) for p in front], color="black", lw=1.2, alpha=0.7, zorder=0
        )
    _finish(ax, points, _cost, _worst, handles)
    named = [f"{k}  {_named(p)}" for k, p in enumerate(front, 1)]
    ax.text(1.02, 1.0, "\n".join(["Pareto front", *named]), transform=ax.transAxes, fontsize=6.5, va="top")
    return [(_cost(p), _worst(p), str(k)) for k, p in enumerate(front, 1)]


def _named(point: Point) -> str:
    """Return the label of a point among points of other families."""
    family = "" if point.parameters["error_kind"] == NUMERICAL else f"{point.family}: "
    return f"{family}{point.label}{' (default)' if point.parameters.get('default') else ''}"


def _drawn(point: Point) -> bool:
    return point.usable and (point.worst or 0.0) < FARTHEST


def _cost(point: Point) -> float:
    return point.seconds_per_simulated_second or LEAST


def _level(point: Point, output: str) -> float:
    return max(point.error[output] or 0.0, LEAST)


def _worst(point: Point) -> float:
    return max(point.worst or 0.0, LEAST)


def name_points(figure: Any, wanted: Sequence[tuple[Any, Labels]], fontsize: float = 6.5) -> None:
    """Write labels next to points after layout; a label that would overlap is left out."""
    from matplotlib.transforms import Bbox

    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for ax, labels in wanted:
        at = ax.transData.transform([(x, y) for line in ax.lines for x, y in line.get_xydata()])
        frame = ax.get_window_extent()
        taken = [Bbox.from_extents(x - MARK, y - MARK, x + MARK, y + MARK) for x, y in at]
        for x, y, text in sorted(labels):
            for dx, dy in PLACES:
                note = ax.annotate(
                    text, (x, y), textcoords="offset points", xytext=(dx, dy), fontsize=fontsize,
                    color="#333",
                    ha="left" if dx > 0 else "right",
                )  # fmt: skip
                box = note.get_window_extent()
                inside = frame.contains(box.x0, box.y0) and frame.contains(box.x1, box.y1)
                if inside and not any(box.overlaps(other) for other in taken):
                    taken.append(box)
                    if max(abs(dx), abs(dy)) > FAR:
                        line = {"arrowstyle": "-", "lw": 0.4, "color": "#777"}
                        ax.annotate("", (x, y), textcoords="offset points", xytext=(dx, dy + 2), arrowprops=line)
                    break
                note.remove()


def _finish(
    ax: Any, points: Sequence[Point], x: Callable[[Point], float], y: Callable[[Point], float], handles: dict[str, Any]
) -> None:
    """Ring the default settings, and set logarithmic axes, with plain numbers for small ranges."""
    from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

    ax.set(xscale="log", yscale="log")
    for point in points:
        if point.parameters.get("default"):
            (handles["default settings"],) = ax.plot(x(point), y(point), "o", ms=13, mfc="none", mec="black", ls="none")
    ax.margins(x=0.22, y=0.12)
    ax.autoscale_view()
    low, high = ax.get_xlim()
    decades = high / low < 30.0
    ax.xaxis.set_major_locator(LogLocator(10.0, subs=(1.0, 2.0, 5.0) if decades else (1.0,)))
    if decades:
        ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    else:
        ax.xaxis.set_major_formatter(LogFormatterSciNotation())
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.tick_params(labelsize=7)
    ax.grid(which="both", alpha=0.2)
