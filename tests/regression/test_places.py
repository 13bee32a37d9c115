"""What commands write takes the place of nothing but a regular file of the same kind, and is whole."""

import os
import subprocess
import sys

import h5py
import matplotlib.figure
import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError, StoreError
from cranktrain.results.figures import save_figure
from cranktrain.store.hdf5 import read_result, write_result
from cranktrain.store.whole_file import check_place, whole_file
from cranktrain_lab.tradeoff.files import TEXTS

RUN = ("simulate", "diesel_i6", "--speed", "2000", "--crank", "rigid", "--bearings", "linear", "--cycles", "1")
SCENE = 'engine = "diesel_i6"\nspeeds_rpm = [2000]\noutputs = ["pulley.torsion"]\nfrequency_hz = 200\naccuracy = 0.05\n'


def other_hdf5(path):
    with h5py.File(path, "w") as file:
        file["thesis"] = [1.0, 2.0]


def text(path):
    path.write_text("ten years of work")


def linked(path):
    path.with_name("work").write_text("ten years of work")
    path.symlink_to(path.with_name("work"))


def snapshot(folder):
    """Every entry with its kind and content."""
    found = {}
    for entry in sorted(folder.rglob("*")):
        plain = entry.is_file() and not entry.is_symlink()
        found[entry.name] = (entry.lstat().st_mode, entry.read_bytes() if plain else None)
    return found


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (other_hdf5, "exists and is no cranktrain result file"),
        (text, "exists and is no cranktrain result file"),
        (linked, "is a link"),
        (os.mkfifo, "is a device"),
        (os.mkdir, "is a folder"),
    ],
)
def test_a_result_replaces_results_only(tmp_path, capsys, make, says):
    path = tmp_path / "mine.h5"
    make(path)
    before = snapshot(tmp_path)
    assert main([*RUN, "--output", str(path)]) == 2
    assert says in capsys.readouterr().err
    assert snapshot(tmp_path) == before


@pytest.mark.parametrize(
    ("arguments", "file"),
    [
        (("bearing", "table", "--length-ratio", "0.4", "--anew", "--output", "thesis.txt"), "thesis.txt"),
        (("bearing", "table", "--length-ratio", "0.4", "--output", "film.h5"), "film.h5.part"),
        ((*RUN, "--plots", "."), "orbits.png"),
        (("stability", "--output", "."), "oil_whirl.svg"),
        (("stability", "--output", ".", "--page", "notes.md"), "notes.md"),
        (("plan", "--run", "scene.toml", "--output", "thesis.txt"), "thesis.txt"),
        (("identify", "diesel_i6", "diesel_i6", "--output", "mine.toml"), "mine.toml"),
        (("run-in", "diesel_i6", "--output", "mine.toml"), "mine.toml"),
    ],
)
def test_every_verb_refuses_what_is_not_its_own_before_the_work(tmp_path, capsys, monkeypatch, arguments, file):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE)
    text(tmp_path / file)
    before = snapshot(tmp_path)
    assert main(list(arguments)) == 2
    assert file in capsys.readouterr().err
    assert snapshot(tmp_path) == before


def test_an_fmu_replaces_an_fmu_of_ours_only(tmp_path, capsys):
    import build_fmu

    text(tmp_path / "CranktrainDieselI6.fmu")
    assert build_fmu.main(["diesel_i6", "-o", str(tmp_path)]) == 2
    assert "exists and is no FMU of cranktrain" in capsys.readouterr().err
    assert (tmp_path / "CranktrainDieselI6.fmu").read_text() == "ten years of work"


@pytest.mark.parametrize("name", TEXTS)
def test_files_of_a_study_replace_their_own_kind_only(tmp_path, name):
    text(tmp_path / name)
    with pytest.raises(InputError, match="is no file of cranktrain tradeoff"), whole_file(tmp_path / name, TEXTS[name]):
        pass


@pytest.mark.parametrize("ending", [".png", ".svg"])
def test_own_pictures_and_results_are_replaced(tmp_path, ending):
    figure = matplotlib.figure.Figure()
    for _ in range(2):
        save_figure(figure, tmp_path / f"a{ending}")
        write_result(tmp_path / "a.h5", {"x": (np.arange(3.0), "1")})
    figure.savefig(tmp_path / f"foreign{ending}")
    with pytest.raises(InputError, match="is no picture of cranktrain"):
        save_figure(figure, tmp_path / f"foreign{ending}")


def test_an_empty_file_may_be_replaced_and_a_name_can_be_long(tmp_path):
    (tmp_path / "empty.h5").touch()
    write_result(tmp_path / "empty.h5", {"x": (np.arange(3.0), "1")})
    write_result(tmp_path / ("x" * 252 + ".h5"), {"x": (np.arange(3.0), "1")})
    for name in ("x" * 300, "x\0.h5"):
        with pytest.raises(InputError, match="no file can have this name"):
            check_place(tmp_path / name)


def test_a_folder_that_takes_no_files_is_refused_before_the_work_whoever_writes(tmp_path, monkeypatch):
    """An administrator has the right to write into ``/proc`` or a full disk, and yet no file comes to be there."""

    def full(*given, **named):
        raise OSError(28, "No space left on device")

    check_place(tmp_path / "a.toml")
    assert not list(tmp_path.iterdir())
    monkeypatch.setattr("tempfile.TemporaryFile", full)
    with pytest.raises(InputError, match="is not a writable folder"):
        check_place(tmp_path / "a.toml")


FULL = """
import resource, sys
import numpy as np
from cranktrain.store.hdf5 import write_result
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
write_result(sys.argv[1], {f"o{i}": (np.arange(3000.0) ** 0.5, "1") for i in range(100)})
"""


@pytest.mark.parametrize("size", [100, 50_000, 2_000_000, 2_640_000])
def test_a_disk_that_is_full_ends_in_one_line_and_leaves_the_old_file(tmp_path, size):
    """At every stage of the file: signature, headers, values, and what HDF5 writes as it closes."""
    path = tmp_path / "a.h5"
    write_result(path, {"old": (np.arange(3.0), "1")})
    done = subprocess.run([sys.executable, "-c", FULL, str(path), str(size)], capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith("a.h5: cannot be written (File too large); choose another place")
    assert list(read_result(path)[0]) == ["old"]
    assert os.listdir(tmp_path) == ["a.h5"]


def test_a_file_that_appears_during_the_work_stays(tmp_path):
    path = tmp_path / "a.txt"
    with pytest.raises(InputError, match="is a folder"), whole_file(path) as temporary:
        temporary.write_text("ours")
        path.mkdir()
    assert os.listdir(tmp_path) == ["a.txt"] and path.is_dir()


def test_an_error_while_writing_is_told_as_one_of_the_place(tmp_path):
    with pytest.raises(StoreError, match="No space left on device"), whole_file(tmp_path / "a.txt"):
        raise OSError(28, "No space left on device")
