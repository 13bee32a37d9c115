"""Cylinder pressures given by a script, as arrays over a cycle or functions of crank angle and speed.

An array is treated as measured data, like the columns of a pressure file (:mod:`cranktrain.loads.pressure_file`), so
equal numbers give exactly equal traces. A function is evaluated at the angles of the gas tables without smoothing. Its
argument is the angle after the firing dead centre of its cylinder, rad.

    pressure = p                          (n,) Pa at equal steps over one cycle, for all cylinders
    pressure = (angle, p)                 angles in rad, in any order; p (n,), or (c, n) for c cylinders
    pressure = {1: p1, 2: p2, ...}        by cylinder: arrays of one length, or functions
    pressure = p(angle), p(angle, speed)  a function that returns Pa; speed of the run in rad/s
"""

import math
import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cranktrain.core.argument_checks import called, takes_two, without_unit
from cranktrain.core.errors import InputError, shown
from cranktrain.engine.model import Engine
from cranktrain.loads.built_in_trace import CYCLE, SAMPLES
from cranktrain.loads.gas_pressure import Gas, GasTrace, trace_of
from cranktrain.loads.pressure_file import HIGHEST_PEAK, LOWEST_PEAK, folded_traces
from cranktrain.loads.pressure_points import Points
from cranktrain.loads.pressure_units import PressureUnit, named_unit

Array = NDArray[np.float64]
Function = Callable[..., float]
Pressures: TypeAlias = ArrayLike | Mapping[int, ArrayLike | Function] | Sequence[Function] | Function

NAME = "pressure"
"""Name of the pressure argument, with which error messages begin."""
REMEDY = "give an array over one cycle, (angle, pressure), a dict by cylinder, or a function of the angle"
JUMP, SMALL = 3.0, 0.02
"""A cycle is not closed if its ends differ by more than JUMP times its largest step and SMALL times its peak."""
CLOSED = 1e-3
"""Tolerance of the difference of a function's values at both ends of the cycle, over its peak."""
TOLD_SPEEDS = 33
"""Number of speeds at which digests sample a function of speed, evenly up to twice the engine's best speed."""


def given_gas(value: Any, engine: Engine, unit: str | None = None, dead_centre_deg: float | None = None) -> Gas:
    """Make the pressures of a run from arrays or functions.

    Parameters
    ----------
    value : see the module docstring; quantities of pint and results of runs are converted
    unit : unit of the numbers; None means Pa
    dead_centre_deg : angle of the data that is firing dead centre, deg; None as for a file, 0 for a function

    Raises
    ------
    InputError
        one line for too few values, non-finite values, a missing cylinder, or a cycle that does not close
    """
    stated = PressureUnit("Pa", 1.0, 0.0, "Pa") if unit is None else named_unit(unit)
    members = list(value.values()) if isinstance(value, Mapping) else value
    listed = isinstance(members, list | tuple) and bool(members) and all(map(callable, members))
    if callable(value) or listed:
        functions = (value,) if callable(value) else tuple(_by_cylinder(value, engine.n_cylinders))
        return GasFunction(engine, functions, stated, math.radians(dead_centre_deg or 0.0))
    points = _points(value, engine)
    rows, source = folded_traces(points, stated, dead_centre_deg, SAMPLES, engine, NAME)
    return trace_of(engine, rows, source)


def _points(value: Any, engine: Engine) -> Points:
    """Convert arrays to points; ``InputError`` for invalid arrays."""
    period, angle = engine.cylinders.cycle, None
    if isinstance(value, tuple) and len(value) == 2 and not np.isscalar(value[0]):
        angle, value = _numbers(value[0], "rad", f"{NAME}: angles"), value[1]
    if isinstance(value, Mapping):
        value = _by_cylinder(value, engine.n_cylinders)
    rows = [_numbers(one, "Pa", NAME) for one in value] if _many(value) else _numbers(value, "Pa", NAME)
    if isinstance(rows, list) and len({row.shape for row in rows}) > 1:
        counts = ", ".join(str(row.size) for row in rows)
        raise InputError(f"{NAME}: the cylinders have {counts} values; give each as many, over one cycle")
    pressures = np.atleast_2d(np.array(rows, dtype=float))
    if pressures.ndim != 2 or pressures.shape[0] not in (1, engine.n_cylinders):
        raise InputError(
            f"{NAME}: an array of shape {np.shape(rows)} is neither one cycle (n,) nor one for each of the "
            f"{engine.n_cylinders} cylinders ({engine.n_cylinders}, n)"
        )
    if angle is None:
        pressures = _one_cycle(pressures, math.degrees(period))
        degrees = np.arange(pressures.shape[1]) * (math.degrees(period) / pressures.shape[1])
    elif angle.shape != (pressures.shape[1],):
        raise InputError(f"{NAME}: {angle.size} angles for {pressures.shape[1]} values; give one for each value")
    elif np.ptp(angle) > 200.0:
        raise InputError(f"{NAME}: angles reach over {np.ptp(angle):.4g} rad; give radians, np.radians(angle)")
    else:
        degrees = np.degrees(angle)
    return Points(lambda: [(np.arange(degrees.size), degrees, np.ascontiguousarray(pressures.T))])


def _many(value: Any) -> bool:
    """True if a value is a list of arrays."""
    return (
        isinstance(value, list | tuple)
        and bool(value)
        and all(np.ndim(without_unit(one, "Pa", NAME)) == 1 for one in value)
    )


def _one_cycle(pressures: Array, period: float) -> Array:
    """Return one cycle (c, n) at equal steps, without a repeated end; ``InputError`` if it does not close."""
    if pressures.shape[1] % 2 == 1 and np.array_equal(pressures[:, 0], pressures[:, -1]):
        pressures = pressures[:, :-1]
    for row in pressures:
        step, jump = float(np.abs(np.diff(row)).max(initial=0.0)), abs(float(row[0] - row[-1]))
        if jump > JUMP * step and jump > SMALL * float(row.max()):
            raise InputError(
                f"{NAME}: the last value, {row[-1]:.4g}, and the first one, {row[0]:.4g}, are farther apart than any "
                f"neighbours, so the cycle does not close; give one whole cycle of {period:g} deg, or (angle, pressure)"
            )
    return pressures


def _by_cylinder(value: Any, cylinders: int) -> list[Any]:
    """Return the values in the order of cylinders; ``InputError`` if one is missing."""
    if isinstance(value, Mapping):
        wanted = list(range(1, cylinders + 1))
        if sorted(value, key=str) != sorted(wanted, key=str):
            raise InputError(
                f"{NAME}: is for cylinders {', '.join(map(shown, value))}; give 1 to {cylinders}, each once"
            )
        return [value[number] for number in wanted]
    if len(value) != cylinders:
        raise InputError(f"{NAME}: {len(value)} functions for {cylinders} cylinders; give one, or one for each")
    return list(value)


def _numbers(value: Any, unit: str, where: str) -> Array:
    """Convert a value to an array of finite numbers in ``unit``; ``InputError`` if this is not possible."""
    try:
        found = np.array(without_unit(value, unit, where), dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{where}: {shown(value)} is a {type(value).__name__}; {REMEDY}") from None
    if found.ndim not in (1, 2) or not found.size:
        raise InputError(f"{where}: {shown(value)} is no array of values over a cycle; {REMEDY}")
    wrong = np.argwhere(~np.isfinite(found))
    if len(wrong):
        place = "".join(f"[{k}]" for k in wrong[0])
        raise InputError(f"{where}: value {place} is {found[tuple(wrong[0])]}; give finite numbers in {unit}")
    return found


@dataclass(eq=False)
class GasFunction(Gas):
    """Pressures by a function for all cylinders, or for each: ``function(angle)`` or ``function(angle, speed)``.

    Attributes
    ----------
    unit : unit of the returned pressures
    dead_centre : argument of the functions at firing dead centre, rad
    """

    engine: Engine
    functions: tuple[Function, ...]
    unit: PressureUnit
    dead_centre: float
    _made: dict[float, GasTrace] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Evaluate once, so that an invalid function raises ``InputError`` immediately."""
        self._fast = [takes_two(function) for function in self.functions]
        self.at(self.engine.best_speed, 1.0)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for pickling to a worker process; ``InputError`` for a function that cannot be pickled."""
        try:
            pickle.dumps(self.functions)
        except Exception:
            raise InputError(
                f"{NAME}: a function of a notebook or a lambda cannot go to another process; take workers=1, or define "
                "it in a module"
            ) from None
        return self.__dict__

    def at(self, speed: float, load: float) -> GasTrace:
        """Return the trace at ``speed``, rad/s; the model scales its burn by the load."""
        key = speed if any(self._fast) else 0.0
        if key not in self._made:
            rows = [self._sampled(k, speed) for k in range(len(self.functions))]
            names = ", ".join(getattr(function, "__name__", "function") for function in self.functions[:3])
            source = f"{NAME}: {names}{', …' if len(self.functions) > 3 else ''} of the crank angle"
            self._made[key] = trace_of(self.engine, rows, f"{source} and the speed" if key else source)
        return self._made[key]

    @property
    def values(self) -> list[Any]:
        """Return the values for a run's digest: one trace, or traces at fixed speeds independent of the run."""
        if not any(self._fast):
            return self.at(0.0, 1.0).values
        speeds = np.linspace(0.0, 2.0 * self.engine.best_speed, TOLD_SPEEDS + 1)[1:]
        return [[speed, self.at(speed, 1.0).values] for speed in speeds.tolist()]

    def _sampled(self, k: int, speed: float) -> Array:
        """Return the pressures (SAMPLES,) Pa of function k over 720 degrees; ``InputError`` for invalid values."""
        function, fast, period = self.functions[k], self._fast[k], self.engine.cylinders.cycle
        name = NAME if len(self.functions) == 1 else f"{NAME}, cylinder {k + 1}"

        def value(angle: float) -> float:
            own = (angle + self.dead_centre) if not self.dead_centre else (angle + self.dead_centre) % period
            said = (
                f"at {math.degrees(own):.4g} deg and {speed:.4g} rad/s" if fast else f"at {math.degrees(own):.4g} deg"
            )
            return self.unit.zero + self.unit.scale * called(
                function, (own, speed)[: 1 + fast], f"{name}: {said}", "Pa"
            )

        count = round(SAMPLES * period / CYCLE)
        once = np.array([value(period * i / count) for i in range(count)])
        peak = float(once.max())
        if once.min() <= 0.0:
            at = math.degrees(period) * int(once.argmin()) / count
            raise InputError(f"{name}: {once.min():.4g} Pa at {at:.4g} deg; absolute pressures are positive")
        if not LOWEST_PEAK <= peak <= HIGHEST_PEAK:
            raise InputError(
                f"{name}: a peak of {peak:.4g} Pa is no cylinder pressure of an engine (0.3 to 60 MPa); return Pa, or "
                "state pressure_unit"
            )
        if not self.dead_centre and abs(value(period) - once[0]) > CLOSED * peak:
            raise InputError(
                f"{name}: {once[0]:.4g} Pa at 0 and {value(period):.4g} Pa at {math.degrees(period):g} deg, so the "
                f"cycle does not close; take the angle modulo {math.degrees(period):g} deg, in rad"
            )
        return np.tile(once, round(CYCLE / period))
