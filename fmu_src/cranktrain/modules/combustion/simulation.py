"""Combustion simulation that an FMU or a script steps: set ``inputs``, call ``step``, read ``outputs``."""

import math
from typing import Any, ClassVar

from cranktrain.modules.combustion import run_record
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.advance import N_HEAD
from cranktrain.modules.combustion.native import MEND_DEVIATION, NO_SOLUTION, native_interface
from cranktrain.modules.combustion.settings import Array, CycleSettings, make_run
from cranktrain.modules.crank_angle import INPUT_NOT_POSITIVE
from cranktrain.modules.stepped_module import SteppedModule


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

    def __init__(self, settings: CycleSettings, gas: Array | None = None) -> None:
        super().__init__(settings, make_run(settings, gas), native_interface(settings))

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
