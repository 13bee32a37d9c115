"""Text tables of measured orders: reading curves over speed from UFF files and tables, writing tracked orders.

The option ``--measured`` of run-up pictures and reports reads the written table. Its columns are speed_rpm, order,
amplitude, unit, phase_deg, band (half width of the 95 % band, in the same unit), output, signal, and wheel (teeth such
as 60-2 if a toothed wheel measured the rotation, whose pitch errors add a constant to whole orders).
"""

import math
import re
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM, to_si
from cranktrain.core.user_file import user_path
from cranktrain.engine.model import Engine
from cranktrain.results.orders.measured import OrderCurve
from cranktrain.store.whole_file import marked, whole_file
from cranktrain_lab.measured.channels import Measurement
from cranktrain_lab.measured.reading import file_format, read_measured
from cranktrain_lab.measured.tracking import BAND, Orders

MARK = "# cranktrain measured orders"
TRACE_MARK = "# cranktrain measured pressure"
BEYOND = 0.05
"""Part by which measured speeds may lie outside those of the engine."""
ORDER = re.compile(r"(?i)\border\b\D{0,3}(\d+(?:\.\d+)?)|\bo(\d+(?:\.\d+)?)\b")


def curves_of_file(path: str | Path) -> list[OrderCurve] | None:
    """Return measured orders of a binary file; None for a text table."""
    return None if file_format(user_path(path)).module == "text" else order_curves(read_measured(path))


def order_curves(measurement: Measurement) -> list[OrderCurve]:
    """Return curves of channels over speed with the order in name or title; raises ``InputError`` if there are none."""
    curves = []
    for channel in measurement.channels:
        found = ORDER.search(f"{channel.name} {channel.about}")
        if channel.abscissa != "speed" or found is None:
            continue
        order = float(found[1] or found[2])
        if abs(2.0 * order - round(2.0 * order)) > 1e-6 or order <= 0.0:
            raise InputError(f"{channel.where}: order {order:g} is not a multiple of 0.5")
        values = channel.read(0, channel.size)
        speeds = np.asarray(to_si(channel.abscissae(), channel.abscissa_unit or "rev/min", "speed"))
        phases = np.angle(values) if np.iscomplexobj(values) else np.full(channel.size, math.nan)
        good = np.isfinite(speeds) & np.isfinite(np.abs(values)) & (speeds > 0.0)
        by_speed = np.argsort(speeds[good], kind="stable")
        curves.append(
            OrderCurve(order, speeds[good][by_speed], np.abs(values[good])[by_speed], phases[good][by_speed],
                       channel.unit, channel.name)
        )  # fmt: skip
    if not curves:
        kinds = sorted({channel.abscissa for channel in measurement.channels})
        sources = ", ".join(sorted({channel.source for channel in measurement.channels}))
        raise InputError(
            f"{sources}: its channels are over {' and '.join(kinds)}; orders over speed are wanted, or track them with "
            "'cranktrain measured FILE --rotation CHANNEL --teeth N --orders LIST --output orders.csv'"
        )
    return curves


def write_orders(
    path: str | Path, found: Sequence[Orders], outputs: Sequence[str] = (), unit: str = "deg", wheel: str = ""
) -> Path:
    """Write tracked orders as a text table; angles in ``unit`` ``deg``, other signals in their own unit.

    ``outputs``: output of a run-up to compare each signal with; by default the signal's unit decides on reading.
    ``wheel``: teeth of the wheel that measured the rotation, such as ``60-2``.
    """
    lines = [MARK, "speed_rpm,order,amplitude,unit,phase_deg,band,output,signal,wheel"]
    for orders, output in zip_longest(found, outputs[: len(found)], fillvalue=""):
        assert isinstance(orders, Orders)
        scale, own = (180.0 / math.pi, unit) if orders.unit == "rad" else (1.0, orders.unit or "1")
        for k, order in enumerate(orders.orders):
            for s, speed in enumerate(orders.speeds):
                value = complex(orders.amplitudes[s, k])
                if math.isfinite(abs(value)):
                    name = orders.name.replace(",", " ").replace('"', "'")
                    lines.append(
                        f"{speed / RPM:.6g},{order:g},{scale * abs(value):.8g},{own},"
                        f"{math.degrees(np.angle(value)):.3f},"
                        f"{BAND * scale * float(orders.errors[s, k]):.3g},{output},{name},{wheel}"
                    )
    with whole_file(path, marked("table of measured orders", MARK)) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return Path(path)


def write_trace(path: str | Path, angle: Array, pressures: Sequence[Array], cylinders: Sequence[int] = ()) -> Path:
    """Write mean cycles (n,) Pa over angles (n,) rad as a trace that ``--pressure`` reads, bar over degrees.

    ``cylinders``: cylinder numbers; 1, 2, … by default.
    """
    names = (
        ["bar"] if len(pressures) == 1 else [f"cylinder[{k}] (bar)" for k in cylinders or range(1, len(pressures) + 1)]
    )
    lines = [TRACE_MARK, ";".join(["deg", *names])]
    for row in zip(np.degrees(angle), *(1e-5 * values for values in pressures), strict=True):
        lines.append(";".join(f"{value:.7g}" for value in row))
    with whole_file(path, marked("measured pressure", TRACE_MARK)) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return Path(path)


def check_speeds(engine: Engine, speeds: Array, where: str, remedy: str) -> None:
    """Raise ``InputError`` for speeds (rad/s) outside those of the engine; ``{low}`` and ``{high}`` in the remedy."""
    low, high = engine.speeds
    outside = (speeds < low * (1.0 - BEYOND)) | (speeds > high * (1.0 + BEYOND))
    if outside.any():
        ends = {"low": f"{low / RPM:.0f}", "high": f"{high / RPM:.0f}"}
        raise InputError(
            f"{where}: {int(outside.sum())} of {speeds.size} speeds, {speeds.min() / RPM:.0f} to "
            f"{speeds.max() / RPM:.0f} rev/min, lie outside those of '{engine.name}', {ends['low']} to {ends['high']} "
            f"rev/min; {remedy.format(**ends)}"
        )
