"""Run-up of a torsional crank in the frequency domain: all speeds and orders at once, without time steps.

``linear``: the structure with the cycle mean of the rods' inertia and of the gas torques' tangents
(:mod:`cranktrain.studies.torsion.shaft_orders`), under the torques of a crank that turns rigidly. Orders are not
coupled.

``harmonic-balance``: the rods' exact torques, those of a run in time. With the turn y of a pin and the two-sided
Fourier coefficients Ĵ_h of its rods' inertia over the crank angle, inertia couples order m to order k by

    f_k = Ω²/2 Σ_m Ĵ_{k−m} (k² + m²) y_m,   m and k of both signs,

which is −Ω² (J y'' + J' y' + ½ J'' y). J repeats every revolution, so whole and half orders are two systems. For each
system one LU factorisation per speed solves the structure with this coupling. The difference between the exact torques
at the last motion and their linear part is added to the known torques until the motion converges.

Motions are given against the frame, as a run gives them. The frame follows the crank's rotation slowly
(:func:`cranktrain.loads.drive_line.frame_lead`): it wobbles by

    δ = κ φ/(τ (κ/τ − ω² + iωκ)),   φ = the crank's mean rotation in space

about a steady turn.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from cranktrain.core.errors import InputError, SolverError, nearest
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array, ComplexArray
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import SLOWEST
from cranktrain.engine.model import Engine
from cranktrain.loads.drive_line import RECENTRING_REVOLUTIONS
from cranktrain.loads.gas_pressure import Gas, GasTrace
from cranktrain.loads.mean_load import balancing_load
from cranktrain.results.run_up.run_up import FLYWHEEL, TORSION, RunUp
from cranktrain.studies.run_up.sequence import Failed
from cranktrain.studies.torsion.damper_link import DamperLink, equivalent
from cranktrain.studies.torsion.shaft_orders import ShaftOrders

Fitted = tuple[Engine, Settings]

LINEAR, HARMONIC_BALANCE = RULES = ("linear", "harmonic-balance")
HIGHEST_ORDER = 24.0
BALANCED_ORDER = 60.0
"""Highest order in the harmonic balance at one speed."""
_AT_ONCE = 20
"""Number of speeds that are solved together, whose matrix factors are in memory at once."""
_SETTLED, _ROUNDS = 1e-8, 40


def frequency_run_up(
    engine: Engine,
    body: ReducedBody,
    settings: Settings,
    speeds: Array,
    orders: Sequence[float],
    rule: str = LINEAR,
    gas: Gas | None = None,
    balanced: bool = False,
    failed: list[Failed] | None = None,
) -> RunUp:
    """Run-up of ``pulley.torsion`` and ``flywheel.torsion``, and of the torques of shafts that a table states.

    Raises ``InputError``: a rule, speed or order that does not exist, a model that does more than twist;
    ``SolverError``: orders that settle at none of the speeds, or without a list ``failed`` not at all.

    Parameters
    ----------
    engine, body, settings : as of :func:`cranktrain.dynamics.simulation.simulate`, of a torsional crank at a given
        speed; with damper ``fitted`` both carry its housing
    speeds : (s,) rad/s
    orders : (o,) multiples of a half
    rule : ``linear`` or ``harmonic-balance``, see this module; the balance has the orders up to 24 at least
    gas : pressure trace, or traces over speed, in place of the built-in one
    balanced : whether the burn balances the engine's ``[load]`` at each speed, in place of the settings' load
    failed : list to which speeds are added whose orders do not settle; their amplitudes are not a number

    Returns
    -------
    amplitudes (rad) of increasing speeds: order o is Re[a exp(i o θ)] with θ the mean of the frame's angle; of shafts
    of a line of discs and of a crank from a table as ``shaft[NAME to NAME].torque``, N m
    """
    if rule not in RULES:
        raise InputError(f"rule '{rule}' of a run-up in the frequency domain does not exist; {nearest(rule, RULES)}")
    speeds = np.unique(np.asarray(speeds, dtype=float))
    if not np.all((speeds >= SLOWEST) & np.isfinite(speeds)):
        raise InputError(f"speeds of a run-up must be finite and at least {SLOWEST / RPM:.0f} rev/min")
    places = _halves(orders)
    highest = max(0.5 * float(places.max(initial=1)), HIGHEST_ORDER)
    damper, used = (engine, settings) if settings.damper == "fitted" else None, gas or GasTrace.from_engine(engine)
    one = isinstance(used, GasTrace)  # true if one pressure trace serves all speeds
    solve, lost = _linear if rule == LINEAR else _balanced, [] if failed is None else failed
    found_parts = []
    for some in (speeds,) if one else np.split(speeds, speeds.size):
        first = float(some[0])
        own_load = balancing_load(engine, used, first) if balanced and not one else settings.gas_load
        trace = used.at(first, own_load)
        structure = ShaftOrders(engine, body, settings, trace, highest, balanced)
        parts = [some] if rule == LINEAR else np.array_split(some, -(-some.size // _AT_ONCE))
        found_parts += [_each(partial(solve, structure, damper), part, lost) for part in parts]
    shape = max(part.shape[1:] for part in found_parts)
    found = np.concatenate([np.broadcast_to(part, (part.shape[0], *shape)) for part in found_parts])
    if lost and (failed is None or len(lost) == speeds.size):
        raise SolverError(lost[0].reason)
    motion = structure.signal(found, 1)
    extremes = np.stack((motion.min(axis=1), found[:, 0].real, motion.max(axis=1)), axis=1)
    # Without a chain in the drive line, torques of its shafts are left out; a connecting shaft carries the load.
    first = 0 if engine.drive_line_chain is not None else len(structure.link.names)
    ends = {TORSION: 0, FLYWHEEL: 1}
    ends |= {shaft_output(name): 2 + k for k, name in enumerate(structure.shafts) if k >= first}
    attributes = {"engine": engine.name, "crank": settings.crank, "damper": settings.damper}
    return RunUp(
        speeds=speeds,
        orders=np.asarray(orders, dtype=float),
        amplitudes={name: found[:, places, k] for name, k in ends.items()},
        extremes={name: extremes[:, :, k] for name, k in ends.items()},
        cycles=np.zeros(speeds.size, dtype=int),
        repeats=np.ones(speeds.size, dtype=int),
        left=np.zeros(speeds.size),
        attributes={**attributes, "body_digest": body.digest, "steady": rule},
    )


def _halves(orders: Sequence[float]) -> NDArray[np.int_]:
    """Orders as multiples of half an order; ``InputError`` for an order that is not such a multiple."""
    places = np.round(2.0 * np.asarray(orders, dtype=float)).astype(int)
    if np.any(np.abs(0.5 * places - orders) > 1e-9) or np.any(places < 1):
        raise InputError("orders of a run-up are multiples of a half, from 0.5 on")
    return places


def shaft_output(name: str) -> str:
    """Name of the output of a shaft's torque."""
    return f"shaft[{name}].torque"


def _each(solve: Callable[[Array], ComplexArray], speeds: Array, failed: list[Failed]) -> ComplexArray:
    """Solutions at all ``speeds`` together; if this fails, each speed alone, so that only failing speeds are lost."""
    try:
        return solve(speeds)
    except (SolverError, np.linalg.LinAlgError) as error:
        if speeds.size == 1:
            failed.append(Failed(float(speeds[0]), str(error)))
            return np.full((1, 1, 1), np.nan, dtype=complex)
    found = [_each(solve, speeds[k : k + 1], failed) for k in range(speeds.size)]
    shape = max(one.shape for one in found)
    return np.concatenate([np.broadcast_to(one, shape) for one in found])


def steady_orders(
    engine: Engine, body: ReducedBody, settings: Settings, speed: float, gas: GasTrace
) -> list[list[float]]:
    """Orders of the pulley's torsion at one speed (rad/s), zero to peak in degrees, for the summary of a run.

    Arguments and errors as of :func:`frequency_run_up`.
    """
    orders = [0.5 * k for k in range(1, round(2.0 * BALANCED_ORDER) + 1)]
    found = frequency_run_up(engine, body, settings, np.array([speed]), orders, HARMONIC_BALANCE, gas)
    amplitudes = np.degrees(np.abs(found.torsion[0])).tolist()
    return [[order, size] for order, size in zip(orders, amplitudes, strict=True) if order <= HIGHEST_ORDER]


class _Transfer(NamedTuple):
    """Response of a structure with its damper to torques on the pins and to the damper's residual torque.

    ``motion`` (s, k, rows, p) and ``by_rest`` (s, k, rows): rows as of :meth:`ShaftOrders.transfer`. ``link`` is a
    damper whose law is not linear, ``stiffness`` (s, k) its complex stiffness; ``friction`` (s, shafts) the damping
    that stands for friction in the drive line.
    """

    motion: ComplexArray
    by_rest: ComplexArray
    stiffness: ComplexArray
    link: DamperLink | None
    friction: Array

    @classmethod
    def of(cls, structure: ShaftOrders, damper: Fitted | None, speeds: Array, known: ComplexArray) -> "_Transfer":
        """Make the transfer at ``speeds`` (s,); ``known`` (s, k, p) are torques on pins of a rigidly rotating crank."""
        friction = structure.friction(speeds)
        whole = structure.transfer(speeds, np.arange(structure.orders.size), friction)
        motion, by_rest = whole[..., :-1], whole[..., -1]
        if damper is None:
            return cls(motion, by_rest, np.zeros(motion.shape[:2], dtype=complex), None, friction)
        twist = structure.at.twist
        free = np.einsum("skp,skp->sk", motion[:, :, twist], known)
        link, stiffness, share = _linked(structure, damper, speeds, free, by_rest[:, :, twist])
        held = (stiffness * share)[:, :, None, None]
        motion = motion - held * by_rest[:, :, :, None] * motion[:, :, twist, None]
        return cls(motion, share[:, :, None] * by_rest, stiffness, link if link.thinning else None, friction)

    def at(self, which: NDArray[np.bool_]) -> "_Transfer":
        """Transfer at those speeds for which ``which`` (s,) is true."""
        link = self.link.at(which) if self.link is not None else None
        return _Transfer(self.motion[which], self.by_rest[which], self.stiffness[which], link, self.friction[which])

    def respond(self, torques: ComplexArray, rest: ComplexArray) -> ComplexArray:
        """Motions (s, k, rows) by torques on the pins (s, k, p) and the residual torque of the damper (s, k)."""
        return np.asarray((self.motion @ torques[..., None])[..., 0] - self.by_rest * rest[:, :, None])


def frame_wobble(speed: float | Array, omega: Array) -> ComplexArray:
    """Orders (…, k + 1) of the frame's oscillation about the crank's mean rotation, without mean."""
    inverse = speed / (2.0 * np.pi * RECENTRING_REVOLUTIONS)
    kappa = 4.0 * inverse
    result = kappa * inverse / (kappa * inverse - omega**2 + 1j * omega * kappa)
    return np.asarray(np.where(omega > 0.0, result, 0.0))


def _ends(structure: ShaftOrders, speeds: Array, motion: ComplexArray, friction: Array) -> ComplexArray:
    """Rotation of pulley and flywheel relative to the frame, then torques of the shafts, (s, k, 2 + shafts)."""
    wobble = frame_wobble(speeds[:, None], speeds[:, None] * structure.orders)
    at = structure.at
    ends = motion[:, :, [at.pulley, at.flywheel]] - (wobble * motion[:, :, at.swing])[:, :, None]
    return np.concatenate((ends, structure.shaft_torques(speeds, motion[:, :, at.shafts :], friction)), axis=2)


def _linked(
    structure: ShaftOrders, damper: Fitted, speeds: Array, free: ComplexArray, compliance: ComplexArray
) -> tuple[DamperLink, ComplexArray, ComplexArray]:
    """Link of a damper, its complex stiffness (s, k), and the factor (s, k) by which it reduces the ``free`` twist."""
    link = DamperLink(*damper, speeds, speeds[:, None] * structure.orders)
    stiffness = equivalent(link, free, compliance, structure)
    return link, stiffness, 1.0 / (1.0 + stiffness * compliance)


class SolvedOrders(NamedTuple):
    """Solution of a linear run-up by orders.

    Attributes
    ----------
    structure : linear structure
    motion : (s, k + 1, n) complex coordinates
    friction : (s, shafts) damping that stands for friction in the drive line
    twist, stiffness : (s, k + 1) twist of hub against ring and complex stiffness of the damper; None without damper
    link : damper, or None
    """

    structure: ShaftOrders
    motion: ComplexArray
    friction: Array
    twist: ComplexArray | None = None
    stiffness: ComplexArray | None = None
    link: DamperLink | None = None


def solved_orders(structure: ShaftOrders, damper: Fitted | None, speeds: Array) -> SolvedOrders:
    """Solve the motion of a linear structure, with the mean inertia of its rods, at ``speeds`` (s,) rad/s.

    Raises ``SolverError``: a damper or friction that does not settle.
    """
    friction = structure.friction(speeds)
    moved = structure.answers(speeds, structure.known(speeds), friction)
    free, by_damper = moved[..., 0], moved[..., 1]
    if damper is None:
        return SolvedOrders(structure, free, friction)
    row = structure.ends_rows()[0]
    link, stiffness, share = _linked(structure, damper, speeds, free @ row, by_damper @ row)
    twist = share * (free @ row)
    motion = free - (stiffness * twist)[..., None] * by_damper
    return SolvedOrders(structure, motion, friction, twist, stiffness, link)


def _linear(structure: ShaftOrders, damper: Fitted | None, speeds: Array) -> ComplexArray:
    """Orders (s, k + 1, 2 + shafts) of pulley, flywheel and shaft torques, with the mean inertia of the rods."""
    solved = solved_orders(structure, damper, speeds)
    return _ends(structure, speeds, solved.motion @ structure.rows.T, solved.friction)


class _Coupling:
    """Varying part of the rods' inertia for each order: torque f_k = Ω² Σ_m (a_km y_m + b_km ȳ_m) for k, m > 0."""

    def __init__(self, structure: ShaftOrders) -> None:
        o = structure.orders[1:]
        half = np.rint(2.0 * o).astype(int)
        squares = 0.5 * (o[:, None] ** 2 + o**2)[:, :, None]
        apart, together = half[:, None] - half, half[:, None] + half
        # ``inertia`` holds coefficients of half orders h ≥ 0; coefficients of −h are their complex conjugates.
        found = structure.inertia[np.abs(apart)]
        found = np.where((apart < 0)[:, :, None], found.conj(), found)
        found[apart == 0] = 0.0
        self.direct, self.mirrored = squares * found, squares * structure.inertia[together]
        self._halves = []
        for odd in (0, 1):
            own = np.flatnonzero(half % 2 == odd)
            direct, mirrored = self.direct[np.ix_(own, own)], self.mirrored[np.ix_(own, own)]
            self._halves.append((own, direct + mirrored, direct - mirrored))

    def torque(self, speeds: Array, turn: ComplexArray) -> ComplexArray:
        """Torques (s, k + 1, p) by the rotations of the pins, of the same shape; the effect of order 0 is left out."""
        result = np.zeros_like(turn)
        own = turn[:, 1:].transpose(2, 1, 0)
        direct, mirrored = self.direct.transpose(2, 0, 1), self.mirrored.transpose(2, 0, 1)
        result[:, 1:] = (direct @ own + mirrored @ own.conj()).transpose(2, 1, 0)
        return speeds[:, None, None] ** 2 * result

    def factors(self, speed: float, compliance: ComplexArray) -> list[tuple[NDArray[np.intp], Any, Any]]:
        """LU factors of 1 − R A with separate real and imaginary parts, by whole and half orders; ``compliance`` R."""
        found = []
        pins = compliance.shape[1]
        for own, both, apart in self._halves:
            size = own.size * pins
            by = -(speed**2) * compliance[own + 1][:, :, None, :]
            blocks = np.empty((2, own.size, pins, 2, own.size, pins))
            # Real parts of rotations are multiplied by the sum a + b, imaginary parts by i (a − b).
            for part, coefficients in enumerate((both, apart)):
                product = by * coefficients[:, None]
                blocks[part, :, :, part] = product.real
                blocks[1 - part, :, :, part] = product.imag if part == 0 else -product.imag
            matrix = blocks.reshape(2 * size, 2 * size)
            np.einsum("ii->i", matrix)[:] += 1.0
            found.append((own + 1, *dgetrf(matrix.T, overwrite_a=True)[:2]))
        return found


def _coupled(factors: list[tuple[NDArray[np.intp], Any, Any]], free: ComplexArray) -> ComplexArray:
    """Rotations (k + 1, p) of the pins at one speed, from their rotations ``free`` without coupling of orders."""
    result = free.copy()
    for own, factor, pivots in factors:
        right = free[own].ravel()
        found, _ = dgetrs(factor, pivots, np.concatenate((right.real, right.imag)), trans=1)
        result[own] = (found[: right.size] + 1j * found[right.size :]).reshape(free[own].shape)
    return result


def _balanced(structure: ShaftOrders, damper: Fitted | None, speeds: Array) -> ComplexArray:
    """Orders (s, k + 1, 2 + shafts) of pulley, flywheel and shaft torques, by harmonic balance."""
    pins, twist = slice(0, structure.pins), structure.at.twist
    torques = structure.known(speeds)
    coupling, transfer = _Coupling(structure), _Transfer.of(structure, damper, speeds, torques)
    factors = [coupling.factors(speed, transfer.motion[k, :, pins]) for k, speed in enumerate(speeds.tolist())]
    rest = np.zeros(torques.shape[:2], dtype=complex)
    largest = np.abs(torques).max()
    result = np.zeros((*torques.shape[:2], 2 + len(structure.shafts)), dtype=complex)
    left = np.arange(speeds.size)
    change = ahead = np.full(speeds.size, np.inf)
    for _ in range(_ROUNDS):
        free = transfer.respond(torques, rest)[:, :, pins]
        turn = np.stack([_coupled(factors[k], own) for k, own in zip(left, free, strict=True)])
        varying = coupling.torque(speeds, turn)
        motion = transfer.respond(torques + varying, rest)
        settled, going = ahead <= _SETTLED * largest, ahead > _SETTLED * largest
        result[left[settled]] = _ends(structure, speeds[settled], motion[settled], transfer.friction[settled])
        if settled.all():
            return result
        left, speeds, torques, rest, change, transfer, varying, motion = (
            left[going], speeds[going], torques[going], rest[going], change[going], transfer.at(going), varying[going],
            motion[going],
        )  # fmt: skip
        held = structure.mean_feedback(speeds, motion) + varying
        before, torques = torques, structure.exact(speeds, motion) - held
        earlier, change = change, np.abs(torques - before).max(axis=(1, 2))
        if transfer.link is not None:
            last, rest = rest, transfer.link.rest(motion[:, :, twist], transfer.stiffness, structure)
            change = np.maximum(change, np.abs(rest - last).max(axis=1))
        # Changes decrease by a constant factor per iteration, so the change of the next iteration can be predicted.
        ahead = change * np.minimum(change / earlier, 1.0) if np.isfinite(earlier).all() else change
    raise SolverError(
        f"the orders do not settle at {speeds[0] / RPM:.0f} rev/min; take the rule linear, or run it in time"
    )
