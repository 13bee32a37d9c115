"""Tolerances of a comparison, one for each quantity."""

from collections.abc import Iterable, Mapping

from cranktrain.core.errors import InputError, nearest, shown

QUANTITIES = {
    "output": "course over the cycle, without mean, over its range",
    "mean": "mean over the cycle, over the largest value",
    "order": "amplitude with phase, over the order's largest amplitude",
    "peak-speed": "speed of a resonance",
    "peak-height": "height of a resonance",
    "damping": "damping ratio of a resonance",
    "speeds": "fraction of the speeds at which only one run-up has a result",
}
"""Compared quantities."""
USUAL = 0.02
"""Tolerance of all quantities but ``speeds``, for which it is 0."""


def tolerance_list(text: str) -> tuple[str, ...]:
    """Tolerances from a text, ``0.02`` for all or ``QUANTITY=0.02``, separated by commas; ``InputError``."""
    words = tuple(word.strip() for word in text.split(",") if word.strip())
    tolerances_of(words)
    return words


def tolerances_of(words: Iterable[str]) -> Mapping[str, float]:
    """Tolerance of each quantity; one that is named counts before one for all."""
    found = dict.fromkeys(QUANTITIES, USUAL) | {"speeds": 0.0}
    named: dict[str, float] = {}
    for word in words:
        name, equals, number = word.rpartition("=")
        name = name.strip()
        if equals and name not in QUANTITIES:
            raise InputError(f"'{name}' is no compared quantity; {nearest(name, QUANTITIES)}")
        try:
            value = float(number)
        except ValueError:
            value = -1.0
        if not value >= 0.0:
            raise InputError(f"{shown(word)} is no tolerance; give a number from 0 on, or QUANTITY=number: damping=0.1")
        found |= {} if equals else dict.fromkeys(found, value) | {"speeds": found["speeds"]}
        named |= {name: value} if equals else {}
    return found | named
