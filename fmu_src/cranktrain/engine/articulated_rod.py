"""Articulated rods: motion of the knuckle pins on a master rod, and paths of their pistons.

In the axes of the master's cylinder (y along the cylinder) the crank pin is at P = (x, y) and the path of the piston
pin at x = e. With X = x − e and s = √(L² − X²) the master rod leans by φ, sin φ = X/L, in the sense of rotation, and

    φ̇ = ẋ/s,    φ̈ = ẍ/s + ẋ² X/s³

A knuckle pin at k in the master rod's axes (second axis towards the small end) is at K = P + r with r = R(φ) k. It has
K̇ = Ṗ + φ̇ h and K̈ = P̈ + φ̈ h − φ̇² r, with h = e_z × r. The articulated rod is a slider-crank on K in the axes of its
own cylinder. Source: rigid-body kinematics, see C. F. Taylor, The Internal-Combustion Engine in Theory and Practice,
vol. 2, on master and articulated rods.
"""

import math
from typing import Any, NamedTuple, Protocol

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.types import Array
from cranktrain.engine.parts import ArticulatedRod, Crankshaft, Cylinders, Rod

ARTICULATED = "articulated"
"""Value of ``cylinders.rods_on_pin``."""
REVOLUTION = 2.0 * math.pi
_SAMPLES, _STEPS = 360, 4


class Engine(Protocol):
    """Parts of an engine that determine the motion of its rods."""

    @property
    def crankshaft(self) -> Crankshaft: ...  # noqa: D102
    @property
    def cylinders(self) -> Cylinders: ...  # noqa: D102
    @property
    def rod(self) -> Rod: ...  # noqa: D102
    @property
    def articulated_rod(self) -> ArticulatedRod | None: ...  # noqa: D102
    @property
    def offsets(self) -> tuple[float, ...]: ...  # noqa: D102


class Articulation(NamedTuple):
    """Attachment of an articulated rod to its master rod (SI).

    Attributes
    ----------
    master : cylinder of the master rod, from 0
    length, offset : length of the master rod, and offset e of its cylinder
    x, y : position of the knuckle pin in the master rod's axes, whose origin is the crank pin
    turn : angle of the articulated rod's bank relative to the master's, rad
    """

    master: int
    length: float
    offset: float
    x: float
    y: float
    turn: float


class RodEnd(NamedTuple):
    """Path (…,) of the crank or knuckle pin on which a rod turns, over crank angle, in axes of the rod's cylinder.

    x, y : m; then their first (m/rad) and second derivatives (m/rad²) by the crank angle
    """

    x: Array
    y: Array
    vx: Array
    vy: Array
    ax: Array
    ay: Array


@kernel
def knuckle_motion(x, y, vx, vy, ax, ay, length, offset, k_x, k_y):
    """Position, velocity and acceleration of a knuckle pin from those of the crank pin, in the master cylinder's axes.

    Returns these six values, then h_x, h_y, s, φ̇ and φ̈ of the equations above. For arrays call ``py_func``.
    """
    x = x - offset
    s = np.sqrt(length * length - x * x)
    cos = s / length
    sin = x / length
    p = cos * k_x - sin * k_y
    q = sin * k_x + cos * k_y
    rate = vx / s
    change = ax / s + rate * rate * x / s
    return (
        x + offset + p, y + q, vx - rate * q, vy + rate * p, ax - change * q - rate * rate * p,
        ay + change * p - rate * rate * q, -q, p, s, rate, change,
    )  # fmt: skip


def articulations(engine: Engine) -> tuple[Articulation | None, ...]:
    """Attachment of each cylinder's rod to a master rod; None for rods on the crank pin."""
    cylinders, joint = engine.cylinders, engine.articulated_rod
    found: list[Articulation | None] = [None] * len(cylinders.pins)
    if cylinders.rods_on_pin != ARTICULATED or joint is None:
        return tuple(found)
    for c, pin in enumerate(cylinders.pins):
        master = cylinders.pins.index(pin)
        if master != c:
            turn = cylinders.bank_angles[c] - cylinders.bank_angles[master]
            angle = joint.knuckle_angles[c] if joint.knuckle_angles else turn
            x, y = -joint.knuckle_radius * math.sin(angle), joint.knuckle_radius * math.cos(angle)
            found[c] = Articulation(master, engine.rod.length, engine.offsets[master], x, y, turn)
    return tuple(found)


def rods_of(engine: Engine) -> tuple[Rod, ...]:
    """Rod of each cylinder."""
    own = engine.articulated_rod or engine.rod
    return tuple(engine.rod if joint is None else own for joint in articulations(engine))


def articulated_text(engine: Engine) -> list[str]:
    """Text with one line per master rod: the rods that it carries, which turn on knuckle pins."""
    found: dict[int, list[str]] = {}
    for c, joint in enumerate(articulations(engine)):
        if joint is not None:
            found.setdefault(joint.master, []).append(str(c + 1))
    return [
        f"big_end[{master + 1}] carries the rods of cylinders {', '.join(hung)} too; theirs are knuckle pins"
        for master, hung in found.items()
    ]


def hung_on(joint: Articulation, pin: RodEnd) -> RodEnd:
    """Path of a knuckle pin in axes of its own cylinder, from the crank pin's path in axes of the master's cylinder."""
    moved: Any = knuckle_motion.py_func(*pin, joint.length, joint.offset, joint.x, joint.y)
    cos, sin = math.cos(joint.turn), math.sin(joint.turn)
    turned = [(cos * x + sin * y, cos * y - sin * x) for x, y in zip(moved[0:6:2], moved[1:6:2], strict=True)]
    return RodEnd(*(value for pair in turned for value in pair))


def circle(radius: float | Array, angle: Array) -> RodEnd:
    """Path of a crank pin on its circle, at ``angle`` (…,) from the axis of the cylinder in the sense of rotation."""
    across, along = -radius * np.sin(angle), radius * np.cos(angle)
    return RodEnd(across, along, -along, across, -across, -along)


def rod_end(engine: Engine, cylinder: int, angle: Array) -> RodEnd:
    """Path of the pin on which the rod of ``cylinder`` (from 0) turns, in its axes, at n crank ``angle`` values."""
    cylinders, crank, joint = engine.cylinders, engine.crankshaft, articulations(engine)[cylinder]
    pin = cylinders.pins[cylinder] - 1
    bank = cylinders.bank_angles[cylinder if joint is None else joint.master]
    path = circle(crank.throws[pin], angle + crank.throw_angles[pin] - bank)
    return path if joint is None else hung_on(joint, path)


def piston_height(engine: Engine, cylinder: int, angle: Array) -> tuple[Array, Array]:
    """Height (n,), m, of a piston's pin above the crank axis, and its derivative (n,) by crank angle, m/rad."""
    end, length = rod_end(engine, cylinder, angle), rods_of(engine)[cylinder].length
    x = end.x - engine.offsets[cylinder]
    s = np.sqrt(length**2 - x**2)
    return end.y + s, end.vy - x / s * end.vx


def reach(engine: Engine, cylinder: int) -> float:
    """Largest distance of a rod's pin from the axis of its cylinder over a revolution, m; NaN for impossible motion."""
    angle: Array = np.linspace(0.0, REVOLUTION, _SAMPLES + 1)
    with np.errstate(invalid="ignore"):
        return float(np.abs(rod_end(engine, cylinder, angle).x - engine.offsets[cylinder]).max())


def dead_centre_angles(engine: Engine, cylinder: int) -> tuple[float, float]:
    """Crank angles, rad, of the highest and lowest piston position within a revolution, by Newton's method."""
    angle: Array = np.arange(_SAMPLES, dtype=np.float64) * (REVOLUTION / _SAMPLES)
    height = piston_height(engine, cylinder, angle)[0]
    found, step = angle[[height.argmax(), height.argmin()]], 1e-4
    for _ in range(_STEPS):
        before, now, after = (piston_height(engine, cylinder, found + k * step)[1] for k in (-1, 0, 1))
        found -= now * 2.0 * step / (after - before)
    return float(found[0]), float(found[1])


def dead_centre_heights(engine: Engine, cylinder: int) -> Array:
    """Highest and lowest position (2,), m, of a piston's pin above the crank axis, on the exact path of the pin."""
    return piston_height(engine, cylinder, np.array(dead_centre_angles(engine, cylinder)))[0]
