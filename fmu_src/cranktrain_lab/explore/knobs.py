"""Knobs of an engine's torsional vibration: variable values of its file, with ranges in user units.

The engine file determines the knobs. An engine without damper has no damper knobs, a drive line of discs has one knob
per shaft, and the crank's diameters are variable if its stiffness comes from a formula.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

from cranktrain.core.errors import InputError
from cranktrain.engine import values as places
from cranktrain.engine.firing import firing_angles, intervals, is_even
from cranktrain.engine.levels import crank_level
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import OFFSETS, UNITS

LOAD = "load"
"""Key of the knob for the fraction of the full-load burn, which is not in engine files."""
FIRING = "cylinders.firing_order"
WIDE, NARROW = 4.0, 1.25
"""Ratio of a knob's range ends to the engine's own value: for inertias, stiffness and damping; for diameters."""
DIGITS = 4
_MOST_SHAFTS, _MOST_ORDERS = 6, 32
_OF_DAMPER = {
    "viscous": ("ring_inertia", "viscosity", "axial_gap"),
    "rubber": ("ring_inertia", "stiffness", "loss_factor"),
    "linear": ("ring_inertia", "stiffness", "damping", "stiffnesses", "dampings"),
}
_TITLES = {
    "ring_inertia": "ring inertia", "viscosity": "fluid viscosity", "axial_gap": "axial gap", "stiffness": "stiffness",
    "loss_factor": "loss factor", "damping": "damping", "stiffnesses": "stiffness", "dampings": "damping",
}  # fmt: skip


@dataclass(frozen=True)
class Knob:
    """Variable value of the engine on the page.

    Attributes
    ----------
    key : ``table.key`` or ``table.key[2]`` of an engine file, or ``load``
    title, group : title and group on the page
    unit, scale : displayed value in ``unit`` = SI value / ``scale``
    own, low, high : engine's own value and ends of the range, SI
    along : keys whose values are scaled by the same factor
    """

    key: str
    title: str
    group: str
    unit: str
    scale: float
    own: float
    low: float
    high: float
    along: tuple[str, ...] = ()

    def si(self, shown: float) -> float:
        """Convert a displayed value to SI."""
        return shown * self.scale

    def shown(self, value: float) -> float:
        """Convert a value (SI) for display, with four digits unless it is the engine's own."""
        found = value / self.scale
        return found if value == self.own else float(f"{found:.{DIGITS}g}")

    def check(self, value: float) -> None:
        """Raise ``InputError`` for a value (SI) outside the knob's range."""
        if not (math.isfinite(value) and self.low * (1 - 1e-9) <= value <= self.high * (1 + 1e-9)):
            low, high = self.low / self.scale, self.high / self.scale
            raise InputError(f"{self.key}: {value / self.scale:.4g} is not within {low:.4g} to {high:.4g} {self.unit}")


@dataclass(frozen=True)
class Chosen:
    """Choice of the knobs: changed values by key (SI), and firing order (empty: the engine's own)."""

    values: Mapping[str, float] = field(default_factory=dict)
    firing: tuple[int, ...] = ()

    @property
    def load(self) -> float:
        """Load of the choice, as a fraction of the full-load burn."""
        return self.values.get(LOAD, 1.0)


def knobs_of(engine: Engine) -> list[Knob]:
    """Return all knobs of an engine."""
    found = [Knob(LOAD, "load", "Engine", "%", 0.01, 1.0, 0.0, 1.0)]
    for key in () if engine.damper is None else _OF_DAMPER[engine.damper.kind]:
        held, title = getattr(engine.damper, key), _TITLES[key]
        if not isinstance(held, tuple):
            found += _knob(engine, f"damper.{key}", title, "Damper")
        elif held and min(held) > 0.0:
            rest = tuple(f"damper.{key}[{k}]" for k in range(2, len(held) + 1))
            found += _knob(engine, f"damper.{key}[1]", f"{title}, all frequencies", "Damper", rest)
    for table in ("pulley", "flywheel"):
        # A body's diametral inertia is at least half of its polar inertia, so both are scaled together.
        if getattr(engine, table).polar_inertia > 0.0:
            title = f"{table} inertia"
            found += _knob(engine, f"{table}.polar_inertia", title, "Masses", (f"{table}.diametral_inertia",))
    chain = engine.drive_line_chain
    if chain is None:
        for key in ("stiffness", "damping"):
            found += _knob(engine, f"drive_line.{key}", f"connecting shaft, {key}", "Shafts")
    else:
        for k, (start, end) in enumerate(zip(chain.starts, chain.ends, strict=True), 1):
            if k <= _MOST_SHAFTS:
                found += _knob(engine, f"drive_line_chain.stiffnesses[{k}]", f"shaft {start} to {end}", "Shafts")
    if not crank_level("torsional").needs_solid(engine):
        mains, pins = engine.main_bearing if engine.main_roller is None else None, engine.big_end_bearing
        for key, title, bearing, table in (
            ("main_diameter", "main journals", mains, "main_bearing"),
            ("pin_diameter", "crank pins", pins, "big_end_bearing"),
        ):
            if bearing is not None:  # a bearing is as wide as its journal
                along = (f"{table}.diameter",)
                found += _knob(engine, f"crankshaft.{key}", f"{title}, diameter", "Shafts", along, NARROW)
    return found


def _knob(
    engine: Engine, key: str, title: str, group: str, along: tuple[str, ...] = (), wide: float = WIDE
) -> list[Knob]:
    """Return the knob of a value as a list; empty for a value of 0, which no factor changes."""
    own, rule = places.value(engine, key), places.quantity(engine, key)
    if not own > 0.0:
        return []
    unit = rule.unit or next(iter(UNITS[rule.dimension]))
    scale = UNITS[rule.dimension][unit]
    if OFFSETS.get(unit):
        unit, scale = next(iter(UNITS[rule.dimension])), 1.0
    low, high = max(own / wide, rule.low * scale), min(own * wide, rule.high * scale)
    return [Knob(key, title, group, "" if unit == "1" else unit, scale, own, low, high, along)]


def firing_orders(engine: Engine) -> list[tuple[int, ...]]:
    """Return firing orders with equal intervals, the engine's own first, by exchange of cylinders 360° apart.

    A single, a two-stroke, a compressor and an engine with given angles have only their own order.
    """
    cylinders = engine.cylinders
    own, half = cylinders.firing_order, len(cylinders.firing_order) // 2
    stated = cylinders.firing_angles or cylinders.firing_intervals or engine.compressor is not None
    if stated or len(own) % 2 or len(own) < 4 or cylinders.cycle < 4.0 * math.pi - 1e-6:
        return [own]
    found = [own]
    gaps = intervals(firing_angles(engine), cylinders.cycle)
    for swapped in product((False, True), repeat=half - 1):
        order = list(own)
        for k, swap in enumerate(swapped, 1):
            if swap:
                order[k], order[k + half] = order[k + half], order[k]
        if (one := tuple(order)) in found:
            continue
        try:
            angles = firing_angles(with_order(engine, one))
        except InputError:
            continue
        if is_even(intervals(angles, cylinders.cycle)) == is_even(gaps):
            found.append(one)
        if len(found) == _MOST_ORDERS:
            break
    return found


def with_order(engine: Engine, order: tuple[int, ...]) -> Engine:
    """Return the engine with a firing order, without checks."""
    return replace(engine, cylinders=replace(engine.cylinders, firing_order=order))


def changes_of(engine: Engine, knobs: Sequence[Knob], chosen: Chosen) -> dict[str, Any]:
    """Return all values (SI) of the engine file that a choice changes, by key with or without index.

    Raises ``InputError`` for a knob that the engine lacks, or a value outside its range.
    """
    known = {knob.key: knob for knob in knobs}
    found: dict[str, Any] = {}
    for key, value in chosen.values.items():
        if key not in known:
            raise InputError(f"{key}: engine '{engine.name}' has no such knob; it has {', '.join(known)}")
        knob = known[key]
        knob.check(value)
        if key == LOAD or value == knob.own:
            continue
        found[key] = value
        found |= {other: places.value(engine, other) * (value / knob.own) for other in knob.along}
    if chosen.firing and chosen.firing != engine.cylinders.firing_order:
        found[FIRING] = chosen.firing
    return found


def chosen_engine(engine: Engine, knobs: Sequence[Knob], chosen: Chosen) -> Engine:
    """Return the engine of the choice, checked like an engine file; raises ``InputError``."""
    whole: dict[str, Any] = {}
    for key, value in changes_of(engine, knobs, chosen).items():
        name, index = key.partition("[")[::2]
        if not index:
            whole[name] = value
            continue
        table, _, entry = name.partition(".")
        entries = list(whole.get(name, getattr(getattr(engine, table), entry)))
        entries[int(index.rstrip("]")) - 1] = value
        whole[name] = entries
    return engine.with_(whole) if whole else engine
