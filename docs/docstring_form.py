"""Docstrings in the form of this project, for the library's page of the site: an extension of griffe.

An entry of Parameters, Attributes or Returns is ``name : what it is``, its type stands in the signature. A reader of
numpydoc takes the text after the colon for the type; here it becomes the description. Roles such as ``:func:`name```
become links where the site has the name, and code elsewhere.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import griffe

SECTION = re.compile(r"^(Parameters|Other Parameters|Attributes|Returns|Yields)\n(-{3,})\n", re.MULTILINE)
ENTRY = re.compile(r"^(\S[^:]*?) : ?(.*)$")
NAMED = re.compile(r"^([A-Za-z_][\w\[\], ]*) : (.+)$")
ROLE = re.compile(r":[a-z]+:`(?:[^`<]*<)?(~?)([\w.]+)>?`")


class DocstringForm(griffe.Extension):
    """Rewrites docstrings once a package is loaded, when names can be looked up."""

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        """Every docstring of a package."""
        for one in _objects(pkg):
            if one.docstring is not None:
                one.docstring.value = rewritten(one.docstring.value, one)


def rewritten(text: str, owner: griffe.Object) -> str:
    """A docstring in the form that griffe reads."""
    parts = SECTION.split(text)
    found = [parts[0]]
    for title, dashes, body in zip(parts[1::3], parts[2::3], parts[3::3], strict=True):
        entries, blank, rest = body.partition("\n\n")
        returned = title in ("Returns", "Yields")
        made = _returned(entries.splitlines()) if returned else _described(entries.splitlines(), owner)
        found += [f"{title}\n{dashes}\n", "\n".join(made), blank, rest]
    return ROLE.sub(lambda role: _link(role[2], bool(role[1]), owner), "".join(found))


def _described(lines: list[str], owner: griffe.Object) -> Iterator[str]:
    """Entries whose text is their description; several names in one entry have their common type."""
    for line in lines:
        entry = ENTRY.match(line)
        if entry is None:
            yield line
            continue
        names = entry[1].split(", ")
        kinds = {str(owner.members[name].annotation) for name in names if _annotated(owner, name)}
        yield f"{entry[1]} : {kinds.pop()}" if len(names) > 1 and len(kinds) == 1 else entry[1]
        if entry[2]:
            yield f"    {entry[2]}"


def _annotated(owner: griffe.Object, name: str) -> bool:
    return name in owner.members and getattr(owner.members[name], "annotation", None) is not None


def _returned(lines: list[str]) -> Iterator[str]:
    """What is returned, as one description after its name; the type is that of the signature."""
    if not lines:
        return
    named = NAMED.match(lines[0])
    yield ":" if named is None else f"{named[1]} :"
    yield f"    {lines[0] if named is None else named[2]}"
    yield from (f"    {line.strip()}" for line in lines[1:])


def _link(name: str, short: bool, owner: griffe.Object) -> str:
    """A name as code, and as a link if a page has it."""
    shown = name.rpartition(".")[2] if short else name.lstrip(".")
    path = name
    if name.startswith("."):
        path = f"{owner.module.parent.path if owner.module.parent else owner.module.path}{name}"
    elif not name.startswith("cranktrain."):
        try:
            path = owner.resolve(name)
        except griffe.NameResolutionError:
            return f"`{shown}`"
    return f'<autoref identifier="{path}" optional><code>{shown}</code></autoref>'


def _objects(owner: griffe.Object) -> Iterator[griffe.Object]:
    """An object and all in it; aliases are reached where they are defined."""
    yield owner
    for member in owner.members.values():
        if not isinstance(member, griffe.Alias):
            yield from _objects(member)
