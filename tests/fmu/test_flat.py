"""The flat binary: what is written is read, and nothing else is."""

import dataclasses

import numpy as np
import pytest

from cranktrain.core.errors import StoreError
from cranktrain.engine.levels import CRANKS
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.fmu import flat


def bore(seed, size):
    """Elastic bore of that many shapes, any numbers."""
    values = np.random.default_rng(seed).random
    return BoreCompliance(values((size, 5, 3)), values(size), values((size, 4)), values(size), 0.1 * size)


def test_round_trip_is_exact(whole, tmp_path):
    own = {"balancer[1]": dataclasses.replace(whole.block, name="balancer[1]")}
    model = whole._replace(bore=bore(1, 4), block_bore=bore(2, 3), added=own)
    path = tmp_path / "model.bin"
    path.write_bytes(flat.to_bytes(model))
    read = flat.read_model(path)
    assert read.engine == model.engine
    assert read.table is None and read.big_end_table is None
    assert list(read.cranks) == list(read.damped) == list(CRANKS)
    parts = (
        [*m.cranks.values(), *m.damped.values(), *m.added.values(), m.block, m.bore, m.block_bore]
        for m in (read, model)
    )
    for one, other in zip(*parts, strict=True):
        for field in dataclasses.fields(other):
            if field.name not in ("records", "basis", "quality"):  # for reports: they stay behind
                assert np.array_equal(getattr(one, field.name), getattr(other, field.name)), field.name
    assert flat.to_bytes(read) == path.read_bytes()


def test_arrays_start_where_a_processor_reads_them_at_once(engine, body):
    """At multiples of 8 bytes, whatever the length of the text before them."""
    for more in range(8):
        titled = dataclasses.replace(engine, title=engine.title + more * "x")
        data = flat.to_bytes(flat.FlatModel(titled, {"solid": body}))
        arrays = np.frombuffer(data, np.uint8, offset=flat._PREFIX.size)
        length = flat._PREFIX.unpack_from(data)[3]
        assert (flat._PREFIX.size + length) % 8 == 0 and bytes(arrays[length - 1 : length]) in (b"}", b" ")
        assert flat.from_bytes(data).engine.title == titled.title


def test_what_a_model_lacks_stays_absent(engine, body):
    model = flat.from_bytes(flat.to_bytes(flat.FlatModel(engine, {"solid": body})))
    assert list(model.cranks) == ["solid"] and model.damped == model.added == {} and model[3:8] == (None,) * 5


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: data[:-8], "truncated"),
        (lambda data: data[:-1] + bytes([data[-1] ^ 1]), "changed"),
        (lambda data: data[:8] + bytes([flat.SCHEMA + 1]) + data[9:], f"schema {flat.SCHEMA + 1}"),
        (lambda data: b"\x89HDF\r\n\x1a\n" + data[8:], "not a flat model"),
        (lambda data: b"", "not a flat model"),
    ],
)
def test_what_is_not_whole_is_refused(engine, body, tmp_path, change, words):
    path = tmp_path / "model.bin"
    path.write_bytes(change(flat.to_bytes(flat.FlatModel(engine, {"solid": body}))))
    with pytest.raises(StoreError, match=words):
        flat.read_model(path)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(StoreError, match=r"absent\.bin"):
        flat.read_model(tmp_path / "absent.bin")
