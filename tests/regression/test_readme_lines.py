"""The README's command lines run as they stand: a file that they read is in the repository or made by a line before."""

import itertools
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from some import some

from cranktrain.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
BLOCK = next(
    text
    for text in re.findall(r"```sh\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)
    if "cranktrain new" in text
)
LINES = [shlex.split(line, comments=True) for line in BLOCK.splitlines() if not line.startswith(". .venv")]
READ = re.compile(r"\.(toml|csv|step|stp|mf4|tdms|uff|h5|msh|fmu)$")
WRITES = ("--output", "--to", "-o")
"""Options in front of a file that a line writes."""
MADE = {
    "diesel_i6_2000rpm.h5": ["cranktrain", "simulate", "diesel_i6", "--speed", "2000"],
    "dist/CranktrainDieselI6.fmu": ["python", "build_fmu.py", "diesel_i6"],
}
"""Files that a line reads, and how the earlier line begins that makes them."""
SERVES = ("explore",)
"""Verbs that serve a page until Ctrl-C."""
QUICK = ("new", "measured", "watch", "engines")


def test_every_file_that_a_line_reads_is_there():
    for number, words in enumerate(LINES):
        for before, word in some(itertools.pairwise(words)):
            if not READ.search(word) or before in WRITES:
                continue
            if word in MADE:
                begin = MADE[word]
                assert any(line[: len(begin)] == begin for line in LINES[:number]), f"{word}: made by no line before"
            else:
                assert (ROOT / word).is_file(), f"{word}: not in the repository"


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """A folder with what a clone has for these lines."""
    for name in ("examples", "build_fmu.py", "fmu_src", "modelDescription"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_lines_of_seconds_run(clone, capsys):
    """Two new engines with their combustion, a bench file's channels, and a misfire from recordings of the pulley."""
    told = {}
    for words in LINES:
        if words[:1] == ["cranktrain"] and words[1] in QUICK:
            assert main(words[1:]) == 0, capsys.readouterr().err
            told.setdefault(words[1], "")
            told[words[1]] += capsys.readouterr().out
    assert "pulley" in told["measured"]
    assert "Likeliest: misfire of cylinder 3, severity 0.2" in told["watch"]
    assert len(list(clone.glob("my_*.toml"))) == 4 and len(list(clone.glob("my_*_crank.msh"))) == 1


def page_served(command):
    """Start a page's server, wait for its address, and end it by Ctrl-C: exit code and what it said."""
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    said = []
    for line in server.stdout:
        said.append(line)
        if "http://127.0.0.1" in line:
            server.send_signal(signal.SIGINT)
            break
    rest, _ = server.communicate(timeout=60)
    return server.returncode, "".join(said) + rest


@pytest.mark.slow
def test_all_lines_run_one_after_the_other(clone):
    for words in LINES:
        shown = [word for word in words if word != "--show-plot"]
        command = [sys.executable, "-m", *shown] if words[0] != "python" else [sys.executable, *shown[1:]]
        if words[1] in SERVES:
            code, said = page_served(command)
        else:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            code, said = done.returncode, done.stderr
        assert code == 0, (words, said[-2000:])
