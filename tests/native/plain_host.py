"""A host without Python, ``tests/data/native/host.c``, and what it finds in a native FMU."""

from __future__ import annotations

import subprocess
from pathlib import Path
from urllib.parse import quote

from fmpy import read_model_description
from mock_unit import DATA, SOURCES, WARNINGS, compiler


def plain_host(folder: Path, *options: str, command: tuple[str, ...] = (), suffix: str = "") -> Path:
    """The host, compiled with further ``options``, by another compiler's ``command`` for another system."""
    path = folder / f"host{suffix}"
    flags = "-std=gnu11", "-O1", "-g", *WARNINGS, *options, "-I", str(SOURCES)
    libraries = ("-lm",) if suffix == ".exe" else ("-ldl", "-lpthread", "-lm")
    run = [*(command or (str(compiler()),)), *flags, str(DATA / "host.c"), "-o", str(path), *libraries]
    subprocess.run(run, check=True)
    return path


def hosted(host, unpacked, *what, texts=(), before=(), binary=None, step=1e-4, **variables):
    """Values of all Real outputs as hexadecimal texts, and the host's log.

    ``unpacked`` is the FMU's folder, ``what`` is run, threads or fuzz, with count and seed; ``texts`` are String
    parameters, "REFERENCE=TEXT"; ``before`` a command that runs the host, such as valgrind; ``variables`` are
    those of its environment, which is empty otherwise.
    """
    about = read_model_description(str(unpacked))
    outputs = [v.valueReference for v in about.modelVariables if v.causality == "output" and v.type == "Real"]
    assert outputs == list(range(outputs[0], outputs[-1] + 1))
    if binary is None:
        binary = unpacked / "binaries" / "linux64" / f"{about.coSimulation.modelIdentifier}.so"
    drive = "/Z:" if Path(binary).suffix == ".dll" else ""  # what Wine calls this machine's root
    place = binary, about.guid, f"file://{drive}{quote(str(unpacked / 'resources'))}"
    given = len(about.modelVariables), outputs[0], outputs[-1], step, *what, *texts
    command = [*before, *map(str, (host, *place, *given))]
    done = subprocess.run(command, capture_output=True, text=True, env=variables, timeout=1800)
    assert done.returncode == 0, done.stderr[-3000:]
    return [float.fromhex(line).hex() for line in done.stdout.split()], done.stderr
