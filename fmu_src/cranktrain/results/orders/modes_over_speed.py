"""Natural frequencies over speed, and speeds at which orders excite them."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array


class Crossing(NamedTuple):
    """Resonance of an order with a mode: order, name and kind of the mode, speed (rad/s) and frequency (Hz)."""

    order: float
    mode: str
    kind: str
    speed: float
    hz: float


class ModesOverSpeed(NamedTuple):
    """Modes tracked over speed.

    Attributes
    ----------
    speeds : (s,) rad/s, increasing
    hz : (s, m) natural frequencies
    names, kinds : (m,) names and kinds, such as ``torsional 1`` and ``torsional``
    agreement : (s − 1, m) modal assurance criterion between each mode and itself at the next speed
    """

    speeds: Array
    hz: Array
    names: tuple[str, ...]
    kinds: tuple[str, ...]
    agreement: Array

    def crossings(self, orders: Sequence[float], kind: str = "") -> list[Crossing]:
        """Resonances of orders with modes of one kind, or of any, within the speeds; sorted by speed."""
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
        """Mode of one kind, or of any, nearest to an order at a speed (rad/s); None if there is none."""
        which = [k for k, own in enumerate(self.kinds) if kind in ("", own)]
        if not which:
            return None
        there = [float(np.interp(speed, self.speeds, self.hz[:, k])) for k in which]
        at = int(np.argmin(np.abs(np.array(there) - order * speed / (2.0 * math.pi))))
        critical = 2.0 * math.pi * there[at] / order
        return Crossing(order, self.names[which[at]], self.kinds[which[at]], critical, there[at])
