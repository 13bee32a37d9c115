"""Files that ask for memory without end, name what is not theirs, or hold what a terminal obeys: refused or shown."""

import json
import os
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

import cranktrain as ct
from cranktrain.cli.main import main
from cranktrain.core.element_names import array_element
from cranktrain.core.errors import InputError
from cranktrain.core.text_table import split_columns
from cranktrain.core.visible_text import visible
from cranktrain.engine.file import load_engine
from cranktrain.structure.fem.mesh_file import read_surfaces_and_tetrahedra
from cranktrain.structure.fem.superelement_file import read_superelement

MOST = 300_000
"""Memory over the start that a refused file may take, kB."""
SECRET = "hunter2:x:0:0:root:/root:/bin/sh"
WORK = """
import json, resource, sys
from pathlib import Path
import cranktrain as ct
from cranktrain.core.errors import CranktrainError
from cranktrain.core.text_table import read_table
from cranktrain.core.user_file import read_toml
from cranktrain_lab.cad.step_file import read_step
from cranktrain.structure.fem.mesh_file import read_surfaces_and_tetrahedra
from cranktrain.structure.fem.superelement_file import read_superelement
readers = {
    "mesh": lambda path: read_surfaces_and_tetrahedra(Path(path)), "super": read_superelement, "step": read_step,
    "measured": ct.read_measured, "toml": lambda path: read_toml(path, "file", "give one"),
    "table": lambda path: read_table(path, "table", "give one"),
}
before, found = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, []
for reader, path in json.loads(sys.argv[1]):
    try:
        readers[reader](path)
        said = ""
    except CranktrainError as error:
        said = str(error)
    found.append((said, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before))
print(json.dumps(found))
"""


LONG = "9" * 5000  # digits beyond what ``int`` takes of a text


@pytest.mark.parametrize("number", [LONG, "²", "１２x", f"-{LONG}"], ids=["long", "superscript", "wide", "negative"])
def test_whole_numbers_that_are_none_are_refused_wherever_they_stand(tmp_path, number):
    texts = {
        "a.inp": f"*NODE\n1, 0, 0, 0\n*ELSET, ELSET=A\n{number}, 2\n*ELEMENT, TYPE=C3D10\n1, 1\n",
        "b.bdf": f"BEGIN BULK\nGRID,{number},,0.,0.,0.\nENDDATA\n",
        "c.unv": f"    -1\n{number:>6}\n    -1\n",
        "d.toml": 'stiffness = "k.mtx"\nmass = "k.mtx"\ndofs = "e.txt"\n[interfaces]\npulley = 1\n[nodes]\n'
        f'"{number}" = [0, 0, 0]\n',
        "e.txt": f"{number}.1\n1.2\n",
        "k.mtx": "1 1 2.0\n",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    for name in ("a.inp", "b.bdf", "c.unv", "d.toml"):
        with pytest.raises(InputError) as caught:
            (read_superelement if name == "d.toml" else read_surfaces_and_tetrahedra)(tmp_path / name)
        assert len(str(caught.value)) < 500 and str(caught.value).isprintable()
    assert array_element(f"x[{number}]") is None
    with pytest.raises(InputError):
        load_engine("diesel_i6").with_({f"body[{number}].mass": 1.0})
    for words in (["simulate", "diesel_i6", "--speed", "2000", "--pressure", f"k.mtx:{number}"],
                  ["picture", "diesel_i6", "--mode", number, "--crank", "beam"],
                  ["measured", "k.mtx", "--cylinders", number, "--pressure", "a"]):  # fmt: skip
        assert main(words) == 2, words


def test_names_that_no_file_can_have_are_missing_files(tmp_path, monkeypatch, capsys):
    """Longer than any file's: of traces in an index, of files, of columns behind a colon, which may be many."""
    monkeypatch.chdir(tmp_path)
    long = 300 * "a"
    (tmp_path / "index.csv").write_text(f"speed_rpm,load,file\n1000,1,{long}.csv\n")
    run = ["simulate", "diesel_i6", "--speed", "2000", "--crank", "rigid", "--bearings", "linear", "--pressure"]
    for words in ([*run, "index.csv"], [*run, f"{long}.csv"], [*run, f"{long}/b.csv:1,2"],
                  ["measured", f"{long}.csv"], ["export", f"{long}.h5", "--to", "a.csv"],
                  ["modal", "diesel_i6", "--mesh", f"{long}.msh"], ["modal", "diesel_i6", "--body", f"{long}.toml"],
                  ["plan", "--run", f"{long}.toml"], ["vary", f"{long}.toml"],
                  ["identify", "diesel_i6", f"{long}.toml"],
                  ["optimize", f"{long}.toml"]):  # fmt: skip
        assert main(words) == 2, words
        assert "fault of this program" not in capsys.readouterr().err
    angle = np.arange(0.0, 720.0, 2.0)
    names = [f"pressure of cylinder {k} at full load, averaged over the cycles of the day" for k in range(1, 7)]
    rows = [";".join([f"{a:g}", *6 * [f"{3 + 130 * np.exp(-(((a - 370) / 25) ** 2)):.4f}"]]) for a in angle]
    (tmp_path / "p.csv").write_text("\n".join([";".join(["deg", *names]), *rows]))
    path, columns = split_columns("p.csv:" + ",".join(one.replace(",", " ") for one in names))
    assert str(path) == "p.csv" and len(columns) == 6


def test_memory_of_what_is_refused_is_bounded(tmp_path):
    """Sets of 300 million members, sets of sets that double, devices, a pipe, and files of 8 GB of nothing."""
    texts = {
        "nset.inp": "*NSET, NSET=A, GENERATE\n1, 300000000, 1\n",
        "elset.inp": "*ELSET, ELSET=A, GENERATE\n1, 300000000, 1\n",
        "sets.inp": "*ELSET, ELSET=A0, GENERATE\n1, 1000\n"
        + "".join(f"*ELSET, ELSET=A{k + 1}\nA{k}, A{k}\n" for k in range(40)),
        "surface.inp": "*ELSET, ELSET=A, GENERATE\n1, 1000000\n*SURFACE, NAME=B\n" + "A, S1\n" * 400,
        "zero.toml": 'matrices = "/dev/zero"\n[interfaces]\npulley = 1\n',
        "dofs.toml": 'stiffness = "k.mtx"\nmass = "k.mtx"\ndofs = "/dev/zero"\n[interfaces]\npulley = 1\n',
        "k.mtx": "1 1 2.0\n",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "device.inp").symlink_to("/dev/zero")
    (tmp_path / "device.csv").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe.csv")
    for name in ("empty.inp", "empty.bdf", "empty.unv", "empty.msh", "empty.csv", "empty.step"):
        with (tmp_path / name).open("wb") as file:
            file.truncate(8_000_000_000)
    cases = [
        *[("mesh", name) for name in ("nset.inp", "elset.inp", "sets.inp", "surface.inp", "device.inp")],
        *[("mesh", f"empty.{ending}") for ending in ("inp", "bdf", "unv", "msh")],
        ("super", "zero.toml"), ("super", "dofs.toml"), ("step", "/dev/zero"), ("step", "empty.step"),
        *[(reader, f"{path}.csv") for reader in ("measured", "table", "toml") for path in ("device", "pipe", "empty")],
    ]  # fmt: skip
    told = json.dumps([(reader, str(tmp_path / name)) for reader, name in cases])
    ran = subprocess.run([sys.executable, "-c", WORK, told], capture_output=True, text=True, timeout=500, check=True)
    for (reader, name), (said, memory) in zip(cases, json.loads(ran.stdout), strict=True):
        assert said and "\n" not in said, (reader, name)
        assert memory < MOST, (reader, name, memory)
        kind = {"device": "is a device", "pipe": "is a pipe", "nset": "gets 300000000", "zero": "is a device"}
        assert kind.get(name.split("/")[-1].split(".")[0], "") in said, (reader, name, said)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("deck.inp", "*NODE, INPUT={}\n"), ("deck.inp", "*ELEMENT, TYPE=C3D4, INPUT={}\n"),
        ("deck.inp", "*NSET, NSET=A, INPUT={}\n"), ("deck.inp", "*INCLUDE, INPUT={}\n"),
        ("deck.inp", "*NODE\n*INCLUDE, INPUT={}\n"), ("deck.bdf", "INCLUDE '{}'\n"),
        ("deck.bdf", "GRID,1\nINCLUDE '{}'\n"),
        ("body.toml", 'matrices = "{}"\n'), ("body.toml", 'stiffness = "{}"\nmass = "{}"\n'),
        ("body.toml", 'matrices = "k.mtx"\nnodes = "{}"\n'),
    ],
)  # fmt: skip
@pytest.mark.parametrize("place", ["secret", "../secret", "link/secret"])
@pytest.mark.parametrize("lines", [SECRET, "hunter2", "hunter2 word", " ,hunter2", "hunter2, 1, 2, 3"])
def test_no_message_quotes_a_foreign_file(name, text, place, lines, tmp_path):
    """Beside the deck, above it, or behind a link; what lies elsewhere is not opened at all."""
    folder = tmp_path / "deck"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path)
    (folder / place).write_text(lines + "\n")
    (folder / "k.mtx").write_text("1,1,1,1,2.0\n")
    (folder / name).write_text(text.replace("{}", place))
    read = read_superelement if name == "body.toml" else read_surfaces_and_tetrahedra
    with pytest.raises(InputError) as error:
        read(folder / name)
    assert "hunter2" not in str(error.value)
    if name != "body.toml" and place != "secret":
        assert "not below the deck's folder" in str(error.value)


@pytest.mark.parametrize(
    ("kind", "line", "last"),
    [("inp", "*INCLUDE, INPUT={}\n", "*NODE\n1, 0, 0, oops\n"), ("bdf", "INCLUDE '{}'\n", "GRID,1,,0.,0.,oops\n")],
)
def test_includes_are_deep_but_no_loop(kind, line, last, tmp_path, monkeypatch):
    """25 files in a row are read; a folder outside is opened where the user names it."""
    shared = tmp_path / "shared"
    (tmp_path / "deck").mkdir()
    shared.mkdir()
    for k in range(26):
        (tmp_path / f"deck/{k}.{kind}").write_text(
            line.format(f"{k + 1}.{kind}" if k < 25 else f"../shared/last.{kind}")
        )
    (shared / f"last.{kind}").write_text(last)
    with pytest.raises(InputError, match="not below the deck's folder"):
        read_surfaces_and_tetrahedra(tmp_path / f"deck/0.{kind}")
    monkeypatch.setenv("CRANKTRAIN_INCLUDES", str(shared))
    with pytest.raises(InputError, match=f"last.{kind}, line .*oops"):
        read_surfaces_and_tetrahedra(tmp_path / f"deck/0.{kind}")


def test_what_a_terminal_obeys_is_shown(tmp_path, capsys):
    name = "\x1b]0;title\x07p\x9b31m\u202e"
    path = str(tmp_path / "run.parquet")
    pd.DataFrame({"time": np.arange(50.0), name: np.arange(50.0) % 5}).to_parquet(path)
    assert name in ct.read_measured(path).names and main(["measured", path]) == 0
    assert main(["measured", path, "--channels", f"{name}x"]) == 2
    shown = capsys.readouterr()
    for text in (shown.out, shown.err):
        assert "1b]0;title" in text and not set(name) & {"\x1b", "\x07", "\x9b", "\u202e"} & set(text)
    assert main(["measured", path, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["channels"][0]["name"] == name
    assert visible("12 µm\u00a0± 3\n\tθ̈") == "12 µm\u00a0± 3\n\tθ̈"
