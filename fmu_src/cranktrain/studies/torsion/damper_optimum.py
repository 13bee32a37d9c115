"""Optimum damping of a viscous torsional damper, by Houdaille's closed form and by search on a real crank.

Two masses: a hub I₁ on a spring to ground carries a ring I₂ = μ I₁ by a viscous coupling c alone; a harmonic torque
acts on the hub. All curves of its amplitude over frequency pass one fixed point; the least possible peak lies there:

    ζ = c/(2 I₁ ω₁) = μ/√(2(1+μ)(2+μ)),   amplification 1 + 2/μ,   frequency √(2/(2+μ)) ω₁

A crank: its modes ω_j move the hub by h_j each and have damping ratios ζ_j of their own. Mode N alone is excited, by a
torque spread like its inertia forces, T/h at the hub, so that without damper the hub answers as one mass I = 1/h_N² on
a spring I ω_N². The ring pulls at the hub with the dynamic stiffness D = −ω²J iωc/(iωc − ω²J) and meets the receptance
R of all modes there:

    θ/θ_static = ω_N²/z_N / (1 + R D),   R = Σ_j h_j²/z_j,   z_j = ω_j² − ω² + 2i ζ_j ω_j ω

The damping that makes the largest of it least is searched. Ratios are formed with I and ω_N: for one undamped mode
these are Houdaille's. An engine's modes have the damping of its structure, the bearings' left out: without it the faint
motion of a bending mode close by would rule the search.

Sources: J. P. Den Hartog, Mechanical Vibrations (1956), section 3.3; W. Ker Wilson, Practical Solution of Torsional
Vibration Problems, vol. 4 (1968).
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.dynamics.model.arrays import structural_damping
from cranktrain.engine.model import Engine
from cranktrain.loads.damper import required_damper
from cranktrain.studies.torsion.housed_crank import housed_crank

# Range of the peak's search: multiples of the frequency with locked ring and with free ring; number of points.
_BELOW, _ABOVE, _POINTS = 0.8, 1.1, 400
# Range of damping ratios searched for the optimum; the closed form gives 0.05 to 0.7 for inertia ratios 0.1 to 100.
_DAMPING_RATIOS = (1e-3, 5.0)
_LEAST_RATIO = 1e-3


class Optimum(NamedTuple):
    """Optimum of a damper on one mode: ζ = c/(2 I ω_N), peak over static amplitude, frequency of the peak over ω_N."""

    damping_ratio: float
    amplification: float
    frequency_ratio: float


class HubModes(NamedTuple):
    """Modes of a structure without the ring.

    ``omega`` (n,) rad/s, ``hub`` (n,) rotation of the hub in modes of unit modal mass, ``ratios`` (n,) damping ratios.
    """

    omega: Array
    hub: Array
    ratios: Array


class CrankOptimum(NamedTuple):
    """Optimum for one torsional mode of a cranktrain (SI); ``hz`` and ``inertia`` are the mode's, without the ring."""

    optimum: Optimum
    damping: float
    hz: float
    inertia: float
    inertia_ratio: float


def houdaille_optimum(inertia_ratio: float) -> Optimum:
    """Houdaille's optimum for two masses; ``inertia_ratio`` is ring over hub. ``InputError`` unless it is positive."""
    if not _LEAST_RATIO <= inertia_ratio <= 1e3:
        raise InputError(
            f"inertia ratio {inertia_ratio:g} (ring over hub) is not within {_LEAST_RATIO:g} to 1000; dampers have 0.1 "
            "to 3"
        )
    mu = float(inertia_ratio)
    return Optimum(mu / math.sqrt(2.0 * (1.0 + mu) * (2.0 + mu)), 1.0 + 2.0 / mu, math.sqrt(2.0 / (2.0 + mu)))


def two_mass_modes() -> HubModes:
    """Hub of unit inertia on a unit spring, as input of :func:`optimal_damping` for Houdaille's two masses."""
    return HubModes(np.ones(1), np.ones(1), np.zeros(1))


def amplification(modes: HubModes, mode: int, ring_inertia: float, damping: float, omega: Array) -> Array:
    """Amplitude of the hub over its deflection by a static torque, (k,), at ``omega`` (k,) rad/s.

    ``mode`` is the index of the excited mode, ``ring_inertia`` in kg m², ``damping`` in N m s/rad.
    """
    swings = modes.omega**2 - omega[:, None] ** 2 + 2j * modes.ratios * modes.omega * omega[:, None]
    own, others = swings[:, mode], np.arange(modes.omega.size) != mode
    rest = (modes.hub[others] ** 2 / swings[:, others]).sum(axis=1)
    ring = -(omega**2) * ring_inertia * 1j * damping / (1j * damping - omega * ring_inertia)
    # Numerator and denominator are multiplied by z_N, which avoids a division by 0 at an undamped mode.
    return np.asarray(modes.omega[mode] ** 2 / np.abs(own * (1.0 + rest * ring) + modes.hub[mode] ** 2 * ring))


def peak(modes: HubModes, mode: int, ring_inertia: float, damping: float) -> tuple[float, float]:
    """Largest amplification around a mode and its angular frequency, rad/s."""
    own = float(modes.omega[mode])
    locked = own / math.sqrt(1.0 + ring_inertia * float(modes.hub[mode]) ** 2)
    grid = np.geomspace(_BELOW * locked, _ABOVE * own, _POINTS)
    values = amplification(modes, mode, ring_inertia, damping, grid)
    top = int(np.clip(values.argmax(), 1, _POINTS - 2))

    def lower(omega: float) -> float:
        return -float(amplification(modes, mode, ring_inertia, damping, np.array([omega]))[0])

    around, options = (grid[top - 1], grid[top + 1]), {"xatol": 1e-9 * own}
    found = minimize_scalar(lower, bounds=around, method="bounded", options=options)
    return -float(found.fun), float(found.x)


def optimal_damping(modes: HubModes, mode: int, ring_inertia: float) -> tuple[Optimum, float]:
    """Optimum damping of a mode by search: the optimum, and the damping in N m s/rad.

    Raises ``InputError``: a mode that does not move the hub, or no optimum within damping ratios of 0.001 to 5.

    Parameters
    ----------
    modes : of the structure without the ring
    mode : index of the mode that is to be damped
    ring_inertia : kg m²
    """
    own, at_hub = float(modes.omega[mode]), float(modes.hub[mode])
    if ring_inertia * at_hub**2 < _LEAST_RATIO:
        raise InputError(
            f"the mode of {own / (2.0 * math.pi):.1f} Hz hardly turns the hub: a ring of {ring_inertia:.3g} kg m^2 is "
            f"negligible beside {1.0 / at_hub**2:.3g} kg m^2; damp another mode"
        )
    critical = 2.0 * own / at_hub**2
    low, high = (math.log(ratio) for ratio in _DAMPING_RATIOS)

    def largest(log_ratio: float) -> float:
        return math.log(peak(modes, mode, ring_inertia, critical * math.exp(log_ratio))[0])

    # A coarse search comes first, because the largest amplification may have several minima over damping.
    coarse = np.linspace(low, high, 35)
    at = int(np.argmin([largest(x) for x in coarse]))
    if at in (0, coarse.size - 1):
        raise InputError("damper: no damping minimises the peak of this mode, because the ring hardly acts on it")
    found = minimize_scalar(largest, bounds=(coarse[at - 1], coarse[at + 1]), method="bounded", options={"xatol": 1e-9})
    damping = critical * math.exp(float(found.x))
    height, omega = peak(modes, mode, ring_inertia, damping)
    return Optimum(damping / critical, height, omega / own), damping


def crank_optimum(engine: Engine, body: ReducedBody, number: int = 1) -> CrankOptimum:
    """Optimum of the engine's damper for the first or second torsional mode of its cranktrain (``number`` 1 or 2).

    The cranktrain is that of :mod:`cranktrain.studies.torsion.housed_crank`; ``body`` is the bare reduced crankshaft.
    Raises ``InputError``: no damper, no such mode, or a damper that does nothing for it.
    """
    damper, crank = required_damper(engine), housed_crank(engine, body)
    if not 1 <= number <= len(crank.torsional):
        raise InputError(f"torsional mode {number} cannot be told from other modes; give 1 or 2")
    rates = structural_damping(engine, crank.crankshaft) @ crank.shapes**2
    ratios = 0.5 * rates / np.where(crank.omega > 0.0, crank.omega, 1.0)
    modes, mode = HubModes(crank.omega, crank.hub @ crank.shapes, ratios), crank.torsional[number - 1]
    optimum, damping = optimal_damping(modes, mode, damper.ring_inertia)
    inertia = 1.0 / float(modes.hub[mode]) ** 2
    hz = float(modes.omega[mode]) / (2.0 * math.pi)
    return CrankOptimum(optimum, damping, hz, inertia, damper.ring_inertia / inertia)
