"""Recordings for a watch: complex orders of one output at common speeds, one recording per file.

Speeds of the watched recordings define the operating points. Points of a file within ``NEAR`` of an operating point are
averaged. The change of the model's orders between a file's own speed and the operating point is added to the measured
orders, so speeds need not agree exactly.

Orders of torsion by a torsional crank, for the cases of :mod:`cranktrain_lab.watch.defects`.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.types import Array, ComplexArray, Progress
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import fitted_engine
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.orders.measured import MeasuredOrders, read_measured_orders
from cranktrain.results.run_up.run_up import FLYWHEEL, TORSION
from cranktrain.structure.assembly import assemble
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, HIGHEST_ORDER, frequency_run_up
from cranktrain_lab.measured.order_table import check_speeds
from cranktrain_lab.watch.defects import Case

TWIST = "twist"
OUTPUTS = (TORSION, FLYWHEEL, TWIST)
"""Outputs that may be watched."""


class Place(NamedTuple):
    """Operating points of a watch: output of torsion, s speeds (rad/s) and o orders."""

    output: str
    speeds: Array
    orders: Array


class TorsionalAnswers:
    """Model of a torsional crank for the healthy engine and its defects.

    Parameters
    ----------
    engine : healthy engine; added bodies and connections are left out
    load : fraction of the full-load burn
    damper : True if the damper is fitted
    rule : ``linear`` or ``harmonic-balance``
    inherit : True if the crank takes the damping of the level above

    Raises
    ------
    InputError
        an engine without a torsional crank
    """

    def __init__(
        self, engine: Engine, load: float, damper: bool, rule: str = HARMONIC_BALANCE, inherit: bool = True,
        say: Progress = lambda stage: None,
    ) -> None:  # fmt: skip
        self.engine, self.damper, self._rule = engine.without_additions, damper, rule
        settings = Settings(crank="torsional", damper="fitted" if damper else "none", gas_load=load)
        self._made = assemble(self.engine, settings, say=say, inherit=inherit)
        self.healthy = Case(self.engine, GasTrace.from_engine(self.engine))

    def orders(self, case: Case, place: Place) -> ComplexArray:
        """Return complex orders (s, o), rad, with order n as Re[a exp(i n θ)]; ``InputError``, ``SolverError``."""
        made, speeds = self._made, np.unique(place.speeds)
        engine = fitted_engine(case.engine, made.settings)
        found = frequency_run_up(engine, made.body, made.settings, speeds, list(place.orders), self._rule, case.gas)
        values = found.amplitudes[FLYWHEEL if place.output == FLYWHEEL else TORSION]
        if place.output == TWIST:
            values = values - found.amplitudes[FLYWHEEL]
        turned = values * np.exp(1j * case.zero * np.asarray(place.orders))
        return np.asarray(turned[np.searchsorted(speeds, place.speeds)])


NEAR = 0.02
"""Relative difference up to which two speeds belong to one operating point."""


class Recordings(NamedTuple):
    """Complex orders, rad, of m watched (m, s, o) and n healthy recordings (n, s, o) at operating points."""

    place: Place
    watched: ComplexArray
    healthy: ComplexArray


class _File(NamedTuple):
    """Recording of one file: for each order its k speeds and complex amplitudes."""

    name: str
    points: dict[float, tuple[Array, ComplexArray]]


def read_recordings(
    engine: Engine, watched: Sequence[str | Path], healthy: Sequence[str | Path], output: str,
    orders: Sequence[float], corrected: Callable[[Place], ComplexArray],
) -> Recordings:  # fmt: skip
    """Read recordings from files; ``corrected`` returns the model's orders (s, o) at operating points.

    Raises
    ------
    InputError
        orders without phase, orders or speeds that a file lacks, speeds that the engine does not run at, a recording
        that is given twice
    """
    files = [_read(path, output) for path in (*watched, *healthy)]
    common = [order for order in sorted(files[0].points) if all(order in file.points for file in files)]
    wanted = np.array(sorted(set(orders)) or [order for order in common if 0.5 <= order <= HIGHEST_ORDER])
    for order in wanted.tolist():
        for file in files:
            if order not in file.points:
                near = nearest(f"{order:g}", [f"{one:g}" for one in file.points])
                raise InputError(f"{file.name}: has no order {order:g} of {output}; {near}")
    if not wanted.size:
        raise InputError(
            f"{files[0].name}: no order is in all files; analyse all of them by 'cranktrain measured' with one --orders"
        )
    speeds = _operating_points([file.points[order][0] for file in files[: len(watched)] for order in wanted.tolist()])
    check_speeds(engine, speeds, files[0].name, "leave them out")
    place = Place(output, speeds, wanted)
    own = corrected(place)
    values = [_at_points(file, place, own, corrected) for file in files]
    for recordings in (range(len(watched)), range(len(watched), len(files))):
        for second in recordings:  # equal ones would underestimate the scatter
            for first in recordings[: second - recordings[0]]:
                if np.array_equal(values[first], values[second]):
                    raise InputError(
                        f"{files[second].name}: holds the same orders as {files[first].name}; a recording counts once, "
                        "so leave one of them out"
                    )
    return Recordings(place, np.array(values[: len(watched)]), np.array(values[len(watched) :]))


def _read(path: str | Path, output: str) -> _File:
    """Read one file's orders of an output; raises ``InputError``."""
    name, found = Path(path).name, read_measured_orders(path)
    assert isinstance(found, MeasuredOrders)
    if output not in found:
        raise InputError(f"{name}: has no orders of {output}; {nearest(output, found)}")
    points = {}
    for order, (speeds, sizes) in found[output].items():
        phases = found.phases[output][order]
        if missing := int(np.isnan(phases).sum()):
            raise InputError(
                f"{name}: order {order:g} has no phase at {missing} of {phases.size} speeds; amplitudes alone do not "
                "tell cylinders apart, so measure against a tacho with an index"
            )
        points[order] = speeds, sizes * np.exp(1j * phases)
    return _File(name, points)


def _operating_points(speeds: Sequence[Array]) -> Array:
    """Return means (s,) of groups of speeds within ``NEAR`` of each other, rad/s."""
    groups: list[list[float]] = []
    for speed in np.sort(np.concatenate(speeds)).tolist():
        if groups and speed <= groups[-1][0] * (1.0 + NEAR):
            groups[-1].append(speed)
        else:
            groups.append([speed])
    return np.array([float(np.mean(group)) for group in groups])


def _at_points(
    file: _File, place: Place, own: ComplexArray, corrected: Callable[[Place], ComplexArray]
) -> ComplexArray:
    """Return a recording's o orders at the s operating points, (s, o)."""
    all_speeds = np.unique(np.concatenate([file.points[order][0] for order in place.orders.tolist()]))
    moved = not np.isin(all_speeds, place.speeds).all()
    there = corrected(place._replace(speeds=all_speeds)) if moved else None
    found = np.empty(own.shape, dtype=complex)
    for k, speed in enumerate(place.speeds.tolist()):
        for o, order in enumerate(place.orders.tolist()):
            speeds, values = file.points[order]
            near = np.abs(speeds - speed) <= NEAR * speed
            if not near.any():
                raise InputError(
                    f"{file.name}: order {order:g} was not recorded at {speed / RPM:.0f} rev/min, its speeds are "
                    f"{speeds.min() / RPM:.0f} to {speeds.max() / RPM:.0f} rev/min; record it there, or leave the "
                    "speed out of the watched file"
                )
            row = values[near]
            if there is not None:
                row = row + own[k, o] - there[np.searchsorted(all_speeds, speeds[near]), o]
            found[k, o] = row.mean()
    return found
