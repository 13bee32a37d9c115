"""Base class of the simulation of a module: its run, and the kernels of the run's record."""

import math
from abc import abstractmethod
from typing import Any, ClassVar

from cranktrain.core.errors import CranktrainError, InputError, SolverError
from cranktrain.core.run_entries import RunEntries
from cranktrain.core.stepped_model import SteppedModel
from cranktrain.modules import crank_angle as crank
from cranktrain.modules.statuses import FAILED, MEND_ANGLE, MEND_STEP, NO_REVERSE, NativeInterface


class SteppedModule(SteppedModel):
    """A stepped module whose inputs and state begin as defined in :mod:`cranktrain.modules.crank_angle`.

    Attributes
    ----------
    settings : settings of the module, with ``inputs_at``
    outputs : values valid after ``initialize`` and after each step
    """

    settings: Any
    _kind: ClassVar[str]
    """Kind of the module's library of machine code."""
    _kernels: ClassVar[Any]
    """Python module of the run's record, with kernels ``prepare``, ``start``, ``advance_run`` and ``observe_run``."""

    def __init__(self, settings: Any, run: Any, interface: NativeInterface) -> None:
        self.settings = settings
        self._run, self._model, self._work = run, run.model, run.work
        self._entries = RunEntries(self._kind, run, self._kernels)
        self._inputs, self.outputs = run.inputs, run.outputs
        self.input_names, self.output_names = interface.inputs, interface.outputs
        self._statuses = interface.statuses

    def initialize(self, time: float = 0.0) -> None:
        """Start at a time, s, with the present inputs, by the module's kernel ``start``.

        Raises ``InputError`` for impossible inputs, ``SolverError`` if the start has no solution; the state is then
        unchanged.
        """
        status = self._entries.start(time)
        if status:
            raise self._error(status, "the start", time)
        self._state = self._run.state
        self._observe()

    def step(self, t_end: float) -> None:
        """Advance to ``t_end``, s. On an error the state stays at the last good time.

        Raises
        ------
        InputError
            inputs that are not finite or out of bounds, an angle that jumps, a step that is not positive or too long
        SolverError
            a model without a solution
        """
        state = self._current()
        status = self._entries.advance(t_end)
        if status:
            raise self._error(status, f"the step from {state[crank.TIME]:.9g} s", t_end)

    def _observe(self) -> None:
        self._entries.observe()

    def _error(self, status: int, what: str, t_end: float) -> CranktrainError:
        """Exception for a status of ``what``, the start or a step to ``t_end``, s."""
        if self._statuses[status][0] == FAILED:
            return SolverError(self._failure(what, status))
        return InputError(self._refusal(status, t_end))

    def _refusal(self, status: int, t_end: float) -> str:
        """Message for a refused input or step, with its value."""
        inputs = self.inputs
        if status == crank.BACKWARDS:
            return f"crank.speed is {inputs[crank.SPEED]:g} rad/s; {NO_REVERSE}"
        place = status - crank.INPUT_NOT_FINITE
        if 0 <= place < inputs.size:
            return f"{self.input_names[place]} is {inputs[place]}; it must be a finite number"
        state = self._current()
        time = float(state[crank.TIME])
        if status == crank.NOT_AHEAD:
            return f"a step from {time:.9g} s to {t_end:.9g} s; {MEND_STEP}"
        off = crank.jump(state, inputs, t_end - time, crank.TIMES.index(self.settings.inputs_at))
        return (
            f"crank.angle is {math.degrees(inputs[crank.ANGLE]):.1f} deg at {time:.9g} s, "
            f"{math.degrees(off):.0f} deg off from where crank.speed has led; {MEND_ANGLE}"
        )

    @abstractmethod
    def _failure(self, what: str, status: int) -> str:
        """Message with the reason why ``what``, the start or a step, has no solution."""
