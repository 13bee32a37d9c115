"""Forces that excite a rigid engine: free forces and moments of its masses, and the reaction to the crank's torque.

Masses press on the engine as :mod:`cranktrain.results.free_forces` states. About the crank's axis the engine carries

    M = −T − dL/dt,    T = Σ −J' Ω²/2 − J Ω̇ − h p A,    L = Ω Σ [m_b (K × dK/dθ)_z + m_o e h + ΔJ b]

with the torque T of rods and gas on the crank and the angular momentum L of rods and pistons; symbols are those of
:mod:`cranktrain.studies.torsion.rod_torque`. The mean of M is minus the engine's torque, which its load takes from
outside the mounts. Amplitudes a of order k are those of Re[a exp(ikθ)].
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.types import Array
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.articulated_rod import rod_end
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace, gas_tables
from cranktrain.loads.mean_load import full_share
from cranktrain.loads.slider_crank import remainder_inertia
from cranktrain.results.free_forces import HIGHEST_ORDER, mass_forces
from cranktrain.structure.crank.torsional import rigid_crank
from cranktrain.studies.torsion.rod_torque import Rods, gas_push
from cranktrain_lab.mounts.stiffness import Complex

SAMPLES = 2880
"""Crank angles of a cycle of 720 degrees at which torques are evaluated."""
ORDERS: Array = 0.5 * np.arange(2 * HIGHEST_ORDER + 1, dtype=np.float64)
"""Orders of a cycle, from 0 to the highest."""


class Excitation(NamedTuple):
    """Amplitudes by order of forces (N) and moments (N m) on the engine's centre, each (orders, 6).

    Attributes
    ----------
    masses, rate : over the square of the crank's speed (rad/s), and over its acceleration
    motored, burnt : of the gas without burn, and of the full-load burn's rise of pressure
    gas : trace that gives the burn over the speed
    """

    masses: Complex
    rate: Complex
    motored: Complex
    burnt: Complex
    gas: GasTrace

    def at(self, speed: float, load: float, acceleration: float = 0.0) -> Complex:
        """Amplitudes (orders, 6) at a speed (rad/s), a fraction of the full-load burn and an acceleration, rad/s²."""
        burn = load * full_share(self.gas, speed)
        return np.asarray(self.masses * speed**2 + self.rate * acceleration + self.motored + burn * self.burnt)


def excitation(engine: Engine, centre: Array) -> tuple[Excitation, list[str]]:
    """Excitation of an engine with its centre of mass (3,), m, and the names of added bodies that are left out."""
    moments, left_out = mass_forces(engine, float(centre[2]))[::2]
    masses = np.zeros((ORDERS.size, 6), dtype=np.complex128)
    masses[::2, :2] = moments[:, 0]
    masses[::2, 3], masses[::2, 4] = -moments[:, 1, 1], moments[:, 1, 0]
    rate = np.zeros_like(masses)
    rate[2:] = -1j * masses[2:] / ORDERS[2:, None]
    gas = GasTrace.from_engine(engine)
    square, linear, motored, burnt = _torques(engine, gas)
    masses[:, 5] = square + centre[1] * masses[:, 0] - centre[0] * masses[:, 1]
    rate[:, 5] = linear + centre[1] * rate[:, 0] - centre[0] * rate[:, 1]
    pushes = np.zeros((2, ORDERS.size, 6), dtype=np.complex128)
    pushes[:, :, 5] = motored, burnt
    return Excitation(masses, rate, pushes[0], pushes[1], gas), left_out


def _torques(engine: Engine, gas: GasTrace) -> list[Complex]:
    """Orders of the moment about the crank's axis: over Ω², over Ω̇, motored and of the full burn."""
    angle: Array = np.arange(SAMPLES, dtype=np.float64) * (4.0 * math.pi / SAMPLES)
    every = np.repeat(angle[:, None], engine.n_cylinders, axis=1)
    found = Rods.of_engine(engine, rigid_crank(engine), 0.0).torque(every)
    area = 0.25 * math.pi * engine.cylinders.bore**2
    motored, burnt = gas_push(gas_tables(gas), area, every - np.array(engine.firing_angles))
    momentum = np.zeros(SAMPLES)
    for c, rod in enumerate(engine.rods):
        end, offset = rod_end(engine, c, angle), engine.offsets[c]
        swing = end.vx / np.sqrt(rod.length**2 - (end.x - offset) ** 2)
        pistons = rod.small_end_mass + engine.cylinders.piston_mass
        momentum += rod.big_end_mass * (end.x * end.vy - end.y * end.vx)
        momentum += pistons * offset * found.arm[:, c] + remainder_inertia(rod) * swing
    orders = 0.5 * np.arange(SAMPLES // 2 + 1)
    change = np.fft.irfft(1j * orders * np.fft.rfft(momentum), SAMPLES)
    signals = (
        0.5 * found.slope.sum(axis=1) - change,
        found.inertia.sum(axis=1) - momentum,
        (found.arm * (motored - Settings().crankcase_pressure * area)).sum(axis=1),
        (found.arm * burnt).sum(axis=1),
    )
    spectra = [2.0 / SAMPLES * np.fft.rfft(one)[: ORDERS.size] for one in signals]
    for one in spectra:
        one[0] *= 0.5
    return spectra
