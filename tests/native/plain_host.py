"""Hosts without Python, ``tests/data/native/host.c`` and ``host3.c``, and what they find in a native FMU."""

from __future__ import annotations

import subprocess
from pathlib import Path
from urllib.parse import quote

from fmpy import read_model_description
from mock_unit import DATA, SOURCES, WARNINGS, compiler


def plain_host(
    folder: Path, *options: str, command: tuple[str, ...] = (), suffix: str = "", name: str = "host"
) -> Path:
    """The host, compiled with further ``options``, by another compiler's ``command`` for another system.

    Its ``name`` is host3 for FMI 3.0.
    """
    path = folder / f"{name}{suffix}"
    flags = "-std=gnu11", "-O1", "-g", *WARNINGS, *options, "-I", str(SOURCES)
    libraries = ("-lm",) if suffix == ".exe" else ("-ldl", "-lpthread", "-lm")
    run = [*(command or (str(compiler()),)), *flags, str(DATA / f"{name}.c"), "-o", str(path), *libraries]
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
    return _said([*before, *map(str, (host, *place, *given))], variables)


def hosted3(host, binary, token, resources, references, outputs, what, items=(), before=(), step=1e-4, **variables):
    """The same of an FMU of FMI 3.0, of its Float64 outputs.

    ``references`` is one above the highest, ``outputs`` pairs of reference and size, ``items`` of reference and item.
    """
    sizes = ",".join(f"{reference}*{size}" for reference, size in outputs)
    given = binary, token, resources, references, sizes, step, *what, *(f"{one}={item}" for one, item in items)
    return _said([*before, *map(str, (host, *given))], variables)


def _said(command, variables):
    done = subprocess.run(command, capture_output=True, text=True, env=variables, timeout=1800)
    assert done.returncode == 0, done.stderr[-3000:]
    return [float.fromhex(line).hex() for line in done.stdout.split()], done.stderr
