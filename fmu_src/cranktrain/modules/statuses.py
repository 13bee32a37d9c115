"""Meaning of the statuses of a module's kernels, and description of a module for callers without Python."""

import math
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from cranktrain.modules import crank_angle as crank

REFUSED, FAILED = "refused", "failed"
"""Kinds of a status: unusable input; a step or a start without a solution."""

MEND_STEP = f"it must go forward, by {crank.LONGEST_STEP:g} s at most"
MEND_ANGLE = "connect both to one crank, or set angle.source to speed"
NO_REVERSE = "reverse running is not modelled"
_JUMP = math.degrees(crank.LARGEST_JUMP)

Statuses = dict[int, tuple[str, str]]
"""Kind and text of each status."""


class NativeInterface(NamedTuple):
    """Interface of a module's run: names and meanings of its arrays and statuses.

    Attributes
    ----------
    inputs, outputs : names in the order of the run's arrays
    numbers : meaning of each of the run's numbers: a field of the settings, or a firing angle, ``firing_angles[1]``
    choices : for numbers that represent texts: the options and their values
    constant : arrays of the run that no kernel writes
    statuses : kind and text of each status except 0
    about : further entries of a native FMU, see :class:`cranktrain.fmu.native.interface.NativeModel`
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    numbers: tuple[str, ...]
    choices: Mapping[str, Mapping[str, float]]
    constant: tuple[str, ...]
    statuses: Statuses
    about: Mapping[str, str] = MappingProxyType({})


def options(names: Iterable[str]) -> dict[str, float]:
    """Value of each option of a choice: its index."""
    return {name: float(k) for k, name in enumerate(names)}


def common_statuses(
    inputs: Iterable[str], numbers: Iterable[str], choices: Mapping[str, Mapping[str, float]]
) -> Statuses:
    """Statuses that every module has, with texts that name inputs and numbers."""
    known = {
        crank.NOT_AHEAD: f"a step that does not go forward, or is too long; {MEND_STEP}",
        crank.JUMPS: f"crank.angle is over {_JUMP:g} deg off from where crank.speed has led; {MEND_ANGLE}",
        crank.BACKWARDS: f"crank.speed is below 0; {NO_REVERSE}",
    }
    places = list(numbers)
    known |= {crank.INPUT_NOT_FINITE + k: f"{name} must be a finite number" for k, name in enumerate(inputs)}
    known |= {crank.NUMBER_NOT_FINITE + k: f"{name} must be a finite number" for k, name in enumerate(places)}
    for name, values in choices.items():
        known[crank.UNKNOWN_CHOICE + places.index(name)] = f"{name} is not known; valid: " + ", ".join(values)
    return {status: (REFUSED, text) for status, text in known.items()}


def with_names(statuses: Statuses, names: Mapping[str, str]) -> Statuses:
    """Statuses whose texts begin with the user's name of a field instead of the field."""
    return {status: (kind, named(text, names)) for status, (kind, text) in statuses.items()}


def named(text: str, names: Mapping[str, str]) -> str:
    """Text in which a leading field is replaced by its name in ``names``."""
    field, _, rest = text.partition(" ")
    return f"'{names[field]}' {rest}" if field in names else text
