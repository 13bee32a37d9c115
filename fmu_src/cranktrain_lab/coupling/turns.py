"""Calls of coupled units by compiled code, see :mod:`cranktrain.core.unit_turns`.

Compiled code calls units whose method ``direct`` returns a :class:`Direct`. The master calls all other units itself.
Both ways give bitwise equal results.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, NoReturn, Protocol

import numpy as np
from numpy.typing import NDArray

from cranktrain.core import unit_turns as at
from cranktrain.core.kernel import bound_call
from cranktrain.core.records import address_of
from cranktrain.core.reduced_body import Array
from cranktrain_lab.coupling.connections import Wiring
from cranktrain_lab.coupling.exchanged_values import ExchangedValues
from cranktrain_lab.coupling.reconstruction import POINTS
from cranktrain_lab.coupling.unit import Unit

Notes = NDArray[np.int64]


class Told(NamedTuple):
    """Results of an FMI 3.0 step: True if the simulation ended, True if the step returned early, and its time (s)."""

    ended: bool
    early: bool
    reached: float


class Failed(NamedTuple):
    """Failed call of a unit: the kernel's number of the call, status, inputs (k,) of the unit, result of the step."""

    call: int
    status: int
    inputs: Array
    told: Told


class Failing(Protocol):
    """Function that raises the error of a failed call of a unit."""

    def __call__(self, failed: Failed) -> NoReturn: ...  # noqa: D102


class Calls(NamedTuple):
    """C functions of a loaded unit.

    Attributes
    ----------
    version : FMI version, ``FMI_2`` or ``FMI_3`` of the kernel
    set, step, get, component : addresses of ``fmi2SetReal`` or ``fmi3SetFloat64``, of ``fmi2DoStep`` or ``fmi3DoStep``,
        of ``fmi2GetReal`` or ``fmi3GetFloat64``, and of the instance
    """

    version: int
    set: int
    step: int
    get: int
    component: int


class Direct(NamedTuple):
    """Description of a loaded unit for compiled code.

    Attributes
    ----------
    calls : C functions of the unit
    given, taken : buffers of its inputs and outputs, with the linked elements
    no_state_before : True if no earlier state will be set
    fail : called for a bad status, or if a step of FMI 3.0 returned early or ended the simulation
    notes, place : record of calls (None: not recorded), and the unit's number in the record
    """

    calls: Calls
    given: ExchangedValues
    taken: ExchangedValues
    no_state_before: bool
    fail: Failing
    notes: Notes | None = None
    place: int = 0


class Vectors(NamedTuple):
    """Vectors of a co-simulation master for its n outputs: known values, values at earlier points, and extremes.

    Shapes: ``known`` (3 n,), ``samples`` (POINTS, n), ``extremes`` (2, n).
    """

    known: Array
    samples: Array
    extremes: Array


class Turns:
    """Units that compiled code calls, by their index in the order of a master's units.

    Attributes
    ----------
    until : for each index the end of the sequence of direct units from there; the index itself for other units
    inputs : linked inputs of direct units as last written, by unit name
    arguments : arguments of the kernel
    """

    def __init__(
        self, order: Sequence[Unit], asked: Mapping[str, Unit], wirings: Mapping[str, Wiring],
        parts: Mapping[str, slice], vectors: Vectors,
    ) -> None:  # fmt: skip
        """Prepare calls of those units in ``asked`` that are direct, with their wirings and slices of outputs."""
        known = vectors.known
        offers: dict[str, Any] = {name: getattr(unit, "direct", None) for name, unit in asked.items()}
        found: dict[str, Direct | None] = {name: offer and offer() for name, offer in offers.items()}
        chosen = {name: one for name, one in found.items() if one is not None and not wirings[name].modified}
        self._chosen, self._order = chosen, order
        self._units = np.zeros((len(order), at.COLUMNS), dtype=np.int64)
        count = sum(len(wirings[name].names) for name in chosen)
        self._wires, self._values = np.zeros((count, at.WIRES)), np.zeros(count)
        self._places = np.zeros((count, at.ENDS), dtype=np.int64)
        self._sources = np.zeros(known.size // 3, dtype=np.int64)
        blocks = [values.values for one in chosen.values() for values in (one.given, one.taken)]
        self._exchanged = np.concatenate([np.empty(0), *blocks])
        self.inputs: dict[str, Array] = {}
        self._fill(wirings, parts)
        self._control, self._numbers = np.zeros(at.CONTROLS, dtype=np.int64), np.zeros(at.OLD_WEIGHT + POINTS)
        for slot, own in ((at.EVENT_AT, at.EVENT), (at.ENDED_AT, at.ENDED), (at.EARLY_AT, at.EARLY)):
            self._control[slot] = address_of(self._control[own:])
        self._control[at.REACHED_AT] = address_of(self._numbers[at.REACHED :])
        noted = [one.notes for one in chosen.values() if one.notes is not None]
        notes = noted[-1] if noted else np.zeros(at.NOTE_SLOTS, dtype=np.int64)
        tables = self._units, self._wires, self._places, self._values, self._sources, self._exchanged
        self.arguments = (self._control, self._numbers, *tables, *vectors, notes)
        ends = [0] * len(self._order)
        for k in reversed(range(len(ends))):
            if self._order[k].name in self._chosen:
                ends[k] = ends[k + 1] if k + 1 < len(ends) and ends[k + 1] > k + 1 else k + 1
            else:
                ends[k] = k
        self.until = ends
        if chosen:
            self._call = bound_call(at.take_turns, self.arguments)

    def _fill(self, wirings: Mapping[str, Wiring], parts: Mapping[str, slice]) -> None:
        """Fill the kernel's tables of units, and the indices of their inputs and outputs."""
        rows = {unit.name: row for unit, row in zip(self._order, self._units, strict=True)}
        first = begin = 0
        for name, one in self._chosen.items():
            row, taken, part = rows[name], wirings[name], parts[name]
            end = first + len(taken.names)
            self.inputs[name] = self._values[first:end]
            self._wires[first:end] = np.column_stack([taken.scale, taken.shift, taken.low, taken.high])
            self._places[first:end, at.SOURCE] = taken.places
            row[[at.VERSION, at.SET, at.DO_STEP, at.GET, at.COMPONENT]] = one.calls
            row[[at.NO_STATE_BEFORE, at.PLACE]] = int(one.no_state_before), one.place
            row[[at.IN_FIRST, at.IN_END, at.OUT_FIRST, at.OUT_END]] = first, end, part.start, part.stop
            for values, column in ((one.given, at.IN_REFERENCES), (one.taken, at.OUT_REFERENCES)):
                where = address_of(self._exchanged[begin:])
                numbers = address_of(values.references), values.references.size, where, values.values.size
                row[column : column + len(numbers)] = numbers
                if values is one.given:
                    self._places[first:end, at.TARGET] = begin + values.places
                else:
                    self._sources[part] = begin + values.places
                begin += values.values.size
            first = end

    def weigh(self, weights: Sequence[float]) -> None:
        """Set the weights with which the next step averages an input: for its new value, then for earlier points."""
        self._control[at.OLDER] = len(weights) - 1
        self._numbers[at.NEW_WEIGHT : at.NEW_WEIGHT + len(weights)] = weights

    def take(self, what: int, first: int, end: int, time: float, size: float) -> None:
        """Let units ``first`` to ``end`` write, step and read; ``what`` are flags of these actions.

        ``UnitError`` without unit and time if a call fails; ``KeyboardInterrupt`` if the notes request a stop.
        """
        control, numbers = self._control, self._numbers
        control[at.WHAT], control[at.FIRST], control[at.END] = what, first, end
        numbers[at.TIME], numbers[at.SIZE] = time, size
        found = self._call()
        if found == at.STOPPED:
            raise KeyboardInterrupt
        if found == at.REFUSED:
            unit = self._order[int(control[at.FAILED])]
            told = Told(bool(control[at.ENDED]), bool(control[at.EARLY]), float(numbers[at.REACHED]))
            failed = Failed(int(control[at.CALL]), int(control[at.STATUS]), self.inputs[unit.name], told)
            self._chosen[unit.name].fail(failed)

    def arrive(self) -> bool:
        """Store the newest values as a communication point and return True, if all are finite."""
        self._control[at.WHAT], self._control[at.END] = at.ARRIVE, self._control[at.FIRST]
        return self._call() == at.DONE

    @property
    def failed(self) -> tuple[Unit, bool]:
        """Return the unit whose call failed last, and True if this call was a step."""
        return self._order[int(self._control[at.FAILED])], self._control[at.CALL] == at.STEPPING
