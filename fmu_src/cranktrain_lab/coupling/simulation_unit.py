"""Simulation of a module as a unit without an FMU, for studies and for coupling from Python."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from cranktrain.core.errors import CranktrainError
from cranktrain.core.reduced_body import Array
from cranktrain_lab.coupling.unit import Port, Unit, UnitError


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


class SimulationUnit(Unit):
    """Simulation as a :class:`cranktrain_lab.coupling.unit.Unit` under a master.

    ``begin`` replaces the simulation's ``initialize``, to start from a known state. Values are SI, without unit names.
    """

    restorable = True

    def __init__(self, name: str, simulation: Stepped, begin: Callable[[], None] | None = None) -> None:
        self.name, self.simulation, self._begin = name, simulation, begin
        self.inputs: Mapping[str, Port] = dict.fromkeys(simulation.input_names, Port())
        self.outputs: Mapping[str, Port] = dict.fromkeys(simulation.output_names, Port())

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Choose the inputs that ``write`` sets and the outputs that ``read`` returns."""
        self._in = [self.simulation.input_names.index(name) for name in inputs]
        self._out = [self.simulation.output_names.index(name) for name in outputs]

    def initialize(self, time: float) -> None:
        """Prepare the unit for steps from ``time`` (s) on."""
        self._try(lambda: self.simulation.initialize(time) if self._begin is None else self._begin())

    def write(self, values: Array) -> None:
        """Set the values (k,) of the k linked inputs."""
        self.simulation.inputs[self._in] = values

    def read(self) -> Array:
        """Return the values (k,) of the k linked outputs."""
        return np.array(self.simulation.read(self._out))

    def step(self, time: float, size: float) -> None:
        """Advance the unit from ``time`` (s) by one step of ``size`` (s)."""
        self._try(lambda: self.simulation.step(time + size))

    def keep(self, held: Any = None) -> Any:
        """Return the unit's state; memory of the earlier state ``held`` may be reused."""
        return self.simulation.state, self.simulation.inputs.copy()

    def restore(self, state: Any) -> None:
        """Restore a state of the unit that ``keep`` returned."""
        vector, self.simulation.inputs[:] = state
        self.simulation.state = vector

    def _try(self, call: Callable[[], None]) -> None:
        try:
            call()
        except CranktrainError as error:
            raise UnitError(str(error)) from None
