r"""Load distribution of a cylindrical roller bearing with clearance, tilt and roller profile.

Rollers j = 0 … Z − 1 are at the angles ψ_j = ψ_0 + 2πj/Z between rigid rings. If the journal is displaced by (x, y) in
its middle and additionally by (a, b) at its end ζ = 1, the total approach of both contacts of roller j at ζ is

    δ_j(ζ) = (x + aζ) cos ψ_j + (y + bζ) sin ψ_j − G_r/2 − 2 P(ζ),

with the diametral clearance G_r of the standards (ISO 5753: total displacement from side to side) and the relief P of
the roller's profile. Each slice carries q = K δ^(10/9) times its fraction of the length if δ > 0; slices are points
of Gauss's rule. K = k l^(8/9) with δ and l in mm:

* ``palmgren``: δ = 3.84e-5 Q^0.9/l^0.8 in each of the two contacts (steel on steel), so k = 7.68e-5^(−10/9) = 37 309.6;
* ``iso16281``: k = 35 948 of ISO/TS 16281, both contacts.

Forces are sums over slices; so are their tangents, symmetric because the contacts only store energy. Profile, in the
logarithmic form of ISO/TS 16281: P = p D ln 1/(1 − s²), s = (2|z| − m)/(l − m), with m = l − 2.5 D of a long roller
left straight and m = 0 of a short one; the standard has p = 0.00035 for short and 0.0005 for long rollers.

Neglected: centrifugal force and skew of the rollers, cage, oil film. Rings stay round; for their deformation see
:mod:`cranktrain.structure.block.roller_ring`.

References: Harris and Kotzalas, Rolling Bearing Analysis, 5th ed., ch. 6 and 7 (contacts by Palmgren, load
distribution); ISO/TS 16281 (slices, profile); ISO 76 (static rating at 4000 MPa).
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import four, minus, put_four
from cranktrain.core.reduced_body import Array
from cranktrain.engine.roller_bearing import LONG_ROLLER, RollerBearing, check_roller_bearing

SLICES = 30
"""Number of Gauss points along a roller."""
ITERATIONS = 200
HALVINGS = 100
"""Most steps of a line search, doublings included."""
RESIDUAL = 1.0e-11
"""Tolerance of the force balance, as a fraction of the load."""

# Indices of the constants of a roller bearing.
COUNT, HALF_CLEARANCE, STIFFNESS_FACTOR, PRESSURE_FACTOR, TURN_COS, TURN_SIN, N_CONSTANTS = range(7)
# Rows of the slices of a roller: position ζ, fraction of the length, relief 2P of both contacts (m).
ZETA, SHARE, RELIEF = range(3)
# Indices of the result of roller_force, which begins with forces (4):
# BY_PLACE, WORK: tangents by position (4, 4), elastic energy (J).
# LARGEST, WHERE, PRESSURE: load (N) and number of the most loaded roller, pressure of the most loaded slice (Pa).
# LOADED, APPROACH: number of loaded rollers, largest approach (m; negative: least gap).
BY_PLACE, WORK, LARGEST, WHERE, PRESSURE, LOADED, APPROACH, N_OUT = 4, 20, 21, 22, 23, 24, 25, 26


@dataclass(frozen=True, eq=False)
class LoadedBearing:
    """Equilibrium of a bearing under a load.

    Attributes
    ----------
    place : (4,) m, displacement (x, y) of the journal's middle and (a, b) of its end against the middle
    stiffness : (4, 4) N/m, −∂F/∂place; the tilting stiffness about the middle is the lower block times (l/2)²
    angles, loads : (Z,) rad, N of each roller
    pressure : largest contact pressure at the inner ring, Pa
    iterations : number of Newton iterations
    """

    place: Array
    stiffness: Array
    angles: Array
    loads: Array
    pressure: float
    iterations: int


def roller_constants(bearing: RollerBearing) -> Array:
    """Return the constants of one bearing for :func:`roller_force`, (N_CONSTANTS,)."""
    step = 2.0 * math.pi / bearing.rollers
    return np.array(
        [
            bearing.rollers,
            0.5 * bearing.clearance,
            bearing.contact_stiffness,
            bearing.pressure_factor / math.sqrt(bearing.length),
            math.cos(step),
            math.sin(step),
        ]
    )


def roller_slices(bearing: RollerBearing, count: int = SLICES) -> Array:
    """Return slices of a roller, (3, count): ζ in (−1, 1), fraction of the length, relief 2P of both contacts (m)."""
    zeta, weight = _gauss(count)
    straight = max(0.0, 1.0 - LONG_ROLLER * bearing.diameter / bearing.length)
    s = np.maximum(np.abs(zeta) - straight, 0.0) / (1.0 - straight)
    relief = -2.0 * bearing.profile * bearing.diameter * np.log1p(-s * s)
    return np.array([zeta, 0.5 * weight, relief])


@lru_cache(maxsize=8)
def _gauss(count: int) -> tuple[Array, Array]:
    """Return points and weights of Gauss's rule on [−1, 1]."""
    return np.polynomial.legendre.leggauss(count)


def radial_integral(epsilon: float, points: int = 400) -> float:
    """Return Sjövall's integral J_r(ε): Z rollers with the largest roller load Q_max carry F = Z Q_max J_r(ε).

    J_r(ε) = 1/(2π) ∫ [1 − (1 − cos ψ)/(2ε)]^(10/9) cos ψ dψ over the loaded arc, cos ψ > 1 − 2ε; with the approach
    δ_max of the most loaded rollers ε = δ_max/(2 δ_max + G_r), ½ without clearance (Harris and Kotzalas, ch. 7).
    """
    end = math.acos(max(-1.0, 1.0 - 2.0 * epsilon)) if epsilon < 1.0 else math.pi
    # The substitution ψ = end sin(t) removes the kink of the power law at the end of the arc.
    t, weight = _gauss(points)
    psi = end * np.sin(0.5 * math.pi * t)
    jacobian = 0.5 * math.pi * end * np.cos(0.5 * math.pi * t)
    share = np.maximum(1.0 - (1.0 - np.cos(psi)) / (2.0 * epsilon), 0.0) ** (10.0 / 9.0)
    return float(weight @ (jacobian * share * np.cos(psi))) / (2.0 * math.pi)


def many_rollers(bearing: RollerBearing, load: float) -> tuple[float, float]:
    """Return largest approach (m) and roller load (N) of an aligned bearing, straight rollers, radial ``load`` > 0 (N).

    Closed form for infinitely many rollers, F = Z K δ_max^(10/9) J_r(ε); ε follows from the clearance.
    """

    def total(approach: float) -> float:
        epsilon = approach / max(2.0 * approach + bearing.clearance, 1e-300)
        return bearing.rollers * bearing.contact_stiffness * approach ** (10.0 / 9.0) * radial_integral(epsilon)

    low = max(0.0, -0.5 * bearing.clearance)
    high = low + (load / bearing.contact_stiffness) ** 0.9
    while total(high) < load:
        high *= 2.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if total(middle) < load else (low, middle)
    return high, bearing.contact_stiffness * high ** (10.0 / 9.0)


def force_at(bearing: RollerBearing, place: Array, first_angle: float = 0.0, slices: int = SLICES) -> Array:
    """Return the result (N_OUT,) of :func:`roller_force` with the journal at ``place`` (4,) m."""
    out = np.zeros(N_OUT)
    first = math.cos(first_angle), math.sin(first_angle)
    at = np.array(place, dtype=float)
    roller_force(at, *first, roller_constants(bearing), roller_slices(bearing, slices), out)
    return out


def roller_loads(bearing: RollerBearing, place: Array, first_angle: float = 0.0, slices: int = SLICES) -> Array:
    """Return the load (N) of each of the Z rollers, (Z,), with the journal at ``place`` (4,) m."""
    share = roller_slices(bearing, slices)[SHARE]
    approach = _approach(bearing, place, first_angle, slices)
    return np.asarray(bearing.contact_stiffness * approach ** (10.0 / 9.0) @ share)


def slice_stiffness(bearing: RollerBearing, place: Array, first_angle: float = 0.0, slices: int = SLICES) -> Array:
    """Return the stiffness (N/m) of each slice of the Z rollers, (Z, slices), with the journal at ``place`` (4,) m."""
    share = roller_slices(bearing, slices)[SHARE]
    approach = _approach(bearing, place, first_angle, slices)
    slope = 10.0 / 9.0 * bearing.contact_stiffness * approach ** (1.0 / 9.0)
    return np.asarray(np.where(approach > 0.0, slope, 0.0) * share)


def _approach(bearing: RollerBearing, place: Array, first_angle: float, slices: int) -> Array:
    """Return the approach (m) of both contacts at each slice of the Z rollers, (Z, slices); 0 without contact."""
    angles = first_angle + 2.0 * math.pi * np.arange(bearing.rollers) / bearing.rollers
    zeta, _, relief = roller_slices(bearing, slices)
    x, y, a, b = place
    radial = np.outer(np.cos(angles), x + a * zeta) + np.outer(np.sin(angles), y + b * zeta)
    return np.asarray(np.maximum(radial - 0.5 * bearing.clearance - relief, 0.0))


def equilibrium(bearing: RollerBearing, load: Array, first_angle: float = 0.0, slices: int = SLICES) -> LoadedBearing:
    """Find the equilibrium position of the journal under a load.

    The rollers' energy is convex, so Newton's method with a line search on energy minus work of the load converges from
    any start. In a direction that no roller resists (few rollers within a clearance) the initial guess is kept.

    Parameters
    ----------
    load : (4,) N: F_x, F_y, and the moments as forces at the end ζ = 1, Q = M/(l/2)
    first_angle : ψ_0, rad

    Returns
    -------
    the equilibrium; without load the journal is at half the clearance along x, or in the middle without clearance

    Raises
    ------
    InputError
        if the data of the bearing are invalid
    SolverError
        if no equilibrium is found
    """
    check_roller_bearing(bearing)
    load = np.asarray(load, dtype=np.float64)
    size = float(np.linalg.norm(load))
    if not math.isfinite(size):
        raise InputError("load: is not a finite number")
    half = max(0.5 * bearing.clearance, 0.0)
    place = np.zeros(4)
    direction = load / size if size > 0.0 else np.array([1.0, 0.0, 0.0, 0.0])
    # Initial guess: contact in the direction of the load, plus the approach of many rollers.
    place += direction * (half + (5.0 * size / (bearing.rollers * bearing.contact_stiffness)) ** 0.9)
    step_limit = half + 10.0 * float(np.linalg.norm(place)) + 1.0e-9
    for iteration in range(ITERATIONS):
        out = force_at(bearing, place, first_angle, slices)
        residual = load + out[:4]
        error = float(np.linalg.norm(residual))
        stiffness = -out[BY_PLACE:WORK].reshape(4, 4)
        # Rounding limits the accuracy of small loads: the approach is a small difference of position and clearance.
        digits = abs(0.5 * bearing.clearance) + float(np.abs(place).max())
        rounding = 1.0e-15 * float(np.trace(stiffness)) * digits
        if error <= RESIDUAL * size + rounding:
            angles = first_angle + 2.0 * math.pi * np.arange(bearing.rollers) / bearing.rollers
            loads = roller_loads(bearing, place, first_angle, slices)
            return LoadedBearing(place, stiffness, angles, loads, float(out[PRESSURE]), iteration)
        # Either the directions that rollers resist or the others, whichever are further out of balance: one factor on
        # a step of both would be the factor that the others need.
        values, ways = np.linalg.eigh(stiffness)
        share = ways.T @ residual
        softest = max(1.0e-10 * float(values[-1]), 1.0e-30)
        held = values > softest
        further = held if np.linalg.norm(share[held]) > np.linalg.norm(share[~held]) else ~held
        step = ways[:, further] @ (share[further] / np.maximum(values[further], softest))
        step *= min(1.0, step_limit / float(np.linalg.norm(step)))
        place = place + _line_search(bearing, place, step, load, first_angle, slices) * step
    raise SolverError(
        f"roller bearing: no balance with {size:.4g} N after {ITERATIONS} iterations; check load, clearance and lengths"
    )


def _line_search(
    bearing: RollerBearing, place: Array, step: Array, load: Array, first_angle: float, slices: int
) -> float:
    """Return the factor on a step at which the unbalanced force along it has fallen, and has not turned round.

    The energy is convex, so this force falls along the step. It may do so within a tiny part of it, where a tilt
    across the only loaded roller brings others into contact. A step of stiff and soft directions leaves the soft part.
    """

    def left(share: float) -> float:
        return float((load + force_at(bearing, place + share * step, first_angle, slices)[:4]) @ step)

    promised, low, high = left(0.0), 0.0, math.inf
    share = 1.0
    for _ in range(HALVINGS):
        now = left(share)
        if -0.5 * promised <= now <= 0.9 * promised:
            break
        low, high = (share, high) if now > 0.0 else (low, share)
        share = 2.0 * share if math.isinf(high) else 0.5 * (low + high)
    return share


# Kernels --------------------------------------------------------------------------------------------------------------


@kernel
def roller_force(place, first_cos, first_sin, constants, slices, out):
    """Compute the force of the rollers on a journal at ``place`` (4,) m, in any axes.

    ``place`` holds (x, y) of the middle and (a, b) of the end ζ = 1 against it. ``first_cos``, ``first_sin`` give the
    direction of roller 0; ``constants`` and ``slices`` come from :func:`roller_constants` and :func:`roller_slices`.

    Fills ``out`` (N_OUT,): forces (F_x, F_y, Q_x, Q_y) with Q = ∫ ζ dF (N); from BY_PLACE on their derivatives by
    place, row-major (N/m); WORK, the energy stored (J); LARGEST load of a roller (N), WHERE its number; PRESSURE, the
    largest at the inner ring (Pa); LOADED, the number of loaded rollers; APPROACH, the largest at the ends or middle of
    the rollers, without their profile (m; below 0: least gap).
    """
    x, y, a, b = four(place, 0)
    for k in range(N_OUT):
        out[k] = 0.0
    count = int(constants[COUNT])
    half_clearance = constants[HALF_CLEARANCE]
    factor = constants[STIFFNESS_FACTOR]
    cos = first_cos
    sin = first_sin
    highest = 0.0
    for j in range(count):
        middle = x * cos + y * sin - half_clearance
        lever = a * cos + b * sin
        reach = middle + abs(lever)
        if j == 0 or reach > out[APPROACH]:
            out[APPROACH] = reach
            if out[LARGEST] == 0.0:
                out[WHERE] = j
        if reach > 0.0:
            load = 0.0
            moment = 0.0
            k_0 = 0.0
            k_1 = 0.0
            k_2 = 0.0
            for i in range(slices.shape[1]):
                zeta = slices[ZETA, i]
                delta = middle + lever * zeta - slices[RELIEF, i]
                if delta <= 0.0:
                    continue
                slope = factor * delta ** (1.0 / 9.0)
                per_length = slope * delta
                if per_length > highest:
                    highest = per_length
                q = slices[SHARE, i] * per_length
                slope *= slices[SHARE, i] * (10.0 / 9.0)
                load += q
                moment += zeta * q
                k_0 += slope
                k_1 += zeta * slope
                k_2 += zeta * zeta * slope
                out[WORK] += (9.0 / 19.0) * q * delta
            if load > 0.0:
                out[LOADED] += 1.0
                if load > out[LARGEST]:
                    out[LARGEST] = load
                    out[WHERE] = j
                put_four(out, 0, minus(four(out, 0), (load * cos, load * sin, moment * cos, moment * sin)))
                for row in range(2):
                    for column in range(2):
                        stiffness = k_0 if row + column == 0 else (k_2 if row + column == 2 else k_1)
                        k = BY_PLACE + 8 * row + 2 * column
                        out[k] -= stiffness * cos * cos
                        out[k + 1] -= stiffness * cos * sin
                        out[k + 4] -= stiffness * cos * sin
                        out[k + 5] -= stiffness * sin * sin
        turned = cos * constants[TURN_COS] - sin * constants[TURN_SIN]
        sin = sin * constants[TURN_COS] + cos * constants[TURN_SIN]
        cos = turned
    out[PRESSURE] = constants[PRESSURE_FACTOR] * math.sqrt(highest)
