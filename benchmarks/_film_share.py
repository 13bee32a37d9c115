"""How long a running simulation spends in films that are called at their address: a law with a clock around the law."""

from __future__ import annotations

import ctypes
import time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import call_kernel, keep_record, kernel_address, law_kernel, record_reader
from cranktrain.film.laws.films import CLOSE_STAGE, FORCE, FROZEN, RATE, SIZE, Films

_clock: Any = ctypes.CDLL(None).clock_gettime
_clock.argtypes, _clock.restype = [ctypes.c_int, ctypes.c_void_p], ctypes.c_int
_MONOTONIC = time.CLOCK_MONOTONIC
HELD_FORCE = RATE + 1
"""Row of forces whose tangents are held, after the actions of a law."""


class Timer(NamedTuple):
    """Law that is timed, seconds and nanoseconds of the clock before and after, and what was spent."""

    entry: NDArray[np.int64]  # (b, 3) as the films had it
    clock: NDArray[np.int64]  # (2, 2)
    spent: NDArray[np.float64]  # (actions, 2) calls and nanoseconds


def _timer(entry: NDArray[np.int64]) -> Timer:
    return Timer(entry, np.zeros((2, 2), dtype=np.int64), np.zeros((HELD_FORCE + 1, 2)))


_read = record_reader(_timer(np.zeros((1, 3), dtype=np.int64)))


@law_kernel
def _timed_law(record, action, i, place, velocity, numbers, memory, out):
    timer = _read(record)
    _clock(_MONOTONIC, timer.clock[0].ctypes)
    own = timer.entry[i]
    status = call_kernel(own[0], (own[1], action, own[2], place, velocity, numbers, memory, out))
    _clock(_MONOTONIC, timer.clock[1].ctypes)
    row = HELD_FORCE if action == FORCE and numbers[FROZEN] != 0.0 else action
    timer.spent[row, 0] += 1.0
    timer.spent[row, 1] += 1e9 * (timer.clock[1, 0] - timer.clock[0, 0]) + timer.clock[1, 1] - timer.clock[0, 1]
    return status


class FilmTimer:
    """Stands before the law of ``films`` while a ``with`` block runs, and counts."""

    def __init__(self, films: Films) -> None:
        self.films, self.timer = films, _timer(films.entry.copy())
        self.record = keep_record(self.timer, self.timer.spent)
        films = films._replace(numbers=np.zeros_like(films.numbers))
        memory, out = np.zeros(1), np.zeros(SIZE)
        self.address = kernel_address(
            _timed_law, 0, 0, 0, films.place[0], films.velocity[0], films.numbers, memory, out
        )

    def __enter__(self) -> FilmTimer:
        self.films.entry[:, :2] = self.address, self.record
        self.films.entry[:, 2] = range(len(self.films.entry))
        return self

    def __exit__(self, *error: object) -> None:
        self.films.entry[:] = self.timer.entry

    @property
    def seconds(self) -> float:
        """Wall time in films."""
        return float(1e-9 * self.timer.spent[:, 1].sum())

    def by_action(self, films: int) -> dict[str, dict[str, float]]:
        """Calls of each of the ``films`` and microseconds per call, by what was asked for."""
        rows = {"force_with_tangents": FORCE, "force": HELD_FORCE, "end_of_stage": CLOSE_STAGE}
        return {
            name: {
                "calls_per_film": round(float(self.timer.spent[row, 0]) / films),
                "us": float(f"{1e-3 * self.timer.spent[row, 1] / self.timer.spent[row, 0]:.4g}"),
            }
            for name, row in rows.items()
            if self.timer.spent[row, 0]
        }
