"""Start and stop of an engine through the modes of its mounts, in time.

The crank's speed changes at a constant rate; the engine's centre q and the internal displacements z of the mounts obey

    M q̈ + Ω G q̇ + Σ t (c t·q̇ + k t·q) + Σ k_b t (t·q − z_b) = Re Σ_k a_k(Ω, Ω̇) e^{ikθ}
    m_b z̈_b + c_b ż_b = k_b (t·q − z_b)

with the direction t of a component; a branch without mass has no velocity of its own. They are solved by LSODA (SciPy,
A. C. Hindmarsh, 1983). The motion begins with the periodic motion of the first speed, or at rest under the first force.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from cranktrain.core.errors import SolverError
from cranktrain.core.types import Array
from cranktrain_lab.mounts.body import RigidEngine
from cranktrain_lab.mounts.excitation import ORDERS, Excitation
from cranktrain_lab.mounts.response import gyroscopic
from cranktrain_lab.mounts.stiffness import DIRECTIONS, Complex, Support

TOLERANCE, LEAST = 1.0e-6, 1.0e-3
"""Relative tolerance of the integration, and the size (m, rad, m/s, rad/s) below which errors count as absolute."""
LONGEST = 1.0e-3
"""Longest step, s, so that no firing is stepped over."""
PER_PERIOD, SAMPLES = 24, 200
"""Samples of a run per period of its highest order at its highest speed, and least number of samples."""


class States(NamedTuple):
    """Linear system ẏ = (A + Ω B) y + R f of the centre's motion and the mounts' internal motion, and mount forces C y.

    ``y`` has displacements (6,) and velocities (6,) of the centre, then those of the branches.
    """

    a: Array
    b: Array
    r: Array
    c: Array


def states(body: RigidEngine, support: Support) -> States:
    """System of an engine on mounts without tables, see :func:`cranktrain_lab.mounts.stiffness.with_states`."""
    first = 2 * DIRECTIONS
    size = first + sum(1 if one.mass == 0.0 else 2 for one in support.branches)
    a, b, r = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, DIRECTIONS))
    c = np.zeros((len(support.motion), size))
    c[:, :DIRECTIONS] = support.stiffness[:, None] * support.motion
    c[:, DIRECTIONS:first] = support.damping[:, None] * support.motion
    a[:DIRECTIONS, DIRECTIONS:first] = np.eye(DIRECTIONS)
    place = first
    for one in support.branches:
        stretch = np.zeros(size)
        stretch[:DIRECTIONS], stretch[place] = support.motion[one.row], -1.0
        c[one.row] += one.stiffness * stretch
        if one.mass == 0.0:
            a[place] = one.stiffness / one.damping * stretch
            place += 1
            continue
        a[place, place + 1] = 1.0
        a[place + 1] = one.stiffness / one.mass * stretch
        a[place + 1, place + 1] -= one.damping / one.mass
        place += 2
    inverse = np.linalg.inv(body.mass)
    a[DIRECTIONS:first] = -inverse @ support.motion.T @ c
    b[DIRECTIONS:first, DIRECTIONS:first] = -inverse @ gyroscopic(body)
    r[DIRECTIONS:first] = inverse
    return States(a, b, r, c)


class Transient(NamedTuple):
    """Run of n samples with j mounts.

    Attributes
    ----------
    time, speed : (n,) s and rad/s
    centre : (n, 6) displacement of the centre and rotation about it, m and rad
    mounts : (n, j, 6) forces and moments of the mounts on the frame, N and N m
    """

    time: Array
    speed: Array
    centre: Array
    mounts: Array


def transient(
    system: States, forces: Callable[[float, float, float], Array], first: float, rate: float, duration: float,
    start: Array, tolerance: float = TOLERANCE,
) -> Transient:  # fmt: skip
    """Run over a ``duration``, s, from the speed ``first`` (rad/s) at ``rate`` (rad/s²).

    Raises ``SolverError`` if the integration fails.

    Parameters
    ----------
    forces : function of crank angle (rad), speed (rad/s) and acceleration (rad/s²) with the excitation (6,), N and N m
    start : state at the begin, as :func:`steady` gives it
    """

    def derivative(time: float, y: Array) -> Array:
        speed = first + rate * time
        force = forces(first * time + 0.5 * rate * time * time, speed, rate)
        return np.asarray(system.a @ y + speed * (system.b @ y) + system.r @ force)

    highest = max(abs(first), abs(first + rate * duration)) * float(ORDERS[-1]) / (2.0 * math.pi)
    count = max(SAMPLES, math.ceil(PER_PERIOD * highest * duration))
    time = np.linspace(0.0, duration, count)
    found = solve_ivp(
        derivative, (0.0, duration), start, method="LSODA", t_eval=time, rtol=tolerance, atol=LEAST * tolerance,
        max_step=LONGEST,
    )  # fmt: skip
    if not found.success:
        raise SolverError(f"start or stop on the mounts: {found.message}")
    motion = found.y.T
    mounts = (motion @ system.c.T).reshape(count, -1, DIRECTIONS)
    return Transient(time, first + rate * time, motion[:, :DIRECTIONS], mounts)


def steady(system: States, speed: float, amplitudes: Complex) -> Array:
    """State at crank angle 0 of the periodic motion at a constant speed (rad/s), under ``amplitudes`` (orders, 6)."""
    turned = system.a + speed * system.b
    found = np.zeros(len(system.a))
    for order, own in zip(ORDERS, amplitudes, strict=True):
        found += np.linalg.solve(1j * order * speed * np.eye(len(turned)) - turned, system.r @ own).real
    return found


def engine_force(excitation: Excitation, load: float) -> Callable[[float, float, float], Array]:
    """Excitation (6,) of an engine over angle, speed and acceleration, as :func:`transient` takes it."""

    def force(angle: float, speed: float, acceleration: float) -> Array:
        return np.asarray((excitation.at(speed, load, acceleration) * np.exp(1j * angle * ORDERS)[:, None]).real.sum(0))

    return force
