"""Bodies, frames and connections that an engine file adds to crank and block, as arrays of tables.

    [[frame]]                                  [[body]]
    name = "left"                              name = "balancer[1]"
    ratio = { value = -2, ... }                frame = "left"
    axis = { value = [-80, -60], ... }         mass = { value = 1.8, unit = "kg", ... }
                                               inertia = { value = [...], unit = "kg m^2", ... }
    [[connection]]                             centre = { value = [-80, -62, 160], unit = "mm", ... }
    name = "gear"                              interfaces = ["front", "gear", "rear"]
    law = "gear_mesh"                          x = { value = [...], unit = "mm", ... }
    ends = ["crank.flywheel", "balancer[1].gear"]
    stiffness = { value = 2e8, unit = "N/m", ... }

Positions are in the engine's axes at crank angle 0. An end is a body and one of its interfaces. ``crank`` and ``block``
are the engine's own bodies; ``ground`` has no interface. With ``place`` both ends are points at this position, rigidly
fixed to their interfaces.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from cranktrain.core.argument_checks import given_name
from cranktrain.core.errors import nearest
from cranktrain.engine import connections as laws
from cranktrain.engine import quantities as q
from cranktrain.engine.mount_dynamics import MountDynamics
from cranktrain.engine.parts import Given, Needed
from cranktrain.engine.quantities import check_values, need

GROUND = "ground"


@dataclass(frozen=True)
class FrameTable:
    """Axes that rotate ``ratio`` times as fast as a crank about an ``axis`` (x, y) parallel to its own, or a rod's.

    Attributes
    ----------
    motion : ``turning``, or the motion of the ``rod`` or ``piston`` on a turning crank
    ratio, axis : of the frame, or of the crank that moves the rod
    angle : angle of a turning frame at crank angle 0, rad
    cylinder : cylinder of the engine (from 1) whose rod or piston the frame follows; it supplies all values below, and
        the engine's own rod, piston and gas of this cylinder are left out
    pin : position of the crank pin across the axis at crank angle 0, x and y, m
    length, bank, offset : length of the rod, m; angle of the cylinder from the y axis, rad; offset of its axis from the
        crank's, m
    """

    @staticmethod
    def needed(given: Given) -> Needed:
        """Keys that a rod or piston needs if no cylinder of the engine supplies them."""
        alone = given("motion") in ("rod", "piston") and not given("cylinder")
        return Needed(("pin", "length"), "give the cylinder whose rod it is, or") if alone else Needed()

    name: str
    ratio: q.GearRatio = 1.0
    axis: tuple[q.Offset, ...] = (0.0, 0.0)
    angle: q.Angle = 0.0
    motion: q.FrameMotion = "turning"
    cylinder: q.CylinderNumber = 0
    pin: tuple[q.Offset, ...] = ()
    length: q.Offset = 0.0
    bank: q.Angle = 0.0
    offset: q.Offset = 0.0


@dataclass(frozen=True)
class BodyTable:
    """A rigid body by its mass, an elastic shaft by its stations, or a reduced body from a ``file``, in a frame.

    Attributes
    ----------
    inertia : moments about x, y, z through the centre of mass, or six values xx, yy, zz, xy, xz, yz, kg m²
    centre : centre of mass, m
    interfaces, x, y, z : names of the interfaces and their positions, m
    file : file of a reduced body or superelement, described in axes of its frame; no other key is given with it
    stations, diameters : of a shaft along its frame's axis: positions z of its steps and ends, m, and the diameter of
        each piece between them, m
    areas, second_moments : in place of diameters, m², m⁴; for a rod those in the plane of its motion
    along : axis of the frame along which stations lie, ``z``, or ``y`` of a rod. Then stations and the interfaces'
        ``y`` are distances from the frame's origin, the rod's big end, and one ``z`` gives the plane of its motion
    youngs_modulus, poisson_ratio, density, damping_ratio : of a shaft
    cutoff_hz : highest natural frequency of a shaft's modes; the static compliance of stiffer modes is kept
    discs, disc_masses, disc_polar, disc_diametral, disc_x, disc_y : interfaces of a shaft that carry a disc, its mass
        and moments of inertia, polar about z, and the offset of its centre of mass from the interface
    """

    @staticmethod
    def needed(given: Given) -> Needed:
        """Keys that a rigid body or a shaft needs; none if a file describes the body."""
        if given("file"):
            return Needed()
        if not given("stations"):
            return Needed(("mass", "inertia", "centre", "interfaces", "x", "y", "z"), "a rigid body needs")
        sections = ("areas", "second_moments") if given("areas") or given("second_moments") else ("diameters",)
        places = ("y", "z") if given("along") == "y" else ("z",)
        discs = ("disc_masses", "disc_polar", "disc_diametral") if given("discs") else ()
        return Needed(("interfaces", *places, *sections, *discs), "a shaft of stations needs")

    name: str
    frame: str = "rest"
    mass: q.AddedMass = 0.0
    inertia: tuple[q.ProductOfInertia, ...] = ()
    centre: tuple[q.Offset, ...] = ()
    interfaces: tuple[str, ...] = ()
    x: tuple[q.Offset, ...] = ()
    y: tuple[q.Offset, ...] = ()
    z: tuple[q.Offset, ...] = ()
    file: str = ""
    stations: tuple[q.Offset, ...] = ()
    diameters: tuple[q.Size, ...] = ()
    areas: tuple[q.SectionArea, ...] = ()
    second_moments: tuple[q.SecondMoment, ...] = ()
    along: q.BeamAxis = "z"
    youngs_modulus: q.Modulus = 210.0e9
    poisson_ratio: q.PoissonRatio = 0.3
    density: q.Density = 7850.0
    damping_ratio: q.DampingRatio = 0.01
    cutoff_hz: q.Frequency = 3000.0
    discs: tuple[str, ...] = ()
    disc_masses: tuple[q.Mass, ...] = ()
    disc_polar: tuple[q.Inertia, ...] = ()
    disc_diametral: tuple[q.Inertia, ...] = ()
    disc_x: tuple[q.Offset, ...] = ()
    disc_y: tuple[q.Offset, ...] = ()

    @property
    def made_of_files_or_elements(self) -> bool:
        """True if the body needs a file or finite elements in addition to its table."""
        return bool(self.file or self.stations)

    @property
    def held_at(self) -> tuple[float, ...]:
        """Positions of a shaft's interfaces along its stations, m."""
        return self.y if self.along == "y" else self.z


@dataclass(frozen=True)
class ConnectionTable:
    """A force law between two ends, ``body.interface``; its data are in the field with the law's name."""

    name: str
    law: str
    ends: tuple[str, ...]
    place: tuple[q.Offset, ...] = ()
    gear_mesh: laws.GearMesh | None = None
    coupling: laws.Coupling | None = None
    spring: laws.Spring | None = None
    load: laws.Load | None = None
    film: laws.Film | None = None
    rigid_gear: laws.RigidGear | None = None
    planetary: laws.Planetary | None = None
    belt: laws.Belt | None = None
    gas: laws.Gas | None = None
    liner: laws.Liner | None = None
    roller: laws.Roller | None = None
    thrust: laws.Thrust | None = None
    damper: laws.RingDamper | None = None
    axial_joint: laws.SlidingJoint | None = None
    slider_crank: laws.SliderCrank | None = None
    own: laws.Own | None = None

    @property
    def data(self) -> Any:
        """Data of the connection's law."""
        return getattr(self, self.law)


class Additions(NamedTuple):
    """Frames, bodies and connections that are added to crank and block."""

    frame: tuple[FrameTable, ...] = ()
    body: tuple[BodyTable, ...] = ()
    connection: tuple[ConnectionTable, ...] = ()


TEXTS = {
    "frame": ("name", "motion"),
    "body": ("name", "frame", "interfaces", "file", "discs", "along"),
    "connection": ("name", "law", "ends"),
    "mount_dynamics": ("name", "axes"),
}
"""Keys of each TOML table whose values are plain texts, without unit and origin."""
TABLES: dict[str, type] = {
    "frame": FrameTable, "body": BodyTable, "connection": ConnectionTable, "mount_dynamics": MountDynamics
}  # fmt: skip


OWN_NAMES = {"frame": ("rest", "crank"), "body": ("crank", "block", GROUND), "connection": ()}
"""Names of frames and bodies that exist in every engine, so that a file cannot define them."""


def check_additions(added: Additions, cylinders: int) -> None:
    """Raise ``InputError`` for TOML tables that contradict themselves, each other or the number of ``cylinders``."""
    frames, bodies, connections = added
    for noun, tables in added._asdict().items():
        taken = [*OWN_NAMES[noun]]
        for table in tables:
            need(f"{noun} '{table.name}'", "name", table.name not in taken, "is taken already; choose another one")
            given_name(table.name, noun)
            taken.append(table.name)
    for frame in frames:
        check_values(frame, f"frame '{frame.name}'")
        need(f"frame '{frame.name}'", "axis", len(frame.axis) == 2, f"{len(frame.axis)} values; give x and y")
        _check_rod(frame, cylinders)
    known = ["rest", "crank", *(frame.name for frame in frames)]
    for body in bodies:
        _check_body(body, known)
    _check_replaced(frames, bodies, connections)
    names = ["crank", "block", GROUND, *(body.name for body in bodies)]
    for connection in connections:
        where = f"connection '{connection.name}'"
        laws.check_ends(connection.law, len(connection.ends), where)
        need(where, "place", len(connection.place) in (0, 3), f"{len(connection.place)} values; give x, y and z")
        check_values(connection.data, where)
        for of_cylinder in (connection.gas, connection.slider_crank):
            if of_cylinder is not None:
                check_cylinder(where, of_cylinder.cylinder, cylinders)
        apart = len(set(connection.ends)) > 1 or len(connection.ends) < 2
        need(where, "ends", apart, f"all are at '{connection.ends[0] if connection.ends else ''}'; join two bodies")
        for end in connection.ends:
            held, interface = split_end(end)
            need(where, "ends", held in names, f"no body '{held}'; {nearest(held, names)}")
            text = f"'{end}' must name {'no' if held == GROUND else 'an'} interface; write body.interface, or ground"
            need(where, "ends", bool(interface) != (held == GROUND), text)
            own = next((body.interfaces for body in bodies if body.name == held and not body.file), ())
            text = f"body '{held}' has no interface '{interface}'; {nearest(interface, own)}"
            need(where, "ends", not own or interface in own, text)


def _check_replaced(frames: tuple[FrameTable, ...], bodies: tuple[BodyTable, ...],
                    connections: tuple[ConnectionTable, ...]) -> None:  # fmt: skip
    """Raise ``InputError`` for a cylinder of which rod, piston or gas is left out without a replacement."""
    used = {body.frame for body in bodies}
    gas = {table.gas.cylinder for table in connections if table.gas is not None}
    for frame in frames:
        if not frame.cylinder:
            continue
        made = {one.motion for one in frames if one.cylinder == frame.cylinder and one.name in used}
        missing = [f"a body in a frame with motion '{motion}'" for motion in ("rod", "piston") if motion not in made]
        missing += [] if frame.cylinder in gas else ["a connection with law 'gas'"]
        text = (
            f"the engine's own rod, piston and gas of cylinder {frame.cylinder} are left out; add {', '.join(missing)}"
        )
        need(f"frame '{frame.name}'", "cylinder", not missing, text)


def _check_rod(frame: FrameTable, cylinders: int) -> None:
    where, given = f"frame '{frame.name}'", bool(frame.pin or frame.length or frame.bank or frame.offset)
    if frame.motion == "turning":
        need(where, "motion", not (given or frame.cylinder), "has no rod's pin or length; write 'rod' or 'piston'")
        return
    check_cylinder(where, frame.cylinder, cylinders)
    if frame.cylinder:
        own = given or frame.ratio != 1.0 or frame.axis != (0.0, 0.0)
        need(where, "cylinder", not own, "gives pin, length, bank, offset, ratio and axis; leave these out")
        return
    need(where, "pin", len(frame.pin) == 2, f"{len(frame.pin)} values; give x and y, or the cylinder whose rod it is")
    need(where, "length", frame.length > 0.0, "is missing; give the length of the rod, or the cylinder whose rod it is")


def check_cylinder(where: str, cylinder: int, cylinders: int) -> None:
    """Raise ``InputError`` for a cylinder that an engine with so many ``cylinders`` lacks; 0 is none."""
    text = f"no cylinder {cylinder}; the engine has 1 to {cylinders}"
    need(where, "cylinder", 0 <= cylinder <= cylinders, text)


def _check_body(body: BodyTable, frames: list[str]) -> None:
    where = f"body '{body.name}'"
    check_values(body, where)
    need(where, "frame", body.frame in frames, f"no frame '{body.frame}'; {nearest(body.frame, frames)}")
    if body.file:
        alone = body.mass == 0.0 and not body.interfaces
        need(where, "file", alone, "the file holds mass and interfaces; leave them out of the table")
        return
    if body.stations:
        _check_shaft(body, where)
        return
    need(where, "mass", body.mass > 0.0, "is missing; give mass, inertia and centre of a rigid body, or a file")
    need(where, "inertia", len(body.inertia) in (3, 6), f"{len(body.inertia)} values; give three moments, or six")
    need(where, "centre", len(body.centre) == 3, f"{len(body.centre)} values; give x, y and z")
    need(where, "interfaces", len(body.interfaces) > 0, "is empty; give names, and their places x, y, z")
    for key in "xyz":
        count = len(getattr(body, key))
        need(where, key, count == len(body.interfaces), f"{count} values for {len(body.interfaces)} interfaces")
    for name in body.interfaces:
        need(where, "interfaces", body.interfaces.count(name) == 1, f"'{name}' is listed twice")


def _check_shaft(body: BodyTable, where: str) -> None:
    rises = all(first < second for first, second in pairwise(body.stations))
    need(where, "stations", len(body.stations) > 1 and rises, "needs at least two stations, increasing along z")
    pieces = len(body.stations) - 1
    keys = ("areas", "second_moments") if body.areas or body.second_moments else ("diameters",)
    need(where, "diameters", len(keys) == 1 or not body.diameters, "does not go with areas; leave one of them out")
    for key in keys:
        count = len(getattr(body, key))
        need(where, key, count == pieces, f"{count} values for {pieces} pieces between stations")
    need(where, "mass", body.mass == 0.0, "is computed from the stations of a shaft; leave out mass or stations")
    need(where, "interfaces", len(body.interfaces) > 0, "is empty; give names, and their places z")
    if body.along == "y":
        need(where, "x", not body.x, "interfaces of a rod lie on its axis; give y, and one z")
        need(where, "z", len(body.z) == 1, f"{len(body.z)} values; give the one plane in which the rod moves")
    else:
        need(where, "x", not (body.x or body.y), "interfaces of a shaft lie on its axis; give z alone")
    count, first, last = len(body.held_at), body.stations[0], body.stations[-1]
    need(where, body.along, count == len(body.interfaces), f"{count} values for {len(body.interfaces)} interfaces")
    within = all(first <= place <= last for place in body.held_at)
    need(where, body.along, within, "interfaces lie between the first and the last station")
    for name in body.discs:
        need(where, "discs", name in body.interfaces, f"no interface '{name}'; {nearest(name, body.interfaces)}")
    for key in ("disc_masses", "disc_polar", "disc_diametral"):
        count = len(getattr(body, key))
        need(where, key, count == len(body.discs), f"{count} values for {len(body.discs)} discs")
    for key in ("disc_x", "disc_y"):
        count = len(getattr(body, key))
        need(where, key, count in (0, len(body.discs)), f"{count} values for {len(body.discs)} discs")


def split_end(end: str) -> tuple[str, str]:
    """Body and interface of an end ``body.interface``; names of bodies contain no dot."""
    body, _, interface = end.partition(".")
    return body, interface


def located(body: BodyTable, folder: Path) -> BodyTable:
    """Body whose relative file path is resolved from the folder of the engine file."""
    return replace(body, file=str((folder / body.file).resolve())) if body.file else body
