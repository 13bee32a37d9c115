"""The cranktrain about its rigid rotation as a linear system of periodic coefficients, solved order by order.

About the rigid crank that turns at Ω the motion is small. In the turning frame

    q̈ + (D + 2ΩG) q̇ + [ω² + Ω² (K_σ − C)] q + shaft = Σ Φᵀ f,   f = f₀(t) + A(t) ü + B(t) u̇ + C(t) u,   u = Φ q

with f₀ the rods' forces on a rigid crank (gas and inertia) and A, B, C, of the cycle's period, the exact tangents of
the rods (whose inertia varies as they turn), of the bearings' springs and dampers (fixed in space) and of the moment
(u × f₀)_z. Every order of a cycle is solved with the mean of A, B and C; what they vary couples the orders and is
solved for by GMRES, matrix-free, in the forces at samples of a cycle. The frame turns with the crank's mean rotation,
as in a run. Gravity is left out.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, gmres

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.dynamics.model.arrays import structural_damping
from cranktrain.dynamics.model.bodies import locked_on_axis
from cranktrain.dynamics.model.slots import AMBIENT, ROTATION
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.film.laws.thrust import closed_stiffness
from cranktrain.loads.gas_pressure import GasTrace, gas_pressure, spline_coefficients
from cranktrain.loads.slider_crank import remainder_inertia, rod_force
from cranktrain.structure.crank.modal import main_springs

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_ACROSS = np.array([[0.0, -1.0], [1.0, 0.0]])
"""e_z × in the plane."""
_TOLERANCE = 1e-10
_APART = 1e-5
"""Angle (rad) at which the gas's rise is taken by differences."""


class PeriodicForces(NamedTuple):
    """Force laws at m components of motion, at N samples of a cycle.

    ``rows`` (m, n) of the motion u = rows · q; ``forces`` (N, m) at u = 0; ``by_place``, ``by_velocity`` and
    ``by_acceleration`` (N, m, m) their tangents.
    """

    rows: Array
    forces: Array
    by_place: Array
    by_velocity: Array
    by_acceleration: Array


class OrderStructure(Protocol):
    """What answers order by order: see :class:`PeriodicCrank`."""

    omega: Array
    samples: int

    def response(self, row: Array, added: ComplexArray, torque: ComplexArray) -> ComplexArray:
        """Complex amplitudes of a motion, see :meth:`PeriodicCrank.response`."""

    def spectrum(self, signal: Array) -> ComplexArray:
        """Complex amplitudes of samples."""

    def signal(self, spectrum: ComplexArray) -> Array:
        """Samples of complex amplitudes."""


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
    coupled : whether what varies over the cycle couples the orders; may be set
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
            self.forces = forces = _joined(forces, main_forces(engine, body, speed, self.angle))
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


def rod_forces(
    engine: Engine, body: ReducedBody, speed: float, angle: Array, gas: GasTrace, load: float
) -> PeriodicForces:
    """Forces of the rods at x, y and z-rotation of their places on the pins, three per cylinder; at angles (N,).

    The last row is the crank's mean rotation, which feels nothing and shifts the gas.
    """
    rod, cylinders = engine.rod, engine.cylinders
    remainder, oscillating = remainder_inertia(rod), rod.small_end_mass + cylinders.piston_mass
    out = np.zeros(16)
    pushes = gas_forces(engine, speed, angle, gas, load)
    ahead, behind = (gas_forces(engine, speed, angle + sign * _APART, gas, load) for sign in (1.0, -1.0))
    rises = (ahead - behind) / (2.0 * _APART)
    rows = []
    samples, n = angle.size, 3 * engine.n_cylinders + 1
    forces, tangents = np.zeros((samples, n)), np.zeros((3, samples, n, n))
    for c in range(engine.n_cylinders):
        pin = body.index(f"pin[{cylinders.pins[c]}]")
        shape, offset = body.shapes[pin], engine.rod_offsets[c]
        # The rod sits on the pin beside its middle, at (0, 0, offset) from it.
        rows.append(np.stack((shape[0] + offset * shape[4], shape[1] - offset * shape[3], shape[5])))
        x0, y0 = body.positions[pin, :2]
        at = slice(3 * c, 3 * c + 2)
        for k, theta in enumerate(angle - cylinders.bank_angles[c]):
            cos, sin = math.cos(theta), math.sin(theta)
            turn = np.array([[cos, -sin], [sin, cos]])
            x, y = turn @ (x0, y0)
            rod_force(
                x, y, -speed * y, speed * x, -(speed**2) * x, -(speed**2) * y, pushes[k, c], rod.length,
                rod.big_end_mass, oscillating, remainder, cylinders.pin_offset, 0.0, 0.0, out,
            )  # fmt: skip
            forces[k, at] = f_x, f_y = turn.T @ out[:2]
            own = np.zeros((2, 3, 2))  # by place, velocity and acceleration in cylinder axes
            own[:, 0, 0], own[:, 1, 0], own[:, 2] = out[2:4], out[4:6], out[6:10].reshape(2, 2)
            by_place, by_velocity, by_acceleration = (turn.T @ own[:, i] @ turn for i in range(3))
            # Velocity and acceleration in space are u̇ + Ω e_z×u and ü + 2Ω e_z×u̇ − Ω²u.
            tangents[0, k, at, at] = by_place + speed * by_velocity @ _ACROSS - speed**2 * by_acceleration
            tangents[1, k, at, at] = by_velocity + 2.0 * speed * by_acceleration @ _ACROSS
            tangents[2, k, at, at] = by_acceleration
            tangents[0, k, 3 * c + 2, at] = f_y, -f_x
            across = (x - cylinders.pin_offset) / math.sqrt(rod.length**2 - (x - cylinders.pin_offset) ** 2)
            tangents[0, k, at, -1] = rises[k, c] * turn.T @ (across, -1.0)
    mean_rotation = np.zeros((1, body.n_modes))
    mean_rotation[0, ROTATION] = body.shapes[body.index("pulley"), ROTATION, ROTATION]
    return PeriodicForces(np.concatenate((*rows, mean_rotation)), forces, *tangents)


def gas_forces(engine: Engine, speed: float | Array, angle: Array, gas: GasTrace, load: float) -> Array:
    """Gauge pressure times piston area (N, c) of each cylinder, N, at crank angles (N,), as a run has it.

    ``speed`` (rad/s) scales the burn, one for all or (N,).
    """
    area = 0.25 * math.pi * engine.cylinders.bore**2
    share = np.maximum(load * (1.0 - gas.falloff * (speed / gas.best_speed - 1.0) ** 2), 0.0)
    motored, rise = spline_coefficients(gas.motored - AMBIENT), spline_coefficients(gas.fired - gas.motored)
    phases = engine.firing_angles
    parts = [
        np.array([[gas_pressure(theta - phase, table) for phase in phases] for theta in angle])
        for table in (motored, rise)
    ]
    return np.asarray(area * (parts[0] + np.atleast_1d(share)[:, None] * parts[1]))


def main_forces(engine: Engine, body: ReducedBody, speed: float, angle: Array) -> PeriodicForces:
    """Linear springs and dampers of the main bearings at x, y and, where they resist it, tilt; at crank angles (N,)."""
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.stack((np.stack((cos, -sin), axis=-1), np.stack((sin, cos), axis=-1)), axis=-2)
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
    """Linear damping beside the springs of :func:`cranktrain.structure.crank.modal.main_springs` (N s/m, N m s/rad)."""
    roller = engine.main_roller
    dampers: list[dict[int, float]] = [{} for _ in engine.crankshaft.main_widths]
    if roller is not None:
        for main, radial, tilt in zip(engine.roller_mains, roller.damping, roller.tilt_damping, strict=True):
            dampers[main] = {0: radial, 1: radial, 3: tilt, 4: tilt}
    for main in engine.plain_numbers:
        dampers[main] = {0: engine.plain_mains.damping_x, 1: engine.plain_mains.damping_y}
    return dampers


def _joined(*parts: PeriodicForces) -> PeriodicForces:
    """Force laws side by side."""
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
