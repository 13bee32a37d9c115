"""The flat file of a native FMU: what is written is read, what was changed is noticed."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cranktrain.core.errors import StoreError
from cranktrain.fmu.native.file_format import (
    ALIGNMENT,
    NONE,
    SECTIONS,
    Blob,
    NativeFile,
    Texts,
    from_bytes,
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


def test_what_is_written_is_read():
    file = example()
    data = to_bytes(file)
    assert len(data) % 8 == 0
    read = from_bytes(data)
    assert (read.digest, read.guid) == (DIGEST, GUID)
    for section in SECTIONS:
        assert np.array_equal(read[section], file[section]), section
    assert [read.text(row["name"]) for row in read["VARS"]] == ["speed", "Größe"]
    array = read["ARRY"][0]
    values = read["BLOB"][array["offset"] : array["offset"] + array["bytes"]].view("<f8")
    assert values.tolist() == list(range(7))
    assert to_bytes(read) == data


def test_sections_are_aligned():
    data = to_bytes(example())
    for k, name in enumerate(SECTIONS):
        raw, offset, _, _ = struct.unpack_from("<8sQQQ", data, 104 + 32 * k)
        assert raw.rstrip(b"\0").decode() == name
        assert offset % (ALIGNMENT if name == "BLOB" else 8) == 0


def test_equal_texts_and_arrays_are_kept_once():
    texts, blob = Texts(), Blob()
    assert texts.at("") == 0 and texts.at("a") == texts.at("a") != texts.at("b")
    assert blob.put(np.ones(3)) == blob.put(np.ones(3))
    assert blob.put(np.zeros(0))[1] == 0


@given(st.data())
def test_any_changed_byte_is_noticed(data):
    whole = to_bytes(example())
    place = data.draw(st.integers(0, len(whole) - 1))
    changed = bytearray(whole)
    changed[place] ^= data.draw(st.integers(1, 255))
    if 24 <= place < 80:  # digest and GUID are compared where the file is used
        read = from_bytes(bytes(changed))
        assert (read.digest, read.guid) != (DIGEST, GUID)
        return
    with pytest.raises(StoreError, match="build the FMU again"):
        from_bytes(bytes(changed))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: b"", "not the data of a native FMU"),
        (lambda data: data[:100], "not the data of a native FMU"),
        (lambda data: data[:-8], "truncated"),
        (lambda data: data[:8] + struct.pack("<I", 99) + data[12:], "version 99"),
        (lambda data: data[:12] + data[15:11:-1] + data[16:], "byte order"),
    ],
)
def test_what_is_wrong_is_named(change, words):
    with pytest.raises(StoreError, match=words):
        from_bytes(change(to_bytes(example())))


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
