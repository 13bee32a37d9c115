"""What is unlikely of a measured pressure in a given engine: one line.

The pressure at the end of the intake stroke is compared with the engine's own. Between ``COMPRESSION`` the charge is
closed and does not burn yet, so that p Vⁿ is constant with n from 1.2 (cooled) to 1.4 (air): a wrong dead centre, zero
of the pressure or compression ratio shows in n. A fired cycle does work, with its peak after dead centre; angles that
run backwards show in the sign of the work.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.checks.plausible import COMPRESSOR, heat_of_air
from cranktrain.engine.model import Engine
from cranktrain.loads.built_in_trace import CYCLE
from cranktrain.loads.cylinder_volume import cylinder_volume, mean_effective_pressure

PEAK = (-10.0, 45.0)
"""First and last usual place of the peak, deg after firing dead centre: knocking engines to the latest burns."""
MOTORED, FIRED = 1.0e5, 2.0
"""Largest loss of a motored cycle (Pa), whose throttle takes an atmosphere at most; a peak this far after dead centre
(deg) is one of a burn."""
INTAKE = (0.2, 2.5)
"""Least and largest pressure at the start of the compression over combustion.intake_pressure: throttled to charged."""
COMPRESSION = (-65.0, -35.0)
"""Between closed valves or ports and the earliest burn, deg after firing dead centre."""
EXPONENTS = (1.05, 1.6)
"""Least and largest usual exponent n between these."""


def trace_doubts(engine: Engine, pressure: Array) -> Iterator[str]:
    """Doubts of a cylinder's pressure (n,), Pa, at uniform angles over 720 degrees after its firing dead centre."""
    n = pressure.size
    at: Array = np.arange(n, dtype=np.float64) * (720.0 / n)
    burns = not heat_of_air(engine) < COMPRESSOR  # the valves of a compressor open before dead centre
    cycle = math.degrees(engine.cylinders.cycle)
    peak = (float(at[pressure.argmax()]) + 0.5 * cycle) % cycle - 0.5 * cycle
    work = mean_effective_pressure(engine, pressure)
    intake = float(pressure[3 * n // 4])
    stated = engine.compressor.suction if engine.compressor else engine.burn.intake_pressure
    ratio = intake / stated
    inside = (at - 720.0 >= COMPRESSION[0]) & (at - 720.0 <= COMPRESSION[1])
    volume, _ = cylinder_volume(engine, at[inside] * (CYCLE / 720.0))
    exponent = -float(np.polyfit(np.log(volume), np.log(pressure[inside]), 1)[0])
    # One cause may show in several of these: the first says most.
    if burns and not PEAK[0] <= peak <= PEAK[1]:
        yield (
            f"the peak lies at {peak:.4g} deg after firing dead centre, usual {PEAK[0]:g} to {PEAK[1]:g} deg; check "
            "where dead centre is in the file, and that its angles rise with time"
        )
    elif burns and (work < -MOTORED or (work < 0.0 and peak > FIRED)):
        yield (
            f"its mean effective pressure is {1e-5 * work:.3g} bar, so the cycle takes work; the angles may run "
            "backwards, or dead centre may be wrong"
        )
    elif not INTAKE[0] <= ratio <= INTAKE[1]:
        yield (
            f"{1e-5 * intake:.3g} bar at the start of the compression, {ratio:.3g} times the engine file's intake "
            f"pressure, usual {INTAKE[0]:g} to {INTAKE[1]:g} times; check the unit (1 psi is 0.069 bar) and this one"
        )
    elif burns and not EXPONENTS[0] <= exponent <= EXPONENTS[1]:
        yield (
            f"from {COMPRESSION[0]:g} to {COMPRESSION[1]:g} deg the charge is compressed with p V^{exponent:.3g} "
            f"constant, usual exponents {EXPONENTS[0]:g} to {EXPONENTS[1]:g}; check dead centre, zero of the pressure "
            "(absolute or gauge) and compression_ratio"
        )
