"""Simulation of a module as a unit without an FMU, for studies and for coupling from Python."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from cranktrain.core.errors import CranktrainError
from cranktrain.core.reduced_body import Array
from cranktrain_lab.coupling.unit import Port, UnitError


class Stepped(Protocol):
    """Common interface of the simulations of all modules."""

    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    inputs: Array
    state: Array

    def initialize(self, time: float = 0.0) -> None:
        """Initialize with the present inputs."""

    def step(self, t_end: float) -> None:
        """Advance to a time, s."""

    def read(self, places: Sequence[int]) -> list[float]:
        """Return outputs by index."""


class SimulationUnit:
    """Simulation as a :class:`cranktrain_lab.coupling.unit.Unit` under a master.

    ``begin`` replaces the simulation's ``initialize``, to start from a known state. Values are SI, without unit names.
    """

    restorable = True

    def __init__(self, name: str, simulation: Stepped, begin: Callable[[], None] | None = None) -> None:
        self.name, self.simulation, self._begin = name, simulation, begin
        self.inputs: Mapping[str, Port] = dict.fromkeys(simulation.input_names, Port())
        self.outputs: Mapping[str, Port] = dict.fromkeys(simulation.output_names, Port())

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Choose the linked inputs and outputs, see ``Unit.link``."""
        self._in = [self.simulation.input_names.index(name) for name in inputs]
        self._out = [self.simulation.output_names.index(name) for name in outputs]

    def initialize(self, time: float) -> None:
        """Prepare for steps, see ``Unit.initialize``."""
        self._try(lambda: self.simulation.initialize(time) if self._begin is None else self._begin())

    def write(self, values: Array) -> None:
        """Set the linked inputs, see ``Unit.write``."""
        self.simulation.inputs[self._in] = values

    def read(self) -> Array:
        """Return the linked outputs, see ``Unit.read``."""
        return np.array(self.simulation.read(self._out))

    def step(self, time: float, size: float) -> None:
        """Take one step, see ``Unit.step``."""
        self._try(lambda: self.simulation.step(time + size))

    def keep(self, held: Any = None) -> Any:
        """Return the state, see ``Unit.keep``."""
        return self.simulation.state, self.simulation.inputs.copy()

    def restore(self, state: Any) -> None:
        """Restore a kept state, see ``Unit.restore``."""
        vector, self.simulation.inputs[:] = state
        self.simulation.state = vector

    def close(self) -> None:
        """Release the unit, see ``Unit.close``."""

    def _try(self, call: Callable[[], None]) -> None:
        try:
            call()
        except CranktrainError as error:
            raise UnitError(str(error)) from None
