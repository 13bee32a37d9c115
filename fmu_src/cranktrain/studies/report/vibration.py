"""Sections of a report on torsional and axial vibration: charts and tables of run-ups."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.results.columns import NOTHING
from cranktrain.results.orders.deviations import deviation_table, deviations, of_another_engine
from cranktrain.results.orders.measured import band_of
from cranktrain.results.orders.measured_points import motion_of, points_at, reach_of
from cranktrain.results.orders.resonances import Peak
from cranktrain.results.run_up.plot_data import PARTS, drowned
from cranktrain.results.run_up.run_up import (
    AXIAL,
    FLYWHEEL,
    LARGEST,
    LEAST,
    MEAN,
    TORSION,
    TWIST,
    RunUp,
    frequency_map,
    half_range,
    order_map,
)
from cranktrain.results.tables import Table
from cranktrain.studies.report.chart import NAMED, Switches, bar_chart, line_chart, map_chart
from cranktrain.studies.report.elements import paragraph, table
from cranktrain.studies.report.findings import Asked, Findings, Torsion
from cranktrain.studies.run_up.report import closing_text

NEXT = 0.12
"""Relative difference below which two speeds count as neighbours; only one of their cycles is shown."""
SHOWN_CYCLES = 4
"""Largest number of speeds whose cycles are drawn."""
SAMPLES, MARKS = 720, 48
"""Number of points of a computed curve over a cycle, and of a measured one."""
LEAST_UM = 1e-6
"""Axial motion below this counts as zero, as for an engine on ground."""
MAP_COLUMNS, MAP_ROWS = 240, 200
"""Number of pixels of a colour map."""
ALL_ORDERS = "all orders, half of peak to peak"
HIGHEST_BAR = 12.0
"""Highest order in bar charts."""


def torsion(found: Findings) -> list[str]:
    """Torsional orders over the speed without damper, and its peaks."""
    if found.torsion is None:
        return []
    how = found.torsion.run_up.attributes["steady"]
    note = (
        f"Torsional crank on journals that are locked on their axis, in the frequency domain ({how}). "
        f"Amplitudes are zero to peak.{_own_mode(found, found.torsion)}"
    )
    run = found.torsion.run_up
    parts = [paragraph(note), *_beside(found, run, TORSION, "without damper"), table(_peaks(found.torsion))]
    maps = _maps(found, run, "without damper")
    firing = f"{found.engine.firings:g}"
    text = (
        "Torsion is the pulley's rotation against a steady turn, as it is measured there. Low orders at low speeds, "
        f"above all order {firing} of the firings, are uneven rotation of the crank as a whole under the gas torque, "
        "which falls with the square of the speed. The twist from pulley to flywheel, below, is what strains the crank."
    )
    if found.engine.n_cylinders == 6 and len(found.engine.crankshaft.throw_angles) == 6:
        text += " Orders 1.5 and 4.5 twist the front half of an in-line six against its rear half, below resonance."
    return [*parts, paragraph(text), *_twist(found, run, "without damper"), *maps]


def _own_mode(found: Findings, made: Torsion) -> str:
    """Sentence on the difference of this crank's first torsional mode from the solid crank's; empty if unknown."""
    own = next((peak.mode_hz for peak in made.peaks if peak.kind == "torsional"), None)
    rest = None if found.modes is None else found.modes["cranktrain"]["first_torsional_hz"]
    if own is None or rest is None:
        return ""
    source = found.engine.reduction.torsional_source
    why = _SOURCES.get(source, f"because its shafts have the stiffness of a formula, {source}")
    return (
        f" The first torsional mode of this crank is at {own:.1f} Hz, that of the solid crank at rest at {rest:.1f} "
        f"Hz, {why}."
    )


_SOURCES = dict.fromkeys(
    ("solid", "solid-on-bearings"), "because this crank twists without bending and its journals cannot move"
) | {"solid-in-motion": "because this crank is fitted to the solid one with its journals locked, as films lock them"}
"""Reasons why the torsional crank's frequency differs from the solid crank's, by the source of stiffnesses."""


def damper(found: Findings) -> list[str]:
    """Torsional orders over the speed with the damper, and its reduction of the amplitudes."""
    if found.damped is None or found.torsion is None:
        return []
    before, after = found.torsion.run_up, found.damped.run_up
    note = (
        "Same crank, with its damper. Modes are those of the crank with the damper's ring, at the damping that it has "
        "at the peak: the fluid drags the ring along, so they lie below those without."
    )
    return [
        paragraph(note), *_beside(found, after, TORSION, "with damper"), table(_peaks(found.damped)),
        *_twist(found, after, "with damper"),
        table(_taken_off(before, after, "")),
    ]  # fmt: skip


def torsion_cycles(found: Findings) -> list[str]:
    """Torsion over a cycle at the critical speeds."""
    if found.torsion is None:
        return []
    run = found.torsion.run_up
    resonances = sorted(found.torsion.peaks, key=lambda peak: peak.kind != "torsional")
    speeds = _apart(
        [peak.speed for peak in resonances]
        or [float(run.speeds[np.nan_to_num(np.abs(run.torsion)).max(axis=1).argmax()])]
    )
    return [draw(found, run, TORSION, speeds) for draw in (_cycles, _bars)]


def whole_torsion(found: Findings) -> list[str]:
    """Torsional orders of the run-up from the user or a folder."""
    run, damped = found.run_up, found.damped_run_up
    parts = []
    if run is not None:
        parts += [paragraph(_levels(run)), *_beside(found, run, TORSION, "run-up"), *_twist(found, run, "run-up")]
    if damped is not None:
        parts += [paragraph(_levels(damped)), *_beside(found, damped, TORSION, "run-up with damper")]
    if run is not None and damped is not None:
        parts.append(table(_taken_off(run, damped, ", run-ups")))
    return parts


def axial(found: Findings) -> list[str]:
    """Axial orders over the speed, extremes, and cycles at the speeds of the largest ones."""
    run = found.run_up
    if run is None or AXIAL not in run.amplitudes:
        return []
    parts = [paragraph(_levels(run)), *_beside(found, run, AXIAL, "run-up")]
    if AXIAL in run.extremes:
        names = {"largest": LARGEST, "mean": MEAN, "least": LEAST}
        curves = {name: 1e6 * run.extremes[AXIAL][:, column] for name, column in names.items()}
        title = "Axial motion of the pulley over a cycle: largest, mean and least"
        parts.append(line_chart(title, run.speeds_rpm, curves, ("speed / rev/min", "axial motion / µm")))
    total = np.sqrt((np.abs(run.axial) ** 2).sum(axis=1))
    largest = _apart(run.speeds[np.argsort(-total)].tolist())
    parts += [_cycles(found, run, AXIAL, largest), _bars(found, run, AXIAL, largest)]
    if all(output in run.amplitudes for output in PARTS.values()):
        row = int(np.abs(run.speeds - largest[0]).argmin())
        keep = run.orders <= HIGHEST_BAR
        sizes = {_PART_NAMES[part]: 1e6 * np.abs(run.amplitudes[name][row][keep]) for part, name in PARTS.items()}
        bars = {name: size for name, size in sizes.items() if size.max() > LEAST_UM}
        title = f"Parts of the axial motion at {run.speeds_rpm[row]:.0f} rev/min; as vectors they add up to the whole"
        parts.append(bar_chart(title, run.orders[keep], bars, ("order", "zero to peak / µm")))
    return parts


def _beside(found: Findings, run: RunUp, output: str, words: str) -> list[str]:
    """Chart of an output's orders over the speed, with measured orders."""
    measured = {order: points for order, points in found.measured.get(output, {}).items() if order in run.orders}
    chart = _orders(found.asked, run, output, words, measured=_with_bands(found, output, measured))
    if not measured:
        return [chart]
    rows = [row for row in deviations(run, found.measured) if row["output"] == output]
    doubt = of_another_engine(rows)
    return [
        chart, table(_measured(run, output, measured)), *([table(deviation_table(rows))] if rows else []),
        *([paragraph(doubt[0].upper() + doubt[1:] + ".")] if doubt else []),
    ]  # fmt: skip


def _with_bands(
    found: Findings, output: str, measured: Mapping[float, tuple[Array, Array]]
) -> dict[float, tuple[Array, Array, Array]]:
    """Measured orders of an output with half widths of their bands, zero if unknown."""
    bands = {order: band_of(found.measured, output, order) for order in measured}
    return {
        order: (*points, np.zeros(points[0].size) if (band := bands[order]) is None else np.nan_to_num(band))
        for order, points in measured.items()
    }


def _measured(run: RunUp, output: str, measured: Mapping[float, tuple[Array, Array]]) -> Table:
    """Table of the largest measured amplitude of each order, and the computed one at the same speed."""
    scale, unit, what = _UNITS[output]
    rows = []
    for order, (speeds, amplitudes) in measured.items():
        k = int(amplitudes.argmax())
        computed = np.interp(speeds[k], run.speeds, np.abs(run.order(order, output)), math.nan, math.nan)
        texts = f"{order:g}", f"{speeds[k] / RPM:.0f}", f"{scale * amplitudes[k]:.3g}"
        if amplitudes[k] > 0.0 and math.isfinite(computed):
            off = 100.0 * (computed / amplitudes[k] - 1.0)
            rows.append((*texts, f"{scale * computed:.3g}", f"{off:+z.0f} %"))
        else:
            rows.append((*texts, NOTHING, NOTHING))
    header = ("order", "largest measured at / rev/min", f"measured / {unit}", f"computed there / {unit}", "off")
    return Table(f"{what} of the pulley, measured and computed", header, tuple(rows))


def _orders(
    asked: Asked,
    run: RunUp,
    output: str,
    words: str,
    what: str = "",
    measured: Mapping[float, tuple[Array, Array, Array]] | None = None,
    whole: bool = False,
) -> str:
    """Chart of an output's orders over the speed, with names for the requested, or the strongest and measured, orders.

    An order has the same colour on all charts. ``whole``: with half of the peak-to-peak value of all orders together.
    """
    scale, unit, name = _UNITS[output]
    measured = measured or {}
    ranked = sorted(_strongest(run, output), key=lambda order: order not in measured)
    shown = [*sorted(ranked[:NAMED]), *ranked[NAMED:]]
    chosen = sorted(order for order in asked.orders if order in run.orders)
    shown, named = (chosen, len(chosen)) if chosen else (shown, min(NAMED, len(shown)))
    curves = {f"order {order:g}": scale * np.abs(run.order(order, output)) for order in shown}
    colours = [_COLOURS[round(2.0 * order) % len(_COLOURS)] for order in shown]
    if whole:
        curves = {ALL_ORDERS: scale * half_range(run, run.amplitudes[output]), **curves}
        colours, named = ["black", *colours], named + 1
    title = f"{what or name + ' of the pulley'}, orders over the speed, {words}"
    points = {
        f"order {order:g}": (speeds / RPM, scale * sizes, scale * bands)
        for order, (speeds, sizes, bands) in measured.items()
    }
    labels = "speed / rev/min", f"zero to peak / {unit}"
    log = drowned(run, output, chosen) if asked.log is None else asked.log
    return line_chart(
        title, run.speeds_rpm, curves, labels, colours=colours, switches=Switches(log, asked.peak_to_peak),
        points={name: values for name, values in points.items() if name in curves}, named=named,
    )  # fmt: skip


def _twist(found: Findings, run: RunUp, words: str) -> list[str]:
    """Chart of the twist from pulley to flywheel, if the run-up has both."""
    if FLYWHEEL not in run.amplitudes:
        return []
    measured = {order: points for order, points in found.measured.get(TWIST, {}).items() if order in run.orders}
    marks, title = _with_bands(found, TWIST, measured), "Twist from pulley to flywheel"
    parts = [_orders(found.asked, _twisting(run), TORSION, words, title, measured=marks, whole=True)]
    rows = [row for row in deviations(run, found.measured) if row["output"] == TWIST]
    return [*parts, *([table(deviation_table(rows))] if rows else [])]


def _maps(found: Findings, run: RunUp, words: str) -> list[str]:
    """Colour maps of orders and frequencies over the speed: of the twist, or of the pulley's torsion without it."""
    what, shown = "Torsion of the pulley", run
    if FLYWHEEL in run.amplitudes:
        what, shown = "Twist from pulley to flywheel", _twisting(run)
    scale, unit, _ = _UNITS[TORSION]
    speeds = np.linspace(run.speeds[0], run.speeds[-1], MAP_COLUMNS)
    first = ((found.modes or {}).get("cranktrain") or {}).get("first_torsional_hz") or 0.0
    excited = float(run.orders[-1] * run.speeds[-1]) / (2.0 * math.pi)
    hz = np.linspace(0.0, min(excited, 1.5 * first or excited), MAP_ROWS)
    maps = (
        ("orders", "order", shown.orders, order_map(shown, TORSION, speeds)),
        ("frequencies", "frequency / Hz", hz, frequency_map(shown, TORSION, speeds, hz)),
    )
    return [
        map_chart(
            f"{what}, {name} over the speed as colours, {words}", speeds / RPM, y, scale * values,
            ("speed / rev/min", label, f"{unit}, zero to peak"),
        )
        for name, label, y, values in maps
    ]  # fmt: skip


def _twisting(run: RunUp) -> RunUp:
    """The run-up with the twist from pulley to flywheel in place of the pulley's torsion."""
    return replace(run, amplitudes={TORSION: run.amplitudes[TORSION] - run.amplitudes[FLYWHEEL]})


def _taken_off(before: RunUp, after: RunUp, words: str) -> Table:
    """Largest amplitudes of the orders over the speed without and with the damper, of the pulley and of the twist."""
    kinds = {"pulley": [before, after]}
    if all(FLYWHEEL in run.amplitudes for run in (before, after)):
        kinds["twist"] = [_twisting(run) for run in (before, after)]
    header = ["order"]
    for name in kinds:
        header += [f"{name} without / deg", "with / deg", "change"]
    rows = []
    for order in _strongest(before, TORSION)[:NAMED]:
        texts = [f"{order:g}"]
        for pair in kinds.values():
            one, other = (math.degrees(np.nan_to_num(np.abs(run.order(order))).max()) for run in pair)
            texts += [f"{one:.3g}", f"{other:.3g}", f"{100.0 * (other / one - 1.0):+.0f} %"]
        rows.append(tuple(texts))
    return Table(
        f"Largest amplitude over the speed range, without and with the damper{words}", tuple(header), tuple(rows)
    )


def _apart(speeds: list[float]) -> list[float]:
    """Speeds (rad/s) without later ones that are neighbours of an earlier one."""
    kept: list[float] = []
    for speed in speeds:
        if all(abs(speed / other - 1.0) > NEXT for other in kept):
            kept.append(speed)
    return kept


def _bars(found: Findings, run: RunUp, output: str, speeds: Iterable[float]) -> str:
    """Chart of an output's orders at the speeds of :func:`_cycles`."""
    scale, unit, what = _UNITS[output]
    keep = run.orders <= HIGHEST_BAR
    rows = sorted(_rows(run, speeds))
    names = {k: f"{run.speeds_rpm[k]:.0f} rev/min" for k in rows}
    bars = {name: scale * np.abs(run.amplitudes[output][k][keep]) for k, name in names.items()}
    points = {}
    for k, name in names.items():
        values = np.full((2, np.count_nonzero(keep)), math.nan)
        for point in points_at(found.measured, output, float(run.speeds[k]), reach_of(run.speeds)):
            values[:, run.orders[keep] == point.order] = scale * np.array([[point.amplitude], [point.band]])
        if np.isfinite(values[0]).any():
            points[name] = values[0], values[1]
    title = f"{what} of the pulley, orders at these speeds"
    return bar_chart(title, run.orders[keep], bars, ("order", f"zero to peak / {unit}"), points)


def _rows(run: RunUp, speeds: Iterable[float]) -> list[int]:
    """Rows of a run-up at the speeds nearest to the first given speeds."""
    return list(dict.fromkeys(int(np.abs(run.speeds - speed).argmin()) for speed in speeds))[:SHOWN_CYCLES]


def _cycles(found: Findings, run: RunUp, output: str, speeds: Iterable[float]) -> str:
    """Chart of an output over a cycle, at the speeds of the run-up nearest to the first given speeds."""
    scale, unit, what = _UNITS[output]
    rows = _rows(run, speeds)
    angle = np.linspace(0.0, 4.0 * math.pi, SAMPLES + 1).astype(np.float64)
    names = {k: f"{run.speeds_rpm[k]:.0f} rev/min" for k in sorted(rows)}
    curves = {name: scale * cycle(run, output, k, angle) for k, name in names.items()}
    points = {}
    marked = angle[:: SAMPLES // MARKS]
    for k, name in names.items():
        near = points_at(found.measured, output, float(run.speeds[k]), reach_of(run.speeds))
        if (own := motion_of(near, marked)) is not None:
            points[name] = np.degrees(marked), scale * own[0], np.full(marked.size, scale * own[1])
    title = f"{what} of the pulley about its mean over a cycle, where it is largest"
    return line_chart(title, np.degrees(angle), curves, ("crank angle / deg", f"{what.lower()} / {unit}"), 120.0,
                      points=points)  # fmt: skip


def cycle(run: RunUp, output: str, row: int, angle: Array) -> Array:
    """One speed's cycle about its mean at crank angles (n,) rad, from its orders, in the output's unit."""
    turn = np.exp(1j * np.outer(angle, run.orders))
    return np.asarray((turn @ run.amplitudes[output][row]).real)


def _strongest(run: RunUp, output: str) -> list[float]:
    """Orders, those of the largest amplitudes over the speed first."""
    return [
        float(order) for order in run.orders[np.argsort(-np.nan_to_num(np.abs(run.amplitudes[output])).max(axis=0))]
    ]


def _peaks(found: Torsion) -> Table:
    """Table of peaks and of the critical speeds of modes at rest, with journals locked on their axis."""
    header = ("order", "peak at / rev/min", "amplitude / deg", "Hz", "at rest / Hz", "critical / rev/min", "off")
    return Table("Resonances and the critical speeds of the modes at rest", header, tuple(map(_peak, found.peaks[:10])))


def _peak(peak: Peak) -> tuple[str, ...]:
    mode = 3 * (NOTHING,)
    if math.isfinite(peak.mode_hz):
        off = 100.0 * (peak.speed / peak.critical_speed - 1.0)
        mode = f"{peak.kind} {peak.mode_hz:.1f}", f"{peak.critical_speed / RPM:.0f}", f"{off:+z.1f} %"
    size = f"{math.degrees(peak.amplitude):.3g}"
    return (f"{peak.order:g}", f"{peak.speed / RPM:.0f}", size, f"{peak.hz:.1f}", *mode)


def _levels(run: RunUp) -> str:
    """Settings of the run-up."""
    names = ("crank", "bearings", "big_ends", "block", "pistons", "damper", "integrator")
    said = ", ".join(f"{name.replace('_', ' ')} {run.attributes[name]}" for name in names if name in run.attributes)
    speeds = run.speeds_rpm
    settled = f" {closing_text(run).capitalize()}." if run.cycles.any() else ""
    return f"Run-up from {speeds[0]:.0f} to {speeds[-1]:.0f} rev/min: {said}.{settled}"


_COLOURS = (
    "#444e5a", "#d9822b", "#a8a018", "#3b8f3b", "#1b9aa0", "#8a6d3b", "#7b52ab", "#c2459a", "#2d6a4f", "#14304f",
    "#e0607e", "#8c3b1f", "#b5373b", "#5f6b73", "#4a90d9", "#1f5a94", "#5b8c1f",
)  # fmt: skip
"""Colours of orders 0, 0.5, … on all charts, used in turn."""
_PART_NAMES = {
    "crank": "the crank's own vibration",
    "bearing": "the collar in its clearance",
    "engine": "the engine on its mounts",
}
_UNITS = {TORSION: (180.0 / math.pi, "deg", "Torsion"), AXIAL: (1e6, "µm", "Axial motion")}
"""Scale, unit and name of each drawn output."""
