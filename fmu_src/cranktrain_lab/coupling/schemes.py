"""Schemes of the master, which define the order of units within a step.

Sources: Busch, ZAMM 96 (2016) 1061–1081; Gomes, Thule, Broman, Larsen, Vangheluwe, *Co-simulation: a survey*, ACM
Computing Surveys 51 (2018) 49.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.unit_turns import READ, STEP, WRITE
from cranktrain_lab.coupling.intermediate import Inside
from cranktrain_lab.coupling.stages import AtStages
from cranktrain_lab.coupling.unit import Unit

Master: TypeAlias = Any
"""Stands for :class:`cranktrain_lab.coupling.master.Master`, which cannot be imported here (circular import)."""
RESOLVED = 1.0e-6
"""Least range of an output, as a fraction of its value, in the convergence test of scheme ``iterative``."""


def jacobi(master: Master, size: float, place: float) -> None:
    """Step all units with the values known at the step's start."""
    samples, first = master._samples, master._samples.places[0]
    master.means[:] = samples.mean(first, place, master._degree)
    count, everyone = master._independent, len(master._order)
    master._one_by_one(0, count, size, place)
    for what in (WRITE, STEP, READ):
        master._let(what, count, everyone, size, place)
    master.sweeps += 1


def gauss_seidel(master: Master, size: float, place: float) -> None:
    """Step one unit after the other, each with the newest outputs of the previous units."""
    samples = master._samples
    master.means[:] = samples.mean(samples.places[0], place, master._degree)
    master._one_by_one(0, len(master._order), size, place)
    master.sweeps += 1


def iterative(master: Master, size: float, place: float) -> None:
    """Repeat a Gauss-Seidel step from the same start until the outputs at the step's end converge."""
    exchange, samples, coupled = master.exchange, master._samples, master.coupled
    everything = slice(0, len(master.names))
    for unit in master._order:
        master._states[unit.name] = unit.keep(master._states.get(unit.name))
    expected = samples.at(place, max(1, master._degree))
    # A signal that has hardly changed so far need not converge beyond its rounding error.
    scales = np.maximum(master.scales[coupled], RESOLVED * np.abs(master.newest[coupled]))
    master._quasi_newton.begin()
    for sweep in range(exchange.sweeps):
        master.newest[:] = expected
        master.means[:] = samples.mean_to(place, expected, everything, master._degree)
        if sweep:
            for unit in master._order:
                unit.restore(master._states[unit.name])
        master._one_by_one(0, len(master._order), size, place)
        master.sweeps += 1
        change = (master.newest[coupled] - expected[coupled]) / scales
        if not coupled.size or float(np.abs(change).max()) <= exchange.tolerance:
            return
        expected = master.newest.copy()
        expected[coupled] = scales * master._quasi_newton.next(expected[coupled] / scales, change)
    left = float(np.abs(change).max())
    worst, name = list(master._at)[int(coupled[np.abs(change).argmax()])]
    raise SolverError(
        f"units do not agree at {master.time + size:.6g} s: {worst}.{name} still changes by {left:.1e} of its range "
        f"after {exchange.sweeps} sweeps; take shorter steps, or a tolerance above {exchange.tolerance:g}"
    )


def inside(master: Master, size: float, place: float) -> None:
    """Exchange values within the last unit's step, see :mod:`.intermediate` and :mod:`.stages`."""
    master.inside.step(master, size)


SCHEMES: dict[str, Callable[[Master, float, float], None]] = {
    "jacobi": jacobi, "gauss-seidel": gauss_seidel, "iterative": iterative, "intermediate": inside,
    "stages": inside,
}  # fmt: skip
"""Functions that take one communication step with all units of a master, by name of the scheme."""
INSIDE: dict[str, Callable[[Sequence[Unit], Any], Any]] = {
    "intermediate": lambda order, exchange: Inside(order),
    "stages": lambda order, exchange: AtStages(order, exchange.whole),
}
"""Schemes whose last unit calls its master inside a step. Each function gets the units in order and their ``Exchange``,
and makes the object that exchanges values inside the step."""
