"""Exchange at the stages of the last unit's integrator, which requests inputs at these times before its step (FMI 3.0).

The last unit knows at which times within a step its integrator evaluates forces, and calls its master for each of these
times before it steps. The other units step from one stage time to the next, each with the previous units' outputs at
the end of this part, and their outputs become inputs of the last unit. The last unit's own outputs are not known yet,
so the others get values extrapolated by the parabola through the last communication points.

Units with torques of impacts shorter than a step take the whole step first, in equal parts, because their outputs at
single times mean little. Their means over the parts are replaced by a straight line over the step with the same mean
and first moment, so the impacts give the last unit the correct momentum and displacement.
"""

from collections.abc import Collection, Sequence

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.core.unit_turns import MEAN, READ, WRITE
from cranktrain_lab.coupling.unit import Master, Unit, UnitError, Updates

NONE = 1.0e-9
"""Fraction of a step below which two stage times count as equal, because they differ by rounding."""
PARTS = 4
"""Number of equal parts in which the units that go first pass through a communication step. With a single part the
error is three times as large."""


class AtStages(Updates):
    """Exchange at the stages of the last unit in a master's order."""

    def __init__(self, order: Sequence[Unit], whole: Collection[str] = ()) -> None:
        """Register with the last unit; raises ``InputError`` if it does not call its master.

        The units in ``whole`` must come first and take each step of the master as a whole, before the others.
        """
        super().__init__(order, "stages")
        self._first = sum(one.name in whole for one in order)
        if {one.name for one in order[: self._first]} != set(whole):
            raise InputError(
                f"scheme 'stages': {', '.join(whole)} must be the first units, as they take whole steps; reorder units"
            )
        self._none = self._begin = self._size = 0.0
        self._asked_for = 0
        self._trial = False
        self._foreseen: Array | None = None
        self._ahead: Array | None = None
        self._newest = 0.0
        self._line: tuple[Array, Array] | None = None
        self._means = np.zeros((2, 0))
        self._unit.listen(self._guarded(self._reached), self._guarded(self._asked))

    def step(self, master: Master, size: float) -> None:
        """Take one communication step (s) with all units; ``UnitError`` names the unit that fails, with the time."""
        begin = master.time
        self._master, self._none, self._asked_for = master, NONE * size, 0
        self._foreseen, self._ahead, self._trial, self._line = None, None, False, None
        self._begin, self._size = begin, size
        try:
            if len(master._samples.places) == 1 and master.restorable:
                self._foresee(begin, size)
            self._lead_whole()
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
        """Estimate the slope of the last unit's outputs in the first step, when there is no earlier point.

        All units take a trial step, the others in one part, and are restored.
        """
        master = self._master
        states, known = [unit.keep() for unit in master._order], master._known.copy()
        self._trial = True
        self._lead_whole()
        self._take(begin, size)
        self._read(begin + size)
        before = known[len(master.names) : 2 * len(master.names)]
        self._foreseen = (master.newest[self._part] - before[self._part]) / size
        self._trial, self._line, self._asked_for, master.time = False, None, 0, begin
        master._known[:] = known
        for unit, state in zip(master._order, states, strict=True):
            unit.restore(state)

    def _reached(self, time: float) -> None:
        """Handle the last unit's call at a point that it has reached within the step."""
        if self._master is None or self._trial:
            return
        self._lead(time)
        self._read(time)
        self._master.arrive()
        self._ahead = None

    def _asked(self, time: float) -> None:
        """Handle the last unit's request for inputs at a later time (s)."""
        if self._master is None:
            return
        self._asked_for += 1
        self._lead(time)
        mean, slope = self._means
        self._master.means[: mean.size] = mean + slope * (2.0 * (time - self._begin) / self._size - 1.0)
        self._master._let(WRITE, self._place, self._place + 1, 0.0, time)

    def _lead(self, time: float) -> None:
        """Step the other units to a time, s."""
        master = self._master
        time = self._begin + self._size if self._trial else time
        size = time - master.time
        if size <= self._none:
            return
        if not self._trial:
            self._expect(master.time, time)
        master._one_by_one(self._first, self._place, size, time)
        master.time = time

    def _lead_whole(self) -> None:
        """Take the whole step with the units that go first; others then see these units' outputs as linear in time."""
        master, parts = self._master, 1 if self._trial else PARTS
        if self._first == 0:
            return
        whole = slice(int(master._parts[master._order[self._first].name].start))  # outputs of the first units
        before, means = master.start[whole].copy(), np.empty((parts, whole.stop))
        for k in range(parts):
            begin, end = (self._begin + self._size * (edge / parts) for edge in (k, k + 1))
            if not self._trial:
                self._expect(begin, end)
            master.time = begin
            master._one_by_one(0, self._first, end - begin, end)
            means[k] = master.means[whole]
        master.time = self._begin
        self._line = before, master.newest[whole] - before
        self._means = mean_and_moment(means)

    def _expect(self, begin: float, end: float) -> None:
        """Extrapolate the last unit's outputs for a part of the step: values at the part's start, and means over it.

        The mean speed gives the same change of angle over the part as the speed itself.
        """
        master, part = self._master, self._part
        if self._ahead is None:
            self._ahead = self._parabola()
        first, last = begin - self._newest, end - self._newest
        square = (first * first + first * last + last * last) / 3.0
        weights = np.array(((1.0, first, first * first), (1.0, 0.5 * (first + last), square)))
        master.newest[part], master.means[part] = weights @ self._ahead
        master.start[:] = master.newest
        if self._line is not None:
            before, change = self._line
            master.start[: before.size] = before + (begin - self._begin) / self._size * change

    def _parabola(self) -> Array:
        """Return coefficients (3, outputs) of parabolas of the last unit's outputs over time since the newest point."""
        samples = self._master._samples
        nodes, values = samples.places, samples.values[:, self._part]
        found = np.zeros((3, values.shape[1]))
        found[0] = values[0]
        self._newest = nodes[0]
        if len(nodes) == 1:
            found[1] = 0.0 if self._foreseen is None else self._foreseen
        else:
            last = nodes[0] - nodes[1]
            found[1] = (values[0] - values[1]) / last
            if len(nodes) > 2:
                found[2] = (found[1] - (values[1] - values[2]) / (nodes[1] - nodes[2])) / (nodes[0] - nodes[2])
                found[1] += last * found[2]
        return found

    @property
    def _part(self) -> slice:
        """Slice of the last unit's outputs in the vector of all outputs."""
        part: slice = self._master._parts[self._unit.name]
        return part

    def _read(self, time: float) -> None:
        """Read the last unit's outputs at a point that it has reached."""
        self._master._let(READ | MEAN, self._place, self._place + 1, 0.0, time)


def mean_and_moment(means: Array) -> Array:
    """Return mean and slope (2, n), over x from -1 to 1, of the line with mean and first moment of ``means`` (k, n)."""
    parts = len(means)
    away = (2.0 * np.arange(parts) + 1.0) / parts - 1.0  # coordinate x, −1 to 1, of the middle of each part
    return np.array((means.mean(axis=0), 3.0 * away @ means / parts))
