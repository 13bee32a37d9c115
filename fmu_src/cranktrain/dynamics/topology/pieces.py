"""Pieces of a connection: up to four components of motion each, and the law that answers them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.topology.terms import Direction
from cranktrain.dynamics.topology.values import REST, Frame
from cranktrain.engine.parts import JournalBearing, Oil
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.table.database import FilmTable

LENGTH, ANGLE = 5.0e-5, 1.0e-3
"""Motion (m, rad) that counts as much as a clearance in a connection without one."""
SAME = 1.0e-9
"""Ratios or places (m) that differ by less are the same."""
REFERENCE_VISCOSITY = 0.01
"""Viscosity (Pa s) of oil in a model that is not prepared yet."""


class FilmParts(NamedTuple):
    """What films of added bearings may need besides their data.

    Attributes
    ----------
    tables : film tables of any bearings, of which a film takes one that fits
    mains, bore : the engine's plain main bearings and the compliance of their bores
    oil : dependence of the engine's oil on pressure
    at_main : whether the film is that of a main journal in its bore
    connection : name of the film's connection
    """

    tables: tuple[FilmTable, ...] = ()
    mains: JournalBearing | None = None
    bore: BoreCompliance | None = None
    oil: Oil | None = None
    at_main: bool = False
    connection: str = ""


class Piece(NamedTuple):
    """Up to four components of a connection, and the kernel that answers their motion.

    Attributes
    ----------
    components : of each component what it measures of the first and of the second end
    scales : motion that counts as much as a clearance
    kernel, record : of the law; a record that refers to the table of all bearings is made by a call,
        ``record(table, parts)`` with :class:`FilmParts`
    axes : frame in whose axes the law is evaluated
    pairs : first component of the pairs that turn with these axes, −1: none
    rubs : whether friction turns both ends about z
    closes : whether steps of the iteration are limited, and time steps by how fast the gap closes
    outputs : what is shown of it: name, kind and place, see :mod:`cranktrain.dynamics.topology.slots`
    parameters : (COLUMNS,) of a bearing; else nothing
    viscosity : of its oil, Pa s; 0: the engine's, −1: it has none
    cylinder : of the engine, of whose gas the law is told; 0: of none
    tilt : what a rotation of the first end moves the components by that measure tilt, m or 1; 0: none does
    told_oil, told_speed : whether the law takes the actions OIL, and WARM
    tells_rate : whether the law takes the action RATE
    carried : whether its forces work on what the ends' frames carry along
    memory : how many values the law's record keeps in the state, ``memory(record)``; None: none
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


def between(frame: Frame, along: Array, about: Array) -> tuple[Direction, Direction]:
    """Motion of the first end against the second one, both measured alike."""
    return Direction(frame, along, about), Direction(frame, along, about, -1.0)
