"""FMI 3.0 co-simulation FMU as a unit under a master: 64-bit reals, as scalars or elements of arrays.

Arrays are set and read as a whole. Elements of an input array without a connection keep their start values.
"""

import ctypes
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from fmpy import fmi3
from fmpy.fmi1 import FMICallException

from cranktrain.core.element_names import Elements
from cranktrain.core.errors import InputError, nearest
from cranktrain.core.unit_turns import FMI_3, STEPPING
from cranktrain_lab.coupling.exchanged_values import Place
from cranktrain_lab.coupling.fmu3_description import places_of, whole_numbers
from cranktrain_lab.coupling.fmu_unit import FmuUnit, described, is_bad
from cranktrain_lab.coupling.turns import Failed, Told
from cranktrain_lab.coupling.unit import UnitError


class FMU3CheckedSlave(fmi3.FMU3Slave):
    """FMPy's FMI 3.0 slave, with an error for negative status, which FMPy accepts."""

    def _call(self, fname: str, *args: Any) -> Any:
        result = super()._call(fname, *args)
        if self._functions[fname].restype is fmi3.fmi3Status and is_bad(result):
            raise FMICallException(fname, result)
        return result


def open_fmu(path: str | Path, name: str, values: Mapping[str, Any] | None = None) -> FmuUnit:
    """Open a co-simulation FMU of FMI 2.0 or 3.0; see :class:`cranktrain_lab.coupling.fmu_unit.FmuUnit`."""
    description = described(Path(path))
    kind = Fmu3Unit if str(description.fmiVersion).startswith("3.") else FmuUnit
    return kind(path, name, values, description)


class Fmu3Unit(FmuUnit):
    """FMI 3.0 unit, see :class:`cranktrain_lab.coupling.unit.Unit`; enumerations accept the names of their items."""

    _slave = FMU3CheckedSlave
    _version = FMI_3
    _listener: Callable[[float], None] | None = None
    _asked: Callable[[float], None] | None = None

    @property
    def updates(self) -> bool:
        """True if the FMU calls its master at points inside a step."""
        return bool(self._description.coSimulation.providesIntermediateUpdate)

    def listen(self, call: Callable[[float], None], ahead: Callable[[float], None] | None = None) -> None:
        """Register functions to call with the time (s) at points inside a step where inputs may be set.

        The unit calls ``call`` at points it has reached, and ``ahead`` with times for which it needs inputs in
        advance. Use before ``initialize``.
        """
        self._listener, self._asked = call, ahead

    @property
    def places(self) -> Mapping[str, Place]:
        """Locations of scalars and of elements of arrays, by name."""
        return Elements(places_of(self._description))

    def start_values(self, name: str, given: Mapping[str, Any]) -> list[Any]:
        """Return start values of all elements of the variable that contains ``name``; ``given`` values override.

        Values of enumerations are the names of their items. ``InputError`` if an element has no start value.
        """
        known = places_of(self._description)
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

    def _place(self, name: str) -> Place:
        place: Place = self._variables[name].place
        return place

    def _starts(self, names: Sequence[str], places: Sequence[Place]) -> Mapping[int, Sequence[float]]:
        wanted = {place.reference for place in places}
        starts: dict[int, list[float]] = {}
        for name, one in places_of(self._description).items():
            if one.reference in wanted:
                starts.setdefault(one.reference, []).append(self.start(name))
        return starts

    def initialize(self, time: float) -> None:
        """Prepare the unit for steps from ``time`` (s) on."""
        self._load()
        fmu = self._fmu
        known = places_of(self._description)
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
        """Return start values of all elements of an array; raises ``UnitError`` if one is missing."""
        names = [name for name, one in known.items() if one.reference == place.reference]
        values = [self._values.get(name, self._variables[name].start) for name in names]
        lacking = [name for name, value in zip(names, values, strict=True) if value is None]
        if lacking:
            raise UnitError(f"{self.name}: {lacking[0]} has no start value; give one for each element of its array")
        convert = type(next(self._values[name] for name in names if name in self._values))
        return [convert(value) for value in values]

    def step(self, time: float, size: float) -> None:
        """Advance the unit by ``size`` (s); ``UnitError`` also if the FMU returns early or ends the simulation."""
        event, ended, early = (ctypes.c_bool() for _ in range(3))
        reached = ctypes.c_double()
        told = (ctypes.byref(one) for one in (event, ended, early, reached))
        fixed = ctypes.c_double(time), ctypes.c_double(size), ctypes.c_bool(not self.restorable)
        self._direct("step", self._do_step, self._component, *fixed, *told)
        _complete(Told(ended.value, early.value, reached.value))

    def _fail(self, failed: Failed) -> NoReturn:
        if failed.call == STEPPING and not is_bad(failed.status):
            _complete(failed.told)
        super()._fail(failed)

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
        """Handle the FMU's intermediate update; an early return is never requested."""
        told = self._listener if may_get else self._asked
        if told is not None and may_set:
            told(time)

    def _log_line(self, environment: Any, status: int, category: bytes, message: bytes) -> None:
        if is_bad(status):
            self.note(message or b"")

    def _checked(self, name: str, value: Any) -> Any:
        """Return a start value in its variable's type, with item names as numbers; raises ``InputError``."""
        variable = self._variables.get(name)
        if variable is None or variable.type != "Enumeration" or not isinstance(value, str):
            return super()._checked(name, value)
        items = {item.name: int(item.value) for item in variable.declaredType.items}
        if value not in items:
            raise InputError(f"{self.name}: {name} = '{value}' is none of its items; {nearest(value, items)}")
        return items[value]

    def _whole_numbers(self, name: str) -> tuple[int, int]:
        """Return the least and the largest value of an integer variable, from its type."""
        return whole_numbers(places_of(self._description)[self._variables.own(name)].kind)


def _complete(told: Told) -> None:
    """Raise ``UnitError`` if a step returned early or ended the simulation; ``told`` are the results of the step."""
    if told.early or told.ended:
        what = "ended the simulation" if told.ended else "returned early"
        raise UnitError(f"step: it {what} at {told.reached:.9g} s, which no master here handles; correct the unit")
