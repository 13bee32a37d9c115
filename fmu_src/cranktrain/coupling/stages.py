"""Exchange at the stages of the last unit's integrator, which asks for its inputs there ahead of its step (FMI 3.0).

The last unit knows at which times within a step its integrator evaluates forces, and calls its master for each of these
times before it steps. The other units step from one of them to the next, each with the previous units' outputs at the
end of such a part, and their outputs there are set. The last unit's own outputs are not known there yet: the
others get them extrapolated by the parabola through the last communication points.

A unit that asks has the attribute ``updates``, true, and a method ``listen`` that takes two functions to call with a
time in s: at a point that the unit has reached, and at one that lies ahead of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.coupling.kernels.exchange import MEAN, READ, WRITE
from cranktrain.coupling.reconstruction import weights_at
from cranktrain.coupling.unit import Unit, UnitError

Master: TypeAlias = Any
"""A :class:`cranktrain.coupling.master.Master`, which imports this module."""
NONE = 1.0e-9
"""Part of a step, over its length, that is none: the times of two stages differ by rounding."""


class AtStages:
    """Exchange at the stages of the last unit in a master's order."""

    def __init__(self, order: Sequence[Unit]) -> None:
        """Listen to the last unit; ``InputError`` if it does not call its master."""
        unit: Any = order[-1]
        if not getattr(unit, "updates", False):
            raise InputError(
                f"scheme 'stages': {unit.name} does not call its master inside a step; take gauss-seidel, or an FMU of "
                "FMI 3.0 with providesIntermediateUpdate (build_fmu.py --fmi 3.0)"
            )
        self._unit, self._place = unit, len(order) - 1
        self._master: Master = None
        self._error: BaseException | None = None
        self._none = self._end = 0.0
        self._asked_for = 0
        self._trial = False
        self._foreseen: tuple[float, Array, float, Array] | None = None
        unit.listen(self._reached, self._asked)

    def step(self, master: Master, size: float) -> None:
        """One communication step (s) of all units; ``UnitError`` names the unit that fails, with the time."""
        begin = master.time
        self._master, self._none, self._asked_for = master, NONE * size, 0
        self._foreseen, self._trial = None, False
        try:
            if len(master._samples.places) == 1 and master.restorable:
                self._foresee(begin, size)
            self._take(begin, size)
            if not self._asked_for:
                raise UnitError(
                    f"{self._unit.name}, step from {begin:.6g} s: it did not ask for inputs within its step; set its "
                    "input.reconstruction to stages, or take gauss-seidel"
                )
            self._lead(begin + size)
            self._read(begin + size)
            master.sweeps += 1
        finally:
            self._master = None

    def _foresee(self, begin: float, size: float) -> None:
        """Know the last unit's outputs at the end of a first step, before which there is nothing to draw a line from.

        All units take the step once, the others in one go, and take it back.
        """
        master = self._master
        states, known = [unit.keep() for unit in master._order], master._known.copy()
        self._trial, self._end = True, begin + size
        self._take(begin, size)
        self._read(begin + size)
        first, part = known[len(master.names) :][self._part], master.newest[self._part]
        self._foreseen = begin, first.copy(), size, part - first
        self._trial, self._asked_for, master.time = False, 0, begin
        master._known[:] = known
        for unit, state in zip(master._order, states, strict=True):
            unit.restore(state)

    def _take(self, begin: float, size: float) -> None:
        """Let the last unit take its step; what failed in a call goes first."""
        self._error = None
        try:
            self._unit.step(begin, size)
        except UnitError as error:
            if self._error is None:
                when = f"step from {begin:.6g} s to {begin + size:.6g} s"
                raise UnitError(f"{self._unit.name}, {when}: {error}") from None
        if self._error is not None:
            raise self._error

    def _reached(self, time: float) -> None:
        """The last unit stands at a point within the step."""
        self._guarded(self._arrive, time)

    def _asked(self, time: float) -> None:
        """The last unit asks for its inputs at a time ahead."""
        self._guarded(self._give, time)

    def _guarded(self, call: Any, time: float) -> None:
        """Nothing may be raised into the unit that calls."""
        if self._error is not None or self._master is None:
            return
        try:
            call(time)
        except BaseException as error:  # an interrupt too: the unit would swallow it
            self._error = error

    def _arrive(self, time: float) -> None:
        master = self._master
        if self._trial:
            return
        self._lead(time)
        self._read(time)
        master.arrive()

    def _give(self, time: float) -> None:
        """Inputs of the last unit at a time ahead of it."""
        master = self._master
        self._asked_for += 1
        self._lead(time)
        master._let(WRITE, self._place, self._place + 1, 0.0, time)

    def _lead(self, time: float) -> None:
        """Step the other units to a time, s."""
        master = self._master
        time = self._end if self._trial else time
        size = time - master.time
        if size <= self._none:
            return
        if not self._trial:
            self._expect(master.time, time)
        master._one_by_one(0, self._place, size, time)
        master.time = time

    def _expect(self, begin: float, end: float) -> None:
        """What the other units know in a part of the step: the last unit's outputs at its begin, and their means.

        An angle goes from its begin to its end by the mean of the speed, just as it would by the speed itself.
        """
        master, part = self._master, self._part
        first, middle, last = (self._ahead(time) for time in (begin, 0.5 * (begin + end), end))
        master.newest[part] = first
        master.start[:] = master.newest
        master.means[part] = (first + 4.0 * middle + last) / 6.0

    def _ahead(self, time: float) -> Array:
        """The last unit's outputs at a time within the step."""
        if self._foreseen is not None:
            begin, first, size, change = self._foreseen
            return first + (time - begin) / size * change
        samples = self._master._samples
        nodes = samples.places
        return np.asarray(np.array(weights_at(time, nodes)) @ samples.values[: len(nodes), self._part])

    @property
    def _part(self) -> slice:
        """Where the last unit's outputs are among all."""
        part: slice = self._master._parts[self._unit.name]
        return part

    def _read(self, time: float) -> None:
        """The last unit's outputs at a point that it has reached."""
        self._master._let(READ | MEAN, self._place, self._place + 1, 0.0, time)
