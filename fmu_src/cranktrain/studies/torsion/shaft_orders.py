"""A torsional crank with drive line and damper: response of the linear structure for each order, at many speeds.

In the modes of what turns (crank, ring, discs of the drive line), about a steady turn at Ω and with ω = oΩ for order o,

    [K + iH + iωC − ω²(I + Sᵀ J̄ S) − Sᵀ ḡ] x = Sᵀ f + t T,   S = rotations of the pins,   t = hub less ring,

f torques on the pins, T that of the damper, H = Σ ηk r rᵀ of the crank's shafts that have a loss factor, with their
twists r; J̄ is the cycle mean of the rods' inertia. The mean ḡ x of the gas torques' change vanishes where each pressure
goes by the angle of its own pin: a torque that is a periodic function of one angle has no mean slope. Where the trace
is phased to pulley or flywheel, pins turn against pressures, and ḡ does not vanish. Shafts of the drive line have a
stiffness of their own at each order and speed where it depends on frequency or mean torque, or has a loss factor
(:mod:`cranktrain.studies.torsion.line_link`). At order 0 the frame turns with the crank's mean rotation; the mean
torque of the drive line is sought in its place.

Matrices are those of :mod:`cranktrain.dynamics.linear`.
"""

import math
from collections.abc import Sequence
from copy import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.types import ComplexArray
from cranktrain.dynamics.linear import mean_places
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.model.hysteresis import OF_LOSS, OF_SHAFT
from cranktrain.dynamics.model.records import dimensions
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.dynamics.tangents import tangents_in_rotation
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.mean_load import balancing_load
from cranktrain.loads.torsional_line import torsional_line
from cranktrain.studies.torsion.added_orders import OrderMatrices, linear_model, not_linear
from cranktrain.studies.torsion.line_link import LineLink
from cranktrain.studies.torsion.rod_torque import Rods, gas_push

_MOVES = 1.0e-4
"""Least part of the crank in the shape of a mode that counts as one of the crank."""


class Observed(NamedTuple):
    """Rows of a transfer that follow the rows of the pins, by name."""

    twist: int
    pulley: int
    swing: int
    flywheel: int

    @property
    def shafts(self) -> int:
        """First row of the shafts' twists, which come last: shafts of the drive line, then those of the crank."""
        return self.flywheel + 1


class ShaftOrders:
    """Cranktrain of crank level ``torsional`` (or ``rigid``), its journals locked on their axis.

    Raises ``InputError``: a crank that bends or journals that are not locked, the boundary ``torque``.

    Parameters
    ----------
    engine, body, settings : as of :func:`cranktrain.dynamics.simulation.simulate`; with the damper's housing where
        ``settings.damper`` is ``fitted``
    gas : pressure trace
    highest : highest order of the balance

    Attributes
    ----------
    orders : (k + 1,) 0, 0.5, … ``highest``
    samples : number of samples of a cycle
    angle : (N,) crank angle of the samples, rad
    throw : (c,) index of each cylinder's pin among the p pins
    at : rows of a transfer behind the pins': twist of hub against ring, rotation of the pulley, of the crank in the
        mean, of the flywheel; then the twists of the shafts
    lead : row of a transfer by whose motion pressures lead; None where they go by the pins' own angles
    rows : (p + 4 + shafts, n) rows of a transfer on the n coordinates
    link : the drive line's shafts
    shafts : names of all shafts whose torques are known, first those of ``link``, then those of a crank from a table
    balanced : whether the burn balances the engine's ``[load]``
    """

    def __init__(
        self,
        engine: Engine,
        body: ReducedBody,
        settings: Settings,
        gas: GasTrace,
        highest: float,
        balanced: bool = False,
    ) -> None:
        settings = resolved(settings, engine)
        if bearing_law(settings.bearings).carries or settings.boundary != "speed":
            raise InputError(
                "a run-up in the frequency domain takes a crank that only twists at a given speed; use crank "
                "torsional, bearings held (or auto) and boundary speed, or run it in time"
            )
        if reason := not_linear(engine):
            raise InputError(f"{reason}, which a steady state in the frequency domain does not include; run it in time")
        model = linear_model(engine, body, settings, gas)
        line = torsional_line(engine)
        self.link, self._engine, self._gas, self.balanced = LineLink(line), engine, gas, balanced
        count = round(2.0 * highest)
        self.orders: Array = 0.5 * np.arange(count + 1, dtype=np.float64)
        self.samples = 8 * count
        self.angle: Array = np.arange(self.samples, dtype=np.float64) * (4.0 * math.pi / self.samples)
        self.rods = Rods.of_engine(engine, body, settings.gravity)
        self.gas_tables, self.area = model.gas, model.cylinders[0, slots.AREA]
        self.crankcase = float(model.scalars[slots.CRANKCASE])
        self.phase: Array = model.cylinders[:, slots.PHASE]
        self._burn = model.scalars[[slots.GAS_LOAD, slots.FALLOFF, slots.BEST_SPEED]]
        pins, first, self.throw = np.unique(engine.cylinders.pins, return_index=True, return_inverse=True)
        self.pins = len(pins)
        self.at = Observed(*range(self.pins, self.pins + 4))
        self.lead: int | None = {"pulley": self.at.pulley, "flywheel": self.at.flywheel}.get(settings.encoder)
        # Rigid motions other than the rotation are locked and are left out.
        own = slice(slots.ROTATION, None)
        sizes = dimensions(model)
        rows = model.ports[model.cylinders[first, slots.PIN_TURN].astype(int), own]
        twist = model.ports[sizes.twist, own] if sizes.damper >= 0 else np.zeros(rows.shape[1])
        swing = np.zeros(rows.shape[1])
        swing[0] = model.scalars[slots.RIGID_ROTATION]
        self._flywheel: Array = model.ends[0, own]
        self._shaft_twists: Array = model.shafts[: len(line.shafts), own]
        # Shafts of a crank from a table.
        found = np.flatnonzero(body.shaft_laws[:, OF_SHAFT])
        twists = body.twists[found].reshape(found.size, body.n_modes)
        self._own_twists: Array = np.pad(twists, ((0, 0), (0, model.shafts.shape[1] - body.n_modes)))[:, own]
        self._own_laws: Array = body.shaft_laws[found]
        lost = self._own_laws[:, OF_SHAFT] * self._own_laws[:, OF_LOSS]
        self._hysteresis: Array = self._own_twists.T @ (lost[:, None] * self._own_twists)
        self.shafts = (*self.link.names, *(body.shafts[k] for k in found))
        ends = (twist, model.ends[1, own], swing, self._flywheel)
        self.rows: Array = np.vstack((rows, *ends, self._shaft_twists, self._own_twists))
        # Loss factors are complex stiffness here. The model's last shafts represent them in time and are left out.
        kept = len(model.shafts) - np.count_nonzero(self._own_laws[:, OF_LOSS]) - np.count_nonzero(line.hysteresis)
        model = model._replace(shafts=model.shafts[:kept], shaft_laws=model.shaft_laws[:kept])
        self._crank: tuple[Array, Array] = model.omega2[own], model.damping[own]
        # The ring is appended to the crank's modes.
        self._ring = [sizes.crank_modes - slots.ROTATION] if sizes.damper >= 0 else []
        still = self.rods.torque(np.repeat(self.angle[:, None], engine.n_cylinders, axis=1))
        self.inertia: ComplexArray = np.fft.rfft(self.on_pins(still.inertia), axis=0) / self.samples
        added = range(int(model.layout[slots.TERM_ROW]), len(model.connections))
        laws = tangents_in_rotation(model, rows=added, places=mean_places(model, added)).mean()
        laws.acceleration[model.cylinders[:, slots.END_ROW].astype(int), 0, 0] = -still.inertia.mean(axis=0)
        self._matrices = OrderMatrices(model, laws, max(gas.best_speed, 1.0))
        self._parts: ComplexArray = self._matrices.of_crank
        self._scale = float(self._parts[0].real.max())
        mass, damping, stiffness = self._matrices.at_rest
        self._at_rest = [stiffness, damping, mass]
        self._gas_means(still.arm)
        cylinders = np.repeat(self.angle[:, None], self.throw.size, axis=1)
        motored = self.push(cylinders, np.zeros(1))
        rise = self.push(cylinders, np.ones(1)) - motored
        parts = (-0.5 * still.slope, still.weight, -still.arm * motored, -still.arm * rise)
        self.still = tuple(self.spectrum(self.on_pins(part)) for part in parts)

    def at_load(self, load: float) -> "ShaftOrders":
        """Copy of the structure at another load, a fraction of the full-load burn."""
        other = copy(self)
        other._burn = np.array([load, *self._burn[1:]])
        return other

    def with_crank(self, squares: Array, damping: Array) -> "ShaftOrders":
        """Structure with other stiffness (m,) 1/s² and damping (m,) 1/s of the crank's own modes.

        The m modes are those of its body from the rotation about the axis on.
        """
        other, own = copy(self), np.arange(squares.size)
        other._parts, other._at_rest = self._parts.copy(), [part.copy() for part in self._at_rest]
        for part, at_rest, before, now in zip((0, 3), other._at_rest, self._crank, (squares, damping), strict=False):
            for matrix in (other._parts[part], at_rest):
                matrix[own, own] += now - before[: now.size]
        other._crank = squares, damping
        other._scale = float(other._parts[0].real.max())
        return other

    def on_pins(self, values: Array) -> Array:
        """Sums (…, p) over the rods of each pin of values (…, c)."""
        return np.stack([values[..., self.throw == k].sum(axis=-1) for k in range(self.pins)], axis=-1)

    def burn(self, speeds: Array) -> Array:
        """Fraction of the full-load burn at speeds (s,) rad/s."""
        load, falloff, best = self._burn
        if self.balanced:
            load = np.array([balancing_load(self._engine, self._gas, speed) for speed in speeds.tolist()])
        return np.maximum(load * (1.0 - falloff * (speeds / best - 1.0) ** 2), 0.0)

    def push(self, angle: Array, burn: Array) -> Array:
        """Gas force (gauge pressure times piston area), N, at cylinders' crank angles (…, c) and fraction ``burn``."""
        motored, rise = gas_push(self.gas_tables, self.area, angle - self.phase)
        return np.asarray(motored - self.crankcase * self.area + burn * rise)

    def spectrum(self, signal: Array, axis: int = 0) -> ComplexArray:
        """Complex amplitudes of the orders along an axis of a cycle's samples; that of order o is Re[a exp(i o θ)]."""
        moved = np.moveaxis(signal, axis, -1)
        result = 2.0 / self.samples * np.fft.rfft(moved, axis=-1)[..., : self.orders.size]
        result[..., 0] *= 0.5
        return np.moveaxis(result, -1, axis)

    def signal(self, spectrum: ComplexArray, axis: int = 0) -> Array:
        """Samples of complex amplitudes, inverse of :meth:`spectrum`."""
        moved = 0.5 * self.samples * np.moveaxis(spectrum, axis, -1)
        moved[..., 0] *= 2.0
        return np.moveaxis(np.fft.irfft(moved, self.samples, axis=-1), -1, axis)

    def known(self, speeds: Array) -> ComplexArray:
        """Torques (s, k + 1, p) on the pins of a rigidly rotating crank at ``speeds`` (s,) rad/s."""
        inertia, weight, motored, rise = self.still
        share = self.burn(speeds)[:, None, None]
        return np.asarray(speeds[:, None, None] ** 2 * inertia + weight + motored + share * rise)

    def mean_torque(self, speeds: Array) -> Array:
        """Mean torque (s,) of the engine at the flywheel, N m."""
        return np.asarray(self.known(speeds)[:, 0].real.sum(axis=1))

    def friction(self, speeds: Array) -> Array:
        """Equivalent damping (s, shafts) of the friction of the drive line, see :mod:`line_link`; ``SolverError``."""
        rubbing, omega = self.link.rubbing, speeds[:, None] * self.orders
        free, by = self._shafts_alone(speeds) if rubbing else (np.zeros(0), np.zeros(0))

        def twists(damping: Array) -> ComplexArray:
            # Damping of a few shafts is a change of low rank: (1 + G E) ψ = ψ₀ for the twists ψ of these shafts.
            excess = 1j * omega[..., None] * damping[:, None, rubbing]
            own = by[:, :, rubbing] * excess[:, :, None, :] + np.eye(len(rubbing))
            rub = free[:, :, rubbing] / own[..., 0] if len(rubbing) == 1 else (
                np.linalg.solve(own, free[:, :, rubbing, None])[..., 0])  # fmt: skip
            return np.asarray(free - (by @ (excess * rub)[..., None])[..., 0])

        return self.link.settled_friction(twists, omega, lambda one: self.signal(one, 1), speeds.size)

    def _shafts_alone(self, speeds: Array) -> tuple[ComplexArray, ComplexArray]:
        """Twists (s, k + 1, shafts) without friction, and by a unit torque in each rubbing shaft (…, shafts, m)."""
        pins, own = self.rows[: self.pins], self._shaft_twists[self.link.rubbing]
        right = np.empty((speeds.size, self.orders.size, own.shape[1], 1 + len(own)), dtype=complex)
        right[..., 0] = self.known(speeds) @ pins
        right[..., 1:] = own.T
        moved = np.linalg.solve(self._dynamic(speeds, np.arange(self.orders.size), None), right)
        moved[:, 0, 0] = 0.0
        found = self._shaft_twists @ moved
        return found[..., 0], found[..., 1:]

    def shaft_torques(self, speeds: Array, twists: ComplexArray, friction: Array) -> ComplexArray:
        """Torques (s, k + 1, shafts) of shafts twisted by ``twists`` of that shape, mean torque included, N m."""
        mean, omega, line = self.mean_torque(speeds), speeds[:, None] * self.orders, len(self.link.names)
        result = self.link.stiffness(omega, mean, friction) * twists[..., :line]
        result[:, 0] = mean[:, None] * self.link.shares
        stiffness, damping, loss = self._own_laws.T
        own = stiffness * (1.0 + 1j * loss * (omega > 0.0)[..., None]) + 1j * omega[..., None] * damping
        return np.concatenate((result, own * twists[..., line:]), axis=-1)

    def mean_feedback(self, speeds: Array, motion: ComplexArray) -> ComplexArray:
        """Part of the pins' torques (s, k + 1, p) that the structure includes: mean inertia and mean gas tangents.

        ``motion`` (s, k + 1, rows) as of :meth:`transfer`.
        """
        omega, pins = speeds[:, None] * self.orders, motion[:, :, : self.pins]
        result = (omega**2)[:, :, None] * self.inertia[0].real * pins
        if self.lead is not None:
            motored, rise = self._by_turn
            slope = motored + self.burn(speeds)[:, None] * rise
            result = result + slope[:, None] * (pins - motion[:, :, self.lead, None])
        return np.asarray(result)

    def exact(self, speeds: Array, motion: ComplexArray) -> ComplexArray:
        """Exact torques (s, k + 1, p) of rods and gas on pins that move by ``motion`` (s, k + 1, rows)."""
        turn = motion[:, :, : self.pins]
        w = 1j * speeds[:, None, None] * self.orders[:, None]
        turned, rate, acceleration = (self.signal(w**order * turn, 1)[:, :, self.throw] for order in range(3))
        cylinders = self.angle[:, None] + turned
        at = self.rods.torque(cylinders)
        own = cylinders if self.lead is None else (self.angle + self.signal(motion[:, :, self.lead], 1))[:, :, None]
        push = self.push(own, self.burn(speeds)[:, None, None])
        result = at.weight - at.arm * push - at.inertia * acceleration
        result -= 0.5 * at.slope * (speeds[:, None, None] + rate) ** 2
        return self.spectrum(self.on_pins(result), 1)

    def transfer(self, speeds: Array, orders: NDArray[np.intp], friction: Array | None = None) -> ComplexArray:
        """Motions (s, o, p + 4 + shafts, p + 1) of the pins and of ``at`` by torques on pins and between hub and ring.

        ``orders`` (o,) are indices; ``friction`` (s, shafts) is the damping that stands for friction. The link between
        hub and ring itself is left out, see the class ``_Transfer`` of
        :mod:`cranktrain.studies.torsion.frequency_run_up`.
        """
        dynamic = self._dynamic(speeds, orders, friction)
        right = self.rows[: self.pins + 1].T
        zero = np.flatnonzero(orders == 0)
        moved = np.linalg.solve(dynamic, np.broadcast_to(right, (*dynamic.shape[:2], *right.shape)))
        for k in zero:
            moved[:, k, 0] = 0.0
        return np.asarray(self.rows @ moved)

    def answers(self, speeds: Array, torques: ComplexArray, friction: Array | None = None) -> ComplexArray:
        """Coordinates (s, k + 1, n, 2) under ``torques`` (s, k + 1, p) on pins, and under 1 N m between hub and ring.

        It needs fewer right-hand sides than :meth:`transfer` if orders are not coupled; the arguments are the same.
        """
        right = np.empty((*torques.shape[:2], self.rows.shape[1], 2), dtype=complex)
        right[..., 0] = torques @ self.rows[: self.pins]
        right[..., 1] = self.rows[self.pins]
        moved = np.linalg.solve(self._dynamic(speeds, np.arange(self.orders.size), friction), right)
        moved[:, 0, 0] = 0.0
        return np.asarray(moved)

    def rotations(self, body: ReducedBody, names: Sequence[str]) -> Array:
        """Rows (m, n) that give the rotations about the axis of interfaces of the crank's ``body``."""
        turned = body.shapes[[body.index(name) for name in names], 5, slots.ROTATION :]
        return np.pad(turned, ((0, 0), (0, self.rows.shape[1] - turned.shape[1])))

    def ends_rows(self) -> Array:
        """Rows (4, n) of :class:`Observed`: twist of hub against ring, pulley, swing, flywheel."""
        return self.rows[self.pins : self.pins + 4]

    def shaft_rows(self) -> Array:
        """Rows (shafts, n) that give the twists of all ``shafts``."""
        return np.vstack((self._shaft_twists, self._own_twists))

    def matrices(self, ring: bool) -> tuple[Array, Array, Array]:
        """Stiffness, damping and mass (m, m) with mean rods, with or without the damper's ring, its link left out.

        Modes of added bodies at rest follow those of the crank.
        """
        kept = np.delete(np.arange(len(self._at_rest[0])), [] if ring else self._ring)
        stiffness, damping, mass = (part[np.ix_(kept, kept)] for part in self._at_rest)
        return stiffness, damping, mass

    @property
    def ring(self) -> list[int]:
        """Indices of the damper ring's coordinate: one index, or none without a damper."""
        return self._ring

    def frequencies_hz(self) -> Array:
        """Natural frequencies (m,) above 0 with mean rods, without damping and without the damper's ring.

        Modes in which only added bodies move are left out.
        """
        stiffness, _, mass = self.matrices(False)
        squares, shapes = eigh(stiffness, mass)
        crank = self.rows.shape[1] - len(self._ring)
        moves = np.linalg.norm(shapes[:crank], axis=0) > _MOVES * np.linalg.norm(shapes, axis=0)
        return np.sqrt(squares[(squares > 1e-6 * squares[-1]) & moves]) / (2.0 * math.pi)

    def _dynamic(self, speeds: Array, orders: NDArray[np.intp], friction: Array | None) -> ComplexArray:
        """Dynamic stiffness (s, o, n, n) without the link of hub and ring; arguments as of :meth:`transfer`.

        At order 0 the flywheel stands still, and the mean torque that this takes is the first unknown.
        """
        n = self.rows.shape[1]
        pins = self.rows[: self.pins]
        w = speeds[:, None] * self.orders[orders]
        share = np.broadcast_to(self.burn(speeds)[:, None], w.shape)
        motored, rise = np.zeros((2, n, n))
        if self.lead is not None:
            motored, rise = (pins.T @ (slope[:, None] * (pins - self.rows[self.lead])) for slope in self._by_turn)
        more = np.stack((-np.ones_like(w), -share, 1j * (w > 0.0)), axis=-1)
        weights = np.concatenate((self._matrices.weights(speeds[:, None], w), more), axis=-1)
        parts = np.concatenate((self._parts, np.stack((motored, rise, self._hysteresis))))
        dynamic = (weights @ parts.reshape(len(parts), -1)).reshape(*w.shape, n, n)
        special = self.link.special
        if special:
            rubbing = np.zeros((speeds.size, self._shaft_twists.shape[0])) if friction is None else friction
            own = self._shaft_twists[special]
            excess = self.link.excess(w, self.mean_torque(speeds), rubbing)
            dynamic += np.einsum("skt,ti,tj->skij", excess, own, own)
        for one, speed in zip(dynamic, speeds.tolist(), strict=True):
            one -= self._matrices.felt(speed, self.orders[orders])
        for k in np.flatnonzero(orders == 0):
            dynamic[:, k, :, 0] = self._scale * self._flywheel
            dynamic[:, k, self._ring, self._ring] = self._scale
        return np.asarray(dynamic)

    def _gas_means(self, arm: Array) -> None:
        """Cycle means of the gas torques' slopes by a pin's turn at given pressures, (p,) N m/rad: motored and rise.

        From the spectra: the mean of −p h' is that of p' h. A lead of the pressures does the opposite.
        """
        cylinders = np.repeat(self.angle[:, None], self.throw.size, axis=1)
        pair = []
        for push in gas_push(self.gas_tables, self.area, cylinders - self.phase):
            slope = np.fft.irfft(0.5j * np.arange(self.samples // 2 + 1)[:, None] * np.fft.rfft(push, axis=0), axis=0)
            pair.append(self.on_pins((slope * arm).mean(axis=0)))
        self._by_turn = pair[0], pair[1]
