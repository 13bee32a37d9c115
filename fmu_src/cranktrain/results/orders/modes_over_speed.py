"""Natural frequencies over the speed, and the speeds at which orders meet them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array


class Crossing(NamedTuple):
    """Speed (rad/s) at which an order meets a mode, named and of a kind, of a frequency (Hz) there."""

    order: float
    mode: str
    kind: str
    speed: float
    hz: float


class ModesOverSpeed(NamedTuple):
    """Modes followed over the speed.

    Attributes
    ----------
    speeds : (s,) rad/s, increasing
    hz : (s, m) natural frequencies
    names, kinds : (m,) such as ``torsional 1`` and ``torsional``
    agreement : (s − 1, m) modal assurance criterion of each mode with itself at the next speed
    """

    speeds: Array
    hz: Array
    names: tuple[str, ...]
    kinds: tuple[str, ...]
    agreement: Array

    def crossings(self, orders: Sequence[float], kind: str = "") -> list[Crossing]:
        """Where orders meet modes of a kind, or any, within the speeds; by speed."""
        found = []
        for order in orders:
            ahead = order * self.speeds[:, None] / (2.0 * math.pi) - self.hz
            for k, (name, own) in enumerate(zip(self.names, self.kinds, strict=True)):
                if kind not in ("", own):
                    continue
                for i in np.flatnonzero(ahead[:-1, k] * ahead[1:, k] < 0.0):
                    share = ahead[i, k] / (ahead[i, k] - ahead[i + 1, k])
                    speed = float(self.speeds[i] + share * (self.speeds[i + 1] - self.speeds[i]))
                    found.append(Crossing(order, name, own, speed, order * speed / (2.0 * math.pi)))
        return sorted(found, key=lambda crossing: crossing.speed)

    def nearest(self, order: float, speed: float, kind: str = "") -> Crossing | None:
        """The mode of a kind, or any, nearest to an order at a speed (rad/s); None where there is none."""
        which = [k for k, own in enumerate(self.kinds) if kind in ("", own)]
        if not which:
            return None
        there = [float(np.interp(speed, self.speeds, self.hz[:, k])) for k in which]
        at = int(np.argmin(np.abs(np.array(there) - order * speed / (2.0 * math.pi))))
        critical = 2.0 * math.pi * there[at] / order
        return Crossing(order, self.names[which[at]], self.kinds[which[at]], critical, there[at])
