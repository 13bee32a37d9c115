"""Components of a connection's motion as sums over ports, with coefficients that are cosines of the crank angle.

A component is how far one end moves against the other along a direction, or turns about it:

    d = Σ A cos(kθ + ψ) u,    ḋ = Σ A [cos(kθ + ψ) u̇ − kΩ sin(kθ + ψ) u],    θ the crank's frame

one *term* a port. A direction fixed in one frame has constant components along z in any other, and ones that turn with
the difference of both frames across it; k is that difference. What a force F of the component does to the ports is the
transpose, A cos(kθ + ψ) F: one table serves motion, forces and compliance.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.topology.values import End, Frame

SMALL = 1.0e-14
"""Amplitude over the largest of a component below which a term is left out."""
PORTS = 6
"""Components of motion of an interface: displacement x, y, z and rotation about x, y, z."""


class Term(NamedTuple):
    """Share of one port, ``component`` of the motion of an interface, in a component of a connection."""

    body: str
    interface: str
    component: int
    amplitude: float
    factor: float
    phase: float


class Direction(NamedTuple):
    """What a component measures of one end: displacement along a vector and rotation about another one.

    Both are fixed in ``frame``, given in its axes; ``sign`` −1 for the end against which the motion counts.
    """

    frame: Frame
    along: Array  # (3,)
    about: Array  # (3,), m for a component of displacement
    sign: float = 1.0


def terms_of(end: End, frame: Frame, direction: Direction) -> list[Term]:
    """Terms of one end, whose body is described in ``frame``."""
    along, about = (_seen(direction.frame, vector, frame) for vector in (direction.along, direction.about))
    # At an offset ρ from its interface a body moves by u + φ×ρ: the direction d measures φ·(ρ×d) besides.
    x, y, z = end.offset
    lever = [
        _sum((y, along[2]), (-z, along[1])), _sum((z, along[0]), (-x, along[2])), _sum((x, along[1]), (-y, along[0])),
    ]  # fmt: skip
    found = []
    for component in range(PORTS):
        parts = along[component] if component < 3 else _sum((1.0, about[component - 3]), (1.0, lever[component - 3]))
        for factor, amplitude in parts.items():
            if factor == 0.0:
                size, phase = direction.sign * amplitude.real, 0.0
            else:
                size, phase = direction.sign * abs(amplitude), math.atan2(amplitude.imag, amplitude.real)
            found.append(Term(end.body, end.interface, component, size, factor, phase))
    largest = max((abs(term.amplitude) for term in found), default=0.0)
    return [term for term in found if abs(term.amplitude) > SMALL * largest]


_Parts = dict[float, complex]
"""Coefficient as a sum: by factor k the A exp(iψ) of A cos(kθ + ψ)."""


def _seen(frame: Frame, vector: Array, other: Frame) -> list[_Parts]:
    """A vector fixed in ``frame`` by its components in the axes of another one."""
    x, y, z = (float(value) for value in vector)
    # Angle of the x axes in the engine's axes, per crank angle and at crank angle 0.
    factor = frame.sense * frame.rate - other.sense * other.rate
    start = frame.sense * frame.angle - other.sense * other.angle
    turn = complex(math.cos(start), math.sin(start))
    # Across: as complex numbers the vector x + i s y of one frame is (x + i s y) exp(iα) in the other's, its part along
    # y being the imaginary one times the other's sense. Its real part is A cos(α) with A = x + i s y, likewise the
    # imaginary one −i A.
    whole = complex(x, frame.sense * y) * turn
    across = [{factor: whole}, {factor: -1j * other.sense * whole}]
    if factor == 0.0:
        across = [{0.0: complex(part[0.0].real)} for part in across]
    return [*across, {0.0: complex(frame.sense * other.sense * z)}]


def _sum(*shares: tuple[float, _Parts]) -> _Parts:
    total: _Parts = {}
    for weight, parts in shares:
        for factor, amplitude in parts.items():
            if weight != 0.0:
                total[factor] = total.get(factor, 0.0) + weight * amplitude
    return total


def unit(axis: int) -> Array:
    """Unit vector (3,) along an axis."""
    return np.eye(3)[axis]
