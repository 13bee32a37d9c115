"""File of a run's communication points, written by one process and readable by another even if the first has died.

The file is mapped into memory, so writing a point needs no system call. Disk space is reserved before mapping, so a
full disk raises ``OSError`` instead of a memory fault later.
"""

from __future__ import annotations

import mmap
import os
from pathlib import Path

import numpy as np

from cranktrain.core.reduced_body import Array

ROWS = mmap.ALLOCATIONGRANULARITY // 8
"""Number of points for which space is reserved at once. Their size is a multiple of the page size for any width."""


class PointsFile:
    """Writer of points of ``width`` numbers; raises ``OSError`` if the disk is full."""

    def __init__(self, path: Path, width: int) -> None:
        self._file = path.open("w+b")
        self._width, self._count, self._size = width, 0, 0
        self._rows = np.empty((0, width))

    def take(self, row: Array) -> int:
        """Write a point and return the number of points written."""
        place = self._count % ROWS
        if place == 0:
            size = ROWS * self._width * 8
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(self._file.fileno(), self._size, size)
            else:
                self._file.truncate(self._size + size)
            room = mmap.mmap(self._file.fileno(), size, offset=self._size)
            self._size += size
            self._rows = np.frombuffer(room).reshape(ROWS, self._width)
        self._rows[place] = row
        self._count += 1
        return self._count


def read_points(path: Path, width: int, count: int) -> Array:
    """Return the first ``count`` points (k, width), or fewer if the file holds fewer."""
    held = path.stat().st_size // (8 * width)
    values = np.fromfile(path, dtype=np.float64, count=min(max(0, count), held) * width)
    return values[: len(values) // width * width].reshape(-1, width)
