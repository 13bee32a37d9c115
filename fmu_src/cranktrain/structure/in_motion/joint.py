"""Mean law of the drive line's axial joint for small motions about a cycle.

For slip velocity v and deflection z of the teeth (:mod:`cranktrain.film.laws.axial_joint`) small changes satisfy

    δż = b δv − a δz,     a = k |v| / F_max,     b = 1 − k z sgn v / F_max.

Both change over the cycle. The response of the teeth to a slip d exp(iωt) is y(t) d exp(iωt), where y has the cycle's
period,

    ẏ = iω b − (a + iω) y,

and the force at ω is that of the dynamic stiffness (k + iωc) ȳ, where ȳ is the mean of y. Sticking teeth have ȳ = 1,
teeth that slide in one direction under a steady force have ȳ = 0. The friction limit is taken from the cycle.
"""

import cmath
import math

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.records import dimensions
from cranktrain.dynamics.model.state import film_offset
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.parts import AxialPath
from cranktrain.film.laws.axial_joint import DEFLECTION, LEAST_LIMIT, SLIP, WINDUP_TORQUE

STEADY = 1.0e-9
"""Limit of |decay factor over a cycle − 1| of the joint's response, below which the frozen response is used."""


def joint_at_state(simulation: Simulation) -> tuple[float, float]:
    """Coefficients a (1/s) and b of the joint at the state of the last tangents; (0, 1) for a run without a joint."""
    model, path = simulation.model, simulation.engine.axial_path
    if path is None or dimensions(model).joint < 0:
        return 0.0, 1.0
    size = dimensions(model)
    z = float(
        simulation.state[film_offset(size.modes, size.ports) + int(model.laws.remembered[size.joint]) + DEFLECTION]
    )
    place, velocity = model.laws.place[size.joint], model.laws.velocity[size.joint]
    return fading(path, z, float(velocity[SLIP]), float(place[WINDUP_TORQUE]))


def fading(path: AxialPath, deflection: float, slip_velocity: float, torque: float) -> tuple[float, float]:
    """Coefficients a (1/s) and b of the joint at a deflection (m) of teeth, a slip velocity (m/s), a torque (N m)."""
    if path.joint != "spline":
        return 0.0, 1.0
    limit = path.friction / path.spline_radius * abs(torque) + LEAST_LIMIT
    per_slip = path.joint_stiffness / limit
    return per_slip * abs(slip_velocity), 1.0 - per_slip * deflection * math.copysign(1.0, slip_velocity)


def joint_stiffness(path: AxialPath, joint: Array, period: float, hz: float) -> complex:
    """Dynamic stiffness (N/m) of the joint at ``hz``, from a and b (N, 2) at equal steps of a ``period`` (s)."""
    omega = 2.0 * math.pi * hz
    return (path.joint_stiffness + 1j * omega * path.joint_damping) * mean_answer(joint, period, omega)


def mean_answer(joint: Array, period: float, omega: float) -> complex:
    """Mean response ȳ at ω (rad/s) of the joint, from a (1/s) and b (``joint``, (N, 2)) at N steps of a period (s)."""
    rates = joint[:, 0] + 1j * omega
    frozen, step = 1j * omega * joint[:, 1] / rates, period / len(joint)
    left = np.exp(-rates * step)
    whole = cmath.exp(-complex(rates.sum()) * step)
    if abs(1.0 - whole) < STEADY:
        return complex(frozen.mean())
    y = 0.0j
    for part, target in zip(left, frozen, strict=True):
        y = target + (y - target) * part
    y /= 1.0 - whole
    total = 0.0j
    for part, target, rate in zip(left, frozen, rates, strict=True):
        total += target * step + (y - target) * (1.0 - part) / rate
        y = target + (y - target) * part
    return complex(total / period)
