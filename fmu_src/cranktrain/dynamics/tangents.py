"""Tangents of all force laws at the state of a run, by displacement, velocity and acceleration of the ports.

A stage combines them into one block for each connection,

    ∂f/∂u = K + (c_v/c_q) C + (1/c_q) M,

so three evaluations with different (c_q, c_v) give K, C and M. This is exact for films, thrust bearing, damper, and
rods whose pistons run on the axes of their cylinders, because all are affine in both ratios. K and C are the
derivatives by u and u̇ in axes of the frame; K includes derivatives by velocity times the frame's rotation.
"""

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
from cranktrain.dynamics.topology.own_law import own_failure
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, COS, FORCE, INERTANCE, MASS, NUMBERS, SIN, SIZE

NO_MASS = 1.0e30
"""Value of c_q, s², so large that its inverse is negligible."""
PER_VELOCITY, PER_ACCELERATION = 1.0e3, 1.0e6
"""Ratios c_v/c_q (1/s) and 1/c_q (1/s²) of the evaluations, of the size of vibration at a few hundred Hz."""
TURN = 24
"""Number of crank angles over which masses of laws are averaged."""


class Tangents(NamedTuple):
    """Tangents and forces of all force laws at one state, along the axes of the frame.

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


@kernel
def law_at(law, record, index, place, velocity, numbers, out):
    """Call the force law at an address: forces and tangents are written to ``out``. Return the status of the law."""
    return call_kernel(law, (record, FORCE, index, place, velocity, numbers, out, out))


def tangents_at_rest(model: ModelArrays) -> Tangents:
    """Tangents and forces of all connections by terms without motion, at crank angle 0; those of ports are zero.

    Masses of a law's own are means over a turn. ``InputError`` for a law that has no force at rest.
    """
    count, numbers = len(model.connections), np.zeros(NUMBERS)
    numbers[COS] = 1.0
    found = np.zeros((count, SIZE))
    mass = np.zeros((count, 16))
    for k in range(int(model.layout[at.TERM_ROW]), count):
        law, record, index = model.laws.entry[k].tolist()
        if law_at(law, record, index, np.zeros(4), np.zeros(4), numbers, found[k]) != 0:
            raise InputError(
                own_failure(model.laws.entry[k : k + 1, 1]) or "a law of a connection has no force at rest"
            )
        if model.laws.traits[k, MASS] > 0.0:
            mass[k] = _mean_mass(law, record, index)
    place, velocity = (found[:, first : first + 16].reshape(-1, 4, 4) for first in (BY_PLACE, BY_VELOCITY))
    none = np.zeros(int(model.layout[at.PORTS]))
    return Tangents(place, velocity, mass.reshape(-1, 4, 4), none, none)


def _mean_mass(law: int, record: int, index: int) -> Array:
    """Mean over a turn of the derivatives (16,) of a law's forces by acceleration, kg."""
    found, out, still = np.zeros(16), np.zeros(SIZE), np.zeros(4)
    for angle in np.arange(TURN) * 2.0 * np.pi / TURN:
        numbers = np.zeros(NUMBERS)
        numbers[[COS, SIN]] = np.cos(angle), np.sin(angle)
        for inertance in (0.0, 1.0):
            numbers[INERTANCE] = inertance
            law_at(law, record, index, still, still, numbers, out)
            found += (2.0 * inertance - 1.0) * out[BY_PLACE : BY_PLACE + 16]
    return found / TURN


@kernel
def evaluate_at_state(model, work, c_q, c_v):
    """Write forces and combined tangents at the state observed last to ``work``. Return 0, or a failure status.

    Films with a memory are those of the last stage.
    """
    for k in range(port_count(model)):
        work.port[at.U, k] = work.port[at.STATE_U, k]
        work.port[at.UD, k] = work.port[at.STATE_U + 1, k]
        work.port[at.UDD, k] = work.port[at.STATE_U + 2, k]
        work.port[at.U_Q, k] = 0.0
        work.port[at.U_V, k] = 0.0
    return port_forces(model, work, work.frames[0], work.pressures[0], c_q, c_v)


def tangents_at_state(model: ModelArrays, work: Work) -> Tangents:
    """Tangents at the state of a run that was observed last; ``SolverError`` if a law fails."""
    found = []
    for c_q, c_v in ((NO_MASS, 0.0), (NO_MASS, PER_VELOCITY * NO_MASS), (1.0 / PER_ACCELERATION, 0.0)):
        if evaluate_at_state(model, work, c_q, c_v) != 0:
            raise SolverError("a film has no tangents at a state of the run; take another bearing level")
        found.append(work.blocks.reshape(-1, 4, 4).copy())
    place, with_velocity, with_acceleration = found
    ports = int(model.layout[at.PORTS])
    return Tangents(
        place, (with_velocity - place) / PER_VELOCITY, (with_acceleration - place) / PER_ACCELERATION,
        work.port[at.FORCES, :ports].copy(), work.port[at.STATE_U, :ports].copy(),
    )  # fmt: skip
