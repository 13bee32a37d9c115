"""An engine as one rigid body on its mounts: mass, centre of mass, inertia, and angular momentum of its rotating parts.

Rods are two masses each. Moving masses count with their mean over a cycle. The crank with its flywheel turns freely in
the block, so its inertia about its own axis does not resist the engine's roll. Its angular momentum J Ω couples pitch
and yaw.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.rigid_slices import inertia_tensor, part_moments
from cranktrain.core.types import Array
from cranktrain.engine.additions import FrameTable
from cranktrain.engine.articulated_rod import piston_height, rod_end
from cranktrain.engine.model import Engine
from cranktrain.structure.block.reduction import standing_moments
from cranktrain.structure.crank.reduction import complete_crankshaft
from cranktrain.structure.crank.torsional import rigid_crank

SAMPLES = 360
"""Crank angles over which moving masses are averaged."""


class RigidEngine(NamedTuple):
    """Rigid engine; axes x across, y up, z along the crank.

    Attributes
    ----------
    centre : (3,) centre of mass, m
    mass : (6, 6) mass matrix of displacements of the centre (kg) and rotations about it (kg m²)
    spin : angular momentum of all rotating parts about z over the crank's speed, kg m²
    left_out : names of added bodies that are not included: elastic ones and those that move with a rod
    """

    centre: Array
    mass: Array
    spin: float
    left_out: tuple[str, ...]


def rigid_engine(engine: Engine) -> RigidEngine:
    """Rigid body of an engine; ``InputError`` for an engine without ``[block]`` and without a standing body."""
    turning = _crank(engine)
    moments = standing_moments(engine) + turning
    polar = spin = float(turning[1, 1] + turning[2, 2])
    for c, rod in enumerate(engine.rods):
        ends, pistons = _paths(engine, c)
        big_ends = rod.big_end_mass * _mean(ends)
        moments = moments + big_ends + (rod.small_end_mass + engine.cylinders.piston_mass) * _mean(pistons)
        polar += float(big_ends[1, 1] + big_ends[2, 2])
        spin += float(big_ends[1, 1] + big_ends[2, 2])
    frames = {"rest": FrameTable("rest", 0.0), "crank": FrameTable("crank")} | {one.name: one for one in engine.frame}
    left_out = []
    for body in engine.body:
        frame = frames[body.frame]
        if body.made_of_files_or_elements or frame.motion != "turning":
            left_out.append(body.name)
            continue
        axis = np.array([*frame.axis, 0.0])
        own = part_moments(body.mass, inertia_tensor(body.inertia), np.array(body.centre) - axis)
        if frame.ratio:
            own = _round(own)
            polar += float(own[1, 1] + own[2, 2])
            spin += frame.ratio * float(own[1, 1] + own[2, 2])
        moments = moments + _moved(own, axis)
    mass, centre = moments[0, 0], moments[0, 1:] / moments[0, 0]
    second = moments[1:, 1:] - mass * np.outer(centre, centre)
    whole = np.diag([mass, mass, mass, 0.0, 0.0, 0.0])
    whole[3:, 3:] = np.trace(second) * np.eye(3) - second
    whole[5, 5] -= polar
    return RigidEngine(centre, whole, spin, tuple(left_out))


def _crank(engine: Engine) -> Array:
    """Mean moments (4, 4) over a revolution of the crank and all parts that are fixed to it."""
    body = complete_crankshaft(engine, rigid_crank(engine))
    own = body.inertia - body.mass * (body.centre @ body.centre * np.eye(3) - np.outer(body.centre, body.centre))
    return _round(part_moments(body.mass, own, body.centre))


def _round(moments: Array) -> Array:
    """Mean of moments (4, 4) over a revolution about z."""
    across = 0.5 * (moments[1, 1] + moments[2, 2])
    mean = np.diag([moments[0, 0], across, across, moments[3, 3]])
    mean[0, 3] = mean[3, 0] = moments[0, 3]
    return mean


def _moved(moments: Array, place: Array) -> Array:
    """Moments (4, 4) about the origin from those about ``place`` (3,)."""
    shift = np.eye(4)
    shift[1:, 0] = place
    return np.asarray(shift @ moments @ shift.T)


def _paths(engine: Engine, cylinder: int) -> tuple[Array, Array]:
    """Positions (SAMPLES, 3) of a rod's big end and of its piston pin over a revolution, m."""
    angle: Array = np.arange(SAMPLES, dtype=np.float64) * (2.0 * math.pi / SAMPLES)
    bank, z = engine.cylinders.bank_angles[cylinder], engine.cylinder_positions[cylinder]
    end, height = rod_end(engine, cylinder, angle), piston_height(engine, cylinder, angle)[0]
    turn = np.array([[math.cos(bank), math.sin(bank)], [-math.sin(bank), math.cos(bank)]])
    pairs = (end.x, end.y), (np.full(SAMPLES, engine.offsets[cylinder]), height)
    first, second = (np.column_stack((np.column_stack(pair) @ turn, np.full(SAMPLES, z))) for pair in pairs)
    return first, second


def _mean(path: Array) -> Array:
    """Mean moments (4, 4) of a unit mass on a path (n, 3)."""
    extended = np.column_stack((np.ones(len(path)), path))
    return np.asarray(extended.T @ extended / len(path))
