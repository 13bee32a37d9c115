"""Virtual environments of other programs, and children in them that run a turn each time they are asked."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

from cranktrain.core.cache import private_folder

HERE = Path(__file__).resolve().parent
MARK = "TURN "
"""Begins the lines by which a child answers; programs print much else."""
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}


class Absent(Exception):
    """A program that cannot be had on this machine, or breaks down, and why."""


class Program(NamedTuple):
    """What pip installs, the first being the program itself, the script that runs it, and the Python that it needs."""

    packages: tuple[str, ...]
    script: str
    python: tuple[int, int] = (3, 11)


def interpreter(wanted: tuple[int, int]) -> str:
    """A Python of at least this version; :class:`Absent` where there is none."""
    if sys.version_info[:2] >= wanted:
        return sys.executable
    name = f"python{wanted[0]}.{wanted[1]}"
    kept = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    for found in (shutil.which(name), *map(str, sorted(kept.glob(f"{wanted[0]}.{wanted[1]}.*/bin/{name}")))):
        if found and subprocess.run([found, "-c", ""], capture_output=True, check=False).returncode == 0:
            return found
    raise Absent(f"needs Python {wanted[0]}.{wanted[1]}, which is not here")


def environment(program: Program) -> str:
    """Python of a program's environment, made at first use and kept in the cache; :class:`Absent`."""
    base = interpreter(program.python)
    digest = sha256(" ".join((*program.packages, base)).encode()).hexdigest()[:12]
    folder = private_folder("peers") / f"{program.packages[0].partition('=')[0]}-{digest}"
    python, done = str(folder / "bin" / "python"), folder / "installed"
    if not done.is_file():
        print(f"peers: installing {' '.join(program.packages)}", file=sys.stderr, flush=True)
        pip = [python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *program.packages]
        for words in ([base, "-m", "venv", str(folder)], pip):
            run = subprocess.run(words, capture_output=True, text=True, env=_variables(), check=False)
            if run.returncode:
                said = [line for line in run.stderr.splitlines() if line.strip() and "WARNING" not in line]
                raise Absent(f"cannot be installed: {said[-1] if said else f'pip ended with {run.returncode}'}")
        done.touch()
    return python


def _variables() -> dict[str, str]:
    left_out = ("PYTHONPATH", "VIRTUAL_ENV")
    return {key: value for key, value in os.environ.items() if key not in left_out} | ONE_THREAD


class Child:
    """A running program that answers one JSON object a request."""

    def __init__(self, process: subprocess.Popen[str], name: str) -> None:
        self._process, self._name = process, name
        self.about = self._answer()

    def turn(self, **request: Any) -> dict[str, Any]:
        """Answer to a request; :class:`Absent` where the program ends instead."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith(MARK):
                return dict(json.loads(line[len(MARK) :]))
        raise Absent(f"{self._name} ended with {self._process.wait()} in the midst of its work")


@contextmanager
def child(program: Program, job: Path) -> Iterator[Child]:
    """The program's script at a job file, a NumPy archive; it says its version first."""
    words: Sequence[str] = [environment(program), str(HERE / program.script), str(job)]
    pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(words, env=_variables(), **pipes) as process:
        try:
            yield Child(process, program.packages[0])
        finally:
            assert process.stdin is not None
            process.stdin.close()
