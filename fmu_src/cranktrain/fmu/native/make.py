"""Emission of one share of the kernels: ``python -m cranktrain.fmu.native.make SHARE FOLDER``.

This runs in a process of its own, whose kernels are compiled for the oldest supported processor. The process ends when
its standard input closes, that is, with its parent.
"""

import faulthandler
import json
import os
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import track

from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import share_of
from cranktrain.core.records import layout
from cranktrain.core.visible_text import unfiltered
from cranktrain.fmu.native.emit import Emission
from cranktrain.fmu.native.exports import exports


def make(share: str, folder: Path) -> None:
    """Write a share's program, ``SHARE.bc``, then the list of its exports, ``SHARE.json``; see :mod:`.exported`."""
    with Emission(share, lambda name: share_of(name) == share) as emission:
        made = exports(share)
        entries = {f"ct_{name}": row for name, row in made.entries.items()}
        functions = {f"{share}_function_{k}": row for k, row in enumerate(made.functions.values())}
        steps: list[Callable[[], object]] = [
            partial(emission.entry, name, made.run, row) for name, row in entries.items()
        ]
        steps += [
            partial(emission.function, name, row.kernel, row.arguments(made.run)) for name, row in functions.items()
        ]
        steps += [partial(emission.python_calls, *call) for call in made.calls]
        console = Console(file=unfiltered(sys.stderr))
        shown = console.is_terminal and share == "stages"  # only one of the parallel shares shows its progress
        for step in track(steps, f"{share}: machine code", console=console, disable=not shown):
            step()
        _write(folder / f"{share}.bc", emission.program())
    given = {name: layout(row.arguments(made.run)) for name, row in made.functions.items()}
    names = [f"{name}|{arguments}" for name, arguments in given.items()]
    about = {
        "entries": list(entries),
        "functions": dict(zip(functions, names, strict=True)),
        "calls": emission.called,
        "layout": layout(made.run),
    }
    _write(folder / f"{share}.json", json.dumps(about).encode())


def _write(path: Path, data: bytes) -> None:
    temporary = path.with_suffix(f".{os.getpid()}")
    temporary.write_bytes(data)
    os.replace(temporary, path)


def _end_with_input() -> None:
    while os.read(0, 1):
        pass
    os._exit(1)


if __name__ == "__main__":
    faulthandler.enable()
    threading.Thread(target=_end_with_input, daemon=True).start()
    try:
        make(sys.argv[1], Path(sys.argv[2]))
    except InputError as error:
        sys.exit(str(error))
