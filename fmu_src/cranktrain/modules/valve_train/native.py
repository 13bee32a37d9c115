"""Description of a valve train's run for callers without Python: names, choices and status texts."""

from collections.abc import Mapping

from cranktrain.modules.statuses import FAILED as STEP_FAILED
from cranktrain.modules.statuses import REFUSED, NativeInterface, Statuses, common_statuses, options, with_names
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.advance import FAILED
from cranktrain.modules.valve_train.preparation import NO_SEAT_TIME, SMALL_BASE, VALVE_ANGLES
from cranktrain.modules.valve_train.settings import CHOICES, MEND_ANGLES, MEND_BASE, MEND_RAMP, TrainSettings

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
