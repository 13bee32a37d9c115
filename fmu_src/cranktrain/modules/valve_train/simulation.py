"""Valve-train simulation that an FMU or a script steps: set ``inputs``, call ``step``, read ``outputs``."""

from collections.abc import Mapping
from typing import Any, ClassVar

from cranktrain.modules.statuses import FAILED as STEP_FAILED
from cranktrain.modules.statuses import REFUSED, NativeInterface, Statuses, common_statuses, options, with_names
from cranktrain.modules.stepped_module import SteppedModule
from cranktrain.modules.valve_train import run_record
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.advance import FAILED
from cranktrain.modules.valve_train.preparation import NO_SEAT_TIME, SMALL_BASE, VALVE_ANGLES
from cranktrain.modules.valve_train.settings import CHOICES, MEND_ANGLES, MEND_BASE, MEND_RAMP, TrainSettings, make_run

NO_SOLUTION = (
    "camshaft and valves find no balance however short the step; check stiffnesses, dampings and masses, and whether "
    "the speed is one that an engine has"
)


def native_interface(settings: TrainSettings, names: Mapping[str, str] | None = None) -> NativeInterface:
    """Interface of a valve-train run with ``settings``; ``names`` are the user's names of the settings' fields."""
    count = len(settings.firing_angles)
    of_each = [f"cylinder[{i + 1}].{kind}_" for i in range(count) for kind in at.KINDS]
    outputs = (*at.OUTPUTS, *(head + name for head in of_each for name in at.LINE_OUTPUTS))
    numbers = (*at.RUN_NUMBERS, *(f"firing_angles[{i + 1}]" for i in range(count)))
    choices = {name: options(values) for name, values in CHOICES.items()}
    known: Statuses = {FAILED: (STEP_FAILED, NO_SOLUTION)}
    for k, kind in enumerate(at.KINDS):
        known |= {
            VALVE_ANGLES + k: (REFUSED, f"{kind}_opens does not fit {kind}_closes; {MEND_ANGLES[k]}"),
            NO_SEAT_TIME + k: (REFUSED, f"ramp of the cam leaves the {kind} valve no time on its seat; {MEND_RAMP}"),
            SMALL_BASE + k: (REFUSED, f"base_radius is too small for the {kind} cam; {MEND_BASE}"),
        }
    statuses = with_names(common_statuses(at.INPUTS, numbers, choices) | known, names or {})
    return NativeInterface(at.INPUTS, outputs, numbers, choices, (), statuses)


class ValveTrainSimulation(SteppedModule):
    """Valve train of one engine, stepped from outside.

    Attributes
    ----------
    input_names, output_names : names as in the FMU
    inputs : values in the order of ``input_names`` (SI), initially 0
    outputs : values in the order of ``output_names`` (SI); valid after ``initialize`` and after each step
    """

    _kind: ClassVar[str] = "valvetrain"
    _kernels: ClassVar[Any] = run_record

    def __init__(self, settings: TrainSettings) -> None:
        super().__init__(settings, make_run(settings), native_interface(settings))

    @property
    def n_cylinders(self) -> int:
        """Number of cylinders."""
        return int(self._model.noses.size) // 2

    def _failure(self, what: str, status: int) -> str:
        return f"{what} fails: {NO_SOLUTION}"
