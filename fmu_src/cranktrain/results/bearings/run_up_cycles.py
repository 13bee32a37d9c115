"""Bearings of a run-up: the cycle at each speed, composed of the stored orders of the bearings' outputs.

Loads, positions of journals and friction are sums of the orders of the run-up (up to 24 by default). Least film and
largest pressure are extremes of the run itself; their crank angles come from the sums. If the motion is not periodic,
orders are those of a mean cycle, and extremes are taken over all cycles.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.engine.model import Engine
from cranktrain.results.bearings.cycle import BearingCycle, BearingReport, bearing_report
from cranktrain.results.orders.harmonics import CYCLE, Array, ComplexArray
from cranktrain.results.run_up.run_up import LARGEST, LEAST, MEAN, RunUp

SAMPLES = 720
SPEED = "crank.speed"
_OF_ALL = (
    "force.x", "force.y", "position.x", "position.y", "film_thickness_min", "pressure_max", "friction_torque",
    "oil_flow",
)  # fmt: skip
_OF_MAINS = ("speed.relative",)


def bearing_outputs(engine: Engine, mains: bool = True) -> list[str]:
    """Outputs whose orders describe an engine's bearings; without ``mains`` if their journals are locked."""
    names = [SPEED]
    if mains:
        count = len(engine.crankshaft.main_widths)
        names += [f"bearing[{i + 1}].{name}" for i in range(count) for name in (*_OF_ALL, *_OF_MAINS)]
    return [*names, *(f"big_end[{c + 1}].{name}" for c in range(engine.n_cylinders) for name in _OF_ALL)]


def run_up_bearings(run_up: RunUp, engine: Engine) -> Iterator[BearingReport]:
    """Bearing report at each speed with a result, in rising order of speed.

    Raises ``InputError``: a run-up without the orders of its bearings, or of an engine with other bearings.
    """
    if missing := [name for name in (SPEED, "big_end[1].force.x") if name not in run_up.amplitudes]:
        raise InputError(f"has no orders of '{missing[0]}'; run 'cranktrain runup' again with --outputs bearings")
    for row in np.flatnonzero(run_up.with_result).tolist():
        report = bearing_report(OrderedCycle.of(run_up, row), engine)
        mains, ends = (tuple(_with_extremes(one, run_up, row) for one in of) for of in (report.mains, report.big_ends))
        yield replace(report, mains=mains, big_ends=ends)


@dataclass(frozen=True)
class OrderedCycle:
    """One cycle as sums of orders, in the form of a run for :func:`cranktrain.results.bearings.cycle.bearing_report`.

    Attributes
    ----------
    time, angle : (n,) s and rad of crank angle, from 0 to the end of the cycle
    outputs : name → (n,) SI, computed on request
    """

    time: Array
    angle: Array
    outputs: Mapping[str, Array]

    @classmethod
    def of(cls, run_up: RunUp, row: int) -> "OrderedCycle":
        """Make the cycle of one speed (row) of a run-up."""
        angle = np.linspace(0.0, CYCLE, SAMPLES + 1)
        return cls(angle / run_up.speeds[row], angle, _Outputs(run_up, row, angle))


class _Outputs(Mapping[str, Array]):
    """Sums of orders by output name; angle of the gap and velocity are derived from the journal's position."""

    def __init__(self, run_up: RunUp, row: int, angle: Array) -> None:
        self._run_up, self._row, self._angle = run_up, row, angle
        self._turn: ComplexArray = np.exp(1j * np.outer(angle, run_up.orders))

    def __iter__(self) -> Iterator[str]:
        return iter(self._run_up.amplitudes)

    def __len__(self) -> int:
        return len(self._run_up.amplitudes)

    def __getitem__(self, name: str) -> Array:
        run_up, row = self._run_up, self._row
        stem, _, last = name.rpartition(".")
        if name == "crank.angle":
            return self._angle
        if name.endswith(".gap.angle"):
            place = stem.removesuffix(".gap") + ".position"
            return np.arctan2(self[f"{place}.y"], self[f"{place}.x"])
        if stem.endswith(".velocity"):
            place = f"{stem.removesuffix('.velocity')}.position.{last}"
            return self._sum(1j * run_up.orders * run_up.speeds[row] * run_up.amplitudes[place][row])
        return run_up.extremes[name][row, MEAN] + self._sum(run_up.amplitudes[name][row])

    def _sum(self, amplitudes: ComplexArray) -> Array:
        return np.asarray((self._turn @ amplitudes).real)


def _with_extremes(bearing: BearingCycle, run_up: RunUp, row: int) -> BearingCycle:
    """Bearing with least film and largest pressure of the run, because sums of orders miss extremes."""
    name = bearing.name.replace("main", "bearing")
    found = {}
    for key, output, column in (("film", "film_thickness_min", LEAST), ("pressure", "pressure_max", LARGEST)):
        extreme = getattr(bearing, key)
        if extreme is not None:
            found[key] = replace(extreme, value=float(run_up.extremes[f"{name}.{output}"][row, column]))
    return replace(bearing, **found)
