"""Steady torsional vibration in the frequency domain by other ways than the product's: counterparts of its results.

:func:`forced_torsion` has the cranktrain on bearings of level ``linear``, linearised about uniform rotation
(:class:`PeriodicResponse`), with and without damper; no step, no integrator. With J the ring's inertia and
link = k + iωc, the ring's twist against a hub that turns by θ is

    ψ = (−ω²J θ − e)/(link − ω²J),   torque on the hub −(link ψ + e)

If the law's torque is not linear in the rate, c is the linear damper with the same dissipation over the cycle, the mean
of T ψ̇ over the mean of ψ̇², and e is the residual torque of the law. Both are found by iteration, so that all orders
of the torque balance. This is harmonic balance; equivalent linearisation is its first iteration. A ring transmits no
mean torque. With a nonlinear law it slips slowly on average against the hub.

:func:`torsional_response` has a torsional crank with its journals locked on their axis, which turns and twists, nothing
else. Its pins run on circles: at the angle θ + φ of pin c the rod pushes with the force of
:mod:`cranktrain.loads.slider_crank`, whose inertia varies as it turns. The linear laws of the crank are the tangents of
these forces at φ = 0. The difference between the exact forces at the last motion and their linear part is added to the
known forces, and the orders are solved again until the motion converges (harmonic balance). With twists of some
thousandths each round gains two digits or more. The wobble of the frame
(:func:`cranktrain.studies.torsion.frequency_run_up.frame_wobble`) is part of the balance.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.sparse.linalg import LinearOperator, gmres

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.dynamics.linear import SmallMotions
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.arrays import build_model
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.tangents import tangents_in_rotation
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import usual_level
from cranktrain.loads.damper import STIFFNESS, damper_torque, damping_coefficient
from cranktrain.loads.gas_pressure import GasTrace, gas_tables
from cranktrain.loads.slider_crank import remainder_inertia, rod_force
from cranktrain.studies.torsion.frequency_run_up import frame_wobble
from cranktrain.studies.torsion.rod_torque import gas_push

ComplexArray = NDArray[np.complex128]

HIGHEST_ORDER, HIGHEST_HELD_ORDER = 24.0, 60.0
GRAVITY = 9.80665
_TOLERANCE = 1e-10
# The law's torque is found to this share of its largest value, or after so many rounds not at all.
_SETTLED, _ROUNDS = 1e-8, 100
_HELD_SETTLED, _HELD_ROUNDS = 1e-10, 30


class OrderStructure(Protocol):
    """A structure whose response is computed for each order, see :class:`PeriodicResponse`."""

    omega: Array
    samples: int

    def response(self, row: Array, added: ComplexArray, torque: ComplexArray) -> ComplexArray:
        """Complex amplitudes of a motion, see :meth:`PeriodicResponse.response`."""

    def spectrum(self, signal: Array) -> ComplexArray:
        """Complex amplitudes of samples."""

    def signal(self, spectrum: ComplexArray) -> Array:
        """Samples of complex amplitudes."""


class PeriodicResponse:
    """Response of a cranktrain on linear bearings to its rods, linearised about uniform rotation, order by order.

    Every order of a cycle is solved with the mean of the tangents. Their variation couples the orders; it is solved by
    GMRES, matrix-free, in the forces at samples of a cycle. The frame turns with the crank's mean rotation, as in a
    run. Gravity is left out.

    Parameters
    ----------
    engine, body : the engine and its running body, with all parts attached
    speed : Ω, rad/s
    gas, load : pressure trace, and share of the full-load burn
    highest : highest order of the balance
    mains : ``linear`` or ``held``

    Attributes
    ----------
    angle : (N,) crank angle of the samples, rad
    omega : (k + 1,) angular frequencies of the orders 0, 0.5, …, rad/s
    samples : number of samples of a cycle
    rows, forces : (m, n) motion at m components of the rods and bearings, and (N, m) forces there at rest
    tangents : three arrays (N, m, m) of the forces by displacement, velocity and acceleration
    coupled : whether the variation over the cycle couples the orders; may be set
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
        self.samples = 8 * round(2.0 * highest)
        self.angle: Array = np.arange(self.samples, dtype=np.float64) * (4.0 * math.pi / self.samples)
        settings = Settings(crank="rigid", bearings=mains, block="ground", gas_load=load)
        model = build_model(replace(engine.without_additions, axial_path=None), body, settings, speed, gas)
        motions, laws = SmallMotions(model), tangents_in_rotation(model, speed, samples=self.samples)
        self.mass, self.damping, self.stiffness = motions.equations(speed, laws.mean())
        # No force acts on locked rigid motions; an added stiffness keeps their equations solvable.
        self._scale = float(np.max(body.omega)) ** 2
        self.stiffness += self._scale * np.diag(~self.stiffness.any(axis=0))
        rows, forces = [], []
        self.tangents = np.zeros((3, self.samples, len(model.ports), len(model.ports)))
        for k, row in enumerate(model.connections):
            size, first = int(row[at.COUPLED]), len(rows)
            own, ports = slice(first, first + size), row[at.FIRST : at.FIRST + int(row[at.COUPLED])]
            rows += [*motions.components()[motions.numbers(k)]]
            forces += [*laws.forces[:, ports].T]
            for whole, part in zip(self.tangents, laws[:3], strict=True):
                whole[:, own, own] = part[:, k, :size, :size]
            if row[at.OF_CYLINDER] >= 0 and row[at.TURNED] >= 0:  # the moment u × f of a rod about the crank's axis
                rows.append(motions.port(row[at.TURNED]))
                forces.append(np.zeros(self.samples))
                self.tangents[0, :, first + size, own] = np.stack((forces[first + 1], -forces[first]), axis=-1)
        self.rows, self.forces = np.array(rows), np.array(forces).T
        self.tangents = self.tangents[:, :, : len(rows), : len(rows)]
        self.omega: Array = 0.5 * speed * np.arange(self.samples // 8 + 1, dtype=np.float64)
        self.coupled = True
        self._known = self.forces
        self._varying = tuple(tangent - tangent.mean(axis=0) for tangent in self.tangents)
        self._flywheel: Array = body.shapes[body.index("flywheel"), 5]
        self._start: Array | None = None

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
        self._known = self.forces + added

    def modal_response(self, row: Array, added: ComplexArray, torque: ComplexArray) -> ComplexArray:
        """Complex amplitudes (k + 1, n) of the modes; arguments and errors as of :meth:`response`."""
        rows, w = self.rows, self.omega[:, None, None]
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


class Ring(NamedTuple):
    """A damper's ring: parameters as of :func:`cranktrain.loads.damper.damper_parameters` and inertia, kg m²."""

    parameters: Array
    inertia: float


class TorsionResponse(NamedTuple):
    """Steady torsional vibration at one speed.

    Attributes
    ----------
    speed : rad/s
    pulley : (k + 1,) complex amplitude of the pulley's torsion of order 0, 0.5, 1, …, rad; that of order o is
        Re[pulley exp(i o θ)]
    damping : of the linear damper that dissipates as much, N m s/rad; 0 without damper
    power : mean dissipated power of the damper, W
    torque : largest torque of the damper, N m
    """

    speed: float
    pulley: ComplexArray
    damping: float = 0.0
    power: float = 0.0
    torque: float = 0.0

    @property
    def orders(self) -> Array:
        """Orders, (k + 1,), from 0 on."""
        return np.asarray(0.5 * np.arange(self.pulley.size), dtype=np.float64)

    def amplitude(self, order: float) -> float:
        """Zero-to-peak amplitude of the pulley's torsion at ``order``, rad."""
        return float(np.abs(self.pulley[round(2.0 * order)]))


def forced_torsion(
    engine: Engine,
    body: ReducedBody,
    speed: float,
    ring: Ring | None = None,
    gas: GasTrace | None = None,
    load: float = 1.0,
    highest: float = HIGHEST_ORDER,
    coupled: bool = True,
) -> TorsionResponse:
    """Steady response at ``speed`` (rad/s).

    Parameters
    ----------
    engine : carrying the damper's housing where there is a ``ring``, by
        :func:`cranktrain.loads.damper.with_damper_housing`
    body : its running body, :func:`cranktrain.structure.crank.reduction.running_body`
    ring : of the damper on the pulley; None leaves it away
    gas, load : pressure trace in place of the built-in one; share of the full-load burn
    highest : highest order of the balance
    coupled : whether the variation over the cycle couples the orders

    Raises
    ------
    SolverError
        orders or a damper that do not settle
    """
    crank = PeriodicResponse(engine, body, speed, gas or GasTrace.from_engine(engine), load, highest)
    crank.coupled = coupled
    hub = body.shapes[body.index("pulley"), 5]
    if ring is None:
        nothing = np.zeros(crank.omega.size, dtype=complex)
        return TorsionResponse(speed, crank.response(hub, nothing, nothing))
    return balanced_ring(crank, hub, ring, speed)


def order_peak(
    engine: Engine,
    body: ReducedBody,
    order: float,
    speeds: tuple[float, float],
    ring: Ring | None = None,
) -> TorsionResponse:
    """Response at the speed, between two ``speeds`` (rad/s), at which the pulley's torsion of ``order`` is largest.

    Coarsely at 17 speeds, then between the neighbours of the best one; the speed to a ten-thousandth.
    """
    found: dict[float, TorsionResponse] = {}

    def least(speed: float) -> float:
        found[speed] = forced_torsion(engine, body, speed, ring)
        return -found[speed].amplitude(order)

    grid = np.linspace(*speeds, 17).tolist()
    best = min(grid, key=least)
    step = grid[1] - grid[0]
    around = (max(best - step, grid[0]), min(best + step, grid[-1]))
    minimize_scalar(least, bounds=around, method="bounded", options={"xatol": 1e-4 * best})
    return max(found.values(), key=lambda response: response.amplitude(order))


def balanced_ring(structure: OrderStructure, hub: Array, ring: Ring, speed: float = 0.0) -> TorsionResponse:
    """Response of a structure whose rotation ``hub`` carries a ring, by the iteration of this module.

    ``structure`` has ``omega``, ``samples`` and ``response`` as :class:`PeriodicResponse`; ``speed`` is passed on.
    """
    omega, samples = structure.omega, structure.samples
    parameters = ring.parameters
    spring, damping = float(parameters[STIFFNESS]), damping_coefficient(parameters)
    rest, slip = np.zeros(omega.size, dtype=complex), 0.0
    out = np.zeros(4)
    torque, power = np.empty(samples), np.empty(samples)
    inertia = -(omega**2) * ring.inertia
    for _ in range(_ROUNDS):
        link = spring + 1j * omega * damping
        whole = np.where(omega > 0.0, link + inertia, 1.0)
        share = np.where(omega > 0.0, inertia / whole, 0.0)
        pulley = structure.response(hub, share * link, -share * rest)
        twist = share * pulley - rest / whole
        angle, rate = structure.signal(twist), structure.signal(1j * omega * twist) + slip
        for k in range(samples):
            damper_torque(parameters, angle[k], rate[k], out)
            torque[k], power[k] = -out[0], out[3]
        before = link * twist + rest
        damping = float(power.mean() / np.mean(rate**2))
        found = structure.spectrum(torque)
        rest = found - (spring + 1j * omega * damping) * twist
        rest[0] = 0.0
        slip -= float(found[0].real) / damping
        largest = float(np.abs(torque).max())
        if np.abs(found - before).max() <= _SETTLED * largest:
            return TorsionResponse(speed, pulley, damping, float(power.mean()), largest)
    at = f" at {speed * 30.0 / math.pi:.0f} rev/min" if speed else ""
    raise SolverError(f"the damper's torque does not settle{at}; its law is too far from a linear one")


class HeldResponse(NamedTuple):
    """Steady twisting at one speed.

    Attributes
    ----------
    speed : rad/s
    pulley, flywheel : (k + 1,) complex amplitudes of the rotations against the frame of orders 0, 0.5, 1, …, rad; that
        of order o is Re[pulley exp(i o θ)] with θ = Ω t, the mean of the frame's angle
    crank : (k + 1,) swing of the crank's mean rotation about its steady turn, rad
    rounds : of the balance
    """

    speed: float
    pulley: ComplexArray
    flywheel: ComplexArray
    crank: ComplexArray
    rounds: int

    @property
    def orders(self) -> Array:
        """Orders, (k + 1,), from 0 on."""
        return np.asarray(0.5 * np.arange(self.pulley.size), dtype=np.float64)


def torsional_response(
    engine: Engine,
    body: ReducedBody,
    speed: float,
    gas: GasTrace | None = None,
    load: float = 1.0,
    highest: float = HIGHEST_HELD_ORDER,
) -> HeldResponse:
    """Steady response at ``speed`` (rad/s) of a torsional crank, its journals locked on their axis.

    Parameters
    ----------
    engine, body : the engine and its running body, :func:`cranktrain.structure.crank.level.crank_body`
    gas, load : pressure trace in place of the built-in one; share of the full-load burn
    highest : highest order of the balance

    Raises
    ------
    SolverError
        orders that do not settle
    """
    gas = gas or GasTrace.from_engine(engine)
    crank = PeriodicResponse(engine, body, speed, gas, load, highest, usual_level("torsional"))
    pulley, flywheel = (body.shapes[body.index(name), 5] for name in ("pulley", "flywheel"))
    nothing = np.zeros(crank.omega.size, dtype=complex)
    w = crank.omega[:, None]
    follows = frame_wobble(speed, crank.omega)
    largest = float(np.abs(crank.forces).max())
    added = np.zeros_like(crank.forces)
    for round_ in range(1, _HELD_ROUNDS + 1):
        modes = crank.modal_response(pulley, nothing, nothing)
        turning_swing = np.where(crank.omega > 0.0, pulley[5] * modes[:, 5], 0.0)
        frame = follows * turning_swing
        spectrum = modes @ crank.rows.T
        motions = [crank.signal((1j * w) ** order * spectrum) for order in range(3)]
        tangent = crank.forces.copy()
        for law, motion in zip(crank.tangents, motions, strict=True):
            tangent += np.einsum("tij,tj->ti", law, motion)
        turn, turning, swing = (motion[:, : engine.n_cylinders] for motion in motions)
        push = gas_forces(engine, speed, crank.angle[:, None] + turn, gas, load)
        exact = tangent.copy()
        exact[:, : engine.n_cylinders] = exact_rod_torques(engine, body, speed, crank.angle, push, turn, turning, swing)
        before, added = added, exact - tangent
        if np.abs(added - before).max() <= _HELD_SETTLED * largest:
            return HeldResponse(speed, modes @ pulley - frame, modes @ flywheel - frame, turning_swing, round_)
        crank.correct(added)
    raise SolverError(f"the orders do not settle at {speed * 30.0 / math.pi:.0f} rev/min; the crank twists too far")


def gas_forces(engine: Engine, speed: float | Array, angle: Array, gas: GasTrace, load: float) -> Array:
    """Gas force (N, c) of each cylinder at crank angles, gauge pressure times piston area as in a run, N.

    ``angle`` is (N,) for all cylinders or (N, c) for each; ``speed`` (rad/s), one value or (N,), scales the burn.
    """
    area = 0.25 * math.pi * engine.cylinders.bore**2
    share = np.maximum(load * (1.0 - gas.falloff * (speed / gas.best_speed - 1.0) ** 2), 0.0)
    own = np.reshape(angle, (len(angle), -1)) - np.array(engine.firing_angles)
    motored, rise = gas_push(gas_tables(gas), area, own)
    return np.asarray(motored - area * at.AMBIENT + np.atleast_1d(share)[:, None] * rise)


def exact_rod_torques(
    engine: Engine,
    body: ReducedBody,
    speed: float,
    angle: Array,
    push: Array,
    turn: Array,
    rate: Array,
    acceleration: Array,
) -> Array:
    """Torques (N, c) of the rods about the axis, on pins that run on their circles.

    ``angle`` (N,) of the frame, ``push`` (N, c) gas forces, N; ``turn``, ``rate`` and ``acceleration`` (N, c) of the
    pins in the frame, rad, s.
    """
    rod, cylinders = engine.rod, engine.cylinders
    remainder, oscillating = remainder_inertia(rod), rod.small_end_mass + cylinders.piston_mass
    out = np.zeros(16)
    torques = np.zeros((angle.size, engine.n_cylinders))
    for c in range(engine.n_cylinders):
        x0, y0 = body.positions[body.index(f"pin[{cylinders.pins[c]}]"), :2]
        down = GRAVITY * math.sin(cylinders.bank_angles[c]), GRAVITY * math.cos(cylinders.bank_angles[c])
        for k, frame in enumerate(angle):
            lead = turn[k, c]
            # The pin's place on its circle in cylinder axes.
            theta = frame - cylinders.bank_angles[c]
            cos, sin = math.cos(theta + lead), math.sin(theta + lead)
            x, y = cos * x0 - sin * y0, sin * x0 + cos * y0
            w, a = speed + rate[k, c], acceleration[k, c]
            rod_force(
                x, y, -w * y, w * x, -(w**2) * x - a * y, -(w**2) * y + a * x, push[k, c], rod.length,
                rod.big_end_mass, oscillating, remainder, cylinders.pin_offset, *down, out,
            )  # fmt: skip
            torques[k, c] = x * out[1] - y * out[0]
    return torques
