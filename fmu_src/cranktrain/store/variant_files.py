"""Variants of a study in a folder of Parquet files, with a journal of those not yet in a Parquet file.

    _study.json          digest of the study, its values, outputs, units and speeds
    part-00000.parquet   a row for each finished variant: number, values, outputs, reason of a failure
    _journal.jsonl       a line for each variant that was finished since then, added at once

Pandas, Polars, DuckDB and Dask read the folder as one table; they ignore names that begin with _. A line that was
half-written when the process was killed ends the journal. All values are in SI; fields name their units.
"""

import json
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.types import Array
from cranktrain.store.sound_files import DAMAGED, json_of
from cranktrain.store.whole_file import TEMPORARY, marked, whole_file

HEAD, JOURNAL, PART = "_study.json", "_journal.jsonl", "part-{:05d}.parquet"
FORMAT = "cranktrain variants 1"
ROWS = 1000
"""Number of variants in a Parquet file, and largest number of variants held in memory during a study."""
NUMBER, REASON, CURVE = "variant", "failed", " over speed"
"""Names of the columns of a variant's number and of its failure; ending of columns with a value for each speed."""


class Column(NamedTuple):
    """Output of a study: name, SI unit, True if it has a value for each speed, True if its ``least`` value is worst."""

    name: str
    unit: str
    over_speed: bool
    worst: str


class Row(NamedTuple):
    """A finished variant: number, values (d,), outputs, and reason of a failure (empty if there is none)."""

    number: int
    values: Array
    outputs: Mapping[str, Array]
    failed: str = ""


@dataclass
class VariantFiles:
    """Folder of a study with the Parquet files and the journal of its variants.

    Attributes
    ----------
    folder : path of the folder
    names, units : varied values, (d,), and their SI units
    columns : outputs
    speeds : (s,) rad/s
    about : further data of the study
    """

    folder: Path
    names: tuple[str, ...]
    units: tuple[str, ...]
    columns: tuple[Column, ...]
    speeds: Array
    about: dict[str, Any] = field(default_factory=dict)
    _waiting: list[Row] = field(default_factory=list)
    _journal: TextIO | None = None
    _parts: int = 0

    @classmethod
    def open(cls, folder: str | Path) -> "VariantFiles":
        """Open an existing folder; ``StoreError`` if it is missing, damaged or foreign."""
        folder = Path(folder)
        try:
            head = json_of((folder / HEAD).read_text("utf-8"))
            columns = tuple(Column(*one) for one in head["columns"])
            if head["format"] != FORMAT:
                raise ValueError(head["format"])
            found = cls(
                folder, tuple(head["names"]), tuple(head["units"]), columns, np.array(head["speeds"]), head["about"]
            )
        except DAMAGED as error:
            raise StoreError(f"{folder}: is no folder of variants ({error}); name one that vary wrote") from None
        return found

    def begin(self, digest: str, anew: bool) -> set[int]:
        """Prepare the folder, also after a killed run; returns the numbers of the variants that it already contains.

        Raises ``InputError`` for a folder with other files, or of another study unless ``anew`` replaces it.
        """
        if self.folder.exists() and not self.folder.is_dir():
            raise InputError(f"{self.folder}: exists and is no folder; name another --output")
        head = {"format": FORMAT, "digest": digest, "names": self.names, "units": self.units,
                "columns": self.columns, "speeds": self.speeds.tolist(), "about": self.about}  # fmt: skip
        if self.folder.is_dir() and any(not TEMPORARY.fullmatch(place.name) for place in self.folder.iterdir()):
            if not (self.folder / HEAD).is_file():
                raise InputError(f"{self.folder}: holds other files; name another --output")
            if anew:
                journals = (self.folder / JOURNAL, self.folder / f"{JOURNAL}.new")
                for place in (*self.folder.glob("part-*.parquet"), *journals, self.folder / HEAD):
                    place.unlink(missing_ok=True)
            elif _digest(self.folder / HEAD) != digest:
                raise InputError(
                    f"{self.folder}: holds variants of another study, or of another version; name another --output, or "
                    "replace them by --anew"
                )
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be made ({error.strerror}); name another --output") from None
        if not (self.folder / HEAD).is_file():
            with whole_file(self.folder / HEAD, marked("head of a study", FORMAT)) as place:
                place.write_text(json.dumps(head), "utf-8")
        # New part files are numbered after the highest existing number, so that none is replaced.
        names = [re.fullmatch(r"part-(\d{1,9})\.parquet", place.name) for place in self.folder.iterdir()]
        self._parts = max((int(found[1]) + 1 for found in names if found), default=0)
        held = {int(n) for table in self._tables([NUMBER]) for n in table.column(NUMBER).to_numpy()}
        self._waiting = [row for row in self._journal_rows() if row.number not in held]
        self._open_journal()
        return held | {row.number for row in self._waiting}

    def keep(self, row: Row) -> None:
        """Store a finished variant, which then survives the end of the process."""
        self._waiting.append(row)
        assert self._journal is not None
        self._journal.write(_line(row))
        self._journal.flush()
        if len(self._waiting) >= ROWS:
            self.write()

    def write(self) -> None:
        """Write the variants of the journal to a Parquet file."""
        if not self._waiting:
            return
        arrow, files = parquet()
        place = self.folder / PART.format(self._parts)
        with whole_file(place, marked("Parquet file", "PAR1")) as temporary:
            files.write_table(self._table(arrow, self._waiting), temporary)
        self._parts += 1
        self._waiting = []
        self._open_journal()

    def close(self) -> None:
        """Write the remaining variants, and close the journal."""
        self.write()
        if self._journal is not None:
            self._journal.close()
            self._journal = None
        with suppress(OSError):
            (self.folder / JOURNAL).unlink()

    def column(self, name: str) -> NDArray[Any]:
        """Column (n,) in the order of variant numbers: number, value, an output's worst value, or reason of failure."""
        found = [table.column(name).to_numpy() for table in self._tables([name])]
        whole = np.concatenate(found) if found else np.zeros(0)
        return np.asarray(whole[self._order()])

    def curve(self, name: str, first: int = 0, last: int | None = None) -> Array:
        """Values (n, k) of an output at speeds ``first`` to ``last`` (exclusive), in the order of variant numbers."""
        cut = slice(first, last)
        found = []
        for table in self._tables([name + CURVE]):
            chunks = table.column(name + CURVE).combine_chunks()
            flat = chunks.flatten() if not hasattr(chunks, "chunks") else chunks.chunk(0).flatten()
            found.append(flat.to_numpy(zero_copy_only=False).reshape(-1, self.speeds.size)[:, cut].copy())
        whole = np.concatenate(found) if found else np.zeros((0, len(range(*cut.indices(self.speeds.size)))))
        return np.asarray(whole[self._order()])

    def _order(self) -> NDArray[np.intp]:
        found = [table.column(NUMBER).to_numpy() for table in self._tables([NUMBER])]
        return np.argsort(np.concatenate(found)) if found else np.zeros(0, dtype=np.intp)

    def _tables(self, names: list[str]) -> Iterator[Any]:
        _, files = parquet()
        for place in sorted(self.folder.glob("part-*.parquet")):
            try:
                yield files.read_table(place, columns=names, partitioning=None)
            except (OSError, ValueError) as error:
                raise StoreError(f"{place}: cannot be read ({error}); delete it and run the study again") from None

    def _table(self, arrow: Any, rows: list[Row]) -> Any:
        """Arrow table with one row per given variant."""
        s = self.speeds.size
        arrays = [arrow.array([row.number for row in rows], arrow.int64())]
        fields = [arrow.field(NUMBER, arrow.int64())]
        for k, (name, unit) in enumerate(zip(self.names, self.units, strict=True)):
            arrays.append(arrow.array([row.values[k] for row in rows], arrow.float64()))
            fields.append(arrow.field(name, arrow.float64(), metadata={"unit": unit}))
        for column in self.columns:
            lost = np.full(s if column.over_speed else 1, np.nan)
            values = np.array([row.outputs.get(column.name, lost) for row in rows])
            worst = values.min(axis=1) if column.worst == "least" else values.max(axis=1)
            arrays.append(arrow.array(worst, arrow.float64()))
            fields.append(arrow.field(column.name, arrow.float64(), metadata={"unit": column.unit}))
            if column.over_speed:
                kind = arrow.list_(arrow.float64(), s)
                arrays.append(arrow.FixedSizeListArray.from_arrays(arrow.array(values.ravel(), arrow.float64()), s))
                fields.append(arrow.field(column.name + CURVE, kind, metadata={"unit": column.unit}))
        arrays.append(arrow.array([row.failed for row in rows], arrow.string()))
        fields.append(arrow.field(REASON, arrow.string()))
        facts = {"cranktrain": FORMAT, "speeds_rad_per_s": json.dumps(self.speeds.tolist())}
        return arrow.table(arrays, schema=arrow.schema(fields, metadata=facts))

    def _journal_rows(self) -> Iterator[Row]:
        """Variants in the journal, up to the first invalid line."""
        with suppress(*DAMAGED), (self.folder / JOURNAL).open(encoding="utf-8") as file:
            for line in file:
                if not line.endswith("\n"):
                    return
                number, values, outputs, failed = json_of(line)
                row = Row(int(number), np.array(values), {n: np.array(v) for n, v in outputs.items()}, str(failed))
                if not self._fits(row):
                    return
                yield row

    def _fits(self, row: Row) -> bool:
        """True if a row of the journal fits this study."""
        sizes = {column.name: self.speeds.size if column.over_speed else 1 for column in self.columns}
        arrays = [(row.values, len(self.names)), *((value, sizes.get(name)) for name, value in row.outputs.items())]
        return all(value.shape == (size,) and value.dtype.kind in "fiu" for value, size in arrays)

    def _open_journal(self) -> None:
        """Open the journal with the variants not yet in a Parquet file; a complete new journal replaces the old one."""
        if self._journal is not None:
            self._journal.close()
        place, fresh = self.folder / JOURNAL, self.folder / f"{JOURNAL}.new"
        fresh.write_text("".join(map(_line, self._waiting)), "utf-8")
        fresh.replace(place)
        self._journal = place.open("a", encoding="utf-8")


def _line(row: Row) -> str:
    outputs = {name: np.asarray(value).tolist() for name, value in row.outputs.items()}
    return json.dumps([row.number, np.asarray(row.values).tolist(), outputs, row.failed]) + "\n"


def parquet() -> tuple[Any, Any]:
    """PyArrow and its Parquet module; ``InputError`` with installation advice if it is missing."""
    try:
        return import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        raise InputError("variants are kept as Parquet; pip install pyarrow, or cranktrain[parquet]") from None


def _digest(head: Path) -> str:
    """Digest of the study in a folder; empty if its head file is missing or damaged."""
    try:
        return str(json_of(head.read_text("utf-8"))["digest"])
    except DAMAGED:
        return ""
