"""Every script of ``benchmarks`` starts, at the shortest setting that it has.

``tests/data/benchmark_starts.toml`` names arguments and constants for each; ``tests/shortened.py`` sets the constants.
A script that is not in the table fails the test. Figures of such short runs mean nothing and are not looked at.
"""

import ast
import importlib
import json
import os
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "benchmarks"
SCRIPTS = sorted(path.stem for path in FOLDER.glob("[!_]*.py"))


class Start(NamedTuple):
    """How a script is started.

    Attributes
    ----------
    words : its arguments
    constants : its module constants that make it short
    quick : whether it runs in ``make test``
    code : its exit code
    why : why it is not started whole
    """

    words: str = ""
    constants: Mapping[str, object] = MappingProxyType({})
    quick: bool = False
    code: int = 0
    why: str = ""


ROWS = tomllib.loads((ROOT / "tests" / "data" / "benchmark_starts.toml").read_text("utf-8"))
STARTS = {name: Start(**row) for name, row in sorted(ROWS.items())}
NO_JSON = {"digests", "ground_springs", "vector_kernels", "whole_engine", "clients", "peers", "spark_reference"}
"""Scripts that print lines or tables, or are not started whole."""


def started(name, folder, constants, words):
    """A script in a process of its own that works in ``folder``."""
    command = [
        sys.executable,
        ROOT / "tests" / "shortened.py",
        FOLDER / f"{name}.py",
        json.dumps(dict(constants)),
        *words,
    ]
    paths = os.pathsep.join([str(ROOT / "fmu_src"), str(ROOT)])
    return subprocess.run(command, cwd=folder, env=os.environ | {"PYTHONPATH": paths}, capture_output=True, text=True)


def check_start(name, folder):
    start = STARTS[name]
    if name == "code_variants" and not any(ROOT.glob("fmu_src/cranktrain/fmu/native/lib/*/cranktrain.*")):
        pytest.skip("compares machine code of the installation, which `make native` makes")
    done = started(name, folder, start.constants, shlex.split(start.words))
    assert done.returncode == start.code, done.stderr[-2000:]
    if name not in NO_JSON:
        assert json.loads(done.stdout)


def test_the_table_holds_every_script():
    assert list(STARTS) == SCRIPTS
    assert all(start.why for start in STARTS.values() if "--help" in start.words or start.code)


def syntax(name):
    return ast.parse((FOLDER / f"{name}.py").read_text("utf-8"))


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_script_is_imported_and_reads_its_arguments(name, monkeypatch, capsys):
    """Importing starts nothing. Where a parser reads the arguments it tells of itself, and takes those of the table."""
    monkeypatch.syspath_prepend(str(FOLDER))
    module = importlib.import_module(f"benchmarks.{name}")
    assert module.__doc__ and capsys.readouterr().out == ""
    for constant in STARTS[name].constants:
        assert hasattr(module, constant), f"{name} has no {constant}"
    if "argparse" not in {alias.name for node in ast.walk(syntax(name)) if isinstance(node, ast.Import)
                          for alias in node.names}:  # fmt: skip
        return
    monkeypatch.setattr(sys, "argv", [name, "--help"])
    with pytest.raises(SystemExit) as ended:
        module.main(*(["--help"] if name == "clients" else []))
    assert ended.value.code == 0 and "usage" in capsys.readouterr().out


@pytest.mark.parametrize("name", [name for name, start in STARTS.items() if start.quick])
def test_a_short_script_starts(name, tmp_path):
    check_start(name, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, start in STARTS.items() if not start.quick])
def test_a_long_script_starts(name, tmp_path):
    check_start(name, tmp_path)
