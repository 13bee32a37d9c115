"""Damaged and hostile files of results and bodies: one line and exit code 2, and no memory that they only state."""

import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
from damaged_files import DEEP, FOLDER_HARMS, HARMS, archive_of
from superelements import shaft, write_superelement
from test_open_files import result, run_up
from test_own_body import made as made  # a fixture

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError, StoreError
from cranktrain.coupling.run import Coupled, keep_run
from cranktrain.results.export import export
from cranktrain.results.in_hand.loaded import load_run
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.store import columns
from cranktrain.store.bodies import export_body, import_body
from cranktrain.store.columns import ResultColumns
from cranktrain.store.hdf5 import load_body, save_body, write_result
from cranktrain.store.variant_files import HEAD, VariantFiles
from cranktrain.structure.fem.own_body import read_body
from cranktrain.studies.report.findings import _fatigue


def refused(capsys, *arguments):
    """The error of a call, in one line."""
    assert main(list(map(str, arguments))) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if "warning" not in line]
    assert len(lines) == 1, lines
    return lines[0]


@pytest.mark.parametrize("harm", HARMS)
def test_a_damaged_result_is_refused_by_every_reader(tmp_path, capsys, harm):
    path = result(tmp_path / "run.h5")
    harm(path)
    assert "run.h5" in refused(capsys, "export", path, "--to", tmp_path / "t.csv")
    assert not (tmp_path / "t.csv").exists()
    assert "run.h5" in refused(capsys, "bearing-loads", "diesel_i6", "--result", path)
    with pytest.raises(StoreError, match=r"run\.h5"):
        load_run(path)


@pytest.mark.parametrize("harm", HARMS)
@pytest.mark.parametrize("name", ["speeds", "amplitudes"])
def test_a_damaged_run_up_is_refused_by_every_reader(tmp_path, capsys, harm, name):
    run_up(tmp_path / "up.h5")
    path = tmp_path / "up.h5"
    harm(path, name)
    if (harm.__name__, name) == ("not_a_number", "amplitudes"):  # a speed may lack an amplitude
        assert np.isnan(RunUp.load(path).amplitudes["pulley.torsion"]).any()
        return
    for call in (("export", path, "--to", tmp_path / "t.csv"), ("plot-runup", path, "--plots", tmp_path / "new")):
        assert "up.h5" in refused(capsys, *call)
    assert not (tmp_path / "t.csv").exists()


def with_value(path, name, value, place=-1):
    """A file of which one number is another."""
    with h5py.File(path, "r+") as file:
        values = file[f"data/{name}"][()]
        values.flat[place] = value
        file[f"data/{name}"][...] = values


@pytest.mark.parametrize("place", [0, 7, 49])
@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, -1.0, 0.0])
def test_a_time_that_is_not_finite_or_does_not_rise_is_refused_by_every_reader(tmp_path, capsys, value, place):
    path = result(tmp_path / "run.h5")
    if place == 0 and value in (0.0, -1.0):
        value = 1.0  # the run lasts less
    with_value(path, "time", value, place)
    for table in ("t.csv", "t.npz"):
        assert "run.h5: its time is damaged" in refused(capsys, "export", path, "--to", tmp_path / table)
        assert not (tmp_path / table).exists()
    assert "run.h5" in refused(capsys, "bearing-loads", "diesel_i6", "--result", path)
    with pytest.raises(StoreError, match=r"run\.h5"):
        load_run(path)


def test_times_of_a_long_result_rise_from_block_to_block(tmp_path):
    time = np.arange(2.0 * columns.BLOCK)
    write_result(tmp_path / "run.h5", {"time": (time, "s")}, {})
    assert ResultColumns.of(tmp_path / "run.h5").rows == time.size
    time[columns.BLOCK :] -= 1.0
    write_result(tmp_path / "run.h5", {"time": (time, "s")}, {})
    with pytest.raises(StoreError, match="its time is damaged"):
        ResultColumns.of(tmp_path / "run.h5")


def test_a_time_of_coupled_units_rises(tmp_path):
    times, values = np.array([0.0, 1.0, 2.0, 2.0]), np.arange(4.0)[:, None]
    keep_run(
        tmp_path / "run.h5", Coupled(("six.crank.angle",), ("rad",), times, values, {}, 3, 0, 3, 0.1), {"scheme": "x"}
    )
    with pytest.raises(StoreError, match="its time is damaged"):
        load_run(tmp_path / "run.h5")


@pytest.mark.parametrize(
    ("name", "value"),
    [("cycles", -3), ("repeats", -1), ("left", -1e-5), ("orders", 0.5), ("extremes", np.inf), ("extremes", -1e300)],
)
def test_numbers_that_no_run_up_has_are_refused_by_every_reader(tmp_path, capsys, name, value):
    """A negative count of cycles would be drawn as one."""
    run_up(tmp_path / "up.h5")
    with_value(tmp_path / "up.h5", name, value)
    for call in (("export", "up.h5", "--to", "t.csv"), ("plot-runup", "up.h5", "--plots", "new")):
        call = [tmp_path / one if "." in one or one == "new" else one for one in call]
        assert "up.h5: holds numbers that no run-up has" in refused(capsys, *call)
    with pytest.raises(StoreError, match="holds numbers that no run-up has"):
        load_run(tmp_path / "up.h5")


def test_a_journal_with_numbers_that_no_run_up_has_is_refused(tmp_path):
    made = run_up(tmp_path / "up.h5")
    replace(made, speeds=made.speeds + 50.0, cycles=-made.cycles).add_to_journal(tmp_path / "up.h5")
    with pytest.raises(StoreError, match="holds numbers that no run-up has"):
        RunUp.load(tmp_path / "up.h5")


@pytest.mark.parametrize(("name", "value"), [("speeds", 1e300), ("amplitudes", 1e308), ("amplitudes", np.inf)])
def test_a_run_up_of_numbers_beyond_measure_is_refused(tmp_path, capsys, name, value):
    """They would overflow where they are drawn."""
    run_up(tmp_path / "up.h5")
    with_value(tmp_path / "up.h5", name, value)
    assert "up.h5" in refused(capsys, "plot-runup", tmp_path / "up.h5", "--plots", tmp_path / "new")


def test_names_that_are_nested_too_deeply_are_refused(tmp_path, capsys):
    run_up(tmp_path / "up.h5")
    with h5py.File(tmp_path / "up.h5", "r+") as file:
        file.attrs["run.extremes_outputs"] = DEEP[:60_000]
    assert "names of its outputs are damaged" in refused(capsys, "export", tmp_path / "up.h5", "--to", "t.csv")


@pytest.mark.parametrize("harm", FOLDER_HARMS)
def test_a_damaged_folder_of_a_body_is_refused(tmp_path, made, harm):
    harm(export_body(tmp_path / "body", made))
    with pytest.raises(StoreError):
        import_body(tmp_path / "body")


def test_an_archive_that_states_terabytes_is_refused(tmp_path, made):
    for k, stated in enumerate(("(10995116277760,)", "(-1,)", "(2, 3, 99999999999)")):
        path = export_body(tmp_path / f"{k}.npz", made)
        archive_of(path, stated)
        with pytest.raises(StoreError, match="damaged"):
            import_body(path)


def test_a_body_of_negative_mass_is_refused_in_every_format(tmp_path, made):
    path = save_body(tmp_path / "b.h5", made)
    with h5py.File(path, "r+") as file:
        file.attrs["mass"] = -1.0
    with pytest.raises(StoreError, match="its mass is -1 kg, needs one above zero"):
        load_body(path)


@pytest.mark.parametrize("head", [DEEP, "{", "[]", '{"format": 1}', '"x"'])
def test_a_damaged_head_of_variants_is_refused(tmp_path, head):
    (tmp_path / HEAD).write_text(head)
    with pytest.raises(StoreError, match="is no folder of variants"):
        VariantFiles.open(tmp_path)


def test_coupled_units_are_columns_and_their_table_replaces_itself(tmp_path):
    """Each unit has a group in the file; nothing of them is left out."""
    times, values = np.arange(5.0), np.arange(10.0).reshape(5, 2)
    names = ("mass.place", "spring.force")
    keep_run(tmp_path / "run.h5", Coupled(names, ("m", "N"), times, values, {}, 4, 0, 4, 0.1), {"scheme": "jacobi"})
    for _ in range(2):
        found = export(tmp_path / "run.h5", tmp_path / "t.csv")
    assert (found["columns"], found["left_out"]) == (3, [])
    head, *rows = (tmp_path / "t.csv").read_text().splitlines()
    assert head == "time [s],mass/place [m],spring/force [N]" and rows[1] == "1.0,2.0,3.0"


def test_a_deep_json_of_fatigue_is_no_result_of_it(tmp_path):
    for text in (DEEP, "[]", json.dumps({"fillets": 3})):
        (tmp_path / "f.json").write_text(text)
        with pytest.raises(InputError, match="is no result of 'cranktrain fatigue"):
            _fatigue(tmp_path / "f.json")


def test_a_superelement_that_states_terabytes_is_refused(tmp_path):
    write_superelement(tmp_path, shaft(2), {"a": 1, "b": 3})
    text = (tmp_path / "super.toml").read_text("utf-8")
    own = 'stiffness = "stiffness.mtx"\nmass = "mass.mtx"'
    (tmp_path / "super.toml").write_text(text.replace('matrices = "super.mtx"', own), "utf-8")
    for name in ("stiffness.mtx", "mass.mtx"):
        (tmp_path / name).write_text("%%MatrixMarket matrix array real general\n1000000000 1000000\n1.0\n")
    with pytest.raises(InputError, match="at most"):
        read_body(tmp_path / "super.toml")
