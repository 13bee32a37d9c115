"""A host without Python, ``tests/data/native/host.c``, and what it finds in a native FMU."""

from __future__ import annotations

import subprocess
from pathlib import Path

from fmpy import read_model_description
from mock_unit import DATA, SOURCES, WARNINGS, compiler


def plain_host(folder: Path, *options: str) -> Path:
    """The host, compiled with further ``options``."""
    path = folder / "host"
    flags = "-std=gnu11", "-O1", "-g", *WARNINGS, *options, "-I", str(SOURCES)
    libraries = "-ldl", "-lpthread", "-lm"
    subprocess.run([str(compiler()), *flags, str(DATA / "host.c"), "-o", str(path), *libraries], check=True)
    return path


def hosted(host, unpacked, *what, texts=(), before=(), binary=None, step=1e-4):
    """Values of all Real outputs as hexadecimal texts, and the host's log.

    ``unpacked`` is the FMU's folder, ``what`` is run, threads or fuzz, with count and seed; ``texts`` are String
    parameters, "REFERENCE=TEXT"; ``before`` a command that runs the host, such as valgrind.
    """
    about = read_model_description(str(unpacked))
    outputs = [v.valueReference for v in about.modelVariables if v.causality == "output" and v.type == "Real"]
    assert outputs == list(range(outputs[0], outputs[-1] + 1))
    if binary is None:
        binary = unpacked / "binaries" / "linux64" / f"{about.coSimulation.modelIdentifier}.so"
    place = binary, about.guid, (unpacked / "resources").as_uri()
    given = len(about.modelVariables), outputs[0], outputs[-1], step, *what, *texts
    command = [*before, *map(str, (host, *place, *given))]
    done = subprocess.run(command, capture_output=True, text=True, env={}, timeout=600)
    assert done.returncode == 0, done.stderr[-3000:]
    return [float.fromhex(line).hex() for line in done.stdout.split()], done.stderr
