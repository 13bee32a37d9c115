"""Our FMUs in other people's clients: ``python benchmarks/clients.py [FILE.fmu …]``.

Each client is installed by pip into an environment of its own in the cache, once, and runs each FMU at its start
values; what it finds is compared with FMPy. Without files the FMUs of all shipped modules are built, and the six's
cranktrain without film tables and block, each as Python's and as a native one, which is run in an environment without
numba; and the native ones of FMI 3.0, in the clients that read it. Prints one JSON object: by FMU and client the
largest difference of outputs from FMPy's, relative to the value or to 1e-9 of its nominal one, or why there is none;
and what ``fmutool -check`` says.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from fmpy import read_model_description
from fmpy.model_description import ScalarVariable

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks._clients import CLIENTS, CLIENTS_3, ONE_VALUE_EACH, REFERENCE, Client  # noqa: E402

from cranktrain.core.cache import private_folder  # noqa: E402
from cranktrain.fmu.build import build_fmu  # noqa: E402
from cranktrain.modules.register import module_files  # noqa: E402

STEPS, STEP = 100, 1.0e-4
"""Communication steps, and their length, s."""
TOOLBOX = Client(("fmu-manipulation-toolbox==2.0",), "")
ROUNDING = "balance.", "solver."
"""Outputs that are rounding errors or counts, which times that differ in their last digit change."""


class ClientError(Exception):
    """A client that cannot be installed, or does not run to the end; says what it said last."""


def environment(client: Client, native: bool = False) -> Path:
    """Folder of a client's virtual environment, made at first use; ``ClientError``. A native FMU is given no numba."""
    needed = () if native else ("numpy", _numba())
    digest = hashlib.sha256(" ".join((*client.packages, sys.version, "" if needed else "native")).encode()).hexdigest()[
        :12
    ]
    folder = private_folder("clients") / f"{client.packages[0].partition('=')[0]}-{digest}"
    done = folder / "installed"
    if not done.is_file():
        pip = [str(folder / "bin" / "python"), "-m", "pip", "install", "-q", "--disable-pip-version-check"]
        for words in ([sys.executable, "-m", "venv", str(folder)], [*pip, *needed, *client.packages]):
            _run(words, {})
        done.touch()
    return folder


def _numba() -> str:
    """The numba that runs here: kernels that it compiled are found again."""
    import numba

    return f"numba=={numba.__version__}"


def _run(words: Sequence[str], more: dict[str, str]) -> str:
    """Output of a command; ``ClientError`` with the last line that it said where it fails."""
    left_out = ("PYTHONPATH", "VIRTUAL_ENV")
    variables = {key: value for key, value in os.environ.items() if key not in left_out} | more
    done = subprocess.run(words, capture_output=True, text=True, env=variables, timeout=3600, check=False)
    if done.returncode != 0:
        lines = [line.strip() for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        raise ClientError(lines[-1] if lines else f"ended with {done.returncode}")
    return done.stdout


class Job:
    """One run of an FMU at its start values, the same for every client; without ``arrays`` of its scalars alone."""

    def __init__(self, fmu: Path, steps: int = STEPS, step: float = STEP, arrays: bool = True) -> None:
        about = read_model_description(str(fmu))
        variables, self.native = about.modelVariables, not about.coSimulation.needsExecutionTool
        outputs = [v for v in variables if v.causality == "output" and v.type != "Clock"]
        outputs = [v for v in outputs if not v.name.startswith(ROUNDING)]
        outputs = [v for v in outputs if arrays or not v.shape]
        self.nominal = [float(v.nominal or 1.0) for v in outputs for _ in range(math.prod(v.shape))]
        self.given = {
            "fmu": str(fmu),
            "steps": steps,
            "step": step,
            "outputs": [v.name for v in outputs],
            "references": [v.valueReference for v in outputs],
            "starts": {v.name: _numbers(v) for v in variables if v.causality == "input"},
        }
        self._expected: list[float] | None = None

    def values(self, script: str, python: str = sys.executable, more: dict[str, str] | None = None) -> list[float]:
        """What a script finds; ``ClientError``."""
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "job.json"
            file.write_text(json.dumps(self.given))
            said = _run([python, "-c", script, str(file)], {"OMP_NUM_THREADS": "1", **(more or {})})
        return list(map(float, json.loads(said.partition("VALUES ")[2].splitlines()[0])))

    @property
    def expected(self) -> list[float]:
        """What FMPy finds."""
        if self._expected is None:
            self._expected = self.values(Client((), REFERENCE).script)
        return self._expected


def _numbers(variable: ScalarVariable) -> float | list[float]:
    """Start value of an input, or values of an array."""
    found = [float(word) for word in str(variable.start).split()]
    return found * (math.prod(variable.shape) // len(found)) if variable.shape else found[0]


def clients_of(fmu: Path) -> dict[str, Client]:
    """Clients that read the FMU's version of FMI, by name."""
    return {**CLIENTS_3, **ONE_VALUE_EACH} if read_model_description(str(fmu)).fmiVersion == "3.0" else CLIENTS


def difference(client: Client, job: Job) -> float:
    """Largest difference of a client's outputs from FMPy's, relative; ``ClientError``."""
    folder = environment(client, job.native)
    more = {"LD_LIBRARY_PATH": str(folder / "lib")} if client.libraries else {}
    found = job.values(client.script, str(folder / "bin" / "python"), more)
    pairs = zip(found, job.expected, job.nominal, strict=True)
    return max(abs(value - own) / max(abs(own), 1e-9 * nominal) for value, own, nominal in pairs)


def checked(fmu: Path) -> list[str]:
    """What ``fmutool -check`` finds wrong, or why it could not."""
    try:
        said = _run([str(environment(TOOLBOX) / "bin" / "fmutool"), "-input", str(fmu), "-check"], {})
    except ClientError as error:
        return [str(error)]
    wrong = [line for line in said.splitlines() if not line.startswith("INFO")]
    return wrong if wrong or "This FMU seems to be compliant" in said else [said]


def main(*words: str) -> int:
    """Print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE.fmu", help="FMUs (default: all shipped modules)")
    paths: list[Path] = parser.parse_args(words).files
    found: dict[str, dict[str, object]] = {}
    with tempfile.TemporaryDirectory() as folder:
        if not paths:
            say = lambda text: print(text, file=sys.stderr, flush=True)  # noqa: E731
            native = ("linux64",)
            for kind, platforms, fmi in (("python", (), "2.0"), ("native", native, "2.0"), ("fmi3", native, "3.0")):
                place = Path(folder, kind)
                options = {"platforms": platforms, "fmi": fmi, "say": say}
                paths += [build_fmu("diesel_i6", place, film_table=False, block=False, **options)]
                paths += [build_fmu(name, place, **options) for name in module_files()]
        for path in paths:
            there = clients_of(path)
            jobs = {arrays: Job(path, arrays=arrays or there is CLIENTS) for arrays in (False, True)}
            row: dict[str, object] = {"fmutool": checked(path)}
            for name, client in there.items():
                print(f"clients: {path.name} of {path.parent.name} in {name}", file=sys.stderr, flush=True)
                try:
                    row[name] = difference(client, jobs[client.arrays])
                except ClientError as error:
                    row[name] = str(error)
            found[f"{path.parent.name}/{path.name}"] = row
    print(json.dumps(found, indent=2))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
