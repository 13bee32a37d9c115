"""Components of a connection's motion as sums over ports, with coefficients that follow the crank angle.

A component is how far one end moves against the other along a direction, or turns about it:

    d = Σ c(θ) u,    ḋ = Σ (c u̇ + Ω c′ u),    c = A cos(α_g − α_o + ψ),    θ the crank's frame

one *term* a port. A direction fixed in one frame has constant components along z in any other, and ones that turn with
the difference of both frames' angles α across it. What a force F of the component does to the ports is the transpose,
c F: one table serves motion, forces and compliance.

Where a body's end slides over one at rest, as a piston over its block, the point where they touch moves over the latter
by ρ(θ), and a body that turns by φ moves there by φ×ρ besides: such terms are c(θ) times x or y of ρ.
"""

from __future__ import annotations

import cmath
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.values import REST, End, Frame

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
    given: Frame  # of the direction
    own: Frame  # of the body; both at rest where their angles' difference is constant
    phase: float = 0.0
    lever: Frame | None = None  # whose origin's motion since crank angle 0 is a factor
    way: int = 0  # of it: x or y in the engine's axes


class Direction(NamedTuple):
    """What a component measures of one end: displacement along a vector and rotation about another one.

    Both are fixed in ``frame``, given in its axes; ``sign`` −1 for the end against which the motion counts.
    """

    frame: Frame
    along: Array  # (3,)
    about: Array  # (3,), m for a component of displacement
    sign: float = 1.0


def terms_of(end: End, frame: Frame, direction: Direction, sliding: Frame | None = None) -> list[Term]:
    """Terms of one end, whose body is described in ``frame``; at rest where one of frame ``sliding`` slides over it."""
    along, about = (_seen(direction.frame, vector, frame) for vector in (direction.along, direction.about))
    # At an offset ρ from its interface a body moves by u + φ×ρ: the direction d measures φ·(ρ×d) besides.
    x, y, z = end.offset
    lever = [
        _sum((y, along[2]), (-z, along[1])), _sum((z, along[0]), (-x, along[2])), _sum((x, along[1]), (-y, along[0])),
    ]  # fmt: skip
    found = []

    def add(component: int, parts: _Parts, weight: float = 1.0, over: Frame | None = None, way: int = 0) -> None:
        for turning, amplitude in parts.items():
            frames = (direction.frame, frame) if turning else (REST, REST)
            size, phase = (abs(amplitude), cmath.phase(amplitude)) if turning else (amplitude.real, 0.0)
            size *= weight * direction.sign
            found.append(Term(end.body, end.interface, component, size, *frames, phase, over, way))

    for component in range(3):
        add(component, along[component])
        add(component + 3, _sum((1.0, about[component]), (1.0, lever[component])))
    largest = max((abs(term.amplitude) for term in found), default=0.0)
    if sliding is not None:
        for component, parts, way, weight in ((3, 2, 1, 1.0), (4, 2, 0, -1.0), (5, 1, 0, 1.0), (5, 0, 1, -1.0)):
            add(component, along[parts], weight, sliding, way)
    return [term for term in found if abs(term.amplitude) > SMALL * largest]


_Parts = dict[bool, complex]
"""Coefficient as a sum: its constant part, and by True the A exp(iψ) of A cos(α_g − α_o + ψ)."""


def _seen(frame: Frame, vector: Array, other: Frame) -> list[_Parts]:
    """A vector fixed in ``frame`` by its components in the axes of another one."""
    x, y, z = (float(value) for value in vector)
    # Across: as complex numbers the vector x + i s y of one frame is (x + i s y) exp(iα) in the other's, its part along
    # y being the imaginary one times the other's sense. Its real part is A cos(α) with A = x + i s y, likewise the
    # imaginary one −i A.
    whole = complex(x, frame.sense * y)
    turning = turns_against(frame, other)
    if not turning:
        apart = frame.moved(0.0)[at.TURNED] - other.moved(0.0)[at.TURNED]
        whole *= cmath.exp(1j * apart)
    across = [{turning: whole}, {turning: -1j * other.sense * whole}]
    if not turning:
        across = [{False: complex(part[False].real)} for part in across]
    return [*across, {False: complex(frame.sense * other.sense * z)}]


def turns_against(frame: Frame, other: Frame) -> bool:
    """Whether two frames turn against each other, two different rods' among them."""
    if frame == other:
        return False
    return frame.swings or other.swings or frame.sense * frame.rate != other.sense * other.rate


def _sum(*shares: tuple[float, _Parts]) -> _Parts:
    total: _Parts = {}
    for weight, parts in shares:
        for turning, amplitude in parts.items():
            if weight != 0.0:
                total[turning] = total.get(turning, 0.0) + weight * amplitude
    return total


def unit(axis: int) -> Array:
    """Unit vector (3,) along an axis."""
    return np.eye(3)[axis]
