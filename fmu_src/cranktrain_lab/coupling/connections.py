"""Connections between units: which output goes to which input, in whose unit, and which of its values is meant."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array
from cranktrain_lab.coupling.unit import Port, Unit

MEAN, NEWEST, START = "mean", "newest", "start"
MEANINGS = (MEAN, NEWEST, START)
"""Which value of an output an input is given for a step: its mean over the step, as the master reconstructs it; the
newest that is known, for units that reconstruct by themselves; that at the step's start."""


@dataclass(frozen=True)
class Connection:
    """One output to one input, each as ``(unit, variable)``.

    ``modify`` computes the written value from the time (s) and the value in the input's unit: noise, a drop-out.
    ``judged``: whether control of the communication step and scheme ``iterative`` judge the output; not where its unit
    extrapolates it well enough and a small error of it means nothing, as with deviations of volumes.
    """

    source: tuple[str, str]
    target: tuple[str, str]
    meaning: str = MEAN
    modify: Callable[[float, float], float] | None = None
    judged: bool = True

    @property
    def text(self) -> str:
        """``combustion.cylinder[1].pressure -> cranktrain.cylinder[1].pressure``."""
        return f"{'.'.join(self.source)} -> {'.'.join(self.target)}"


class Wiring(NamedTuple):
    """Values of one unit's linked inputs from the outputs of all: ``scale · values[places] + shift``, within bounds.

    ``places`` are indices into one vector: means of all outputs, newest values, and values at the step's start.
    """

    names: tuple[str, ...]
    places: NDArray[np.intp]
    scale: Array
    shift: Array
    low: Array
    high: Array
    modified: tuple[tuple[int, Callable[[float, float], float]], ...]
    bounded: bool

    def of(self, values: Array, time: float) -> Array:
        """Inputs (k,) from the values of all outputs (3 n,), for a step that begins at ``time`` (s)."""
        found = values[self.places]
        found *= self.scale
        found += self.shift
        if self.bounded:
            np.minimum(np.maximum(found, self.low, out=found), self.high, out=found)
        for k, modify in self.modified:
            found[k] = modify(time, float(found[k]))
        return found


def checked(units: Mapping[str, Unit], connections: Sequence[Connection]) -> None:
    """Refuse connections that cannot be: ``InputError`` with unit, variable and the nearest there is."""
    taken: dict[tuple[str, str], Connection] = {}
    for connection in connections:
        ports: list[Port] = []
        for (unit, name), kind in ((connection.source, "outputs"), (connection.target, "inputs")):
            if unit not in units:
                raise InputError(f"connection {connection.text}: there is no unit '{unit}'; {nearest(unit, units)}")
            there: Mapping[str, Port] = getattr(units[unit], kind)
            if name not in there:
                what = f"{unit} has no {kind[:-1]} '{name}'"
                raise InputError(f"connection {connection.text}: {what}; {nearest(name, there)}")
            ports.append(there[name])
        if connection.meaning not in MEANINGS:
            raise InputError(f"connection {connection.text}: '{connection.meaning}'; valid: {', '.join(MEANINGS)}")
        other = taken.setdefault(connection.target, connection)
        if other is not connection:
            raise InputError(f"connection {connection.text}: its input is taken by {other.text}; leave one out")
        conversion(ports[0], ports[1], f"connection {connection.text}")


def conversion(source: Port, target: Port, where: str) -> tuple[float, float]:
    """Factor and shift by which a value in the source's unit becomes one in the target's.

    A variable that has no unit is taken to be in SI units: many FMUs declare none.

    Raises
    ------
    InputError
        units of different dimensions, or different ones of which nothing is known
    """
    one_unit = source.unit == target.unit and source.dimensions == target.dimensions
    same = source.dimensions is not None and source.dimensions == target.dimensions
    if source.unit and target.unit and not (one_unit or same):
        raise InputError(
            f"{where}: from unit '{source.unit}' to '{target.unit}', which cannot be converted; take what has one "
            "dimension, or declare base units in the model description"
        )
    return source.factor / target.factor, (source.offset - target.offset) / target.factor


def wiring(
    unit: Unit, connections: Sequence[Connection], units: Mapping[str, Unit], at: Mapping[tuple[str, str], int]
) -> Wiring:
    """What a unit takes, with ``at`` the place of each output among those of all."""
    own = [connection for connection in connections if connection.target[0] == unit.name]
    ports = [unit.inputs[connection.target[1]] for connection in own]
    pairs = [
        conversion(units[connection.source[0]].outputs[connection.source[1]], port, f"connection {connection.text}")
        for connection, port in zip(own, ports, strict=True)
    ]
    places = [MEANINGS.index(connection.meaning) * len(at) + at[connection.source] for connection in own]
    low, high = np.array([port.low for port in ports]), np.array([port.high for port in ports])
    return Wiring(
        tuple(connection.target[1] for connection in own),
        np.array(places, dtype=np.intp),
        np.array([factor for factor, _ in pairs]),
        np.array([shift for _, shift in pairs]),
        low,
        high,
        tuple((k, connection.modify) for k, connection in enumerate(own) if connection.modify is not None),
        bool(np.isfinite(low).any() or np.isfinite(high).any()),
    )


def by_name(units: Mapping[str, Unit]) -> list[Connection]:
    """Connections of every input to the one output of another unit that has its name; none where several have."""
    found = []
    for target in units.values():
        for name in target.inputs:
            sources = [unit.name for unit in units.values() if unit is not target and name in unit.outputs]
            if len(sources) == 1:
                found.append(Connection((sources[0], name), (target.name, name)))
    return found
