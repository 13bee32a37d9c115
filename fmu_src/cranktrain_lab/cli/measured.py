"""The verb ``measured``: what measurement files hold, rotation from pulses, orders over speed, cylinder pressures."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import finite, number, positive, say, show_rows, taking, word
from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain_lab.measured.analysis import RotationAsked, cylinder_numbers, orders_of, pressures_of, rotations_of
from cranktrain_lab.measured.compression import BAND
from cranktrain_lab.measured.pressure import PEGGING
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


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("files", metavar="FILE", nargs="+", help="measurement files")
    add("--channels", type=names, default=None, metavar="LIST", help="channels to keep, separated by commas")
    add("--output", default="", metavar="FILE.csv",
        help="write orders for --measured of plot-runup and report, or mean pressures for --pressure")  # fmt: skip
    _add_rotation(parser.add_argument_group("rotation"))
    _add_orders(parser.add_argument_group("orders"))
    _add_pressure(parser.add_argument_group("pressure"))


def _add_rotation(group: Any) -> None:
    add = group.add_argument
    add("--rotation", default="", metavar="CHANNEL", help="channel of pulses, or of rising times of pulses")
    add(
        "--teeth",
        type=number(1, 100_000, "teeth", int),
        default=None,
        help="teeth a revolution, those missing included",
    )
    add("--missing", type=number(0, 50_000, "teeth", int), default=None, help="teeth missing in the gap (2 for 60-2)")
    add(
        "--edge",
        type=word(EDGES),
        default=None,
        help="rising or falling edges (default: rising, unless those beside the gap are wrong)",
    )
    add(
        "--clock-hz",
        type=positive,
        default=None,
        metavar="HZ",
        help="clock of a counter, where a channel holds times of pulses in ticks",
    )
    add("--level", type=finite, default=None, help="crossing level in the channel's unit (default: found)")
    add(
        "--learn-teeth",
        type=stretch,
        default=False,
        metavar="FROM,TO",
        help="learn pitch errors between two times, s; or 'all'",
    )
    add(
        "--eccentricity",
        type=word(("keep", "remove")),
        default="keep",
        help="order 1 of constant size: keep (default) or remove",
    )
    add("--index", default="", metavar="CHANNEL", help="once-a-revolution pulse that marks tooth 0")
    add(
        "--dead-centre-deg",
        type=number(-720.0, 720.0, "deg"),
        default=0.0,
        help="angle from tooth 0 to firing dead centre of cylinder 1",
    )
    add(
        "--firing",
        default="",
        metavar="CHANNEL",
        help="pressure of cylinder 1, which says in which revolution it fires",
    )
    add("--second", default="", metavar="CHANNEL", help="pulses of a second place, for the twist between both")
    add("--second-teeth", type=number(1, 100_000, "teeth", int), default=None, help="teeth of the second place")
    add("--second-missing", type=number(0, 50_000, "teeth", int), default=None, help="teeth missing there")


def _add_orders(group: Any) -> None:
    add = group.add_argument
    add("--orders", type=order_range, default=[], metavar="LIST", help="orders to track, e.g. 0.5-12 or 3,4.5,6")
    add("--of", type=names, default=[], metavar="LIST", help="channels whose orders are tracked (default: the torsion)")
    add(
        "--integrate",
        type=number(0, 2, "times", int),
        default=0,
        help="integrals over time: 1 for velocity (vibrometer), 2 for acceleration",
    )
    add("--step-rpm", type=positive, default=0.0, help="width of the bins of speed (default: a 40th of the range)")
    add(
        "--bandwidth-hz",
        type=positive,
        default=0.0,
        metavar="HZ",
        help="track by the Vold-Kalman filter of this bandwidth in place of fits over cycles",
    )
    add(
        "--cycles",
        type=number(1, 64, "cycles", int),
        default=None,
        help="cycles that a fit spans (default: what it needs)",
    )


def _add_pressure(group: Any) -> None:
    add = group.add_argument
    add("--pressure", type=names, default=[], metavar="LIST", help="channels of cylinder pressure")
    add("--engine", default="", metavar="ENGINE", help="engine of these pressures")
    add("--cylinders", type=names, default=[], metavar="LIST", help="numbers of their cylinders (default 1, 2, …)")
    add("--unit", default="", help="unit of the pressures, where the file states none")
    add(
        "--samples-per-cycle",
        type=number(36, 1_000_000, "samples", int),
        default=0,
        help="of encoder-triggered channels",
    )
    add(
        "--first-deg",
        type=number(-720.0, 720.0, "deg"),
        default=-360.0,
        help="crank angle of their first sample after dead centre of cylinder 1 (default -360)",
    )
    add(
        "--speed",
        type=positive,
        default=None,
        metavar="RPM",
        help="speed of encoder-triggered channels, or one that pulses are checked against",
    )
    add("--pegging", type=word(PEGGING), default="compression", help=f"zero by {', '.join(PEGGING)}")
    add("--exponent", type=number(1.0, 1.67, "", float), default=1.34, help="of --pegging polytropic (default 1.34)")
    add("--intake-bar", type=positive, default=None, help="absolute intake pressure of --pegging intake")
    add("--intake-deg-c", type=finite, default=None, help="intake temperature (default: the engine's)")
    add("--low-pass-deg", type=positive, default=0.0, help="remove waves shorter than this crank angle")
    add("--correct-dead-centre", action="store_true", help="move the cycles by the shift found")


@taking("str | Sequence[str]")
def names(text: str) -> list[str]:
    """Type of an option whose value are names."""
    return [name.strip() for name in text.split(",") if name.strip()]


@taking("str | Sequence[float] | bool")
def stretch(text: str) -> tuple[float, float] | bool:
    """Type of ``--learn-teeth``."""
    if text == "all":
        return True
    try:
        begin, end = (float(word) for word in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is neither two times, e.g. 12.5,20, nor 'all'") from None
    if not begin < end:
        raise argparse.ArgumentTypeError(f"'{text}' does not rise")
    return begin, end


@taking("str | Sequence[float]")
def order_range(text: str) -> list[float]:
    """Type of ``--orders``: multiples of a half, single ones or ranges."""
    orders: set[float] = set()
    for part in text.split(","):
        low, dash, high = part.partition("-")
        try:
            first, last = float(low), float(high if dash else low)
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{text}' is no list of orders; give 0.5-12 or 3,4.5,6") from None
        for order in (first, last):
            if not (0.5 <= order <= HIGHEST and (2.0 * order).is_integer()):
                raise argparse.ArgumentTypeError(f"order {order:g} is not a multiple of 0.5 up to {HIGHEST:g}")
        orders |= {0.5 * k for k in range(round(2 * first), round(2 * last) + 1)}
    return sorted(orders)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Read the files and do what the options ask for."""
    measurement = read_measured(*options.files, channels=options.channels)
    for remark in measurement.remarks:
        say(f"cranktrain: remark: {remark}")
    if options.orders and not options.rotation:
        raise InputError("--orders needs a rotation; give --rotation CHANNEL and --teeth N")
    if options.output and not (options.orders or options.pressure):
        raise InputError("--output writes orders or pressures; give --orders or --pressure too")
    result: dict[str, Any] = {"files": options.files, "remarks": list(measurement.remarks)}
    if not options.rotation and not options.pressure:
        result |= _list(measurement, options)
    rotations = _rotations(measurement, options) if options.rotation else []
    if rotations:
        result["rotation"] = [rotation.summary() for rotation in rotations]
    if options.orders:
        result["orders"] = _orders(measurement, rotations, options)
    if options.pressure:
        result["pressure"] = _pressures(measurement, rotations, options)
    if options.output:
        result["output"] = str(Path(options.output))
        if not options.json:
            print(options.output)
    return result


def _list(measurement: Measurement, options: argparse.Namespace) -> dict[str, Any]:
    """Show channels and tachos."""
    from cranktrain_lab.measured.rotation import tachos

    channels, found = described(measurement), tachos(measurement)
    if not options.json:
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
    return {"channels": channels, "tachos": found}


def _rotations(measurement: Measurement, options: argparse.Namespace) -> list[Rotation]:
    """Show and return the rotation of one or two places."""
    asked = RotationAsked(
        options.rotation, options.teeth, options.missing, options.level, options.edge, options.learn_teeth,
        options.eccentricity, options.index, math.radians(options.dead_centre_deg), options.second,
        options.second_teeth, options.second_missing, options.firing, options.speed, options.clock_hz,
    )  # fmt: skip
    rotations = rotations_of(measurement, asked)
    for rotation in rotations:
        for remark in rotation.remarks:
            say(f"cranktrain: remark: {remark}")
    if not options.json:
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
    if options.orders and not rotations[0].cycle_known and any((2 * order) % 2 for order in options.orders):
        say(
            "cranktrain: remark: which revolution of a cycle fires is not known, so phases of half orders may "
            "be 180 deg off; "
            "give --firing CHANNEL, the pressure of cylinder 1"
        )
    return rotations


def _orders(measurement: Measurement, rotations: list[Rotation], options: argparse.Namespace) -> list[dict[str, Any]]:
    """Show, write and return the orders over speed."""
    from cranktrain_lab.measured.order_table import write_orders

    found = orders_of(
        measurement,
        rotations,
        options.orders,
        options.of,
        options.integrate,
        options.step_rpm,
        options.cycles,
        options.bandwidth_hz,
    )
    result = []
    for orders in found:
        angle = orders.unit == "rad"
        scale, unit = (180.0 / math.pi, "deg") if angle else (1.0, orders.unit)
        rpm = orders.speeds / RPM
        sizes = scale * abs(orders.amplitudes)
        result.append(
            {
                "signal": orders.name,
                "unit": unit,
                "cycles_per_fit": orders.cycles,
                "speeds_rpm": rpm.tolist(),
                "orders": orders.orders.tolist(),
                "amplitudes": sizes.tolist(),
                "phases_deg": [
                    [math.degrees(math.atan2(a.imag, a.real)) for a in row] for row in orders.amplitudes.tolist()
                ],
                "errors": (scale * orders.errors).tolist(),
                "coherence": orders.coherence.tolist(),
                "fits": orders.fits.tolist(),
            }
        )
        recurring: list[float] = [] if options.of else rotations[0].summary()["recurring_deg"]
        teeth = [
            recurring[round(order) - 1] if order % 1.0 == 0.0 and order <= len(recurring) else None
            for order in orders.orders.tolist()
        ]
        result[-1]["recurring"] = teeth
        if not options.json:
            rows = []
            for k, order in enumerate(orders.orders):
                s = int(sizes[:, k].argmax())
                value = complex(orders.amplitudes[s, k])
                rows.append(
                    (
                        f"{order:g}",
                        f"{rpm[s]:.0f}",
                        f"{sizes[s, k]:.4g}",
                        f"{1.96 * scale * orders.errors[s, k]:.2g}",
                        f"{math.degrees(math.atan2(value.imag, value.real)):.1f}",
                        f"{orders.coherence[s, k]:.3f}",
                        _said(teeth[k], ".2g"),
                    )
                )
            title = f"Orders of {orders.name}, {len(rpm)} speeds from {rpm[0]:.0f} to {rpm[-1]:.0f} rev/min"
            show_rows(
                title,
                (
                    "order",
                    "largest at / rev/min",
                    f"amplitude / {unit}",
                    "band ±",
                    "phase / deg",
                    "coherence",
                    "constant / deg",
                ),
                rows,
            )
    if options.output and not options.pressure:
        places = ("pulley.torsion", "flywheel.torsion", "twist") if not options.of else ()
        wheel = rotations[0].wheel
        write_orders(options.output, found, places, wheel="" if options.of else f"{wheel.teeth}-{wheel.missing}")
    return result


def _within(error: float | None) -> str:
    """Half width of the 95 % interval of a value with a standard error."""
    return "" if error is None else f" ± {BAND * error:.2f}"


def _pressures(
    measurement: Measurement, rotations: list[Rotation], options: argparse.Namespace
) -> list[dict[str, Any]]:
    """Show, write and return the cycles of cylinder pressures."""
    from cranktrain.engine.file import load_engine
    from cranktrain_lab.measured.order_table import write_trace
    from cranktrain_lab.measured.pressure import statistics

    if not options.engine:
        raise InputError("--pressure needs the engine's dimensions; give --engine NAME or FILE.toml")
    engine = load_engine(options.engine)
    numbers = cylinder_numbers(options, engine)
    found = pressures_of(measurement, rotations[0] if rotations else None, engine, options)
    result: list[dict[str, Any]] = []
    for cycles, fit, cylinder in found:
        told = {"cylinder": numbers[len(result)], **statistics(cycles, cylinder, fit)}
        result.append(told)
        for remark in cycles.remarks:
            say(f"cranktrain: remark: {remark}")
    if not options.json:
        rows = [
            (
                str(one["channel"]),
                f"{one['cycles']}",
                f"{one['peak_bar']:.2f}",
                f"{one['peak_deg']:.1f}",
                f"{one['imep_bar']:.3f}",
                _said(one["imep_cov_percent"], ".2f"),
                f"{one['zero_bar']:+.3f}",
                _said(one.get("dead_centre_shift_deg"), "+.2f") + _within(one.get("dead_centre_error_deg")),
                _said(one.get("loss_angle_deg"), ".2f"),
                _said(one.get("polytropic_exponent"), ".3f"),
            )
            for one in result
        ]
        header = (
            "quantity",
            "cycles",
            "peak / bar",
            "at / deg",
            "imep / bar",
            "cov / %",
            "zero / bar",
            "shift (95 %) / deg",
            "loss / deg",
            "n",
        )
        show_rows("Cylinder pressures", header, rows)
    for one in result:
        if (hum := one["resonance"]) is not None:
            say(
                f"cranktrain: remark: {one['channel']}: oscillates at {hum['hz']:.0f} Hz with "
                f"{1e-5 * hum['amplitude']:.2g} bar; an "
                f"indicating channel of {1e3 * hum['channel_m']:.0f} mm does so, the chamber at "
                f"{hum['chamber_hz']:.0f} Hz"
            )
    if options.output:
        write_trace(options.output, found[0][0].angle, [cycles.mean for cycles, _, _ in found], numbers)
    return result


def _said(value: Any, form: str) -> str:
    return "–" if value is None or not math.isfinite(value) else format(value, form)
