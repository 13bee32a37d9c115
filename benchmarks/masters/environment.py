"""Other people's masters, each in a virtual environment of its own, made once and kept in the cache."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import venv
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cranktrain.core.cache import cache_folder
from cranktrain.core.reduced_body import Array

HERE = Path(__file__).resolve().parent


class Master(NamedTuple):
    """One master: packages of its environment, the script that runs it, and what the script is given before names."""

    packages: tuple[str, ...]
    script: str
    given: tuple[str, ...] = ()


CONTAINER = ("fmu-manipulation-toolbox==2.0",)
MASTERS = {
    "fmpy": Master((), "run_fmpy.py"),
    "libcosimpy": Master(("libcosimpy==0.0.6",), "run_libcosim.py"),
    "ecospy": Master(("ecospy==0.7.2", "tbb"), "run_ecos.py"),
    "fmucontainer, sequential": Master(CONTAINER, "run_container.py", ("TOOL", "cranktrain")),
    "fmucontainer, parallel": Master(CONTAINER, "run_container.py", ("TOOL", "")),
}
"""By name. FMPy's simulator and what runs a container are those of this environment."""


class NotHere(Exception):
    """A master that cannot be had on this machine, and why."""


def environment(master: Master) -> Path:
    """Folder of its environment, made where there is none; :class:`NotHere` where it cannot be."""
    folder = cache_folder() / "masters" / Path(master.script).stem
    done, wanted = folder / "installed", "\n".join(master.packages)
    if done.exists() and done.read_text("utf-8") == wanted:
        return folder
    shutil.rmtree(folder, ignore_errors=True)
    print(f"masters: installing {', '.join(master.packages)}", file=sys.stderr, flush=True)
    venv.create(folder, with_pip=True)
    command = [str(folder / "bin" / "python"), "-m", "pip", "install", "--disable-pip-version-check", "-q"]
    tried = subprocess.run([*command, *master.packages], capture_output=True, text=True)
    if tried.returncode:
        raise NotHere(f"{master.packages[0]} cannot be installed: {tried.stderr.strip().splitlines()[-1]}")
    done.write_text(wanted, "utf-8")
    return folder


def run(name: str, ssp: Path, step: float, count: int, outputs: Sequence[str], native: bool = False) -> Array:
    """Run an SSP for ``count`` steps of ``step`` (s); ``outputs`` (``unit.variable``) after each, (count, k).

    Units that are ``native`` are run in the master's own environment, which has no numba and nothing of this one.

    Raises :class:`NotHere` for a master that cannot be had, ``RuntimeError`` with what a master says that fails.
    """
    master = MASTERS[name]
    python, libraries, paths = sys.executable, "", [str(HERE.parents[1]), os.environ.get("PYTHONPATH", "")]
    given = list(master.given)
    if master.packages:
        own = environment(master)
        libraries = str(own / "lib")
        given = [str(own / "bin" / "fmucontainer") if word == "TOOL" else word for word in given]
        if not given:
            python = str(own / "bin" / "python")
            # What Python's FMUs need is taken from here: a master's interpreter runs them.
            paths = [] if native else [sysconfig.get_paths()["purelib"], os.environ.get("PYTHONPATH", "")]
    variables = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    variables |= {"LD_LIBRARY_PATH": libraries} if libraries else {}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "rows.json")
        arguments = [str(ssp), repr(step), str(count), str(out), *given, *outputs]
        done = subprocess.run(
            [python, str(HERE / master.script), *arguments], env=variables, capture_output=True, text=True, cwd=folder
        )
        if done.returncode or not out.exists():
            raise RuntimeError(f"{name}: {(done.stderr or done.stdout).strip()[-500:]}")
        return np.array(json.loads(out.read_text("utf-8")))
