"""Components of a connection's motion as sums over ports, with coefficients that depend on the crank angle.

A component is the motion of one end relative to the other along a direction, or the rotation about it,

    d = Σ c(θ) u,    ḋ = Σ (c u̇ + Ω c′ u),    c = A cos(α_g − α_o + ψ),    θ the crank's frame

with one *term* for each port. A direction fixed in one frame has a constant component along z in any other frame, and
lateral components that rotate with the difference of both frames' angles α. A force F of the component acts on the
ports by the transpose, c F, so one table serves motion, forces and compliance.

If a body's end slides over a body at rest, as a piston over its block, the contact point moves over the latter by ρ(θ).
A rotation φ of that body then adds the motion φ×ρ at this point. Such terms are c(θ) times x or y of ρ.
"""

import cmath
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.values import REST, End, Frame

SMALL = 1.0e-14
"""Amplitude of a term, relative to the largest term of a component, below which the term is omitted."""
PORTS = 6
"""Number of components of motion of an interface: displacement x, y, z and rotation about x, y, z."""


class Term(NamedTuple):
    """Contribution of one port, ``component`` of the motion of an interface, to a component of a connection."""

    body: str
    interface: str
    component: int
    amplitude: float
    given: Frame  # frame in which the direction is fixed
    own: Frame  # frame of the body; ``given`` and ``own`` are REST if the angle between both is constant
    phase: float = 0.0
    lever: Frame | None = None  # frame whose origin's motion since crank angle 0 is a factor of the term
    way: int = 0  # component of the lever's motion: x or y in the engine's axes


class Direction(NamedTuple):
    """Direction of a component at one end: displacement along a vector plus rotation about another one.

    Both vectors are fixed in ``frame`` and given in its axes; ``sign`` is −1 for the end that motion is relative to.
    """

    frame: Frame
    along: Array  # (3,) direction of displacement
    about: Array  # (3,) axis of rotation; in m for a component of displacement
    sign: float = 1.0


def terms_of(end: End, frame: Frame, direction: Direction, sliding: Frame | None = None) -> list[Term]:
    """Terms of one end, whose body is described in ``frame``; ``sliding`` is the frame of an end sliding over it."""
    along, about = (_seen(direction.frame, vector, frame) for vector in (direction.along, direction.about))
    # At an offset ρ from its interface a body moves by u + φ×ρ, so the direction d also measures φ·(ρ×d).
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
"""Coefficient of a term as a sum: constant at key False, and A exp(iψ) of A cos(α_g − α_o + ψ) at key True."""


def _seen(frame: Frame, vector: Array, other: Frame) -> list[_Parts]:
    """Components of a vector fixed in ``frame`` in the axes of another frame."""
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
    """True if two frames rotate relative to each other, as the frames of two different rods do."""
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
