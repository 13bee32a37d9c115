"""The unit of a measured pressure that states none, from what a trace of this engine can be.

Three marks of a trace have the dimension of a pressure: its peak, its least value, and the level of its compression
line at bottom dead centre, p (V / V_max)^n with the exponent n fitted where both valves are shut. A unit fits if all
three are those of an engine. The exponent itself has no unit; outside 1.1 to 1.6 the line is no compression from an
absolute pressure, or dead centre is wrong, and the level is not used.

A unit is taken where it is the only one that fits. An engine that compresses 14 to 1 or more and whose file states a
supercharged intake is a diesel without throttle, so units that put its intake below ``UNTHROTTLED`` are dropped where
others fit. At a compressor the suction pressure of its file takes the place of the intake.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.engine.model import Engine
from cranktrain.loads.cylinder_volume import cylinder_volume
from cranktrain.loads.pressure_units import UNITS, PressureUnit

Array = NDArray[np.float64]
CANDIDATES = ("Pa", "kPa", "psi", "bar", "MPa")
"""Units in which cylinder pressures are recorded; at and atm are within 2 % of bar and must be stated."""
LOWEST_PEAK, HIGHEST_PEAK = 5e5, 3.5e7
INTAKE = 2e4, 4e5
"""Absolute pressures at the beginning of compression, Pa, from a throttled engine that idles to high supercharge."""
LEAST = 5e3
"""Least pressure of a cycle, Pa; overlap and pulsations go below that of the intake."""
UNTHROTTLED, DIESEL, SUPERCHARGED = 6e4, 14.0, 1.2e5
"""Least intake pressure of a diesel, Pa, its least compression ratio, and the stated intake pressure beyond which an
engine of such a ratio is no throttled one."""
LINE = (-100.0, -45.0)
"""Crank angles before firing dead centre over which the compression line is fitted, deg."""
EXPONENTS = 1.1, 1.6


def unit_of_trace(name: str, engine: Engine, angle: Array, pressure: Array) -> PressureUnit:
    """The one unit that fits a trace.

    Parameters
    ----------
    name : file, for messages
    angle, pressure : (k,) deg after firing dead centre within a cycle, ordered, and pressure as written

    Raises
    ------
    InputError
        no unit fits, or several do: they are named with the peaks that they mean
    """
    peak, least = float(pressure.max()), float(np.quantile(pressure, 0.02))
    level = compression_level(engine, angle, pressure)
    start = least if level is None else level
    low, high = INTAKE if engine.compressor is None else (engine.compressor.suction * k for k in (0.5, 2.0))
    fits = [
        unit
        for unit in CANDIDATES
        if LOWEST_PEAK <= peak * UNITS[unit] <= HIGHEST_PEAK
        and low <= start * UNITS[unit] <= high
        and LEAST <= least * UNITS[unit] <= 1.2 * high
    ]
    if engine.compressor is None and _unthrottled(engine):
        fits = [unit for unit in fits if start * UNITS[unit] >= UNTHROTTLED] or fits
    if len(fits) == 1:
        how = (
            f"{fits[0]} (not stated; the only unit that fits a peak of {peak:.4g} over {start:.3g} "
            f"{'at its least' if level is None else 'at the beginning of compression'})"
        )
        return PressureUnit(fits[0], UNITS[fits[0]], 0.0, how)
    if fits:
        raise InputError(
            f"{name}: no unit is stated and several fit a peak of {peak:.4g} over {start:.3g}: {meant(fits, peak)}; "
            "state it, --pressure-unit or the header"
        )
    raise InputError(
        f"{name}: no unit is stated and none fits a peak of {peak:.4g} over {start:.3g} at the intake: "
        f"{meant(CANDIDATES, peak)}; state it, --pressure-unit or the header"
    )


def _unthrottled(engine: Engine) -> bool:
    return engine.cylinders.compression_ratio >= DIESEL and engine.burn.intake_pressure > SUPERCHARGED


def refuse_any_unit(name: str, peak: float) -> None:
    """Refuse a peak, as written, that is none of an engine in any unit; ``InputError``."""
    if not any(LOWEST_PEAK <= peak * UNITS[unit] <= HIGHEST_PEAK for unit in CANDIDATES):
        raise InputError(
            f"{name}: no unit is stated and none fits a peak of {peak:.4g}: {meant(CANDIDATES, peak)}; state it, "
            "--pressure-unit or the header"
        )


def meant(units: list[str] | tuple[str, ...], peak: float) -> str:
    """Candidates with the peak that each of them means."""
    return ", ".join(f"{unit} ({1e-5 * peak * UNITS[unit]:.4g} bar)" for unit in units)


def compression_level(engine: Engine, angle: Array, pressure: Array) -> float | None:
    """Pressure as written of the compression line at bottom dead centre; None where there is no such line."""
    after = (angle + 360.0) % 720.0 - 360.0
    chosen = (after >= LINE[0]) & (after <= LINE[1]) & (pressure > 0.0)
    if np.count_nonzero(chosen) < 5:
        return None
    volume, _ = cylinder_volume(engine, np.radians(after[chosen]))
    largest, _ = cylinder_volume(engine, np.array([math.pi]))
    ratio = np.log(volume / largest[0])
    slope, level = np.polyfit(ratio, np.log(pressure[chosen]), 1)
    if not EXPONENTS[0] <= -slope <= EXPONENTS[1]:
        return None
    return float(math.exp(level))
