"""Unit of a measured pressure without a stated unit, from the plausible range of traces of the engine.

Three features of a trace have the dimension of a pressure: its peak, its least value, and the level of its compression
line at bottom dead centre, p (V / V_max)^n with the exponent n fitted while the valves are closed. A unit fits if all
three are plausible for an engine. The exponent itself has no unit. If it is outside 1.1 to 1.6, the line is not a
compression of absolute pressure, or dead centre is wrong, and the level is not used.

A unit is accepted if it is the only one that fits. An engine with a compression ratio of 14 or more and a supercharged
intake in its file is a diesel without throttle, so units that give an intake below ``UNTHROTTLED`` are dropped if
others fit. For a compressor the suction pressure of its file replaces the intake pressure.
"""

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.engine.model import Engine
from cranktrain.loads.cylinder_volume import polytrope
from cranktrain.loads.pressure_units import UNITS, PressureUnit

Array = NDArray[np.float64]
CANDIDATES = ("Pa", "kPa", "psi", "bar", "MPa")
"""Units of recorded cylinder pressures; at and atm differ from bar by 2 % only and must be stated."""
LOWEST_PEAK, HIGHEST_PEAK = 5e5, 3.5e7
INTAKE = 2e4, 4e5
"""Range of absolute pressure at the start of compression, Pa, from throttled idle to high supercharge."""
LEAST = 5e3
"""Least pressure of a cycle, Pa; valve overlap and pulsations may lower it below the intake pressure."""
UNTHROTTLED, DIESEL, SUPERCHARGED = 6e4, 14.0, 1.2e5
"""Least intake pressure of a diesel, Pa, least compression ratio of a diesel, and stated intake pressure above which an
engine of such a ratio has no throttle, Pa."""
LINE = (-100.0, -45.0)
"""Range of crank angle relative to firing dead centre over which the compression line is fitted, deg."""
EXPONENTS = 1.1, 1.6


def unit_of_trace(name: str, engine: Engine, angle: Array, pressure: Array) -> PressureUnit:
    """Return the only unit that fits a trace.

    Parameters
    ----------
    name : file name, for messages
    angle, pressure : (k,) increasing angle after firing dead centre within a cycle, deg, and pressure as written

    Raises
    ------
    InputError
        if no unit or several units fit; the message lists units with the peaks that they imply
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
    diesel = engine.compressor is None and engine.cylinders.compression_ratio >= DIESEL
    if diesel and engine.burn.intake_pressure > SUPERCHARGED:
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


def refuse_any_unit(name: str, peak: float) -> None:
    """Raise ``InputError`` for a peak, as written in the file, that is implausible for an engine in every unit."""
    if not any(LOWEST_PEAK <= peak * UNITS[unit] <= HIGHEST_PEAK for unit in CANDIDATES):
        raise InputError(
            f"{name}: no unit is stated and none fits a peak of {peak:.4g}: {meant(CANDIDATES, peak)}; state it, "
            "--pressure-unit or the header"
        )


def meant(units: list[str] | tuple[str, ...], peak: float) -> str:
    """Return a list of candidate units with the peak that each implies."""
    return ", ".join(f"{unit} ({1e-5 * peak * UNITS[unit]:.4g} bar)" for unit in units)


def compression_level(engine: Engine, angle: Array, pressure: Array) -> float | None:
    """Return the compression line's pressure at bottom dead centre, in the file's unit; None without such a line."""
    exponent, level = polytrope(engine, angle, pressure, LINE)
    return level if EXPONENTS[0] <= exponent <= EXPONENTS[1] else None
