"""Functions that a module's FMU calls."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, NamedTuple

from cranktrain.core.announcement import announced
from cranktrain.core.errors import InputError, StoreError
from cranktrain.modules.module_settings import from_bytes, with_chosen
from cranktrain.modules.statuses import named
from cranktrain.modules.stepped_module import SteppedModule

COMPILATION = "one minute"
"""Longest compilation time of a module's kernels, from an empty cache."""


class ModuleRunning(NamedTuple):
    """Functions of a module's FMU, from the classes of its settings and its simulation."""

    settings: type[Any]
    model: type[SteppedModule]

    def read_model(self, path: str | Path) -> Any:
        """Settings from the data file of an FMU; ``StoreError`` if it is missing or of another kind."""
        try:
            data = Path(path).read_bytes()
        except OSError as error:
            raise StoreError(
                f"{path}: cannot be read ({error.strerror}); build the FMU again with build_fmu.py"
            ) from None
        return from_bytes(self.settings, data, Path(path).name)

    def simulation(self, model: Any, chosen: Mapping[str, Any], names: Mapping[str, str]) -> Any:
        """Simulation with ``chosen`` values of settings; errors use the FMU's ``names``."""
        try:
            return self.model(with_chosen(model, chosen))  # type: ignore[call-arg]
        except InputError as error:
            raise InputError(named(str(error), names)) from None

    @staticmethod
    def announced_compilation(instance: str) -> AbstractContextManager[None]:
        """Context that announces the compilation of kernels to the user of an instance."""
        return announced(instance, COMPILATION)
