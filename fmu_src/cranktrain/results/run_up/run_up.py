"""Result of a run-up (orders over the speed range) and its file.

A file holds the finished speeds, so an interrupted run-up can be continued. Speeds finished after the file was last
written are in its journal (:mod:`cranktrain.store.journal`), which is read together with the file.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.dynamics.outputs.register import nearest_output
from cranktrain.results.files import output_unit
from cranktrain.results.orders.harmonics import ComplexArray
from cranktrain.store.hdf5 import CUT_SHORT, RUN_UP, cut_short, read_run_up, write_run_up
from cranktrain.store.journal import add_row, drop_journal, journal_rows
from cranktrain.store.sound_files import json_of, real, rising
from cranktrain.store.whole_file import check_place

TORSION, AXIAL, FLYWHEEL = "pulley.torsion", "pulley.axial", "flywheel.torsion"
LEAST, MEAN, LARGEST = 0, 1, 2
"""Columns of ``extremes``: least, mean and largest value of an output over a cycle."""
_AXES = ("speeds", "orders", "cycles", "repeats", "left")
_COUNTS = ("cycles", "repeats")
_NAMED = ("amplitudes", "extremes")
"""Names of arrays in a run-up file that have one row per output."""
REMEDY = "delete it and run 'cranktrain runup' again"


def check_run_up_target(path: Path) -> None:
    """Refuse a target file that a run-up must not replace, before any work; ``InputError``."""
    if cut_short(path):
        raise InputError(f"{path}: {CUT_SHORT}, or delete it and run all speeds again")
    check_place(path, RUN_UP)


@dataclass(frozen=True)
class RunUp:
    """Orders of steady cycles over speed, or of a speed ramp; SI.

    Attributes
    ----------
    speeds : (s,) rad/s, increasing
    orders : (o,) 0.5, 1, …
    amplitudes : output → (s, o) complex order amplitudes in its unit, x = mean + Re Σ a exp(i order θ) with θ the
        crank's mean rotation from firing dead centre of cylinder 1; NaN for a speed without result
    extremes : output → (s, 3) least, mean and largest value of a cycle
    cycles : (s,) number of cycles run at each speed; 0 without cycles (frequency domain, ramp)
    repeats : (s,) period of the motion in cycles; 0 if it is not periodic
    left : (s,) settling error of the worst output family; 0 without settling
    attributes : settings, as in the file
    parting : (s,) factor per cycle by which the difference between two similar cycles grows, for speeds that have no
        period for this reason, else NaN. Empty if not known
    """

    speeds: Array
    orders: Array
    amplitudes: Mapping[str, ComplexArray]
    extremes: Mapping[str, Array]
    cycles: NDArray[np.int_]
    repeats: NDArray[np.int_]
    left: Array
    attributes: Mapping[str, str | int | float] = field(default_factory=dict)
    parting: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def torsion(self) -> ComplexArray:
        """Complex orders (s, o) of the pulley's torsion, rad."""
        return self.amplitudes[TORSION]

    @property
    def axial(self) -> ComplexArray:
        """Complex orders (s, o) of the pulley's axial motion, m; ``InputError`` for journals locked on their axis."""
        return self._of(AXIAL)

    @property
    def speeds_rpm(self) -> Array:
        """Speeds (s,), rev/min."""
        return np.asarray(self.speeds / RPM)

    @property
    def with_result(self) -> NDArray[np.bool_]:
        """True for speeds (s,) with a result. In the frequency domain an unsettled speed has no result."""
        return np.all([np.isfinite(own).all(axis=1) for own in self.amplitudes.values()], axis=0)

    def order(self, order: float, output: str = TORSION) -> ComplexArray:
        """Complex amplitudes (s,) of one order of an output; ``InputError`` if the run-up does not have it."""
        at = np.flatnonzero(np.isclose(self.orders, order, rtol=0.0, atol=1e-9))
        if not at.size:
            raise InputError(f"order {order:g} is not in this run-up; it has {self.orders[0]:g} to {self.orders[-1]:g}")
        return np.asarray(self._of(output)[:, at[0]])

    def _of(self, output: str) -> ComplexArray:
        if output not in self.amplitudes:
            raise InputError(f"output '{output}' is not in this run-up; {nearest_output(output, self.amplitudes)}")
        return self.amplitudes[output]

    def save(self, path: str | Path) -> Path:
        """Write the file completely or not at all; ``InputError`` if it must not replace a file, ``StoreError``."""
        datasets: dict[str, tuple[NDArray[Any], str]] = {
            "speeds": (self.speeds, "rad/s"), "orders": (self.orders, "1/revolution"), "cycles": (self.cycles, "1"),
            "repeats": (self.repeats, "1"), "left": (self.left, "1"),
        }  # fmt: skip
        if self.parting.size:
            datasets["parting"] = self.parting, "1"
        attributes, labels = dict(self.attributes), {"extreme": ["least", "mean", "largest"]}
        # All outputs share one dataset for fast writing, because the file is rewritten with every speed.
        shapes = {"amplitudes": (0, self.speeds.size, self.orders.size), "extremes": (0, self.speeds.size, 3)}
        for group, named in (("amplitudes", self.amplitudes), ("extremes", self.extremes)):
            datasets[group] = np.array(list(named.values())) if named else np.zeros(shapes[group]), "SI, by output"
            attributes[f"{group}_outputs"] = json.dumps({name: output_unit(name) for name in named})
            kind = group.removesuffix("s")
            labels[f"{kind}_output"], labels[f"{kind}_unit"] = list(named), [output_unit(name) for name in named]
        written = write_run_up(path, datasets, attributes, labels)
        drop_journal(written)
        return written

    def add_to_journal(self, path: Path) -> None:
        """Append this run-up's speeds to the journal of a run-up file with the same settings; ``StoreError``."""
        s = self.speeds.size
        parting = self.parting if self.parting.size else np.full(s, math.nan)
        columns = [self.speeds, self.cycles, self.repeats, self.left, parting]
        amplitudes = [values.view(np.float64).reshape(s, -1) for values in self.amplitudes.values()]
        for row in np.hstack([np.array(columns, dtype=np.float64).T, *amplitudes, *self.extremes.values()]):
            add_row(path, self._tie, row)

    @property
    def _tie(self) -> str:
        """Text that is equal for run-ups with the same settings, orders and outputs."""
        names = [*self.amplitudes, *self.extremes]
        return repr((self.orders.tolist(), names, sorted((name, str(held)) for name, held in self.attributes.items())))

    def _with_rows(self, rows: Sequence[Array]) -> "RunUp":
        """Run-up with the speeds of a journal added; rows of another length are left out."""
        size = 5 + 2 * self.orders.size * len(self.amplitudes) + 3 * len(self.extremes)
        rows = [row for row in rows if row.size == size]
        if not rows:
            return self
        whole = np.array(rows)
        speeds, cycles, repeats, left, parting = whole[:, :5].T
        cuts = 5 + np.cumsum([2 * self.orders.size] * len(self.amplitudes) + [3] * len(self.extremes))
        parts = [np.ascontiguousarray(part) for part in np.split(whole[:, 5:], cuts[:-1] - 5, axis=1)]
        added = replace(
            self, speeds=speeds, cycles=cycles.astype(int), repeats=repeats.astype(int), left=left, parting=parting,
            amplitudes={name: part.view(np.complex128) for name, part in zip(self.amplitudes, parts, strict=False)},
            extremes=dict(zip(self.extremes, parts[len(self.amplitudes) :], strict=True)),
        )  # fmt: skip
        return merged([self, added])

    @classmethod
    def load(cls, path: str | Path) -> "RunUp":
        """Read a file and its journal; ``StoreError`` if it is missing, incomplete, damaged, or of another kind."""
        data, attributes = read_run_up(path)
        values: dict[str, Any] = {name: array for name, (array, _) in data.items()}
        if missing := [name for name in (*_AXES, *_NAMED) if name not in values]:
            raise StoreError(f"{path}: '{missing[0]}' is missing; {REMEDY}")
        try:
            named = {name: json_of(str(attributes.pop(f"{name}_outputs", "{}"))) for name in _NAMED}
        except ValueError:
            raise StoreError(f"{path}: names of its outputs are damaged; {REMEDY}") from None
        parting = values.get("parting", np.zeros(0))
        if not _fit({**values, "parting": parting}, named):
            raise StoreError(f"{path}: arrays do not fit together; {REMEDY}")
        outputs: Any = {name: dict(zip(named[name], values[name], strict=True)) for name in _NAMED}
        axes: dict[str, Any] = {name: values[name] if name in _COUNTS else real(values[name]) for name in _AXES}
        found = cls(**axes, **outputs, parting=real(parting), attributes=attributes)
        found = found._with_rows(journal_rows(Path(path), found._tie))
        if not _sound(found):
            raise StoreError(f"{path}: holds numbers that no run-up has; {REMEDY}")
        return found


MOST = 1e15
"""Largest permitted number in a file, so that squares and their sums are finite."""


def _fit(values: Mapping[str, Any], named: Mapping[str, Any]) -> bool:
    """True if arrays of a file and the names of its outputs have consistent shapes."""
    s, orders = values["speeds"].size, values["orders"]
    fits = s > 0 and orders.size > 0 and orders.ndim == 1
    fits &= all(values[name].shape == (s,) for name in _AXES if name != "orders")
    fits &= values["parting"].shape in ((s,), (0,))
    fits &= values["amplitudes"].shape[1:] == (s, orders.size) and values["extremes"].shape[1:] == (s, 3)
    fits &= all(isinstance(named[name], dict) and len(named[name]) == len(values[name]) for name in _NAMED)
    kinds = {"amplitudes": "fc"}
    return fits and all(values[name].dtype.kind in kinds.get(name, "iuf") for name in (*_AXES, *_NAMED, "parting"))


def _sound(run_up: RunUp) -> bool:
    """True if the numbers of a run-up are possible: speeds and orders increase, counts are non-negative integers."""
    counted = [run_up.cycles, run_up.repeats]
    bounded: list[NDArray[Any]] = [run_up.speeds, run_up.orders, *counted, run_up.parting]
    bounded += [*run_up.amplitudes.values(), *run_up.extremes.values()]
    sound = rising(run_up.speeds, 0.0) and rising(run_up.orders, 0.0)
    sound &= all(bool(np.all(count == np.floor(count))) for count in counted)
    # The comparison lets NaN pass, because NaN marks a missing result.
    sound &= not any((np.abs(one) > MOST).any() for one in bounded)
    return sound and not any((one < 0.0).any() for one in (*counted, run_up.left, run_up.parting))


def merged(parts: Sequence[RunUp]) -> RunUp:
    """Merge run-ups of the same outputs and orders, sorted by speed; attributes are those of the last one."""
    speeds = np.concatenate([part.speeds for part in parts])
    speeds, first = np.unique(speeds, return_index=True)

    def joined(arrays: Sequence[NDArray[Any]]) -> Any:
        return np.concatenate(arrays)[first]

    return RunUp(
        speeds=speeds,
        orders=parts[-1].orders,
        amplitudes={name: joined([p.amplitudes[name] for p in parts]) for name in parts[-1].amplitudes},
        extremes={name: joined([p.extremes[name] for p in parts]) for name in parts[-1].extremes},
        cycles=joined([p.cycles for p in parts]),
        repeats=joined([p.repeats for p in parts]),
        left=joined([p.left for p in parts]),
        parting=joined([p.parting if p.parting.size else np.full(p.speeds.size, math.nan) for p in parts]),
        attributes=parts[-1].attributes,
    )


TWIST = "twist"
"""Name of the twist among the outputs of a run-up, rad."""
SAMPLES = 2880
"""Number of samples of a cycle, with which the range of order 24 is accurate to 0.2 %."""


def with_twist(run_up: RunUp) -> RunUp:
    """Run-up with added output ``TWIST``, pulley's minus flywheel's torsion; unchanged without flywheel's torsion."""
    if FLYWHEEL not in run_up.amplitudes:
        return run_up
    twist = run_up.amplitudes[TORSION] - run_up.amplitudes[FLYWHEEL]
    return replace(run_up, amplitudes={**run_up.amplitudes, TWIST: twist})


def half_range(run_up: RunUp, amplitudes: ComplexArray) -> Array:
    """Half of the peak-to-peak value over a cycle at each speed (s,), from complex orders (s, o)."""
    angle = np.linspace(0.0, 4.0 * math.pi, SAMPLES, endpoint=False)
    motion = (amplitudes @ np.exp(1j * np.outer(run_up.orders, angle))).real
    return np.asarray(0.5 * np.ptp(motion, axis=1))


def order_map(run_up: RunUp, output: str, speeds: Array) -> Array:
    """Amplitudes (o, n) of all orders at speeds (n,) rad/s, interpolated between the speeds of the run-up."""
    sizes = np.abs(run_up.amplitudes[output]).T
    return np.array([np.interp(speeds, run_up.speeds, one) for one in sizes])


def frequency_map(run_up: RunUp, output: str, speeds: Array, hz: Array) -> Array:
    """Amplitudes (f, n) of the order nearest to each frequency (f,), Hz, at speeds (n,) rad/s.

    They are NaN above the highest order of the run-up.
    """
    of_orders = order_map(run_up, output, speeds)
    wanted = 2.0 * math.pi * hz[:, None] / speeds
    nearest = np.abs(wanted[:, :, None] - run_up.orders).argmin(axis=2)
    found = np.take_along_axis(of_orders, nearest, axis=0)
    return np.where(wanted <= run_up.orders[-1] + 0.25, found, math.nan)
