"""Shafts of the drive line for each order: complex stiffness about the mean torque of each speed.

Shaft s twists by ψ_s and carries the torque κ_s(ω) ψ_s with

    κ_s = k_s(T_s) (1 + iη) + iω (c_s + c_f),    or k_s(ω) + iω c_s(ω) of a shaft over frequency

T_s is the shaft's mean torque, which decides the tangent stiffness of couplings over torque. The mean torque M of the
engine enters at the flywheel and leaves at the dynamometer, or at the last disc of a line that ends freely; with the
static twists K θ = f for M = 1 the shares are T_s = M k_s ψ_s. Friction T_f against the rate of twist is replaced by
the viscous damping c_f that dissipates as much over a cycle,

    c_f = ⟨T_f ψ̇²/√(ψ̇² + ω_s²)⟩/⟨ψ̇²⟩

for the twist of all orders together, found by iteration. A run in time has the loss factor as viscous damping, and one
stiffness and damping for all frequencies, see :mod:`cranktrain.loads.torsional_line`.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import Array
from cranktrain.core.types import ComplexArray
from cranktrain.engine.drive_line_chain import DriveLineChain
from cranktrain.engine.line_elements import complex_stiffness
from cranktrain.engine.model import Engine
from cranktrain.engine.torsional_chain import Chain
from cranktrain.loads.torsional_line import DAMPING, STIFFNESS, TorsionalLine

_SETTLED, _ROUNDS = 1e-7, 200


def linear_engine(engine: Engine) -> Engine:
    """Engine whose drive line is replaced by one that is linear in twist and rate of twist."""
    line = engine.drive_line_chain
    if line is None:
        return engine
    chain = line.chain
    plain = tuple(replace(shaft, torques=(), stiffnesses=(), friction=0.0) if shaft.bends_the_line else shaft
                  for shaft in chain.shafts)  # fmt: skip
    return replace(engine, drive_line_chain=DriveLineChain.of(Chain(chain.discs, plain)))


def mean_shares(line: TorsionalLine) -> Array:
    """Mean torque of each drive-line shaft, (shafts,), over the engine's mean torque at the flywheel."""
    rows = line.twists[: len(line.shafts), :-1]
    stiffness = line.laws[: len(line.shafts), STIFFNESS]
    force = np.zeros(rows.shape[1])
    force[0] = 1.0
    if line.free and line.inertia.size:
        force[1 + line.last] = -1.0 / line.speeds[line.last]
    matrix = rows.T @ (stiffness[:, None] * rows)
    return np.asarray(stiffness * (rows @ np.linalg.lstsq(matrix, force, rcond=None)[0]))


class LineLink:
    """Shafts of a drive line at many speeds and orders.

    Attributes
    ----------
    names : (s,) of the shafts, by their ends
    shares : (s,) mean torque per mean torque of the engine
    special : (n,) indices of shafts that the linear running model does not describe at every frequency and torque
    rubbing : (m,) indices of shafts with friction
    """

    def __init__(self, line: TorsionalLine) -> None:
        self._shafts = line.shafts
        self._laws = line.laws[: len(line.shafts)]
        self.names = tuple(f"{shaft.between[0]} to {shaft.between[1]}" for shaft in line.shafts)
        self.shares = mean_shares(line)
        self.special = [k for k, shaft in enumerate(line.shafts)
                        if shaft.bends_the_line or shaft.frequencies or shaft.loss_factor > 0.0]  # fmt: skip
        self.rubbing = [k for k, shaft in enumerate(line.shafts) if shaft.friction > 0.0]

    def stiffness(self, omega: Array, torque: Array, friction: Array) -> ComplexArray:
        """Complex stiffness (s, k, shafts) N m/rad at ``omega`` (s, k) and mean torques of the engine (s,).

        ``friction`` (s, shafts) is the damping that stands for friction, N m s/rad.
        """
        columns = [
            complex_stiffness(shaft, omega, (share * torque)[:, None]) + 1j * omega * own[:, None]
            for shaft, share, own in zip(self._shafts, self.shares, friction.T, strict=True)
        ]
        return np.stack(columns, axis=-1)

    def excess(self, omega: Array, torque: Array, friction: Array) -> ComplexArray:
        """Part of the complex stiffness (s, k, n) of n special shafts that the running model's force law lacks."""
        whole = self.stiffness(omega, torque, friction)[..., self.special]
        laws = self._laws[self.special]
        return np.asarray(whole - laws[:, STIFFNESS] - 1j * omega[..., None] * laws[:, DAMPING])

    def settled_friction(
        self, twists: Callable[[Array], ComplexArray], omega: Array, signal: Callable[[ComplexArray], Array], count: int
    ) -> Array:
        """Equivalent damping (s, shafts) of friction, for a function ``twists(damping)`` that returns (s, k, shafts).

        ``signal`` turns spectra (s, k) into samples (s, N). Raises ``SolverError``: friction whose damping does not
        settle.
        """
        found = np.zeros((count, len(self._shafts)))
        if not self.rubbing:
            return found
        for k in self.rubbing:
            # The iteration starts at the largest equivalent damping of friction, which falls as the shaft slips.
            found[:, k] = self._shafts[k].friction / self._shafts[k].slip_speed
        for _ in range(_ROUNDS):
            before, spectra = found.copy(), twists(found)
            for k in self.rubbing:
                shaft = self._shafts[k]
                rate = signal(1j * omega * spectra[..., k])
                square = np.maximum((rate**2).mean(axis=1), np.finfo(float).tiny)
                power = shaft.friction * rate**2 / np.sqrt(rate**2 + shaft.slip_speed**2)
                found[:, k] = np.sqrt(before[:, k] * power.mean(axis=1) / square)
            if np.all(np.abs(found - before) <= _SETTLED * np.abs(found)):
                return found
        raise SolverError("friction of the drive line does not settle; give more slip_speed, or run it in time")
