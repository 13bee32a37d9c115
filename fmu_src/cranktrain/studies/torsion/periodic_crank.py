"""The cranktrain about its rigid rotation as a linear system of periodic coefficients, solved order by order.

About the rigid crank that turns at Ω the motion is small. In the turning frame

    q̈ + (D + 2ΩG) q̇ + [ω² + Ω² (K_σ − C)] q + shaft = Σ Φᵀ f,   f = f₀(t) + A(t) ü + B(t) u̇ + C(t) u,   u = Φ q

with f₀ the rods' forces on a rigid crank (gas and inertia) and A, B, C, of the cycle's period, the exact tangents of
the rods (whose inertia varies as they turn), of the bearings' springs and dampers (fixed in space) and of the moment
(u × f₀)_z. Every order of a cycle is solved with the mean of A, B and C. Their variation couples the orders; it is
solved by GMRES, matrix-free, in the forces at samples of a cycle. The frame turns with the crank's mean rotation, as in
a run. Gravity is left out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, gmres

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.dynamics.model.arrays import structural_damping
from cranktrain.dynamics.model.bodies import locked_on_axis
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.film.laws.thrust import closed_stiffness
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.in_motion.periodic_forces import joined, main_forces, rod_forces

ComplexArray = NDArray[np.complex128]

_TOLERANCE = 1e-10


class PeriodicCrank:
    """Cranktrain at one speed, in the modes of its running body, with bearings of level ``linear`` or ``held``.

    Parameters
    ----------
    engine, body : the engine and its running body, with all parts attached
    speed : Ω, rad/s
    gas, load : pressure trace, and share of the full-load burn
    highest : highest order
    mains : ``linear`` or ``held``

    Attributes
    ----------
    omega : (k + 1,) angular frequencies of the orders 0, 0.5, …, rad/s
    samples : number of samples of a cycle
    coupled : whether the variation over the cycle couples the orders; may be set
    angle : (N,) crank angle of the samples, rad
    forces : the force laws about the rigid rotation; what :meth:`correct` adds is not among them
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
        count = round(2.0 * highest)
        self.samples = 8 * count
        self.omega: Array = 0.5 * speed * np.arange(count + 1, dtype=np.float64)
        self.coupled = True
        self.angle: Array = np.arange(self.samples, dtype=np.float64) * (4.0 * math.pi / self.samples)
        locked = not bearing_law(mains).carries
        if locked:
            body = locked_on_axis(body)
        self.forces = forces = rod_forces(engine, body, speed, self.angle, gas, load)
        if not locked:
            self.forces = forces = joined(forces, main_forces(engine, body, speed, self.angle))
        self._known = forces.forces
        place, velocity, acceleration = (tangent.mean(axis=0) for tangent in forces[2:])
        self._varying = tuple(
            tangent - mean for tangent, mean in zip(forces[2:], (place, velocity, acceleration), strict=True)
        )
        rows = forces.rows
        thrust, shaft = body.shapes[body.index("thrust"), 2], body.shapes[body.index("flywheel"), 5]
        self._flywheel: Array = shaft
        springs = closed_stiffness(engine.thrust) * np.outer(thrust, thrust)
        engine.refuse_additions("steady states in the frequency domain")
        line = engine.connecting_shaft
        springs += line.stiffness * np.outer(shaft, shaft)
        dampers = engine.thrust.damping * np.outer(thrust, thrust) + line.damping * np.outer(shaft, shaft)
        stiffness = np.diag(body.omega**2) + speed**2 * (body.stress_stiffness - body.centrifugal) + springs
        damping = np.diag(structural_damping(engine, body)) + 2.0 * speed * body.gyroscopic + dampers
        self._start: Array | None = None
        self._scale = float(np.max(body.omega)) ** 2
        self.stiffness = stiffness - rows.T @ place @ rows
        self.damping = damping - rows.T @ velocity @ rows
        self.mass = np.eye(body.n_modes) - rows.T @ acceleration @ rows
        # Rigid motions that are locked feel nothing; a stiffness keeps their equations solvable.
        self.stiffness += self._scale * np.diag(np.where(np.any(body.shapes, axis=(0, 1)), 0.0, 1.0))

    def response(self, row: Array, added: ComplexArray, torque: ComplexArray) -> ComplexArray:
        """Complex amplitudes (k + 1,) of the orders of the motion ``row`` (n,).

        ``added`` (k + 1,) is a dynamic stiffness and ``torque`` (k + 1,) an external torque (or force) there.

        Raises
        ------
        SolverError
            orders whose coupling does not converge
        """
        return np.asarray(self.modal_response(row, added, torque) @ row)

    def correct(self, added: Array) -> None:
        """Take forces (N, m) into account that the linear laws do not have, from now on."""
        self._known = self.forces.forces + added

    def modal_response(self, row: Array, added: ComplexArray, torque: ComplexArray) -> ComplexArray:
        """Complex amplitudes (k + 1, n) of the modes; arguments and errors as of :meth:`response`."""
        rows, w = self.forces.rows, self.omega[:, None, None]
        dynamic = self.stiffness + 1j * w * self.damping - w**2 * self.mass
        dynamic = dynamic + added[:, None, None] * np.outer(row, row)
        # The frame turns with the crank's mean rotation: in its place the mean torque of the shaft is sought, which
        # acts on the flywheel and winds the crank up.
        dynamic[0, :, 5] = self._scale * self._flywheel
        right = np.broadcast_to(np.vstack((rows, row)).T, (self.omega.size, row.size, rows.shape[0] + 1))
        moved = np.linalg.solve(dynamic, right)
        moved[0, 5] = 0.0
        compliance = rows @ moved
        spectrum = self.spectrum(self._known)

        def feedback(force: ComplexArray, own: ComplexArray) -> Array:
            u = np.einsum("hij,hj->hi", compliance[:, :, :-1], force) + compliance[:, :, -1] * own[:, None]
            s = 1j * self.omega[:, None]
            parts = zip(self._varying, (u, s * u, s**2 * u), strict=True)
            return sum(np.einsum("tij,tj->ti", varying, self.signal(part)) for varying, part in parts)

        if self.coupled:
            shape = self._known.shape
            silent = np.zeros_like(torque)
            operator = LinearOperator(
                (shape[0] * shape[1],) * 2,
                matvec=lambda x: x - feedback(self.spectrum(x.reshape(shape)), silent).ravel(),
                dtype=np.float64,
            )
            known = self._known + feedback(np.zeros_like(spectrum), torque)
            found, status = gmres(operator, known.ravel(), self._start, rtol=_TOLERANCE, restart=300, maxiter=4)
            if status != 0:
                raise SolverError("the orders of a cycle do not settle; leave their coupling out")
            self._start = found  # the next response is often nearly this one
            spectrum = self.spectrum(found.reshape(shape))
        return np.asarray(np.einsum("hij,hj->hi", moved, np.hstack((spectrum, torque[:, None]))))

    def spectrum(self, signal: Array) -> ComplexArray:
        """Complex amplitudes (k + 1, …) of the orders of a cycle's samples (N, …)."""
        result = 2.0 / self.samples * np.fft.rfft(signal, axis=0)[: self.omega.size]
        result[0] *= 0.5
        return np.asarray(result)

    def signal(self, spectrum: ComplexArray) -> Array:
        """Samples (N, …) of complex amplitudes (k + 1, …), inverse of :meth:`spectrum`."""
        whole = np.zeros((self.samples // 2 + 1, *spectrum.shape[1:]), dtype=complex)
        whole[: self.omega.size] = 0.5 * self.samples * spectrum
        whole[0] *= 2.0
        return np.asarray(np.fft.irfft(whole, self.samples, axis=0))
