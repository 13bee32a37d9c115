"""Elastic rods of all cylinders from one table, ``[rod_shape]``, as frames, bodies and connections of an engine file.

For cylinder k the table makes the frames and bodies ``rod[k]`` and ``piston[k]``, and these connections:

    big_end_k        film between crank pin and rod
    small_end_k      spring or film between piston pin and rod
    rod_faces_k      springs that hold the rod on its pin along z and against tilt
    piston_faces_k   the same between piston and liner
    skirt_k          the skirt of [piston_guidance] in its liner, or stiff springs across the cylinder
    gas_k            gas of the cylinder on piston and head

A rod has mass, centre of mass and moment of inertia of ``[rod]``. Its beam has less, so point masses stand for the
rest: at both ends, and in the middle if the moment of inertia is less than that of beam and end masses.
"""

import cmath
import math
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np

from cranktrain.engine import quantities as q
from cranktrain.engine.additions import Additions, BodyTable, ConnectionTable, FrameTable
from cranktrain.engine.articulated_rod import piston_height, rod_end
from cranktrain.engine.connections import Film, Gas, Liner, Spring
from cranktrain.engine.parts import Given, Needed, PlainBearing, Skirt
from cranktrain.engine.quantities import mm, need

Engine = Any
"""An engine of :mod:`cranktrain.engine.model`, which imports this module."""
SMALL_END = ("small_end_diameter", "small_end_width", "small_end_clearance")
"""Keys that a film of the small end needs."""
GAS_LOAD = 1.0e7
"""Pressure on a piston (Pa) by whose force stiff springs are sized; chosen."""
GUIDE, JOINT = 1.0e-3, 2.5e-4
"""Deflection of piston guides and of pin joints under that force, over the bore; chosen."""
FACES = 3.0
"""Natural frequency of rod and piston on the springs of their faces, over the highest speed; chosen."""
DAMPING = 0.3
"""Damping ratio of all these springs; chosen."""
HEIGHT = 0.7
"""Height of a piston over its bore, for its moment of inertia without [piston_guidance]; chosen."""
SAME = 1.0e-6
"""Largest difference (m) between the last station and the length of the rod."""
LEAST = 1.0e-6
"""Smallest point mass (kg) and, with 1e-3 m², smallest moment of inertia that a rod carries."""


@dataclass(frozen=True, kw_only=True)
class RodShape:
    """Elastic rods of all cylinders, as beams; each rod and its piston become bodies with films or springs between.

    Attributes
    ----------
    stations : positions along the rod from the big end's centre, 0, to the small end's, the rod's length, m
    areas, second_moments : of each piece between two stations, m², and m⁴ in the plane of the rod's motion
    big_end : level of the film between crank pin and rod, with the data of [big_end_bearing]
    eye : for level ``ehd`` of the big end: ``elastic`` or ``rigid``
    small_end : ``spring``, or the level of a film between piston pin and rod
    small_end_diameter, small_end_width, small_end_clearance : of this film, m; its surfaces are those of the big end
    youngs_modulus, poisson_ratio, density, damping_ratio : of the rod
    cutoff_hz : highest natural frequency of the rod's modes; the static compliance of stiffer modes is kept
    """

    @staticmethod
    def needed(given: Given) -> Needed:
        """Keys of a film at the small end."""
        film = given("small_end") not in (None, "spring")
        return Needed(SMALL_END, "a film of the small end needs") if film else Needed()

    stations: tuple[q.Offset, ...]
    areas: tuple[q.SectionArea, ...]
    second_moments: tuple[q.SecondMoment, ...]
    big_end: q.FilmLevel = "impedance"
    eye: q.FilmBore = "elastic"
    small_end: q.SmallEnd = "spring"
    small_end_diameter: q.Size = 0.0
    small_end_width: q.Size = 0.0
    small_end_clearance: q.RadialClearance = 0.0
    youngs_modulus: q.Modulus = 210.0e9
    poisson_ratio: q.PoissonRatio = 0.3
    density: q.Density = 7850.0
    damping_ratio: q.DampingRatio = 0.01
    cutoff_hz: q.Frequency = 6000.0


def check_rod_shape(engine: Engine, shape: RodShape) -> None:
    """Raise ``InputError`` for a shape that is no rod of this engine."""
    length, stations = engine.rod.length, shape.stations
    rises = all(first < second for first, second in pairwise(stations))
    need("rod_shape", "stations", len(stations) > 1 and rises, "needs at least two stations, increasing from 0")
    text = f"reach from {mm(stations[0])} to {mm(stations[-1])}; begin at 0 and end at rod.length, {mm(length)}"
    need("rod_shape", "stations", abs(stations[0]) < SAME and abs(stations[-1] - length) < SAME, text)
    pieces = len(stations) - 1
    for key in ("areas", "second_moments"):
        count = len(getattr(shape, key))
        need("rod_shape", key, count == pieces, f"{count} values for {pieces} pieces between {pieces + 1} stations")
    text = "rods run on each other there, which no frame of a rod follows; leave [rod_shape] out"
    need("cylinders", "rods_on_pin", engine.rods_float, text)
    text = "a film needs the table [big_end_bearing]; add it"
    need("rod_shape", "big_end", engine.big_end_bearing is not None, text)
    for frame in engine.frame:
        text = f"the rod of cylinder {frame.cylinder} is that of [rod_shape]; leave this frame or that table out"
        need(f"frame '{frame.name}'", "cylinder", not frame.cylinder, text)
    point_masses(engine, shape)


def point_masses(engine: Engine, shape: RodShape) -> dict[str, tuple[float, float]]:
    """Mass (kg) and moment of inertia about z (kg m²) that complete the beam, by interface of the rod; ``InputError``.

    With mass m, first moment s and second moment j about the big end of what the beam lacks of ``[rod]``: a point mass
    d in the middle of the length l has s l − j = d l²/4. If s l < j there is none, and both ends rotate with j − s l.
    """
    rod, ends = engine.rod, list(pairwise(shape.stations))
    beam = [shape.density * area * (b - a) for area, (a, b) in zip(shape.areas, ends, strict=True)]
    first = math.fsum(m * 0.5 * (a + b) for m, (a, b) in zip(beam, ends, strict=True))
    squares = [(a * a + a * b + b * b) / 3.0 for a, b in ends]
    turned = [i / area for i, area in zip(shape.second_moments, shape.areas, strict=True)]
    second = math.fsum(m * (square + own) for m, square, own in zip(beam, squares, turned, strict=True))
    total = rod.big_end_mass + rod.small_end_mass
    moment = rod.small_end_mass * rod.length - first
    about = rod.inertia + (rod.small_end_mass * rod.length) ** 2 / total - second
    middle = max(0.0, 4.0 * (moment * rod.length - about) / rod.length**2)
    turning = max(0.0, about - moment * rod.length)
    small = moment / rod.length - 0.5 * middle
    big = total - math.fsum(beam) - small - middle
    for key, rest in (("small_end_mass", small), ("big_end_mass", big)):
        own = getattr(rod, key)
        text = (
            f"the sections alone bring {own - rest:.4g} kg to this end, whose rod.{key} is {own:.4g} kg; give less "
            "area or density, or correct the masses of [rod]"
        )
        need("rod_shape", "areas", rest >= 0.0, text)
    found = {"big": (big, turning * big / (big + small)), "middle": (middle, 0.0)} if big + small > 0.0 else {}
    found["small"] = small, turning - found.get("big", (0.0, 0.0))[1]
    return {name: one for name, one in found.items() if one[0] > LEAST}


def rod_additions(engine: Engine, shape: RodShape) -> Additions:
    """Frames, bodies and connections of elastic rods and their pistons for all cylinders of an engine."""
    laws = _laws(engine, shape)
    frames, bodies, connections = [], [], []
    for k, z in enumerate(engine.cylinder_positions):
        number, bank = k + 1, engine.cylinders.bank_angles[k]
        rod, piston = f"rod[{number}]", f"piston[{number}]"
        frames += [FrameTable(rod, motion="rod", cylinder=number), FrameTable(piston, motion="piston", cylinder=number)]
        end, height = rod_end(engine, k, np.zeros(1)), piston_height(engine, k, np.zeros(1))[0]
        axes = cmath.rect(1.0, bank)
        pin, top = axes * complex(end.x[0], end.y[0]), axes * complex(engine.offsets[k], height[0])
        bodies += [_rod(engine, shape, rod, z), _piston(engine, piston, top, axes * 1j, z)]
        on_pin, on_piston = (f"crank.pin[{engine.cylinders.pins[k]}]", f"{rod}.big"), f"{piston}.pin"
        # A rod beside the middle of its pin is held at its own place.
        place = (pin.real, pin.imag, z) if engine.rod_offsets[k] else ()
        wall = on_piston, f"block.liner[{number}].upper"
        ends = {
            "big_end": on_pin, "rod_faces": on_pin, "small_end": (on_piston, f"{rod}.small"), "piston_faces": wall,
            "skirt": wall, "gas": (on_piston, f"block.head[{number}]"),
        }  # fmt: skip
        for name, (law, data) in {**laws, "gas": ("gas", Gas(engine.cylinders.bore, number))}.items():
            at = place if ends[name] is on_pin else ()
            connections.append(ConnectionTable(f"{name}_{number}", law, ends[name], at, **{law: data}))
    return Additions(tuple(frames), tuple(bodies), tuple(connections))


def _laws(engine: Engine, shape: RodShape) -> dict[str, tuple[str, Any]]:
    """Law and data of the connections that all cylinders have, by name."""
    rod, bearing, skirt, bore = engine.rod, engine.big_end_bearing, engine.piston_guidance, engine.cylinders.bore
    assert bearing is not None  # checked
    force, square = GAS_LOAD * 0.25 * math.pi * bore**2, (FACES * engine.speeds[1]) ** 2
    mass, piston = rod.big_end_mass + rod.small_end_mass, engine.cylinders.piston_mass
    tilting, stiff, pinned = _tilt_inertia(engine), force / (GUIDE * bore), force / (JOINT * bore)
    pairs = (mass, mass * rod.length**2 / 3.0), (piston, tilting)
    rod_faces, piston_faces = (
        _springs({2: (square * own, own)}, {0: (square * about, about), 1: (square * about, about)})
        for own, about in pairs
    )
    guide = _springs({0: (stiff, piston)}, {2: (stiff * bore**2 / 12.0, tilting)})
    joint = _springs({0: (pinned, piston), 1: (pinned, piston), 2: (square * piston, piston)})
    linear = force / bearing.clearance
    damping = 2.0 * DAMPING * math.sqrt(linear * mass)
    film = {entry.name: getattr(bearing, entry.name) for entry in fields(PlainBearing)} | {
        "relief_depth": 0.0, "stiffness_x": linear, "stiffness_y": linear, "damping_x": damping, "damping_y": damping,
    }  # fmt: skip
    small = film | {key.removeprefix("small_end_"): getattr(shape, key) for key in SMALL_END} | {"groove": "none"}
    return {
        "big_end": ("film", Film(**film, level=shape.big_end, bore=shape.eye)),
        "rod_faces": ("spring", rod_faces),
        "small_end": ("spring", joint) if shape.small_end == "spring"
        else ("film", Film(**small, level=shape.small_end, bore="rigid")),
        "piston_faces": ("spring", piston_faces),
        "skirt": ("spring", guide) if skirt is None
        else ("liner", Liner(**{entry.name: getattr(skirt, entry.name) for entry in fields(Skirt)})),
    }  # fmt: skip


def _springs(along: dict[int, tuple[float, float]], about: dict[int, tuple[float, float]] | None = None) -> Spring:
    """Springs by axis, each from its stiffness and the mass or moment of inertia for its damping."""
    rows = [[one.get(axis, (0.0, 0.0)) for axis in range(3)] for one in (along, about or {})]
    (k, c), (k_t, c_t) = (
        (tuple(k for k, _ in row), tuple(2.0 * DAMPING * math.sqrt(k * mass) for k, mass in row)) for row in rows
    )
    return Spring(k, c, k_t, c_t)


def _rod(engine: Engine, shape: RodShape, name: str, z: float) -> BodyTable:
    """Elastic rod of a cylinder in its frame."""
    masses, bearing, length = point_masses(engine, shape), engine.big_end_bearing, engine.rod.length
    assert bearing is not None  # checked
    places = {"big": 0.0, "middle": 0.5 * length, "small": length}
    held = [place for place in places if place != "middle" or place in masses]
    # Out of its plane an end rotates as a ring around the pin.
    rings = [max(LEAST * 1e-3, mass * bearing.diameter**2 / 6.0, turning) for mass, turning in masses.values()]
    return BodyTable(
        name, frame=name, along="y", interfaces=tuple(held), y=tuple(places[place] for place in held), z=(z,),
        discs=tuple(masses), disc_masses=tuple(mass for mass, _ in masses.values()),
        disc_polar=tuple(max(LEAST * 1e-3, turning) for _, turning in masses.values()), disc_diametral=tuple(rings),
        **{entry.name: getattr(shape, entry.name) for entry in fields(BodyTable) if hasattr(shape, entry.name)},
    )  # fmt: skip


def _piston(engine: Engine, name: str, pin: complex, along: complex, z: float) -> BodyTable:
    """Rigid piston of a cylinder from the places (x + iy) of its pin and the direction of its cylinder, at angle 0."""
    centre = pin + along * (engine.piston_guidance.mass_height if engine.piston_guidance is not None else 0.0)
    return BodyTable(
        name, name, engine.cylinders.piston_mass, 3 * (_tilt_inertia(engine),), (centre.real, centre.imag, z),
        ("pin",), (pin.real,), (pin.imag,), (z,),
    )  # fmt: skip


def _tilt_inertia(engine: Engine) -> float:
    """Moment of inertia of a piston about its pin's direction, kg m²."""
    if engine.piston_guidance is not None:
        return engine.piston_guidance.tilt_inertia
    return engine.cylinders.piston_mass * engine.cylinders.bore**2 * (1.0 / 16.0 + HEIGHT**2 / 12.0)
