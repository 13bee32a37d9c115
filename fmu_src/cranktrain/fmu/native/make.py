"""Emit a kind's machine code for all platforms: ``python -m cranktrain.fmu.native.make KIND FOLDER``.

Run in a process of its own, whose kernels are compiled for the least processor that an FMU is to run on.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console
from rich.progress import track

from cranktrain.core.cache import cache_folder
from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel_name
from cranktrain.core.records import layout
from cranktrain.fmu.native.emit import PLATFORMS, call_module, entry_module, function_module, object_code
from cranktrain.fmu.native.exports import Exports, exports, functions

_ENTRY = "ct_"

_TABLE = """/* Made by cranktrain.fmu.native.make: what this library's kernels are. */
#include "kernels.h"

#include <stddef.h>

#ifdef _WIN32
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

{declarations}

static const void *const functions[] = {{{addresses}NULL}};
__attribute__((used)) static const char shim[] = CT_SHIM;
static const char *const names[] = {{{names}NULL}};

const struct ct_kernels ct_kernels = {{
    CT_DIGEST, {entries}, functions, {count}, names, "{layout}",
}};

EXPORTED const struct ct_kernels *ct_kernels_table(void);

const struct ct_kernels *ct_kernels_table(void)
{{
    return &ct_kernels;
}}
"""


def make(kind: str, folder: Path) -> None:
    """Write ``kind-PLATFORM.o`` for every platform, and last ``kind.c``, the table of what they export."""
    with _laws_beside(kind, folder) as laws:
        made = exports(kind)
        console = Console(stderr=True)
        pieces = list(_pieces(made))
        # The laws come last, when the other process is done with them.
        ordered = sorted(pieces, key=lambda piece: _is_law(piece.name))
        shown = track(ordered, f"{kind}: machine code", console=console, disable=not console.is_terminal)
        found = {piece.symbol: laws(piece) or piece.emit() for piece in shown}
    emitted = {piece.symbol: (found[piece.symbol], piece) for piece in pieces}
    texts = {symbol: text for symbol, ((text, _), _) in emitted.items()}
    for platform in PLATFORMS.values():
        _write(folder / f"{kind}-{platform.folder}.o", object_code(texts, platform))
    entries = [symbol for symbol in texts if not emitted[symbol][1].name]
    functions = {symbol: piece.name + kinds for symbol, ((_, kinds), piece) in emitted.items() if piece.name}
    declared = [f"extern ct_entry {name};" for name in entries] + [f"extern void {name}(void);" for name in functions]
    table = _TABLE.format(
        declarations="\n".join(declared),
        addresses="".join(f"(const void *){symbol}, " for symbol in functions),
        names="".join(f'"{name}", ' for name in functions.values()),
        entries=", ".join(entries),
        count=len(functions),
        layout=layout(made.run),
    )
    _write(folder / f"{kind}.c", table.encode())


def _is_law(name: str) -> bool:
    """Whether a function is a force law: half of the work, and nothing of what the other half compiles."""
    return name.startswith("cranktrain.film.")


@contextmanager
def _laws_beside(kind: str, folder: Path) -> Iterator[Callable[[_Piece], tuple[str, str] | None]]:
    """Emit the force laws in a process beside this one, where there is a processor for it; gives what it found."""
    path = folder / f"{kind}-laws.json"
    beside = None
    if (os.cpu_count() or 1) > 1 and any(map(_is_law, functions(kind))):
        run = [sys.executable, "-m", "cranktrain.fmu.native.make", kind, str(folder), "laws"]
        beside = subprocess.Popen(run, env=os.environ | {"CRANKTRAIN_CACHE": os.path.join(cache_folder(), "laws")})

    @cache
    def found() -> dict[str, list[str]]:
        done = beside is not None and beside.wait() == 0
        return json.loads(path.read_text(encoding="utf-8")) if done else {}

    def of(piece: _Piece) -> tuple[str, str] | None:
        made = found().get(piece.symbol) if _is_law(piece.name) else None
        return (made[0], made[1]) if made else None

    try:
        yield of
    finally:
        if beside is not None:
            beside.kill()
        path.unlink(missing_ok=True)


def emit_laws(kind: str, folder: Path) -> None:
    """Write ``kind-laws.json``: the texts of all force laws by their symbols."""
    found = {}
    for k, (name, row) in enumerate(functions(kind).items()):
        if _is_law(name):
            symbol = f"ct_function_{k}"
            found[symbol] = function_module(symbol, row.kernel, row.arguments(None)), ""
    _write(folder / f"{kind}-laws.json", json.dumps(found).encode())


class _Piece(NamedTuple):
    """One symbol of the library: what emits its text, with what its name in the table ends in; empty: an entry."""

    symbol: str
    name: str
    emit: Callable[[], tuple[str, str]]


def _pieces(made: Exports) -> Iterator[_Piece]:
    """All that a library exports: entries, functions by their numbers, calls."""
    for name, entry in made.entries.items():
        symbol = _ENTRY + name
        yield _Piece(symbol, "", partial(_without_kinds, entry_module, symbol, made.run, entry))
    for k, (name, row) in enumerate(made.functions.items()):
        arguments = row.arguments(made.run)
        emit = partial(_without_kinds, function_module, f"ct_function_{k}", row.kernel, arguments)
        yield _Piece(f"ct_function_{k}", f"{name}|{layout(arguments)}", emit)
    for k, (kernel, arguments) in enumerate(made.calls):
        emit = partial(call_module, f"ct_call_{k}", kernel, arguments)
        yield _Piece(f"ct_call_{k}", f"{kernel_name(kernel)}|{layout(arguments)}|", emit)


def _without_kinds(emit: Callable[..., str], *arguments: Any) -> tuple[str, str]:
    return emit(*arguments), ""


def _write(path: Path, data: bytes) -> None:
    temporary = path.with_suffix(f".{os.getpid()}")
    temporary.write_bytes(data)
    os.replace(temporary, path)


if __name__ == "__main__":
    try:
        (emit_laws if sys.argv[3:] else make)(sys.argv[1], Path(sys.argv[2]))
    except InputError as error:
        sys.exit(str(error))
    sys.stderr.flush()
    os._exit(0)  # what LLVM made is not taken apart
