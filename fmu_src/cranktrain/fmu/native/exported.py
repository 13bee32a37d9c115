"""C text that lists a library's kernels: ``struct ct_kernels`` of ``c/kernels.h``, from its parts (shares).

The emission of a share writes ``SHARE.json``: symbols of entries; symbols of functions with ``name|layout``, the layout
of the arguments; symbols of kernels that Python calls with ``name|layout|kinds of the results``; the layout of its run.
"""

import json
from collections.abc import Sequence
from pathlib import Path

from cranktrain.core.machine_code import ENTRIES
from cranktrain.fmu.native.objects import FAST

_TEXT = """/* Made by cranktrain.fmu.native.exported: what this library's kernels are. */
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

_TABLE = """
{declarations}

static const void *const {functions}[] = {{{addresses}NULL}};

const struct ct_kernels {table} = {{
    CT_DIGEST, {entries}, {functions}, {count}, names, "{layout}",
}};
"""


def exported_text(shares: Sequence[Path]) -> str:
    """C text that lists all exported kernels, from the JSON files of the shares; the layout is the first share's."""
    about = [json.loads(path.read_text("utf-8")) for path in shares]
    entries, layout = [name for one in about for name in one["entries"]], about[0]["layout"]
    # Functions of all shares get the first numbers, because data files refer to functions by number.
    named = {symbol: name for part in ("functions", "calls") for one in about for symbol, name in one[part].items()}
    tables = _table("ct_kernels", "functions", entries, list(named), layout)
    second = _table("ct_fast_kernels", "fast_functions", entries, list(named), layout, FAST)
    names = "".join(f'"{name}\\n" ' for name in named.values())
    return _TEXT.format(names=names or '""', tables=f"{tables}\n#ifdef CT_FAST{second}#endif\n")


def _table(table: str, functions: str, entries: list[str], symbols: list[str], layout: str, end: str = "") -> str:
    """C text of one ``struct ct_kernels`` and of the symbols in it, with ``end`` at the end of each name."""
    declared = [f"extern ct_entry {name}{end};" for name in entries]
    declared += [f"extern void {name}{end}(void);" for name in symbols]
    given = (f"{name}{end}" if name in entries else "NULL" for name in map("ct_{}".format, ENTRIES))
    return _TABLE.format(
        declarations="\n".join(declared),
        functions=functions,
        addresses="".join(f"(const void *){symbol}{end}, " for symbol in symbols),
        table=table,
        entries=", ".join(given),
        count=len(symbols),
        layout=layout,
    )
