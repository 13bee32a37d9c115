"""Warning, one line, of a measured pressure that is implausible for a given engine.

The pressure at the end of the intake stroke is compared with that of the engine file. Within ``COMPRESSION`` the valves
are closed and combustion has not begun, so p Vⁿ is constant with n from 1.2 (cooled) to 1.4 (air). A wrong zero of the
pressure or a wrong compression ratio changes n. A fired cycle does work, with its peak after dead centre; reversed
angles change the sign of the work.

The exponents on both sides of dead centre are nearly equal. A trace that is late by 5 degrees has 1.25 in compression
and 1.45 in expansion, an early trace the reverse, and a zero that is too low raises both. A moving average over W
degrees multiplies the k-th harmonic of a cycle of Z degrees by sin(x)/x, x = π k W/Z, so the spectrum has zeros.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.checks.plausible import COMPRESSOR, heat_of_air
from cranktrain.engine.model import Engine
from cranktrain.loads.cylinder_volume import mean_effective_pressure, polytrope

PEAK = (-10.0, 45.0)
"""Usual range of the peak's angle, deg after firing dead centre, from knocking engines to the latest burns."""
MOTORED, FIRED = 1.0e5, 2.0
"""Largest loss of a motored cycle (Pa), at most an atmosphere by the throttle; least angle of a peak after dead centre
(deg) that indicates combustion."""
INTAKE = (0.2, 2.5)
"""Usual range of pressure at the start of compression over combustion.intake_pressure, throttled to charged."""
COMPRESSION = (-65.0, -35.0)
"""Angles between closing of valves or ports and the earliest burn, deg after firing dead centre."""
EXPONENTS = (1.05, 1.6)
"""Usual range of the polytropic exponent n within the angles ``COMPRESSION``."""
FLANKS = ((-95.0, -50.0), (60.0, 95.0))
"""Parts of compression and expansion with closed valves, deg after dead centre, ``MARGIN`` away from their events."""
MARGIN = 10.0
BOTH = 1.45
"""Largest usual mean of both flanks' exponents; air has 1.4, which wall heat reduces."""
APART, LATE = 0.03, 3.5
"""Usual difference of both flanks' exponents, and least estimated shift of dead centre (deg) for a warning."""
AIR = 1.4
"""Largest exponent of a compression with wall heat. A late burn flattens the expansion like an early trace; only a
compression steeper than this distinguishes an early trace."""
SHIFTS = np.arange(-20.0, 20.1, 0.5)
AVERAGED, DIP = np.arange(25.0, 60.1, 0.5), 0.12
"""Candidate widths of moving averages, deg, and largest amplitude at a spectral zero over the amplitude next to it."""
LOBES, NOISE = ((0.5, 0.8), (1.3, 1.7), (2.3, 2.7)), 1e-7
"""Bands of harmonics next to the first two zeros, over the first zero, and least amplitude over the largest."""


def trace_doubts(engine: Engine, pressure: Array) -> Iterator[str]:
    """Yield warnings of a cylinder's pressure (n,), Pa, at uniform angles over 720 degrees after firing dead centre."""
    n = pressure.size
    at: Array = np.arange(n, dtype=np.float64) * (720.0 / n)
    burns = not heat_of_air(engine) < COMPRESSOR  # the valves of a compressor open before dead centre
    cycle = math.degrees(engine.cylinders.cycle)
    peak = (float(at[pressure.argmax()]) + 0.5 * cycle) % cycle - 0.5 * cycle
    work = mean_effective_pressure(engine, pressure)
    intake = float(pressure[3 * n // 4])
    stated = engine.compressor.suction if engine.compressor else engine.burn.intake_pressure
    ratio = intake / stated
    flanks = _flanks(engine)
    exponent, squeezed, expanded = (polytrope(engine, at, pressure, own)[0] for own in (COMPRESSION, *flanks))
    # One cause may trigger several warnings; only the first, most informative warning is reported.
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
            f"pressure, usual {INTAKE[0]:g} to {INTAKE[1]:g} times; check the unit (1 psi is 0.069 bar), the zero "
            "(absolute or gauge) and this one"
        )
    elif burns and not EXPONENTS[0] <= exponent <= EXPONENTS[1]:
        yield (
            f"from {COMPRESSION[0]:g} to {COMPRESSION[1]:g} deg the charge is compressed with p V^{exponent:.3g} "
            f"constant, usual exponents {EXPONENTS[0]:g} to {EXPONENTS[1]:g}; check dead centre, zero of the pressure "
            "(absolute or gauge) and compression_ratio"
        )
    elif burns and 0.5 * (squeezed + expanded) > BOTH:
        yield (
            f"compression follows p V^{squeezed:.3g} and expansion p V^{expanded:.3g}, usual at most {BOTH:g} in the "
            "mean, so the pressure is too low throughout; check its zero (absolute or gauge) and compression_ratio"
        )
    elif burns and abs(shift := _shift(engine, pressure, flanks)) > LATE and (shift > 0.0 or squeezed > AIR):
        yield (
            f"compression follows p V^{squeezed:.3g} and expansion p V^{expanded:.3g}, as if dead centre lay at "
            f"{shift:+.2g} deg of the trace, where both are alike; check dead centre (--pressure-tdc-deg)"
        )
    elif burns and (width := _averaged(pressure, cycle)):
        yield (
            f"its harmonics vanish as those of a moving average over {width:.3g} deg do, which lowers the peak and "
            "blurs the burn; average over cycles, not over angles"
        )


def _flanks(engine: Engine) -> list[tuple[float, float]]:
    """Return the ranges of compression and expansion with closed valves or ports, deg after firing dead centre."""
    (begin, before), (after, end) = FLANKS
    if engine.combustion is not None:
        begin = max(begin, min(math.degrees(engine.combustion.intake_closes) + MARGIN, before - MARGIN))
        end = min(end, max(math.degrees(engine.combustion.exhaust_opens) - MARGIN, after + MARGIN))
    return [(begin, before), (after, end)]


def _shift(engine: Engine, pressure: Array, flanks: Sequence[tuple[float, float]]) -> float:
    """Return the angle of dead centre in a trace (n,), deg, at which both exponents have their usual difference."""
    away: list[float] = []
    at: Array = np.arange(pressure.size, dtype=np.float64) * (720.0 / pressure.size)
    for shift in SHIFTS.tolist():
        squeezed, expanded = (polytrope(engine, at, pressure, own, shift)[0] for own in flanks)
        away.append(abs(squeezed - expanded - APART))
    return float(SHIFTS[int(np.argmin(away))])


def _averaged(pressure: Array, cycle: float) -> float:
    """Return the width of the moving average applied to a trace (n,), deg; 0 if its spectrum has no such zeros.

    ``cycle`` is the angle of a cycle, deg.
    """
    sizes = np.abs(np.fft.rfft(pressure)[:: round(720.0 / cycle)])
    best, found = DIP, 0.0
    for width in AVERAGED.tolist():
        first = cycle / width
        if 3.0 * first >= sizes.size:
            continue
        beside = [float(sizes[math.ceil(a * first) : int(b * first) + 1].max()) for a, b in LOBES]
        zeros = [float(sizes[int(m * first) : int(m * first) + 2].min()) for m in (1, 2)]
        if beside[2] < NOISE * sizes[1:].max():
            continue
        dip = max(zero / math.sqrt(a * b) for zero, a, b in zip(zeros, beside[:2], beside[1:], strict=True))
        if dip < best:
            best, found = dip, width
    return found
