"""The flat file of a native FMU as Python writes it, and what it keeps of a run's arrays; C reads it in other tests."""

import struct
from typing import NamedTuple

import numpy as np
import pytest

from cranktrain.core.errors import StoreError
from cranktrain.fmu.native.file_format import (
    ALIGNMENT,
    COPIED,
    NONE,
    SECTIONS,
    SHARED,
    TRANSPOSED,
    ZEROS,
    Blob,
    NativeFile,
    Texts,
    table,
    to_bytes,
)
from cranktrain.fmu.native.image import Images

DIGEST, GUID = "0123456789abcdef", "{8c4e810f-3df3-4a00-8276-176fa3c9f9e0}"


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


def test_sections_are_aligned():
    data = to_bytes(example())
    entries = (struct.unpack_from("<8sQQQ", data, 104 + 32 * k) for k in range(len(SECTIONS)))
    places = {raw.rstrip(b"\0").decode(): offset for raw, offset, *_ in entries}
    assert list(places) == list(SECTIONS)
    for name, offset in places.items():
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


class Run(NamedTuple):
    """A run of a few arrays."""

    matrix: np.ndarray
    turned: np.ndarray
    table: np.ndarray
    work: np.ndarray
    least: np.ndarray


def run():
    matrix = np.arange(1.0, 7.0).reshape(2, 3)
    return Run(matrix, np.ascontiguousarray(matrix.T), np.ones((8, 8)), np.zeros((4, 2)), np.array([[-0.0]]))


def images():
    return Images({}, lambda path: path == "table")


def test_a_matrix_and_its_transposed_are_kept_once():
    made = images()
    made.add(run(), {})
    rows = made.tables["ARRY"]
    assert [row["kind"] for row in rows] == [COPIED, TRANSPOSED, SHARED, ZEROS, COPIED]
    assert rows[0]["offset"] == rows[1]["offset"] and rows[1]["shape"][:2] == (3, 2)
    blob = made.sections()["BLOB"]
    assert len(blob) == 64 + 512 + 64  # padded to lines of a cache: the matrix, the table, the zero with a sign
    kept = np.frombuffer(blob.tobytes(), count=6, offset=rows[0]["offset"])
    assert np.array_equal(kept.reshape(2, 3).T, run().turned)


def test_a_second_variant_of_equal_arrays_adds_no_row():
    made = images()
    made.add(run(), {})
    rows = len(made.tables["ARRY"])
    made.add(run(), {})
    assert len(made.tables["ARRY"]) == rows and made.tables["SLOT"][:rows] == made.tables["SLOT"][rows:]
