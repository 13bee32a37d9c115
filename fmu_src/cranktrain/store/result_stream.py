"""A result file that grows during the run: samples are written in chunks, and memory holds one chunk.

The complete file replaces its target when it is closed, however the run ended.
"""

import shutil
import signal
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import StoreError
from cranktrain.core.types import Array
from cranktrain.store.axes import attach_axes, of_result
from cranktrain.store.hdf5 import RESULT, RESULT_HEADER, Dataset, File, put, put_attributes, put_unit, written

CHUNK = 4096
"""Largest number of samples that are written at once."""
SPARE = 1 << 21
"""Bytes left free on the disk so that a result file can be closed; once more for each 100 datasets."""


@contextmanager
def result_stream(path: str | Path) -> "Iterator[ResultStream]":
    """Result file that exists after the block ends without an error; raises the errors of ``whole_file``."""
    with written(path, RESULT) as file:
        file.attrs.update(RESULT_HEADER)
        yield ResultStream(file, Path(path))


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Context in which interrupt and termination signals are delayed until its end."""
    waiting: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number in before:
        signal.signal(number, lambda arrived, frame: waiting.append(arrived))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for arrived in waiting:
            signal.raise_signal(arrived)


class ResultStream:
    """Columns of samples that are appended to an HDF5 file."""

    def __init__(self, file: File, path: Path) -> None:
        self._file, self._path = file, path
        self._names: tuple[str, ...] = ()
        self._rows = np.empty((0, 0))
        self._written = self._filled = 0

    def begin(self, units: Mapping[str, str], samples: int) -> None:
        """Prepare columns (name → unit) for ``samples`` samples and drop earlier ones; ``StoreError``: disk too small.

        Names may contain ``/`` for groups.
        """
        self._names = tuple(units)
        chunk = min(CHUNK, samples)
        self._rows = np.empty((chunk, len(units)))
        self._written = self._filled = 0
        needed, free = samples * self._rows.itemsize * len(units), max(self._free(), 0)
        if needed > free:
            raise StoreError(
                f"{self._path}: {samples} samples of {len(units)} outputs need {1e-6 * needed:.0f} MB, the disk has "
                f"{1e-6 * free:.0f}; run fewer cycles, or choose another place"
            )
        for name, unit in units.items():
            if f"data/{name}" in self._file:
                del self._file[f"data/{name}"]
            dataset = self._file.create_dataset(
                f"data/{name}", (0,), np.float64, maxshape=(None,), chunks=(chunk,), fletcher32=True, track_times=False
            )
            put_unit(dataset, unit)

    @property
    def count(self) -> int:
        """Number of samples appended so far."""
        return self._written + self._filled

    def append(self, rows: Array) -> None:
        """Append samples (k, columns); ``StoreError`` if the disk is full, with enough space left to close the file.

        An interrupt is delayed until all samples are taken.
        """
        taken = 0
        with _undisturbed():
            while taken < len(rows):
                count = min(len(self._rows) - self._filled, len(rows) - taken)
                self._rows[self._filled : self._filled + count] = rows[taken : taken + count]
                self._filled += count
                taken += count
                if self._filled == len(self._rows):
                    if 2 * self._rows.nbytes > self._free():
                        raise StoreError(f"{self._path}: the disk is full; choose another place")
                    self._write()

    def finish(self, attributes: Mapping[str, str | int | float], datasets: Mapping[str, Dataset]) -> None:
        """Write the remaining samples, attributes and further datasets."""
        self._write()
        put_attributes(self._file, "run", attributes)
        for name, (array, unit) in datasets.items():
            put(self._file, f"data/{name}", array, unit)
        attach_axes(self._file["data"], of_result)
        self._file["data"].attrs.update(attributes)

    def _write(self) -> None:
        """Write the samples in memory to the file; after an interruption a second call writes them all again."""
        end = self._written + self._filled
        for k, name in enumerate(self._names):
            dataset: Any = self._file[f"data/{name}"]
            dataset.resize((end,))
            dataset[self._written : end] = self._rows[: self._filled, k]
        self._written, self._filled = end, 0

    def _free(self) -> int:
        """Number of bytes on the disk available for samples."""
        return shutil.disk_usage(self._path.absolute().parent).free - SPARE * (1 + len(self._names) // 100)
