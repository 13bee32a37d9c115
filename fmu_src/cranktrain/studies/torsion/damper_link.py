"""Torsional damper for each order: complex stiffness between hub and ring, and residual torque of a nonlinear law.

Let g be the motion of hub against ring per torque between them, and ψ₀ the motion due to all other causes. With a link
of complex stiffness κ(ω) the twist is

    ψ = (ψ₀ − g e)/(1 + κ g),   torque on the hub −(κ ψ + e).

κ is what the law has at ω itself: iωη of a newtonian fluid, G*(ω) of a complex modulus, k (1 + id) of rubber; a run in
time has one pair of spring and damper for all orders. A shear-thinning fluid is replaced by the linear damper with the
same dissipation over the cycle; e is the residual torque of the law.
"""

from copy import copy

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import SolverError
from cranktrain.core.types import Array, ComplexArray
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import COMPLEX_MODULUS, SHEAR_THINNING
from cranktrain.loads.damper import (
    EXPONENT,
    PARAMETERS,
    SHEARS,
    TIME,
    WEIGHTS,
    check_temperature,
    complex_modulus,
    damper_at,
    damper_constants,
    damper_temperature,
    damping_coefficient,
    linear_stiffness,
    required_damper,
    shear_layers,
)
from cranktrain.studies.torsion.shaft_orders import ShaftOrders

_SETTLED, _ROUNDS = 1e-8, 100


class DamperLink:
    """Damper of an engine at speeds (s,), for angular frequencies (s, k).

    Attributes
    ----------
    stiffness : (s, k) complex stiffness, N m/rad
    thinning : whether the law is not linear
    """

    def __init__(self, engine: Engine, settings: Settings, speeds: Array, omega: Array) -> None:
        damper = required_damper(engine)
        self.omega = omega
        warm = [settings.damper_temperature or damper_temperature(damper, speed) for speed in speeds.tolist()]
        self.parameters = np.zeros((len(warm), PARAMETERS))
        constants = damper_constants(damper)
        for row, temperature in zip(self.parameters, warm, strict=True):
            check_temperature(damper, temperature)
            damper_at(constants, temperature, row)
        self.thinning = damper.kind == "viscous" and damper.law == SHEAR_THINNING
        viscous = np.array([damping_coefficient(row) for row in self.parameters])
        self.stiffness: ComplexArray = 1j * omega * viscous[:, None]
        if damper.kind == "rubber":
            self.stiffness = np.where(omega > 0.0, damper.stiffness * (1.0 + 1j * damper.loss_factor), 0.0)
        elif damper.kind == "linear":
            self.stiffness = np.where(omega > 0.0, linear_stiffness(damper, omega), 0.0)
        elif damper.law == COMPLEX_MODULUS:
            moments = shear_layers(damper)[0].sum()
            self.stiffness = np.array([
                [moments * complex_modulus(damper, temperature, w) if w > 0.0 else 0.0 for w in row.tolist()]
                for temperature, row in zip(warm, omega, strict=True)
            ])  # fmt: skip

    def at(self, which: NDArray[np.bool_]) -> "DamperLink":
        """Damper at those speeds for which ``which`` (s,) is true."""
        some = copy(self)
        some.omega, some.parameters, some.stiffness = self.omega[which], self.parameters[which], self.stiffness[which]
        return some

    def torque(self, rate: Array) -> Array:
        """Torque of a shear-thinning fluid at rates (s, N) rad/s of hub relative to ring, N m."""
        torque = np.zeros_like(rate)
        time, exponent = self.parameters[:, TIME, None], self.parameters[:, EXPONENT, None]
        for weight, shear in zip(self.parameters[:, WEIGHTS:SHEARS].T, self.parameters[:, SHEARS:].T, strict=True):
            torque += weight[:, None] * rate * (1.0 + (time * shear[:, None] * rate) ** 2) ** exponent
        return torque

    def rest(self, twist: ComplexArray, stiffness: ComplexArray, samples: ShaftOrders) -> ComplexArray:
        """Torque of the nonlinear damper minus that of the linear ``stiffness`` at ``twist``, (s, k) N m.

        A ring carries no mean torque: it slips against the hub until there is none.
        """
        rate = samples.signal(1j * self.omega * twist, 1)
        damping = stiffness[:, 1].imag / self.omega[:, 1]
        for _ in range(_ROUNDS):
            torque = self.torque(rate)
            mean = torque.mean(axis=1)
            if np.all(np.abs(mean) <= _SETTLED * np.abs(torque).max(axis=1)):
                break
            rate = rate - (mean / damping)[:, None]
        result = samples.spectrum(torque, 1) - stiffness * twist
        result[:, 0] = 0.0
        return result


def equivalent(link: DamperLink, free: ComplexArray, compliance: ComplexArray, samples: ShaftOrders) -> ComplexArray:
    """Complex stiffness (s, k) of a damper in series with ``compliance`` (s, k); ``free`` is its twist without torque.

    A nonlinear law is replaced by equivalent linear dampers; ``samples`` converts complex amplitudes to samples. Raises
    ``SolverError``: a damper that does not settle.
    """
    stiffness = link.stiffness
    if not link.thinning:
        return stiffness
    for _ in range(_ROUNDS):
        # Linear dampers that dissipate like the nonlinear damper at this twist.
        rate = samples.signal(1j * link.omega * (free / (1.0 + stiffness * compliance)), 1)
        damping = np.mean(link.torque(rate) * rate, axis=1) / np.mean(rate**2, axis=1)
        before, stiffness = stiffness, np.asarray(1j * link.omega * damping[:, None])
        if np.all(np.abs(stiffness - before) <= _SETTLED * np.abs(before)):
            return stiffness
    raise SolverError("the damper's torque does not settle; its law is too far from a linear one")
