"""An FMI 3.0 co-simulation FMU as a unit under a master: reals of 64 bits, scalars and elements of arrays.

Arrays are set and read whole; inputs of one that no connection leads to keep their start values.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import fmi3
from fmpy.fmi1 import FMICallException

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array
from cranktrain.coupling.element_names import Elements
from cranktrain.coupling.fmu3_description import Place, places, whole_numbers
from cranktrain.coupling.fmu_unit import FmuUnit, described, is_bad
from cranktrain.coupling.unit import UnitError


class FMU3CheckedSlave(fmi3.FMU3Slave):
    """FMPy's unit, which takes a negative status as good."""

    def _call(self, fname: str, *args: Any) -> Any:
        result = super()._call(fname, *args)
        if self._functions[fname].restype is fmi3.fmi3Status and is_bad(result):
            raise FMICallException(fname, result)
        return result


def open_fmu(path: str | Path, name: str, values: Mapping[str, Any] | None = None) -> FmuUnit:
    """A co-simulation FMU of FMI 2.0 or 3.0 as a unit; see :class:`cranktrain.coupling.fmu_unit.FmuUnit`."""
    description = described(Path(path))
    kind = Fmu3Unit if str(description.fmiVersion).startswith("3.") else FmuUnit
    return kind(path, name, values, description)


class _Exchanged:
    """Values of variables, arrays whole, and the places of the linked elements among them."""

    def __init__(self, names: Sequence[str], linked: Sequence[Place], starts: Mapping[int, Sequence[float]]) -> None:
        firsts: dict[int, int] = {}
        count = 0
        for place in linked:
            if place.reference not in firsts:
                firsts[place.reference] = count
                count += place.size
        self.names = tuple(names)
        self.values = np.zeros(count)
        for reference, first in firsts.items():
            given = starts.get(reference, ())
            self.values[first : first + len(given)] = given
        self.at = np.array([firsts[p.reference] + p.number for p in linked], dtype=np.intp)
        self.references = (ctypes.c_uint32 * max(1, len(firsts)))(*firsts)
        self.sizes = [next(p.size for p in linked if p.reference == reference) for reference in firsts]
        pointer = self.values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        self.arguments = self.references, ctypes.c_size_t(len(firsts)), pointer, ctypes.c_size_t(count)


class Fmu3Unit(FmuUnit):
    """See :class:`cranktrain.coupling.unit.Unit`; enumerations may be given by the names of their items."""

    _slave = FMU3CheckedSlave
    _listener: Callable[[float], None] | None = None

    @property
    def updates(self) -> bool:
        """Whether it calls its master at points inside a step."""
        return bool(self._description.coSimulation.providesIntermediateUpdate)

    def listen(self, call: Callable[[float], None]) -> None:
        """Call this with the time, s, at each point inside a step where inputs may be set; before ``initialize``."""
        self._listener = call

    @property
    def places(self) -> Mapping[str, Place]:
        """Places of scalars and of elements of arrays, by name."""
        return Elements(places(self._description))

    def start_values(self, name: str, given: Mapping[str, Any]) -> list[Any]:
        """Start values of all elements of the variable to which a name belongs, ``given`` ones among them.

        Enumerations have the names of their items. ``InputError`` where an element has no start value.
        """
        known = places(self._description)
        place = known[self._variables.own(name)]
        own = {self._variables.own(key): value for key, value in given.items()}
        names = [key for key, one in known.items() if one.reference == place.reference]
        values = [own.get(key, self._variables[key].start) for key in names]
        if None in values:
            lacking = names[values.index(None)]
            raise InputError(f"{self.name}: {lacking} has no start value; give one for each element of its array")
        if place.kind != "Enumeration":
            return values
        items = {int(item.value): item.name for item in self._variables[names[0]].declaredType.items}
        return [value if value in items.values() else items[int(value)] for value in values]

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """See the protocol."""
        known = places(self._description)

        def place(name: str) -> Place:
            return known[self._variables.own(name)]

        wanted = {place(name).reference for name in inputs}
        starts: dict[int, list[float]] = {}
        for name, one in known.items():
            if one.reference in wanted:
                starts.setdefault(one.reference, []).append(self.start(name))
        self._given = _Exchanged(inputs, [place(name) for name in inputs], starts)
        self._taken = _Exchanged(outputs, [place(name) for name in outputs], {})
        self._in, self._out = self._given.values, self._taken.values

    def initialize(self, time: float) -> None:
        """See the protocol."""
        self._load()
        fmu = self._fmu
        known = places(self._description)
        done: set[int] = set()
        for name, value in self._values.items():
            place = known[name]
            if place.reference in done:
                continue
            done.add(place.reference)
            values = [value] if not place.of_array else self._whole(place, known)
            kind = "Int64" if place.kind == "Enumeration" else place.kind
            self._try(f"{name} = {value}", getattr(fmu, f"set{kind}"), [place.reference], values)
        self._try("initialization", fmu.enterInitializationMode, startTime=time)
        self._try("initialization", fmu.exitInitializationMode)

    def _whole(self, place: Place, known: Mapping[str, Place]) -> list[Any]:
        """Start values of all elements of an array, given ones among them; ``UnitError`` where one has none."""
        names = [name for name, one in known.items() if one.reference == place.reference]
        values = [self._values.get(name, self._variables[name].start) for name in names]
        lacking = [name for name, value in zip(names, values, strict=True) if value is None]
        if lacking:
            raise UnitError(f"{self.name}: {lacking[0]} has no start value; give one for each element of its array")
        convert = type(next(self._values[name] for name in names if name in self._values))
        return [convert(value) for value in values]

    def write(self, values: Array) -> None:
        """See the protocol."""
        self._given.values[self._given.at] = values
        status = self._set_real(self._component, *self._given.arguments)
        if is_bad(status):
            self._direct(self._refused_input(status), lambda: status)

    def read(self) -> Array:
        """See the protocol."""
        self._direct("its outputs", self._get_real, self._component, *self._taken.arguments)
        return np.asarray(self._taken.values[self._taken.at])

    def step(self, time: float, size: float) -> None:
        """See the protocol; ``UnitError`` also where it returns early or ends the simulation."""
        event, ended, early = (ctypes.c_bool() for _ in range(3))
        reached = ctypes.c_double()
        told = (ctypes.byref(one) for one in (event, ended, early, reached))
        fixed = ctypes.c_double(time), ctypes.c_double(size), ctypes.c_bool(not self.restorable)
        self._direct("step", self._do_step, self._component, *fixed, *told)
        if early.value or ended.value:
            what = "ended the simulation" if ended.value else "returned early"
            raise UnitError(f"step: it {what} at {reached.value:.9g} s, which no master here handles; correct the unit")

    def direct(self) -> None:
        """None: compiled turns call the functions of FMI 2.0."""

    def _free_state(self, fmu: Any) -> None:
        self._direct("its state", fmu.dll.fmi3FreeFMUState, self._component, ctypes.byref(self._state))

    def _instantiate(self) -> None:
        updates = {} if self._listener is None else {"intermediateUpdate": self._updated}
        self._try("instantiation", self._fmu.instantiate, loggingOn=True, logMessage=self._log_line, **updates)
        library = self._fmu.dll
        self._set_real, self._get_real = library.fmi3SetFloat64, library.fmi3GetFloat64
        self._do_step = library.fmi3DoStep
        if self.restorable:
            self._get_state, self._set_state = library.fmi3GetFMUState, library.fmi3SetFMUState

    def _updated(self, environment: Any, time: float, may_set: bool, may_get: bool, *others: Any) -> None:
        """The FMU's call; the step is never ended early."""
        if self._listener is not None and may_set and may_get:
            self._listener(time)

    def _log_line(self, environment: Any, status: int, category: bytes, message: bytes) -> None:
        self._note(environment, self.name.encode(), status, category, message)

    def _refused_input(self, status: int) -> str:
        """The input that a unit refuses, if the unit still responds."""
        first = 0
        for reference, size in zip(self._given.references, self._given.sizes, strict=False):
            part = self._given.values[first : first + size].copy()
            at = part.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
            one = ctypes.byref(ctypes.c_uint32(reference)), ctypes.c_size_t(1), at, ctypes.c_size_t(size)
            if status != fmi3.fmi3Fatal and is_bad(self._set_real(self._component, *one)):
                linked = zip(self._given.names, self._given.at, strict=True)
                return ", ".join(f"{n} = {part[k - first]:g}" for n, k in linked if first <= k < first + size)
            first += size
        return "its inputs"

    def _checked(self, name: str, value: Any) -> Any:
        """Start value of the right type, the number of an item by its name; ``InputError``."""
        variable = self._variables.get(name)
        if variable is None or variable.type != "Enumeration" or not isinstance(value, str):
            return super()._checked(name, value)
        items = {item.name: int(item.value) for item in variable.declaredType.items}
        if value not in items:
            raise InputError(f"{self.name}: {name} = '{value}' is none of its items; {nearest(value, items)}")
        return items[value]

    def _whole_numbers(self, name: str) -> tuple[int, int]:
        """Least and largest value that a variable of whole numbers can hold, by its type."""
        return whole_numbers(places(self._description)[self._variables.own(name)].kind)
