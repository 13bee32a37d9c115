"""The object that an FMU or a script steps: set ``inputs``, call ``step``, read ``outputs``."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.kernel import typed_kernel
from cranktrain.core.stepped_model import Array, SteppedModel
from cranktrain.modules import crank_angle as crank
from cranktrain.modules.crank_angle import TIME, check_inputs, checked_interval
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.advance import advance, advance_and_observe, energy, observe, stand
from cranktrain.modules.valve_train.settings import TrainSettings, build_model, make_work

_ZEROED = (at.STEPS, at.REJECTED, at.WORK, at.FRICTION_WORK, at.DAMPED, crank.LAST_INTERVAL, crank.ANGLE_SEEN)


class ValveTrainSimulation(SteppedModel):
    """Valve train of one engine, stepped from outside.

    Attributes
    ----------
    input_names, output_names : names as in the FMU
    inputs : values in their order (SI), 0 at first
    outputs : valid after ``initialize`` and after each step
    """

    def __init__(self, settings: TrainSettings) -> None:
        self.settings = settings
        self._model = build_model(settings)
        self._work = make_work(self._model.noses.size)
        of_each = [f"cylinder[{i + 1}].{kind}_" for i in range(self.n_cylinders) for kind in ("intake", "exhaust")]
        self.input_names = at.INPUTS
        self.output_names = (*at.OUTPUTS, *(head + name for head in of_each for name in at.LINE_OUTPUTS))
        self.outputs = np.zeros(len(self.output_names))
        self._inputs = np.zeros(len(self.input_names))

    @property
    def n_cylinders(self) -> int:
        """Number of cylinders."""
        return int(self._model.noses.size) // 2

    def initialize(self, time: float = 0.0) -> None:
        """Start at the present inputs: in static balance at rest, else ``start_cycles`` cycles behind it.

        Raises ``InputError`` for inputs that no engine has, ``SolverError`` where the cycles cannot be run.
        """
        self._check_inputs()
        state = np.zeros(at.N_HEAD + self._model.noses.size * at.N_LINE)
        speed, angle = float(self.inputs[crank.SPEED]), float(self.inputs[crank.ANGLE])
        cycles = round(self.settings.start_cycles)
        stand(self._model, self._work, state, self.inputs)
        before = self._model._replace(choices=np.zeros_like(self._model.choices))
        runs = speed >= self.settings.start_speed and cycles > 0
        if runs and advance(before, self._work, state, self.inputs, 4.0 * math.pi * cycles / speed):
            raise self._failure("the start")
        state[[*_ZEROED]] = 0.0
        state[at.FIRST_ENERGY] = energy(self._model, self._work, state)
        state[crank.TIME], state[crank.PARTNER_ANGLE] = time, angle
        self._stand_at(state, advance_and_observe, before)

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

    def _observe(self) -> None:
        observe(self._model, self._work, self._current(), self.outputs)

    def _failure(self, what: str) -> SolverError:
        return SolverError(
            f"{what} fails: camshaft and valves find no balance however short the step; check stiffnesses, dampings "
            "and masses, and whether the speed is one that an engine has"
        )
