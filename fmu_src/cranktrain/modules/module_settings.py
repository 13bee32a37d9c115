"""Settings of a module (a frozen record with ``firing_angles``) as the data of an FMU and as numbers of a run."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, StoreError, nearest

Settings = TypeVar("Settings", bound=Any)


def stated(place: str, default: Any = MISSING, **also: Any) -> dict[str, Any]:
    """Metadata of a setting that a module file states at ``table.key``, with its default if the key is left out.

    ``also`` are other places, in tables that some files have in place of the first one, with their defaults; their
    points are written as two underscores.
    """
    return {"files": {place: default} | {name.replace("__", "."): value for name, value in also.items()}}


def to_bytes(settings: Any) -> bytes:
    """Settings as the data of an FMU: JSON with sorted keys."""
    return json.dumps(asdict(settings), sort_keys=True, indent=1).encode()


def from_bytes(kind: type[Settings], data: bytes, name: str = "model") -> Settings:
    """Inverse of :func:`to_bytes`; ``StoreError`` for other data."""
    try:
        given: dict[str, Any] = json.loads(data)
        return kind(**{**given, "firing_angles": tuple(given["firing_angles"])})
    except (ValueError, TypeError, KeyError) as error:
        raise StoreError(f"{name}: no {kind.__name__} ({error}); build the FMU again with build_fmu.py") from None


def with_chosen(settings: Settings, chosen: Mapping[str, Any]) -> Settings:
    """Settings with replaced values of fields; a firing angle is named ``firing_angles[1]``."""
    angles = list(settings.firing_angles)
    plain = {}
    for name, value in chosen.items():
        if name.endswith("]"):
            angles[int(name.partition("[")[2][:-1]) - 1] = float(value)
        else:
            plain[name] = value
    return replace(settings, firing_angles=tuple(angles), **plain)


def check_values(settings: Any, choices: Mapping[str, Sequence[str]]) -> None:
    """Refuse a name that is not among a setting's ``choices``, and numbers that are not finite; ``InputError``."""
    for name, names in choices.items():
        value = str(getattr(settings, name))
        if value not in names:
            raise InputError(f"{name} '{value}' is not known; {nearest(value, names)}")
    angles = {f"firing_angles[{i + 1}]": angle for i, angle in enumerate(settings.firing_angles)}
    for name, value in (asdict(settings) | angles).items():
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError(f"{name} is {value}; it must be a finite number")


def run_numbers(
    settings: Any, names: Sequence[str], choices: Mapping[str, Sequence[str]], **derived: float
) -> NDArray[np.float64]:
    """Numbers of a run: settings by name, the index for a choice, followed by the firing angles."""
    given = asdict(settings) | derived
    given |= {name: valid.index(given[name]) for name, valid in choices.items()}
    return np.array([*(float(given[name]) for name in names), *settings.firing_angles])
