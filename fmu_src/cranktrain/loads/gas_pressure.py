"""Cylinder pressure over one cycle: a built-in single-zone cycle with a Wiebe burn, or a measured trace.

Between intake closing and exhaust opening a single zone of ideal gas obeys

    dp/dθ = [(γ − 1) (dQ_b/dθ − dQ_w/dθ) − γ p dV/dθ] / V,   γ = 1.38 − 0.2 exp(−900 K / T)

with the burn Q_b = Q [1 − exp(−a x^(m+1))], x = (θ − θ_s)/Δθ, and the wall heat of Hohenberg's coefficient. Outside,
the pressure is that of the intake or exhaust; all joins are blended twice continuously differentiable. Angles are crank
angles after the cylinder's own firing dead centre, θ ∈ [0, 4π); pressures are absolute.

Assumptions: no residual gas dynamics, heat of the walls at the speed of the largest heat per cycle, the form of the
trace independent of load and speed: p = p_motored + load [1 − falloff (Ω/Ω_best − 1)²] (p_fired − p_motored).

Sources: I. Wiebe, Brennverlauf und Kreisprozess von Verbrennungsmotoren (1970); G. Hohenberg, SAE 790825; R. Egnell,
SAE 982424 (γ of lean diesel gas).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import four
from cranktrain.engine.model import Engine

Array = NDArray[np.float64]

CYCLE = 4.0 * math.pi
SAMPLES = 720
GAS_CONSTANT = 287.0
KINKS, APART = 4, math.radians(5.0)
"""Most kinks of a trace that are kept, and how far they lie apart at least."""
_BLEND = math.radians(40.0)  # width of a join: short against the cycle, long against a degree


@dataclass(frozen=True, eq=False)
class GasTrace:
    """Absolute cylinder pressure at n uniform crank angles 4π i/n after firing dead centre.

    Attributes
    ----------
    motored, fired : (n,) Pa
    imep : net indicated mean effective pressure of the fired trace over 720 degrees, Pa
    best_speed : rad/s, speed of the full-load trace
    falloff : share of the burn's effect that is lost at twice that speed; 0 for a measured trace
    source : what the trace was made from, for reports
    """

    motored: Array
    fired: Array
    imep: float
    best_speed: float
    falloff: float
    source: str

    @property
    def angles(self) -> Array:
        """Crank angles of the samples, (n,) rad."""
        return np.arange(self.fired.size, dtype=np.float64) * (CYCLE / self.fired.size)

    @property
    def peak(self) -> float:
        """Largest fired pressure, Pa."""
        return float(self.fired.max())

    @property
    def peak_angle(self) -> float:
        """Crank angle of the largest fired pressure, rad in (−2π, 2π]."""
        angle = float(self.angles[self.fired.argmax()])
        return angle if angle <= 2.0 * math.pi else angle - CYCLE

    @classmethod
    def from_engine(cls, engine: Engine) -> GasTrace:
        """Built-in trace of the engine's combustion table."""
        fired = _trace(engine, engine.combustion.heat)
        return cls(
            motored=_trace(engine, 0.0),
            fired=fired,
            imep=mean_effective_pressure(engine, fired),
            best_speed=engine.combustion.best_speed,
            falloff=engine.combustion.falloff,
            source="built-in Wiebe cycle",
        )

    @classmethod
    def from_csv(
        cls, path: str | Path, engine: Engine, unit: str | None = None, dead_centre_deg: float | None = None
    ) -> GasTrace:
        """Measured trace from a file of angle (degrees) and pressure; see :mod:`cranktrain.loads.pressure_file`.

        Parameters
        ----------
        path : text file of two columns, with or without header
        engine : gives the volumes for the mean effective pressure and the motored trace
        unit : of the pressures; None takes it from the header or, failing that, from the size of the peak
        dead_centre_deg : angle of the file that is firing dead centre; None finds it from the peak

        Raises
        ------
        InputError
            one line that names the file and the row
        """
        from cranktrain.loads.pressure_file import read_pressure  # needs SciPy, which the running model does not

        fired, source = read_pressure(path, unit, dead_centre_deg, SAMPLES)
        return cls(
            # the file tells the pressure at the end of the intake stroke, from which motoring compresses
            motored=_trace(engine, 0.0, intake_pressure=float(fired[SAMPLES * 3 // 4])),
            fired=fired,
            imep=mean_effective_pressure(engine, fired),
            best_speed=engine.combustion.best_speed,
            falloff=0.0,
            source=source,
        )


def cylinder_volume(engine: Engine, angle: Array) -> tuple[Array, Array]:
    """Volume above the piston and its derivative by the crank angle.

    Parameters
    ----------
    angle : (n,) crank angle after firing dead centre, rad

    Returns
    -------
    volume (n,) m³, derivative (n,) m³/rad
    """
    r, length, offset = engine.crankshaft.throw, engine.rod.length, engine.cylinders.pin_offset
    area = 0.25 * math.pi * engine.cylinders.bore**2
    top = math.sqrt((length + r) ** 2 - offset**2)
    stroke = top - math.sqrt((length - r) ** 2 - offset**2)
    x = -r * np.sin(angle) - offset
    s = np.sqrt(length**2 - x**2)
    clearance = area * stroke / (engine.cylinders.compression_ratio - 1.0)
    volume = clearance + area * (top - r * np.cos(angle) - s)
    derivative = area * (r * np.sin(angle) - x * r * np.cos(angle) / s)
    return volume, derivative


def mean_effective_pressure(engine: Engine, pressure: Array) -> float:
    """∮ p dV / V_displaced over one cycle of uniform samples (n,) Pa; the periodic trapezoidal rule is spectral."""
    volume, derivative = cylinder_volume(engine, np.arange(pressure.size, dtype=np.float64) * (CYCLE / pressure.size))
    # crankcase pressure and any constant drop out of the closed integral
    return float(np.sum(pressure * derivative) * (CYCLE / pressure.size) / (volume.max() - volume.min()))


def kinks(samples: Array) -> Array:
    """Crank angles (k,) rad at which a trace is least smooth: up to ``KINKS`` knots, ``APART`` from one another.

    A cubic spline has a third derivative that jumps at its knots; the largest jumps, down to a tenth of the largest,
    tell where a burn begins or a valve opens.
    """
    table = spline_coefficients(samples)
    jumps = np.abs(table[:, 3] - np.roll(table[:, 3], 1))
    pitch = CYCLE / samples.size
    found: list[float] = []
    for k in np.argsort(-jumps).tolist():
        if len(found) == KINKS or jumps[k] <= 0.1 * jumps.max():
            break
        away = [abs(math.remainder(k * pitch - other, CYCLE)) for other in found]
        if all(distance > APART for distance in away):
            found.append(k * pitch)
    return np.array(sorted(found))


def spline_coefficients(samples: Array) -> Array:
    """Periodic cubic spline (C²) through uniform samples.

    Parameters
    ----------
    samples : (n,) values at i/n of the period

    Returns
    -------
    (n, 4) coefficients of 1, t, t², t³ with t ∈ [0, 1) in each interval, for :func:`gas_pressure`
    """
    values = np.ascontiguousarray(samples, dtype=float)
    n = values.size
    if values.ndim != 1 or n < 4 or not np.all(np.isfinite(values)):
        raise InputError("a periodic spline takes at least 4 finite samples over one period")
    following = np.roll(values, -1)
    rhs = following - 2.0 * values + np.roll(values, 1)
    symbol = (4.0 + 2.0 * np.cos(2.0 * math.pi * np.arange(n // 2 + 1) / n)) / 6.0
    second = np.fft.irfft(np.fft.rfft(rhs) / symbol, n)
    after = np.roll(second, -1)
    table = np.empty((n, 4))
    table[:, 0] = values
    table[:, 1] = following - values - (2.0 * second + after) / 6.0
    table[:, 2] = 0.5 * second
    table[:, 3] = (after - second) / 6.0
    return table


def _step(x: Array) -> Array:
    """Quintic step from 0 to 1 over x ∈ [0, 1] with two vanishing derivatives at both ends."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x**3 * (10.0 + x * (6.0 * x - 15.0)))


def _trace(engine: Engine, heat: float, intake_pressure: float | None = None) -> Array:
    """Pressure over one cycle, (SAMPLES,) Pa: closed cycle, blow-down, exhaust, intake."""
    burn = engine.combustion
    intake = burn.intake_pressure if intake_pressure is None else intake_pressure
    end = burn.exhaust_opens + 1.5 * _BLEND
    angle = np.arange(SAMPLES) * (CYCLE / SAMPLES)
    after = np.where(angle < end, angle, angle - CYCLE)  # from intake to blow-down on one branch
    order = np.argsort(after)
    closed = np.full(SAMPLES, intake)
    inside = order[after[order] >= burn.intake_closes]
    closed[inside] = _closed_cycle(engine, heat, intake, after[inside])
    compressed = _step((after - burn.intake_closes) / (0.5 * _BLEND))
    expelled = _step((after - burn.exhaust_opens) / (1.5 * _BLEND))
    exchange = _step((after + 2.0 * math.pi + 0.5 * _BLEND) / _BLEND)  # exhaust to intake across gas-exchange TDC
    pressure = burn.exhaust_pressure + (intake - burn.exhaust_pressure) * exchange
    pressure = pressure + (closed - intake) * compressed * (1.0 - expelled)
    # the exchange blend is complete long before the blow-down, where it has to turn back to exhaust pressure
    return np.asarray(pressure + (burn.exhaust_pressure - intake) * expelled)


def _closed_cycle(engine: Engine, heat: float, intake: float, angles: Array) -> Array:
    """Single-zone pressure at increasing ``angles`` (n,) rad after intake closing, Pa, by the classical Runge–Kutta."""
    burn, geometry = engine.combustion, engine.cylinders
    area = 0.25 * math.pi * geometry.bore**2
    start = float(cylinder_volume(engine, np.array([burn.intake_closes]))[0][0])
    mass_r = intake * start / burn.intake_temperature  # m R
    speed = burn.best_speed
    piston_speed = 2.0 * engine.crankshaft.throw * speed / math.pi
    a, m = burn.wiebe_a, burn.wiebe_m

    def slope(theta: float, p: float, volume: float, derivative: float) -> float:
        temperature = p * volume / mass_r
        gamma = 1.38 - 0.2 * math.exp(-900.0 / temperature)
        x = (theta - burn.start) / burn.duration
        burnt = 0.0
        if 0.0 < x <= 1.0:
            burnt = heat * a * (m + 1.0) * x**m * math.exp(-a * x ** (m + 1.0)) / burn.duration
        film = 130.0 * volume**-0.06 * (1e-5 * p) ** 0.8 * temperature**-0.4 * (piston_speed + 1.4) ** 0.8
        wall = 2.0 * area + 4.0 * volume / geometry.bore
        lost = film * wall * (temperature - burn.wall_temperature) / speed
        return ((gamma - 1.0) * (burnt - lost) - gamma * p * derivative) / volume

    steps = 4  # of a quarter degree: the pressure is then converged far below the width of a line
    nodes = np.concatenate(([burn.intake_closes], angles))
    grid = np.concatenate([np.linspace(s, e, 2 * steps, endpoint=False) for s, e in pairwise(nodes)] + [nodes[-1:]])
    volume, derivative = (values.tolist() for values in cylinder_volume(engine, grid))
    theta = grid.tolist()
    p, pressures = intake, []
    for i in range(0, len(theta) - 1, 2):
        h = theta[i + 2] - theta[i]
        k1 = slope(theta[i], p, volume[i], derivative[i])
        k2 = slope(theta[i + 1], p + 0.5 * h * k1, volume[i + 1], derivative[i + 1])
        k3 = slope(theta[i + 1], p + 0.5 * h * k2, volume[i + 1], derivative[i + 1])
        k4 = slope(theta[i + 2], p + h * k3, volume[i + 2], derivative[i + 2])
        p += h * (k1 + 2.0 * (k2 + k3) + k4) / 6.0
        pressures.append(p)
    return np.array(pressures[steps - 1 :: steps])


@kernel
def gas_pressure(theta: float, table: Array) -> float:
    """Pressure (Pa) at crank angle ``theta`` (any real, rad after firing dead centre) from a spline table (n, 4)."""
    n = table.shape[0]
    x = theta / (4.0 * math.pi)
    s = (x - math.floor(x)) * n
    i = int(s)
    if i >= n:
        i = n - 1
    t = s - i
    a, b, c, d = four(table[i], 0)
    return a + t * (b + t * (c + t * d))
