"""Tangents of force laws by displacement, velocity and acceleration of the ports, at a state of a run or in rotation.

A stage combines them into one block for each connection,

    ∂f/∂u = K + (c_v/c_q) C + (1/c_q) M,

so three evaluations with different (c_q, c_v) give K, C and M. This is exact for films, thrust bearing, damper, and
rods whose pistons run on the axes of their cylinders, because all are affine in both ratios. K and C are the
derivatives by u and u̇ in axes of the frame; K includes derivatives by velocity times the frame's rotation.

*In rotation* the rigid crank turns uniformly about its axis, and components of connections rest, those of terms where
mean loads place them. The gas of each cylinder then follows the angle of its pin.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.kernel import call_kernel, kernel
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import port_count
from cranktrain.dynamics.model.records import ModelArrays
from cranktrain.dynamics.model.workspace import Work
from cranktrain.dynamics.motion.equations import port_forces
from cranktrain.dynamics.motion.gas import burn_share, trace_angle
from cranktrain.dynamics.motion.law_forces import law_block
from cranktrain.dynamics.motion.law_motion import ports_of_state
from cranktrain.dynamics.topology.own_law import own_failure
from cranktrain.film.laws.films import (
    ANGLE,
    BY_PLACE,
    COS,
    FORCE,
    INERTANCE,
    MASS,
    NUMBERS,
    PRESSURE,
    RATIO,
    RUBBING,
    SIN,
    SIZE,
    SLOPE,
    SPEED,
    WHIRL,
)
from cranktrain.loads.gas_pressure import gas_slopes

NO_MASS = 1.0e30
"""Value of c_q, s², so large that its inverse is negligible."""
PER_VELOCITY, PER_ACCELERATION = 1.0e3, 1.0e6
"""Ratios c_v/c_q (1/s) and 1/c_q (1/s²) of the evaluations, of the size of vibration at a few hundred Hz."""
SAMPLES = 360
"""Number of crank angles of a cycle in rotation."""


class Tangents(NamedTuple):
    """Tangents and forces of force laws at one state, or with one more axis at N of them, along axes of the frame.

    Attributes
    ----------
    place, velocity, acceleration : (k, 4, 4) derivatives of the forces at the ports of each connection, N/m, N s/m, kg
    forces : (m,) at all ports, N, N m
    displaced : (m,) displacement of all ports, m, rad
    """

    place: Array
    velocity: Array
    acceleration: Array
    forces: Array
    displaced: Array

    def mean(self) -> "Tangents":
        """Mean over the first axis."""
        return Tangents(*(part.mean(axis=0) for part in self))


@kernel
def law_at(law, record, index, place, velocity, numbers, out):
    """Call the force law at an address: forces and tangents are written to ``out``. Return the status of the law."""
    return call_kernel(law, (record, FORCE, index, place, velocity, numbers, out, out))


@kernel
def law_in_rotation(model, k, theta, speed, numbers, out):
    """Call the law of connection k in rotation at a crank angle (rad) and speed (rad/s). Return its status.

    ``numbers`` hold the rule of a stage, RATIO and INERTANCE, and GRAVITY. Connections of terms keep their place, and
    of them only laws with masses get the crank angle.
    """
    row = model.connections[k]
    entry = model.laws.entry[k]
    place = model.laws.place[k]
    velocity = model.laws.velocity[k]
    of_terms = row[at.SHAPE] == at.OF_TERMS
    massive = model.laws.traits[k, MASS] > 0.0
    numbers[WHIRL] = 0.0 if of_terms else speed
    numbers[SPEED] = numbers[RUBBING] = numbers[WHIRL]
    numbers[ANGLE] = theta if massive or not of_terms else 0.0
    numbers[COS] = math.cos(numbers[ANGLE])
    numbers[SIN] = math.sin(numbers[ANGLE])
    for r in range(4):
        velocity[r] = 0.0
        if not of_terms:
            place[r] = 0.0
    numbers[PRESSURE] = numbers[SLOPE] = 0.0
    if massive and not of_terms:
        c = row[at.OF_CYLINDER]
        motored, rise, slope, rise_slope = gas_slopes(trace_angle(model, c, theta), model.gas, c)
        burn = burn_share(model, speed)
        numbers[PRESSURE] = motored + burn * rise - model.scalars[at.CRANKCASE]
        numbers[SLOPE] = slope + burn * rise_slope
    return law_at(entry[0], entry[1], entry[2], place, velocity, numbers, out)


@kernel
def rotate(model, k, speed, numbers, out, forces, blocks):
    """Write ``forces`` (N, 4) and tangents, ``blocks`` (N, 16), of connection k in rotation at N angles of a cycle.

    Arguments and the returned status are those of :func:`law_in_rotation`.
    """
    row = model.connections[k]
    for i in range(forces.shape[0]):
        status = law_in_rotation(model, k, 4.0 * math.pi * i / forces.shape[0], speed, numbers, out)
        if status != 0:
            return status
        if model.laws.traits[k, MASS] > 0.0:
            for r in range(16):
                blocks[i, r] = out[BY_PLACE + r]
        else:
            pairs = -1 if row[at.SHAPE] == at.OF_TERMS else row[at.PAIRS]
            law_block(out, row[at.COUPLED], pairs, numbers[RATIO], numbers[WHIRL], blocks[i])
        for r in range(row[at.COUPLED]):
            forces[i, r] = out[r]
    return 0


def tangents_in_rotation(
    model: ModelArrays, speed: float = 0.0, rows: Iterable[int] | None = None, samples: int = SAMPLES,
    places: Array | None = None,
) -> Tangents:  # fmt: skip
    """Tangents and forces of all connections, or of those in ``rows``, in rotation at N ``samples`` of a cycle.

    ``speed`` is in rad/s, ``places`` (k, 4) are those of connections of terms, zero if left out. Tangents of other
    connections are zero. ``InputError`` for a law that has no force without motion.
    """
    numbers, out, own, block = np.zeros(NUMBERS), np.zeros(SIZE), np.zeros((samples, 4)), np.zeros((samples, 16))
    blocks = np.zeros((3, samples, len(model.connections), 16))
    forces = np.zeros((samples, int(model.layout[at.PORTS])))
    for k in range(len(model.connections)) if rows is None else rows:
        model.laws.place[k] = 0.0 if places is None else places[k]
        for part, ratios in zip(blocks, ((0.0, 0.0), (PER_VELOCITY, 0.0), (0.0, PER_ACCELERATION)), strict=True):
            numbers[[RATIO, INERTANCE]] = ratios
            status = rotate(model, k, speed, numbers, out, own, block)
            if status != 0 or not np.isfinite(block).all():
                raise InputError(
                    own_failure(model.laws.entry[k : k + 1, 1]) or "a law of a connection has no force at rest"
                )
            part[:, k] = block
        row = model.connections[k]
        if row[at.SHAPE] != at.OF_TERMS:
            forces[:, row[at.FIRST : at.FIRST + row[at.COUPLED]]] = own[:, : row[at.COUPLED]]
    return _parted(blocks, forces, np.zeros_like(forces))


def _parted(blocks: Array, forces: Array, displaced: Array) -> Tangents:
    """Tangents of ``blocks`` (3, …, 16) of the three evaluations."""
    place, with_velocity, with_acceleration = blocks.reshape(*blocks.shape[:-1], 4, 4)
    return Tangents(
        place, (with_velocity - place) / PER_VELOCITY, (with_acceleration - place) / PER_ACCELERATION, forces, displaced
    )


def forces_in_rotation(model: ModelArrays, rows: Iterable[int], places: Array) -> Array:
    """Mean forces (k, 4) of connections of terms in ``rows`` over a cycle in rotation, where ``places`` (k, 4) are."""
    numbers, out, block = np.zeros(NUMBERS), np.zeros(SIZE), np.zeros((SAMPLES, 16))
    found, own = np.zeros((len(model.connections), 4)), np.zeros((SAMPLES, 4))
    for k in rows:
        model.laws.place[k] = places[k]
        rotate(model, k, 0.0, numbers, out, own, block)
        found[k] = own.mean(axis=0)
    return found


@kernel
def evaluate_at_state(model, work, c_q, c_v):
    """Write forces and combined tangents at the state observed last to ``work``. Return 0, or a failure status.

    Films with a memory are those of the last stage.
    """
    ports_of_state(work)
    for k in range(port_count(model)):
        work.port[at.U_Q, k] = 0.0
        work.port[at.U_V, k] = 0.0
    return port_forces(model, work, work.frames[0], work.pressures[0], c_q, c_v)


def tangents_at_state(model: ModelArrays, work: Work) -> Tangents:
    """Tangents at the state of a run that was observed last; ``SolverError`` if a law fails."""
    found = []
    for c_q, c_v in ((NO_MASS, 0.0), (NO_MASS, PER_VELOCITY * NO_MASS), (1.0 / PER_ACCELERATION, 0.0)):
        if evaluate_at_state(model, work, c_q, c_v) != 0:
            raise SolverError("a film has no tangents at a state of the run; take another bearing level")
        found.append(work.blocks.copy())
    ports = int(model.layout[at.PORTS])
    return _parted(np.array(found), work.port[at.FORCES, :ports].copy(), work.port[at.STATE_U, :ports].copy())
