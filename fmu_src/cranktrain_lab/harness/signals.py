"""Events of a scenario: inputs that depend on time, connections with noise or interruptions, units with faults.

Signals are outputs of a separate unit without inputs, so every scheme uses their value at a step's end for that step.
"""

import ctypes
import faulthandler
import math
import time as clock
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain_lab.coupling.unit import Around, Port, Unit, UnitError
from cranktrain_lab.harness.entries import DIES, FAILS, HANGS, LAST, NAN, ZERO, Fault

SIGNALS = "signals"
"""Name of the unit whose outputs are the signals."""
_JUST = 1.0 - 1.0e-12
"""Factor on a time that gives a time just before it, earlier by the rounding error."""


class Curve:
    """Piecewise linear function of time. It jumps just after a time at which it has two points."""

    def __init__(self, start: float) -> None:
        self.times, self.values = [0.0], [start]

    def go(self, begin: float, end: float, value: float) -> None:
        """Append a linear change from the last value to another."""
        self.times += [begin, end]
        self.values += [self.values[-1], value]

    def at(self, time: float) -> float:
        """Return the value at a time, before a jump at this time; at the start, after the jump."""
        if time <= 0.0:
            return self.values[max(k for k, at in enumerate(self.times) if at <= 0.0)]
        k = int(np.searchsorted(self.times, _JUST * time))
        if k == len(self.times):
            return self.values[-1]
        before, after = self.times[k - 1], self.times[k]
        share = (time - before) / (after - before)
        return self.values[k - 1] + share * (self.values[k] - self.values[k - 1])


class Signals(Unit):
    """Unit (:class:`cranktrain_lab.coupling.unit.Unit`) whose outputs are curves; ``ports`` describe driven inputs."""

    restorable = True

    def __init__(self, curves: Mapping[str, Curve], ports: Mapping[str, Port]) -> None:
        self.name = SIGNALS
        self.inputs: Mapping[str, Port] = {}
        self.outputs: Mapping[str, Port] = dict(ports)
        self._curves, self._time = curves, 0.0

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Choose the inputs that ``write`` sets and the outputs that ``read`` returns."""
        self._read = [self._curves[name] for name in outputs]

    def initialize(self, time: float) -> None:
        """Prepare the unit for steps from ``time`` (s) on."""
        self._time = time

    def read(self) -> Array:
        """Return the values (k,) of the k linked outputs."""
        return np.array([curve.at(self._time) for curve in self._read])

    def step(self, time: float, size: float) -> None:
        """Advance the unit from ``time`` (s) by one step of ``size`` (s)."""
        self._time = time + size

    def keep(self, held: Any = None) -> Any:
        """Return the unit's state; memory of the earlier state ``held`` may be reused."""
        return self._time

    def restore(self, state: Any) -> None:
        """Restore a state of the unit that ``keep`` returned."""
        self._time = state


class Noisy:
    """Modifier of a connection that adds noise between two times; equal times get equal noise."""

    def __init__(self, begin: float, end: float, size: float, seed: tuple[int, ...]) -> None:
        self._begin, self._end, self._size, self._seed = _JUST * begin, _JUST * end, size, seed

    def __call__(self, time: float, value: float) -> float:
        """Return the connection's value with noise added."""
        if not self._begin <= time < self._end:
            return value
        # A repeated step must get the same values, so the noise is a function of the time.
        drawn = np.random.default_rng((*self._seed, *np.array([time]).view(np.uint32).tolist()))
        return value + self._size * float(drawn.standard_normal())


class DroppedOut:
    """Modifier of a connection that gives the last value before, zero, or NaN between two times."""

    def __init__(self, begin: float, end: float, gives: str) -> None:
        self._begin, self._end, self._gives = _JUST * begin, _JUST * end, gives
        self._last: float | None = None

    def __call__(self, time: float, value: float) -> float:
        """Return the connection's value, or the replacement value during the drop-out."""
        if not self._begin <= time < self._end:
            if time < self._begin:
                self._last = value
            return value
        held = value if self._last is None else self._last
        self._last = held
        return {LAST: held, ZERO: 0.0, NAN: math.nan}[self._gives]


def in_turn(modifiers: Sequence[Callable[[float, float], float]]) -> Callable[[float, float], float]:
    """Return one modifier that applies several in sequence."""

    def modify(time: float, value: float) -> float:
        for one in modifiers:
            value = one(time, value)
        return value

    return modify


class Faulty(Around):
    """Wrapper of a unit with a fault from a time on."""

    def __init__(self, unit: Unit, fault: Fault) -> None:
        super().__init__(unit)
        self._fault, self._now = fault, -math.inf

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Choose the inputs that ``write`` sets and the outputs that ``read`` returns."""
        wrong = [k for k, name in enumerate(outputs) if self._fault.output in ("", name)]
        self._wrong = wrong if self._fault.kind == NAN else []
        super().link(inputs, outputs)

    def read(self) -> Array:
        """Return the values (k,) of the k linked outputs."""
        found = super().read()
        if self._wrong and self._now > self._fault.begin:
            found = found.copy()
            found[self._wrong] = math.nan
        return found

    def step(self, time: float, size: float) -> None:
        """Advance the unit from ``time`` (s) by one step of ``size`` (s)."""
        self._now = _JUST * (time + size)
        # Faults of all kinds begin in the step that contains their time.
        if self._now > self._fault.begin:
            if self._fault.kind == FAILS:
                raise UnitError("fails, as its scenario says")
            while self._fault.kind == HANGS:
                clock.sleep(1.0)
            if self._fault.kind == DIES:
                faulthandler.disable()
                ctypes.string_at(0)
        super().step(time, size)
