"""Install a wheel into an empty environment and run it there: ``python tests/installed_wheel.py dist/*.whl``.

The environment is of the Python that runs this file, with all that the wheel depends on. There is no compiler on its
path and nothing in its caches. Prints JSON: how long the installation, the first run and the first FMU took, and what
was compiled; ends with 1 where anything was, or where the FMU holds no binary of this machine.

Standard library only, nothing of the repository: any Python can run it.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

RUN = """
import sys
from cranktrain.cli.main import main
code = main("simulate diesel_i6 --speed 2000 --cycles 2 --crank beam --output run.h5".split())
sys.exit(code or 3 * ("numba" in sys.modules))
"""
FMU = "import cranktrain as ct; print(ct.build_fmu('{model}', 'dist'))"
WHERE = "import cranktrain as ct; print(ct.__version__, ct.__file__)"


class Environment:
    """A virtual environment in a folder, with empty caches, and no program on its path but its own.

    Parameters
    ----------
    folder : empty
    python : makes it
    """

    def __init__(self, folder: Path, python: str) -> None:
        self.folder = folder
        programs = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
        self.python = programs / ("python.exe" if os.name == "nt" else "python")
        left_out = "PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "CC", "CRANKTRAIN_NO_MACHINE_CODE", "NUMBA_CACHE_DIR"
        left_out += ("PYTHONDONTWRITEBYTECODE",)
        plain = {name: value for name, value in os.environ.items() if name not in left_out}
        self.around = {**plain, "CRANKTRAIN_CACHE": str(folder / "cache"), "XDG_CACHE_HOME": str(folder / "other")}
        subprocess.run([python, "-m", "venv", str(folder / "venv")], check=True, env=self.around)
        self._alone = {**self.around, "PATH": str(programs)}

    def install(self, wheel: Path, *options: str) -> float:
        """Install a wheel; seconds."""
        began = time.perf_counter()
        quiet = "--disable-pip-version-check", "-q"
        subprocess.run(
            [str(self.python), "-m", "pip", "install", *quiet, *options, str(wheel)], check=True, env=self.around
        )
        return time.perf_counter() - began

    def run(self, text: str) -> tuple[str, dict[str, float]]:
        """What a Python text prints, without any other program on the path; its seconds and processor seconds."""
        began, used = time.perf_counter(), processor_seconds()
        done = subprocess.run(
            [str(self.python), "-c", text], cwd=self.folder, env=self._alone, stdout=subprocess.PIPE, text=True
        )
        if done.returncode:
            raise SystemExit(f"exit code {done.returncode} of{text}")
        seconds = {"wall": time.perf_counter() - began, "processor": processor_seconds() - used}
        return done.stdout, {name: round(value, 1) for name, value in seconds.items()}

    def compiled(self) -> list[str]:
        """Kernels and libraries that were compiled since the environment was made."""
        cache = self.folder / "cache"
        places = [*cache.rglob("*.nb?"), *cache.rglob("programs"), *(self.folder / "venv").rglob("cranktrain/**/*.nb?")]
        return [str(place.relative_to(self.folder)) for place in places]


def processor_seconds() -> float:
    """Of all processes that have ended below this one."""
    spent = os.times()
    return spent.children_user + spent.children_system


def binaries(fmu: Path) -> list[str]:
    """Folders of binaries in an FMU."""
    names = zipfile.ZipFile(fmu).namelist()
    return sorted({name.split("/")[1] for name in names if name.startswith("binaries/")})


def tried(wheel: Path, folder: Path, model: str) -> dict[str, object]:
    """Install, run and build, in a folder."""
    environment = Environment(folder, sys.executable)
    seconds: dict[str, object] = {"install": round(environment.install(wheel), 1)}
    where, seconds["first_import"] = environment.run(WHERE)
    _, seconds["first_run"] = environment.run(RUN)
    _, seconds["second_run"] = environment.run(RUN)
    out, seconds["first_fmu"] = environment.run(FMU.format(model=model))
    return {
        "wheel": wheel.name, "python": sys.version.split()[0], "platform": sys.platform, "installed": where.strip(),
        "seconds": seconds,
        "binaries": binaries(folder / out.split()[-1]), "compiled": environment.compiled(),
    }  # fmt: skip


def main() -> int:
    """Try the wheel, print what was found; 1 where something compiled, or the FMU has no binary."""
    parser = argparse.ArgumentParser(description="Install a wheel into an empty environment and run it there.")
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--fmu", default="diesel_i6", help="model whose FMU is built (default: diesel_i6)")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="cranktrain_wheel_", ignore_cleanup_errors=True) as folder:
        found = tried(chosen.wheel.resolve(), Path(folder), chosen.fmu)
    print(json.dumps(found, indent=2))
    return int(bool(found["compiled"]) or not found["binaries"])


if __name__ == "__main__":
    sys.exit(main())
