"""Load torque given by a script, as an array over the angle of the loaded end or a function of its angle and speed.

The loaded end is the dynamometer's rotor, the far end of the drive line. Its angle ψ (rad, whole turns counted) is 0 at
crank angle 0 without wind-up of the drive line; behind gears it turns faster or slower than the crank. Over a
communication step the torque is a straight line, from its value at the step's begin to the value at the angle and
speed extrapolated to its end,

    T(t) = T₀ + (T₁ − T₀) t/h,    T₁ = T(ψ + ω h + α h²/2, ω + α h),    α = (ω − ω₋)/h₋

which is of second order in h. A torque that depends on speed is at most half a step late, in which the speed changes
little because of the rotor's inertia.
"""

import math
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from cranktrain.core.argument_checks import called, takes_two, without_unit
from cranktrain.core.errors import InputError, shown
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import state as st
from cranktrain.dynamics.model.records import ModelArrays
from cranktrain.dynamics.model.state import offset

LoadValues: TypeAlias = ArrayLike | Callable[..., float]
NAME = "load_torque_nm"
"""Keyword of the load torque in scripts; error messages begin with it."""
CYCLE = 4.0 * math.pi
LARGEST = 1e6
FEWEST = 2


class LoadTorque:
    """Torque (N m) on the loaded end over its angle (rad) and speed (rad/s).

    Parameters
    ----------
    value : array (n,) at equal steps over 720 degrees, straight between its values, ``function(angle)`` or
        ``function(angle, speed)``

    Raises
    ------
    InputError
        one line: no array of finite numbers, a function that returns none
    """

    def __init__(self, value: Any) -> None:
        self.table: Array | None = None
        self.function: Callable[..., float] | None = None
        if callable(value):
            self.function, self._fast = value, takes_two(value)
            return
        try:
            table = np.array(without_unit(value, "N m", NAME), dtype=float)
        except (TypeError, ValueError):
            raise InputError(
                f"{NAME} is {shown(value)}, a {type(value).__name__}; give a number, an array over 720 deg or a "
                "function of angle and speed"
            ) from None
        if table.ndim != 1 or table.size < FEWEST:
            raise InputError(f"{NAME}: {shown(value)} has the shape {table.shape}; give at least {FEWEST} values (n,)")
        wrong = np.flatnonzero(~(np.abs(table) <= LARGEST))
        if wrong.size:
            raise InputError(
                f"{NAME}: value [{wrong[0]}] is {table[wrong[0]]:g}; give finite numbers within {LARGEST:g} N m"
            )
        self.table = table

    def at(self, angle: float, speed: float) -> float:
        """Torque (N m) at an angle and speed of the loaded end; ``InputError`` for an invalid result."""
        if self.table is not None:
            place = (angle / CYCLE) % 1.0 * self.table.size
            k = int(place) % self.table.size
            after = self.table[(k + 1) % self.table.size]
            return float(self.table[k] + (place - int(place)) * (after - self.table[k]))
        assert self.function is not None
        where = f"{NAME}: at {math.degrees(angle):.5g} deg and {speed:.5g} rad/s"
        torque = called(self.function, (angle, speed)[: 1 + self._fast], where, "N m")
        if abs(torque) > LARGEST:
            raise InputError(f"{where} the function returns {torque:.4g} N m; at most {LARGEST:g} N m are possible")
        return torque

    def mean(self, speed: float, samples: int = 720) -> float:
        """Mean torque over 720 degrees at a steady speed, N m."""
        return float(np.mean([self.at(CYCLE * k / samples, speed) for k in range(samples)]))


class LoadFollower:
    """Load torque as input of a run: value and rate over a communication step."""

    def __init__(self, load: LoadTorque) -> None:
        self.load = load
        self._before: tuple[float, float] | None = None  # time, s, and speed, rad/s, of the last step's begin

    def over(self, model: ModelArrays, state: Array, end_speed: float, t_end: float) -> tuple[float, float]:
        """Torque (N m) at the state's time and its rate (N m/s) over the step to ``t_end``.

        ``end_speed`` is the speed ratio of loaded end and crank.
        """
        angle, speed = loaded_end(model, state, end_speed)
        time, change = float(state[st.TIME]), 0.0
        if self._before is not None and time > self._before[0]:
            change = (speed - self._before[1]) / (time - self._before[0])
        self._before = time, speed
        h = t_end - time
        now = self.load.at(angle, speed)
        if not h > 0.0:
            return now, 0.0
        return now, (self.load.at(angle + h * (speed + 0.5 * h * change), speed + h * change) - now) / h


def loaded_end(model: ModelArrays, state: Array, end_speed: float) -> tuple[float, float]:
    """Angle (rad) and speed (rad/s) of the dynamometer's rotor at a state."""
    n, turning = model.omega2.size, model.rotor.size
    q, v = (state[offset(kind, n) :][:turning] for kind in (st.POSITION, st.VELOCITY))
    angle = end_speed * (state[st.SHAFT_ANGLE] + state[st.LEAD_ANGLE]) + float(model.rotor @ q)
    return float(angle), float(end_speed * (state[st.SHAFT_SPEED] + state[st.LEAD_SPEED]) + float(model.rotor @ v))
