"""The register of a report's sections: each is one row and one function that makes it or finds nothing to show."""

from __future__ import annotations

import base64
import html
import math
import platform
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain import __version__
from cranktrain.results.orders.resonances import Peak
from cranktrain.results.run_up.run_up import AXIAL, LARGEST, LEAST, MEAN, TORSION, RunUp
from cranktrain.results.tables import NOTHING, Table, cranktrain_table, critical_speed_table, free_table
from cranktrain.studies.report.chart import NAMED, line_chart
from cranktrain.studies.report.findings import Findings, Torsion

Array = NDArray[np.float64]

RPM = 30.0 / math.pi
SHOWN_CYCLES = 3
"""Speeds whose cycle is drawn."""
SAMPLES = 720


class Section(NamedTuple):
    """Section of a report.

    ``make`` returns its parts as HTML, or nothing where what it needs is missing; ``command`` then says what makes it,
    with ``{}`` for the engine.
    """

    title: str
    make: Callable[[Findings], list[str]]
    command: str = ""
    six: str = ""
    eight: str = ""
    """Tables and figures of the reference that it stands beside, of the in-line six and of the V8."""

    def reference(self, engine: str) -> str:
        """What of the reference it stands beside; empty for engines that the reference does not have."""
        return {"diesel_i6": self.six, "diesel_v8": self.eight}.get(engine, "")


def frequencies(found: Findings) -> list[str]:
    """Natural frequencies beside the published ones."""
    parts = [
        free_table(found.engine, found.modes["crankshaft_free"]),
        cranktrain_table(found.engine, found.modes["cranktrain"]),
    ]
    error = found.modes["reduction"]["max_relative_error"]
    quality = (
        f"Finite elements: {found.modes['reduction']['dofs_full']} degrees of freedom reduced to "
        f"{found.modes['reduction']['modes']} modes, largest error to 1000 Hz {100.0 * error:.2g} %."
    )
    return [*map(table, parts), paragraph(quality)]


def critical_speeds(found: Findings) -> list[str]:
    """Critical speeds of the first torsional mode beside the published ones."""
    return [table(critical_speed_table(found.engine, found.modes["critical_speeds"]))]


def torsion(found: Findings) -> list[str]:
    """Torsional orders over the speed without damper, and its peaks."""
    how = found.torsion.run_up.attributes["steady"]
    note = (
        f"Torsional crank on journals that are locked on their axis, in the frequency domain ({how}). "
        "Amplitudes are zero to peak."
    )
    return [paragraph(note), _orders(found.torsion.run_up, TORSION, "without damper"), table(_peaks(found.torsion))]


def damper(found: Findings) -> list[str]:
    """The same with the damper, and what it takes off."""
    if found.damped is None:
        return []
    before, after = found.torsion.run_up, found.damped.run_up
    rows = []
    for order in _strongest(before, TORSION)[:NAMED]:
        one, other = (math.degrees(np.abs(run.order(order)).max()) for run in (before, after))
        rows.append((f"{order:g}", f"{one:.3g}", f"{other:.3g}", f"{100.0 * (other / one - 1.0):+.0f} %"))
    header = ("order", "without / deg", "with / deg", "change")
    return [
        _orders(after, TORSION, "with damper"),
        table(Table("Largest amplitude over the speed range, without and with the damper", header, tuple(rows))),
        table(_peaks(found.damped)),
    ]


def torsion_cycles(found: Findings) -> list[str]:
    """Torsion over a cycle at the critical speeds."""
    speeds = [peak.speed for peak in found.torsion.peaks]
    return [_cycles(found.torsion.run_up, TORSION, speeds)]


def whole_torsion(found: Findings) -> list[str]:
    """Torsional orders of the run-up that was given."""
    run = found.run_up
    return [] if run is None else [paragraph(_levels(run)), _orders(run, TORSION, "run-up")]


def axial(found: Findings) -> list[str]:
    """Axial orders over the speed, extremes, and cycles where they are largest."""
    run = found.run_up
    if run is None or AXIAL not in run.amplitudes:
        return []
    parts = [paragraph(_levels(run)), _orders(run, AXIAL, "run-up")]
    if AXIAL in run.extremes:
        names = {"largest": LARGEST, "mean": MEAN, "least": LEAST}
        curves = {name: 1e6 * run.extremes[AXIAL][:, column] for name, column in names.items()}
        title = "Axial motion of the pulley over a cycle: largest, mean and least"
        parts.append(line_chart(title, run.speeds_rpm, curves, ("speed / rev/min", "axial motion / µm")))
    total = np.sqrt((np.abs(run.axial) ** 2).sum(axis=1))
    return [*parts, _cycles(run, AXIAL, run.speeds[np.argsort(-total)].tolist())]


def provenance(found: Findings) -> list[str]:
    """Every value of the engine file with its origin; what was calibrated stands first."""
    rows = [(key, _value(value), unit, origin, note) for key, value, unit, origin, note in found.origins]
    fitted = tuple(row for row in rows if row[3] == "calibrated")
    header = ("value", "", "unit", "origin", "note")
    counts = ", ".join(
        f"{sum(row[3] == origin for row in rows)} {origin}" for origin in dict.fromkeys(r[3] for r in rows)
    )
    everything = table(Table(f"All values of {found.engine.name}", header, tuple(rows)))
    parts = [paragraph(f"Of {len(rows)} values {counts}.")]
    parts += [table(Table("Calibrated values and the numbers they were fitted to", header, fitted))] if fitted else []
    return [*parts, f"<details><summary>All {len(rows)} values</summary>{everything}</details>"]


def run_time(found: Findings) -> list[str]:
    """What the report took, and where."""
    rows = [(what, f"{seconds:.1f}") for what, seconds in found.seconds.items()]
    if found.run_up is not None and "seconds" in found.run_up.attributes:
        rows.append(("run-up that was given", f"{float(found.run_up.attributes['seconds']):.1f}"))
    where = f"Cranktrain {__version__}, Python {platform.python_version()}, {platform.machine()}."
    return [table(Table("Wall time", ("stage", "s"), tuple(rows))), paragraph(where)]


def pictures(*shown: tuple[str, str]) -> Callable[[Findings], list[str]]:
    """Maker of a section of pictures by their file names, each with what it shows."""

    def make(found: Findings) -> list[str]:
        there = [(found.pictures[name], words) for name, words in shown if name in found.pictures]
        return [picture(path.read_bytes(), words) for path, words in there]

    return make


STABILITY = (
    "oil_whirl", "cold_start", "step_film_stiffness", "variable_inertia", "rotating_damping", "mode_truncation",
    "contact_ringing", "cosimulation",
)  # fmt: skip
SECTIONS = (
    Section("Natural frequencies", frequencies, six="table 7.1", eight="table 7.3"),
    Section("Critical speeds", critical_speeds, six="table 7.2", eight="table 7.4"),
    Section("Torsional vibration over the speed range", torsion, six="figures 7.2 and 7.3", eight="figure 7.8"),
    Section("With the torsional damper", damper, "add [damper] to the engine file", eight="figure 7.9"),
    Section("Torsion over a cycle at critical speeds", torsion_cycles, six="figure 7.1"),
    Section(
        "Torsional vibration with films", whole_torsion,
        "cranktrain runup {0}, then cranktrain report {0} --run-up FILE", "figures 7.2 and 7.3", "figure 7.8",
    ),
    Section(
        "Axial vibration of the pulley", axial, "cranktrain runup {0}, then cranktrain report {0} --run-up FILE",
        "figures 7.4 to 7.6",
    ),
    Section(
        "Run-up in pictures",
        pictures(
            ("torsion_orders.png", "Torsional orders over the speed, resonances with their orders and modes"),
            ("waterfall.png", "Waterfall: orders over speed and frequency"),
            ("campbell.png", "Campbell diagram: modes over the speed, crossed by orders"),
            ("axial_orders.png", "Axial orders over the speed"),
            ("axial_harmonics.png", "Orders of the axial motion and of its parts at its peaks"),
            ("damper.png", "Torsional orders over the speed without and with the damper"),
        ),
        "cranktrain plot-runup FILE --plots FOLDER, then cranktrain report {0} --pictures FOLDER",
    ),
    Section(
        "Stress of the crankshaft",
        pictures(
            ("stresses.png", "Von Mises stress of the crankshaft's surface every 90 degrees of crank angle"),
            ("stress_envelope.png", "Greatest von Mises stress of each place over the cycle"),
        ),
        "cranktrain stress {0} --speed 2200 --plots FOLDER, then cranktrain report {0} --pictures FOLDER", "figure 7.7",
    ),
    Section(
        "Bearings",
        pictures(
            ("orbits.png", "Orbits of the journals in their clearance circles over a cycle"),
            ("least_films.png", "Least oil film of each bearing over a cycle"),
        ),
        "cranktrain simulate {0} --speed 2000 --plots FOLDER, then cranktrain report {0} --pictures FOLDER",
    ),
    Section(
        "Fatigue of the crankshaft",
        pictures(
            ("safety_factors.png", "Safety factor of each fillet on a side view of the crankshaft"),
            ("haigh.png", "Haigh diagram: stress amplitude over mean stress of the fillets"),
        ),
        "cranktrain fatigue {0} --plots FOLDER, then cranktrain report {0} --pictures FOLDER",
    ),
    Section(
        "Accuracy against speed of computation",
        pictures(("overall.png", "Error over cost of methods, levels and resolutions, with the Pareto front")),
        "cranktrain tradeoff --output FOLDER, then cranktrain report {0} --pictures FOLDER",
    ),
    Section(
        "Where methods fail",
        pictures(*((f"{name}.png", f"Stability map: {name.replace('_', ' ')}") for name in STABILITY)),
        "cranktrain stability --output FOLDER, then cranktrain report {0} --pictures FOLDER",
    ),
    Section("Values and their origins", provenance),
    Section("Run time", run_time),
)  # fmt: skip
"""The register, in the order of the report."""


def paragraph(text: str) -> str:
    """A paragraph of plain text."""
    return f"<p>{html.escape(text)}</p>"


def table(content: Table) -> str:
    """A table of texts; columns of words stand to the left, of numbers to the right."""
    words = ["" if all(map(_numeric, column)) else ' class="words"' for column in zip(*content.rows, strict=True)]
    words = words or [""] * len(content.header)

    def cells(kind: str, row: Sequence[str]) -> str:
        pairs = zip(words, row, strict=True)
        return "<tr>" + "".join(f"<{kind}{how}>{html.escape(text)}</{kind}>" for how, text in pairs) + "</tr>"

    title = html.escape(content.title)
    body = "".join(cells("td", row) for row in content.rows)
    inside = f"<thead>{cells('th', content.header)}</thead><tbody>{body}</tbody>"
    return f'<p class="caption">{title}</p><div class="scroll"><table aria-label="{title}">{inside}</table></div>'


def _numeric(text: str) -> bool:
    """Whether a cell is a number, with or without a per cent sign, or a dash for none."""
    try:
        float(text.removesuffix("%").strip() or "0")
    except ValueError:
        return text == NOTHING
    return True


def picture(png: bytes, words: str) -> str:
    """A picture, inside the page."""
    source = base64.b64encode(png).decode("ascii")
    said = html.escape(words)
    return f'<figure><img alt="{said}" src="data:image/png;base64,{source}"><figcaption>{said}</figcaption></figure>'


def _orders(run: RunUp, output: str, words: str) -> str:
    """Chart of an output's orders over the speed, the strongest named."""
    scale, unit, what = _UNITS[output]
    ranked = _strongest(run, output)
    shown = [*sorted(ranked[:NAMED]), *ranked[NAMED:]]
    curves = {f"order {order:g}": scale * np.abs(run.order(order, output)) for order in shown}
    title = f"{what} of the pulley, orders over the speed, {words}"
    return line_chart(title, run.speeds_rpm, curves, ("speed / rev/min", f"zero to peak / {unit}"))


def _cycles(run: RunUp, output: str, speeds: Iterable[float]) -> str:
    """Chart of an output over a cycle at the speeds of the run-up next to the first of those given."""
    scale, unit, what = _UNITS[output]
    rows = list(dict.fromkeys(int(np.abs(run.speeds - speed).argmin()) for speed in speeds))[:SHOWN_CYCLES]
    angle = np.linspace(0.0, 4.0 * math.pi, SAMPLES + 1).astype(np.float64)
    names = {k: f"{run.speeds_rpm[k]:.0f} rev/min" for k in sorted(rows)}
    curves = {name: scale * cycle(run, output, k, angle) for k, name in names.items()}
    title = f"{what} of the pulley about its mean over a cycle, where it is largest"
    return line_chart(title, np.degrees(angle), curves, ("crank angle / deg", f"{what.lower()} / {unit}"), 120.0)


def cycle(run: RunUp, output: str, row: int, angle: Array) -> Array:
    """One speed's cycle about its mean at crank angles (n,) rad, from its orders, in the output's unit."""
    turn = np.exp(1j * np.outer(angle, run.orders))
    return np.asarray((turn @ run.amplitudes[output][row]).real)


def _strongest(run: RunUp, output: str) -> list[float]:
    """Orders, those of the largest amplitudes over the speed first."""
    return [float(order) for order in run.orders[np.argsort(-np.nanmax(np.abs(run.amplitudes[output]), axis=0))]]


def _peaks(found: Torsion) -> Table:
    """Peaks beside the critical speeds of the linear modes."""
    header = ("order", "peak at / rev/min", "amplitude / deg", "Hz", "mode / Hz", "critical / rev/min", "off")
    return Table("Resonances and the critical speeds of the linear modes", header, tuple(map(_peak, found.peaks[:10])))


def _peak(peak: Peak) -> tuple[str, ...]:
    mode = 3 * (NOTHING,)
    if math.isfinite(peak.mode_hz):
        off = 100.0 * (peak.speed / peak.critical_speed - 1.0)
        mode = f"{peak.kind} {peak.mode_hz:.1f}", f"{peak.critical_speed * RPM:.0f}", f"{off:+.1f} %"
    size = f"{math.degrees(peak.amplitude):.3g}"
    return (f"{peak.order:g}", f"{peak.speed * RPM:.0f}", size, f"{peak.hz:.1f}", *mode)


def _levels(run: RunUp) -> str:
    """What the run-up was made with."""
    names = ("crank", "bearings", "big_ends", "block", "pistons", "damper", "integrator")
    said = ", ".join(f"{name.replace('_', ' ')} {run.attributes[name]}" for name in names if name in run.attributes)
    speeds = run.speeds_rpm
    return f"Run-up of {speeds.size} speeds from {speeds[0]:.0f} to {speeds[-1]:.0f} rev/min: {said}."


def _value(value: object) -> str:
    text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    return text if len(text) <= 60 else f"{text[:56]} …"


_UNITS = {TORSION: (180.0 / math.pi, "deg", "Torsion"), AXIAL: (1e6, "µm", "Axial motion")}
"""Scale, unit and name of the outputs that are drawn."""
