"""Damaged and hostile files of results and bodies: one line and exit code 2, and no memory that they only state."""

import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
from damaged_files import DEEP, FOLDER_HARMS, HARMS, archive_of
from one_line import one_line
from superelements import shaft, write_superelement
from test_open_files import result, run_up
from test_own_body import made as made  # a fixture

from cranktrain.cli.main import main
from cranktrain.core.errors import StoreError
from cranktrain.engine.file import load_engine
from cranktrain.results.export import export
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.results.views.loaded import load_run
from cranktrain.store import columns
from cranktrain.store.bodies import export_body, import_body
from cranktrain.store.columns import ResultColumns
from cranktrain.store.hdf5 import load_body, save_body, write_result
from cranktrain.store.variant_files import HEAD, VariantFiles
from cranktrain.structure.crank.beam import beam_body
from cranktrain.structure.fem.own_body import read_body
from cranktrain.studies.report.findings import _fatigue
from cranktrain_lab.coupling.run import Coupled, keep_run
from cranktrain_lab.identification.data import _shape
from cranktrain_lab.identification.tables import ModeTable


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
    for call in (("export", path, "--to", tmp_path / "t.csv"), ("plot", path, "--plots", tmp_path / "new")):
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
    with one_line("its time is damaged", kind=StoreError):
        ResultColumns.of(tmp_path / "run.h5")
    times, values = np.array([0.0, 1.0, 2.0, 2.0]), np.arange(4.0)[:, None]
    coupled = Coupled(("six.crank.angle",), ("rad",), times, values, {}, 3, 0, 3, 0.1)
    keep_run(tmp_path / "coupled.h5", coupled, {"scheme": "x"})
    with one_line("its time is damaged", kind=StoreError):
        load_run(tmp_path / "coupled.h5")


@pytest.mark.parametrize(("name", "value"), [
    ("cycles", -3), ("repeats", -1), ("left", -1e-5), ("orders", 0.5), ("extremes", np.inf), ("extremes", -1e300),
    ("speeds", -1.0), ("speeds", 1e300), ("amplitudes", 1e308), ("amplitudes", np.inf),
])  # fmt: skip
def test_numbers_that_no_run_up_has_are_refused_by_every_reader(tmp_path, capsys, name, value):
    """Of a journal as of the file; numbers beyond measure would overflow where they are drawn."""
    path = tmp_path / "up.h5"
    made = run_up(path)
    with_value(path, name, value, 0 if (name, value) == ("speeds", -1.0) else -1)
    for call in (("export", path, "--to", tmp_path / "t.csv"), ("plot", path, "--plots", tmp_path / "new")):
        assert "up.h5: holds numbers that no run-up has" in refused(capsys, *call)
    with one_line("holds numbers that no run-up has", kind=StoreError):
        load_run(path)
    made.save(path)
    replace(made, speeds=made.speeds + 50.0, cycles=-made.cycles).add_to_journal(path)
    with one_line("holds numbers that no run-up has", kind=StoreError):
        RunUp.load(path)


def test_speeds_of_a_run_up_that_are_whole_numbers_are_not_calculated_with_as_such(tmp_path):
    """Their squares would be beyond what a byte holds."""
    run_up(tmp_path / "up.h5")
    with h5py.File(tmp_path / "up.h5", "r+") as file:
        del file["data/speeds"]
        file["data/speeds"] = np.array([100, 110, 120], dtype=np.uint8)
        file["data/speeds"].attrs["unit"] = "rad/s"
    assert RunUp.load(tmp_path / "up.h5").speeds.dtype == np.float64


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


def test_bodies_that_state_terabytes_or_what_none_has_are_refused(tmp_path, made):
    for k, stated in enumerate(("(10995116277760,)", "(-1,)", "(2, 3, 99999999999)")):
        path = export_body(tmp_path / f"{k}.npz", made)
        archive_of(path, stated)
        with one_line("damaged", kind=StoreError):
            import_body(path)
    path = save_body(tmp_path / "b.h5", made)
    with h5py.File(path, "r+") as file:
        file.attrs["mass"] = -1.0
    with one_line("its mass is -1 kg, needs one above zero", kind=StoreError):
        load_body(path)
    with one_line("rigid modes do not belong", kind=StoreError):
        import_body(export_body(tmp_path / "b.npz", replace(made, mass=1e30)))


def antisymmetric(matrix):
    return matrix + np.tril(np.ones_like(matrix))


HARMED = (
    ("gyroscopic", lambda a: a + np.eye(len(a)), "'gyroscopic' is not antisymmetric"),
    ("centrifugal", antisymmetric, "'centrifugal' is not symmetric"),
    ("stress_stiffness", antisymmetric, "'stress_stiffness' is not symmetric"),
    ("inertia", lambda a: 2.0 * a, "rigid modes do not belong"),
    ("centre", lambda a: a + 0.1, "rigid modes do not belong"),
    ("positions", lambda a: a[::-1], "rigid modes do not belong"),
    ("translation", lambda a: -a, "rigid modes do not belong"),
    ("shapes", lambda a: 0.0 * a, "rigid modes do not belong"),
    ("euler_load", lambda a: 1e300 * np.ones_like(a), "'euler_load' holds values beyond"),
    ("centrifugal_load", lambda a: a * np.nan, "'centrifugal_load' holds values that are not finite"),
    ("centrifugal_load", lambda a: a.astype(complex), "damaged"),
    ("gyroscopic", lambda a: a.astype("S5"), "damaged"),
)


@pytest.mark.parametrize(("name", "harm", "said"), HARMED)
@pytest.mark.parametrize("form", ["b.h5", "b.npz"])
def test_terms_that_do_not_belong_to_one_body_are_refused(tmp_path, made, form, name, harm, said):
    """Six rigid modes of a body know its mass, centre and inertia, and how its interfaces move with it."""
    path = export_body(tmp_path / form, made)
    if form == "b.h5":
        with h5py.File(path, "r+") as file:
            array, unit = file[f"body/{name}"][()], file[f"body/{name}"].attrs["unit"]
            del file[f"body/{name}"]
            file[f"body/{name}"] = harm(array)
            file[f"body/{name}"].attrs["unit"] = unit
    else:
        with np.load(path) as data:
            arrays = dict(data)
        np.savez(path, **{**arrays, name: harm(arrays[name])})
    with one_line(said, kind=StoreError):
        import_body(path)


SECTIONS = ("section_interface", "section_mass", "section_polar", "section_diametral")


@pytest.mark.parametrize("records", [
    {}, {"section_interface": np.full(9, 999.0)}, {"section_interface": np.full(9, np.nan)},
    {"section_mass": np.ones(2)}, {"section_mass": -np.ones(9)}, {"section_polar": np.ones((3, 3))},
])  # fmt: skip
def test_sections_that_no_crank_has_are_refused_by_modal(tmp_path, capsys, records):
    """Records of a body tell mass and inertia along its axis; what is left out of them is named."""
    beams = beam_body(load_engine("diesel_i6"))
    path = export_body(tmp_path / "crank.npz", replace(beams, records={**beams.records, **records} if records else {}))
    assert all(name in refused(capsys, "modal", "diesel_i6", "--body", path, "--json") for name in SECTIONS)


def test_a_body_that_does_not_say_how_it_was_reduced_is_told_by_what_it_has(tmp_path, capsys):
    path = export_body(tmp_path / "crank.h5", replace(beam_body(load_engine("diesel_i6")), quality={}))
    assert main(["reduce", "diesel_i6", "--body", str(path)]) == 0
    assert "59.0 kg, 150 modes" in capsys.readouterr().out


def test_deep_or_strange_texts_are_no_files_of_ours(tmp_path):
    for head in (DEEP, "{", "[]", '{"format": 1}', '"x"'):
        (tmp_path / HEAD).write_text(head)
        with one_line("is no folder of variants", kind=StoreError):
            VariantFiles.open(tmp_path)
    for text in (DEEP, "[]", json.dumps({"fillets": 3})):
        (tmp_path / "f.json").write_text(text)
        with one_line("is no result of 'cranktrain fatigue"):
            _fatigue(tmp_path / "f.json")


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


def test_a_superelement_that_states_terabytes_is_refused(tmp_path):
    write_superelement(tmp_path, shaft(2), {"a": 1, "b": 3})
    text = (tmp_path / "super.toml").read_text("utf-8")
    own = 'stiffness = "stiffness.mtx"\nmass = "mass.mtx"'
    (tmp_path / "super.toml").write_text(text.replace('matrices = "super.mtx"', own), "utf-8")
    for name in ("stiffness.mtx", "mass.mtx"):
        (tmp_path / name).write_text("%%MatrixMarket matrix array real general\n1000000000 1000000\n1.0\n")
    with one_line("at most"):
        read_body(tmp_path / "super.toml")


@pytest.mark.parametrize("harm", HARMS)
def test_a_damaged_file_of_measured_signals_is_read_as_far_as_it_is_sound(tmp_path, capsys, harm):
    """What is no signal is left out; a shape of terabytes is refused before it is read."""
    path = result(tmp_path / "run.h5")
    harm(path, "pulley.torsion")
    code = main(["measured", str(path), "--json"])
    out, err = capsys.readouterr()
    assert (code, "Traceback" in err) == (2 if harm.__name__ == "huge" else 0, False), err
    if code:
        assert "states 1.1e+12 values, more than the file can hold" in err
    elif harm.__name__ in ("virtual", "link_to_other", "pairs", "texts"):
        assert "pulley.torsion" not in [one["name"] for one in json.loads(out)["channels"]]


def test_a_shape_whose_squares_are_beyond_measure_is_one_of_unit_length():
    values = _shape(load_engine("diesel_i6"), ModeTable(shape={"pulley": 1e308, "flywheel": -1e307}), "mode").values
    assert np.hypot(*values) == pytest.approx(1.0) and values[0] / values[1] == pytest.approx(-10.0)


@pytest.mark.parametrize("harm", ["gone", "shorter", "without a unit", "texts"])
def test_a_result_that_lacks_an_output_is_refused_by_its_name(tmp_path, capsys, harm):
    """Outputs of mains and big ends that are there count as before."""
    names = [f"{of}[{k}].force.{axis}" for of in ("bearing", "big_end") for k in range(1, 8) for axis in "xy"]
    time, lacking = np.linspace(0.0, 0.06, 721), "bearing[1].gap.angle"
    path, angle = tmp_path / "run.h5", (4.0 * np.pi * time / 0.06, "rad")
    data = {"time": (time, "s"), "angle": angle, "crank.angle": angle, lacking: (np.ones(721), "rad")}
    data |= {name: (np.ones(721), "N") for name in names if not name.startswith("big_end[7]")}
    write_result(path, data, {"engine": "diesel_i6"})
    with h5py.File(path, "r+") as file:
        del file[f"data/{lacking}"]
        if harm != "gone":
            values = {"shorter": np.ones(700), "texts": np.array([b"x"] * 721)}
            file[f"data/{lacking}"] = values.get(harm, np.ones(721))
            file[f"data/{lacking}"].attrs.update({} if harm == "without a unit" else {"unit": "rad"})
    said = refused(capsys, "bearing-loads", "diesel_i6", "--result", path)
    assert "run.h5: " in said and (lacking in said or harm == "texts")
