"""Two coupled masses as units under a master, each exact over a step whose inputs are held."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from cranktrain_lab.coupling.connections import Connection
from cranktrain_lab.coupling.unit import Port
from cranktrain_lab.stability.two_mass import TwoMass


class Mass:
    """One mass on its spring: ẋ = A x + B u, y = C x + D u."""

    restorable = True

    def __init__(self, name, a, b, c, d, inputs, outputs, start):
        self.name = name
        self.a, self.b, self.c, self.d = (np.array(m, dtype=float) for m in (a, b, c, d))
        fed = [frozenset(o for o, row in zip(outputs, self.d, strict=True) if row[k]) for k in range(len(inputs))]
        self.inputs = {name: Port(feeds=feeds) for name, feeds in zip(inputs, fed, strict=True)}
        self.outputs = {name: Port() for name in outputs}
        self.x, self.u = np.array(start, dtype=float), np.zeros(len(inputs))
        self.steps = {}

    def link(self, inputs, outputs):
        self.taken = [list(self.inputs).index(name) for name in inputs]
        self.said = [list(self.outputs).index(name) for name in outputs]

    def initialize(self, time):
        pass

    def write(self, values):
        self.u[self.taken] = values

    def read(self):
        return (self.c @ self.x + self.d @ self.u)[self.said]

    def step(self, time, size):
        if size not in self.steps:
            n, m = self.b.shape
            block = np.zeros((n + m, n + m))
            block[:n, :n], block[:n, n:] = self.a, self.b
            self.steps[size] = expm(block * size)[:n]
        self.x = self.steps[size] @ np.concatenate((self.x, self.u))

    def keep(self, held=None):
        return self.x.copy(), self.u.copy()

    def restore(self, state):
        self.x, self.u = state[0].copy(), state[1].copy()

    def close(self):
        pass


def units(masses: TwoMass, decomposition: str, start=(1.0, 0.0, 0.0, 0.0)):
    """Both masses and their connections; ``force/displacement`` or ``displacement/displacement``."""
    m1, m2, c1, c2, cc, d1, d2, dc = (getattr(masses, k) for k in ("m1", "m2", "c1", "c2", "cc", "d1", "d2", "dc"))
    shared = decomposition == "displacement/displacement"
    s, r = (cc, dc) if shared else (0.0, 0.0)
    own = [[0, 1], [-(c1 + s) / m1, -(d1 + r) / m1]]
    state = [[1, 0], [0, 1]]
    pull = [[0, 0], [cc / m1, dc / m1]] if shared else [[0], [1 / m1]]
    takes = ["x2", "v2"] if shared else ["force"]
    first = Mass("first", own, pull, state, np.zeros((2, len(takes))), takes, ["x1", "v1"], start[:2])
    other = [[0, 1], [-(c2 + cc) / m2, -(d2 + dc) / m2]]
    says = [*state, [cc, dc]]
    feed = [[0, 0], [0, 0], [-cc, -dc]]
    second = Mass(
        "second", other, [[0, 0], [cc / m2, dc / m2]], says, feed, ["x1", "v1"], ["x2", "v2", "force"], start[2:]
    )
    links = [Connection(("second", name), ("first", name)) for name in takes]
    links += [Connection(("first", name), ("second", name)) for name in ("x1", "v1")]
    return [first, second], links
