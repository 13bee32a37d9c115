r"""Format of a native FMU's data, ``resources/native.bin``: a flat file of tables that C maps and reads in place.

Little-endian; sections lie at multiples of 8 bytes, the last one at a multiple of 64::

    0    8 bytes   magic, b"CRNKNAT\0"
    8    uint32    version
    12   uint32    0x01020304, the order of bytes
    16   uint64    size of the file in bytes, a multiple of 8
    24   16 bytes  digest (hexadecimal) of the layout of Run, the same as that of the kernels
    40   40 bytes  GUID with braces, padded with zeros
    80   uint64    CRC-32 (IEEE 802.3) of the bytes from byte 96 on
    88   uint64    Σ (i + 1) wᵢ of the uint64 words there, modulo 2⁶⁴
    96   uint32    number of sections, uint32 0
    104            for each section: 8 bytes name, uint64 offset, uint64 bytes, uint64 rows
                   the sections

The rows of each section are :data:`SECTIONS`. A *text* is an offset in TEXT; :data:`NONE` stands for "none". Rows of
one table refer to rows of another by index; leaves, records and slots of a variant are counted from its first one.
Equal tables give equal bytes. The C reader is ``c/file.c``; tests compare both.
"""

import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import StoreError

MAGIC = b"CRNKNAT\0"
VERSION = 3
BYTE_ORDER = 0x01020304
NONE = 0xFFFFFFFF
"""Value of a uint32 index that refers to no row."""
REFUSED = 0x80000000
"""Bit of a row of LEVL that contains the text of a refusal instead of a variant."""
LARGEST = float(np.finfo(np.float64).max)
"""Upper bound stored for a variable without bounds; the lower bound is its negative."""
ALIGNMENT = 64
"""Alignment of arrays in BLOB, bytes: a cache line of a processor."""

REAL, INTEGER, BOOLEAN, STRING, ENUMERATION = range(5)
"""Types of a variable."""
INPUT, OUTPUT, PARAMETER, LOCAL = range(4)
"""Causalities of a variable."""
LEVEL, NUMBER = range(2)
"""Kinds of a choice: LEVEL selects the variant, NUMBER sets one of ``run.numbers``."""
ZEROS, COPIED, SHARED, TRANSPOSED = range(4)
"""Kinds of an array's memory. ZEROS: zeros at the start. COPIED: a copy for each instance. SHARED: memory of the file,
shared by all instances. TRANSPOSED: a copy of a matrix of eight-byte numbers that is stored transposed."""
FUNCTION, RECORD = range(2)
"""Target of a fixup's address: a function of the kernels, a record of the variant."""
PLAIN, FUNCTION_LEAF, RECORD_LEAF = range(3)
"""Content of a leaf that is not an array: a number, the address of a function, or the address of a record."""
ERROR, DISCARD = range(2)
"""Meaning of a kernel's status: refused input (ERROR), or a failed step (DISCARD)."""

_PREFIX = struct.Struct("<8sIIQ16s40sQQ")
_SUMMED = _PREFIX.size
_COUNT = struct.Struct("<II")
_ENTRY = struct.Struct("<8sQQQ")


def _row(**columns: str) -> np.dtype[Any]:
    """Type of a row with columns without gaps."""
    return np.dtype([(name, f"<{kind}") for name, kind in columns.items()])


_ONE = np.dtype("<u4")

SECTIONS: Mapping[str, np.dtype[Any]] = MappingProxyType(
    {
        # TEXT: UTF-8 texts, each followed by a zero byte; the empty text is at offset 0.
        "TEXT": np.dtype("u1"),
        # VARS: variables in the order of value references.
        # index: position in run.inputs or run.outputs, slot of run.numbers, or row of CHOI.
        "VARS": np.dtype(
            [
                *(("name", "<u4"), ("start_text", "<u4"), ("type", "u1"), ("causality", "u1"), ("pad", "<u2")),
                *(("index", "<u4"), ("start", "<f8"), ("min", "<f8"), ("max", "<f8"), ("nominal", "<f8")),
                *(("first_family", "<u4"), ("n_families", "<u4")),
            ]
        ),
        # FAMS: rows of run.outputs.families that an output needs.
        "FAMS": _ONE,
        # CHOI: choices of String and Enumeration parameters; index: slot of run.numbers, for kind NUMBER.
        "CHOI": _row(name="u4", first_option="u4", n_options="u4", kind="u4", index="u4"),
        # OPTN: options of a choice; value: digit of the variant's key (LEVEL); number: value for run.numbers (NUMBER).
        "OPTN": _row(text="u4", value="u4", number="f8"),
        # LEVL: variant of each combination of LEVEL choices, or REFUSED | text; the first choice is most significant.
        "LEVL": _ONE,
        "VARI": _row(
            first_leaf="u4", n_leaves="u4", first_slot="u4", n_slots="u4",
            first_record="u4", n_records="u4", first_number="u4", n_numbers="u4",
        ),
        # NUMB: values of run.numbers of a variant, set before the values of parameters.
        "NUMB": _row(slot="u4", pad="u4", value="f8"),
        # SLOT: row of ARRY for each piece of memory of an instance.
        "SLOT": _ONE,
        # LEAF: members of the flattened tuple Run: slot of an array, or NONE and the eight bytes of a number.
        "LEAF": _row(slot="u4", kind="u4", value="u8"),
        "RECS": _row(first_leaf="u4", n_leaves="u4"),
        "ARRY": np.dtype(
            [
                *(("offset", "<u8"), ("bytes", "<u8"), ("shape", "<u8", (4,)), ("ndim", "<u4"), ("itemsize", "<u4")),
                *(("kind", "<u4"), ("first_fixup", "<u4"), ("n_fixups", "<u4"), ("pad", "<u4")),
            ]
        ),
        # FIXU: positions of addresses within an array of kind COPIED.
        "FIXU": _row(byte_offset="u8", kind="u4", index="u4"),
        # NAME: leaves of Run that the C side uses.
        # Names: state, inputs, outputs, numbers, families, input_rates, staged.
        "NAME": _row(name="u4", leaf="u4"),
        "STAT": _row(code="i4", text="u4", kind="u4", pad="u4"),
        "INFO": _row(name="u4", text="u4"),
        "BLOB": np.dtype("u1"),
    }
)  # fmt: skip
"""Type of the rows of each section, in the order of the file."""


class Texts:
    """Builder of section TEXT."""

    def __init__(self) -> None:
        self._bytes = bytearray(b"\0")
        self._known = {"": 0}

    def at(self, text: str) -> int:
        """Offset of a text; each text is stored once."""
        if "\0" in text:
            raise StoreError(f"native.bin: the text {text!r} contains a zero byte; leave it out")
        if text not in self._known:
            self._known[text] = len(self._bytes)
            self._bytes += text.encode() + b"\0"
        return self._known[text]

    def table(self) -> NDArray[Any]:
        """Bytes of the section as rows of its table."""
        return np.frombuffer(bytes(self._bytes), dtype=SECTIONS["TEXT"])


class Blob:
    """Builder of section BLOB."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0
        self._known: dict[bytes, int] = {}

    def put(self, array: NDArray[Any]) -> tuple[int, int]:
        """Offset and length, bytes, of an array's values in C order; equal values are stored once."""
        data = np.ascontiguousarray(array).tobytes()
        if data not in self._known:
            padded = data + bytes(-len(data) % ALIGNMENT)
            self._known[data] = self._size
            self._parts.append(padded)
            self._size += len(padded)
        return self._known[data], len(data)

    def find(self, array: NDArray[Any]) -> int | None:
        """Offset of an array's values in C order; None if they are not stored yet."""
        return self._known.get(np.ascontiguousarray(array).tobytes())

    def table(self) -> NDArray[Any]:
        """Bytes of the section as rows of its table."""
        return np.frombuffer(b"".join(self._parts), dtype=SECTIONS["BLOB"])


def table(section: str, rows: Iterable[Any]) -> NDArray[Any]:
    """Rows of a section from numbers, tuples, or mappings of columns; missing columns are 0.

    Raises ``StoreError`` for a column that the section does not have.
    """
    dtype = SECTIONS[section]
    listed = list(rows)
    if not any(isinstance(row, Mapping) for row in listed):
        return np.array(listed, dtype=dtype)
    made = np.zeros(len(listed), dtype=dtype)
    for i, row in enumerate(listed):
        if not isinstance(row, Mapping):
            made[i] = row
            continue
        for column, value in row.items():
            if column not in (dtype.names or ()):
                raise StoreError(f"native.bin: section {section} has no column '{column}'; valid: {dtype.names}")
            made[i][column] = value
    return made


@dataclass(frozen=True)
class NativeFile:
    """Contents of a native.bin.

    Attributes
    ----------
    digest : 16 hexadecimal digits of the kernels' layout
    guid : GUID of the FMU, with braces
    tables : rows by section name; missing sections are empty
    """

    digest: str
    guid: str
    tables: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def __getitem__(self, section: str) -> NDArray[Any]:
        return self.tables.get(section, np.zeros(0, dtype=SECTIONS[section]))

    def text(self, offset: int) -> str:
        """Text at an offset of TEXT."""
        data = self["TEXT"].tobytes()
        return data[offset : data.index(b"\0", offset)].decode()


def to_bytes(file: NativeFile) -> bytes:
    """Bytes of the file in the layout of this module.

    Raises
    ------
    StoreError
        a digest, GUID or table that does not fit the layout
    """
    digest, guid = file.digest.encode(), file.guid.encode()
    if len(digest) != 16:
        raise StoreError(f"native.bin: the digest '{file.digest}' does not have 16 digits")
    if not 0 < len(guid) < 40:
        raise StoreError(f"native.bin: the GUID '{file.guid}' is not one of at most 39 characters")
    directory, sections = [_COUNT.pack(len(SECTIONS), 0)], []
    at = _SUMMED + _COUNT.size + _ENTRY.size * len(SECTIONS)
    for name, dtype in SECTIONS.items():
        rows = file[name]
        if name == "TEXT" and not rows.size:
            rows = Texts().table()
        if rows.dtype != dtype or rows.ndim != 1:
            raise StoreError(f"native.bin: section {name} holds rows of {rows.dtype}, not of {dtype}")
        data = rows.tobytes()
        before = -at % (ALIGNMENT if name == "BLOB" else 8)
        sections.append(bytes(before) + data)
        at += before
        directory.append(_ENTRY.pack(name.encode(), at, len(data), len(rows)))
        at += len(data)
    body = b"".join([*directory, *sections, bytes(-at % 8)])
    # Checksums of a file's body: CRC-32, and the sum modulo 2⁶⁴ of its 64-bit words times their numbers from 1 on.
    words = np.frombuffer(body, dtype="<u8")
    counts = np.arange(1, words.size + 1, dtype=np.uint64)
    first, second = zlib.crc32(body), int((words * counts).sum(dtype=np.uint64))
    prefix = _PREFIX.pack(MAGIC, VERSION, BYTE_ORDER, _SUMMED + len(body), digest, guid, first, second)
    return prefix + body
