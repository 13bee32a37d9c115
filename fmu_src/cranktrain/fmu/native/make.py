"""Emit a kind's machine code for all platforms: ``python -m cranktrain.fmu.native.make KIND FOLDER``.

Run in a process of its own, whose kernels are compiled for the least processor that an FMU is to run on.
"""

from __future__ import annotations

import os
import sys
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import track

from cranktrain.core.records import layout
from cranktrain.fmu.native.emit import PLATFORMS, entry_module, function_module, object_code
from cranktrain.fmu.native.exports import exports

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
    made = exports(kind)
    entries = {
        f"ct_{name}": partial(entry_module, f"ct_{name}", made.run, kernel) for name, kernel in made.entries.items()
    }
    functions = {
        f"ct_function_{k}": partial(function_module, f"ct_function_{k}", row.kernel, row.arguments(made.run))
        for k, row in enumerate(made.functions.values())
    }
    work = [*entries.items(), *functions.items()]
    shown = track(work, f"{kind}: machine code", console=Console(stderr=True), disable=not sys.stderr.isatty())
    texts = {symbol: emit() for symbol, emit in shown}
    for platform in PLATFORMS.values():
        _write(folder / f"{kind}-{platform.folder}.o", object_code(texts, platform))
    declarations = [f"ct_entry {name};" for name in entries] + [f"void {name}(void);" for name in functions]
    table = _TABLE.format(
        declarations="\n".join(f"extern {line}" for line in declarations),
        addresses="".join(f"(const void *){symbol}, " for symbol in functions),
        names="".join(f'"{name}", ' for name in made.functions),
        entries=", ".join(entries),
        count=len(functions),
        layout=layout(made.run),
    )
    _write(folder / f"{kind}.c", table.encode())


def _write(path: Path, data: bytes) -> None:
    temporary = path.with_suffix(f".{os.getpid()}")
    temporary.write_bytes(data)
    os.replace(temporary, path)


if __name__ == "__main__":
    make(sys.argv[1], Path(sys.argv[2]))
