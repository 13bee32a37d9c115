"""Volume above a piston over the crank angle, and mean effective pressure."""

import math

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.articulated_rod import dead_centre_heights, piston_height
from cranktrain.engine.model import Engine
from cranktrain.loads.built_in_trace import CYCLE

FEWEST = 5
"""Least number of points of a polytropic line."""


def cylinder_volume(engine: Engine, angle: Array, cylinder: int = 0) -> tuple[Array, Array]:
    """Return the volume above the piston and its derivative by the crank angle.

    Parameters
    ----------
    angle : (n,) crank angle after firing dead centre, rad
    cylinder : number from 0; it matters for an articulated rod only, because all other cylinders are equal

    Returns
    -------
    volume (n,) m³, derivative (n,) m³/rad
    """
    area = 0.25 * math.pi * engine.cylinders.bore**2
    if engine.articulations[cylinder] is not None:
        height, rate = piston_height(engine, cylinder, angle + engine.firing_angles[cylinder])
        top, bottom = dead_centre_heights(engine, cylinder).tolist()
        clearance = area * (top - bottom) / (engine.cylinders.compression_ratio - 1.0)
        return clearance + area * (top - height), -area * rate
    r, length, offset = engine.crankshaft.throw, engine.rod.length, engine.offsets[0]
    top = math.sqrt((length + r) ** 2 - offset**2)
    stroke = top - math.sqrt((length - r) ** 2 - offset**2)
    x = -r * np.sin(angle) - offset
    s = np.sqrt(length**2 - x**2)
    clearance = area * stroke / (engine.cylinders.compression_ratio - 1.0)
    volume = clearance + area * (top - r * np.cos(angle) - s)
    derivative = area * (r * np.sin(angle) - x * r * np.cos(angle) / s)
    return volume, derivative


def polytrope(
    engine: Engine, degrees: Array, pressure: Array, between: tuple[float, float], centre: float = 0.0
) -> tuple[float, float]:
    """Return the exponent n of p Vⁿ = const, fitted between two angles, and p at bottom dead centre; NaN without a fit.

    Angles (n,) of the pressures are in degrees, like those of ``between`` and of firing dead centre, ``centre``.
    """
    after = (degrees + 360.0) % 720.0 - 360.0
    inside = (after >= between[0]) & (after <= between[1]) & (pressure > 0.0)
    if np.count_nonzero(inside) < FEWEST:
        return math.nan, math.nan
    angles = np.radians(after[inside] - centre), np.array([math.pi])
    volume, largest = (cylinder_volume(engine, angle)[0] for angle in angles)
    slope, level = np.polyfit(np.log(volume / largest[0]), np.log(pressure[inside]), 1)
    return -float(slope), math.exp(level)


def mean_effective_pressure(engine: Engine, pressure: Array) -> float:
    """Return ∮ p dV / V_displaced over a cycle, from uniform samples (n,) Pa over 720°, by the trapezoidal rule."""
    volume, derivative = cylinder_volume(engine, np.arange(pressure.size, dtype=np.float64) * (CYCLE / pressure.size))
    # crankcase pressure, like any constant, has no work over a closed cycle
    work = np.sum(pressure * derivative) * (engine.cylinders.cycle / pressure.size)
    return float(work / (volume.max() - volume.min()))
