"""Connections from outputs to inputs of units, with conversion of units of measurement and choice of the value."""

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
"""Values of an output that an input can be set to for a step. ``MEAN`` is the master's reconstructed mean over the
step, ``NEWEST`` the newest known value (for units that reconstruct by themselves), ``START`` the value at its start."""


@dataclass(frozen=True)
class Connection:
    """Connection of one output to one input, each given as ``(unit, variable)``.

    ``modify`` computes the written value from the time (s) and the value in the input's unit: noise, a drop-out.
    ``judged``: True if step control and convergence of scheme ``iterative`` consider the output. False is for outputs
    that their unit extrapolates well and whose small errors do not matter, such as volume deviations.
    """

    source: tuple[str, str]
    target: tuple[str, str]
    meaning: str = MEAN
    modify: Callable[[float, float], float] | None = None
    judged: bool = True

    @property
    def text(self) -> str:
        """Text such as ``combustion.cylinder[1].pressure -> cranktrain.cylinder[1].pressure``."""
        return f"{'.'.join(self.source)} -> {'.'.join(self.target)}"


class Wiring(NamedTuple):
    """Computes one unit's linked inputs from all outputs: ``scale · values[places] + shift``, clipped to bounds.

    ``places`` are indices into one vector of means of all outputs, newest values and values at the step's start.
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
        """Return a unit's inputs (k,) for a step from ``time`` (s) on; ``values`` (3 n,): three of each output."""
        found = values[self.places]
        found *= self.scale
        found += self.shift
        if self.bounded:
            np.minimum(np.maximum(found, self.low, out=found), self.high, out=found)
        for k, modify in self.modified:
            found[k] = modify(time, float(found[k]))
        return found


def checked(units: Mapping[str, Unit], connections: Sequence[Connection]) -> None:
    """Raise ``InputError`` for invalid connections, with unit, variable and the nearest valid name."""
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
    """Return factor and shift that convert a value from the source's unit of measurement to the target's.

    A variable that has no unit is taken to be in SI units: many FMUs declare none.

    Raises
    ------
    InputError
        units of different dimensions, or different units of unknown dimensions
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
    """Return the wiring of a unit's inputs; ``at`` is the index of each output in the vector of all outputs."""
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
    """Connect each input to the output of the same name of another unit, if exactly one unit has such an output."""
    found = []
    for target in units.values():
        for name in target.inputs:
            sources = [unit.name for unit in units.values() if unit is not target and name in unit.outputs]
            if len(sources) == 1:
                found.append(Connection((sources[0], name), (target.name, name)))
    return found
