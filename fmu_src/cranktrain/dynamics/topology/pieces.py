"""Pieces of a connection, each with up to four components of motion and their force law."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.topology.terms import Direction
from cranktrain.dynamics.topology.values import REST, Frame
from cranktrain.engine.parts import BigEndBearing, JournalBearing, Oil

if TYPE_CHECKING:
    from cranktrain.film.elastic.bore_compliance import BoreCompliance
    from cranktrain.film.table.database import FilmTable

LENGTH, ANGLE = 5.0e-5, 1.0e-3
"""Motion (m, rad) that counts like one clearance in convergence tests of a connection without a clearance."""
SAME = 1.0e-9
"""Largest difference at which two ratios or two positions (m) count as equal."""
REFERENCE_VISCOSITY = 0.01
"""Viscosity (Pa s) of oil in a model that is not prepared yet."""


class FilmParts(NamedTuple):
    """Parts that films of added bearings may need in addition to their data.

    Attributes
    ----------
    tables : film tables of any bearings, from which a film takes a fitting one
    mains, bore : the engine's plain main bearings and the compliance of their bores
    big_ends, eye : the engine's big-end bearings and the compliance of the rods' eyes
    oil : dependence of the engine's oil on pressure
    at_main, at_pin : whether the film is that of a main journal in its bore, or of a crank pin in a rod
    first : position (3,) of the first end in the frame of its body, m
    connection : name of the film's connection
    """

    tables: tuple[FilmTable, ...] = ()
    mains: JournalBearing | None = None
    bore: BoreCompliance | None = None
    big_ends: BigEndBearing | None = None
    eye: BoreCompliance | None = None
    oil: Oil | None = None
    at_main: bool = False
    at_pin: bool = False
    first: Array = np.zeros(3)
    connection: str = ""


class Piece(NamedTuple):
    """Piece of a connection: up to four components of motion, and the kernel of their force law.

    Attributes
    ----------
    components : for each component its directions at the first and the second end
    scales : motion of each component that counts like one clearance
    kernel, record : kernel and record of the law; a record that needs the table of all bearings, or where its ends are,
       is made by a call, ``record(table, parts)`` with :class:`FilmParts`
    axes : frame in whose axes the law is evaluated
    pairs : first component of the pairs that rotate with these axes, or −1
    rubs : whether friction torque acts on both ends about z
    closes : whether the closing gap limits steps of the iteration and time steps
    outputs : name, kind and position of each output, see :mod:`cranktrain.dynamics.topology.slots`
    parameters : (COLUMNS,) of a bearing, else None
    viscosity : of its oil, Pa s; 0: the engine's oil, −1: no oil
    cylinder : cylinder of the engine whose gas pressure is input of the law; 0: none
    tilt : motion of the tilt components per rotation of the first end, m or 1; 0 without tilt
    told_oil, told_speed : whether the law takes the actions OIL, and WARM
    tells_rate : whether the law takes the action RATE
    has_mass : whether the law has masses of its own, whose cylinder, the second end, is the ground
    input : slot of a stage's frame whose value is input of the law; −1: none
    carried : whether its forces also do work on the motion of the ends' frames
    holds : number of components, from the first, that hold a body; a push holds nothing
    memory : function ``memory(record)`` of the number of values that the law keeps in the state, or None
    """

    components: list[tuple[Direction, Direction]]
    scales: list[float]
    kernel: Any
    record: Any
    axes: Frame = REST
    pairs: int = -1
    rubs: bool = False
    closes: bool = False
    outputs: tuple[tuple[str, str, int], ...] = ()
    parameters: Array | None = None
    viscosity: float = -1.0
    cylinder: int = 0
    tilt: float = 0.0
    told_oil: bool = False
    told_speed: bool = False
    tells_rate: bool = False
    memory: Callable[[Any], int] | None = None
    carried: bool = False
    has_mass: bool = False
    input: int = -1
    holds: int = 4


def component(frame: Frame, axis: str) -> tuple[Direction, Direction]:
    """Component of motion along an axis of a frame (x, y, z), or about it (rx, ry, rz)."""
    way, still = np.eye(3)["xyz".index(axis[-1])], np.zeros(3)
    return between(frame, still, way) if axis.startswith("r") else between(frame, way, still)


def piece_along(frame: Frame, ways: Sequence[str], kernel: Any, record: Any, **more: Any) -> Piece:
    """Piece with components along and about axes of a frame, whose outputs are forces, moments and motion by axis."""
    components, turns = [component(frame, way) for way in ways], [way.startswith("r") for way in ways]
    outputs = tuple(
        (f"{names[turning]}.{way[-1]}", kind, at)
        for kind, names in (("force", ("force", "moment")), ("place", ("position", "rotation")))
        for at, (way, turning) in enumerate(zip(ways, turns, strict=True))
    )
    scales = more.pop("scales", [ANGLE if turning else LENGTH for turning in turns])
    return Piece(components, scales, kernel, record, outputs=outputs, **more)


def between(frame: Frame, along: Array, about: Array) -> tuple[Direction, Direction]:
    """Component of motion of the first end relative to the second end, with the same directions for both ends."""
    return Direction(frame, along, about), Direction(frame, along, about, -1.0)
