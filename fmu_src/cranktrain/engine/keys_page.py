"""The page of all keys of an engine file: ``python -m cranktrain.engine.keys_page docs/engine_keys.md``.

It is made from the declarations that the reader takes, so page and reader agree; a test compares them.
"""

from __future__ import annotations

import inspect
import re
import sys
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from cranktrain.engine.entries import described
from cranktrain.engine.file import engine_parts
from cranktrain.engine.model import Engine, optional_fields
from cranktrain.engine.quantities import kinds

HEAD = """\
# Keys of an engine file

All tables with their keys, as the reader takes them. An entry states value, unit, origin and a note
([describe your own engine](how-to/own_engine.md)); units other than the one named are read too. *Needed* says which
keys a table must have where it is there; *by kind* marks keys that another value of the table makes necessary, and all
that lack are named in one refusal. Arrays of tables (`[[body]]`, `[[frame]]`, `[[connection]]`) are described in
[added bodies](how-to/added_bodies.md).

"""
TAIL = "This page is made by `python -m cranktrain.engine.keys_page docs/engine_keys.md`.\n"
CONDITIONS = ("viscous", "rubber", "power", "torque", "propeller", "spline")
"""Values of the keys ``kind`` and ``joint`` by which further keys become necessary."""


def page() -> str:
    """Text of the page: needed tables first."""
    optional = optional_fields(Engine)
    order = sorted(engine_parts().items(), key=lambda item: item[0] in optional)
    return HEAD + "".join(_table(name, part, name in optional) for name, part in order) + TAIL


def _table(name: str, part: type, optional: bool) -> str:
    about = re.sub(r":\w+:`([^`]*)`", r"`\1`", inspect.cleandoc(part.__doc__ or "").replace("``", "`"))
    lines = [f"## [{name}]{', optional' if optional else ''}", "", about, ""]
    lines += ["| key | value | needed |", "| --- | --- | --- |"]
    by_kind = conditional(part)
    for entry in fields(part):
        _, many, rule = kinds(part)[entry.name]
        needed = "yes" if entry.default is MISSING else "by kind" if entry.name in by_kind else "no"
        text = described(rule, many).removesuffix("; check its unit")
        lines.append(f"| `{entry.name}` | {text} | {needed} |")
    return "\n".join(lines) + "\n\n"


def conditional(part: type) -> set[str]:
    """Optional keys of a part that some value of another key makes necessary."""
    needed: Any = getattr(part, "needed", None)
    if needed is None:
        return set()
    return {
        key
        for one in CONDITIONS
        for key in needed(lambda name, one=one: one if name in ("kind", "joint") else None).keys
    }


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8")
