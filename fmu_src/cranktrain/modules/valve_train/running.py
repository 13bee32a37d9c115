"""What the slave of a valve train FMU asks of the package."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from cranktrain.core.announcement import announced
from cranktrain.core.errors import InputError, StoreError
from cranktrain.modules.valve_train.settings import TrainSettings, from_bytes, with_chosen
from cranktrain.modules.valve_train.simulation import ValveTrainSimulation

__all__ = ["announced_compilation", "read_model", "simulation"]

COMPILATION = "one minute"
"""What the kernels take, from an empty cache."""


def read_model(path: str | Path) -> TrainSettings:
    """Read the data of an FMU; ``StoreError`` where they are missing or none."""
    try:
        return from_bytes(Path(path).read_bytes(), Path(path).name)
    except OSError as error:
        raise StoreError(f"{path}: cannot be read ({error.strerror}); build the FMU again with build_fmu.py") from None


def simulation(model: TrainSettings, chosen: Mapping[str, Any], names: Mapping[str, str]) -> ValveTrainSimulation:
    """Simulation with values ``chosen`` of settings, which the FMU calls by ``names``; ``InputError`` for misfits."""
    try:
        return ValveTrainSimulation(with_chosen(model, dict(chosen)))
    except InputError as error:
        field, _, rest = str(error).partition(" ")
        raise InputError(f"'{names[field]}' {rest}" if field in names else str(error)) from None


def announced_compilation(instance: str) -> AbstractContextManager[None]:
    """Let the user of an instance know what takes so long while kernels compile."""
    return announced(instance, COMPILATION)
