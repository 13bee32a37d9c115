"""Names are parts of paths and identifiers, titles are text: neither is obeyed by what shows it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from cranktrain.cli.console import show_rows
from cranktrain.cli.exit_codes import one_line, parts
from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.engine.file import engine_path, load_engine
from cranktrain.fmu import archive, engine_fmu
from cranktrain.studies import modal
from cranktrain.studies.scene import load_scene

TITLE = "[/x] $x_{$ <script>alert(1)</script> & :smile:"
LONG = "x" * 260
SCENE = 'engine = "diesel_i6"\nspeeds_rpm = [2000]\noutputs = ["pulley.torsion"]\nfrequency_hz = 200\naccuracy = 0.05\n'


def engine_file(folder, name="my_six", title="Six"):
    """The six under another name and title."""
    lines = engine_path("diesel_i6").read_text("utf-8").splitlines()
    heads = {"name": name, "title": title}
    lines = [
        f"{key} = {json.dumps(heads[key])}" if (key := line.partition(" ")[0]) in heads and line[0] != "[" else line
        for line in lines
    ]
    path = folder / "six.toml"
    path.write_text("\n".join(lines), "utf-8")
    return path


@pytest.mark.parametrize("name", ["../x", "a/b", "a\\b", "a b", "1a", "_a", "", "six-2", "sïx", "x" * 65, "a\n"])
def test_a_name_that_is_no_identifier_is_refused(tmp_path, name):
    with pytest.raises(InputError, match=r"six\.toml: name: .* is not a valid name; use 1 to 64 letters"):
        load_engine(engine_file(tmp_path, name=name))


@pytest.mark.parametrize("title", ["", " ", "a\nb", "\x1b[2J", "a\u202eb", "x" * 201])
def test_a_title_is_one_printable_line(tmp_path, title):
    with pytest.raises(InputError, match=r"six\.toml: title: must be one line"):
        load_engine(engine_file(tmp_path, title=title))
    scene = tmp_path / "scene.toml"
    scene.write_text(f"title = {json.dumps(title)}\n" + SCENE, "utf-8")
    with pytest.raises(InputError, match=r"scene\.toml: title: must be one line"):
        load_scene(scene)


def test_a_title_is_shown_as_it_stands(tmp_path, capsys):
    """In pictures, in an FMU's page, and on a terminal."""
    path = engine_file(tmp_path, name="a" * 64, title=TITLE)
    assert load_engine(path).title == TITLE
    options = ("--speed", "2000", "--crank", "rigid", "--bearings", "linear", "--cycles", "1", "--step-deg", "10")
    files = ("--output", str(tmp_path / "run.h5"), "--plots", str(tmp_path))
    assert main(["simulate", str(path), *options, *files]) == 0
    assert (tmp_path / "orbits.png").is_file()
    files = archive.accompanying(engine_fmu.product(load_engine(path), engine_fmu.full_interface()))
    page = files["documentation/index.html"].decode()
    assert "[/x] $x_{$ &lt;script&gt;alert(1)&lt;/script&gt; &amp; :smile:" in page and "<script>" not in page
    capsys.readouterr()
    show_rows(TITLE, ["[bold]"], [["[/x]" + "x" * 60]])
    shown = capsys.readouterr().out
    assert TITLE in shown and "[bold]" in shown


def test_a_fault_is_one_line_and_keeps_its_traceback(tmp_path, capsys, monkeypatch):
    def broken(*given, **more):
        raise RecursionError("deep\ndown \x1b[31m")

    monkeypatch.setattr(modal, "modal", broken)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert main(["modal", "diesel_i6", "--json"]) == 70
    captured = capsys.readouterr()
    (kept,) = tmp_path.glob("cranktrain-*.log")
    assert "in broken" in kept.read_text() and kept.stat().st_mode & 0o077 == 0
    assert captured.err == (
        "cranktrain: fault of this program, RecursionError: deep down \\x1b[31m; please report it with its traceback, "
        f"{kept}\n"
    )
    error = json.loads(captured.out)["error"]
    assert error["what"].startswith("fault of this program") and str(kept) in error["remedy"]


@pytest.mark.parametrize(
    ("arguments", "where"),
    [
        (("simulate", "diesel_i6", "--speed", "5"), "--speed"),
        (("simulate", "diesel_i6", "--speed", "2000", "--cycles", "9" * 400), "--cycles"),
        (("modal", "missing.toml"), "missing.toml"),
        (("identify", "diesel_i6", "missing.toml"), "missing.toml"),
        (("plan", "missing.toml"), "missing.toml"),
        (("simulate", "diesel_i6", "--speed", "2000", "--block", "flexible", "--block-mesh", LONG), LONG),
        (("bearing", "table", "--length-ratio", "0.5", "--output", LONG), LONG),
        (("simulate", "diesel_i6", "--speed", "2000", "--output", LONG), None),
        ((), None),
    ],
)
def test_errors_are_objects_for_machines(capsys, arguments, where):
    assert main([*arguments, "--json"]) == 2
    captured = capsys.readouterr()
    error = json.loads(captured.out)["error"]
    assert set(error) == {"what", "where", "remedy"} and error["what"] and captured.err.count("\n") == 1
    assert where is None or error["where"] == where


@pytest.mark.parametrize(
    ("line", "where", "what", "remedy"),
    [
        ("six.toml: crankshaft.throw: 'x' is not a number", "six.toml: crankshaft.throw", "'x' is not a number", None),
        ("/a b/c.h5: is a folder; name a file", "/a b/c.h5", "is a folder", "name a file"),
        ("--load 3 is not within 0 to 2; less", "--load", "--load 3 is not within 0 to 2", "less"),
        ("no film; yet; wait", None, "no film; yet", "wait"),
    ],
)
def test_a_line_says_what_where_and_what_to_do(line, where, what, remedy):
    assert parts(line) == {"what": what, "where": where, "remedy": remedy}


def test_a_line_is_one_line():
    assert one_line("a\n b\x07\udcff") == "a b\\x07\\udcff"
    assert len(one_line("x" * 10**6)) < 1600


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_an_output_that_takes_nothing_ends_in_one_line(tmp_path):
    table = tmp_path / "table.toml"
    discs = "".join(f'[[disc]]\nname = "{name}"\ninertia = 1.0\n' for name in "ab")
    table.write_text(f'{discs}[[shaft]]\nbetween = ["a", "b"]\nstiffness = 9.0\n', "utf-8")
    command = [sys.executable, "-m", "cranktrain.cli.main", "modal", str(table)]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert done.stderr == (
        "cranktrain: standard output: cannot be written, there is no space left; choose another place\n"
    )
