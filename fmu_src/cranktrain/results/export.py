"""Export of results and run-ups as tables for other programs: CSV, Parquet, NumPy archive.

The table of a run has one row per sample; that of a run-up has one row per speed, with amplitude and phase of every
order. Values are SI as in the file, and each heading gives its unit. A table is written in blocks, and the file appears
only when it is complete.
"""

import csv
import io
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.user_file import ending, user_path
from cranktrain.results.files import output_unit
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.store.bodies import write_archive
from cranktrain.store.columns import ResultColumns
from cranktrain.store.hdf5 import is_run_up
from cranktrain.store.whole_file import Kind, check_place, marked, whole_file

Progress = Callable[[float], None]

BLOCK = 4096
"""Number of rows that are read and written at once."""
MARK = "cranktrain table"
CSV_HEADS = ("time [s],angle [rad]", "speed [rad/s],cycles [1]")
"""First characters of the CSV tables that this program writes, by which a file to be replaced is recognised."""


@dataclass(frozen=True)
class ArrayTable:
    """Table whose columns (rows,) are arrays in memory."""

    columns: dict[str, Array]
    units: dict[str, str]
    attributes: dict[str, Any]
    left_out: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Number of rows, the length of every column."""
        return len(next(iter(self.columns.values())))

    def blocks(self, names: Sequence[str], size: int) -> Iterator[Array]:
        """Iterate over blocks of k ≤ ``size`` rows of the named columns, (k, names)."""
        for first in range(0, self.rows, size):
            yield np.stack([self.columns[name][first : first + size] for name in names], axis=1)


Table = ArrayTable | ResultColumns
"""Table to be exported: named columns of equal length with units, and attributes; it is read in blocks of rows."""


def run_up_table(run_up: RunUp) -> ArrayTable:
    """Table of a run-up, one row per speed: cycles, extremes, zero-to-peak amplitude and phase (rad) of all orders."""
    columns: dict[str, tuple[Any, str]] = {
        "speed": (run_up.speeds, "rad/s"), "cycles": (run_up.cycles, "1"), "repeats": (run_up.repeats, "1"),
        "left": (run_up.left, "1"),
    }  # fmt: skip
    for name, extremes in run_up.extremes.items():
        for label, values in zip(("least", "mean", "largest"), extremes.T, strict=True):
            columns[f"{name} {label}"] = values, output_unit(name)
    for name, amplitudes in run_up.amplitudes.items():
        for order, values in zip(run_up.orders, amplitudes.T, strict=True):
            columns[f"{name} order {order:g} amplitude"] = np.abs(values), output_unit(name)
            columns[f"{name} order {order:g} phase"] = np.angle(values), "rad"
    arrays = {name: np.asarray(values, dtype=np.float64) for name, (values, _) in columns.items()}
    return ArrayTable(arrays, {name: unit for name, (_, unit) in columns.items()}, dict(run_up.attributes))


def export(source: str | Path, target: str | Path, group: str = "", progress: Progress | None = None) -> dict[str, Any]:
    """Write a result or run-up file as a table in the format given by the ending of ``target``.

    Raises ``InputError``: an unknown ending, an existing file that must not be replaced, a group that does not exist, a
    library that is missing; ``StoreError``: a source that is missing, damaged or of another kind.

    Parameters
    ----------
    group : group in the file of a scene with several speeds
    progress : called with the completed fraction

    Returns
    -------
    ``table``, ``rows``, ``columns``, and ``left_out``: names of data that are not columns
    """
    path = user_path(target)
    if ending(path) not in FORMATS:
        raise InputError(f"{target}: tables end with {', '.join(FORMATS)}; name it {path.stem or 'table'}.csv")
    write, kind = FORMATS[ending(path)]
    table: Table
    if is_run_up(source):
        if group:
            raise InputError(f"{source}: a run-up has one table; leave out --group")
        table = run_up_table(RunUp.load(source))
    else:
        table = ResultColumns.of(source, group)
    if ending(path) == ".csv":
        kind = _csv_of(table)
    check_place(path, kind)
    with whole_file(path, kind) as temporary:
        write(temporary, table, progress or (lambda share: None))
    return {"table": str(path), "rows": table.rows, "columns": len(table.units), "left_out": list(table.left_out)}


def headings(table: Table) -> list[str]:
    """Heading of each column, such as ``pulley.torsion [rad]``; only the name if it has no unit."""
    return [f"{name} [{unit}]" if unit else name for name, unit in table.units.items()]


def _write_csv(path: Path, table: Table, progress: Progress) -> None:
    done = 0
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(headings(table))
        for block in table.blocks(list(table.units), BLOCK):
            writer.writerows(block.tolist())
            done += len(block)
            progress(done / table.rows)


def _write_parquet(path: Path, table: Table, progress: Progress) -> None:
    try:
        import pyarrow as arrow
        from pyarrow import parquet
    except ImportError:
        raise InputError("Parquet needs pyarrow; pip install pyarrow, or cranktrain[parquet]") from None
    about = {"format": MARK, **{key: str(value) for key, value in table.attributes.items()}}
    fields = [
        arrow.field(heading, arrow.float64(), metadata={"units": unit})
        for heading, unit in zip(headings(table), table.units.values(), strict=True)
    ]
    schema, done = arrow.schema(fields, metadata=about), 0
    with parquet.ParquetWriter(path, schema) as writer:
        for block in table.blocks(list(table.units), 16 * BLOCK):
            columns = [arrow.array(np.ascontiguousarray(column)) for column in block.T]
            writer.write_table(arrow.Table.from_arrays(columns, schema=schema))
            done += len(block)
            progress(done / table.rows)


def _write_npz(path: Path, table: Table, progress: Progress) -> None:
    about = {"format": MARK, "units": table.units, "attributes": {k: str(v) for k, v in table.attributes.items()}}

    def arrays() -> Iterator[tuple[str, NDArray[Any]]]:
        yield MARK, np.array(json.dumps(about))
        for k, name in enumerate(table.units):
            yield name, next(table.blocks([name], max(table.rows, 1)))[:, 0]
            progress((k + 1) / len(table.units))

    write_archive(path, arrays())


def _starts(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(64).startswith(tuple(head.encode() for head in CSV_HEADS))


def _csv_of(table: Table) -> Kind:
    """File kind of CSV tables: files of this program, or files that begin with the headings of ``table``."""
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(headings(table))
    head = line.getvalue().encode()

    def includes(path: Path) -> bool:
        with path.open("rb") as file:
            return _starts(path) or file.read(len(head)) == head

    return Kind("table of cranktrain", includes)


def _footed(path: Path) -> bool:
    """True if the footer of a Parquet file contains this program's mark; the file ends with the footer's length."""
    with path.open("rb") as file:
        end = file.seek(0, 2)
        if end < 12:
            return False
        file.seek(end - 8)
        tail = file.read(8)
        length = int.from_bytes(tail[:4], "little")
        file.seek(max(end - 8 - length, 0))
        return tail[4:] == b"PAR1" and MARK.encode() in file.read(length)


FORMATS = {
    ".csv": (_write_csv, Kind("table of cranktrain", _starts)),
    ".parquet": (_write_parquet, Kind("table of cranktrain", _footed)),
    ".npz": (_write_npz, marked("table of cranktrain", f"{MARK}.npy")),
}
"""Writers of tables by file ending: function that writes the table, and kind of its file."""
