"""The object that an FMU or a script steps: set ``inputs``, call ``step``, read ``outputs``."""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.errors import InputError, SolverError
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.advance import N_HEAD, advance, advance_and_observe, fill_all, observe
from cranktrain.modules.combustion.settings import Array, CycleSettings, build_model, make_work
from cranktrain.modules.stepped_module import SteppedModule

_ZEROED = (at.BURNT, at.WORK, at.WALL, at.INTAKE, at.EXHAUST, at.INTAKE_ENTHALPY, at.EXHAUST_ENTHALPY)


class CombustionSimulation(SteppedModule):
    """Cylinders of one engine, stepped from outside.

    Parameters
    ----------
    settings : the engine's cylinders
    gas : table of another gas than air and products, see :func:`cranktrain.modules.combustion.gas.constant_gas`

    Attributes
    ----------
    input_names, output_names : names as in the FMU
    inputs : values in their order (SI); they start as the settings say
    outputs : valid after ``initialize`` and after each step
    """

    def __init__(self, settings: CycleSettings, gas: Array | None = None) -> None:
        self.settings = settings
        self._model = build_model(settings, gas)
        self._work = make_work()
        count = len(settings.firing_angles)
        of_each = [f"cylinder[{i + 1}]." for i in range(count)]
        self.input_names = (*at.COMMON_INPUTS, *(head + name for head in of_each for name in at.CYLINDER_INPUTS))
        self.output_names = (*at.OUTPUTS, *(head + name for head in of_each for name in at.CYLINDER_OUTPUTS))
        self.outputs = np.zeros(len(self.output_names))
        self._inputs = np.zeros(len(self.input_names))
        for slot, name in ((at.INTAKE_P, "intake_pressure"), (at.INTAKE_T, "intake_temperature"),
                           (at.EXHAUST_P, "exhaust_pressure"), (at.EXHAUST_T, "exhaust_temperature")):  # fmt: skip
            self.inputs[slot] = getattr(settings, name)
        self.inputs[at.FIRST_CYLINDER + at.FUEL_MASS :: at.OF_CYLINDER] = settings.fuel_mass
        self.inputs[at.FIRST_CYLINDER + at.INJECTION :: at.OF_CYLINDER] = settings.injection_angle

    @property
    def n_cylinders(self) -> int:
        """Number of cylinders."""
        return int(self._model.firing.size)

    @property
    def bases(self) -> list[int]:
        """Where each cylinder's block begins in the state."""
        return [N_HEAD + i * at.SIZE for i in range(self.n_cylinders)]

    def initialize(self, time: float = 0.0) -> None:
        """Start under the present inputs, ``start_cycles`` cycles after a filling; at rest with the intake's gas.

        Fuel and manifolds are those of the inputs, valves the built-in ones. Raises ``InputError`` for inputs that no
        engine has, ``SolverError`` where the cycles cannot be run.
        """
        self._check_inputs()
        state = np.zeros(N_HEAD + self.n_cylinders * at.SIZE)
        speed, angle = float(self.inputs[at.SPEED]), float(self.inputs[at.ANGLE])
        cycles = round(self.settings.start_cycles)
        fill_all(self._model, self._work, state, self.inputs)
        before = self._model._replace(choices=np.zeros_like(self._model.choices))
        runs = speed >= self.settings.start_speed and cycles > 0
        # A cylinder at rest stays full.
        if runs and advance(before, self._work, state, self.inputs, 4.0 * math.pi * cycles / speed):
            raise self._failure("the start")
        for base in self.bases:
            for total, start in ((at.WORK, at.WORK_START), (at.WALL, at.WALL_START), (at.BURNT, at.BURNT_START)):
                state[base + start] -= state[base + total]
            state[base + at.INJECTED] -= state[base + at.BURNT]
            state[base + at.SOI_TIME] -= state[base + at.CLOCK]
            state[[base + slot for slot in (*_ZEROED, at.CLOCK)]] = 0.0
            state[base + at.FIRST_MASS], state[base + at.FIRST_ENERGY] = state[base + at.MASS], state[base + at.ENERGY]
        for i, base in enumerate(self.bases):
            place = at.FIRST_CYLINDER + i * at.OF_CYLINDER
            state[base + at.LAST_LIFT_IN], state[base + at.LAST_LIFT_OUT] = self.inputs[
                place + at.LIFT_IN : place + at.LIFT_OUT + 1
            ]
        state[[at.STEPS, at.REJECTED, at.LAST_INTERVAL, at.ANGLE_SEEN, at.LIFTS_SEEN]] = 0.0
        state[at.TIME] = time
        state[at.OWN_ANGLE] = state[at.PARTNER_ANGLE] = angle
        self._stand_at(state, advance_and_observe, before)

    def of_cylinder(self, slot: int) -> Array:
        """A quantity of all cylinders, (cylinders,), by its slot of :mod:`.slots`."""
        return self._current()[[base + slot for base in self.bases]]

    def _observe(self) -> None:
        observe(self._model, self._work, self._current(), self.outputs)

    def _check_inputs(self) -> None:
        super()._check_inputs()
        if self.inputs[at.INTAKE_P : at.EXHAUST_T + 1].min() > 0.0:
            return
        for slot in (at.INTAKE_P, at.INTAKE_T, at.EXHAUST_P, at.EXHAUST_T):
            if self.inputs[slot] <= 0.0:
                raise InputError(f"{self.input_names[slot]} is {self.inputs[slot]:g}; it is absolute and above 0")

    def _failure(self, what: str) -> SolverError:
        number = int(self._work.counters[0])
        angle = ""
        if self._state is not None:
            angle = (
                f" at {math.degrees(self._state[self.bases[number - 1] + at.PHI]):.1f} deg after its firing dead centre"
            )
        return SolverError(
            f"{what} fails in cylinder {number}{angle}: its gas has no temperature or its steps became too short; "
            "check pressures and temperatures of the manifolds, fuel mass and lifts"
        )
