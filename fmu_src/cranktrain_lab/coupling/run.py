"""Runs of coupled units with fixed or error-controlled communication steps, recorded at each point."""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain_lab.coupling.connections import Connection
from cranktrain_lab.coupling.master import Exchange, Master
from cranktrain_lab.coupling.reconstruction import DEGREES
from cranktrain_lab.coupling.unit import Unit

LOOK = 0.2
"""Wall time between two progress reports, s."""
SAFETY, SHRINK, GROW = 0.85, 0.3, 2.0
"""Step control: safety factor of the step size, smallest and largest ratio of successive steps."""
REFUSED = 1.5
"""Ratio of error to tolerance above which a step is repeated, if all units can restore their state."""


@dataclass(frozen=True)
class Steps:
    """Settings of communication steps.

    Attributes
    ----------
    size : step size, s; with error control the first one
    error : allowed error of an extrapolated output over the output's range so far; None for equal steps
    least, most : bounds of controlled steps, s
    """

    size: float
    error: float | None = None
    least: float = 0.0
    most: float = math.inf

    def __post_init__(self) -> None:
        if not 0.0 < self.size < math.inf:
            raise InputError(f"communication step {self.size:g} s must be above zero")
        if self.error is not None and not (0.0 < self.error < 1.0):
            raise InputError(
                f"error {self.error:g} of the communication step is not within 0 and 1 of an output's range"
            )
        if not 0.0 <= self.least <= self.size <= self.most:
            raise InputError(f"communication step {self.size:g} s is not within {self.least:g} and {self.most:g} s")

    @property
    def longest(self) -> float:
        """Longest communication step, s."""
        return self.size if self.error is None else self.most


class Bond(NamedTuple):
    """Power bond: power that two units exchange, computed on each side.

    Both sides are sums of products of values, each ``(unit, variable)``, an output or a connected input. A sum is a
    power at the communication points or, with ``works``, the work since the start (J).
    """

    name: str
    given: Sequence[Sequence[tuple[str, str]]]
    taken: Sequence[Sequence[tuple[str, str]]]
    works: bool = False


@dataclass(frozen=True)
class System:
    """Coupled system: input of a master, ``outputs`` to read in addition to connected outputs, and power bonds."""

    units: Mapping[str, Unit]
    connections: list[Connection]
    exchange: Exchange
    outputs: dict[str, list[str]]
    bonds: list[Bond]

    def master(self) -> Master:
        """Return a co-simulation master of these units."""
        return Master(list(self.units.values()), self.connections, self.exchange, self.outputs)


class Coupled(NamedTuple):
    """Result of a run of coupled units, with outputs at all communication points.

    Attributes
    ----------
    names, units : outputs ``unit.variable``, (n,), and their units of measurement
    times, values : times of communication points (k,), s, and outputs (k, n)
    residuals : residual of each power bond (k,), W: power given by one side minus power taken by the other, at a
        communication point or, if both sides count work, the mean over the step that ends at the point
    steps, refused, sweeps : numbers of steps taken, of repeated steps, and of evaluations of all units
    seconds : wall time without initialization
    ended : reason of an early end; empty for a complete run
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    times: Array
    values: Array
    residuals: dict[str, Array]
    steps: int
    refused: int
    sweeps: int
    seconds: float
    ended: str = ""

    def of(self, name: str) -> Array:
        """Return one output over time, (k,)."""
        return np.asarray(self.values[:, self.names.index(name)])


def run(
    master: Master,
    stop: float,
    steps: Steps,
    bonds: Sequence[Bond] = (),
    progress: Callable[[float], None] | None = None,
    told: "Callable[[Record], None] | None" = None,
) -> Coupled:
    """Run an initialized master to ``stop`` (s); ``told`` is called at each communication point.

    Raises
    ------
    CranktrainError
        a unit fails; attribute ``found`` of the error, or of an interrupt, is the run so far (:class:`Coupled`)
    """
    record = Record(master, bonds)
    try:
        if told is not None:
            told(record)
        for share in _points(master, stop, steps, record):
            if told is not None:
                told(record)
            if progress is not None and share is not None:
                progress(share)
    except BaseException as error:
        error.found = record.result(str(error) or type(error).__name__)  # type: ignore[attr-defined]
        raise
    return record.result()


def _points(master: Master, stop: float, steps: Steps, record: "Record") -> Iterator[float | None]:
    """Take the steps; yields None after each step, or the completed fraction at intervals of :data:`LOOK`."""
    start, looked = master.time, time.perf_counter()
    walk = _equal(master, stop, steps) if steps.error is None else _controlled(master, stop, steps, record)
    for _ in walk:
        record.take()
        now = time.perf_counter()
        if looks := now - looked > LOOK or master.time >= stop:
            looked = now
        yield (master.time - start) / (stop - start) if looks else None


def _equal(master: Master, stop: float, steps: Steps) -> Iterator[None]:
    """Take equal steps. Times are multiples of the step size, because sums would accumulate rounding errors."""
    start = master.time
    count = max(1, round((stop - start) / steps.size))
    if abs(count * steps.size - (stop - start)) > 1.0e-6 * steps.size:
        count = math.ceil((stop - start) / steps.size - 1.0e-9)
    for k in range(count):
        master.step(min(start + (k + 1) * steps.size, stop) if k + 1 < count else stop)
        yield None


def _controlled(master: Master, stop: float, steps: Steps, record: "Record") -> Iterator[None]:
    """Take steps controlled by the difference between extrapolated and received outputs."""
    assert steps.error is not None
    size, degree = steps.size, max(1, DEGREES[master.exchange.reconstruction])
    coupled, again = master.coupled, master.restorable
    while master.time < stop - 1.0e-9 * size:
        end = stop if master.time + 1.001 * size >= stop else master.time + size
        taken = end - master.time
        expected = master.predicted(taken)[coupled]
        kept = master.keep() if again else None
        master.step(end)
        off = np.abs(master.newest[coupled] - expected) / master.scales[coupled]
        over = float(off.max()) / steps.error if off.size else 0.0
        factor = GROW if over == 0.0 else min(GROW, max(SHRINK, SAFETY * over ** (-1.0 / (degree + 1))))
        if over > REFUSED and kept is not None and taken > 1.001 * steps.least:
            master.restore(kept)
            record.refused += 1
            size = max(steps.least, taken * min(factor, 0.9))
            continue
        size = min(steps.most, max(steps.least, taken * factor))
        yield None


_FIRST_ROWS = 1024
"""Initial capacity of a record in communication points; doubled whenever the record is full."""


class Record:
    """Recorded communication points of a run."""

    def __init__(self, master: Master, bonds: Sequence[Bond]) -> None:
        self._master = master
        self._bonds = [(_products(master, bond.given), _products(master, bond.taken)) for bond in bonds]
        self._names = [bond.name for bond in bonds]
        self._works = {k: self._residual(k) for k, bond in enumerate(bonds) if bond.works}
        self._width = 1 + len(bonds)
        self._rows = np.empty((_FIRST_ROWS, self._width + len(master.names)))
        self._count, self._start, self.refused = 0, time.perf_counter(), 0
        self._take([0.0] * len(bonds))

    def take(self) -> None:
        """Record the present communication point."""
        residuals = [self._residual(k) for k in range(len(self._bonds))]
        passed = self._master.time - self._rows[self._count - 1, 0]
        for k, before in self._works.items():
            self._works[k] = residuals[k]
            residuals[k] = (residuals[k] - before) / passed
        self._take(residuals)

    def _residual(self, k: int) -> float:
        """Return given minus taken power (or work) of bond ``k`` at the present communication point."""
        given, taken = self._bonds[k]
        return _sum(given) - _sum(taken)

    def _take(self, residuals: Sequence[float]) -> None:
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        row = self._rows[self._count]
        row[0] = self._master.time
        row[self._width :] = self._master.newest
        for k, residual in enumerate(residuals, start=1):
            row[k] = residual
        self._count += 1

    @property
    def newest(self) -> Array:
        """Time (s), residuals of the bonds and outputs of the last communication point, in one vector."""
        return np.asarray(self._rows[self._count - 1])

    def result(self, ended: str = "") -> Coupled:
        """Return the run so far; ``ended`` is the reason of an early end."""
        master, rows, width = self._master, self._rows[: self._count], self._width
        return Coupled(
            master.names, tuple(master.ports[name].unit for name in master.names),
            rows[:, 0].copy(), rows[:, width:].copy(),
            {name: rows[1:, k].copy() for k, name in enumerate(self._names, start=1)},
            self._count - 1, self.refused, master.sweeps, time.perf_counter() - self._start, ended,
        )  # fmt: skip


_Product = list[tuple[Array, int]]


def _products(master: Master, products: Sequence[Sequence[tuple[str, str]]]) -> list[_Product]:
    return [[master.vector(master.find(*factor)) for factor in factors] for factors in products]


def _sum(products: Sequence[_Product]) -> float:
    """Return the sum of products of values at the present communication point."""
    total = 0.0
    for factors in products:
        total += math.prod(values.item(k) for values, k in factors)
    return total


def keep_run(path: Path, run: Coupled, attributes: Mapping[str, str | int | float]) -> None:
    """Write a run to a result file with every read output over time, as ``unit/variable``; raises ``StoreError``."""
    from cranktrain.store.hdf5 import write_result

    datasets = {"time": (run.times, "s")}
    for k, (name, unit) in enumerate(zip(run.names, run.units, strict=True)):
        datasets[name.replace(".", "/", 1)] = run.values[:, k], unit
    write_result(path, datasets, attributes)
