"""A topology as plain values: bodies in frames, and connections between their interfaces.

    gear = Connection("gear", "gear_mesh", (End("crank", "flywheel"), End("balancer", "gear")), {...})
    Topology((Frame("twice", ratio=-2.0, axis=(0.08, -0.05)),), (Body("balancer", shaft, "twice"),), (gear,))

The engine brings the bodies ``crank`` (and what turns with it) and ``block``; ``ground`` is at rest and gives way to
nothing.

A frame turns about an axis parallel to the crank's, ``ratio`` times as fast, so that gears that join bodies of
different frames have no backlash to make up for: motion against the frame is small. A body is described in axes of its
own frame: their origin lies on the frame's axis, at the z of the engine's origin, and they are those of the engine
turned by ``angle``. Where a frame turns backwards its z axis and its y axis are those of the engine reversed, so that
every body turns forwards about its own z axis.

The frame of a rod or of a piston moves as that of a crank without give does (:mod:`.frames`): its origin is the pin's
axis, or that of the piston's pin, its y axis goes along the rod or the cylinder.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.given import given_kind, given_name, given_number, given_numbers
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.frames import frames_at

CRANK, BLOCK, GROUND = "crank", "block", "ground"
"""Bodies that a topology has without being told: those of its engine, and what is at rest."""
OWN = "own"
"""Name of the law that is a function of Python."""
AT_REST = "rest"
"""Name of the frame that does not turn."""


@dataclass(frozen=True)
class Slider:
    """A rod between a crank's pin and the axis of a cylinder, whose frames move as without give.

    Attributes
    ----------
    pin : place of the pin's axis at crank angle 0, x and y in the engine's axes, m
    length : of the rod, m
    bank : angle of the cylinder from the engine's y axis, as cylinders' banks count, rad
    offset : of the cylinder's axis from that of the crank, across the cylinder, m
    piston : whether the frame is the piston's, not the rod's
    cylinder : of the engine, counted from 1, whose own rod, piston and gas are left out; 0: of none
    """

    pin: tuple[float, float]
    length: float
    bank: float = 0.0
    offset: float = 0.0
    piston: bool = False
    cylinder: int = 0

    def __post_init__(self) -> None:
        """Refuse values of another kind; ``InputError``."""
        given_numbers(self.pin, 2, "slider: pin")
        for key in ("length", "bank", "offset", "cylinder"):
            given_number(getattr(self, key), f"slider: {key}")


@dataclass(frozen=True)
class Frame:
    """Axes that move with the crank.

    Attributes
    ----------
    name : by which bodies refer to it
    ratio : turns per turn of the crank, negative: the other way round; 0: at rest
    angle : at crank angle 0, about the frame's own axis of rotation, rad
    axis : its place across the crank's axis, x and y in the engine's axes, m
    slider : where it is that of a rod or of a piston; ``ratio`` and ``axis`` are those of its crank then
    """

    name: str
    ratio: float = 0.0
    angle: float = 0.0
    axis: tuple[float, float] = (0.0, 0.0)
    slider: Slider | None = None

    def __post_init__(self) -> None:
        """Refuse values of another kind, and rods that do not reach their cylinder; ``InputError``."""
        given_kind(self.name, str, "frame: name", "give a text")
        given_number(self.ratio, f"frame '{self.name}': ratio")
        given_number(self.angle, f"frame '{self.name}': angle")
        given_numbers(self.axis, 2, f"frame '{self.name}': axis")
        if self.slider is not None:
            given_kind(self.slider, Slider, f"frame '{self.name}': slider", "give a ct.Slider(pin, length)")
            reach = math.hypot(*self._arm()) + abs(self.slider.offset)
            if self.slider.length <= reach:
                raise InputError(
                    f"frame '{self.name}': a rod of {1e3 * self.slider.length:.4g} mm is no longer than the crank's "
                    f"throw and the cylinder's offset together, {1e3 * reach:.4g} mm; give a longer one"
                )

    def _arm(self) -> tuple[float, float]:
        """The pin's place across and along the cylinder from its crank's axis at crank angle 0, m."""
        if self.slider is None:
            return 0.0, 0.0
        x, y = self.slider.pin[0] - self.axis[0], self.slider.pin[1] - self.axis[1]
        cos, sin = math.cos(self.slider.bank), math.sin(self.slider.bank)
        return cos * x + sin * y, cos * y - sin * x

    @property
    def sense(self) -> float:
        """1, or −1 where it turns backwards."""
        return -1.0 if self.ratio < 0.0 and self.slider is None else 1.0

    @property
    def rate(self) -> float:
        """Mean turns about its own z axis per turn of the crank, not negative."""
        return abs(self.ratio) if self.slider is None else 0.0

    @property
    def swings(self) -> bool:
        """Whether it turns to and fro, as that of a rod."""
        return self.slider is not None and not self.slider.piston

    @property
    def row(self) -> Array:
        """What :func:`~cranktrain.dynamics.topology.frames.move_frames` knows of it, (FRAME,)."""
        if self.slider is None:
            return np.array([at.TURNING, self.ratio, self.sense * self.angle, 0.0, 0.0, 0.0, 0.0])
        kind = at.PISTON_FRAME if self.slider.piston else at.ROD_FRAME
        return np.array([kind, self.ratio, self.slider.bank, *self._arm(), self.slider.length, self.slider.offset])

    def moved(self, theta: float) -> Array:
        """Its angle, place and their derivatives at a crank angle (rad), (MOVED,), see ``slots``."""
        return np.asarray(frames_at(self.row[None], theta)[0])

    @property
    def origin(self) -> Array:
        """Its origin (3,) at crank angle 0 in the engine's axes, m."""
        x, y = self.moved(0.0)[[at.PLACE_X, at.PLACE_Y]]
        return np.array([self.axis[0] + x, self.axis[1] + y, 0.0])

    def local(self, place: Array) -> Array:
        """A place (3,) of the engine's axes at crank angle 0 in the frame's, m."""
        return self.turned(np.asarray(place, dtype=float) - self.origin)

    def turned(self, direction: Array) -> Array:
        """A direction (3,) of the engine's axes at crank angle 0 in the frame's."""
        angle = self.sense * float(self.moved(0.0)[at.TURNED])
        cos, sin = math.cos(angle), math.sin(angle)
        x, y, z = np.asarray(direction, dtype=float) * np.array([1.0, self.sense, self.sense])
        return np.array([cos * x + sin * y, cos * y - sin * x, z])


REST = Frame(AT_REST)


@dataclass(frozen=True, eq=False)
class Body:
    """A reduced body in a frame; ``name`` is that of its outputs."""

    name: str
    reduced: ReducedBody
    frame: str = AT_REST

    def __post_init__(self) -> None:
        """Refuse values of another kind; ``InputError``."""
        given_name(self.name, "body")
        where = f"body '{self.name}'"
        given_kind(self.reduced, ReducedBody, f"{where}: reduced", "give a ct.ReducedBody, e.g. by ct.rigid_body")
        given_kind(self.frame, str, f"{where}: frame", "give the frame's name")


@dataclass(frozen=True)
class End:
    """Where a connection holds a body: at an interface, or rigidly beside it by ``offset`` (m, in axes of the body)."""

    body: str
    interface: str = ""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Refuse values of another kind; ``InputError``."""
        for key in ("body", "interface"):
            given_kind(getattr(self, key), str, f"end: {key}", "give its name")
        given_numbers(self.offset, 3, f"end '{self.body}.{self.interface}': offset")


@dataclass(frozen=True)
class Connection:
    """One law between its ends, see :mod:`cranktrain.dynamics.topology.laws`; ``data`` are the law's own (SI).

    ``law`` is a name, or a law of :func:`cranktrain.law`.
    """

    name: str
    law: Any
    ends: tuple[End, ...]
    data: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse values of another kind; ``InputError``."""
        given_name(self.name, "connection")
        where = f"connection '{self.name}'"
        if hasattr(self.law, "stated"):
            object.__setattr__(self, "data", self.law.stated(self.data, where))
            object.__setattr__(self, "law", OWN)
        given_kind(self.law, str, f"{where}: law", "give the name of one")
        given_kind(self.ends, tuple, f"{where}: ends", "give a tuple of ct.End")
        for end in self.ends:
            given_kind(end, End, f"{where}: an end", "give ct.End(body, interface)")


@dataclass(frozen=True)
class Topology:
    """What stands beside an engine, or alone.

    Attributes
    ----------
    frames : those that turn; ``rest`` need not be named, nor the crank's
    bodies, connections : in any order
    """

    frames: tuple[Frame, ...] = ()
    bodies: tuple[Body, ...] = ()
    connections: tuple[Connection, ...] = ()

    def __post_init__(self) -> None:
        """Refuse names that are used twice, and references to what does not exist; ``InputError``."""
        for noun, items, kind in (
            ("frame", self.frames, Frame), ("body", self.bodies, Body), ("connection", self.connections, Connection),
        ):  # fmt: skip
            given_kind(items, tuple, f"topology: the list of each {noun}", f"give a tuple of ct.{kind.__name__}")
            for item in items:
                given_kind(item, kind, f"topology: a {noun}", f"give a ct.{kind.__name__}")
            names = [item.name for item in items]
            for name in names:
                if names.count(name) > 1:
                    raise InputError(f"topology: {noun} '{name}' is there twice; give one of them another name")
        for body in self.bodies:
            if body.name in (CRANK, BLOCK, GROUND):
                raise InputError(f"topology: body '{body.name}' has a name that the engine uses; give it another one")
            self.frame(body.frame)
        known = [CRANK, BLOCK, GROUND, *(body.name for body in self.bodies)]
        for connection in self.connections:
            places = {(end.body, end.interface) for end in connection.ends}
            if len(connection.ends) > 1 and len(places) == 1 and connection.ends[0].body != GROUND:
                raise InputError(f"connection '{connection.name}': all its ends are at one place; join two bodies")
            for end in connection.ends:
                if end.body not in known:
                    raise InputError(
                        f"connection '{connection.name}': no body '{end.body}'; {nearest(end.body, known)}"
                    )

    def frame(self, name: str) -> Frame:
        """A frame by name; ``InputError`` where there is none."""
        found = {CRANK: Frame(CRANK, 1.0), AT_REST: REST} | {frame.name: frame for frame in self.frames}
        if name not in found:
            raise InputError(f"topology: no frame '{name}'; {nearest(name, list(found))}")
        return found[name]

    def end_frame(self, end: End) -> Frame:
        """Frame of the body that an end holds."""
        if end.body == CRANK:
            return self.frame(CRANK)
        return self.frame(AT_REST if end.body in (BLOCK, GROUND) else self.body(end.body).frame)

    def body(self, name: str) -> Body:
        """A body of its own by name; ``KeyError`` where there is none."""
        return next(body for body in self.bodies if body.name == name)

    @property
    def cylinders(self) -> set[int]:
        """Cylinders of the engine whose rods are bodies of this topology."""
        return {frame.slider.cylinder for frame in self.frames if frame.slider is not None and frame.slider.cylinder}

    def plus(self, other: Topology) -> Topology:
        """Both together."""
        return replace(
            self, frames=self.frames + other.frames, bodies=self.bodies + other.bodies,
            connections=self.connections + other.connections,
        )  # fmt: skip
