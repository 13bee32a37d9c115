"""Exchange inside a communication step, in which the last unit calls its master at intermediate points (FMI 3.0).

The other units step to the next intermediate point. The last unit gets their outputs there and goes on to that point,
within one call of ``step``. Each part is a step of scheme ``gauss-seidel``.

An FMU does not announce its intermediate points. For each step size the master therefore lets the last unit take one
trial step, which is undone, and records the points. It is an error if later points differ.
"""

from collections.abc import Sequence
from typing import Any

from cranktrain.core.errors import InputError
from cranktrain.core.unit_turns import MEAN, READ, WRITE
from cranktrain_lab.coupling.unit import Master, Unit, UnitError, Updates

CLOSE = 1.0e-5
"""Largest difference of an intermediate point from the expected point, as a fraction of the step size."""
DIGITS = 8
"""Number of digits to which two step sizes must agree to have the same intermediate points."""


class Inside(Updates):
    """Exchange at intermediate points of the last unit in a master's order."""

    def __init__(self, order: Sequence[Unit]) -> None:
        """Register with the last unit; ``InputError`` if it has no intermediate points or cannot restore its state."""
        super().__init__(order, "intermediate")
        if not self._unit.restorable:
            raise InputError(
                f"scheme 'intermediate': {self._unit.name} cannot keep and restore its state, so its intermediate "
                "points cannot be found; take gauss-seidel, or a unit with canGetAndSetFMUState"
            )
        self._shares: dict[str, list[float]] = {}
        self._ends: list[float] = []
        self._noted: list[float] | None = None
        self._close = 0.0
        self._unit.listen(self._guarded(self._called))

    def step(self, master: Master, size: float) -> None:
        """Take one communication step (s) with all units; ``UnitError`` names the unit that fails, with the time."""
        begin = master.time
        shares = self._found(begin, size)
        self._ends = [begin + size * share for share in shares] + [begin + size]
        self._close, self._master = CLOSE * size, master
        try:
            self._lead()
            self._take(begin, size)
            if len(self._ends) > 1:
                raise UnitError(
                    f"{self._unit.name}: no intermediate update at {self._ends[0]:.9g} s, where one was due"
                )
            self._read()
        finally:
            self._master = None

    def _found(self, begin: float, size: float) -> list[float]:
        """Return the intermediate points of a step of this size, as fractions of the step."""
        key = f"{size:.{DIGITS}e}"
        if key not in self._shares:
            state = self._unit.keep()
            self._noted = []
            try:
                self._take(begin, size)
                self._shares[key] = [(time - begin) / size for time in self._noted]
            finally:
                self._noted = None
            self._unit.restore(state)
        return self._shares[key]

    def _called(self, time: float) -> None:
        """Handle the last unit's call at an intermediate point."""
        if self._noted is not None:
            self._noted.append(time)
        elif self._master is not None:
            master = self._master
            if len(self._ends) == 1 or not abs(time - self._ends[0]) <= self._close:
                raise UnitError(
                    f"{self._unit.name}: an intermediate update at {time:.9g} s, but {self._ends[0]:.9g} s was due; "
                    "its points must not move while the step is the same"
                )
            self._read()
            master.time = self._ends.pop(0)
            master.arrive()
            self._lead()

    def _lead(self) -> None:
        """Step the other units to the next intermediate point, and write their outputs there to the last unit."""
        master = self._master
        size, place, samples = self._part()
        master.means[:] = samples.mean(samples.places[0], place, master._degree)
        master._one_by_one(0, self._place, size, place)
        master._let(WRITE, self._place, self._place + 1, size, place)
        master.sweeps += 1

    def _read(self) -> None:
        """Read the last unit's outputs at the next intermediate point."""
        size, place, _ = self._part()
        self._master._let(READ | MEAN, self._place, self._place + 1, size, place)

    def _part(self) -> tuple[float, float, Any]:
        """Return the length (s) of the current part of the step, the abscissa of its end, and the known samples."""
        size = self._ends[0] - self._master.time
        return size, self._master._place(size), self._master._samples
