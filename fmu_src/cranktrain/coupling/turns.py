"""Turns of units that compiled code can call, see :mod:`cranktrain.coupling.kernels.exchange`.

A unit that has a method ``direct`` returns a :class:`Direct` from it, or None; all other units are called by the master
itself. Both ways give the same bits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, NoReturn, Protocol

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import bound_call
from cranktrain.core.records import address_of
from cranktrain.core.reduced_body import Array
from cranktrain.coupling.connections import Wiring
from cranktrain.coupling.kernels import exchange as at
from cranktrain.coupling.reconstruction import POINTS
from cranktrain.coupling.unit import Unit

Notes = NDArray[np.int64]


class Failing(Protocol):
    """Raises the error of a call of a unit: ``call`` of the kernel's, its status and the inputs (k,) it was given."""

    def __call__(self, call: int, status: int, inputs: Array) -> NoReturn: ...  # noqa: D102


class Direct(NamedTuple):
    """A loaded unit's C functions, those of FMI 2.0, for the inputs and outputs that it was linked with.

    Attributes
    ----------
    set, step, get, component : addresses of ``fmi2SetReal``, ``fmi2DoStep``, ``fmi2GetReal`` and of the instance
    in_references, out_references : references of the linked inputs and outputs, uint32
    no_state_before : whether no earlier state will be set
    fail : called where a status is not good
    notes, place : where calls are noted, and the unit's number there; None: nowhere
    """

    set: int
    step: int
    get: int
    component: int
    in_references: NDArray[np.uint32]
    out_references: NDArray[np.uint32]
    no_state_before: bool
    fail: Failing
    notes: Notes | None = None
    place: int = 0


class Vectors(NamedTuple):
    """Vectors of a master: known values (3 n,), of earlier points (POINTS, n), least and largest so far (2, n)."""

    known: Array
    samples: Array
    extremes: Array


class Turns:
    """Turns of the units that are direct, by their places in the order of a master's units.

    Attributes
    ----------
    until : of each place, the end of the direct units that follow one another from there; the place itself for others
    inputs : linked inputs of direct units by their names, as last written
    arguments : of the kernel
    """

    def __init__(
        self, order: Sequence[Unit], asked: Mapping[str, Unit], wirings: Mapping[str, Wiring],
        parts: Mapping[str, slice], vectors: Vectors,
    ) -> None:  # fmt: skip
        """Ask ``asked`` of the units in ``order`` for their functions; they have these wirings and parts of outputs."""
        known = vectors.known
        found = {name: _direct(unit) for name, unit in asked.items()}
        chosen = {name: one for name, one in found.items() if one is not None and not wirings[name].modified}
        count = sum(len(wirings[name].names) for name in chosen)
        self._units = np.zeros((len(order), at.COLUMNS), dtype=np.int64)
        self._wires, self._places = np.zeros((count, at.WIRES)), np.zeros(count, dtype=np.int64)
        self._values = np.zeros(count)
        self._chosen, self._order = chosen, order
        self.inputs: dict[str, Array] = {}
        n, first = known.size // 3, 0
        notes = None
        for row, unit in zip(self._units, order, strict=True):
            if unit.name not in chosen:
                continue
            one, taken, part = chosen[unit.name], wirings[unit.name], parts[unit.name]
            end = first + len(taken.names)
            self.inputs[unit.name] = values = self._values[first:end]
            self._places[first:end] = taken.places
            self._wires[first:end] = np.column_stack([taken.scale, taken.shift, taken.low, taken.high])
            row[[at.SET, at.DO_STEP, at.GET, at.COMPONENT]] = one.set, one.step, one.get, one.component
            row[[at.IN_REFERENCES, at.OUT_REFERENCES]] = address_of(one.in_references), address_of(one.out_references)
            row[[at.IN_FIRST, at.IN_END, at.OUT_FIRST, at.OUT_END]] = first, end, part.start, part.stop
            row[[at.IN_VALUES, at.OUT_VALUES]] = address_of(values), address_of(known[n + part.start :])
            row[[at.NO_STATE_BEFORE, at.PLACE]] = int(one.no_state_before), one.place
            notes = one.notes if one.notes is not None else notes
            first = end
        self._control, self._numbers = np.zeros(at.CONTROLS, dtype=np.int64), np.zeros(at.OLD_WEIGHT + POINTS)
        notes = np.zeros(at.NOTE_SLOTS, dtype=np.int64) if notes is None else notes
        arrays = self._units, self._wires, self._places, self._values, *vectors, notes
        self.arguments = (self._control, self._numbers, *arrays)
        self.until = self._ends()
        if chosen:
            self._call = bound_call(at.take_turns, self.arguments)

    def _ends(self) -> list[int]:
        ends = [0] * len(self._order)
        for k in reversed(range(len(ends))):
            if self._order[k].name in self._chosen:
                ends[k] = ends[k + 1] if k + 1 < len(ends) and ends[k + 1] > k + 1 else k + 1
            else:
                ends[k] = k
        return ends

    def weigh(self, weights: Sequence[float]) -> None:
        """Weights of means over the step to come: of the newest value, then of earlier communication points."""
        self._control[at.OLDER] = len(weights) - 1
        self._numbers[at.NEW_WEIGHT : at.NEW_WEIGHT + len(weights)] = weights

    def take(self, what: int, first: int, end: int, time: float, size: float) -> None:
        """Let the units from place ``first`` to ``end`` write, step and read, whatever ``what`` has of it.

        ``UnitError`` where a call fails, of a message without unit and time; ``KeyboardInterrupt`` if the notes ask.
        """
        control, numbers = self._control, self._numbers
        control[at.WHAT], control[at.FIRST], control[at.END] = what, first, end
        numbers[at.TIME], numbers[at.SIZE] = time, size
        found = self._call()
        if found == at.STOPPED:
            raise KeyboardInterrupt
        if found == at.REFUSED:
            unit = self._order[int(control[at.FAILED])]
            call, status = int(control[at.CALL]), int(control[at.STATUS])
            self._chosen[unit.name].fail(call, status, self.inputs[unit.name])

    def arrive(self) -> bool:
        """Remember the newest values as those of a communication point, if all are finite; whether they are."""
        self._control[at.WHAT], self._control[at.END] = at.ARRIVE, self._control[at.FIRST]
        return self._call() == at.DONE

    @property
    def failed(self) -> tuple[Unit, bool]:
        """The unit whose call failed last, and whether that was its step."""
        return self._order[int(self._control[at.FAILED])], self._control[at.CALL] == at.STEPPING


def no_turns() -> None:
    """Call the kernel for no unit: where its machine code is made."""
    turns = Turns([], {}, {}, {}, Vectors(np.zeros(3), np.zeros((POINTS, 1)), np.zeros((2, 1))))
    at.take_turns(*turns.arguments)


def _direct(unit: Unit) -> Direct | None:
    """What a unit offers."""
    offer = getattr(unit, "direct", None)
    found: Direct | None = None if offer is None else offer()
    return found
