"""The co-simulation master, which steps coupled units from one communication point to the next.

All exchanged values are in one vector: the outputs of all units, each in its own unit of measurement. A step uses three
such vectors, stored one after the other: reconstructed means over the step, newest known values, and values at the
step's start. The connections of a unit select its inputs from these vectors. Schemes differ in the order in which they
update them. Units without inputs take their step first in every scheme, because their outputs do not depend on the
others.

An output with direct feedthrough depends on an input without a step. These inputs are set, and the outputs read, once
more at the communication point, so that the outputs belong to the newest inputs.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array
from cranktrain.core.unit_turns import MEAN, READ, STEP, WRITE
from cranktrain_lab.coupling.connections import Connection, checked, wiring
from cranktrain_lab.coupling.reconstruction import DEGREES, Samples
from cranktrain_lab.coupling.schemes import INSIDE, SCHEMES
from cranktrain_lab.coupling.turns import Turns, Vectors
from cranktrain_lab.coupling.unit import Unit, UnitError

MOST = 8
"""Number of differences kept within a step."""
DISTINCT = 1.0e-10
"""Singular values of the differences are ignored below this fraction of the largest singular value."""
PASSES = 4
"""Largest number of iterations at a communication point, for outputs with direct feedthrough."""
STEADY = 1.0e-12
"""Relative change of outputs at which the iteration of outputs with direct feedthrough has converged."""


class QuasiNewton:
    """Interface quasi-Newton iteration of one communication step for fixed points x = H(x) of its exchanged values.

    Least squares over the last evaluations give the combination with the least residual, and from it the next x.
    Degroote, Bathe, Vierendeels (2009), *Performance of a new partitioned procedure versus a monolithic procedure in
    fluid–structure interaction*, Computers & Structures 87, 793–801.
    """

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Discard the data of the last step."""
        self._results: list[Array] = []
        self._changes: list[Array] = []

    def next(self, result: Array, change: Array) -> Array:
        """Return the next x from H(x) and H(x) − x, each (n,)."""
        self._results = [*self._results[-MOST:], result]
        self._changes = [*self._changes[-MOST:], change]
        if len(self._changes) == 1:
            return result
        changes = np.array([c - change for c in self._changes[:-1]]).T
        results = np.array([r - result for r in self._results[:-1]]).T
        share = np.linalg.lstsq(changes, -change, rcond=DISTINCT)[0]
        return np.asarray(result + results @ share)


@dataclass(frozen=True)
class Exchange:
    """Settings of a master's exchange of values between units.

    Attributes
    ----------
    scheme : a name of :data:`SCHEMES`
    reconstruction : a name of :data:`cranktrain_lab.coupling.reconstruction.DEGREES`
    abscissa : output over which values are reconstructed, ``(unit, variable)``; None: time
    tolerance : convergence limit of scheme ``iterative``: change of an output over its range so far
    sweeps : limit of iterations in a step
    whole : with scheme ``stages``, the first units, which take each step as a whole before the others
    """

    scheme: str = "gauss-seidel"
    reconstruction: str = "linear"
    abscissa: tuple[str, str] | None = None
    tolerance: float = 1.0e-8
    sweeps: int = 30
    whole: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for value, valid, what in ((self.scheme, SCHEMES, "scheme"), (self.reconstruction, DEGREES, "reconstruction")):
            if value not in valid:
                raise InputError(f"{what} '{value}' does not exist; {nearest(value, valid)}")
        if self.scheme == "stages" and (self.reconstruction != "hold" or self.abscissa is not None):
            raise InputError("scheme 'stages' reconstructs nothing; take reconstruction hold, and no abscissa")
        if not 0.0 < self.tolerance < 1.0:
            raise InputError(f"tolerance {self.tolerance:g} is not within 0 and 1 of an output's range")


class Master:
    """Co-simulation master: units that take communication steps together.

    Attributes
    ----------
    names : outputs of all units, ``unit.variable``
    ports : ports of these outputs
    time : time of the last communication point, s
    newest : outputs at this time, in the order of ``names``
    sweeps : evaluations of all units so far, in units of steps
    coupled : indices of connected outputs that step control considers, see ``Connection.judged``
    inside : exchange inside a step of the last unit, for schemes of :data:`INSIDE`; None for others
    """

    def __init__(
        self, units: Sequence[Unit], connections: Sequence[Connection], exchange: Exchange,
        outputs: Mapping[str, Sequence[str]] | None = None,
    ) -> None:  # fmt: skip
        """Link the units in this order; ``outputs`` are, by unit, outputs to read in addition to connected outputs.

        Raises
        ------
        InputError
            two units of one name, invalid connections, a scheme that needs restorable units with units that are not
        """
        by_name = {unit.name: unit for unit in units}
        if len(by_name) < len(units):
            raise InputError(f"units {', '.join(unit.name for unit in units)}: names must differ; rename one")
        checked(by_name, connections)
        self.exchange, self.time, self.sweeps = exchange, 0.0, 0
        self._degree = DEGREES[exchange.reconstruction]
        driven = {connection.target[0] for connection in connections}
        self._order = sorted(units, key=lambda unit: unit.name in driven)  # stable: else as given
        if exchange.scheme == "iterative":
            fixed = [unit.name for unit in self._order if not unit.restorable]
            if fixed:
                raise InputError(
                    f"scheme 'iterative': {', '.join(fixed)} cannot keep and restore its state; take gauss-seidel, or "
                    "a unit with canGetAndSetFMUstate"
                )
        self.inside = INSIDE[exchange.scheme](self._order, exchange) if exchange.scheme in INSIDE else None
        self._parts: dict[str, slice] = {}
        at: dict[tuple[str, str], int] = {}
        for unit in self._order:
            chosen = dict.fromkeys(c.source[1] for c in connections if c.source[0] == unit.name)
            chosen |= dict.fromkeys((outputs or {}).get(unit.name, ()))
            first = len(at)
            at.update({(unit.name, name): first + k for k, name in enumerate(chosen)})
            self._parts[unit.name] = slice(first, len(at))
        self._at, n = at, len(at)
        self.names = tuple(f"{unit}.{name}" for unit, name in at)
        self.ports = {f"{unit}.{name}": by_name[unit].outputs[name] for unit, name in at}
        self._wirings = {unit.name: wiring(unit, connections, by_name, at) for unit in units}
        for unit in units:
            part = self._parts[unit.name]
            unit.link(self._wirings[unit.name].names, [name for _, name in list(at)[part]])
        if exchange.abscissa is not None and exchange.abscissa not in at:
            raise InputError(f"abscissa {'.'.join(exchange.abscissa)}: is not connected; connect it, or take time")
        self._feeding = [unit for unit in self._order if self._feeds(unit)]
        self._known = np.zeros(3 * n)
        self.means, self.newest, self.start = self._known[:n], self._known[n : 2 * n], self._known[2 * n :]
        self.written = {name: np.zeros(len(taken.names)) for name, taken in self._wirings.items()}
        self._samples = Samples(n)
        self._extremes = np.array([np.full(n, math.inf), np.full(n, -math.inf)])
        self.coupled = np.unique(np.array([at[c.source] for c in connections if c.judged], dtype=np.intp))
        self._turned = self._last = 0.0
        self._quasi_newton = QuasiNewton()
        self._states: dict[str, Any] = {}
        self._turns: Turns | None = None
        self._independent = sum(not self._wirings[unit.name].names for unit in self._order)

    def find(self, unit: str, variable: str) -> tuple[str, int]:
        """Return the location, for :meth:`vector`, of a read output or connected input; ``InputError``."""
        if (unit, variable) in self._at:
            return "", self._at[unit, variable]
        names = self._wirings[unit].names if unit in self._wirings else ()
        if variable not in names:
            there = [name for owner, name in self._at if owner == unit] + list(names)
            raise InputError(f"{unit}.{variable} is neither read nor connected; {nearest(variable, there)}")
        return unit, names.index(variable)

    def vector(self, place: tuple[str, int]) -> tuple[Array, int]:
        """Return the vector that contains the value of a location after initialization, and its index in the vector."""
        unit, k = place
        return (self.written[unit] if unit else self.newest), k

    def initialize(self, time: float = 0.0) -> None:
        """Start all units, with their own start values for unconnected inputs, and exchange their first outputs."""
        self.time = time
        for unit in self._order:
            unit.initialize(time)
            self._read(unit)
        self.means[:] = self.start[:] = self.newest
        for _ in range(2):  # the second pass reads outputs that depend on the other units' first outputs
            for unit in self._order:
                self._write(unit)
                self._read(unit)
            self.means[:] = self.start[:] = self.newest
        self._arrive(self.newest)
        # Compiled code calls the loaded FMUs whose outputs have no direct feedthrough.
        direct = {unit.name: unit for unit in self._order if unit not in self._feeding}
        vectors = Vectors(self._known, self._samples.values, self._extremes)
        turns = Turns(self._order, direct, self._wirings, self._parts, vectors)
        for name, values in turns.inputs.items():
            values[:] = self.written[name]
            self.written[name] = values
        self._turns = turns if turns.inputs else None

    def step(self, end: float) -> None:
        """Go to ``end`` (s) in one step; ``UnitError`` or ``SolverError`` with unit and time if the step fails."""
        size = end - self.time
        self.start[:] = self.newest
        SCHEMES[self.exchange.scheme](self, size, self._place(size))
        self.time = end
        self._settle_feeds()
        self._arrive(self.newest)

    def arrive(self) -> None:
        """Record the newest outputs as a point inside the step, at ``time``, and continue from this point."""
        self._settle_feeds()
        self._arrive(self.newest)
        self.start[:] = self.newest

    def predicted(self, size: float) -> Array:
        """Return the extrapolated outputs after a step of this size, (n,)."""
        return self._samples.at(self._place(size), max(1, self._degree))

    @property
    def scales(self) -> Array:
        """Range of each output so far (n,); 1 for an output that has not changed."""
        span = self._extremes[1] - self._extremes[0]
        return np.where(span > 0.0, span, 1.0)

    @property
    def restorable(self) -> bool:
        """True if all units can repeat a step."""
        return all(unit.restorable for unit in self._order)

    def keep(self) -> Any:
        """Return the state of all units and of the master for :meth:`restore`; the next call overwrites this state."""
        for unit in self._order:
            self._states[unit.name] = unit.keep(self._states.get(unit.name))
        samples = self._samples
        return self.time, self._known.copy(), samples.values.copy(), list(samples.places), self._turned, self._last

    def restore(self, state: Any) -> None:
        """Restore the state of all units that :meth:`keep` stored last."""
        for unit in self._order:
            unit.restore(self._states[unit.name])
        self.time, known, values, self._samples.places, self._turned, self._last = state
        self._known[:], self._samples.values[:] = known, values

    def close(self) -> None:
        """Close all units; raises the first ``UnitError`` of a unit that did not end cleanly."""
        self._turns = None
        failed: list[UnitError] = []
        for unit in self._order:
            try:
                unit.close()
            except UnitError as error:
                failed.append(error)
        if failed:
            raise failed[0]

    def _feeds(self, unit: Unit) -> bool:
        """True if a unit has direct feedthrough from a connected input to an output that is read."""
        read = {name for (owner, name) in self._at if owner == unit.name}
        return any(unit.inputs[name].feeds & read for name in self._wirings[unit.name].names)

    def _place(self, size: float) -> float:
        """Return the abscissa (time or crank angle) at the end of a step of this size, s."""
        if self.exchange.abscissa is None:
            return self.time + size
        # Before the first step the rate of the abscissa is unknown and has no effect, because one point has no slope.
        return self._samples.places[0] + (self._turned * size or size)

    def _write(self, unit: Unit) -> None:
        taken = self._wirings[unit.name]
        if taken.names:
            values = self.written[unit.name]
            values[:] = taken.of(self._known, self.time)
            self._asked(unit, unit.write, values)

    def _read(self, unit: Unit) -> None:
        part = self._parts[unit.name]
        if part.stop > part.start:
            self.newest[part] = self._asked(unit, unit.read)

    def _asked(self, unit: Unit, call: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function of a unit and return its result; a ``UnitError`` names the unit and the time."""
        try:
            return call(*arguments)
        except UnitError as error:
            raise UnitError(f"{unit.name} at {self.time:.6g} s: {error}") from None

    def _one_by_one(self, first: int, end: int, size: float, place: float) -> None:
        """Step units ``first`` to ``end`` in turn, each with the outputs of the previous units at the step's end."""
        if self._turns is not None:
            self._turns.weigh(self._samples.weights_to(place, self._degree))
        self._let(WRITE | STEP | READ | MEAN, first, end, size, place)

    def _let(self, what: int, first: int, end: int, size: float, place: float) -> None:
        """Let units ``first`` to ``end`` write, step and read in turn; ``what`` are flags of these actions."""
        k = first
        while k < end:
            until = k if self._turns is None else min(end, self._turns.until[k])
            if self._turns is not None and until > k:
                try:
                    self._turns.take(what, k, until, self.time, size)
                except UnitError as error:
                    unit, stepped = self._turns.failed
                    when = f" at {self.time:.6g} s"
                    if stepped:
                        when = f", step from {self.time:.6g} s to {self.time + size:.6g} s"
                    raise UnitError(f"{unit.name}{when}: {error}") from None
            else:
                self._let_one(self._order[k], what, size, place)
            k = max(until, k + 1)

    def _let_one(self, unit: Unit, what: int, size: float, place: float) -> None:
        if what & WRITE:
            self._write(unit)
        if what & STEP:
            try:
                unit.step(self.time, size)
            except UnitError as error:
                raise UnitError(
                    f"{unit.name}, step from {self.time:.6g} s to {self.time + size:.6g} s: {error}"
                ) from None
        if what & MEAN and unit in self._feeding:
            self._expect(unit, place)
        if what & READ:
            self._read(unit)
        if what & MEAN:
            part = self._parts[unit.name]
            self.means[part] = self._samples.mean_to(place, self.newest[part], part, self._degree)

    def _expect(self, unit: Unit, place: float) -> None:
        """Set a unit's inputs to known or extrapolated values at the step's end, for outputs with feedthrough."""
        n = len(self.names)
        expected = self._samples.at(place, self._degree)
        before = self._order[: self._order.index(unit)]
        for other in before:
            expected[self._parts[other.name]] = self.newest[self._parts[other.name]]
        self._asked(unit, unit.write, self._wirings[unit.name].of(np.tile(expected, 3)[: 3 * n], self.time))

    def _settle_feeds(self) -> None:
        """Iterate outputs with direct feedthrough at the communication point, at most ``PASSES`` times."""
        if not self._feeding:
            return
        self.means[:] = self.start[:] = self.newest
        for _ in range(PASSES):
            before = self.newest.copy()
            for unit in self._feeding:
                self._asked(unit, unit.write, self._wirings[unit.name].of(self._known, self.time))
                self._read(unit)
                part = self._parts[unit.name]
                self.means[part] = self.start[part] = self.newest[part]
            if np.all(np.abs(self.newest - before) <= STEADY * np.abs(before)):
                return

    def _arrive(self, values: Array) -> None:
        """Store the values of a communication point; raises ``UnitError`` if one is not finite."""
        remembered = self._turns is not None and self._turns.arrive()
        if not remembered:
            bad = np.flatnonzero(~np.isfinite(values))
            if bad.size:
                unit, name = list(self._at)[int(bad[0])]
                raise UnitError(f"{unit}: {name} is {values[bad[0]]} at {self.time:.6g} s; units before it are finite")
            low, high = self._extremes
            np.minimum(low, values, out=low)
            np.maximum(high, values, out=high)
        place = self.time
        if self.exchange.abscissa is not None:
            place = float(values[self._at[self.exchange.abscissa]])
            if self._samples.places:
                gone = self.time - self._last
                self._turned = (place - self._samples.places[0]) / gone if gone > 0.0 else self._turned
        self._last = self.time
        if remembered:
            self._samples.stand(place)
        else:
            self._samples.add(place, values)
