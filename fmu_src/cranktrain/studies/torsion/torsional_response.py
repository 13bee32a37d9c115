"""Steady state of a torsional crank in the frequency domain, to the accuracy of a converged run in time.

A torsional crank with its journals locked on their axis turns and twists, nothing else. Its pins run on circles: at the
angle θ + φ of pin c the rod pushes with the force of :mod:`cranktrain.loads.slider_crank`, whose inertia varies as it
turns. The linear laws of :class:`cranktrain.studies.torsion.periodic_crank.PeriodicCrank` are the tangents of these
forces at φ = 0. The difference between the exact forces at the last motion and their linear part is added to the known
forces, and the orders are solved again until the motion converges (harmonic balance). With twists of some thousandths
each round gains two digits or more.

The frame of a run follows the crank's rotation slowly (:func:`cranktrain.loads.drive_line.frame_lead`): it wobbles by

    δ = κ φ/(τ (κ/τ − ω² + iωκ)),   φ = the crank's mean rotation in space

about a steady turn, and gas pressure goes by its angle. The wobble is part of the balance; motions are given against
the frame, as a run gives them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import usual_level
from cranktrain.loads.drive_line import RECENTRING_REVOLUTIONS
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.slider_crank import remainder_inertia, rod_force
from cranktrain.structure.in_motion.periodic_forces import gas_forces
from cranktrain.studies.torsion.periodic_crank import PeriodicCrank

ComplexArray = NDArray[np.complex128]

HIGHEST_ORDER, LISTED = 60.0, 24.0
GRAVITY = 9.80665
_SETTLED, _ROUNDS = 1e-10, 30


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
    highest: float = HIGHEST_ORDER,
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
    crank = PeriodicCrank(engine, body, speed, gas, load, highest, usual_level("torsional"))
    pulley, flywheel = (body.shapes[body.index(name), 5] for name in ("pulley", "flywheel"))
    nothing = np.zeros(crank.omega.size, dtype=complex)
    laws, w = crank.forces, crank.omega[:, None]
    follows = frame_wobble(speed, crank.omega)
    largest = float(np.abs(laws.forces).max())
    added = np.zeros_like(laws.forces)
    for round_ in range(1, _ROUNDS + 1):
        modes = crank.modal_response(pulley, nothing, nothing)
        turning_swing = np.where(crank.omega > 0.0, pulley[5] * modes[:, 5], 0.0)
        frame = follows * turning_swing
        spectrum = modes @ laws.rows.T
        motions = [crank.signal((1j * w) ** order * spectrum) for order in range(3)]
        tangent = laws.forces.copy()
        for law, motion in zip(laws[2:], motions, strict=True):
            tangent += np.einsum("tij,tj->ti", law, motion)
        push = gas_forces(engine, speed, crank.angle + crank.signal(turning_swing), gas, load)
        turn, turning, swing = (motion[:, 2::3] for motion in motions)
        exact = exact_rod_forces(engine, body, speed, crank.angle, push, turn, turning, swing)
        before, added = added, np.pad(exact, ((0, 0), (0, 1))) - tangent
        if np.abs(added - before).max() <= _SETTLED * largest:
            return HeldResponse(speed, modes @ pulley - frame, modes @ flywheel - frame, turning_swing, round_)
        crank.correct(added)
    raise SolverError(f"the orders do not settle at {speed * 30.0 / math.pi:.0f} rev/min; the crank twists too far")


def steady_orders(response: HeldResponse) -> list[list[float]]:
    """Orders of the pulley's torsion and their zero-to-peak amplitudes in degrees, as a run's summary has them."""
    count = min(round(2.0 * LISTED), response.pulley.size - 1)
    amplitudes = np.degrees(np.abs(response.pulley))
    return [[float(response.orders[k]), float(amplitudes[k])] for k in range(1, count + 1)]


def frame_wobble(speed: float | Array, omega: Array) -> ComplexArray:
    """Wobble of the frame over the crank's mean rotation in space, as ``omega`` (…, k + 1); no mean."""
    inverse = speed / (2.0 * math.pi * RECENTRING_REVOLUTIONS)
    kappa = 4.0 * inverse
    result = kappa * inverse / (kappa * inverse - omega**2 + 1j * omega * kappa)
    return np.asarray(np.where(omega > 0.0, result, 0.0))


def exact_rod_forces(
    engine: Engine,
    body: ReducedBody,
    speed: float,
    angle: Array,
    push: Array,
    turn: Array,
    rate: Array,
    acceleration: Array,
) -> Array:
    """Forces (N, 3 c) along x and y and moments about z of the rods on pins that run on their circles.

    ``angle`` (N,) of the frame, ``push`` (N, c) gas forces, N; ``turn``, ``rate`` and ``acceleration`` (N, c) of the
    pins in the frame, rad, s. A moment is that of the force on the way its pin has moved, as
    :func:`cranktrain.structure.in_motion.periodic_forces.rod_forces` has it.
    """
    rod, cylinders = engine.rod, engine.cylinders
    remainder, oscillating = remainder_inertia(rod), rod.small_end_mass + cylinders.piston_mass
    out = np.zeros(16)
    forces = np.zeros((angle.size, 3 * engine.n_cylinders))
    for c in range(engine.n_cylinders):
        x0, y0 = body.positions[body.index(f"pin[{cylinders.pins[c]}]"), :2]
        down = GRAVITY * math.sin(cylinders.bank_angles[c]), GRAVITY * math.cos(cylinders.bank_angles[c])
        for k, frame in enumerate(angle):
            lead = turn[k, c]
            # The pin's place on its circle in cylinder axes, and in the frame's.
            theta = frame - cylinders.bank_angles[c]
            cos, sin = math.cos(theta + lead), math.sin(theta + lead)
            x, y = cos * x0 - sin * y0, sin * x0 + cos * y0
            w, a = speed + rate[k, c], acceleration[k, c]
            rod_force(
                x, y, -w * y, w * x, -(w**2) * x - a * y, -(w**2) * y + a * x, push[k, c], rod.length,
                rod.big_end_mass, oscillating, remainder, cylinders.pin_offset, *down, out,
            )  # fmt: skip
            cos, sin = math.cos(theta), math.sin(theta)
            f_x, f_y = cos * out[0] + sin * out[1], cos * out[1] - sin * out[0]
            moved_x = math.cos(lead) * x0 - math.sin(lead) * y0 - x0
            moved_y = math.sin(lead) * x0 + math.cos(lead) * y0 - y0
            forces[k, 3 * c : 3 * c + 3] = f_x, f_y, moved_x * f_y - moved_y * f_x
    return forces
