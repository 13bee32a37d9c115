"""Section torques of a crank that was made from a table of discs and shafts.

The inertias of the table's discs differ from those of the crank's pieces. The torque that a cut transmits is therefore
that of the table's shaft at this position, k ψ + c ψ̇ with its twist ψ. A disc lies at the interface of its name. Other
discs are placed as if all shafts to their neighbours had equal length, so a branch lies at its root and does not
contribute to the torque along the crank.
"""

from collections.abc import Iterable

import numpy as np

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.results.strength.recorded_cycle import RecordedCycle


def shaft_couples(cycle: RecordedCycle) -> tuple[Array, Array]:
    """Positions z (k,), m, and couples (n, k), N m, about the axis whose sum in front of a cut is the cut's torque."""
    body = cycle.body
    places = disc_places(body)
    z, couples = [], []
    for row, name, (spring, damper, _) in zip(body.twists, body.shafts, body.shaft_laws.tolist(), strict=True):
        if spring > 0.0:
            torque = spring * (cycle.position @ row) + damper * (cycle.velocity @ row)
            z += [places[end] for end in _ends(name)]
            couples += [torque, -torque]
    return np.array(z), np.array(couples).T


def disc_couples(cycle: RecordedCycle) -> tuple[Array, Array]:
    """Positions z (k,), m, and couples (n, k), N m, about the axis of discs with absolute damping."""
    body = cycle.body
    places = disc_places(body)
    found = np.flatnonzero(body.shaft_laws[:, 0] == 0.0).tolist()
    z = [places[body.shafts[k].removeprefix("disc ")] for k in found]
    return np.array(z), -(cycle.velocity @ body.twists[found].T) * body.shaft_laws[found, 1]


def disc_places(body: ReducedBody) -> dict[str, float]:
    """Position z of each disc, m, by name."""
    pairs = [_ends(name) for name, law in zip(body.shafts, body.shaft_laws, strict=True) if law[0] > 0.0]
    found = {end: float(body.positions[body.index(end), 2]) for end in _flat(pairs) if end in body.interfaces}
    others = sorted(set(_flat(pairs)) - found.keys())
    matrix, right = np.zeros((len(others), len(others))), np.zeros(len(others))
    for pair in pairs:
        for one, other in (pair, pair[::-1]):
            if one in found:
                continue
            at = others.index(one)
            matrix[at, at] += 1.0
            if other in found:
                right[at] += found[other]
            else:
                matrix[at, others.index(other)] -= 1.0
    return found | dict(zip(others, np.linalg.solve(matrix, right).tolist(), strict=True))


def _ends(shaft: str) -> tuple[str, str]:
    """Names of the two discs of a shaft from its name, without the number of a parallel shaft after the comma."""
    one, _, other = shaft.partition(" to ")
    return one, other.partition(", ")[0]


def _flat(pairs: Iterable[tuple[str, str]]) -> list[str]:
    return [end for pair in pairs for end in pair]
