"""Dead centre and zero of a measured pressure, by the first law of thermodynamics during compression.

    dp/dθ = [−γ p dV/dθ − (γ − 1) Q̇/ω] / V,    Q̇ = C α A (T − T_w),    T = T₀ p V / (p₀ V₀)

γ(T) is that of air, by the polynomials of :mod:`cranktrain.modules.combustion.gas`, and α Woschni's coefficient
without its combustion term. The measured trace is p − z at θ + δ. A least-squares fit finds the shift δ, the zero z,
p₀, T₀, the heat factor C, and changes of the heat capacity and of its rise with temperature (mixture, residual gas,
another formula). T₀, C and the heat capacity have priors with usual values and scatter, because a noisy trace does not
determine them. The standard errors of δ and z include this.

The fit uses both flanks of a motored trace, whose peak lies before dead centre by the thermodynamic loss angle, which
the heat determines. Of a fired trace it uses the compression until heat is released. δ is less certain then, because
shift, zero and change of the exponent have similar effects on one flank. A diesel engine at light load has nearly
symmetric flanks too. It is recognised because both flanks together fit no usual gas, while the compression alone fits
the engine and heat is released after it.
"""

import math
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.modules.combustion.gas import AIR, HIGHEST, MIDDLE, POLYNOMIALS
from cranktrain_lab.measured.cylinder import Cylinder

FIRST_DEG, FIRST_OF_TWO_STROKES_DEG, LAST_DEG = -115.0, -90.0, 75.0
"""Range of a motored fit, degrees after firing dead centre, in which valves or ports are closed."""
BEFORE_BURN_DEG = 6.0
"""Distance of a fired fit's end from the start of the heat release."""
MOTORED_SYMMETRY = 1.06
HALF_WAY, NEAR = math.radians(50.0), math.radians(8.0)
"""Angles of the test for a motored trace: largest distance ``NEAR`` of the peak from dead centre, and distance
``HALF_WAY`` from the peak at which flanks are compared. Their ratio must be below ``MOTORED_SYMMETRY``, pressures
counted from the pressure 110 degrees before the peak."""
BURNED = 0.02
"""Ratio of heat to peak pressure times clearance volume above which a trace with symmetric flanks counts as fired."""
HEAT, TEMPERATURE = (0.3, 0.4), (65.0, 20.0)
"""Priors (value, scatter) of ln C, and of T₀ minus intake temperature (K). Hohenberg's and Annand's heat of a motored
engine are 1.3 and 1.9 times Woschni's.
"""
CAPACITY, UNSURE = {True: 0.02, False: 0.005}, 0.02
"""Prior scatter of the relative change of heat capacity, and of its rise in 1000 K, from air: for motored (True) and
fired (False) traces. ``UNSURE`` is the wider scatter for standard errors, because formulas of gas and heat differ.
"""
UNUSUAL, IMPOSSIBLE = 4.0, 25.0
"""Deviations of a fit's values from their priors, in standard deviations, that give a remark and an error. A
compression ratio of 16.4 instead of 17 gives a remark.
"""
BAND = 1.96
"""Half width of a 95 % confidence interval in standard errors."""
MIDWAY = 0.5
"""Temperature (in 1000 K) about which the heat capacity's slope over temperature is varied."""
TIGHT = 1.0e-12
"""Tolerances of the fit, small enough that files read in one or several pieces give the same parameters."""
MODEL_ERROR = 1.0e-3
"""Relative error of the compression model's pressure. Model error and noise give the weights of points."""
_AIR = tuple(
    tuple(sum(share * POLYNOMIALS[name][k][i] for name, share in AIR.items()) for i in range(5)) for k in (0, 1)
)
"""Polynomial coefficients of c_p/R of air in T, below and above ``MIDDLE``."""


class Compression(NamedTuple):
    """Result of a compression fit.

    Attributes
    ----------
    shift : true crank angle minus that of the trace, rad
    zero : pressure to add to the trace, Pa
    exponent : mean polytropic exponent of the fitted range's compression
    loss : angle of a motored trace's peak before dead centre, rad; NaN for a fired trace
    heat : factor of the heat to the walls
    shift_error, zero_error : standard errors of shift and zero
    motored : True if both flanks were used
    range : fitted angles, rad
    residual : RMS residual, Pa
    doubt : remark if the fit needs unusual heat, temperature or heat capacity, else empty
    """

    shift: float
    zero: float
    exponent: float
    loss: float
    heat: float
    shift_error: float
    zero_error: float
    motored: bool
    range: tuple[float, float]
    residual: float
    doubt: str = ""

    @property
    def shift_interval(self) -> tuple[float, float]:
        """95 % confidence interval of the dead centre's shift, rad."""
        return self.shift - BAND * self.shift_error, self.shift + BAND * self.shift_error


def fit_compression(
    angle: Array,
    pressure: Array,
    cylinder: Cylinder,
    speed: float,
    *,
    intake_temperature: float = 310.0,
    wall_temperature: float = 430.0,
    noise: float = 0.0,
) -> Compression:
    """Fit dead centre and zero of a mean cycle; ``InputError`` without visible compression or for another engine.

    Parameters
    ----------
    angle : (n,) rad after the assumed firing dead centre, −2π to 2π, increasing
    pressure : (n,) Pa, with unknown zero
    speed : speed, rad/s
    noise : standard deviation of a value of ``pressure``, Pa
    """
    fitted = partial(_fitted, angle, pressure, cylinder, speed, (intake_temperature, wall_temperature), noise)
    # Symmetric flanks about a peak near 0 mean that there is no combustion.
    wide = max(3, round(math.radians(4.0) / float(angle[1] - angle[0])) | 1)
    smooth = np.convolve(np.pad(pressure, wide // 2, mode="edge"), np.ones(wide) / wide, mode="valid")
    peak = float(angle[np.argmax(smooth)])
    low, before, after = np.interp([peak - math.radians(110.0), peak - HALF_WAY, peak + HALF_WAY], angle, smooth)
    if not (abs(peak) < NEAR and after - low < MOTORED_SYMMETRY * (before - low)):
        return fitted(motored=False)
    motored, refusal = None, InputError("")
    try:
        motored = fitted(motored=True)
        if not motored.doubt:
            return motored
    except InputError as error:
        refusal = error
    # At light load so little burns that the flanks are nearly symmetric. A fit of the compression alone then shows the
    # heat that is released afterwards.
    try:
        fired = fitted(motored=False)
    except InputError:
        fired = None
    if fired is not None and not fired.doubt and _burned(angle + fired.shift, pressure + fired.zero, cylinder) > BURNED:
        return fired
    if motored is None:
        raise refusal
    return motored


def _burned(theta: Array, p: Array, cylinder: Cylinder) -> float:
    """Return heat from 30° before to 60° after dead centre over peak pressure times clearance volume, with γ = 1.35."""
    inside = (theta > math.radians(-30.0)) & (theta < math.radians(60.0))
    p, volume = p[inside], cylinder.volume(theta[inside])[0]
    work = float(np.sum(0.5 * (p[1:] + p[:-1]) * np.diff(volume)))
    return ((p[-1] * volume[-1] - p[0] * volume[0]) / 0.35 + work) / float(p.max() * volume.min())


def _fitted(
    angle: Array, pressure: Array, cylinder: Cylinder, speed: float, temperatures: tuple[float, float], noise: float,
    motored: bool,
) -> Compression:  # fmt: skip
    """Fit the compression, or both flanks if ``motored``; ``temperatures`` of intake and wall; ``InputError``."""
    from scipy.optimize import least_squares

    warm, wall = temperatures
    inside = _compressed(angle, pressure, cylinder, motored)
    theta, p = angle[inside], pressure[inside]
    weight = 1.0 / np.sqrt(max(noise, 1.0) ** 2 + (MODEL_ERROR * np.abs(p)) ** 2)
    start = _start(theta, p, cylinder)

    def numbers(x: Array) -> tuple[float, ...]:
        return (x[2], x[3] + warm, x[4], x[5], x[6], wall)

    def residual(x: Array) -> Array:
        model = _pressure(theta + x[0], cylinder, speed, numbers(x))
        capacities = x[5] / CAPACITY[motored], x[6] / CAPACITY[motored]
        priors = (x[3] - TEMPERATURE[0]) / TEMPERATURE[1], (x[4] - HEAT[0]) / HEAT[1], *capacities
        return np.concatenate((weight * (model - x[1] - p), priors))

    scale = np.array([0.01, 1e4, 1e4, 20.0, 0.3, 0.01, 0.01])
    first = np.array([0.0, start[0], start[1], TEMPERATURE[0], 0.0, 0.0, 0.0])
    found = least_squares(residual, first, "3-point", x_scale=scale, ftol=TIGHT, xtol=TIGHT, gtol=TIGHT)
    x, points = found.x, theta.size
    # Standard errors (7,) of a fit's unknowns, with the wider prior UNSURE of the heat capacity.
    scaled = found.jac * scale
    scaled[points + 2 : points + 4] *= CAPACITY[motored] / UNSURE
    # Unknowns are scaled, because pressures in Pa and changes of a hundredth make an ill-conditioned matrix.
    covariance = np.linalg.pinv(scaled.T @ scaled) * np.outer(scale, scale)
    inflated = max(1.0, float(np.sum(found.fun[:points] ** 2)) / max(1, points - 7))
    errors = np.asarray(np.sqrt(np.diag(covariance) * inflated))
    by = float(x[0])
    left = float(np.sqrt(np.mean((found.fun[:points] / weight) ** 2)))
    pulls = found.fun[points : points + 4]
    doubt = _doubt(x, pulls, warm, cylinder) if np.abs(pulls).max() > UNUSUAL else ""
    if np.abs(pulls).max() > IMPOSSIBLE:
        raise InputError(f"{doubt}; the trace is of another engine, or its unit or dead centre are wrong")
    if left > 0.03 * float(np.ptp(p)) + 3.0 * noise or abs(by) > math.radians(20.0):
        raise InputError(
            f"{cylinder.name}: its compression misses the trace by {1e-5 * left:.3g} bar (shift "
            f"{math.degrees(by):.2f} deg, zero {1e-5 * x[1]:+.3g} bar); "
            "the trace is of another engine, or its unit or dead centre are wrong"
        )
    exponent, loss = _shape(theta + by, cylinder, speed, numbers(x), motored)
    return Compression(
        by, float(x[1]), exponent, loss, math.exp(float(x[4])), float(errors[0]),
        float(errors[1]), motored, (float(theta[0]), float(theta[-1])), left, doubt,
    )  # fmt: skip


def _compressed(angle: Array, pressure: Array, cylinder: Cylinder, motored: bool) -> NDArray[np.bool_]:
    """Return a mask (n,) of the samples to fit; raises ``InputError`` if there are too few."""
    last = math.radians(LAST_DEG) if motored else burn_begins(angle, pressure, cylinder) - math.radians(BEFORE_BURN_DEG)
    first = FIRST_DEG if cylinder.cycle > 3.0 * math.pi else FIRST_OF_TWO_STROKES_DEG
    inside = (angle >= math.radians(first)) & (angle <= last)
    if np.count_nonzero(inside) < 12 or last < math.radians(-60.0):
        raise InputError(
            f"{cylinder.name}: no compression from {first:g} to {math.degrees(last):.0f} deg after dead centre in "
            f"the trace; its peak lies at {math.degrees(angle[np.argmax(pressure)]):.0f} deg; check the dead centre"
        )
    return np.asarray(inside)


def _shape(
    angle: Array, cylinder: Cylinder, speed: float, numbers: tuple[float, ...], motored: bool
) -> tuple[float, float]:
    """Return the mean polytropic exponent along true angles (n,), and the loss angle, rad (NaN if not motored)."""
    curve = _pressure(angle, cylinder, speed, numbers)
    volume = cylinder.volume(angle)[0]
    top = int(np.argmin(volume))
    exponent = math.log(curve[top] / curve[0]) / math.log(volume[0] / volume[top])
    if not motored:
        return exponent, math.nan
    step = math.radians(0.05)
    fine = np.arange(math.radians(-10.0), math.radians(5.0), step)
    path = np.concatenate((np.arange(angle[0], fine[0], math.radians(1.0)), fine))
    curve = _pressure(path, cylinder, speed, numbers)
    k = int(np.argmax(curve))
    a, b, c = curve[k - 1 : k + 2]
    return exponent, -float(path[k] + 0.5 * (a - c) / (a - 2.0 * b + c) * step)


def _doubt(x: Array, pulls: Array, intake_temperature: float, cylinder: Cylinder) -> str:
    """Return a remark on the most unusual value of a fit, measured by deviations from the priors."""
    said = (
        f"{x[3] + intake_temperature:.0f} K at the begin of the compression",
        f"{math.exp(float(x[4])):.2f} times the usual heat to the walls",
        f"a heat capacity {100.0 * x[5]:+.1f} % off that of air",
        f"a heat capacity that rises by {100.0 * x[6]:+.1f} % in 1000 K beside that of air",
    )
    worst = said[int(np.argmax(np.abs(pulls)))]
    return (
        f"{cylinder.name}: its compression fits the trace only with {worst}; check compression ratio "
        f"({cylinder.compression_ratio:g}), dead centre, speed and intake temperature"
    )


def burn_begins(angle: Array, pressure: Array, cylinder: Cylinder) -> float:
    """Return the angle, rad, of the start of heat release, from dQ/dθ = γ/(γ−1) p V' + V p'/(γ−1), γ = 1.35."""
    inside = (angle > math.radians(-90.0)) & (angle < math.radians(60.0))
    theta = angle[inside]
    wide = max(3, round(math.radians(3.0) / float(angle[1] - angle[0])) | 1)
    p = np.convolve(np.pad(pressure[inside], wide // 2, mode="edge"), np.ones(wide) / wide, mode="valid")
    volume, derivative = cylinder.volume(theta)
    heat = 1.35 * p * derivative + volume * np.gradient(p, theta)
    top = int(np.argmax(heat))
    early = heat[theta < math.radians(-45.0)]
    limit = max(0.05 * float(heat[top]), float(np.mean(early) + 4.0 * np.std(early)))
    below = np.flatnonzero(heat[:top] < limit)
    return float(theta[below[-1]]) if below.size else float(theta[0])


def two_point_zero(angle: Array, pressure: Array, cylinder: Cylinder, exponent: float) -> float:
    """Return the zero (Pa, to be added) for equal p V^n at 100 and 65° before dead centre, by means over 2° around."""
    means, powers = [], []
    for point in (-100.0, -65.0):
        near = np.abs(angle - math.radians(point)) <= math.radians(1.0)
        power = cylinder.volume(angle[near])[0] ** exponent
        means.append(float(np.mean(pressure[near] * power)))
        powers.append(float(np.mean(power)))
    return (means[1] - means[0]) / (powers[0] - powers[1])


def _start(theta: Array, p: Array, cylinder: Cylinder) -> tuple[float, float]:
    """Return initial guesses of zero and of the true pressure at the first angle, by a line of p over V^−1.35."""
    power = cylinder.volume(theta)[0] ** -1.35
    half = theta < min(math.radians(-30.0), float(theta[-1]))
    slope, shift = np.polyfit(power[half], p[half], 1)
    return -float(shift), float(slope * power[0])


def _pressure(angle: Array, cylinder: Cylinder, speed: float, numbers: tuple[float, ...]) -> Array:
    """Compute pressure (n,) Pa along increasing angles (n,) rad by a Runge-Kutta method, one step per angle.

    ``numbers`` are pressure and temperature at the first angle, ln C, changes of the heat capacity and of its rise in
    1000 K, and wall temperature.
    """
    p0, t0, heat, capacity, rise, wall = (float(value) for value in numbers)
    halves = np.empty(2 * angle.size - 1)
    halves[0::2], halves[1::2] = angle, 0.5 * (angle[1:] + angle[:-1])
    volume, derivative = cylinder.volume(halves)
    area = cylinder.walls(volume)
    # Woschni: 130 D^-0.2 (p/bar)^0.8 T^-0.53 ((2.28 + 0.308) c_m)^0.8, at a swirl of the mean piston speed.
    factor = math.exp(heat) * 130.0 * cylinder.bore**-0.2 * (2.588 * cylinder.stroke * speed / math.pi) ** 0.8 / speed
    low, high = _AIR
    v, dv, a = volume.tolist(), derivative.tolist(), area.tolist()
    ratio = t0 / (p0 * v[0])

    def slope(p: float, k: int) -> float:
        p = max(p, 1e3)
        t = min(ratio * p * v[k], HIGHEST)
        c0, c1, c2, c3, c4 = low if t < MIDDLE else high
        cv = (c0 - 1.0 + t * (c1 + t * (c2 + t * (c3 + t * c4)))) * (1.0 + capacity + rise * (1e-3 * t - MIDWAY))
        lost = factor * (1e-5 * p) ** 0.8 * max(t, 100.0) ** -0.53 * a[k] * (t - wall)
        return (-(1.0 + 1.0 / cv) * p * dv[k] - lost / cv) / v[k]

    steps = np.diff(angle).tolist()
    p = p0
    result = [p]
    for i, h in enumerate(steps):
        k = 2 * i
        k1 = slope(p, k)
        k2 = slope(p + 0.5 * h * k1, k + 1)
        k3 = slope(p + 0.5 * h * k2, k + 1)
        k4 = slope(p + h * k3, k + 2)
        p = p + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        result.append(p)
    return np.array(result)
