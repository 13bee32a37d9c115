"""Generator of the page of all engine file keys: ``python docs/engine_keys_page.py docs/engine_keys.md``.

The page is made from the declarations that the reader uses, so page and reader agree; a test compares them.
"""

import inspect
import re
import sys
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from cranktrain.engine.additions import TABLES, TEXTS
from cranktrain.engine.connections import DATA
from cranktrain.engine.entries import described
from cranktrain.engine.file import engine_parts
from cranktrain.engine.model import Engine, optional_fields
from cranktrain.engine.quantities import kinds
from cranktrain.engine.torsional_chain import LISTS, Disc, Shaft, key_rule, row_keys

HEAD = """\
# Keys of an engine file

All tables with their keys, as the reader takes them. An entry states value, unit, origin and a note
([describe your own engine](how-to/own_engine.md)); units other than the one named are read too. *Needed* says which
keys a table must have where it is there; *by kind* marks keys that another value of the table makes necessary, and all
that lack are named in one refusal. Arrays of tables (`[[body]]`, `[[frame]]`, `[[connection]]`) follow the tables, see
[added bodies](how-to/added_bodies.md), and `[[mount_dynamics]]`, see [mounts](how-to/mounts.md); their keys of kind
*text* are written without unit and origin. Last come the rows of a table of discs and shafts, a file of its own
([drive line](how-to/drive_line.md)), whose keys are plain numbers in SI.

"""
TAIL = "This page is made by `python docs/engine_keys_page.py docs/engine_keys.md`.\n"
CASES: tuple[dict[str, Any], ...] = (
    {},
    *({"kind": one, "joint": one} for one in ("viscous", "rubber", "power", "torque", "propeller", "spline")),
    {"motion": "rod"},
    {"small_end": "impedance"},
    {"stations": (0.0,), "along": "y", "areas": (1.0,), "discs": ("a",)},
    {"stations": (0.0,)},
)
"""Values of keys that make further keys necessary."""
OF_ROWS = {
    Disc: "A disc of a torsional crank or of a drive line.",
    Shaft: "A shaft, or a rigid mesh of gears where it has no stiffness. Keys by kind: those of a table over torque, "
    "twist or frequency.",
}


def page() -> str:
    """Text of the page, required tables first."""
    optional = optional_fields(Engine)
    order = sorted(engine_parts().items(), key=lambda item: item[0] in optional)
    parts = [_table(f"[{name}]", part, name in optional) for name, part in order]
    for name, part in TABLES.items():
        if name == "connection":
            parts += [_table(f"[[{name}]] of law {law}", data, True, part) for law, data in DATA.items()]
        else:
            parts.append(_table(f"[[{name}]]", part, True))
    return HEAD + "".join(parts) + _rows("[[disc]]", Disc) + _rows("[[shaft]]", Shaft) + TAIL


def _table(head: str, part: type, optional: bool, around: type | None = None) -> str:
    """Section of the page for one table; ``around`` is the class of keys that all connections have."""
    about = re.sub(r":\w+:`([^`]*)`", r"`\1`", inspect.cleandoc(part.__doc__ or "").replace("``", "`"))
    about = re.sub(r"\nAttributes\n-+\n", "\n", re.sub(r"^(\w[\w, ]*) : ", r"* `\1`: ", about, flags=re.MULTILINE))
    lines = [f"## {head}{', optional' if optional else ''}", "", about, ""]
    lines += ["| key | value | needed |", "| --- | --- | --- |"]
    by_kind = conditional(part)
    own = [(part, entry) for entry in fields(part)]
    own = [(around, entry) for entry in fields(around) if entry.name not in ("law", *DATA)] + own if around else own
    for kind, entry in own:
        _, many, rule = kinds(kind)[entry.name]
        needed = "yes" if entry.default is MISSING else "by kind" if entry.name in by_kind else "no"
        plain = any(kind is table and entry.name in TEXTS[name] for name, table in TABLES.items())
        text = described(rule, many).removesuffix("; check its unit")
        if plain:
            text = f"{'list of: ' * many}text" + (f": {', '.join(rule.names)}" if rule is not None else "")
        lines.append(f"| `{entry.name}` | {text} | {needed} |")
    return "\n".join(lines) + "\n\n"


def conditional(part: type) -> set[str]:
    """Optional keys of a part that certain values of other keys make necessary."""
    needed: Any = getattr(part, "needed", None)
    return set() if needed is None else {key for case in CASES for key in needed(case.get).keys}


def _rows(head: str, kind: type) -> str:
    """Section of the page for rows of discs or shafts, whose keys are plain numbers or lists of numbers."""
    lines = [f"## {head}", "", OF_ROWS[kind], "", "| key | value | needed |", "| --- | --- | --- |"]
    for key in row_keys(kind):
        text = {"name": "text", "between": "list of: text, two discs"}.get(key) or described(key_rule(kind, key), False)
        lists = kind is Shaft and key in LISTS
        needed = "yes" if key in ("name", "inertia", "between") else "by kind" if lists or key == "frequency" else "no"
        lines.append(f"| `{key}` | {text.removesuffix('; check its unit')}{', or a list' * lists} | {needed} |")
    return "\n".join(lines) + "\n\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8")
