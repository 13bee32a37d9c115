"""Sought parameters: values of the engine file by key, and values that belong to the measurement.

    table.key, table.key[2]         a number of the engine file
    damping.torsional_ratios[1]     damping ratio of the first torsional mode of the cranktrain, without its damper
    load                            fraction of the full-load burn
    crank.stiffness                 factor on the torsional stiffness of the crank
    zero.SET, scale.SET             angle from which a set's encoder counts, rad, and factor on its amplitudes

A parameter with a positive lower bound is sought as its logarithm u = ln θ, so that deviations are relative; any other
one as u = θ/(high − low).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.stated_units import begins_as_number, in_unit, stated
from cranktrain.core.types import Array
from cranktrain.core.units import UNITS
from cranktrain.core.user_file import is_number
from cranktrain.engine import values as places
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import OFFSETS
from cranktrain_lab.identification.tables import SoughtTable

LOAD, CRANK = "load", "crank.stiffness"
ZERO, SCALE = "zero", "scale"
RATIOS = "damping.torsional_ratios"
WIDE = 4.0
"""Default bounds of a parameter: its start divided by and multiplied by this factor."""
FARTHEST = 1e15
"""Largest bound, SI, so that squares of values remain finite."""
_TURN = math.radians(30.0)
"""Default bounds of an encoder's zero, ± rad."""


@dataclass(frozen=True)
class Sought:
    """Sought parameter of an identification.

    Attributes
    ----------
    key : key in the file
    start, low, high : start and bounds, SI
    prior : relative standard deviation about ``start`` from prior knowledge; infinite without
    unit, scale, zero : displayed value in ``unit`` = (SI value − zero) / scale
    in_file : True for a value of the engine file
    note : note in the file
    """

    key: str
    start: float
    low: float
    high: float
    prior: float
    unit: str
    scale: float
    zero: float = 0.0
    in_file: bool = True
    note: str = ""

    @property
    def log(self) -> bool:
        """True if the logarithm of the parameter is sought."""
        return self.low > 0.0 and not self.zero

    def inner(self, value: float) -> float:
        """Return the search coordinate u of a value (SI): its logarithm, or the value over the range between bounds."""
        return math.log(value) if self.log else value / (self.high - self.low)

    def value(self, inner: float) -> float:
        """Return the value (SI) of the parameter at a search coordinate u."""
        return math.exp(inner) if self.log else inner * (self.high - self.low)

    @property
    def prior_inner(self) -> float:
        """Standard deviation of the search coordinate u from prior knowledge."""
        if self.log or not math.isfinite(self.prior):
            return self.prior
        return self.prior * abs(self.start or self.high) / (self.high - self.low)

    def shown(self, value: float) -> float:
        """Convert a value (SI) to the parameter's unit."""
        return (value - self.zero) / self.scale

    def text(self, value: float) -> str:
        """Format a value (SI) with its unit for messages."""
        return f"{self.shown(value):.4g}{'' if self.unit == '1' else ' ' + self.unit}"


def sought_parameters(
    engine: Engine, tables: Mapping[str, SoughtTable], sets: Sequence[str], load: float
) -> tuple[Sought, ...]:
    """Return the sought parameters of a measured file with data sets ``sets`` (names); raises ``InputError``."""
    if not tables:
        raise InputError('parameters: none is given; name at least one, e.g. "damper.viscosity" = {}')
    found = tuple(_sought(engine, key, table, sets, load) for key, table in tables.items())
    for one in found:
        whole, _, index = one.key.partition("[")
        if index and any(other.key == whole for other in found):
            raise InputError(f"parameters.'{one.key}': is sought twice, as '{whole}' too; leave one of them out")
    return found


def _sought(engine: Engine, key: str, table: SoughtTable, sets: Sequence[str], load: float) -> Sought:
    where = f"parameters.'{key}'"
    dimension, unit, own, rule = _measured(engine, key, sets, load, where)
    unit = table.unit if table.unit != "1" else unit
    factor = places.to_si(1.0, unit, where, dimension)
    zero = OFFSETS.get(unit, 0.0)

    def number(value: Any, side: str) -> float:
        if is_number(value):
            return float(value) * factor + zero
        if not begins_as_number(value):
            raise InputError(f"{where}.{side}: {shown(value)} is no number; write 0.2, '30 kg' or '-10 %'")
        text = stated(value, f"20 {unit}")
        signed = value.strip()[0] in "+-"
        # "80 %" of a load or a factor is 0.8. With a sign, "+80 %" is a relative change, as for all other parameters.
        if text.unit == "%" and (signed or dimension != "1"):
            return own * ((1.0 if signed else 0.0) + 0.01 * text.number)
        try:
            return in_unit(text, next(iter(UNITS[dimension])), dimension)
        except InputError as error:
            raise InputError(f"{where}.{side}: {error}") from None

    start = own if table.start is None else number(table.start, "start")
    ends = [
        None if value is None else number(value, side) for side, value in (("low", table.low), ("high", table.high))
    ]
    low, high = _bounds(ends, start, key, where)
    if rule is not None:
        stated_in = rule.unit or next(iter(UNITS[rule.dimension]))
        scale, shift = UNITS[rule.dimension][stated_in], OFFSETS.get(stated_in, 0.0)
        least, largest = rule.low * scale + shift, rule.high * scale + shift
        low, high = (
            end if given is not None else min(max(end, least), largest)
            for end, given in zip((low, high), ends, strict=True)
        )
        for end in (low, high):
            if wrong := rule.wrong(end):
                raise InputError(f"{where}: {wrong}")
    for end in (low, high, start):
        if not abs(end) <= FARTHEST or (end < 0.0 and rule is None and not key.startswith(f"{ZERO}.")):
            raise InputError(
                f"{where}: {end / factor:.4g} is no value of it; write low and high as it may be, or leave them out"
            )
    found = Sought(
        key, start, low, high, table.prior or math.inf, unit, factor, zero,
        in_file=key not in (LOAD, CRANK) and key.partition(".")[0] not in (ZERO, SCALE), note=table.note,
    )  # fmt: skip
    if not low < high:
        raise InputError(f"{where}: low {found.text(low)} is not below high {found.text(high)}")
    if table.start is None and not low <= start <= high:
        start = math.sqrt(low * high) if low > 0.0 else 0.5 * (low + high)
    if not low <= start <= high:
        raise InputError(
            f"{where}: start {found.text(start)} is not within {found.text(low)} to {found.text(high)}; "
            "move one of them"
        )
    return replace(found, start=start)


def _bounds(ends: Sequence[float | None], start: float, key: str, where: str) -> tuple[float, float]:
    """Return the bounds (SI) of a parameter, by default ``start`` divided and multiplied by ``WIDE``."""
    low, high = ends
    if (low is None or high is None) and start <= 0.0 and not key.startswith(f"{ZERO}."):
        raise InputError(f"{where}: its own value is {start:g}, from which no bounds follow; give low and high")
    if key.startswith(f"{ZERO}."):
        return -_TURN if low is None else low, _TURN if high is None else high
    return start / WIDE if low is None else low, start * WIDE if high is None else high


def _measured(engine: Engine, key: str, sets: Sequence[str], load: float, where: str) -> tuple[str, str, float, Any]:
    """Return a parameter's dimension, unit in messages, default value and quantity; raises ``InputError``."""
    kind, _, name = key.partition(".")
    if key in (LOAD, CRANK):
        return "1", "1", load if key == LOAD else 1.0, None
    if kind in (ZERO, SCALE):
        if name not in sets:
            raise InputError(f"{where}: no set of orders is called '{name}'; {nearest(name, sets)}")
        return ("angle", "deg", 0.0, None) if kind == ZERO else ("1", "1", 1.0, None)
    if "." not in key or kind == CRANK.partition(".")[0]:
        near = nearest(key, (LOAD, CRANK, f"{RATIOS}[1]", "damper.viscosity"))
        raise InputError(f"{where}: is not a key of an engine file; {near}")
    try:
        rule, own = places.quantity(engine, key), places.value(engine, key)
    except InputError as error:
        raise InputError(f"parameters.{str(error).replace('calibrate numbers', 'identify numbers')}") from None
    return rule.dimension, rule.unit or next(iter(UNITS[rule.dimension])), own, rule


def engine_with(engine: Engine, sought: Sequence[Sought], values: Sequence[float]) -> Engine:
    """Return the engine with sought values (p,), SI, and values that follow from them, without checks."""
    found = engine
    for one, value in zip(sought, values, strict=True):
        if one.in_file:
            found = places.with_value(found, one.key, float(value))
            for key, number in following(engine, sought, one, float(value)).items():
                found = places.with_value(found, key, number)
    return found


def following(engine: Engine, sought: Sequence[Sought], one: Sought, value: float) -> dict[str, float]:
    """Return values (SI) of the engine file that scale with a sought value, such as inertia about other axes."""
    table, _, name = one.key.partition(".")
    key = f"{table}.diametral_inertia"
    part = getattr(engine, table, None)
    if name != "polar_inertia" or not hasattr(part, "diametral_inertia") or any(other.key == key for other in sought):
        return {}
    own = places.value(engine, one.key)
    return {key: places.value(engine, key) * value / own} if own > 0.0 else {}


def inner_values(sought: Sequence[Sought], values: Sequence[float]) -> Array:
    """Return the search coordinates u (p,) of values (p,), SI, of the p sought parameters."""
    return np.array([one.inner(float(value)) for one, value in zip(sought, values, strict=True)])


def outer_values(sought: Sequence[Sought], inner: Array) -> Array:
    """Return the values (p,), SI, of p sought parameters at search coordinates u (p,), clipped to the bounds."""
    found = [one.value(float(u)) for one, u in zip(sought, inner, strict=True)]
    return np.array([min(max(v, one.low), one.high) for v, one in zip(found, sought, strict=True)])
