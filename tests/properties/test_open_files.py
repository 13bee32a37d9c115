"""Result and run-up files in other programs' hands: xarray and pandas, CSV, Parquet and NumPy's archive."""

import json
import sys

import h5py
import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.results.export import BLOCK, export
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.store.hdf5 import read_result, write_result
from cranktrain.store.result_stream import result_stream

UNITS = {"time": "s", "angle": "rad", "pulley.torsion": "rad", "bearing[1].force.x": "N"}
TABLES = ("table.csv", "table.parquet", "table.npz")
ABOUT = {"engine": "diesel_i6", "speed": 209.4}


def samples(rows=50):
    values = np.random.default_rng(7).standard_normal((rows, len(UNITS)))
    values[:, 0] = 1e-3 * np.arange(rows)
    return values


def result(path, rows=50):
    values = samples(rows)
    datasets = {name: (values[:, k], unit) for k, (name, unit) in enumerate(UNITS.items())}
    write_result(path, {**datasets, "film_temperature_c": (np.full(7, 90.0), "degC")}, ABOUT)
    return path


def streamed(path):
    """A stream that begins anew."""
    with result_stream(path) as stream:
        for rows in (20, 50):
            stream.begin(UNITS, rows)
            stream.append(samples(rows))
        stream.finish(ABOUT, {"film_temperature_c": (np.full(7, 90.0), "degC")})
    return path


def run_up(path):
    generator = np.random.default_rng(1)
    shape = (3, 24)
    torsion = generator.standard_normal(shape) + 1j * generator.standard_normal(shape)
    made = RunUp(
        np.array([100.0, 110.0, 120.0]), 0.5 * np.arange(1, 25), {"pulley.torsion": torsion},
        {"bearing[1].force.x": generator.standard_normal((3, 3))}, np.array([4, 3, 3]), np.ones(3, dtype=int),
        np.full(3, 1e-5), attributes=ABOUT,
    )  # fmt: skip
    made.save(path)
    return made


@pytest.mark.parametrize("write", [result, streamed])
def test_xarray_opens_a_result_with_axes_and_units(tmp_path, write):
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset(write(tmp_path / "run.h5"), group="data", engine="h5netcdf") as data:
        assert data.sizes == {"time": 50, "main_bearing": 7}
        assert set(data.coords) == {"time", "angle", "main_bearing"}
        assert data["film_temperature_c"].dims == ("main_bearing",)
        for k, (name, unit) in enumerate(UNITS.items()):
            assert data[name].dims == ("time",) and data[name].attrs["units"] == unit
            assert np.array_equal(data[name], samples()[:, k])
        assert data.attrs == ABOUT
        frame = data.drop_dims("main_bearing").to_dataframe()
        assert frame.index.name == "time" and set(frame.columns) == set(UNITS) - {"time"} and len(frame) == 50


def test_xarray_opens_a_run_up_by_speed_and_order(tmp_path):
    xarray = pytest.importorskip("xarray")
    made = run_up(tmp_path / "up.h5")
    with xarray.open_dataset(tmp_path / "up.h5", group="data", engine="h5netcdf") as data:
        torsion = data["amplitudes"].sel(amplitude_output="pulley.torsion")
        assert torsion["amplitude_unit"] == "rad" and data["speeds"].attrs["units"] == "rad/s"
        assert np.array_equal(torsion.sel(orders=6.0), made.order(6.0))
        force = data["extremes"].sel(extreme_output="bearing[1].force.x", extreme="largest")
        assert np.array_equal(force, made.extremes["bearing[1].force.x"][:, 2])
        assert data["cycles"].dims == ("speeds",)


def test_files_without_axes_stay_readable(tmp_path):
    """What was written before there were axes: arrays with ``unit`` alone."""
    with h5py.File(tmp_path / "old.h5", "w") as file:
        file.attrs.update({"format": "cranktrain result", "schema": 1, "run.engine": "diesel_i6"})
        for k, (name, unit) in enumerate(UNITS.items()):
            file.create_dataset(f"data/{name}", data=samples()[:, k]).attrs["unit"] = unit
    assert np.array_equal(read_result(tmp_path / "old.h5")[0]["pulley.torsion"][0], samples()[:, 2])
    datasets, attributes = read_result(result(tmp_path / "run.h5"))
    assert list(datasets) == sorted([*UNITS, "film_temperature_c"]) and attributes == ABOUT
    assert export(tmp_path / "old.h5", tmp_path / "old.csv")["rows"] == 50


def read_table(path):
    """Columns by heading, of NumPy's archive by name."""
    if path.suffix == ".npz":
        with np.load(path) as archive:
            return {name: archive[name] for name in archive.files if name != "cranktrain table"}
    if path.suffix == ".parquet":
        parquet = pytest.importorskip("pyarrow.parquet")
        table = parquet.read_table(path)
        return {name: table[name].to_numpy() for name in table.column_names}
    head, *rows = path.read_text().splitlines()
    return dict(zip(head.split(","), np.array([[float(x) for x in row.split(",")] for row in rows]).T, strict=True))


@pytest.mark.parametrize("name", TABLES)
def test_a_table_holds_every_sample_to_the_bit(tmp_path, name):
    """More rows than are written at once, and not a multiple of them."""
    rows = 2 * BLOCK + 3
    found = export(result(tmp_path / "run.h5", rows), tmp_path / name)
    assert found == {"table": str(tmp_path / name), "rows": rows, "columns": 4, "left_out": ["film_temperature_c"]}
    columns = read_table(tmp_path / name)
    wanted = list(UNITS) if name.endswith("npz") else [f"{key} [{unit}]" for key, unit in UNITS.items()]
    assert set(columns) == set(wanted)
    assert np.array_equal(np.stack([columns[key] for key in wanted], axis=1), samples(rows))


@pytest.mark.parametrize("name", TABLES)
def test_a_run_up_becomes_a_row_a_speed(tmp_path, name):
    made = run_up(tmp_path / "up.h5")
    export(tmp_path / "up.h5", tmp_path / name)
    columns = {key.partition(" [")[0] if "order" in key else key: v for key, v in read_table(tmp_path / name).items()}
    back = columns["pulley.torsion order 6 amplitude"] * np.exp(1j * columns["pulley.torsion order 6 phase"])
    assert np.allclose(back, made.order(6.0), rtol=1e-14, atol=0.0)


@pytest.mark.parametrize("name", TABLES)
def test_a_table_replaces_tables_of_ours_alone(tmp_path, name):
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    source, target = result(tmp_path / "run.h5"), tmp_path / name
    export(source, target)
    once = target.read_bytes()
    export(source, target)
    assert target.read_bytes() == once
    run_up(tmp_path / "up.h5")
    export(tmp_path / "up.h5", target)
    for foreign in (b"time,speed\n1,2\n", b"PAR1" + 40 * b"x" + b"PAR1", b"x"):
        target.write_bytes(foreign)
        with pytest.raises(InputError, match="exists and is no table of cranktrain"):
            export(source, target)
        assert target.read_bytes() == foreign


def test_a_scene_of_several_speeds_is_asked_for_one(tmp_path):
    times, names = samples()[:, 0], [(rpm, *row) for rpm in (1000, 2000) for row in UNITS.items()]
    datasets = {f"{rpm}rpm/{name}": (times * rpm, unit) for rpm, name, unit in names}
    write_result(tmp_path / "scene.h5", {**datasets, "levels/rigid/pulley.torsion": (np.zeros(3), "rad")})
    with pytest.raises(InputError, match="groups: 1000rpm, 2000rpm; name one with --group"):
        export(tmp_path / "scene.h5", tmp_path / "table.csv")
    with pytest.raises(InputError, match="did you mean '2000rpm'"):
        export(tmp_path / "scene.h5", tmp_path / "table.csv", "2000")
    export(tmp_path / "scene.h5", tmp_path / "table.npz", "2000rpm")
    assert np.array_equal(read_table(tmp_path / "table.npz")["time"], 2000.0 * samples()[:, 0])


def test_the_command_says_what_it_wrote_and_what_it_left_out(tmp_path, capsys):
    path = tmp_path / "table.csv"
    assert main(["export", str(result(tmp_path / "run.h5")), "--to", str(path), "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["columns"] == 4 and "film_temperature_c" in told.err


@pytest.mark.parametrize(
    ("damage", "to", "says"),
    [
        (lambda whole: whole[: len(whole) // 2], "table.csv", "damaged"),
        (lambda whole: b"", "table.npz", "damaged"),
        (lambda whole: whole, "table.xlsx", r"tables end with .csv, .parquet, .npz; name it table.csv"),
    ],
)
def test_what_cannot_be_exported_ends_in_one_line_and_no_file(tmp_path, capsys, damage, to, says):
    source = result(tmp_path / "run.h5")
    source.write_bytes(damage(source.read_bytes()))
    assert main(["export", str(source), "--to", str(tmp_path / to)]) == 2
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1 and says in error
    assert [file.name for file in tmp_path.iterdir()] == ["run.h5"]


def test_a_missing_library_is_named_with_what_installs_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"Parquet needs pyarrow; pip install pyarrow"):
        export(result(tmp_path / "run.h5"), tmp_path / "table.parquet")
    assert not (tmp_path / "table.parquet").exists()
