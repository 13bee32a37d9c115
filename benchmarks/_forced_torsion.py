"""Steady torsional vibration in the frequency domain, with and without damper: the counterpart of a run in time.

The cranktrain is :class:`cranktrain.studies.torsion.periodic_crank.PeriodicCrank`, bearings at level ``linear``; no
step, no integrator. With J the ring's inertia and link = k + iωc, the ring's twist against a hub that turns by θ is

    ψ = (−ω²J θ − e)/(link − ω²J),   torque on the hub −(link ψ + e)

If the law's torque is not linear in the rate, c is the linear damper with the same dissipation over the cycle, the mean
of T ψ̇ over the mean of ψ̇², and e is the residual torque of the law. Both are found by iteration, so that all orders
of the torque balance. This is harmonic balance; equivalent linearisation is its first iteration. A ring transmits no
mean torque. With a nonlinear law it slips slowly on average against the hub.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.loads.damper import (
    STIFFNESS,
    damper_torque,
    damping_coefficient,
)
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.studies.torsion.periodic_crank import PeriodicCrank

ComplexArray = NDArray[np.complex128]

HIGHEST_ORDER = 24.0
# The law's torque is found to this share of its largest value, or after so many rounds not at all.
_SETTLED, _ROUNDS = 1e-8, 100


class OrderStructure(Protocol):
    """A structure whose response is computed for each order, see :class:`PeriodicCrank`."""

    omega: Array
    samples: int

    def response(self, row: Array, added: ComplexArray, torque: ComplexArray) -> ComplexArray:
        """Complex amplitudes of a motion, see :meth:`PeriodicCrank.response`."""

    def spectrum(self, signal: Array) -> ComplexArray:
        """Complex amplitudes of samples."""

    def signal(self, spectrum: ComplexArray) -> Array:
        """Samples of complex amplitudes."""


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
    crank = PeriodicCrank(engine, body, speed, gas or GasTrace.from_engine(engine), load, highest)
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

    ``structure`` has ``omega``, ``samples`` and ``response`` as :class:`PeriodicCrank`; ``speed`` is passed on.
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
