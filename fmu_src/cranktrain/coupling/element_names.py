"""Names of elements of arrays, written at the number's place (``cylinder[1].pressure``) or last
(``cylinder.pressure[1]``)."""

from __future__ import annotations

import re

_NUMBER = re.compile(r"\[(\d+)\]")


def array_element(name: str) -> tuple[str, int] | None:
    """Array and number, from 1 on, of a name with one number in brackets; None for any other name."""
    found = _NUMBER.findall(name)
    if len(found) != 1 or name.count("[") != 1:
        return None
    return _NUMBER.sub("", name), int(found[0])


def other_name(name: str, known: object) -> str:
    """The name that ``known``, a container of names, has for the same element; ``name`` itself where it has none."""
    if name in known:  # type: ignore[operator]
        return name
    place = array_element(name)
    if place is None:
        return name
    array, number = place
    parts = array.split(".")
    for k in range(1, len(parts) + 1):
        other = ".".join((*parts[: k - 1], f"{parts[k - 1]}[{number}]", *parts[k:]))
        if other in known:  # type: ignore[operator]
            return other
    return name
