"""Files of reduced bodies and results: whole, equal, refused when not theirs; damage is noticed before HDF5 sees it."""

import random
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from superelements import shaft

from cranktrain.core.errors import StoreError
from cranktrain.engine.file import load_engine
from cranktrain.store.hdf5 import (
    BLOCK,
    RESULT,
    check_seal,
    load_body,
    load_extras,
    read_result,
    save_body,
    seal,
    write_result,
)
from cranktrain.structure.crank.reduction import input_digest, reduced_crankshaft, running_loads, stored_path


@pytest.fixture
def body():
    """A shaft in two elastic modes."""
    made = shaft(4).reduced("test", "abc", {"a": 0, "b": 4}, 8)
    return replace(made, quality={"max_relative_error": 1e-3}, records={"full_hz": np.arange(4.0)})


def test_a_body_comes_back_as_it_was(tmp_path, body):
    path = save_body(tmp_path / "x" / "body.h5", body, {"surface": (np.arange(3), "m")})
    again = load_body(path, "abc")
    for name in ("omega", "shapes", "stress_stiffness", "translation"):
        np.testing.assert_array_equal(getattr(again, name), getattr(body, name))
    assert (again.interfaces, again.mass, again.quality) == (body.interfaces, body.mass, body.quality)
    np.testing.assert_array_equal(again.records["full_hz"], body.records["full_hz"])
    np.testing.assert_array_equal(load_extras(path)["surface"], np.arange(3))
    assert [p.name for p in path.parent.iterdir()] == ["body.h5"]


def test_equal_bodies_give_equal_bytes_with_units(tmp_path, body):
    one, other = (save_body(tmp_path / name, body) for name in ("1.h5", "2.h5"))
    assert one.read_bytes() == other.read_bytes()
    with h5py.File(one) as file:
        assert [file[f"body/{name}"].attrs["unit"] for name in ("omega", "inertia")] == ["rad/s", "kg m^2"]


def one_bit(path):
    """One bit of the shapes: a value of the same size, which no check of the body could tell."""
    data = bytearray(path.read_bytes())
    with h5py.File(path) as file:
        chunk = file["body/shapes"].id.get_chunk_info(0)
    data[chunk.byte_offset + 8] ^= 1
    path.write_bytes(data)


def edited(change, mode="a"):
    """What changes an HDF5 file in its place."""

    def harm(path):
        with h5py.File(path, mode) as file:
            change(file)

    return harm


@pytest.mark.parametrize(
    ("harm", "says"),
    [
        (Path.unlink, "no such file"),
        (one_bit, "damaged"),
        (edited(lambda file: file["body/omega"].write_direct(np.array([np.nan]), None, -1)), "b.h5.*not finite"),
        (lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]), "damaged"),
        (lambda path: path.write_text("not HDF5"), "not an HDF5 file"),
        (edited(lambda file: file.create_group("something"), "w"), "not a cranktrain reduced body"),
        (edited(lambda file: file.attrs.modify("schema", 99)), "schema 99"),
        (edited(lambda file: file.pop("body/shapes")), "damaged or incomplete"),
    ],
)
def test_files_that_cannot_be_used_are_refused_in_one_line(tmp_path, body, harm, says):
    path = save_body(tmp_path / "b.h5", body)
    harm(path)
    with pytest.raises(StoreError, match=says) as caught:
        load_body(path)
    assert "\n" not in str(caught.value) and "cranktrain reduce" in str(caught.value)


def test_results_come_back_with_units_and_attributes(tmp_path):
    given = {"engine": "diesel_i6", "speed": 209.4}
    path = write_result(tmp_path / "r.h5", {"pulley/torsion": (np.arange(4.0), "rad")}, given)
    datasets, attributes = read_result(path)
    values, unit = datasets["pulley/torsion"]
    assert unit == "rad" and values.tolist() == [0, 1, 2, 3] and attributes == given
    with pytest.raises(StoreError, match="not a cranktrain reduced body"):
        load_body(path)


def test_the_cache_follows_the_structural_inputs(tmp_path, monkeypatch, body):
    monkeypatch.setenv("CRANKTRAIN_CACHE", str(tmp_path))
    engine = load_engine("diesel_i6")
    path = stored_path(engine)
    assert path.parent == tmp_path
    save_body(path, replace(body, digest=input_digest(engine)))
    assert reduced_crankshaft(engine).name == "test"  # read, not computed
    heavier = replace(engine, flywheel=replace(engine.flywheel, mass=50.0))
    assert stored_path(heavier) == path  # attached afterwards
    thicker = replace(engine, crankshaft=replace(engine.crankshaft, web_thickness=0.025))
    assert stored_path(thicker) != path
    save_body(path, body)
    with pytest.raises(StoreError, match="other inputs"):
        reduced_crankshaft(engine)


def test_running_loads_are_where_forces_act():
    loads = running_loads(load_engine("diesel_i6"))
    assert len(loads) == 2 * 7 + 2 * 6 + 1 and ("thrust", 2) in loads


@pytest.fixture
def path(tmp_path):
    return write_result(tmp_path / "run.h5", {"time": (np.linspace(0.0, 1.0, 50), "s")}, {"engine": "diesel_i6"})


def test_any_damage_is_refused(path):
    """Of an unsealed file one in three such changes goes unnoticed, and one in a hundred crashes or hangs HDF5."""
    whole = path.read_bytes()
    for case in range(200):
        rng, content = random.Random(case), bytearray(whole)
        for _ in range(rng.randrange(1, 9)):
            content[rng.randrange(len(whole) - 40)] ^= rng.randrange(1, 256)
        path.write_bytes(content)
        with pytest.raises(StoreError, match=r"damaged.*run 'cranktrain simulate' again"):
            read_result(path)
        with pytest.raises(OSError, match="checksum"):
            RESULT.includes(path)


def test_a_file_that_was_changed_on_purpose_is_read(path):
    for number in range(3):
        with h5py.File(path, "r+") as file:
            file.attrs[f"note {number}"] = 1000 * "measured in the test bed "
            file[f"more {number}"] = np.arange(20.0)
        check_seal(path)
        datasets, attributes = read_result(path)
        assert datasets["time"][0].size == 50 and attributes["engine"] == "diesel_i6"


def test_a_file_that_lost_its_seal_is_read(path):
    whole = path.read_bytes()
    for cut in (1, 20, 30):
        path.write_bytes(whole[:-cut])
        assert read_result(path)[0]["time"][0].size == 50


@pytest.mark.parametrize("size", [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK])
def test_files_of_any_length(tmp_path, size):
    path = tmp_path / "any"
    path.write_bytes(bytes(size))
    seal(path)
    check_seal(path)
    assert path.read_bytes().startswith(bytes(size)) and path.stat().st_size > size
    if size:
        content = bytearray(path.read_bytes())
        content[size - 1] ^= 1
        path.write_bytes(content)
        with pytest.raises(OSError, match="checksum"):
            check_seal(path)
