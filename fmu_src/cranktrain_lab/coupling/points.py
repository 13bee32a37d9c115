"""Communication points of a run in a file that one process writes and another reads, also when the first has died.

The file is mapped into memory, so a point costs no call of the system. Room on the disk is taken before it is mapped:
a full disk is an ``OSError`` then, and no fault of the process at some later point.
"""

from __future__ import annotations

import mmap
import os
from pathlib import Path

import numpy as np

from cranktrain.core.reduced_body import Array

ROWS = mmap.ALLOCATIONGRANULARITY // 8
"""Points that room is made for at once; their bytes are whole pages, whatever a point's width."""


class PointsFile:
    """Points of ``width`` numbers, written one after the other; ``OSError`` where there is no room."""

    def __init__(self, path: Path, width: int) -> None:
        self._file = path.open("w+b")
        self._width, self._count, self._size = width, 0, 0
        self._rows = np.empty((0, width))

    def take(self, row: Array) -> int:
        """Write a point; how many there are."""
        place = self._count % ROWS
        if place == 0:
            self._rows = self._room()
        self._rows[place] = row
        self._count += 1
        return self._count

    def _room(self) -> Array:
        """Room for the next ROWS points."""
        size = ROWS * self._width * 8
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(self._file.fileno(), self._size, size)
        else:
            self._file.truncate(self._size + size)
        room = mmap.mmap(self._file.fileno(), size, offset=self._size)
        self._size += size
        return np.frombuffer(room).reshape(ROWS, self._width)


def read_points(path: Path, width: int, count: int) -> Array:
    """The first ``count`` points (k, width), or as many as the file holds."""
    held = path.stat().st_size // (8 * width)
    values = np.fromfile(path, dtype=np.float64, count=min(max(0, count), held) * width)
    return values[: len(values) // width * width].reshape(-1, width)
