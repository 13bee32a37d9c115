"""Emit a kind's kernels: ``python -m cranktrain.fmu.native.make KIND FOLDER``.

This runs in a process of its own, whose kernels are compiled for the oldest supported processor. The process ends when
its standard input closes, that is, with its parent.
"""

from __future__ import annotations

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
from cranktrain.core.machine_code import RESTS_ON
from cranktrain.core.records import layout
from cranktrain.core.visible_text import unfiltered
from cranktrain.fmu.native.emit import Emission
from cranktrain.fmu.native.exports import exports


def make(kind: str, folder: Path) -> None:
    """Write a kind's program, ``KIND.bc``, and last what it exports, ``KIND.json``; see :mod:`.exported`."""
    with Emission(kind) as emission:
        made = exports(kind)
        entries = {f"ct_{name}": row for name, row in made.entries.items()}
        functions = {f"{kind}_function_{k}": row for k, row in enumerate(made.functions.values())}
        steps: list[Callable[[], None]] = [
            partial(emission.entry, name, made.run, row) for name, row in entries.items()
        ]
        steps += [
            partial(emission.function, name, row.kernel, row.arguments(made.run)) for name, row in functions.items()
        ]
        console = Console(file=unfiltered(sys.stderr))
        shown = console.is_terminal and kind == next(iter(RESTS_ON))  # the others are made beside it
        for step in track(steps, f"{kind}: machine code", console=console, disable=not shown):
            step()
        _write(folder / f"{kind}.bc", emission.program())
    given = {name: layout(row.arguments(made.run)) for name, row in made.functions.items()}
    names = [f"{name}|{arguments}" for name, arguments in given.items()]
    about = {
        "entries": list(entries),
        "functions": dict(zip(functions, names, strict=True)),
        "calls": emission.called,
        "layout": layout(made.run),
    }
    _write(folder / f"{kind}.json", json.dumps(about).encode())


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
