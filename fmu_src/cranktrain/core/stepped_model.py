"""Base class of simulations that are stepped from outside: inputs, a state that can be saved and restored, outputs."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array

TIME = 0
"""Index of the time, s, in every state vector."""


class SteppedModel(ABC):
    """A model with one state vector: set ``inputs``, step, ``read`` outputs.

    Attributes
    ----------
    input_names, output_names : names as in the FMU
    outputs : values of the outputs in the order of ``output_names`` (SI)
    """

    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    outputs: Array
    _inputs: Array
    told: ClassVar[str] = ""
    """Warning of a ``limited`` step, after its time."""
    _state: Array | None = None

    @property
    def inputs(self) -> Array:
        """Values of the inputs (SI), to be changed in place, because kernels use this very array."""
        return self._inputs

    @inputs.setter
    def inputs(self, values: Array) -> None:
        self._inputs[:] = values

    @property
    def limited(self) -> bool:
        """True if the last step has something to warn of, which ``told`` says; most models have nothing."""
        return False

    @property
    def time(self) -> float:
        """Time of the state, s."""
        return float(self._current()[TIME])

    @property
    def state(self) -> Array:
        """Copy of the whole state, (n,); assigning a state of the same model restores it."""
        return self._current().copy()

    @state.setter
    def state(self, vector: Array) -> None:
        state = self._current()
        if np.shape(vector) != state.shape:
            raise InputError(f"a state of this model has {state.size} values, got {np.size(vector)}")
        self._check_state(vector)
        state[:] = vector
        self._observe()

    def read(self, places: Sequence[int]) -> list[float]:
        """Outputs at the present state, by their indices."""
        return [self.outputs.item(place) for place in places]

    def _current(self) -> Array:
        if self._state is None:
            raise InputError("the model is not initialised yet; call initialize() first")
        return self._state

    def _check_state(self, vector: Array) -> None:  # noqa: B027 - most models need no further check
        """Raise ``InputError`` if a state of the right size does not belong to this model."""

    @abstractmethod
    def _observe(self) -> None:
        """Fill the output values from the present state."""
