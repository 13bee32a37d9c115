"""Reader of WAV by scipy, mapped into memory. Integers are fractions of full scale, because the format has no unit."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain_lab.measured.channels import Channel, Reader

CHECKED = 20_000_000
"""Number of samples of a file that are checked for clipping at full scale."""
FULL = {"int16": 2.0**15, "int32": 2.0**31, "int64": 2.0**63, "uint8": 2.0**7}


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the channels of a file, and remarks."""
    from scipy.io import wavfile

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            rate, data = wavfile.read(str(path), mmap=True)
        except ValueError as error:
            if "mmap" not in str(error) and "buffer" not in str(error) and "bit depth" not in str(error):
                raise
            rate, data = wavfile.read(str(path), mmap=False)  # 24-bit and truncated files cannot be mapped
    if not data.size:
        raise InputError(f"{path.name}: holds no samples; record it again")
    cut = any("EOF" in str(found.message) for found in caught)
    remarks = [f"{path.name}: is cut short; the samples up to the cut were read"] * cut
    columns = data.reshape(data.shape[0], -1)
    count = columns.shape[1]
    unit = "" if columns.dtype.kind == "f" else "full scale"
    if columns.dtype.kind in "iu" and columns.size <= CHECKED:
        ends = np.iinfo(columns.dtype)
        full = np.count_nonzero((columns == ends.min) | (columns == ends.max), axis=0)
        remarks += [
            f"{path.name}, channel {k + 1}: {n} of {columns.shape[0]} samples are at full scale; it may be cut off"
            for k, n in enumerate(full.tolist())
            if n > 2
        ]
    names = [f"{path.stem}" if count == 1 else f"{path.stem}:{k + 1}" for k in range(count)]
    found = [
        Channel(name, unit, columns.shape[0], path.name, _reader(columns, k), 0.0, 1.0 / rate)
        for k, name in enumerate(names)
    ]
    return found, remarks


def _reader(columns: Any, k: int) -> Reader:
    scale = 1.0 / FULL.get(str(columns.dtype), 1.0)
    shift = 128.0 if columns.dtype == np.uint8 else 0.0

    def read(first: int, last: int) -> np.ndarray:
        return np.asarray((columns[first:last, k].astype(np.float64) - shift) * scale)

    return read
