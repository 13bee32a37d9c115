"""Files of reduced bodies and results: whole, equal, refused when not theirs."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from superelements import shaft

from cranktrain.core.errors import StoreError
from cranktrain.engine.file import load_engine
from cranktrain.store.hdf5 import load_body, load_extras, read_result, save_body, write_result
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


def test_units_are_in_the_file(tmp_path, body):
    with h5py.File(save_body(tmp_path / "b.h5", body)) as file:
        assert file["body/omega"].attrs["unit"] == "rad/s"
        assert file["body/inertia"].attrs["unit"] == "kg m^2"


def test_equal_bodies_give_equal_bytes(tmp_path, body):
    assert save_body(tmp_path / "1.h5", body).read_bytes() == save_body(tmp_path / "2.h5", body).read_bytes()


def _truncated(path: Path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _text(path: Path):
    path.write_text("not HDF5")


def _foreign(path: Path):
    with h5py.File(path, "w") as file:
        file["something"] = 1


def _other_schema(path: Path):
    with h5py.File(path, "a") as file:
        file.attrs["schema"] = 99


def _without_shapes(path: Path):
    with h5py.File(path, "a") as file:
        del file["body/shapes"]


def _one_bit(path: Path):
    """One bit of the shapes: a value of the same size, which no check of the body could tell."""
    data = bytearray(path.read_bytes())
    with h5py.File(path) as file:
        chunk = file["body/shapes"].id.get_chunk_info(0)
    data[chunk.byte_offset + 8] ^= 1
    path.write_bytes(data)


def _not_finite(path: Path):
    with h5py.File(path, "a") as file:
        file["body/omega"][-1] = np.nan


@pytest.mark.parametrize(
    ("harm", "says"),
    [
        (Path.unlink, "no such file"),
        (_one_bit, "damaged"),
        (_not_finite, "b.h5.*not finite"),
        (_truncated, "damaged"),
        (_text, "not an HDF5 file"),
        (_foreign, "not a cranktrain reduced body"),
        (_other_schema, "schema 99"),
        (_without_shapes, "damaged or incomplete"),
    ],
)
def test_files_that_cannot_be_used_are_refused_in_one_line(tmp_path, body, harm, says):
    path = save_body(tmp_path / "b.h5", body)
    harm(path)
    with pytest.raises(StoreError, match=says) as caught:
        load_body(path)
    assert "\n" not in str(caught.value) and "cranktrain reduce" in str(caught.value)


def test_a_body_from_other_inputs_is_refused(tmp_path, body):
    path = save_body(tmp_path / "b.h5", body)
    with pytest.raises(StoreError, match="other inputs"):
        load_body(path, "def")


def test_a_failed_write_leaves_the_old_file(tmp_path, body):
    path = save_body(tmp_path / "b.h5", body)
    before = path.read_bytes()
    with pytest.raises(TypeError):
        save_body(path, body, {"bad": (np.array([object()]), "m")})
    assert path.read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 1


def test_results_come_back_with_units_and_attributes(tmp_path):
    path = write_result(
        tmp_path / "r.h5", {"pulley/torsion": (np.arange(4.0), "rad")}, {"engine": "diesel_i6", "speed": 209.4}
    )
    datasets, attributes = read_result(path)
    values, unit = datasets["pulley/torsion"]
    assert unit == "rad" and values.tolist() == [0, 1, 2, 3]
    assert attributes == {"engine": "diesel_i6", "speed": 209.4}
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
    assert len(loads) == 2 * 7 + 2 * 6 + 1
    assert ("thrust", 2) in loads
