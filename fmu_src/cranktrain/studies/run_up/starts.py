"""Storage of the steady motions of finished speeds next to the file of an unfinished run-up.

The next speed starts from the motions of its neighbours. A run-up that goes on has them from here, so that it takes the
path of one that was not interrupted. They are rows of a journal, :mod:`cranktrain.store.journal`; a run-up that has all
its speeds removes them.
"""

from pathlib import Path

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.settled.collar import NOTHING_LEFT, Learned
from cranktrain.dynamics.settled.free_mode import FreeMode
from cranktrain.dynamics.settled.motion import Motion
from cranktrain.store.journal import add_row, drop_journal, journal_rows
from cranktrain.studies.run_up.steady import CycleStart

HEAD = 12
"""Number of values before the arrays in a stored row: scalars, and lengths of the row's arrays."""
MISSING = -1.0
"""Length that marks a missing array."""


def keep_start(path: Path, tie: str, start: CycleStart) -> None:
    """Store the motion of a finished speed; ``tie`` identifies the run-up and its code. Raises ``StoreError``."""
    add_row(_place(path), tie, _row(start))


def kept_starts(path: Path, tie: str) -> list[CycleStart]:
    """Motions of finished speeds, in the order in which they were finished; empty if they belong to another run-up."""
    return [start for row in journal_rows(_place(path), tie) if (start := _start(row)) is not None]


def drop_starts(path: Path) -> None:
    """Remove the stored motions of a complete run-up."""
    drop_journal(_place(path))


def _place(path: Path) -> Path:
    return path.with_name(f"{path.name}.starts")


def _row(start: CycleStart) -> Array:
    motion, learned = start.motion, start.learned
    decay = learned.free.decay if learned is not None else 0j
    shape = np.zeros(0) if learned is None else np.ascontiguousarray(learned.free.shape).view(np.float64)
    temperatures = np.zeros(0) if start.temperatures is None else start.temperatures
    sizes = (
        motion.place.size, start.films.size, MISSING if start.temperatures is None else temperatures.size,
        MISSING if learned is None else shape.size,
    )  # fmt: skip
    head = (
        start.speed, start.shaft_angle, float(start.periodic), motion.lead, motion.lead_rate, decay.real, decay.imag,
        0.0, *sizes,
    )  # fmt: skip
    collar = NOTHING_LEFT if learned is None else learned.collar
    return np.concatenate([head, *motion[:3], start.films, temperatures, shape, collar.ravel()])


def _start(row: Array) -> CycleStart | None:
    """Motion from a row of numbers; None if its lengths are inconsistent."""
    head, rest = row[:HEAD], row[HEAD:]
    if head.size < HEAD:
        return None
    modes, films, temperatures, shape = (int(max(size, 0.0)) for size in head[8:])
    ends = np.cumsum([modes, modes, modes, films, temperatures, shape, NOTHING_LEFT.size])
    if ends[-1] != rest.size:
        return None
    place, velocity, acceleration, film, warm, mode, collar = np.split(rest, ends[:-1])
    learned = None
    if head[11] != MISSING:
        learned = Learned(FreeMode(complex(head[5], head[6]), mode.view(np.complex128)), collar.reshape(2, 2))
    return CycleStart(
        speed=float(head[0]),
        motion=Motion(place, velocity, acceleration, float(head[3]), float(head[4])),
        shaft_angle=float(head[1]),
        films=film,
        temperatures=None if head[10] == MISSING else warm,
        periodic=bool(head[2]),
        learned=learned,
    )
