"""Film tables on disk: built once, resumed after an interruption, refused when they are not what is asked for."""

import json
import os
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
from one_line import one_line

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError, StoreError
from cranktrain.film.table.database import TableSettings, slab_names
from cranktrain.store.film_tables import film_table, load_film_table, table_path

SETTINGS = TableSettings(0.5, tilt=False)
COMMAND = [sys.executable, "-m", "cranktrain.cli.main", "bearing", "table"]


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    path = tmp_path_factory.mktemp("films") / "table.h5"
    film_table(SETTINGS, path, workers=1)
    return path


def broken(path, settings=SETTINGS, after=1, say=lambda text: None):
    """Build a table up to an interrupt after so many slabs."""

    def interrupt(done, total):
        assert total == len(slab_names(settings))
        if done >= after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        film_table(settings, path, workers=1, progress=interrupt, say=say)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda data: data["aligned"].__setitem__((1, 2, 3), np.nan), "'aligned' has 1 values that are not finite"),
        (lambda data: data["axes"].__setitem__(0, 7.0), "'axes' are not those of its settings"),
        (lambda data: reshaped(data, "aligned", lambda x: x[:, :-1]), r"'aligned' is float64 of shape \(4, 50, 99\)"),
        (lambda data: reshaped(data, "aligned", lambda x: x.astype(np.float32)), "'aligned' is float32"),
        (lambda data: reshaped(data, "tilted", np.ravel), r"'tilted' is float32 of shape \(1,\), not"),
        (lambda data: data.__delitem__("pressure"), "'pressure' is missing"),
    ],
)
def test_a_table_of_wrong_shape_or_values_is_refused_in_one_line(kept, tmp_path, change, says):
    """The digest says what a table was made for, not what became of its numbers."""
    path = tmp_path / "table.h5"
    path.write_bytes(kept.read_bytes())
    with h5py.File(path, "r+") as file:
        change(file["data"])
    with one_line(match=f"^{path}: {says}.*--anew", kind=StoreError):
        film_table(SETTINGS, path)


def reshaped(data, name, change):
    """Another array in place of one."""
    values, attributes = change(data[name][()]), dict(data[name].attrs)
    del data[name]
    data.create_dataset(name, data=values).attrs.update(attributes)


def test_spoilt_slabs_of_an_interrupted_build_are_solved_anew(kept, tmp_path):
    path = tmp_path / "table.h5"
    broken(path, after=8)
    with h5py.File(path.with_name("table.h5.part"), "r+") as file:
        slabs = file["data/slab"]
        first, second, *_ = slabs
        slabs[first][0, 0] = np.nan
        reshaped(slabs, second, lambda x: x[:-1])
    _, _, solved = film_table(SETTINGS, path, workers=1)
    assert solved == 97 - 8 + 2 and path.read_bytes() == kept.read_bytes()


def test_an_interrupted_build_goes_on_and_ends_with_the_same_bits(kept, tmp_path):
    path, told = tmp_path / "table.h5", []
    broken(path, after=30)
    assert not path.exists() and path.with_name("table.h5.part").is_file()
    table, _, solved = film_table(SETTINGS, path, workers=2, say=told.append)
    assert solved == 67
    assert len(told) == 1 and "continues with 30 of 97" in told[0]
    assert path.read_bytes() == kept.read_bytes() and not path.with_name("table.h5.part").exists()
    whole = load_film_table(kept, SETTINGS)
    assert all((a == b).all() for a, b in zip(table.arrays, whole.arrays, strict=True))


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")
def test_a_killed_build_leaves_no_process_and_loses_no_kept_slab(tmp_path):
    path = tmp_path / "killed.h5"
    part = path.with_name("killed.h5.part")
    build = subprocess.Popen(
        [*COMMAND, "--length-ratio", "0.35", "--resolution", "coarse", "--workers", "2", "--output", str(path)],
        start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    deadline = time.monotonic() + 3600
    while time.monotonic() < deadline and build.poll() is None:
        if part.is_file() and part.stat().st_size > 50_000:
            break
        time.sleep(0.05)
    assert build.poll() is None
    build.kill()
    build.wait()
    with pytest.raises(ProcessLookupError):
        while time.monotonic() < deadline:
            os.killpg(build.pid, 0)
            time.sleep(0.1)
    told = []
    broken(path, TableSettings(0.35, resolution="coarse"), say=told.append)
    assert "continues with" in told[0]


def test_a_part_of_another_table_is_put_aside_with_a_word(tmp_path):
    path, told = tmp_path / "table.h5", []
    broken(path, TableSettings(0.8, tilt=False))
    broken(path, say=told.append)
    assert len(told) == 1 and "L/D 0.8" in told[0] and "solved again" in told[0]
    path.with_name("table.h5.part").write_bytes(b"nonsense")
    with pytest.raises(InputError, match=r"table\.h5\.part: exists and is no .*; choose another name, or delete it"):
        film_table(SETTINGS, path, workers=1)


def test_tables_of_another_geometry_or_schema_and_foreign_files_are_refused(kept, tmp_path):
    with one_line(match=r"made for L/D 0.5.*wanted L/D 0.6.*--anew", kind=StoreError):
        film_table(TableSettings(0.6, tilt=False), kept)
    with one_line(match=r"groove none.*wanted.*groove circumferential", kind=StoreError):
        film_table(TableSettings(0.5, groove="circumferential", tilt=False), kept)
    other = tmp_path / "other.h5"
    for attributes, says in (({"schema": 99}, "schema 99"), ({"format": "else"}, "not a cranktrain film table")):
        other.write_bytes(kept.read_bytes())
        with h5py.File(other, "a") as file:
            file.attrs.update(attributes)
        with pytest.raises(StoreError, match=says):
            load_film_table(other, SETTINGS)
    other.write_bytes(kept.read_bytes()[:2000])
    for path, says in ((other, "damaged"), (tmp_path / "none.h5", "no such file")):
        with pytest.raises(StoreError, match=says):
            load_film_table(path, SETTINGS)
    # Tables of different settings do not share a file.
    changes = {}, {"groove": "circumferential"}, {"tilt_range": 0.8}, {"resolution": "fine"}
    variants = [SETTINGS, TableSettings(0.51), *(TableSettings(0.5, **change) for change in changes)]
    assert len({table_path(settings) for settings in variants}) == len(variants)


def test_a_kept_table_is_read_and_solved_no_more_and_the_command_prints_what_a_machine_reads(kept, capsys):
    table, path, solved = film_table(SETTINGS, kept)
    assert (path, solved, table.cells, table.arrays.tilted.size) == (kept, 0, 48 * 96, 1)
    assert set(table.worst()) == {"aligned_max", "aligned_p95"}
    assert main(["bearing", "table", "--length-ratio", "0.5", "--no-tilt", "--output", str(kept), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["path"] == str(kept) and result["cells"] == 48 * 96 and result["seconds"] > 0
    assert result["aligned_max_error_to_0.95"] < 0.005
    assert 0 < result["max_interpolation_error"] == np.max(table.aligned_error) < 0.02
