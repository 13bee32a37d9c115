"""The flat file of a native FMU as Python writes it; reading it is tested on the C side."""

import struct

import numpy as np
import pytest

from cranktrain.core.errors import StoreError
from cranktrain.fmu.native.file_format import (
    ALIGNMENT,
    NONE,
    SECTIONS,
    Blob,
    NativeFile,
    Texts,
    table,
    to_bytes,
)

DIGEST, GUID = "0123456789abcdef", "{8c4e810f-3df3-4a00-8276-176fa3c9f9e0}"
ROW_BYTES = {
    "TEXT": 1, "VARS": 56, "FAMS": 4, "CHOI": 20, "OPTN": 16, "LEVL": 4, "VARI": 32, "NUMB": 16, "SLOT": 4, "LEAF": 16,
    "RECS": 8, "ARRY": 72, "FIXU": 16, "NAME": 8, "STAT": 16, "INFO": 8, "BLOB": 1,
}  # fmt: skip
"""Sizes of the structures that the C side reads."""


def example():
    texts, blob = Texts(), Blob()
    offset, size = blob.put(np.arange(7.0))
    again, _ = blob.put(np.ones((2, 3)))
    assert again % ALIGNMENT == 0 and again > offset
    variables = [{"name": texts.at("speed"), "index": 0, "start": 200.0}, {"name": texts.at("Größe"), "index": NONE}]
    tables = {
        "VARS": table("VARS", variables),
        "SLOT": table("SLOT", [0, 1]),
        "ARRY": table("ARRY", [{"offset": offset, "bytes": size, "shape": (7, 0, 0, 0), "ndim": 1, "itemsize": 8}]),
        "TEXT": texts.table(),
        "BLOB": blob.table(),
    }
    return NativeFile(DIGEST, GUID, tables)


def test_rows_have_the_sizes_that_c_expects():
    assert {name: dtype.itemsize for name, dtype in SECTIONS.items()} == ROW_BYTES


def directory(data):
    """Name, offset and rows of each section."""
    entries = (struct.unpack_from("<8sQQQ", data, 104 + 32 * k) for k in range(len(SECTIONS)))
    return [(raw.rstrip(b"\0").decode(), offset, rows) for raw, offset, _, rows in entries]


def test_what_is_written_can_be_read():
    file = example()
    data = to_bytes(file)
    assert len(data) % 8 == 0
    assert data[24:40].decode() == DIGEST and data[40:80].rstrip(b"\0").decode() == GUID
    tables = {name: np.frombuffer(data, SECTIONS[name], rows, offset) for name, offset, rows in directory(data)}
    read = NativeFile(DIGEST, GUID, tables)
    for section in SECTIONS:
        assert np.array_equal(read[section], file[section]), section
    assert [read.text(row["name"]) for row in read["VARS"]] == ["speed", "Größe"]
    array = read["ARRY"][0]
    values = read["BLOB"][array["offset"] : array["offset"] + array["bytes"]].view("<f8")
    assert values.tolist() == list(range(7))
    assert to_bytes(read) == data


def test_sections_are_aligned():
    data = to_bytes(example())
    assert [name for name, _, _ in directory(data)] == list(SECTIONS)
    for name, offset, _ in directory(data):
        assert offset % (ALIGNMENT if name == "BLOB" else 8) == 0


def test_equal_texts_and_arrays_are_kept_once():
    texts, blob = Texts(), Blob()
    assert texts.at("") == 0 and texts.at("a") == texts.at("a") != texts.at("b")
    assert blob.put(np.ones(3)) == blob.put(np.ones(3))
    assert blob.put(np.zeros(0))[1] == 0


def test_what_does_not_fit_is_refused():
    with pytest.raises(StoreError, match="no column 'nome'"):
        table("VARS", [{"nome": 1}])
    with pytest.raises(StoreError, match="digest"):
        to_bytes(NativeFile("12", GUID))
    with pytest.raises(StoreError, match="GUID"):
        to_bytes(NativeFile(DIGEST, ""))
    with pytest.raises(StoreError, match="section SLOT holds rows"):
        to_bytes(NativeFile(DIGEST, GUID, {"SLOT": np.zeros(2)}))
    with pytest.raises(StoreError, match="zero"):
        Texts().at("a\0b")
