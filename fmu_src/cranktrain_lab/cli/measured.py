"""The verb ``measured``: channels of measurement files, rotation from pulses, orders over speed, cylinder pressures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from cranktrain.cli.console import say, show_rows
from cranktrain.cli.functions import verb_alone
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.core.units import RPM
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import POSITIVE, Option, Question, paths, several
from cranktrain_lab.measured.analysis import cylinder_numbers, orders_of, pressures_of, rotations_of
from cranktrain_lab.measured.compression import BAND
from cranktrain_lab.measured.pressure import PEGGING, statistics
from cranktrain_lab.measured.pulses import EDGES
from cranktrain_lab.measured.reading import described, read_measured

if TYPE_CHECKING:
    from cranktrain_lab.measured.channels import Measurement
    from cranktrain_lab.measured.rotation import Rotation

DESCRIPTION = """\
Show and analyse measured signals: channels, rotation from pulses, orders over speed, cylinder pressures.

Files: UFF 58, MDF4, TDMS, WAV, HDF5, MATLAB, Parquet, LabVIEW text, text tables. Without further options the channels
are listed, with units, sampling and the channels that look like pulses.

    cranktrain measured run.mf4
    cranktrain measured run.mf4 --rotation pulley --teeth 60 --missing 2 --orders 0.5-12 --output orders.csv
    cranktrain measured run.mf4 --rotation pulley --teeth 60 --second flywheel --second-teeth 120 --orders 6
    cranktrain measured run.mf4 --pressure p1,p2 --engine diesel_i6 --rotation encoder --teeth 720

Pitch errors of a wheel look like whole orders of constant amplitude. --learn-teeth takes them from a stretch without
torsion (two times in s, e.g. while coasting), or from all of a recording.
"""
HIGHEST = 1000.0
TEETH, GAP = between(1, 100_000, "teeth"), between(0, 50_000, "teeth")
"""Limits of the number of teeth of a wheel, and of the number missing at its gap."""


def names(text: str) -> tuple[str, ...]:
    """Names from a text, separated by commas."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


def stretch(text: str) -> tuple[float, float] | bool:
    """Two times (s) from a text, or True for the text ``all``; ``InputError``."""
    if text == "all":
        return True
    try:
        begin, end = (float(word) for word in text.split(","))
    except ValueError:
        raise InputError(f"'{text}' is neither two times, e.g. 12.5,20, nor 'all'") from None
    if not begin < end:
        raise InputError(f"'{text}' does not rise")
    return begin, end


def order_range(text: str) -> tuple[float, ...]:
    """Orders from a text with single orders or ranges, all multiples of ½; ``InputError``."""
    if not text:
        return ()
    orders: set[float] = set()
    for part in text.split(","):
        low, dash, high = part.partition("-")
        try:
            first, last = float(low), float(high if dash else low)
        except ValueError:
            raise InputError(f"'{text}' is no list of orders; give 0.5-12 or 3,4.5,6") from None
        for order in (first, last):
            if not (0.5 <= order <= HIGHEST and (2.0 * order).is_integer()):
                raise InputError(f"order {order:g} is not a multiple of 0.5 up to {HIGHEST:g}")
        orders |= {0.5 * k for k in range(round(2 * first), round(2 * last) + 1)}
    return tuple(sorted(orders))


@dataclass(frozen=True, kw_only=True)
class RotationOptions(Question):
    """Options for rotation from pulses."""

    heading = "rotation"
    rotation: Annotated[str, Option("CHANNEL", "channel of pulses, or of rising times of pulses")] = ""
    teeth: Annotated[int | None, TEETH, Option(help="teeth a revolution, those missing included")] = None
    missing: Annotated[int | None, GAP, Option(help="teeth missing in the gap (2 for 60-2)")] = None
    edge: Annotated[
        Literal["rising", "falling"] | None,
        Option(help="rising or falling edges (default: rising, unless those beside the gap are wrong)", words=EDGES),
    ] = None
    clock_hz: Annotated[
        float | None,
        POSITIVE,
        Option("HZ", "clock of a counter, where a channel holds times of pulses in ticks"),
    ] = None
    level: Annotated[float | None, Option(help="crossing level in the channel's unit (default: found)")] = None
    learn_teeth: Annotated[
        str | Sequence[float] | bool,
        Option("FROM,TO", "learn pitch errors between two times, s; or 'all'", convert=stretch),
    ] = False
    eccentricity: Annotated[
        Literal["keep", "remove"], Option(help="order 1 of constant size: keep (default) or remove")
    ] = "keep"
    index: Annotated[str, Option("CHANNEL", "once-a-revolution pulse that marks tooth 0")] = ""
    dead_centre_deg: Annotated[
        float,
        between(-720.0, 720.0, "deg"),
        Option(help="angle from tooth 0 to firing dead centre of cylinder 1"),
    ] = 0.0
    firing: Annotated[str, Option("CHANNEL", "pressure of cylinder 1, which says in which revolution it fires")] = ""
    second: Annotated[str, Option("CHANNEL", "pulses of a second place, for the twist between both")] = ""
    second_teeth: Annotated[int | None, TEETH, Option(help="teeth of the second place")] = None
    second_missing: Annotated[int | None, GAP, Option(help="teeth missing there")] = None


@dataclass(frozen=True, kw_only=True)
class OrderOptions(Question):
    """Options for orders over the speed."""

    heading = "orders"
    orders: Annotated[
        words.OrdersOf, Option("LIST", "orders to track, e.g. 0.5-12 or 3,4.5,6", convert=order_range)
    ] = ()
    of: Annotated[
        str | Sequence[str],
        Option("LIST", "channels whose orders are tracked (default: the torsion)", convert=names),
    ] = ()
    integrate: Annotated[
        int,
        between(0, 2, "times"),
        Option(help="integrals over time: 1 for velocity (vibrometer), 2 for acceleration"),
    ] = 0
    step_rpm: Annotated[float, POSITIVE, Option(help="width of the bins of speed (default: a 40th of the range)")] = 0.0
    bandwidth_hz: Annotated[
        float,
        POSITIVE,
        Option("HZ", "track by the Vold-Kalman filter of this bandwidth in place of fits over cycles"),
    ] = 0.0
    cycles: Annotated[
        int | None, between(1, 64, "cycles"), Option(help="cycles that a fit spans (default: what it needs)")
    ] = None


@dataclass(frozen=True, kw_only=True)
class PressureOptions(Question):
    """Options for cylinder pressures."""

    heading = "pressure"
    pressure: Annotated[str | Sequence[str], Option("LIST", "channels of cylinder pressure", convert=names)] = ()
    engine: Annotated[words.File | Engine, Option("ENGINE", "engine of these pressures")] = ""
    cylinders: Annotated[
        str | Sequence[str], Option("LIST", "numbers of their cylinders (default 1, 2, …)", convert=names)
    ] = ()
    unit: Annotated[str, Option(help="unit of the pressures, where the file states none")] = ""
    samples_per_cycle: Annotated[
        int, between(36, 1_000_000, "samples"), Option(help="of encoder-triggered channels")
    ] = 0
    first_deg: Annotated[
        float,
        between(-720.0, 720.0, "deg"),
        Option(help="crank angle of their first sample after dead centre of cylinder 1 (default -360)"),
    ] = -360.0
    speed: Annotated[
        float | None,
        POSITIVE,
        Option("RPM", "speed of encoder-triggered channels, or one that pulses are checked against"),
    ] = None
    pegging: Annotated[
        Literal["compression", "polytropic", "intake", "keep"],
        Option(help=f"zero by {', '.join(PEGGING)}", words=tuple(PEGGING)),
    ] = "compression"
    exponent: Annotated[float, between(1.0, 1.67, ""), Option(help="of --pegging polytropic (default 1.34)")] = 1.34
    intake_bar: Annotated[float | None, POSITIVE, Option(help="absolute intake pressure of --pegging intake")] = None
    intake_deg_c: Annotated[float | None, Option(help="intake temperature (default: the engine's)")] = None
    low_pass_deg: Annotated[float, POSITIVE, Option(help="remove waves shorter than this crank angle")] = 0.0
    correct_dead_centre: Annotated[bool, Option(help="move the cycles by the shift found")] = False


@dataclass(frozen=True)
class AnalyseMeasured(RotationOptions, OrderOptions, PressureOptions):
    """Question of :func:`analyse_measured`."""

    heading = ""
    files: Annotated[words.File | Sequence[words.File], Option("FILE", "measurement files", place=True)]
    _: KW_ONLY
    channels: Annotated[
        str | Sequence[str] | None, Option("LIST", "channels to keep, separated by commas", convert=names)
    ] = None
    output: Annotated[
        words.File,
        Option(
            "FILE.csv",
            "write orders for --measured of plot and report, or mean pressures for --pressure",
        ),
    ] = ""


@verb_alone(AnalyseMeasured, DESCRIPTION)
def analyse_measured(ask: AnalyseMeasured) -> VerbResult:
    """Read the files, and compute the requested results."""
    files = paths(ask.files)
    measurement = read_measured(*files, channels=ask.channels)
    for remark in measurement.remarks:
        say(f"cranktrain: remark: {remark}")
    if ask.orders and not ask.rotation:
        raise InputError("--orders needs a rotation; give --rotation CHANNEL and --teeth N")
    if ask.output and not (ask.orders or ask.pressure):
        raise InputError("--output writes orders or pressures; give --orders or --pressure too")
    result: dict[str, Any] = {"files": files, "remarks": list(measurement.remarks)}
    beside: dict[str, Any] = {}
    if not ask.rotation and not ask.pressure:
        from cranktrain_lab.measured.rotation import tachos

        result |= {"channels": described(measurement), "tachos": tachos(measurement)}
        beside["listed"] = measurement
    rotations = _rotations(measurement, ask) if ask.rotation else []
    if rotations:
        result["rotation"] = [rotation.summary() for rotation in rotations]
        beside["rotations"] = rotations
    if ask.orders:
        result["orders"] = _orders(measurement, rotations, ask)
    if ask.pressure:
        result["pressure"] = _pressures(measurement, rotations, ask)
    if ask.output:
        result["output"] = str(Path(ask.output))
    return VerbResult.of(result, "measured", **beside)


def show(found: VerbResult) -> None:
    """Print channels, rotation, orders and pressures, as far as available."""
    if "listed" in found.beside:
        _show_channels(found.beside["listed"], found["tachos"])
    if "rotations" in found.beside:
        _show_rotations(found.beside["rotations"])
    for entry in found.get("orders", []):
        _show_orders(entry)
    if "pressure" in found:
        _show_pressures(found["pressure"])
    if "output" in found:
        print(found["output"])


def _show_channels(measurement: Measurement, found: list[dict[str, Any]]) -> None:
    """Print channels and tachos."""
    rows = [
        (channel.name, channel.unit or "–", f"{channel.size}",
         f"{channel.rate:.6g} Hz" if math.isfinite(channel.rate) else f"over {channel.abscissa}",
         f"{channel.duration:.6g} {channel.abscissa_unit}", channel.source)
        for channel in measurement.channels
    ]  # fmt: skip
    show_rows("Channels", ("quantity", "unit", "samples", "sampling", "length", "file"), rows)
    for tacho in found:
        gap = f", {tacho['teeth']}-{tacho['missing']} teeth" if "teeth" in tacho else ""
        print(f"pulses: {tacho['channel']}, {tacho['pulses_hz']:.5g} a second{gap}")


def _show_rotations(rotations: list[Rotation]) -> None:
    """Print the rotation at each measured position."""
    rows = []
    for rotation in rotations:
        told = rotation.summary()
        low, high = told["speed_rpm"]
        error = told["tooth_error_percent"]
        rows.append((rotation.name, rotation.wheel.name, f"{told['revolutions']:.1f}",
                     f"{low:.1f} to {high:.1f}", f"{told['lost_pulses']}", f"{told['double_pulses']}",
                     "–" if error is None else f"{error:.2g}"))  # fmt: skip
    header = ("quantity", "teeth", "revolutions", "rev/min", "lost", "double", "pitch error / %")
    show_rows("Rotation", header, rows)


def _show_orders(entry: dict[str, Any]) -> None:
    """Print the speed at which each order of a signal is largest."""
    rpm, amplitudes, rows = entry["speeds_rpm"], np.array(entry["amplitudes"]), []
    for k, order in enumerate(entry["orders"]):
        s = int(amplitudes[:, k].argmax())
        rows.append(
            (
                f"{order:g}", f"{rpm[s]:.0f}", f"{amplitudes[s, k]:.4g}", f"{1.96 * entry['errors'][s][k]:.2g}",
                f"{entry['phases_deg'][s][k]:.1f}", f"{entry['coherence'][s][k]:.3f}",
                _said(entry["recurring"][k], ".2g"),
            )
        )  # fmt: skip
    title = f"Orders of {entry['signal']}, {len(rpm)} speeds from {rpm[0]:.0f} to {rpm[-1]:.0f} rev/min"
    amplitude = f"amplitude / {entry['unit']}"
    header = ("order", "largest at / rev/min", amplitude, "band ±", "phase / deg", "coherence", "constant / deg")
    show_rows(title, header, rows)


PRESSURES = (
    ("quantity", "channel", ""),
    ("cycles", "cycles", ""),
    ("peak / bar", "peak_bar", ".2f"),
    ("at / deg", "peak_deg", ".1f"),
    ("imep / bar", "imep_bar", ".3f"),
    ("cov / %", "imep_cov_percent", ".2f"),
    ("zero / bar", "zero_bar", "+.3f"),
    ("shift (95 %) / deg", "dead_centre_shift_deg", "+.2f"),
    ("loss / deg", "loss_angle_deg", ".2f"),
    ("n", "polytropic_exponent", ".3f"),
)
"""Columns of the table of pressures, with the key of each in the result and the format of its numbers."""


def _show_pressures(result: list[dict[str, Any]]) -> None:
    """Print the characteristic values of each cylinder."""
    rows = []
    for one in result:
        cells = {key: _said(one.get(key), form) for _, key, form in PRESSURES}
        if (error := one.get("dead_centre_error_deg")) is not None:
            cells["dead_centre_shift_deg"] += f" ± {BAND * error:.2f}"
        rows.append(tuple(cells.values()))
    show_rows("Cylinder pressures", tuple(name for name, _, _ in PRESSURES), rows)


def _rotations(measurement: Measurement, ask: AnalyseMeasured) -> list[Rotation]:
    """Rotation at one or two positions; prints remarks."""
    rotations = rotations_of(measurement, ask)
    for rotation in rotations:
        for remark in rotation.remarks:
            say(f"cranktrain: remark: {remark}")
    if ask.orders and not rotations[0].cycle_known and any((2 * order) % 2 for order in ask.orders):
        say(
            "cranktrain: remark: which revolution of a cycle fires is not known, so phases of half orders may "
            "be 180 deg off; "
            "give --firing CHANNEL, the pressure of cylinder 1"
        )
    return rotations


def _orders(measurement: Measurement, rotations: list[Rotation], ask: AnalyseMeasured) -> list[dict[str, Any]]:
    """Orders over speed, which are also written to files if requested."""
    from cranktrain_lab.measured.order_table import write_orders

    found = orders_of(
        measurement,
        rotations,
        words.orders_of(ask.orders),
        several(ask.of),
        ask.integrate,
        ask.step_rpm,
        ask.cycles,
        ask.bandwidth_hz,
    )
    result = []
    for orders in found:
        scale, unit = (180.0 / math.pi, "deg") if orders.unit == "rad" else (1.0, orders.unit)
        recurring: list[float] = [] if ask.of else rotations[0].summary()["recurring_deg"]
        result.append(
            {
                "signal": orders.name,
                "unit": unit,
                "cycles_per_fit": orders.cycles,
                "speeds_rpm": (orders.speeds / RPM).tolist(),
                "orders": orders.orders.tolist(),
                "amplitudes": (scale * abs(orders.amplitudes)).tolist(),
                "phases_deg": np.degrees(np.angle(orders.amplitudes)).tolist(),
                "errors": (scale * orders.errors).tolist(),
                "coherence": orders.coherence.tolist(),
                "fits": orders.fits.tolist(),
                "recurring": [
                    recurring[round(order) - 1] if order % 1.0 == 0.0 and order <= len(recurring) else None
                    for order in orders.orders.tolist()
                ],
            }
        )
    if ask.output and not ask.pressure:
        places = ("pulley.torsion", "flywheel.torsion", "twist") if not ask.of else ()
        wheel = rotations[0].wheel
        write_orders(ask.output, found, places, wheel="" if ask.of else f"{wheel.teeth}-{wheel.missing}")
    return result


def _pressures(measurement: Measurement, rotations: list[Rotation], ask: AnalyseMeasured) -> list[dict[str, Any]]:
    """Cycles of cylinder pressures, which are also written to a file if requested."""
    from cranktrain.engine.file import load_engine
    from cranktrain_lab.measured.order_table import write_trace

    if not ask.engine:
        raise InputError("--pressure needs the engine's dimensions; give --engine NAME or FILE.toml")
    engine = load_engine(ask.engine)
    numbers = cylinder_numbers(ask, engine)
    found = pressures_of(measurement, rotations[0] if rotations else None, engine, ask)
    result: list[dict[str, Any]] = []
    for cycles, fit, cylinder in found:
        told = {"cylinder": numbers[len(result)], **statistics(cycles, cylinder, fit)}
        result.append(told)
        for remark in cycles.remarks:
            say(f"cranktrain: remark: {remark}")
    for one in result:
        if (hum := one["resonance"]) is not None:
            say(
                f"cranktrain: remark: {one['channel']}: oscillates at {hum['hz']:.0f} Hz with "
                f"{1e-5 * hum['amplitude']:.2g} bar; an "
                f"indicating channel of {1e3 * hum['channel_m']:.0f} mm does so, the chamber at "
                f"{hum['chamber_hz']:.0f} Hz"
            )
    if ask.output:
        write_trace(ask.output, found[0][0].angle, [cycles.mean for cycles, _, _ in found], numbers)
    return result


def _said(value: Any, form: str) -> str:
    missing = value is None or (isinstance(value, float) and not math.isfinite(value))
    return "–" if missing else format(value, form)
