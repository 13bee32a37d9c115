"""Combustion simulation that an FMU or a script steps: set ``inputs``, call ``step``, read ``outputs``."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from cranktrain.modules.combustion import run_record
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.advance import N_HEAD
from cranktrain.modules.combustion.preparation import EXHAUST_ANGLES, INTAKE_ANGLES, NO_COMPRESSION, SHORT_ROD
from cranktrain.modules.combustion.run_record import CYLINDER_FAILED, DEVIATION_TOO_LARGE
from cranktrain.modules.combustion.settings import CHOICES, MEND_EXHAUST, MEND_INTAKE, Array, CycleSettings, make_run
from cranktrain.modules.crank_angle import INPUT_NOT_POSITIVE
from cranktrain.modules.statuses import FAILED, REFUSED, NativeInterface, Statuses, common_statuses, options, with_names
from cranktrain.modules.stepped_module import SteppedModule

CONSTANT = ("model.gas", "model.burnt", "model.tableau", "model.nodes", "model.defects")
NO_SOLUTION = (
    "its gas has no temperature or its steps became too short; check pressures and temperatures of the manifolds, "
    "fuel mass and lifts"
)
MEND_DEVIATION = "the clearance volume; give the deviation (m3) from the volume at crank.angle, or 0"


def native_interface(settings: CycleSettings, names: Mapping[str, str] | None = None) -> NativeInterface:
    """Interface of a combustion run with ``settings``; ``names`` are the user's names of the settings' fields."""
    count = len(settings.firing_angles)
    of_each = [f"cylinder[{i + 1}]." for i in range(count)]
    named = at.SPARKED if settings.sparks else {}
    inputs = (*at.COMMON_INPUTS, *(head + named.get(name, name) for head in of_each for name in at.CYLINDER_INPUTS))
    outputs = (*at.OUTPUTS, *(head + named.get(name, name) for head in of_each for name in at.CYLINDER_OUTPUTS))
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
    about = {"limited": str(at.RICH), "told": CombustionSimulation.told}
    return NativeInterface(inputs, outputs, numbers, choices, CONSTANT, statuses, about)


class CombustionSimulation(SteppedModule):
    """Cylinders of one engine, stepped from outside.

    Parameters
    ----------
    settings : settings of the engine's cylinders
    gas : table of another gas than air and products, in the form of :func:`.gas.gas_table`

    Attributes
    ----------
    input_names, output_names : names as in the FMU
    inputs : values in the order of ``input_names`` (SI); initially those of the settings
    outputs : values in the order of ``output_names`` (SI); valid after ``initialize`` and after each step
    """

    _kind: ClassVar[str] = "combustion"
    _kernels: ClassVar[Any] = run_record

    told = "had a charge of lambda below 0.6, which burns as far as its air goes; check fuel and intake pressure"

    def __init__(self, settings: CycleSettings, gas: Array | None = None) -> None:
        super().__init__(settings, make_run(settings, gas), native_interface(settings))

    @property
    def limited(self) -> bool:
        """True once a charge had a lambda below 0.6."""
        return bool(self._current()[at.RICH] > 0.0)

    @property
    def n_cylinders(self) -> int:
        """Number of cylinders."""
        return int(self._model.firing.size)

    @property
    def bases(self) -> list[int]:
        """Index in the state at which each cylinder's block begins."""
        return [N_HEAD + i * at.SIZE for i in range(self.n_cylinders)]

    def of_cylinder(self, slot: int) -> Array:
        """A quantity of all cylinders, (cylinders,), by its slot in :mod:`.slots`."""
        return self._current()[[base + slot for base in self.bases]]

    def _refusal(self, status: int, t_end: float) -> str:
        slot = status - INPUT_NOT_POSITIVE
        if at.INTAKE_P <= slot <= at.EXHAUST_T:
            return f"{self.input_names[slot]} is {self.inputs[slot]:g}; it is absolute and above 0"
        cylinder = status - run_record.DEVIATION_TOO_LARGE
        if 0 < cylinder <= self.n_cylinders:
            name = f"cylinder[{cylinder}].volume_deviation"
            return f"{name} is {self.inputs[self.input_names.index(name)]:g} m3, more than {MEND_DEVIATION}"
        return super()._refusal(status, t_end)

    def _failure(self, what: str, status: int) -> str:
        number = status - run_record.CYLINDER_FAILED
        angle = ""
        if self._state is not None:
            angle = (
                f" at {math.degrees(self._state[self.bases[number - 1] + at.PHI]):.1f} deg after its firing dead centre"
            )
        return f"{what} fails in cylinder {number}{angle}: {NO_SOLUTION}"
