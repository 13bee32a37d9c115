"""Kernel of a user's law: a Python function, compiled by numba or called back, with the signature of film laws.

A kernel is made for each law, when a model first needs its address. Records hold the parameters of one connection and
the exchanged data: last displacement and velocity, the forces found there, and whether the last call failed.
"""

import ctypes
import dis
import math
import time
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import OPTIONS, Kernel, compiler, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.film.laws import films as on

MOST_AXES = 4
OF_SCALE, OF_VALUE = 1.0e-3, 1.0e-6
"""Steps of a central difference: relative to the scale of a component, and relative to its present value."""
RATE = 1.0e3
"""Ratio of the scales of velocity and displacement, 1/s, as for a vibration at 160 Hz."""
# Positions in ``OwnRecord.exchange``, which begins with the displacement of the last call, MOST_AXES values:
# VELOCITY_AT, ANGLE_AT, SPEED_AT: velocity (MOST_AXES values), crank angle and speed of the last call.
# FORCE_AT, BY_PLACE_AT, BY_VELOCITY_AT: forces (MOST_AXES values), their derivatives (4 × 4 each, row-major).
# FAILED_AT, VALUES_AT: failure of the call, and first of the parameters.
VELOCITY_AT, ANGLE_AT, SPEED_AT, FORCE_AT, BY_PLACE_AT, BY_VELOCITY_AT, FAILED_AT, VALUES_AT = (
    4,
    8,
    9,
    10,
    14,
    30,
    46,
    47,
)
FINE, NOT_FINITE, RAISED = 0.0, 1.0, 2.0
"""Failures of a call to a user's law; RAISED is set before a call and stays if an exception ends the call."""
FAILURE = 1
"""Status of a law that fails."""
TRIED = 200
"""Number of calls by which a law in Python is timed."""


class Function(Protocol):
    """Interface of a law from which a kernel is made, see :class:`cranktrain.dynamics.topology.own_law.OwnLaw`."""

    name: str
    axes: tuple[str, ...]
    function: Callable[..., Any]
    tangent: Callable[..., Any] | None
    compiled: bool | None
    arguments: dict[str, float | None]
    parameters: dict[str, float | None]
    told: tuple[str, ...]


class OwnRecord(NamedTuple):
    """Data of one connection by a user's law."""

    scale: Array  # (n,) scale of motion of each component
    exchange: Array  # (VALUES_AT + p,) arguments and results of a call, then p parameters


_read = record_reader(OwnRecord(np.zeros(1), np.zeros(1)))


class OwnKernel(Kernel):
    """Kernel of a law, which numba compiles at first use.

    Attributes
    ----------
    raised : exception that the law's function in Python has raised last, None for a compiled one
    """

    def __init__(self, law: Function) -> None:
        def named() -> None:
            """Stand-in that gives the kernel its name; no library of machine code contains it."""

        named.__module__, named.__name__ = "own_law", law.name
        super().__init__(named)
        self.raised: BaseException | None = None
        self._law = law
        self._made: Any = None

    @property
    def dispatcher(self) -> Any:
        """The law's compiled kernel; warns if its function is called in Python."""
        if self._made is None:
            self._made = self._compiled()
        return self._made

    def _compiled(self) -> Any:
        law, why = self._law, ""
        if law.compiled is not False:
            why = _raises(law.function) or (_raises(law.tangent) if law.tangent else "")
            if not why:
                try:
                    return _whole(law, _jit(_answer(law, _jit(law.function), law.tangent and _jit(law.tangent))))
                except Exception as error:  # compilation errors have many classes, not all of them numba's
                    why = _reason(error)
        if law.compiled:
            raise InputError(f"own law '{law.name}': numba cannot compile it ({why}); leave out compiled=True")
        back, seconds = self._callback()
        calls = 2 if law.tangent else 1 + 4 * len(law.axes)
        because = f" because numba cannot compile it ({why})" if why else ""
        warnings.warn(
            f"own law '{law.name}' runs in Python{because}: {1e6 * seconds:.2g} us a call and {calls} calls at each "
            "iteration, where compiled code takes some 0.02 us; the run is slow",
            stacklevel=2,
        )
        return _whole(law, _jit(_call_back(back)))

    def _callback(self) -> tuple[Any, float]:
        """C callback of the function, whose argument is the address of the exchange; also the time of one call in s."""
        law = self._law
        entry = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(self._called)
        probe = np.zeros(VALUES_AT + len(law.parameters))
        address = int(probe.ctypes.data)
        entry(address)
        begin = time.perf_counter()
        for _ in range(TRIED):
            entry(address)
        seconds, self.raised = (time.perf_counter() - begin) / TRIED, None
        return entry, seconds

    def _called(self, address: int) -> int:
        """Evaluate the Python function on the exchange at an address. Return 0, or FAILURE (error in ``raised``)."""
        law = self._law
        size, count = len(law.axes), len(law.parameters)
        told = (ctypes.c_double * (VALUES_AT + count)).from_address(address)
        named = dict(zip(law.parameters, told[VALUES_AT:], strict=True))
        if "angle" in law.told:
            named["angle"] = told[ANGLE_AT]
        if "speed" in law.told:
            named["speed"] = told[SPEED_AT]
        one = size == 1
        place = told[0] if one else tuple(told[0:size])
        velocity = told[VELOCITY_AT] if one else tuple(told[VELOCITY_AT : VELOCITY_AT + size])
        try:
            found = law.function(place, velocity, **named)
            for r, force in enumerate((found,) if one else found):
                told[FORCE_AT + r] = force
            if law.tangent is not None:
                for at, rows in zip((BY_PLACE_AT, BY_VELOCITY_AT), law.tangent(place, velocity, **named), strict=True):
                    for r, row in enumerate(((rows,),) if one else rows):
                        told[at + MOST_AXES * r : at + MOST_AXES * r + size] = row
        except BaseException as error:  # exceptions do not pass through C; the run reports it when its step fails
            self.raised = error
            return FAILURE
        return 0


def _jit(function: Callable[..., Any]) -> Any:
    """Compile a function for use in other kernels; functions of users may allocate memory."""
    return compiler().njit(**{key: value for key, value in OPTIONS.items() if key != "_nrt"})(function)


def _answer(law: Function, function: Any, tangent: Any) -> Callable[..., Any]:
    """Make ``answer(exchange, with_tangent)``, which evaluates a compiled function on an exchange and returns 0."""
    size = len(law.axes)

    def numbers(begin: int) -> str:
        listed = [f"exchange[{begin + k}]" for k in range(size)]
        return listed[0] if size == 1 else f"({', '.join(listed)})"

    place_of = {name: VALUES_AT + k for k, name in enumerate(law.parameters)} | {"angle": ANGLE_AT, "speed": SPEED_AT}
    more = "".join(f", exchange[{place_of[name]}]" for name in law.arguments)
    call = f"({numbers(0)}, {numbers(VELOCITY_AT)}{more})"
    lines = ["def answer(exchange, with_tangent):", f"    found = function{call}"]
    of = [""] if size == 1 else [f"[{r}]" for r in range(size)]
    lines += [f"    exchange[{FORCE_AT + r}] = found{one}" for r, one in enumerate(of)]
    if tangent is not None:
        lines += ["    if with_tangent:", f"        by_place, by_velocity = tangent{call}"]
        for name, at in (("by_place", BY_PLACE_AT), ("by_velocity", BY_VELOCITY_AT)):
            lines += [
                f"        exchange[{at + MOST_AXES * r + s}] = {name}{'' if size == 1 else f'[{r}][{s}]'}"
                for r in range(size)
                for s in range(size)
            ]
    lines.append("    return 0")
    space: dict[str, Any] = {"function": function, "tangent": tangent}
    exec("\n".join(lines), space)
    found: Callable[..., Any] = space["answer"]
    return found


def _call_back(entry: Any) -> Callable[..., Any]:
    """Make ``answer(exchange, with_tangent)`` that calls a C function with the address of the exchange."""

    def answer(exchange, with_tangent):
        return entry(exchange.ctypes.data)

    return answer


def _whole(law: Function, answer: Any) -> Any:
    """Compile the law's kernel for the argument types of all laws."""
    made = _jit(_kernel(answer, len(law.axes), law.tangent is not None))
    numba = compiler()
    place, other, memory, out = np.zeros(4), np.zeros(on.NUMBERS), np.zeros(1), np.zeros(on.SIZE)
    made.compile(tuple(map(numba.typeof, (0, 0, 0, place, place, other, memory, out))))
    return made


def _kernel(answer: Any, size: int, exact: bool) -> Callable[..., Any]:
    """Kernel around an ``answer``: forces, checked, and tangents, see :mod:`cranktrain.film.laws.films`."""

    def evaluate(exchange):
        for r in range(size):
            exchange[FORCE_AT + r] = math.nan
        exchange[FAILED_AT] = RAISED
        failed = answer(exchange, exact)
        if failed != 0:
            return FAILURE
        exchange[FAILED_AT] = NOT_FINITE
        for r in range(size):
            if not math.isfinite(exchange[FORCE_AT + r]):
                return FAILURE
        exchange[FAILED_AT] = FINE
        return 0

    evaluate = _jit(evaluate)

    def own_law(record, action, i, place, velocity, numbers, memory, out):
        own = _read(record)
        exchange = own.exchange
        for k in range(on.SIZE):
            out[k] = 0.0
        for r in range(size):
            out[r] = math.nan  # the value stays NaN if compiled code raises an exception
            exchange[r] = place[r]
            exchange[VELOCITY_AT + r] = velocity[r]
        exchange[ANGLE_AT] = numbers[on.ANGLE]
        exchange[SPEED_AT] = numbers[on.RUBBING]
        status = evaluate(exchange)
        if status != 0:
            return FAILURE
        for r in range(size):
            out[r] = exchange[FORCE_AT + r]
        if action == on.OBSERVE:
            return 0
        if exact:
            for r in range(size):
                for s in range(size):
                    out[on.BY_PLACE + 4 * r + s] = exchange[BY_PLACE_AT + 4 * r + s]
                    out[on.BY_VELOCITY + 4 * r + s] = exchange[BY_VELOCITY_AT + 4 * r + s]
            return 0
        for s in range(2 * size):
            at = s if s < size else VELOCITY_AT + s - size
            unit = own.scale[s] if s < size else RATE * own.scale[s - size]
            to = on.BY_PLACE + s if s < size else on.BY_VELOCITY + s - size
            middle = exchange[at]
            step = OF_SCALE * unit + OF_VALUE * abs(middle)
            exchange[at] = middle + step
            above = exchange[at]
            status = evaluate(exchange)
            if status != 0:
                return FAILURE
            for r in range(size):
                out[to + 4 * r] = exchange[FORCE_AT + r]
            exchange[at] = middle - step
            width = above - exchange[at]
            status = evaluate(exchange)
            if status != 0:
                return FAILURE
            for r in range(size):
                out[to + 4 * r] = (out[to + 4 * r] - exchange[FORCE_AT + r]) / width
            exchange[at] = middle
        return 0

    return own_law


def _raises(function: Callable[..., Any] | None) -> str:
    """Reason not to compile a function: compiled code would lose the exceptions it raises; empty if there are none."""
    code = getattr(function, "__code__", None)
    if code is None:
        return "it is no def"
    return "it raises" if any(one.opname == "RAISE_VARARGS" for one in dis.get_instructions(code)) else ""


def _reason(error: Exception) -> str:
    """Most informative line of numba's long message."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    told = [line for line in lines if not line.startswith(("Failed in", "During:", "File ", "-"))]
    return (told or lines or [type(error).__name__])[0][:160]
