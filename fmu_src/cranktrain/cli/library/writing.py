"""Source of the library's functions, written from the options of the verbs."""

from __future__ import annotations

import textwrap
from pathlib import Path

import cranktrain
from cranktrain.cli import main
from cranktrain.cli.library.keywords import NAMES, Keyword, function_name, keywords, verbs

FOLDER = Path(__file__).with_name("functions")
FACE = Path(cranktrain.__file__).with_suffix(".pyi")
"""Stub of the package, by which editors and type checkers see names that are loaded when they are used."""
WIDTH = 120
RETURNS = {
    "simulate": ("Run", "cranktrain.results.run"),
    "runup": ("OrdersOverSpeed", "cranktrain.results.views.over_speed"),
    "campbell": ("Campbell", "cranktrain.results.views.over_speed"),
    "modal": ("Frequencies", "cranktrain.results.views.found"),
    "plan": ("Plan", "cranktrain.studies.planning.plan"),
    "new": ("Engine", "cranktrain.engine.model"),
}
"""Class that a function returns, and its module; what the verb prints with --json for all others."""
FOUND = ("Found", "cranktrain.results.views.found")
PLACES = {
    "Engine": "cranktrain.engine.model", "Scene": "cranktrain.studies.scene",
    "Assembly": "cranktrain.structure.assembly", "Pressures": "cranktrain.loads.given_pressure",
    "LoadValues": "cranktrain.dynamics.load_torque",
}  # fmt: skip


def write() -> list[Path]:
    """Write all functions and the stub of the package; returns the files that changed."""
    changed = []
    wanted = {FOLDER / f"{function_name(verb)}.py": source(verb) for verb in verbs()} | {FACE: face()}
    for path, text in wanted.items():
        if not path.is_file() or path.read_text("utf-8") != text:
            path.write_text(text, encoding="utf-8")
            changed.append(path)
    return changed


def face() -> str:
    """Stub of the package: its names as imports."""
    imports = (f"from cranktrain.{place} import {name} as {name}" for name, place in cranktrain.NAMES.items())
    about = "Names of the library for editors and type checkers; written by ``python -m cranktrain.cli.library``."
    lines = [f'"""{about}"""', "", *sorted(imports), "", "__version__: str", "NAMES: dict[str, str]"]
    return "\n".join(lines) + "\n"


def source(verb: str) -> str:
    """Source of the function of a verb."""
    known = keywords(verb)
    kind, module = RETURNS.get(verb, FOUND)
    kinds = {name: one.kind for name, one in known.items()}
    used = " ".join([*kinds.values(), kind])
    lines = [
        f'"""Function of the verb ``{verb}``; written by ``python -m cranktrain.cli.library``, not by hand."""', "",
        "from __future__ import annotations", "",
    ]  # fmt: skip
    if "Sequence[" in used:
        lines.append("from collections.abc import Sequence")
    if "Path" in used:
        lines.append("from pathlib import Path")
    typing = [name for name in ("Literal",) if f"{name}[" in used]
    lines += [f"from typing import TYPE_CHECKING{''.join(f', {name}' for name in typing)}", ""]
    lines += ["from cranktrain.cli.library.calling import call, of_verb", "", "if TYPE_CHECKING:"]
    places = {kind: module, **{name: place for name, place in PLACES.items() if name in used}}
    imports = sorted(f"    from {place} import {name}" for name, place in places.items() if name in used)
    lines += [*imports, "", ""]
    lines += ["# In one piece: every option of the verb, by keyword.", "@of_verb", *_head(verb, known, kinds, kind)]
    lines += _docstring(verb, known)
    lines.append(f'    return call("{verb}", locals())')
    return "\n".join(lines) + "\n"


def _head(verb: str, known: dict[str, Keyword], kinds: dict[str, str], kind: str) -> list[str]:
    """Lines of the signature."""
    words, starred = [], False
    for name, one in known.items():
        if not one.positional and not starred:
            words.append("*")
            starred = True
        default = tuple(one.default) if isinstance(one.default, list) else one.default
        words.append(f"{name}: {kinds[name]}" + ("" if one.required else f" = {_quoted(default)}"))
    body: list[str] = []
    for word in words:
        if body and len(body[-1]) + len(word) + 2 < WIDTH:
            body[-1] += f" {word},"
        else:
            body += [f"    {line}" for line in _wrapped(f"{word},", WIDTH - 4)]
    return [f"def {function_name(verb)}(", *body, f") -> {kind}:  # fmt: skip"]


def _wrapped(text: str, width: int) -> list[str]:
    """A text in lines, those after the first further in."""
    return textwrap.wrap(text, width, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)


def _quoted(value: object) -> str:
    """A default as source, texts in double quotes."""
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _docstring(verb: str, known: dict[str, Keyword]) -> list[str]:
    """Lines of the docstring: first line of the verb's description, errors, its keywords."""
    about = main.verb_module(verb).DESCRIPTION.strip()
    first, _, rest = about.partition("\n")
    first, colon, more = first.partition(": ") if len(first) > WIDTH - 8 else (first, "", "")
    lines = [f"{first}." if colon else first, ""]
    if colon:
        lines += [*_wrapped(more[:1].upper() + more[1:], WIDTH - 4), ""]
    more = f"See ``cranktrain {verb} --help`` for more. " if rest.strip() and verb not in NAMES else ""
    raised = "Raises ``InputError`` for what cannot be used, ``SolverError`` for a computation that fails."
    lines += [*textwrap.wrap(more + raised, WIDTH - 4), ""]
    lines += ["Parameters", "----------"]
    for name, one in known.items():
        text = f"{name} : {one.help}"
        lines += _wrapped(text, WIDTH - 4)
    escaped = [line.replace("\\", "\\\\") for line in lines]
    return [f'    """{escaped[0]}', *(f"    {line}".rstrip() for line in escaped[1:]), '    """']
