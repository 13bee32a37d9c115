"""Mean stiffness and damping of all force laws over a cycle of a run, for small motions of the crank.

Along the settled cycle the stiffness K = −∂f/∂d and damping C = −∂f/∂ḋ of a film change by orders of magnitude. Let d₀
be the relative motion of crank and block without the film, and H their compliance under the film's force. The film's
force is then f = −(Z⁻¹ + H)⁻¹ d₀ with Z = K + iωC. The mean law Z̄ is the law with the same mean force,

    (Z̄⁻¹ + H)⁻¹ = mean over the cycle of (Z⁻¹ + H)⁻¹,

in the axes of the rotating frame. For a law far softer than the crank Z̄ is the mean of Z; for a law far stiffer it is
the inverse of the mean compliance. The variation about the mean moves crank and block at ω ± kΩ/2, so H is the mean
over these frequencies, with all other films at their mean laws. The axial joint of the drive line has a state (its
deflection) and therefore a separate mean law (:mod:`cranktrain.structure.in_motion.joint`). All other laws, in
particular the floating collar, use the means of K and C. For a law with constant K and C all these means equal K and C.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.core.types import ComplexArray
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.linear import ACROSS
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.model.records import ModelArrays, dimensions
from cranktrain.dynamics.model.state import TIME
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.tangents import Tangents, tangents_at_state
from cranktrain.structure.in_motion.joint import joint_at_state, joint_stiffness


class CycleTangents(NamedTuple):
    """Tangents at N equally spaced times of a settled cycle.

    Attributes
    ----------
    speed : mean speed, rad/s
    laws : tangents, forces and displacements at these times
    frame : (N, 3) cosine and sine of the frame's angle, and speed of the frame, rad/s
    joint : (N, 2) coefficients of the axial joint, see :mod:`cranktrain.structure.in_motion.joint`
    """

    speed: float
    laws: Tangents
    frame: Array
    joint: Array


class CycleMeans(NamedTuple):
    """Means of the force ``laws`` over a cycle at a ``speed``, rad/s; films for vibration at ``hz``, Hz."""

    speed: float
    hz: float
    laws: Tangents


def tangents_over_cycle(simulation: Simulation) -> CycleTangents:
    """Tangents at each step of the cycle that begins at a simulation's state; the state is not changed.

    Raises ``SolverError`` for a step that fails, or a law without tangents.
    """
    speed, state = float(simulation.inputs[0]), simulation.state
    step = communication_step(speed, simulation.settings.step)
    found: list[Tangents] = []
    frame, joint = [], []
    for k in range(round(4.0 * math.pi / speed / step)):
        simulation.step(float(state[TIME]) + (k + 1) * step)
        found.append(tangents_at_state(simulation.model, simulation.work))
        joint.append(joint_at_state(simulation))
        frame.append(simulation.work.frames[0, [slots.COS, slots.SIN, slots.WHIRL]].copy())
    simulation.state = state
    laws = Tangents(*(np.array(parts) for parts in zip(*found, strict=True)))
    return CycleTangents(speed, laws, np.array(frame), np.array(joint))


def plain_means(tangents: CycleTangents, hz: float) -> CycleMeans:
    """Means of all tangents over a cycle, for vibration at ``hz``."""
    return CycleMeans(tangents.speed, hz, tangents.laws.mean())


def with_joint_mean(simulation: Simulation, tangents: CycleTangents, means: CycleMeans, hz: float) -> CycleMeans:
    """Means for vibration at ``hz``, with mean stiffness of the axial joint; unchanged for models without a joint."""
    path, k = simulation.engine.axial_path, dimensions(simulation.model).joint
    if path is None or k < 0:
        return means
    law = joint_stiffness(path, tangents.joint, 4.0 * math.pi / tangents.speed, hz)
    laws = means.laws._replace(place=means.laws.place.copy(), velocity=means.laws.velocity.copy())
    laws.place[k, 0, 0], laws.velocity[k, 0, 0] = -law.real, -law.imag / (2.0 * math.pi * hz)
    return means._replace(laws=laws)


def with_film_means(
    model: ModelArrays, tangents: CycleTangents, means: CycleMeans, compliances: Sequence[ComplexArray], hz: float
) -> CycleMeans:
    """Means at ``hz`` with films in series with their ``compliances`` (p, p), m/N, in the order of :func:`films`."""
    omega = 2.0 * math.pi * hz
    laws = means.laws._replace(place=means.laws.place.copy(), velocity=means.laws.velocity.copy())
    for (k, parts), compliance in zip(films(model), compliances, strict=True):
        at = np.ix_(range(len(tangents.joint)), [k], parts, parts)
        law = -tangents.laws.place[at][:, 0] - 1j * omega * tangents.laws.velocity[at][:, 0]
        mean = mean_law(law, compliance)
        signs = np.ones((1, 1))
        if len(parts) < model.connections[k, slots.COUPLED]:  # the film is between a pin and its big end
            signs = np.array([[1.0, -1.0], [-1.0, 1.0]])
        size = signs.shape[0] * len(parts)
        laws.place[k, :size, :size] = -np.kron(signs, mean.real)
        laws.velocity[k, :size, :size] = -np.kron(signs, mean.imag / omega)
    return means._replace(hz=hz, laws=laws)


def mean_law(laws: ComplexArray, compliance: ComplexArray) -> ComplexArray:
    """Mean dynamic stiffness (p, p), N/m, of film stiffnesses ``laws`` (N, p, p), each in series with a compliance."""
    unit = np.eye(compliance.shape[0])
    forces = np.linalg.solve(unit + laws @ compliance, laws).mean(axis=0)
    return np.asarray(np.linalg.solve(unit - forces @ compliance, forces))


def films(model: ModelArrays) -> list[tuple[int, Sequence[int]]]:
    """Connection (row) of each film of mains and floating big ends, and components of the film's relative motion.

    All connections by terms count as films, because teeth and bearings of added bodies may open in a cycle, too.
    """
    found: list[tuple[int, Sequence[int]]] = [
        (k, range(int(model.connections[k, slots.COUPLED]))) for k in range(model.bearings.shape[0])
    ]
    found += [(int(rod[slots.PIN_ROW]), range(2)) for rod in model.cylinders if rod[slots.END_PORT] >= 0.0]
    added = range(int(model.layout[slots.TERM_ROW]), len(model.connections))
    return found + [(k, range(int(model.connections[k, slots.COUPLED]))) for k in added]


def main_tangents(model: ModelArrays, tangents: CycleTangents) -> tuple[Array, Array]:
    """Stiffness (N, b, 2, 2) N/m and damping, N s/m, of the main bearings over a cycle in axes at rest.

    x is across the engine and y upwards. Stiffness and damping are minus the derivatives of the force on a journal by
    its position and by its velocity in the bore, as seen from the ground.
    """
    mains = model.bearings.shape[0]
    place, velocity = (-part[:, :mains, :2, :2] for part in tangents.laws[:2])
    # Remove the contribution of the frame's rotation to the derivative by velocity.
    cos, sin, whirl = tangents.frame.T
    place = place - whirl[:, None, None, None] * velocity @ ACROSS
    turn = np.stack((np.stack((cos, -sin), axis=-1), np.stack((sin, cos), axis=-1)), axis=-2)[:, None]
    back = turn.transpose(0, 1, 3, 2)
    return turn @ place @ back, turn @ velocity @ back
