"""Forces of rods and bearings on a uniformly rotating crank over a cycle, with their exact tangents.

In the rotating frame, about the rigid crank at Ω, f = f₀(t) + A(t) ü + B(t) u̇ + C(t) u with the period of the cycle.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.dynamics.model import slots
from cranktrain.engine.model import Engine
from cranktrain.loads.articulated_rod import MASTERS_PIN, force_change, force_on_pin, hang, joint_values
from cranktrain.loads.gas_pressure import GasTrace, gas_pressure, spline_coefficients
from cranktrain.loads.slider_crank import remainder_inertia, rod_force
from cranktrain.structure.crank.modal import main_springs

_ACROSS = np.array([[0.0, -1.0], [1.0, 0.0]])
"""Matrix of the cross product e_z × in the plane."""
_APART = 1e-5
"""Half step (rad of crank angle) of the difference quotient for the derivative of the gas force."""


class PeriodicForces(NamedTuple):
    """Linearised force laws at m components of motion, at N samples of a cycle.

    ``rows`` (m, n) give the motion u = rows · q; ``forces`` (N, m) are those at u = 0; ``by_place``, ``by_velocity``
    and ``by_acceleration`` (N, m, m) are the tangents.
    """

    rows: Array
    forces: Array
    by_place: Array
    by_velocity: Array
    by_acceleration: Array


def rod_forces(
    engine: Engine, body: ReducedBody, speed: float, angle: Array, gas: GasTrace, load: float
) -> PeriodicForces:
    """Forces of the rods on the pins at crank angles (N,): per cylinder x, y and moment about z.

    The gas force of each cylinder depends on the angle of its own pin about the axis.
    """
    cylinders = engine.cylinders
    pushes = gas_forces(engine, speed, angle, gas, load)
    ahead, behind = (gas_forces(engine, speed, angle + sign * _APART, gas, load) for sign in (1.0, -1.0))
    rises = (ahead - behind) / (2.0 * _APART)
    rows = []
    samples, n = angle.size, 3 * engine.n_cylinders
    forces, tangents = np.zeros((samples, n)), np.zeros((3, samples, n, n))
    for c in range(engine.n_cylinders):
        pin = body.index(f"pin[{cylinders.pins[c]}]")
        shape, offset = body.shapes[pin], engine.rod_offsets[c]
        # The rod acts at distance ``offset`` along z from the middle of the pin.
        rows.append(np.stack((shape[0] + offset * shape[4], shape[1] - offset * shape[3], shape[5])))
        x0, y0 = body.positions[pin, :2]
        at, joint = slice(3 * c, 3 * c + 2), engine.articulations[c]
        turn = _rotations(angle - cylinders.bank_angles[c if joint is None else joint.master])
        x, y = (turn @ (x0, y0)).T
        motion = np.stack((x, y, -speed * y, speed * x, -(speed**2) * x, -(speed**2) * y), axis=1)
        force, push, own = _rod_laws(engine, c, motion, pushes[:, c])
        back = turn.transpose(0, 2, 1)
        forces[:, at] = force = _turned(back, force)
        by_place, by_velocity, by_acceleration = (back @ own[:, :, i] @ turn for i in range(3))
        # Velocity and acceleration in space are u̇ + Ω e_z×u and ü + 2Ω e_z×u̇ − Ω²u.
        tangents[0, :, at, at] = by_place + speed * by_velocity @ _ACROSS - speed**2 * by_acceleration
        tangents[1, :, at, at] = by_velocity + 2.0 * speed * by_acceleration @ _ACROSS
        tangents[2, :, at, at] = by_acceleration
        tangents[0, :, 3 * c + 2, at] = force @ _ACROSS
        # The pin's own angle about the axis changes by (x₀ u_y − y₀ u_x)/r².
        about = np.array([-y0, x0]) / (x0**2 + y0**2)
        tangents[0, :, at, at] += rises[:, c, None, None] * _turned(back, push)[:, :, None] * about
    return PeriodicForces(np.concatenate(rows), forces, *tangents)


def _rod_laws(engine: Engine, c: int, motion: Array, gas: Array) -> tuple[Array, Array, Array]:
    """Forces of a rod on a pin that moves as ``motion`` (N, 6) under a gas force (N,), in axes of the cylinder.

    Returns the forces (N, 2), their derivative (N, 2) by the gas force, and their derivatives (N, 2, 3, 2) by the pin's
    position, velocity and acceleration. An articulated rod uses the axes of its master rod's cylinder.
    """
    rod, offset, joint = engine.rods[c], engine.offsets[c], engine.articulations[c]
    remainder, oscillating = remainder_inertia(rod), rod.small_end_mass + engine.cylinders.piston_mass
    hung, pin, out = None if joint is None else joint_values(joint), np.zeros(MASTERS_PIN), np.zeros(16)
    force, push, own = np.zeros((len(motion), 2)), np.zeros((len(motion), 2)), np.zeros((len(motion), 2, 3, 2))
    for k, at_pin in enumerate(motion):
        if hung is not None:
            hang(hung, at_pin, pin)
        rod_force(*at_pin, gas[k], rod.length, rod.big_end_mass, oscillating, remainder, offset, 0.0, 0.0, out)
        across = at_pin[0] - offset
        force[k], push[k] = out[:2], (across / math.sqrt(rod.length**2 - across**2), -1.0)
        if hung is None:
            own[k, :, 0, 0], own[k, :, 1, 0], own[k, :, 2] = out[2:4], out[4:6], out[6:10].reshape(2, 2)
        else:
            own[k] = np.array([force_change(hung, pin, out, *way) for way in np.eye(6)]).T.reshape(2, 3, 2)
            force[k], push[k] = (force_on_pin(hung, pin, one)[:2] for one in (force[k], push[k]))
    return force, push, own


def _rotations(angles: Array) -> Array:
    """Matrices (N, 2, 2) that turn a vector of the plane by angles (N,)."""
    cos, sin = np.cos(angles), np.sin(angles)
    return np.stack((np.stack((cos, -sin), axis=-1), np.stack((sin, cos), axis=-1)), axis=-2)


def _turned(turns: Array, vectors: Array) -> Array:
    return np.asarray((turns @ vectors[:, :, None])[:, :, 0])


def gas_forces(engine: Engine, speed: float | Array, angle: Array, gas: GasTrace, load: float) -> Array:
    """Gas force (N, c) of each cylinder at crank angles, gauge pressure times piston area as in a run, N.

    ``angle`` is (N,) for all cylinders or (N, c) for each; ``speed`` (rad/s), one value or (N,), scales the burn.
    """
    area = 0.25 * math.pi * engine.cylinders.bore**2
    share = np.maximum(load * (1.0 - gas.falloff * (speed / gas.best_speed - 1.0) ** 2), 0.0)
    phases = engine.firing_angles
    pairs = [
        (spline_coefficients(trace.motored - slots.AMBIENT), spline_coefficients(trace.fired - trace.motored))
        for trace in gas.own or (gas,)
    ]
    own = pairs if gas.own else pairs * len(phases)
    angles = np.reshape(angle, (len(angle), -1)) - np.array(phases)
    parts = [
        np.stack([gas_pressure(at, pair[k]) for at, pair in zip(angles.T, own, strict=True)], axis=1) for k in range(2)
    ]
    return np.asarray(area * (parts[0] + np.atleast_1d(share)[:, None] * parts[1]))


def main_forces(engine: Engine, body: ReducedBody, speed: float, angle: Array) -> PeriodicForces:
    """Forces of linear main bearings at crank angles (N,), in x, y and, for bearings that resist it, tilt."""
    turn = _rotations(angle)
    back = turn.transpose(0, 2, 1)
    rows, pairs = [], []
    for i, (springs, dampers) in enumerate(zip(main_springs(engine), main_dampers(engine), strict=True), 1):
        for first in (0, 3):
            if first in springs:
                rows.append(body.shapes[body.index(f"main[{i}]"), first : first + 2])
                pairs.append([np.diag([law[first], law[first + 1]]) for law in (springs, dampers)])
    n = 2 * len(rows)
    tangents = np.zeros((3, angle.size, n, n))
    for k, (spring, damper) in enumerate(pairs):
        at = slice(2 * k, 2 * k + 2)
        damping = back @ damper @ turn
        tangents[0, :, at, at] = -back @ spring @ turn - speed * damping @ _ACROSS
        tangents[1, :, at, at] = -damping
    return PeriodicForces(np.concatenate(rows), np.zeros((angle.size, n)), *tangents)


def main_dampers(engine: Engine) -> list[dict[int, float]]:
    """Linear damping of each main bearing by component (0, 1: N s/m; 3, 4: N m s/rad)."""
    roller = engine.main_roller
    dampers: list[dict[int, float]] = [{} for _ in engine.crankshaft.main_widths]
    if roller is not None:
        for main, radial, tilt in zip(engine.roller_mains, roller.damping, roller.tilt_damping, strict=True):
            dampers[main] = {0: radial, 1: radial, 3: tilt, 4: tilt}
    for main in engine.plain_numbers:
        dampers[main] = {0: engine.plain_mains.damping_x, 1: engine.plain_mains.damping_y}
    return dampers


def joined(*parts: PeriodicForces) -> PeriodicForces:
    """Several sets of force laws joined into one; their tangents become diagonal blocks."""
    sizes = [part.rows.shape[0] for part in parts]
    samples, n = parts[0].forces.shape[0], sum(sizes)
    tangents = np.zeros((3, samples, n, n))
    first = 0
    for part, size in zip(parts, sizes, strict=True):
        at = slice(first, first + size)
        for whole, own in zip(tangents, part[2:], strict=True):
            whole[:, at, at] = own
        first += size
    rows, forces = np.concatenate([p.rows for p in parts]), np.hstack([p.forces for p in parts])
    return PeriodicForces(rows, forces, *tangents)
