"""Laws of connections that a user writes as functions of Python.

    @ct.law(axes="y")
    def hardening(y, v, stiffness, cubic=0.0, damping=0.0):
        return -stiffness * y - cubic * y**3 - damping * v

    engine = engine.connected("bush", hardening, ("crank.pulley", "ground"), stiffness="2e5 N/mm")

The function takes the displacement of the first end relative to the second one, m or rad, its velocity, and parameters
by name, in SI. It returns the force on the first end, N or N m; the opposite force acts on the second end. With several
axes the first two arguments and the result are tuples. A parameter called ``angle`` is the angle of the crank's frame
(rad, whole turns counted), one called ``speed`` the speed of rotation of the first end relative to the second one,
about z (rad/s).

Axes are the engine's, like those of a spring (:mod:`cranktrain.dynamics.topology.laws`). Rotations are relative to the
frames of both ends, which rotate uniformly. So a displacement about z is the relative rotation of the ends minus that
of their frames; ``speed`` includes the frames.

Numba compiles the function, and the loop over connections calls it like any law. A function that numba cannot compile,
or that raises, is called in Python (:mod:`cranktrain.dynamics.topology.own_kernel`), with one warning. Tangents are
central differences over a thousandth of ``scale``, or come from a function ``tangent`` of the same arguments, which
returns the derivatives of the force by displacement and by velocity. They are used in the Newton iteration, whose
result does not depend on them. A law must not remember earlier calls, because calls belong to iterations, not to time.
"""

from __future__ import annotations

import inspect
import math
import weakref
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.kernel import RECORDS
from cranktrain.core.reduced_body import Array
from cranktrain.core.stated_units import stated
from cranktrain.core.units import to_si
from cranktrain.dynamics.topology.own_kernel import FAILED_AT, MOST_AXES, RAISED, VALUES_AT, OwnKernel, OwnRecord
from cranktrain.dynamics.topology.pieces import ANGLE, LENGTH, FilmParts, Piece, piece_along
from cranktrain.dynamics.topology.values import REST, Frame
from cranktrain.engine.connections import Own
from cranktrain.film.laws.films import IntArray

AXES = ("x", "y", "z", "rx", "ry", "rz")
TOLD = ("angle", "speed")
"""Names of law parameters that the running model supplies, not the connection."""
OWN_LAWS: dict[str, OwnLaw] = {}
"""Laws of this process by name; a later law replaces one of the same name."""
_NAMES: dict[int, tuple[str, OwnLaw]] = {}
"""Connection and law of each existing record, by the address of its exchange."""


class OwnLaw:
    """Force law made of a Python function.

    Attributes
    ----------
    name : name in engine files and messages
    axes : axes from :data:`AXES`, in the order of the function's tuples
    tangent : function of the derivatives, or None
    scale : motion that counts like one clearance, m or rad for each axis
    parameters : default of each parameter, None if it has no default
    told : those of ``angle`` and ``speed`` that the function takes
    """

    def __init__(
        self, function: Callable[..., Any], name: str, axes: tuple[str, ...], tangent: Callable[..., Any] | None,
        scale: tuple[float, ...], compiled: bool | None,
    ) -> None:  # fmt: skip
        # A function that numba has already compiled is compiled again, as part of the law's kernel.
        self.function = getattr(function, "py_func", function)
        self.tangent = getattr(tangent, "py_func", tangent)
        self.name, self.axes, self.scale, self.compiled = name, axes, scale, compiled
        self.arguments = _arguments(self.function, f"law '{name}'")
        if self.tangent is not None and _arguments(self.tangent, f"tangent of law '{name}'") != self.arguments:
            raise InputError(f"law '{name}': its tangent takes other arguments than the law; give it the same, by name")
        self.parameters = {key: value for key, value in self.arguments.items() if key not in TOLD}
        self.told = tuple(key for key in self.arguments if key in TOLD)
        self.kernel = OwnKernel(self)
        self.__doc__, self.__name__ = self.function.__doc__, name

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the user's Python function itself."""
        return self.function(*arguments, **named)

    def __repr__(self) -> str:
        return f"<law {self.name} of {', '.join(self.axes)}: {', '.join(self.arguments) or 'no parameters'}>"

    def stated(self, given: Mapping[str, Any], where: str) -> Own:
        """Data of a connection: the law's name and the values of its parameters in SI; ``InputError``."""
        for key in given:
            if key not in self.parameters:
                raise InputError(f"{where}: law '{self.name}' has no '{key}'; {nearest(key, self.parameters)}")
        values = {}
        for key, usual in self.parameters.items():
            if key not in given and usual is None:
                raise InputError(f"{where}: law '{self.name}' needs '{key}'; add it to the connection")
            values[key] = _value(given.get(key, usual), f"{where}: {key}")
        return Own(self.name, tuple(values), tuple(values.values()))


def law(
    function: Callable[..., Any] | None = None,
    *,
    axes: str | Iterable[str] = "x",
    tangent: Callable[..., Any] | None = None,
    scale: float | Iterable[float] | None = None,
    compiled: bool | None = None,
    name: str | None = None,
) -> Any:
    """Make a Python function a force law of connections; a decorator, ``@ct.law`` or ``@ct.law(axes="x y")``.

    Parameters
    ----------
    function : ``function(displacement, velocity, [angle], [speed], parameters...)``, see this module
    axes : up to four of x, y, z (m) and rx, ry, rz (rad), along and about the engine's axes; the force of each is
        returned, in this order
    tangent : function of the same arguments that returns (by displacement, by velocity): two numbers, for several axes
        two tuples of rows; None: central differences
    scale : motion that counts like one clearance in the convergence test, m or rad, one value or one for each axis;
        None: 50 µm and 1 mrad
    compiled : True: refuse a function that numba cannot compile; False: call it in Python; None: compile if possible
    name : name in engine files; None: that of the function

    Raises
    ------
    InputError
        one line: unknown axes, arguments that no law has
    """
    if function is None:
        return lambda one: law(one, axes=axes, tangent=tangent, scale=scale, compiled=compiled, name=name)
    if not callable(function):
        raise InputError(f"law: {shown(function)} is no function; write @ct.law above a def")
    called = str(name or getattr(function, "__name__", ""))
    if not called.isidentifier():
        raise InputError(f"law: a function called {shown(called)} needs a name; give name='bush'")
    chosen = tuple(axes.replace(",", " ").split() if isinstance(axes, str) else axes)
    for axis in chosen:
        if axis not in AXES:
            raise InputError(f"law '{called}': no axis {shown(axis)}; valid: {', '.join(AXES)}, as in axes='x y rz'")
    if not 1 <= len(chosen) <= MOST_AXES or len(set(chosen)) < len(chosen):
        raise InputError(f"law '{called}': axes {', '.join(chosen)}; give one to four different ones")
    usual = tuple(ANGLE if axis.startswith("r") else LENGTH for axis in chosen)
    scales = usual if scale is None else tuple(np.broadcast_to(np.asarray(scale, float), len(chosen)).tolist())
    if not all(math.isfinite(one) and one > 0.0 for one in scales):
        raise InputError(f"law '{called}': scale {shown(scale)} is not positive; give m or rad, or leave it out")
    made = OWN_LAWS[called] = OwnLaw(function, called, chosen, tangent, scales, compiled)
    return made


def own_law(name: str) -> OwnLaw:
    """User's law by name, of this process; ``InputError`` for an unknown name."""
    if name not in OWN_LAWS:
        known = nearest(name, OWN_LAWS) if OWN_LAWS else "none is known"
        raise InputError(
            f"no own law '{name}' in this process; {known}. Run it from Python after the def with @ct.law, by "
            "ct.simulate(...)"
        )
    return OWN_LAWS[name]


def own_pieces(data: Own, first: Frame, second: Frame) -> list[Piece]:
    """Single piece of a connection, along and about the engine's axes, or for a piston the axes of its cylinder."""
    found = own_law(data.function)
    if len(data.parameters) != len(data.values):
        raise InputError(f"{len(data.parameters)} parameters and {len(data.values)} values; give one for each")
    own = found.stated(dict(zip(data.parameters, data.values, strict=True)), "")
    _try_at_rest(found, own.values)
    frame = first if first.slider is not None and not first.swings else REST

    def record(_: Array, parts: FilmParts) -> OwnRecord:
        made = OwnRecord(np.array(found.scale), np.array([*np.zeros(VALUES_AT), *own.values]))
        key = int(made.exchange.ctypes.data)
        _NAMES[key] = parts.connection, found
        weakref.finalize(made.exchange, _NAMES.pop, key, None)
        return made

    return [
        piece_along(
            frame, found.axes, found.kernel, record, scales=list(found.scale), axes=Frame("crank angle", 1.0),
            rubs=True, carried=True,
        )
    ]  # fmt: skip


def own_failure(addresses: IntArray) -> str:
    """Message in one line about the user's law that has just failed; empty if no law has failed.

    ``addresses`` are those of the connections' records. An interrupt by the user is raised again here.
    """
    for address in addresses.tolist():
        record = RECORDS.get(address)
        if not isinstance(record, OwnRecord) or record.exchange[FAILED_AT] == 0.0:
            continue
        connection, found = _NAMES[int(record.exchange.ctypes.data)]
        raised, size = found.kernel.raised, len(found.axes)
        if isinstance(raised, KeyboardInterrupt):
            raise raised
        place, velocity = record.exchange[:size], record.exchange[MOST_AXES : MOST_AXES + size]
        units = [("rad", "rad/s") if axis.startswith("r") else ("m", "m/s") for axis in found.axes]
        motion = ", ".join(
            f"{axis} = {x:.6g} {one[0]} at {v:.6g} {one[1]}"
            for axis, x, v, one in zip(found.axes, place, velocity, units, strict=True)
        )
        what = "raises an error" if record.exchange[FAILED_AT] == RAISED else "gives no finite force"
        what = f"raises {type(raised).__name__}: {shown(str(raised))}" if raised is not None else what
        return f"connection '{connection}': own law '{found.name}' {what} at {motion}; return a finite force there"
    return ""


def _try_at_rest(found: OwnLaw, values: tuple[float, ...]) -> None:
    """Refuse a function that cannot be called, or that returns no force at rest; ``InputError``."""
    size, named = len(found.axes), dict(zip(found.parameters, values, strict=True))
    rest: Any = 0.0 if size == 1 else (0.0,) * size
    told = dict.fromkeys(found.told, 0.0)
    try:
        result = found.function(rest, rest, **named, **told)
        numbers = [float(result)] if size == 1 else [float(one) for one in result]
    except ZeroDivisionError:
        return  # compiled code continues with infinity, so a failure appears only in the run
    except Exception as error:
        raise InputError(
            f"own law '{found.name}' raises {type(error).__name__} at rest: {shown(str(error))}; it returns "
            f"{'a number' if size == 1 else f'{size} numbers'}"
        ) from None
    if len(numbers) != size:
        raise InputError(f"own law '{found.name}' returns {len(numbers)} forces for {size} axes; return one for each")
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"own law '{found.name}' gives {numbers} at rest; return finite forces there")


def _arguments(function: Callable[..., Any], where: str) -> dict[str, float | None]:
    """Arguments of a function after displacement and velocity, each with its default or None; ``InputError``."""
    try:
        parameters = list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):
        raise InputError(f"{where}: its arguments are not known; write a def with displacement and velocity") from None
    if len(parameters) < 2 or any(one.kind != one.POSITIONAL_OR_KEYWORD for one in parameters):
        raise InputError(
            f"{where}: takes ({', '.join(map(str, parameters))}); write def f(displacement, velocity, parameters...) "
            "with plain arguments"
        )
    found: dict[str, float | None] = {}
    for one in parameters[2:]:
        if one.name in TOLD:
            found[one.name] = None
        else:
            found[one.name] = None if one.default is one.empty else _value(one.default, f"{where}: {one.name}")
    return found


def _value(value: Any, where: str) -> float:
    """Parameter in SI from a number, a text with its unit, or a quantity of pint; ``InputError``."""
    if isinstance(value, str):
        try:
            found = stated(value, "2e5 N/mm")
            return float(to_si(found.number, found.unit))
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
    if hasattr(value, "to_base_units"):
        value = value.to_base_units().magnitude
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not math.isfinite(value):
        raise InputError(f"{where} is {shown(value)}; give a finite number in SI, or a text with a unit")
    return float(value)
