"""Names of array elements, with the number in either position.

The number is in the middle (``cylinder[1].pressure``, FMUs of FMI 2.0) or at the end (``cylinder.pressure[1]``, arrays
of FMI 3.0).
"""

import re
from collections.abc import Container
from typing import Any, TypeVar

_NUMBER = re.compile(r"\[([0-9]{1,18})\]")
Value = TypeVar("Value")


def array_element(name: str) -> tuple[str, int] | None:
    """Array name and number (from 1) of a name with one number in brackets; None for any other name."""
    found = _NUMBER.findall(name)
    if len(found) != 1 or name.count("[") != 1:
        return None
    return _NUMBER.sub("", name), int(found[0])


def name_among(name: str, known: Container[str]) -> str:
    """Spelling of an array element in ``known``, wherever its number stands; ``name`` itself if ``known`` lacks it."""
    place = None if name in known else array_element(name)
    if place is None:
        return name
    array, number = place
    parts = array.split(".")
    for k in range(len(parts)):
        other = ".".join((*parts[:k], f"{parts[k]}[{number}]", *parts[k + 1 :]))
        if other in known:
            return other
    return name


class Elements(dict[str, Value]):
    """Dictionary by variable name that finds elements of arrays under both spellings of their names."""

    def own(self, name: str) -> str:
        """Name under which a variable is listed; ``name`` itself if it is not listed."""
        return name_among(name, self.keys())

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self.own(name) in self.keys()

    def __missing__(self, name: str) -> Value:
        own = self.own(name)
        if own == name:
            raise KeyError(name)
        return self[own]

    def get(self, name: str, default: Any = None) -> Any:
        """Value of a variable; ``default`` if it is not listed."""
        try:
            return self[name]
        except KeyError:
            return default
