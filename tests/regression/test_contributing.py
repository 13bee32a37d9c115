"""CONTRIBUTING.md can be followed: its files and commands run as they stand there, and no other source is touched."""

import re
import shlex
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from cranktrain.engine.file import engine_names, load_engine
from cranktrain.structure.crank.level import bare_crank

TEXT = (Path(__file__).resolve().parents[2] / "CONTRIBUTING.md").read_text("utf-8")
SECTIONS = {part.partition("\n")[0]: part for part in re.split(r"^## ", TEXT, flags=re.MULTILINE)}
BLOCK = re.compile(r"^ *```(python|sh)\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("title", [title for title in SECTIONS if title.startswith("Add ")])
def test_section_can_be_followed(title, tmp_path):
    """A block of Python is a file, named in its first line; of a shell's lines those of ``cranktrain`` run."""
    lines = ["from cranktrain.cli.main import main"]
    for language, block in BLOCK.findall(SECTIONS[title]):
        text = textwrap.dedent(block)
        if language == "python":
            name = text.partition("\n")[0].removeprefix("# ")
            (tmp_path / name).write_text(text, "utf-8")
            lines.append(f"import {Path(name).stem}")
        else:
            lines += [
                f"assert main({shlex.split(line)[1:]}) == 0" for line in text.splitlines() if "cranktrain" in line
            ]
    command = [sys.executable, "-c", "\n".join(lines)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=3600)
    assert done.returncode == 0, done.stderr[-3000:]


@pytest.mark.parametrize("name", engine_names())
def test_shipped_engines_are_whole(name):
    engine = load_engine(name)
    assert engine.name == name
    steel = 7850.0 * engine.cylinders.bore**3
    assert bare_crank(engine, "rigid").mass > steel
