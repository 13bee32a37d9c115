"""A module's simulation as a unit, without an FMU around it: for studies, and for who couples from Python."""

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
        """Start under the present inputs."""

    def step(self, t_end: float) -> None:
        """Advance to a time, s."""

    def read(self, places: Sequence[int]) -> list[float]:
        """Outputs by their places."""


class SimulationUnit:
    """A simulation under a master; see the protocol of :mod:`cranktrain_lab.coupling.unit`.

    ``begin`` starts it in place of its own ``initialize``: from a state that is known. Values are SI and carry no unit.
    """

    restorable = True

    def __init__(self, name: str, simulation: Stepped, begin: Callable[[], None] | None = None) -> None:
        self.name, self.simulation, self._begin = name, simulation, begin
        self.inputs: Mapping[str, Port] = dict.fromkeys(simulation.input_names, Port())
        self.outputs: Mapping[str, Port] = dict.fromkeys(simulation.output_names, Port())

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """See the protocol."""
        self._in = [self.simulation.input_names.index(name) for name in inputs]
        self._out = [self.simulation.output_names.index(name) for name in outputs]

    def initialize(self, time: float) -> None:
        """See the protocol."""
        self._try(lambda: self.simulation.initialize(time) if self._begin is None else self._begin())

    def write(self, values: Array) -> None:
        """See the protocol."""
        self.simulation.inputs[self._in] = values

    def read(self) -> Array:
        """See the protocol."""
        return np.array(self.simulation.read(self._out))

    def step(self, time: float, size: float) -> None:
        """See the protocol."""
        self._try(lambda: self.simulation.step(time + size))

    def keep(self, held: Any = None) -> Any:
        """See the protocol."""
        return self.simulation.state, self.simulation.inputs.copy()

    def restore(self, state: Any) -> None:
        """See the protocol."""
        vector, self.simulation.inputs[:] = state
        self.simulation.state = vector

    def close(self) -> None:
        """See the protocol."""

    def _try(self, call: Callable[[], None]) -> None:
        try:
            call()
        except CranktrainError as error:
            raise UnitError(str(error)) from None
