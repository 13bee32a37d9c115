"""Fatigue of fillets: cycles counted by rainflow, their mean stress by Haigh's diagram, notch support and surface.

A stress history is reduced to its part along the longest range in von Mises' norm, a scalar that is σ for tension and
√3 τ for torsion. Rainflow counting gives the cycles of this repeating history (ASTM E1049). Loads out of phase, whose
stress changes direction, are treated in :mod:`critical_plane`. The endurable amplitude of a cycle of mean σ_m is σ_WK
K(σ_m/σ_a). With the mean stress sensitivity M, K is 1/(1 − M) for pure compression, 1/(1 + M σ_m/σ_a) up to the stress
ratio 0, falls a third as steeply up to 0.5, and is constant beyond. The fully reversed strength at a surface is

    σ_WK = f_W R_m n K_V / (1 + (1/K_R − 1)/K_f),

a fraction of the tensile strength R_m, increased by the notch's stress gradient (n, Siebel and Stieler) and by
treatment (K_V), reduced by roughness (K_R). The safety factor is the endurable over the actual amplitude at the same
stress ratio.

Source: FKM guideline, Analytical strength assessment, 6th edition (2012), for local stress in steel and cast steel.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import rainflow

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.engine.limits import CrankStrength


class FatigueClass(NamedTuple):
    """Constants of a group of materials with the guideline's symbols; stresses in MPa."""

    f_w: float
    a_m: float
    b_m: float
    a_g: float
    b_g: float
    a_r: float
    r_m_min: float


_FORGED = FatigueClass(0.40, 0.35, -0.10, 0.50, 2700.0, 0.22, 400.0)
CLASSES = {
    "grain-flow": _FORGED,
    "free-form": _FORGED,
    "cast-rolled": FatigueClass(0.34, 0.35, 0.05, 0.25, 2000.0, 0.20, 400.0),
}
"""Material group (forged or cast steel) of each forming process of a crankshaft."""
SMOOTH_NOTCH = 2.0
"""Notch factor K_f in the guideline's roughness term, for steel and cast steel."""
REVERSED_SHEAR = 1.0 / math.sqrt(3.0)
"""Fully reversed strength in shear over that in tension, for ductile steel."""
_SHEAR_GOVERNS = 0.5
LEAST_SHARE = 1.0e-3
"""Fraction of the largest stress cycle below which smaller cycles are ignored."""


@dataclass(frozen=True, eq=False)
class FilletHistory:
    """Stress at one place over a repeating cycle.

    Attributes
    ----------
    name : name of the place, such as ``web[1].pin``
    angles : (n,) crank angle, rad
    tensor : (n, 6) stress components xx, yy, zz, xy, yz, zx, Pa
    gradient : relative gradient of the stress into the material, 1/m
    converged : true if the stress is reliable
    """

    name: str
    angles: Array
    tensor: Array
    gradient: float
    converged: bool = True


class StressCycle(NamedTuple):
    """Amplitude and mean of a closed stress cycle, Pa."""

    amplitude: float
    mean: float


class Judgement(NamedTuple):
    """Safety factor of one place, its governing cycle, Pa, and the endurable amplitude of this cycle, Pa."""

    name: str
    safety_factor: float
    amplitude: float
    mean: float
    endured: float
    converged: bool


def governing_history(tensor: Array) -> Array:
    """Scalar history (n,), Pa, of stresses (n, 6): their part along the direction of largest range in von Mises' norm.

    The sign is positive in tension. If shear governs (first invariant below half of the norm), mean stress is treated
    as tension.
    """
    xx, yy, zz, xy, yz, zx = np.asarray(tensor, dtype=float).T
    root = math.sqrt(3.0)
    # Five deviatoric components whose sum of squares is the square of von Mises' stress.
    parts = np.stack([xx - 0.5 * (yy + zz), 0.5 * root * (yy - zz), root * xy, root * yz, root * zx], axis=1)
    squares = (parts**2).sum(axis=1)
    ranges = squares[:, None] + squares - 2.0 * parts @ parts.T
    i, j = np.unravel_index(int(ranges.argmax()), ranges.shape)
    chord, length = parts[i] - parts[j], math.sqrt(max(float(ranges[i, j]), 0.0))
    if length == 0.0:
        return np.zeros(len(parts))
    history = parts @ chord / length
    trace = float((tensor[i, :3] - tensor[j, :3]).sum()) / length
    pulls = trace if abs(trace) >= _SHEAR_GOVERNS else float(history.max() + history.min())
    return np.asarray(history if pulls >= 0.0 else -history)


def counted_cycles(history: Array) -> list[StressCycle]:
    """Closed stress cycles, by rainflow, of a repeating history (n,) without its end point; largest first.

    The history is counted from its greatest value, so all cycles are closed.
    """
    values = np.asarray(history, dtype=float)
    if values.ndim != 1 or values.size < 2 or not np.all(np.isfinite(values)):
        raise InputError("rainflow: a history of at least two finite values is wanted")
    first = int(values.argmax())
    closed = np.concatenate([values[first:], values[: first + 1]])
    cycles = {(size, mean) for size, mean, *_ in rainflow.extract_cycles(closed.tolist()) if size > 0.0}
    return [StressCycle(0.5 * size, mean) for size, mean in sorted(cycles, reverse=True)]


def mean_stress_factor(ratio: float, sensitivity: float) -> float:
    """Factor K, the endurable amplitude over that at σ_m = 0, for ``ratio`` = σ_m/σ_a and mean stress sensitivity M."""
    m = sensitivity
    if ratio <= -1.0:
        return 1.0 / (1.0 - m)
    if ratio <= 1.0:
        return 1.0 / (1.0 + m * ratio)
    shallow = (1.0 + m / 3.0) / (1.0 + m)
    return shallow / (1.0 + m / 3.0 * min(ratio, 3.0))


def mean_stress_sensitivity(strength: CrankStrength) -> float:
    """Mean stress sensitivity M = a_M R_m/GPa + b_M."""
    group = CLASSES[strength.forming]
    return group.a_m * 1e-9 * strength.tensile_strength + group.b_m


def support_factor(strength: CrankStrength, gradient: float) -> float:
    """Notch support factor n for a relative stress gradient, 1/m (Siebel and Stieler); constant above 100 per mm."""
    group, g = CLASSES[strength.forming], min(1e-3 * gradient, 100.0)
    exponent = group.a_g + 1e-6 * strength.tensile_strength / group.b_g
    if g <= 0.1:
        return 1.0 + g * 10.0 ** (0.5 - exponent)
    return 1.0 + (math.sqrt(g) if g <= 1.0 else g**0.25) * 10.0**-exponent


def roughness_factor(strength: CrankStrength) -> float:
    """Roughness factor K_R, strength of a surface of roughness Rz over that of a polished one; at most 1."""
    group = CLASSES[strength.forming]
    depth, tensile = 1e6 * strength.roughness, 1e-6 * strength.tensile_strength
    return min(1.0 - group.a_r * math.log10(depth) * math.log10(2.0 * tensile / group.r_m_min), 1.0)


def surface_strength(strength: CrankStrength, gradient: float) -> float:
    """Fully reversed local strength of a surface, Pa, f_W R_m n K_V / (1 + (1/K_R − 1)/K_f)."""
    rough = 1.0 + (1.0 / roughness_factor(strength) - 1.0) / SMOOTH_NOTCH
    gain = support_factor(strength, gradient) * strength.fillet_treatment / rough
    return CLASSES[strength.forming].f_w * strength.tensile_strength * gain


def haigh_judgement(history: FilletHistory, strength: CrankStrength) -> Judgement:
    """Safety factor of a place by its governing cycle in Haigh's diagram."""
    reversed_strength = surface_strength(strength, history.gradient)
    sensitivity = mean_stress_sensitivity(strength)
    worst = Judgement(history.name, math.inf, 0.0, 0.0, reversed_strength, history.converged)
    cycles = counted_cycles(governing_history(history.tensor))
    for amplitude, mean in cycles:
        if amplitude < LEAST_SHARE * cycles[0].amplitude:
            continue
        endured = reversed_strength * mean_stress_factor(mean / amplitude, sensitivity)
        if endured / amplitude < worst.safety_factor:
            worst = worst._replace(safety_factor=endured / amplitude, amplitude=amplitude, mean=mean, endured=endured)
    return worst
