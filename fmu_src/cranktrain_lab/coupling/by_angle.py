"""What units have in common whose outputs follow from the crank's angle alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain_lab.coupling.unit import Port

ANGLE, SPEED = "crank.angle", "crank.speed"


class ByAngle:
    """See the protocol of :mod:`cranktrain_lab.coupling.unit`, of which ``read`` is left to a unit.

    The angle at the end of a step, ``_angle``, is that of its start, moved on by the speed.
    """

    restorable = True

    def __init__(self, name: str, outputs: Mapping[str, Port]) -> None:
        self.name = name
        self.inputs: Mapping[str, Port] = dict.fromkeys((ANGLE, SPEED), Port())
        self.outputs = outputs
        self._given, self._angle = np.zeros(2), 0.0
        self.link((ANGLE, SPEED), list(outputs))

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """See the protocol."""
        self._in = [(ANGLE, SPEED).index(name) for name in inputs]
        self._read = list(outputs)

    def initialize(self, time: float) -> None:
        """See the protocol."""
        self._angle = float(self._given[0])

    def write(self, values: Array) -> None:
        """See the protocol."""
        self._given[self._in] = values

    def step(self, time: float, size: float) -> None:
        """See the protocol."""
        self._angle = float(self._given[0] + self._given[1] * size)

    def keep(self, held: Any = None) -> Any:
        """See the protocol."""
        return self._angle, self._given.copy()

    def restore(self, state: Any) -> None:
        """See the protocol."""
        self._angle, given = state
        self._given[:] = given

    def close(self) -> None:
        """See the protocol."""
