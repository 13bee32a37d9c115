"""The simulation of a module beside the cranktrain: a communication step over its kernels."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from cranktrain.core.errors import SolverError
from cranktrain.core.kernel import typed_kernel
from cranktrain.core.stepped_model import Array, SteppedModel
from cranktrain.modules.crank_angle import TIME, check_inputs, checked_interval


class SteppedModule(SteppedModel):
    """A module whose inputs and state begin as :mod:`cranktrain.modules.crank_angle` says.

    Attributes
    ----------
    settings : with ``angle_source`` and ``inputs_at`` among them
    outputs : valid after ``initialize`` and after each step
    """

    settings: Any
    _model: Any
    _work: Any

    def step(self, t_end: float) -> None:
        """Advance to ``t_end``, s. On an error the state stays at the last good time.

        Raises
        ------
        InputError
            inputs that are not numbers or out of bounds, an angle that jumps, a step that is not positive or absurd
        SolverError
            a model without a solution
        """
        state = self._current()
        self._check_inputs()
        interval = checked_interval(state, self.inputs, t_end, self.settings.angle_source, self.settings.inputs_at)
        after = state.copy()
        if self._advance(self._model, self._work, after, self.inputs, interval, self.outputs):
            raise self._failure(f"the step from {state[TIME]:.9g} s")
        after[TIME] = t_end
        self._state = after

    def _stand_at(self, state: Array, kernel: Any, before: Any) -> None:
        """Begin at a state; ``kernel`` takes steps and observes, and compiles in one of the model ``before``."""
        self._state = state
        arguments = before, self._work, state.copy(), self.inputs, 1.0e-9, self.outputs
        self._advance = typed_kernel(kernel, *arguments)
        self._advance(*arguments)
        self._observe()

    def _check_inputs(self) -> None:
        """Refuse inputs that no engine has; ``InputError``."""
        check_inputs(self.inputs, self.input_names)

    @abstractmethod
    def _failure(self, what: str) -> SolverError:
        """Why ``what``, the start or a step, has no solution."""
