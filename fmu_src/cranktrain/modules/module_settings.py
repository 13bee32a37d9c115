"""Settings of a module, a frozen record with ``firing_angles``: as an FMU carries them, and with parameters chosen."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any, TypeVar

from cranktrain.core.errors import StoreError

Settings = TypeVar("Settings", bound=Any)


def to_bytes(settings: Any) -> bytes:
    """The settings as an FMU carries them: JSON with sorted keys."""
    return json.dumps(asdict(settings), sort_keys=True, indent=1).encode()


def from_bytes(kind: type[Settings], data: bytes, name: str = "model") -> Settings:
    """Inverse of :func:`to_bytes`; ``StoreError`` for what is none of this kind."""
    try:
        given: dict[str, Any] = json.loads(data)
        return kind(**{**given, "firing_angles": tuple(given["firing_angles"])})
    except (ValueError, TypeError, KeyError) as error:
        raise StoreError(f"{name}: no {kind.__name__} ({error}); build the FMU again with build_fmu.py") from None


def with_chosen(settings: Settings, chosen: Mapping[str, Any]) -> Settings:
    """Settings with values of their fields replaced; of the firing angles by ``firing_angles[1]``."""
    angles = list(settings.firing_angles)
    plain = {}
    for name, value in chosen.items():
        if name.endswith("]"):
            angles[int(name.partition("[")[2][:-1]) - 1] = float(value)
        else:
            plain[name] = value
    return replace(settings, firing_angles=tuple(angles), **plain)
