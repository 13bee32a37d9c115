"""The flat binary: what is written is read, and nothing else is."""

import dataclasses

import numpy as np
import pytest

from cranktrain import flat
from cranktrain.errors import StoreError


def test_round_trip_is_exact(engine, body, tmp_path):
    path = flat.write_model(tmp_path / "model.bin", flat.FlatModel(engine, body))
    read_engine, read_body, *rest = flat.read_model(path)
    assert rest == [None, None, None]
    assert read_engine == engine
    for field in dataclasses.fields(body):
        if field.name in ("records", "basis"):
            continue  # for reports: they stay behind
        written, read = getattr(body, field.name), getattr(read_body, field.name)
        assert np.array_equal(written, read) if isinstance(written, np.ndarray) else written == read, field.name
    assert flat.to_bytes(flat.FlatModel(read_engine, read_body)) == path.read_bytes()
    assert [p.name for p in tmp_path.iterdir()] == ["model.bin"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: data[:-8], "truncated"),
        (lambda data: data[:-1] + bytes([data[-1] ^ 1]), "changed"),
        (lambda data: data[:8] + b"\x09" + data[9:], "schema 9"),
        (lambda data: b"\x89HDF\r\n\x1a\n" + data[8:], "not a flat model"),
        (lambda data: b"", "not a flat model"),
    ],
)
def test_what_is_not_whole_is_refused(engine, body, tmp_path, change, words):
    path = tmp_path / "model.bin"
    path.write_bytes(change(flat.to_bytes(flat.FlatModel(engine, body))))
    with pytest.raises(StoreError, match=words):
        flat.read_model(path)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(StoreError, match=r"absent\.bin"):
        flat.read_model(tmp_path / "absent.bin")
