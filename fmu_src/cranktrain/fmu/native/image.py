"""Images of runs: the arrays of a ``Run`` record in the form in which a library reads them from a file.

A variant is one choice of levels. Variants share arrays of equal contents. There are three kinds of memory: zeros and
copies, which each instance has of its own, and constants, which all instances read from the file.
"""

import hashlib
from collections.abc import Callable, Mapping
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import ADDRESSES, RECORDS
from cranktrain.core.records import address_of, leaves, number_word
from cranktrain.fmu.native.file_format import COPIED, FUNCTION, NONE, PLAIN, RECORD, SHARED, TRANSPOSED, ZEROS, Blob

MOST_DIMENSIONS = 4
WORD = 8
"""Bytes of a number in a matrix that may be stored transposed."""

Row = dict[str, Any]


class Images:
    """Tables of all variants added so far, by section.

    Parameters
    ----------
    functions : number of each function of the library, by name
    constant : function that is true for the path of an array in the run (``model.gas``) or in a record
        (``RigidBore.table.force``) that kernels never write

    Attributes
    ----------
    called : numbers of the functions that the variants so far refer to
    """

    def __init__(self, functions: Mapping[str, int], constant: Callable[[str], bool]) -> None:
        self.functions, self.constant, self.blob = functions, cache(constant), Blob()
        self.tables: dict[str, list[Any]] = {
            name: [] for name in ("VARI", "NUMB", "SLOT", "LEAF", "RECS", "ARRY", "FIXU")
        }
        self.called: set[int] = set()
        self._rows: dict[tuple[Any, ...], int] = {}
        self._lasting: dict[int, tuple[NDArray[Any], int]] = {}

    def add(self, run: Any, numbers: Mapping[int, float]) -> int:
        """Add a variant, given by an unprepared run and its ``numbers`` by slot. Return the variant's number."""
        made = _Variant(self, run)
        first = {name: len(rows) for name, rows in self.tables.items()}
        self.tables["LEAF"] += made.leaves
        for rows in made.records:
            self.tables["RECS"].append({"first_leaf": len(self.tables["LEAF"]), "n_leaves": len(rows)})
            self.tables["LEAF"] += rows
        self.tables["SLOT"] += made.slots
        self.tables["NUMB"] += [{"slot": slot, "value": value} for slot, value in numbers.items()]
        self.tables["VARI"].append(
            {
                "first_leaf": first["LEAF"], "n_leaves": len(made.leaves),
                "first_slot": first["SLOT"], "n_slots": len(made.slots),
                "first_record": first["RECS"], "n_records": len(made.records),
                "first_number": first["NUMB"], "n_numbers": len(numbers),
            }
        )  # fmt: skip
        return first["VARI"]

    def sections(self) -> dict[str, Any]:
        """Sections of all variants added so far."""
        return {**self.tables, "BLOB": self.blob.table()}

    def row(self, array: NDArray[Any], path: str, fixups: tuple[tuple[int, int, int], ...], lasts: bool = False) -> int:
        """Row of ARRY for an array's contents; addresses in it are left to ``fixups`` (byte offset, kind, number).

        ``lasts`` is true if the array is the same object with the same contents in all variants that have it.
        """
        if not array.flags.c_contiguous or array.ndim > MOST_DIMENSIONS:
            raise ValueError(f"{path} has strides {array.strides} and shape {array.shape}, which a file cannot hold")
        kind = SHARED if self.constant(path) else COPIED
        if fixups or not (lasts or kind == SHARED):
            return self._kept_row(array, kind, fixups)
        # Contents of a lasting array are examined only once, because hundreds of variants share tables of megabytes.
        if id(array) not in self._lasting:
            self._lasting[id(array)] = array, self._kept_row(array, kind, fixups)
        return self._lasting[id(array)][1]

    def _kept_row(self, array: NDArray[Any], kind: int, fixups: tuple[tuple[int, int, int], ...]) -> int:
        kept = array.reshape(-1).view(np.uint8) if array.size else np.zeros(0, dtype=np.uint8)
        if fixups:
            kept = kept.copy()
        for offset, _, _ in fixups:
            kept[offset : offset + 8] = 0
        if kind == COPIED and not fixups and not kept.any():
            kind, kept = ZEROS, kept[:0]
        contents = hashlib.sha256(kept.data).digest() if kept.size else b""
        key = (kind, array.shape, array.itemsize, contents, fixups)
        if key not in self._rows:
            self._rows[key] = len(self.tables["ARRY"])
            is_matrix = kind == COPIED and array.ndim == 2 and array.itemsize == WORD and not fixups
            place = self.blob.find(array.T) if is_matrix else None
            if place is not None:
                kind = TRANSPOSED
            elif kept.size:
                place = self.blob.put(kept)[0]
            self.tables["ARRY"].append(
                {
                    "offset": place or 0, "bytes": array.nbytes, "shape": array.shape + (0,) * (4 - array.ndim),
                    "ndim": array.ndim, "itemsize": array.itemsize, "kind": kind,
                    "first_fixup": len(self.tables["FIXU"]), "n_fixups": len(fixups),
                }
            )  # fmt: skip
            self.tables["FIXU"] += [{"byte_offset": o, "kind": k, "index": i} for o, k, i in fixups]
        return self._rows[key]


class _Variant:
    """One variant in preparation: leaves of its run, its slots, and the records to which its arrays refer."""

    def __init__(self, images: Images, run: Any) -> None:
        self.images = images
        self.slots: list[int] = []
        self.records: list[list[tuple[int, int, int]]] = []
        self._known: dict[tuple[int, tuple[int, ...]], int] = {}
        self._numbers: dict[int, int] = {}
        self._taken: list[tuple[int, int, str]] = []
        self.leaves = [self._leaf(path, leaf) for path, leaf in leaves(run)]
        # An instance would duplicate arrays that overlap.
        for (start, size, path), (after, _, other) in pairwise(sorted(self._taken)):
            if start + size > after:
                raise ValueError(f"{path} and {other} share memory, which a file cannot represent")

    def _leaf(self, path: str, leaf: Any, of_record: bool = False) -> tuple[int, int, int]:
        """Row of section LEAF for an array or a number of a run."""
        if isinstance(leaf, np.ndarray):
            return self._slot(path, leaf, of_record), PLAIN, 0
        return NONE, PLAIN, number_word(leaf) % 2**64

    def _slot(self, path: str, array: NDArray[Any], of_record: bool) -> int:
        # An empty array has no unique address, so it gets a negative number in place of one.
        address = address_of(array) if array.size else -len(self.slots) - 1
        own = self._known.get((address, array.shape))
        if own is None:
            own = self._known[address, array.shape] = len(self.slots)
            self.slots.append(NONE)
            if array.size:
                self._taken.append((address, array.nbytes, path))
            self.slots[own] = self.images.row(array, path, self._fixups(array), of_record)
        return own

    def _fixups(self, array: NDArray[Any]) -> tuple[tuple[int, int, int], ...]:
        """Addresses of functions and records in an array of integers."""
        if array.dtype != np.int64:
            return ()
        found = []
        for k, value in enumerate(array.ravel().tolist()):
            if value in ADDRESSES:
                found.append((8 * k, FUNCTION, number := self.images.functions[ADDRESSES[value]]))
                self.images.called.add(number)
            elif value in RECORDS:
                if value not in self._numbers:
                    record, self._numbers[value] = RECORDS[value], len(self.records)
                    self.records.append([])
                    self.records[self._numbers[value]] += [
                        self._leaf(f"{type(record).__name__}.{path}", leaf, True) for path, leaf in leaves(record)
                    ]
                found.append((8 * k, RECORD, self._numbers[value]))
        return tuple(found)


def leaf_numbers(run: Any, paths: Mapping[str, str]) -> dict[str, int]:
    """Numbers of a run's leaves, by the names given to their paths."""
    numbers = {path: k for k, (path, _) in enumerate(leaves(run))}
    return {name: numbers[path] for name, path in paths.items()}
