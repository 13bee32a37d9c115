"""Valve-train simulation that an FMU or a script steps: set ``inputs``, call ``step``, read ``outputs``."""

from typing import Any, ClassVar

from cranktrain.modules.stepped_module import SteppedModule
from cranktrain.modules.valve_train import run_record
from cranktrain.modules.valve_train.native import NO_SOLUTION, native_interface
from cranktrain.modules.valve_train.settings import TrainSettings, make_run


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
