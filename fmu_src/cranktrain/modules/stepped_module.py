"""What the simulations of all modules share: a state vector that is kept and set, outputs that are read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.modules.crank_angle import TIME

Array = NDArray[np.float64]


class SteppedModule:
    """A simulation whose state begins with the head of :mod:`cranktrain.modules.crank_angle`.

    Attributes
    ----------
    outputs : valid after ``initialize`` and after each step
    """

    outputs: Array
    _inputs: Array
    _state: Array | None = None

    @property
    def inputs(self) -> Array:
        """Values of the inputs, set in place; kernels are handed this very array."""
        return self._inputs

    @inputs.setter
    def inputs(self, values: Array) -> None:
        self._inputs[:] = values

    @property
    def time(self) -> float:
        """Time of the state, s."""
        return float(self._current()[TIME])

    @property
    def state(self) -> Array:
        """The whole state as a copy, (n,); assigning one of the same engine restores it."""
        return self._current().copy()

    @state.setter
    def state(self, vector: Array) -> None:
        if np.shape(vector) != self._current().shape:
            raise InputError(f"a state of this model has {self._current().size} values, got {np.size(vector)}")
        self._state = np.array(vector, dtype=float)
        self._observe(self._state)

    def read(self, places: Sequence[int]) -> list[float]:
        """Outputs by their places."""
        return [self.outputs.item(place) for place in places]

    def _current(self) -> Array:
        if self._state is None:
            raise InputError("the model is not initialised yet; call initialize() first")
        return self._state

    def _observe(self, state: Array) -> None:
        """Fill the outputs from a state."""
        raise NotImplementedError
