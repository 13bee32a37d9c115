"""How large native FMUs are and how soon they are built: ``python benchmarks/native_build.py [NAME …]``.

Each is built twice by ``build_fmu.py`` in a process of its own, for this machine's platform: the first build makes
bodies and tables that the cache has not yet, the second is measured. Engines are also built without film tables. Prints
one JSON object by FMU: its file, numbers of variables, megabytes of FMU, binary and data, seconds of the second build,
wall and processor.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
import zipfile
from collections import Counter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from cranktrain.engine.file import load_engine
from cranktrain.modules.register import module_files

ROOT = Path(__file__).resolve().parents[1]
ENGINES = "diesel_i6", "diesel_v8"


def built(name: str, folder: Path, *options: str) -> dict[str, Any]:
    """Figures of one FMU."""
    command = [sys.executable, str(ROOT / "build_fmu.py"), name, "-o", str(folder), *options]
    for _ in range(2):
        wall, processor = time.perf_counter(), _processor_seconds()
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        wall, processor = time.perf_counter() - wall, _processor_seconds() - processor
    path = Path(done.stdout.split("\n")[-2])
    with zipfile.ZipFile(path) as archive:
        sizes = {entry.filename: 1e-6 * entry.file_size for entry in archive.infolist()}
        variables = ElementTree.fromstring(archive.read("modelDescription.xml")).iter("ScalarVariable")
    causalities = Counter(variable.get("causality") for variable in variables)
    return {
        "file": path.name,
        **{f"{cause}s": causalities[cause] for cause in ("input", "output", "parameter")},
        "megabytes": round(1e-6 * path.stat().st_size, 2),
        "binary_megabytes": round(max(size for file, size in sizes.items() if file.startswith("binaries/")), 2),
        "data_megabytes": round(sizes["resources/native.bin"], 2),
        "seconds": round(wall, 1),
        "processor_seconds": round(processor, 1),
    }


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main(*names: str) -> int:
    """Build and print."""
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in names or (*ENGINES, *module_files()):
            print(f"native build: {name}", file=sys.stderr, flush=True)
            result[name] = built(name, Path(folder, "whole"), *(("--levels", "all") if name in ENGINES else ()))
            if name in ENGINES and load_engine(name).main_roller is None:
                result[f"{name} --no-film-table"] = built(name, Path(folder, "small"), "--no-film-table")
    print(json.dumps(result, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
