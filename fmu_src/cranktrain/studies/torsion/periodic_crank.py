"""Cranktrain linearised about its rigid rotation, with cycle means of all periodic coefficients.

About the rigid crank that turns at Ω the motion is small. In the turning frame

    q̈ + (D + 2ΩG) q̇ + [ω² + Ω² (K_σ − C)] q + shaft = Σ Φᵀ f,   f = f₀(t) + A(t) ü + B(t) u̇ + C(t) u,   u = Φ q

with f₀ the rods' forces on a rigid crank (gas and inertia) and A, B, C, of the cycle's period, the exact tangents of
the rods (whose inertia varies as they turn), of the bearings' springs and dampers (fixed in space) and of the moment
(u × f₀)_z. Gravity is left out.
"""

import math

import numpy as np

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.dynamics.model.arrays import structural_damping
from cranktrain.dynamics.model.bodies import locked_on_axis
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.film.laws.thrust import closed_stiffness
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.in_motion.periodic_forces import joined, main_forces, rod_forces


class PeriodicCrank:
    """Cranktrain at one speed, in the modes of its running body, with bearings of level ``linear`` or ``held``.

    Parameters
    ----------
    engine, body : the engine and its running body, with all parts attached; a drive line of discs is left out, which
        :func:`cranktrain.studies.torsion.line_modes.with_line` attaches, and so are added bodies
    speed : Ω, rad/s
    gas, load : pressure trace, and share of the full-load burn
    highest : highest order that the samples resolve
    mains : ``linear`` or ``held``

    Attributes
    ----------
    angle : (N,) crank angle of the samples of a cycle, rad
    forces : the force laws about the rigid rotation
    stiffness, damping, mass : (n, n) of the crank with the cycle means of all tangents
    """

    def __init__(
        self,
        engine: Engine,
        body: ReducedBody,
        speed: float,
        gas: GasTrace,
        load: float,
        highest: float,
        mains: str = "linear",
    ) -> None:
        samples = 8 * round(2.0 * highest)
        self.angle: Array = np.arange(samples, dtype=np.float64) * (4.0 * math.pi / samples)
        locked = not bearing_law(mains).carries
        if locked:
            body = locked_on_axis(body)
        self.forces = forces = rod_forces(engine, body, speed, self.angle, gas, load)
        if not locked:
            self.forces = forces = joined(forces, main_forces(engine, body, speed, self.angle))
        place, velocity, acceleration = (tangent.mean(axis=0) for tangent in forces[2:])
        rows = forces.rows
        thrust, shaft = body.shapes[body.index("thrust"), 2], body.shapes[body.index("flywheel"), 5]
        springs = closed_stiffness(engine.thrust) * np.outer(thrust, thrust)
        line = engine.drive_line
        springs_of_line = (0.0, 0.0) if engine.drive_line_chain is not None else (line.stiffness, line.damping)
        springs += springs_of_line[0] * np.outer(shaft, shaft)
        dampers = engine.thrust.damping * np.outer(thrust, thrust) + springs_of_line[1] * np.outer(shaft, shaft)
        stiffness = np.diag(body.omega**2) + speed**2 * (body.stress_stiffness - body.centrifugal) + springs
        damping = np.diag(structural_damping(engine, body)) + 2.0 * speed * body.gyroscopic + dampers
        self.stiffness = stiffness - rows.T @ place @ rows
        self.damping = damping - rows.T @ velocity @ rows
        self.mass = np.eye(body.n_modes) - rows.T @ acceleration @ rows
        # No force acts on locked rigid motions; an added stiffness keeps their equations solvable.
        still = np.where(np.any(body.shapes, axis=(0, 1)), 0.0, 1.0)
        self.stiffness += float(np.max(body.omega)) ** 2 * np.diag(still)
