"""FMI 2.0 co-simulation FMU of any tool as a unit under a master; FMPy loads the FMU.

Functions needed once per step are called in the library directly, with arrays that are allocated once.
"""

import ctypes
import errno
import re
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn
from weakref import WeakValueDictionary

import fmpy
import numpy as np
from fmpy import fmi2
from fmpy.fmi1 import FMICallException
from fmpy.logging import addLoggerProxy
from fmpy.model_description import ModelDescription, ModelVariable

from cranktrain.core.element_names import Elements
from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.reduced_body import Array
from cranktrain.core.unit_turns import FMI_2, OUTPUTS, STEPPING
from cranktrain.core.user_file import ending, file_exists
from cranktrain_lab.coupling.exchanged_values import ExchangedValues, Place
from cranktrain_lab.coupling.fmu3_description import flattened
from cranktrain_lab.coupling.fmu_archive import check_archive, check_room
from cranktrain_lab.coupling.turns import Calls, Direct, Failed
from cranktrain_lab.coupling.unit import DIMENSIONS, EndingError, Port, UnitError

STATUS = {fmi2.fmi2Warning: "warning", fmi2.fmi2Discard: "discard", fmi2.fmi2Error: "error", fmi2.fmi2Fatal: "fatal"}
_TYPES = {"Real": float, "Integer": int, "Enumeration": int, "Boolean": bool, "String": str}

_IDENTIFIER = re.compile(r"[A-Za-z_]\w{0,200}", re.ASCII)
_MESSAGES = 20
"""Number of messages of a unit's log that are kept."""
_LONGEST = 2000
"""Number of characters of a message that are kept."""
_LOADED: "WeakValueDictionary[str, FmuUnit]" = WeakValueDictionary()
"""Units with a loaded FMU by instance name, to assign log messages."""


class FMU2CheckedSlave(fmi2.FMU2Slave):
    """FMPy's FMI 2.0 slave, with an error for negative status; FMPy reads the version from the start of the name."""

    def _call(self, fname: str, *args: Any) -> Any:
        result = super()._call(fname, *args)
        if self._functions[fname].restype is fmi2.fmi2Status and is_bad(result):
            raise FMICallException(fname, result)
        return result


class FmuUnit:
    """FMI 2.0 co-simulation FMU as a :class:`cranktrain_lab.coupling.unit.Unit`.

    ``values`` are start values by name. ``InputError`` for a file that is no such FMU, an FMU without a binary for
    this platform, an unknown variable or an invalid value.
    """

    _slave: Any = FMU2CheckedSlave
    _version = FMI_2

    def __init__(
        self,
        path: str | Path,
        name: str,
        values: Mapping[str, Any] | None = None,
        description: ModelDescription | None = None,
    ) -> None:
        self.path, self.name = Path(path), name
        self._description = description = description or described(self.path)
        self._variables = Elements({variable.name: variable for variable in description.modelVariables})
        self.restorable = bool(description.coSimulation.canGetAndSetFMUstate)
        reals = [variable for variable in description.modelVariables if variable.type == "Real"]
        feeds = _feeds(description)
        units = _unit_ports(description)
        self.inputs: Mapping[str, Port] = Elements(
            {v.name: _port(v, units, feeds.get(v.name, frozenset())) for v in reals if v.causality == "input"}
        )
        self.outputs: Mapping[str, Port] = Elements(
            {v.name: _port(v, units, frozenset()) for v in reals if v.causality == "output"}
        )
        self._values = {self._variables.own(key): self._checked(key, value) for key, value in (values or {}).items()}
        self._log: list[str] = []
        self._folder: Path | None = None
        self._fmu: Any = None
        self._lost = False
        self._state = ctypes.c_void_p()

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Choose the inputs that ``write`` sets and the outputs that ``read`` returns."""
        given = [self._place(name) for name in inputs]
        self._given = ExchangedValues(inputs, given, self._starts(inputs, given))
        self._taken = ExchangedValues(outputs, [self._place(name) for name in outputs], {})

    def _place(self, name: str) -> Place:
        """Return the location of the value of a real variable."""
        return Place(self._variables[name].valueReference)

    def _starts(self, names: Sequence[str], places: Sequence[Place]) -> Mapping[int, Sequence[float]]:
        """Return start values of all elements of the variables that contain these elements, by reference."""
        return {place.reference: [self.start(name)] for name, place in zip(names, places, strict=True)}

    def initialize(self, time: float) -> None:
        """Prepare the unit for steps from ``time`` (s) on."""
        self._load()
        fmu = self._fmu
        for name, value in self._values.items():
            variable = self._variables[name]
            kind = "Integer" if variable.type == "Enumeration" else variable.type
            self._try(f"{name} = {value}", getattr(fmu, f"set{kind}"), [variable.valueReference], [value])
        self._try("setup", fmu.setupExperiment, startTime=time)
        self._try("initialization", fmu.enterInitializationMode)
        self._try("initialization", fmu.exitInitializationMode)

    def is_real(self, name: str) -> bool:
        """True if the FMU has a real variable of this name."""
        return name in self._variables and self._variables[name].type == "Real"

    def port(self, name: str) -> Port:
        """Return a real variable of any causality as a port; raises ``InputError`` if it is not real."""
        if not self.is_real(name):
            reals = [key for key, variable in self._variables.items() if variable.type == "Real"]
            raise InputError(f"{self.name}: there is no real variable '{name}'; {nearest(name, reals)}")
        return _port(self._variables[name], _unit_ports(self._description), frozenset())

    def start(self, name: str) -> float:
        """Return the start value of a real variable."""
        return float(self._values.get(self._variables.own(name), self._variables[name].start or 0.0))

    def has(self, name: str) -> bool:
        """True if the FMU has a variable of this name."""
        return name in self._variables

    def set_start(self, name: str, value: Any) -> None:
        """Set the start value of a variable."""
        self._values[self._variables.own(name)] = self._checked(name, value)

    def write(self, values: Array) -> None:
        """Set the values (k,) of the k linked inputs."""
        self._given.linked = values
        status = self._set_real(self._component, *self._given_at)
        if is_bad(status):
            self._direct(self._refused_input(status), lambda: status)

    def read(self) -> Array:
        """Return the values (k,) of the k linked outputs."""
        self._direct("its outputs", self._get_real, self._component, *self._taken_at)
        return self._taken.linked

    def step(self, time: float, size: float) -> None:
        """Advance the unit from ``time`` (s) by one step of ``size`` (s)."""
        self._direct("step", self._do_step, self._component, time, size, not self.restorable)

    def keep(self, held: Any = None) -> Any:
        """Return the unit's state; memory of the earlier state ``held`` may be reused."""
        state = self._state if held is None else held
        self._direct("its state", self._get_state, self._component, ctypes.byref(state))
        return state

    def restore(self, state: Any) -> None:
        """Restore a state of the unit that ``keep`` returned."""
        self._direct("its state", self._set_state, self._component, state)

    def direct(self) -> Direct | None:
        """Return the C functions for compiled code, see :mod:`cranktrain_lab.coupling.turns`."""
        functions = (self._set_real, self._do_step, self._get_real)
        set_, step, get = (int(ctypes.cast(function, ctypes.c_void_p).value or 0) for function in functions)
        calls = Calls(self._version, set_, step, get, int(self._component))
        return Direct(calls, self._given, self._taken, not self.restorable, self._fail)

    def _fail(self, failed: Failed) -> NoReturn:
        """Raise ``UnitError`` for a call that compiled code made."""
        self._given.linked = failed.inputs
        what = {STEPPING: "step", OUTPUTS: "its outputs"}.get(failed.call, "")
        self._direct(what or self._refused_input(failed.status), lambda: failed.status)
        raise AssertionError(failed)

    def close(self) -> None:
        """Release the unit and its memory; may be called repeatedly."""
        fmu, self._fmu = self._fmu, None
        failed: UnitError | None = None
        if fmu is not None and not self._lost:
            try:
                if self._state:
                    self._free_state(fmu)
                self._try("termination", fmu.terminate)
            except UnitError as error:
                failed = error if self._lost else EndingError(*error.args)
            except Exception:  # the earlier failure has been reported
                self._lost = True
            with suppress(Exception):
                if not self._lost:
                    fmu.freeInstance()
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None
        if failed is not None:
            raise failed

    def _free_state(self, fmu: Any) -> None:
        fmu.freeFMUstate(self._state)

    def _load(self) -> None:
        """Extract, load and instantiate the FMU."""
        self._folder = Path(tempfile.mkdtemp(prefix="cranktrain-fmu-"))
        try:
            check_room(self.path)
            fmpy.extract(self.path, self._folder)
            self._fmu = self._slave(
                guid=self._description.guid,
                unzipDirectory=str(self._folder),
                modelIdentifier=self._description.coSimulation.modelIdentifier,
                instanceName=self.name,
            )
        except Exception as error:  # loaders and archives raise errors of many types
            if getattr(error, "errno", None) in (errno.ENOSPC, errno.EDQUOT):
                raise  # the temporary folder is full, the FMU is not at fault
            raise InputError(
                f"{self.path}: cannot be loaded ({_line(error)}); use an FMU that is built for this platform"
            ) from None
        _LOADED[self.name] = self
        self._instantiate()
        self._component = self._fmu.component
        sized = self._version != FMI_2
        self._given_at, self._taken_at = self._given.arguments(sized), self._taken.arguments(sized)

    def _instantiate(self) -> None:
        """Create the instance, and look up the functions that are called once per step."""
        self._callbacks = fmi2.fmi2CallbackFunctions()
        self._callbacks.logger = _LOGGER
        self._callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        self._callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
        addLoggerProxy(ctypes.byref(self._callbacks))
        self._try("instantiation", self._fmu.instantiate, callbacks=self._callbacks, loggingOn=True)
        library = self._fmu.dll
        self._set_real, self._get_real = library.fmi2SetReal, library.fmi2GetReal
        self._do_step = library.fmi2DoStep
        if self.restorable:
            self._get_state, self._set_state = library.fmi2GetFMUstate, library.fmi2SetFMUstate

    def note(self, message: bytes) -> None:
        """Append a message to the unit's log, which keeps the last few."""
        self._log = [*self._log[-_MESSAGES:], message[:_LONGEST].decode("utf-8", "replace")]

    def _refused_input(self, status: int) -> str:
        """Return ``name = value`` of the input that the unit refuses, if the unit still responds."""
        if status != fmi2.fmi2Fatal:
            for said, arguments in self._given.one_by_one(self._version != FMI_2):
                if is_bad(self._set_real(self._component, *arguments)):
                    return said
        return "its inputs"

    def _try(self, what: str, call: Any, *arguments: Any, **named: Any) -> None:
        """Call a function of FMPy; raises ``UnitError`` if FMPy reports a bad status."""
        try:
            call(*arguments, **named)
        except Exception as error:
            self._lost = self._lost or getattr(error, "status", None) == fmi2.fmi2Fatal
            raise UnitError(f"{self.name}: {what}: {self._said(_line(error))}") from None

    def _direct(self, what: str, call: Any, *arguments: Any) -> None:
        """Call a function of the library; raises ``UnitError`` for a bad status."""
        status = call(*arguments)
        if is_bad(status):
            self._lost = status == fmi2.fmi2Fatal
            raise UnitError(f"{what}: {self._said(STATUS.get(status, f'status {status}'))}")

    def _said(self, otherwise: str) -> str:
        """Return the last message of the log that is not empty, else ``otherwise``."""
        return next((" ".join(text.split()) for text in reversed(self._log) if text.strip()), otherwise)

    def _checked(self, name: str, value: Any) -> Any:
        """Return a start value in the type of its variable; raises ``InputError``."""
        if name not in self._variables:
            raise InputError(f"{self.name}: there is no variable '{name}'; {nearest(name, self._variables)}")
        kind = self._variables[name].type
        if kind not in _TYPES:
            raise InputError(f"{self.name}: {name} is of type {kind}, which has no start value here; leave it out")
        if isinstance(value, str) != (kind == "String") or isinstance(value, bool) != (kind == "Boolean"):
            raise InputError(f"{self.name}: {name} = {value!r} is not a {kind}; give a value of that type")
        if _TYPES[kind] is int:
            low, high = self._whole_numbers(name)
            if not (isinstance(value, int) or float(value).is_integer()) or not low <= value <= high:
                raise InputError(f"{self.name}: {name} = {value!r} is no whole number from {low} to {high}; give one")
        return _TYPES[kind](value)

    def _whole_numbers(self, name: str) -> tuple[int, int]:
        """Return the least and the largest value of an integer variable."""
        return -(1 << 31), (1 << 31) - 1


def _note(environment: Any, instance: bytes | None, status: int, category: bytes, message: bytes | None) -> None:
    """Append a log message to the unit of this instance name, or to the unit loaded last."""
    last = next(reversed(list(_LOADED.values())), None)
    own = _LOADED.get((instance or b"").decode("utf-8", "replace"), last)
    if own is not None and is_bad(status):
        own.note(message or b"")


# FMPy has one logger per process, the last one that was set, and calls it for all units loaded afterwards. The
# logger must therefore outlive every unit.
_LOGGER = fmi2.fmi2CallbackLoggerTYPE(_note)


def is_bad(status: int) -> bool:
    """True if an FMI call failed, because its status is neither OK nor warning. FMI has no negative status."""
    return status not in (fmi2.fmi2OK, fmi2.fmi2Warning)


def described(path: Path) -> ModelDescription:
    """Return the model description of an FMU (or of a file .xml) after checking that it can be used; ``InputError``."""
    if not file_exists(path):
        raise InputError(f"{path}: there is no such file; build an FMU with build_fmu.py, or name another")
    version = check_archive(path).get("fmiVersion", "")
    if version != "2.0" and not version.startswith("3."):
        raise InputError(f"{path}: FMI {version or 'of no version'}; give an FMI 2.0 or 3.0 co-simulation FMU")
    try:
        description = fmpy.read_model_description(str(path))
    except Exception as error:
        raise InputError(f"{path}: not a readable FMU ({_line(error)}); use another one") from None
    if description.coSimulation is None:
        raise InputError(
            f"{path}: FMI {version}, without co-simulation (model exchange or scheduled execution); give an FMI 2.0 or "
            "3.0 co-simulation FMU"
        )
    if not _IDENTIFIER.fullmatch(description.coSimulation.modelIdentifier or ""):
        raise InputError(
            f"{path}: modelIdentifier {shown(description.coSimulation.modelIdentifier)} is no name of a library; "
            "use an FMU of a program that you trust"
        )
    if version.startswith("3."):
        try:
            description = flattened(description)
        except InputError as error:
            raise InputError(f"{path}: {error}; use an FMU of a program that you trust") from None
    if ending(path) == ".xml":
        return description
    there = fmpy.supported_platforms(str(path))
    if fmpy.platform not in there:
        raise InputError(
            f"{path}: has binaries for {', '.join(there) or 'no platform'}; one for {fmpy.platform} is needed"
        )
    return description


def _unit_ports(description: ModelDescription) -> dict[str, Port]:
    """Return the units of measurement of a model description, as ports by name."""
    found = {"": Port(dimensions=(0,) * len(DIMENSIONS))}
    for unit in description.unitDefinitions:
        base = unit.baseUnit
        if base is None:
            found[unit.name] = Port(unit.name)
            continue
        dimensions = tuple(int(getattr(base, name)) for name in DIMENSIONS)
        found[unit.name] = Port(unit.name, float(base.factor), float(base.offset), dimensions)
    return found


def _port(variable: ModelVariable, units: Mapping[str, Port], feeds: frozenset[str]) -> Port:
    """Return an input or output as a port."""
    name = variable.unit or getattr(variable.declaredType, "unit", None) or ""
    unit = units.get(name, Port(name))
    low = float(variable.min) if variable.min is not None else -np.inf
    high = float(variable.max) if variable.max is not None else np.inf
    return Port(unit.unit, unit.factor, unit.offset, unit.dimensions, low, high, feeds)


def _feeds(description: ModelDescription) -> dict[str, frozenset[str]]:
    """Return the outputs with direct feedthrough by input; an output without dependencies depends on all inputs."""
    inputs = [variable.name for variable in description.modelVariables if variable.causality == "input"]
    found: dict[str, set[str]] = {name: set() for name in inputs}
    for output in description.outputs:
        depends = inputs if output.dependencies is None else [v.name for v in output.dependencies]
        for name in depends:
            if name in found:
                found[name].add(output.variable.name)
    return {name: frozenset(outputs) for name, outputs in found.items()}


def _line(error: Exception) -> str:
    """Return the message of an error in one line."""
    return " ".join(str(error).split())[:300] or type(error).__name__
