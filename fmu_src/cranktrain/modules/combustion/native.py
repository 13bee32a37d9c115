"""Description of a combustion run for callers without Python: names, choices and status texts."""

from collections.abc import Mapping

from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.preparation import EXHAUST_ANGLES, INTAKE_ANGLES, NO_COMPRESSION, SHORT_ROD
from cranktrain.modules.combustion.run_record import CYLINDER_FAILED, DEVIATION_TOO_LARGE
from cranktrain.modules.combustion.settings import CHOICES, MEND_EXHAUST, MEND_INTAKE, CycleSettings
from cranktrain.modules.crank_angle import INPUT_NOT_POSITIVE
from cranktrain.modules.statuses import FAILED, REFUSED, NativeInterface, Statuses, common_statuses, options, with_names

CONSTANT = ("model.gas", "model.tableau", "model.nodes", "model.defects")
NO_SOLUTION = (
    "its gas has no temperature or its steps became too short; check pressures and temperatures of the manifolds, "
    "fuel mass and lifts"
)
MEND_DEVIATION = "the clearance volume; give the deviation (m3) from the volume at crank.angle, or 0"


def native_interface(settings: CycleSettings, names: Mapping[str, str] | None = None) -> NativeInterface:
    """Interface of a combustion run with ``settings``; ``names`` are the user's names of the settings' fields."""
    count = len(settings.firing_angles)
    of_each = [f"cylinder[{i + 1}]." for i in range(count)]
    inputs = (*at.COMMON_INPUTS, *(head + name for head in of_each for name in at.CYLINDER_INPUTS))
    outputs = (*at.OUTPUTS, *(head + name for head in of_each for name in at.CYLINDER_OUTPUTS))
    numbers = (*at.RUN_NUMBERS, *(f"firing_angles[{i + 1}]" for i in range(count)))
    choices = {name: options(values) for name, values in CHOICES.items()}
    known: Statuses = {
        SHORT_ROD: (
            REFUSED,
            "rod_length does not exceed crank radius and pin offset; lengthen it or shorten the stroke",
        ),
        NO_COMPRESSION: (REFUSED, "compression_ratio must be above 1; diesels have 14 to 20"),
        INTAKE_ANGLES: (REFUSED, f"intake_opens does not fit the intake valve's closing; {MEND_INTAKE}"),
        EXHAUST_ANGLES: (REFUSED, f"exhaust_opens does not fit the exhaust valve's closing; {MEND_EXHAUST}"),
    }
    for k in range(at.INTAKE_P, at.EXHAUST_T + 1):
        known[INPUT_NOT_POSITIVE + k] = REFUSED, f"{inputs[k]} must be above 0; it is absolute"
    for i in range(count):
        known[CYLINDER_FAILED + i + 1] = FAILED, f"cylinder {i + 1} fails: {NO_SOLUTION}"
        known[DEVIATION_TOO_LARGE + i + 1] = REFUSED, f"cylinder[{i + 1}].volume_deviation exceeds {MEND_DEVIATION}"
    statuses = with_names(common_statuses(inputs, numbers, choices) | known, names or {})
    return NativeInterface(inputs, outputs, numbers, choices, CONSTANT, statuses)
