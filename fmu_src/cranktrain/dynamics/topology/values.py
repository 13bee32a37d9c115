"""Topology as plain values: bodies in frames, and connections between interfaces of the bodies.

    gear = Connection("gear", "gear_mesh", (End("crank", "flywheel"), End("balancer", "gear")), {...})
    Topology((Frame("twice", ratio=-2.0, axis=(0.08, -0.05)),), (Body("balancer", shaft, "twice"),), (gear,))

The engine provides the bodies ``crank`` (with all that rotates with it) and ``block``; ``ground`` is rigid and at rest.

A frame rotates about an axis parallel to the crank's, ``ratio`` times as fast. Frames of bodies joined by gears rotate
with the gear ratio, so motion relative to a frame is small. A body is described in axes of its own frame. Their origin
lies on the frame's axis, at the z of the engine's origin, and they are those of the engine rotated by ``angle``. If a
frame rotates backwards, its z and y axes are those of the engine reversed, so that every body rotates forwards about
its own z axis.

The frame of a rod or of a piston moves as for a rigid crank (:mod:`.frames`). Its origin is the axis of the crank pin
or of the piston pin, and its y axis is along the rod or the cylinder.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cranktrain.core.argument_checks import given_kind, given_name, given_number, given_numbers
from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.frames import frames_at

CRANK, BLOCK, GROUND = "crank", "block", "ground"
"""Names of bodies that every topology has: those of its engine, and the ground at rest."""
OWN = "own"
"""Name of the law that is a function of Python."""
AT_REST = "rest"
"""Name of the frame at rest."""


@dataclass(frozen=True)
class Slider:
    """Rod between a crank's pin and the axis of a cylinder, for frames that move as rigid rod or piston.

    Attributes
    ----------
    pin : position of the pin's axis at crank angle 0, x and y in the engine's axes, m
    length : of the rod, m
    bank : angle of the cylinder from the engine's y axis, like the banks of cylinders, rad
    offset : of the cylinder's axis from that of the crank, across the cylinder, m
    piston : whether the frame is the piston's, not the rod's
    cylinder : cylinder of the engine, from 1, whose own rod, piston and gas are replaced; 0: none
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
    """Frame: axes that move with the crank.

    Attributes
    ----------
    name : name by which bodies refer to it
    ratio : rotation per rotation of the crank, negative for the opposite sense; 0: at rest
    angle : angle at crank angle 0, about the frame's own axis of rotation, rad
    axis : position of its axis relative to the crank's axis, x and y in the engine's axes, m
    slider : set for the frame of a rod or of a piston; ``ratio`` and ``axis`` are then those of its crank
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
        """Position of the pin across and along the cylinder from its crank's axis at crank angle 0, m."""
        if self.slider is None:
            return 0.0, 0.0
        x, y = self.slider.pin[0] - self.axis[0], self.slider.pin[1] - self.axis[1]
        cos, sin = math.cos(self.slider.bank), math.sin(self.slider.bank)
        return cos * x + sin * y, cos * y - sin * x

    @property
    def sense(self) -> float:
        """Sense of rotation: 1, or −1 if the frame rotates backwards."""
        return -1.0 if self.ratio < 0.0 and self.slider is None else 1.0

    @property
    def rate(self) -> float:
        """Mean rotation of the frame about its own z axis per rotation of the crank, not negative."""
        return abs(self.ratio) if self.slider is None else 0.0

    @property
    def swings(self) -> bool:
        """True if the frame swings, as the frame of a rod does."""
        return self.slider is not None and not self.slider.piston

    @property
    def row(self) -> Array:
        """Row (FRAME,) of the frame for :func:`~cranktrain.dynamics.topology.frames.move_frames`."""
        if self.slider is None:
            return np.array([at.TURNING, self.ratio, self.sense * self.angle, 0.0, 0.0, 0.0, 0.0])
        kind = at.PISTON_FRAME if self.slider.piston else at.ROD_FRAME
        return np.array([kind, self.ratio, self.slider.bank, *self._arm(), self.slider.length, self.slider.offset])

    def moved(self, theta: float) -> Array:
        """Angle, position and their derivatives at a crank angle (rad), (MOVED,), see ``slots``."""
        return np.asarray(frames_at(self.row[None], theta)[0])

    @property
    def origin(self) -> Array:
        """Origin (3,) of the frame at crank angle 0 in the engine's axes, m."""
        x, y = self.moved(0.0)[[at.PLACE_X, at.PLACE_Y]]
        return np.array([self.axis[0] + x, self.axis[1] + y, 0.0])

    def local(self, place: Array) -> Array:
        """Position (3,) in axes of the frame, m, from a position in the engine's axes at crank angle 0."""
        return self.turned(np.asarray(place, dtype=float) - self.origin)

    def turned(self, direction: Array) -> Array:
        """Direction (3,) in axes of the frame, from a direction in the engine's axes at crank angle 0."""
        angle = self.sense * float(self.moved(0.0)[at.TURNED])
        cos, sin = math.cos(angle), math.sin(angle)
        x, y, z = np.asarray(direction, dtype=float) * np.array([1.0, self.sense, self.sense])
        return np.array([cos * x + sin * y, cos * y - sin * x, z])


REST = Frame(AT_REST)


@dataclass(frozen=True, eq=False)
class Body:
    """Reduced body in a frame; ``name`` also names its outputs."""

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
    """End of a connection on a body: at an interface, or at a rigid ``offset`` from it (m, in axes of the body)."""

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
    """Connection of bodies by one force law, see :mod:`cranktrain.dynamics.topology.laws`; ``data`` (SI) are the law's.

    ``law`` is a name, or a law made by :func:`cranktrain.law`.
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
    """Bodies and connections that are added to an engine, or form a system without an engine.

    Attributes
    ----------
    frames : moving frames; ``rest`` and the crank's frame need not be listed
    bodies, connections : in any order
    """

    frames: tuple[Frame, ...] = ()
    bodies: tuple[Body, ...] = ()
    connections: tuple[Connection, ...] = ()

    def __post_init__(self) -> None:
        """Refuse names that are used twice, and references to missing frames and bodies; ``InputError``."""
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
        """Frame of this topology by name; ``InputError`` for an unknown name."""
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
        """Body of this topology by name."""
        return next(body for body in self.bodies if body.name == name)

    @property
    def cylinders(self) -> set[int]:
        """Cylinders of the engine whose rods are bodies of this topology."""
        return {frame.slider.cylinder for frame in self.frames if frame.slider is not None and frame.slider.cylinder}

    def plus(self, other: Topology) -> Topology:
        """Topology with the frames, bodies and connections of this topology and another."""
        return replace(
            self, frames=self.frames + other.frames, bodies=self.bodies + other.bodies,
            connections=self.connections + other.connections,
        )  # fmt: skip
