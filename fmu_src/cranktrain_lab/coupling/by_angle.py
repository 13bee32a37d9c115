"""Base class of units whose outputs depend on the crank angle alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain_lab.coupling.unit import Port

ANGLE, SPEED = "crank.angle", "crank.speed"


class ByAngle:
    """Unit with crank angle and speed as inputs; subclasses add ``read`` (:class:`cranktrain_lab.coupling.unit.Unit`).

    The angle at the end of a step, ``_angle``, is extrapolated from the angle at its start by the speed.
    """

    restorable = True

    def __init__(self, name: str, outputs: Mapping[str, Port]) -> None:
        self.name = name
        self.inputs: Mapping[str, Port] = dict.fromkeys((ANGLE, SPEED), Port())
        self.outputs = outputs
        self._given, self._angle = np.zeros(2), 0.0
        self.link((ANGLE, SPEED), list(outputs))

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Choose the inputs that ``write`` sets and the outputs that ``read`` returns."""
        self._in = [(ANGLE, SPEED).index(name) for name in inputs]
        self._read = list(outputs)

    def initialize(self, time: float) -> None:
        """Prepare the unit for steps from ``time`` (s) on."""
        self._angle = float(self._given[0])

    def write(self, values: Array) -> None:
        """Set the values (k,) of the k linked inputs."""
        self._given[self._in] = values

    def step(self, time: float, size: float) -> None:
        """Advance the unit from ``time`` (s) by one step of ``size`` (s)."""
        self._angle = float(self._given[0] + self._given[1] * size)

    def keep(self, held: Any = None) -> Any:
        """Return the unit's state; memory of the earlier state ``held`` may be reused."""
        return self._angle, self._given.copy()

    def restore(self, state: Any) -> None:
        """Restore a state of the unit that ``keep`` returned."""
        self._angle, given = state
        self._given[:] = given

    def close(self) -> None:
        """Release the unit and its memory; may be called repeatedly."""
