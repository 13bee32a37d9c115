"""Deviations of a run-up from measured orders: speed and height of peaks, amplitude and phase over speed."""

import math
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.results.columns import cell
from cranktrain.results.orders.harmonics import ComplexArray
from cranktrain.results.orders.measured import Measured, band_of, phases_of
from cranktrain.results.orders.resonances import vertex
from cranktrain.results.run_up.run_up import AXIAL, FLYWHEEL, TWIST, RunUp, with_twist
from cranktrain.results.tables import Table

MOTIONS = {AXIAL: "axial", FLYWHEEL: "flywheel's torsion", TWIST: "twist"}
"""Name of each output's motion in texts; an output without entry is the pulley's torsion."""
FOREIGN = 0.25
"""A remark says that measured orders may be of another engine if all peaks differ in speed by at least this
fraction."""


def deviations(run_up: RunUp, measured: Measured) -> list[dict[str, Any]]:
    """Rows of deviations, one per measured order of the run-up, over the speeds of both run-up and measurement.

    ``speed_percent``, ``amplitude_percent`` and ``damping_percent`` are the relative deviations of the computed peak's
    speed, height and damping ratio (by half-power points) from the measured peak. ``rms_percent`` is the root mean
    square difference of the amplitudes over that of the measured amplitudes. ``phase_deg`` is the mean difference of
    the phases, computed minus measured, weighted by the measured amplitudes. Values are None if a curve has no peak or
    phases are not known.
    """
    rows = []
    run_up = with_twist(run_up)
    for output, by_order in measured.items():
        for order, (speeds, sizes) in by_order.items():
            if output not in run_up.amplitudes or order not in run_up.orders:
                continue
            computed = run_up.order(order, output)
            # Measured points next to a computed speed without a result are not compared.
            there = np.interp(speeds, run_up.speeds, np.abs(computed), math.nan, math.nan)
            inside = np.isfinite(there)
            if not inside.any():
                continue
            at, own, there = speeds[inside], sizes[inside], there[inside]
            keep = (run_up.speeds >= at[0]) & (run_up.speeds <= at[-1]) & np.isfinite(computed)
            band = band_of(measured, output, order)
            noise = 0.0 if band is None else 2.0 * float(np.nanmedian(band[inside]))
            peak, base = _peak(at, own, noise), _peak(run_up.speeds[keep], np.abs(computed)[keep])
            phases = phases_of(measured, output, order)
            power, base_power, apart = (float(np.sqrt(np.mean(one**2))) for one in (own, there, there - own))
            off = [_known(100.0 * (y / x - 1.0)) for x, y in zip(peak, base, strict=True)]
            rows.append(
                {
                    "output": output,
                    "order": order,
                    "points": int(own.size),
                    "measured_peak_rpm": _known(peak[0] / RPM),
                    "computed_peak_rpm": _known(base[0] / RPM),
                    **dict(zip(("speed_percent", "amplitude_percent", "damping_percent"), off, strict=True)),
                    "measured_peak": _known(peak[1]),
                    "computed_peak": _known(base[1]),
                    "measured_damping": _known(peak[2]),
                    "computed_damping": _known(base[2]),
                    "measured_rms": power,
                    "computed_rms": base_power,
                    "rms_percent": 100.0 * apart / power if power > 0.0 else None,
                    "phase_deg": None if phases is None else _phase(run_up.speeds, computed, at, own, phases[inside]),
                }
            )
    return rows


def deviations_said(rows: list[dict[str, Any]]) -> str:
    """Line of text below a picture on deviations of peaks (speed, height) and of phase; empty if there are none."""
    parts = []
    for row in rows:
        said = [
            f"{row[key]:{form}} {words}"
            for key, form, words in (
                ("speed_percent", "+.1f", "% speed"), ("amplitude_percent", "+.0f", "% amplitude"),
                ("phase_deg", "+.0f", "deg phase"), ("rms_percent", ".0f", "% rms"),
            )
            if row[key] is not None
        ]  # fmt: skip
        parts.append(f"order {row['order']:g}: {', '.join(said)}")
    return f"Computed against measured peaks: {'; '.join(parts)}." if parts else ""


def of_another_engine(rows: list[dict[str, Any]]) -> str:
    """Remark if all measured peaks are off the computed peaks by at least ``FOREIGN``; otherwise an empty text."""
    found = [row["speed_percent"] for row in rows if row["speed_percent"] is not None]
    if found and min(abs(value) for value in found) > 100.0 * FOREIGN:
        return (
            f"all {len(found)} measured peaks lie {min(found, key=abs):+.0f} % or more from the computed ones; "
            "the measurement may be of another engine"
        )
    return ""


def check_measured(run_up: RunUp, measured: Measured) -> None:
    """Refuse measured orders without a speed in the range of a run-up; ``InputError`` with both ranges."""
    check_speeds_measured(measured, float(run_up.speeds[0]), float(run_up.speeds[-1]))


def check_speeds_measured(measured: Measured, first: float, last: float, computed: str = "the run-up") -> None:
    """Refuse measured orders without a speed between ``first`` and ``last``, rad/s; ``InputError`` with both ranges."""
    spans = [(speeds[0], speeds[-1]) for by_order in measured.values() for speeds, _ in by_order.values()]
    low, high = min(one[0] for one in spans), max(one[1] for one in spans)
    if high < first or low > last:
        raise InputError(
            f"measured orders are from {low / RPM:.0f} to {high / RPM:.0f} rev/min, {computed} from "
            f"{first / RPM:.0f} to {last / RPM:.0f} rev/min; they have no speed in common"
        )


def deviation_table(rows: list[dict[str, Any]]) -> Table:
    """Table of deviations between computed and measured orders, from the rows of :func:`deviations`."""
    columns = (
        ("measured_peak_rpm", "measured peak / rev/min", ".0f"),
        ("speed_percent", "speed / %", "+.1f"),
        ("amplitude_percent", "amplitude / %", "+.0f"),
        ("rms_percent", "rms / %", ".0f"),
        ("phase_deg", "phase / deg", "+.0f"),
    )
    texts = []
    for row in rows:
        values = (cell(row[key], form) for key, _, form in columns)
        texts.append((MOTIONS.get(row["output"], "torsion"), f"{row['order']:g}", str(row["points"]), *values))
    header = ("motion", "order", "points", *(title for _, title, _ in columns))
    return Table("Computed against measured orders", header, tuple(texts))


def _peak(speeds: Array, sizes: Array, noise: float = 0.0) -> tuple[float, float, float]:
    """Speed (rad/s), height and damping ratio of a curve's peak; NaN if it has none.

    A peak at an end, or one that exceeds the lower quartile of the curve by less than ``noise``, is none.
    """
    k = int(np.argmax(sizes))
    inside = 0 < k < speeds.size - 1 and speeds[k - 1] < speeds[k] < speeds[k + 1]
    if not inside or sizes[k] - float(np.quantile(sizes, 0.25)) < noise:
        return math.nan, math.nan, math.nan
    return vertex(speeds[k - 1 : k + 2], sizes[k - 1 : k + 2])


def _known(value: float) -> float | None:
    """The value; None for NaN."""
    return None if math.isnan(value) else value


def _phase(speeds: Array, computed: ComplexArray, at: Array, sizes: Array, phases: Array) -> float | None:
    """Mean difference of phases, deg, weighted by the measured amplitudes; None if no phase is known."""
    good = np.isfinite(phases)
    if not good.any():
        return None
    there = np.interp(at, speeds, computed.real) + 1j * np.interp(at, speeds, computed.imag)
    mean = np.sum((sizes * np.exp(-1j * phases) * there / np.maximum(np.abs(there), 1e-300))[good])
    return math.degrees(float(np.angle(mean))) if abs(mean) > 0.0 else None
