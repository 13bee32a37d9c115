"""Cylinder pressure over one cycle, from the built-in single-zone cycle with a Wiebe burn or from a measured trace.

Between intake closing and exhaust opening a single zone of ideal gas obeys

    dp/dθ = [(γ − 1) (dQ_b/dθ − dQ_w/dθ) − γ p dV/dθ] / V,   γ = 1.38 − 0.2 exp(−900 K / T)

with the burn Q_b = Q [1 − exp(−a x^(m+1))], x = (θ − θ_s)/Δθ, and the wall heat of Hohenberg's coefficient. Outside,
the pressure is that of the intake or exhaust; all transitions are twice continuously differentiable. Angles are crank
angles after the cylinder's own firing dead centre, θ ∈ [0, 4π), which contains two cycles of a two-stroke; pressures
are absolute.

Assumptions: no residual gas dynamics, wall heat at the speed of the largest heat per cycle, shape of the trace
independent of load and speed: p = p_motored + load [1 − falloff (Ω/Ω_best − 1)²] (p_fired − p_motored).

Sources: I. Wiebe, Brennverlauf und Kreisprozess von Verbrennungsmotoren (1970); G. Hohenberg, SAE 790825; R. Egnell,
SAE 982424 (γ of lean diesel gas).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.lanes import four
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Compressor
from cranktrain.loads.built_in_trace import (
    CYCLE,
    SAMPLES,
    TRACE_BORE,
    TRACE_COMPRESSION,
    TRACE_CONSTANTS,
    fill_spline,
    fill_trace,
)
from cranktrain.loads.cylinder_volume import cylinder_volume, mean_effective_pressure

Array = NDArray[np.float64]

BUILT_IN_SOURCE = "built-in Wiebe cycle"
COMPRESSOR_SOURCE = "polytropic cycle of the compressor"


class Gas(ABC):
    """Pressures of a run: a trace, or traces over speed and load (``loads.pressure_map``)."""

    @abstractmethod
    def at(self, speed: float, load: float) -> GasTrace:
        """Return the trace at ``speed`` (rad/s) and ``load``, the fraction of the full-load burn."""

    def tell_ends(self, speeds: Sequence[float], load: float) -> None:  # noqa: B027 (most pressures have no range)
        """Warn if speeds (rad/s) or load lie outside the measured range, so that the nearest trace is used."""

    @property
    @abstractmethod
    def values(self) -> list[Any]:
        """Return the values of the cylinder pressures that determine a run, for its digest."""


@dataclass(frozen=True, eq=False)
class GasTrace(Gas):
    """Absolute cylinder pressure at n uniform crank angles 4π i/n after firing dead centre.

    Attributes
    ----------
    motored, fired : (n,) pressures without and with combustion, Pa
    imep : net indicated mean effective pressure of the fired trace over 720 degrees, Pa
    best_speed : speed of the full-load trace, rad/s
    falloff : fraction of the burn's effect that is lost at twice ``best_speed``; 0 for a measured trace
    source : origin of the trace, for reports
    own : trace of each cylinder if these differ, else empty; ``motored``, ``fired`` and ``imep`` are then means
    """

    motored: Array
    fired: Array
    imep: float
    best_speed: float
    falloff: float
    source: str
    own: tuple[GasTrace, ...] = ()

    @property
    def angles(self) -> Array:
        """Crank angles of the samples, (n,) rad."""
        return np.arange(self.fired.size, dtype=np.float64) * (CYCLE / self.fired.size)

    @property
    def peak(self) -> float:
        """Largest fired pressure of any cylinder, Pa."""
        return max((trace.peak for trace in self.own), default=float(self.fired.max()))

    @property
    def peak_angle(self) -> float:
        """Crank angle of the largest fired pressure after the firing dead centre of its cylinder, rad in (−2π, 2π]."""
        if self.own:
            return max(self.own, key=lambda trace: trace.peak).peak_angle
        angle = float(self.angles[self.fired.argmax()])
        return angle if angle <= 2.0 * math.pi else angle - CYCLE

    @property
    def built_in(self) -> bool:
        """True if the trace is computed from the engine file's [combustion]."""
        return self.source == BUILT_IN_SOURCE

    def at(self, speed: float, load: float) -> GasTrace:
        """Return this trace for any ``speed`` (rad/s) and ``load``, because the model scales its burn."""
        return self

    @property
    def values(self) -> list[Any]:
        """Return the values of the trace that determine a run, for its digest."""
        own = [trace.values for trace in self.own]
        return [self.motored.tolist(), self.fired.tolist(), self.best_speed, self.falloff, *([own] if own else [])]

    @classmethod
    def mean(cls, traces: Sequence[GasTrace], weights: Sequence[float], source: str) -> GasTrace:
        """Return the weighted mean of traces, which must all be common traces or all have traces by cylinder."""
        first = traces[0]

        def mixed(values: Iterable[Array | float]) -> Any:
            return sum(weight * value for weight, value in zip(weights, values, strict=True))

        return cls(
            motored=mixed(trace.motored for trace in traces),
            fired=mixed(trace.fired for trace in traces),
            imep=mixed(trace.imep for trace in traces),
            best_speed=first.best_speed,
            falloff=first.falloff,
            source=source,
            own=tuple(cls.mean(own, weights, source) for own in zip(*(trace.own for trace in traces), strict=True)),
        )

    @classmethod
    def from_engine(cls, engine: Engine) -> GasTrace:
        """Make the built-in trace from the engine file's [combustion], or the cycle of a compressor."""
        if engine.compressor is not None:
            return cls._of_compressor(engine, engine.compressor)
        fired = _trace(engine, engine.burn.heat)
        return cls(
            motored=_trace(engine, 0.0),
            fired=fired,
            imep=mean_effective_pressure(engine, fired),
            best_speed=engine.burn.best_speed,
            falloff=engine.burn.falloff,
            source=BUILT_IN_SOURCE,
        )

    @classmethod
    def _of_compressor(cls, engine: Engine, gas: Compressor) -> GasTrace:
        """Make polytropic compression and re-expansion between suction and discharge; suction pressure without load."""
        angle = np.arange(SAMPLES, dtype=np.float64) * (CYCLE / SAMPLES)
        volume, rising = cylinder_volume(engine, angle)
        expanded = np.maximum(gas.discharge * (volume.min() / volume) ** gas.exponent, gas.suction)
        compressed = np.minimum(gas.suction * (volume.max() / volume) ** gas.exponent, gas.discharge)
        loaded = np.where(rising > 0.0, expanded, compressed)
        work = mean_effective_pressure(engine, loaded)
        return cls(np.full(SAMPLES, gas.suction), loaded, work, gas.best_speed, 0.0, COMPRESSOR_SOURCE)

    @classmethod
    def from_csv(
        cls, path: str | Path, engine: Engine, unit: str | None = None, dead_centre_deg: float | None = None
    ) -> GasTrace:
        """Read a measured trace from a file of angle (degrees) and pressure; see :mod:`cranktrain.loads.pressure_file`.

        Parameters
        ----------
        path : text file with a column of angles and one column of pressures, or one for each cylinder
        engine : engine, for dead centres, mean effective pressure and motored trace
        unit : unit of the pressures; None takes it from the header or, failing that, from the size of the peak
        dead_centre_deg : angle of the file that is firing dead centre (of cylinder 1); None finds it from the peak

        Raises
        ------
        InputError
            if the file is invalid; one line that names the file and the row

        Warns, one line each, if the trace hardly fits this engine, see :mod:`cranktrain.loads.trace_doubts`.
        """
        from cranktrain.loads.pressure_file import read_pressure  # needs SciPy, unlike the running model

        rows, source = read_pressure(path, unit, dead_centre_deg, SAMPLES, engine)
        return trace_of(engine, rows, source)


def trace_of(engine: Engine, rows: Sequence[Array], source: str) -> GasTrace:
    """Make a trace of given pressures: one row (SAMPLES,), Pa, over 720 degrees, or one for each cylinder."""
    traces = []
    for fired in rows:
        # The motored compression starts from the measured pressure at the end of the intake stroke.
        intake, work = float(fired[SAMPLES * 3 // 4]), mean_effective_pressure(engine, fired)
        compressor = engine.compressor is not None
        motored = np.full(SAMPLES, intake) if compressor else _trace(engine, 0.0, intake_pressure=intake)
        traces.append(GasTrace(motored, fired, work, engine.best_speed, 0.0, source))
    if len(traces) == 1:
        return traces[0]
    return replace(GasTrace.mean(traces, [1.0 / len(traces)] * len(traces), source), own=tuple(traces))


def spline_coefficients(samples: Array) -> Array:
    """Fit a periodic cubic spline (C²) through uniform samples.

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
    table = np.zeros((n, 4))
    fill_spline(values, np.zeros(n), table)
    return table


def gas_tables(gas: GasTrace) -> Array:
    """Fit splines (2, n, 4) of the motored pressure and its rise by combustion; (2c, n, 4) if c cylinders differ.

    The result is the input of :func:`gas_pressures`.
    """
    traces = gas.own or (gas,)
    return np.array(
        [spline_coefficients(part) for trace in traces for part in (trace.motored, trace.fired - trace.motored)]
    )


def _trace(engine: Engine, heat: float, intake_pressure: float | None = None) -> Array:
    """Compute the pressure over one cycle, (SAMPLES,) Pa: closed cycle, blow-down, exhaust, intake."""
    samples = np.zeros(SAMPLES)
    intake = engine.burn.intake_pressure if intake_pressure is None else intake_pressure
    fill_trace(trace_constants(engine), heat, intake, samples)
    return samples


def trace_constants(engine: Engine, built_in: bool = True) -> Array:
    """Return the constants of an engine's cycle, (TRACE_CONSTANTS,), see :mod:`cranktrain.loads.built_in_trace`."""
    cylinders = engine.cylinders
    if engine.compressor is not None:
        none = np.zeros(TRACE_CONSTANTS)
        none[[TRACE_BORE, TRACE_COMPRESSION]] = cylinders.bore, cylinders.compression_ratio
        return none
    burn = engine.burn
    return np.array(
        [
            cylinders.bore, cylinders.compression_ratio, engine.crankshaft.throw, engine.rod.length,
            engine.offsets[0], burn.heat, burn.intake_pressure, burn.intake_temperature, burn.exhaust_pressure,
            burn.intake_closes, burn.exhaust_opens, burn.start, burn.duration, burn.wiebe_a, burn.wiebe_m,
            burn.wall_temperature, burn.best_speed, built_in, cylinders.cycle,
        ],
        dtype=np.float64,
    )  # fmt: skip


@inlined_kernel
def _cell(theta, n):
    """Return the cell of an angle (any real, rad) in a cycle of n cells, and the position in the cell."""
    x = theta / (4.0 * math.pi)
    s = (x - math.floor(x)) * n
    i = int(s)
    if i >= n:
        i = n - 1
    return i, s - i


def gas_pressure(theta: float | Array, table: Array) -> Any:
    """Return pressures (Pa) at crank angles (any shape, rad after firing dead centre) from a spline table (n, 4)."""
    n = len(table)
    x = np.asarray(theta) / CYCLE
    s = (x - np.floor(x)) * n
    i = np.minimum(s.astype(np.int64), n - 1)
    t = s - i
    a, b, c, d = np.moveaxis(table[i], -1, 0)
    return a + t * (b + t * (c + t * d))


@kernel
def gas_pressures(theta, tables, cylinder):
    """Return motored pressure and rise of a cylinder, Pa, at an angle ``theta``, rad, from :func:`gas_tables`."""
    motored, rise, _, _ = gas_slopes(theta, tables, cylinder)
    return motored, rise


@kernel
def gas_slopes(theta, tables, cylinder):
    """Return motored pressure and rise of a cylinder at an angle, Pa, and the slopes of both, Pa/rad."""
    n = tables.shape[1]
    i, t = _cell(theta, n)
    per_rad = n / (4.0 * math.pi)
    row = 2 * cylinder if tables.shape[0] > 2 else 0
    a, b, c, d = four(tables[row, i], 0)
    motored, slope = a + t * (b + t * (c + t * d)), per_rad * (b + t * (2.0 * c + 3.0 * t * d))
    a, b, c, d = four(tables[row + 1, i], 0)
    return motored, a + t * (b + t * (c + t * d)), slope, per_rad * (b + t * (2.0 * c + 3.0 * t * d))
