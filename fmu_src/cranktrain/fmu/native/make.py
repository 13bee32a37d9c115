"""Emit a kind's kernels: ``python -m cranktrain.fmu.native.make KIND FOLDER``.

This runs in a process of its own, whose kernels are compiled for the oldest supported processor. A second process
compiles the force laws, a third of the work; they have hardly any kernel in common with the others. Each process ends
when its standard input closes, that is, with its parent.
"""

from __future__ import annotations

import faulthandler
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track

from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import RESTS_ON
from cranktrain.core.records import layout
from cranktrain.core.visible_text import unfiltered
from cranktrain.fmu.native.emit import Emission
from cranktrain.fmu.native.exports import exports, functions
from cranktrain.fmu.native.objects import FAST

_ENTRY = "ct_"

_TABLE = """/* Made by cranktrain.fmu.native.make: what this library's kernels are. */
#include "kernels.h"

#include <stddef.h>

#ifdef _WIN32
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

static const char names[] = {names};
{tables}
EXPORTED const struct ct_kernels *ct_kernels_table(int portable);

/* That of this processor, or the one of all. */
const struct ct_kernels *ct_kernels_table(int portable)
{{
    return portable ? &ct_kernels : ct_choose_kernels();
}}
"""

_TABLES = """
{declarations}

static const void *const {functions}[] = {{{addresses}NULL}};

const struct ct_kernels {table} = {{
    CT_DIGEST, {entries}, {functions}, {count}, names, "{layout}",
}};
"""


def make(kind: str, folder: Path) -> None:
    """Write the programs of a kind, ``kind-*.bc``, and last ``kind.c``, the table of exports."""
    with _laws_beside(kind, folder) as wait_for_laws, Emission() as emission:
        made = exports(kind)
        rows = made.entries.items()
        steps: list[Callable[[], None]] = [partial(emission.entry, _ENTRY + name, made.run, row) for name, row in rows]
        steps += _functions(emission, kind, made.run, laws=False)
        console = Console(file=unfiltered(sys.stderr))
        shown = console.is_terminal and kind == next(iter(RESTS_ON))  # the others are made beside it
        for step in track(steps, f"{kind}: machine code", console=console, disable=not shown):
            step()
        _write(folder / f"{kind}-run.bc", emission.program())
        wait_for_laws()
    given = {name: layout(row.arguments(made.run)) for name, row in made.functions.items()}
    names = {_symbol(k): f"{name}|{arguments}" for k, (name, arguments) in enumerate(given.items())}
    names |= emission.called
    entries = [_ENTRY + name for name in made.entries]
    tables = _tables("ct_kernels", "functions", entries, list(names), layout(made.run))
    fast = [f"{name}{FAST}" for name in (*entries, *names)]
    second = _tables("ct_fast_kernels", "fast_functions", fast[: len(entries)], fast[len(entries) :], layout(made.run))
    tables += f"\n#ifdef CT_FAST{second}#endif\n"
    lines = "".join(f'"{name}\\n" ' for name in names.values())
    table = _TABLE.format(names=lines or '""', tables=tables)
    _write(folder / f"{kind}.c", table.encode())


def _tables(table: str, functions: str, entries: list[str], symbols: list[str], of: str) -> str:
    """C's text of one ``struct ct_kernels`` and of what it names."""
    declared = [f"extern ct_entry {name};" for name in entries] + [f"extern void {name}(void);" for name in symbols]
    return _TABLES.format(
        declarations="\n".join(declared),
        functions=functions,
        addresses="".join(f"(const void *){symbol}, " for symbol in symbols),
        table=table,
        entries=", ".join(entries),
        count=len(symbols),
        layout=of,
    )


def make_laws(kind: str, folder: Path) -> None:
    """Write the programs of a kind's force laws, ``kind-laws``."""
    with Emission(exports_calls=False) as emission:
        for step in _functions(emission, kind, None, laws=True):
            step()
        _write(folder / f"{kind}-laws.bc", emission.program())


def _functions(emission: Emission, kind: str, run: Any, laws: bool) -> Iterable[Callable[[], None]]:
    """Steps that export the force laws of a kind, or all its other functions."""
    for k, (name, row) in enumerate(functions(kind).items()):
        if _is_law(name) == laws:
            yield partial(emission.function, _symbol(k), row.kernel, row.arguments(run))


def _symbol(k: int) -> str:
    return f"ct_function_{k}"


def _is_law(name: str) -> bool:
    return name.startswith("cranktrain.film.")


@contextmanager
def _laws_beside(kind: str, folder: Path) -> Iterator[Callable[[], None]]:
    """Emit a kind's force laws, if it has any, in a second process; returns a function that waits for it."""
    if not any(map(_is_law, functions(kind))):
        yield lambda: None
        return
    command = [sys.executable, "-m", "cranktrain.fmu.native.make", kind, str(folder), "laws"]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as beside:

        def wait() -> None:
            if beside.wait() != 0:
                raise InputError(f"{kind}: its force laws were not compiled; the lines above say why")

        yield wait


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
        (make_laws if sys.argv[3:] else make)(sys.argv[1], Path(sys.argv[2]))
    except InputError as error:
        sys.exit(str(error))
