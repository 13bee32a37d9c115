"""Stability map of mode truncation: highest frequency at which a truncated body has an accurate receptance.

The receptance of a free body at a loaded interface is H(ω) = Σ φ_n²/(ω_n² − ω²) over its elastic modes; its static
value C = H(0) is the interface's elastic compliance. A body truncated to m elastic modes lacks the other modes at every
frequency. With static completeness (residual attachment, :func:`cranktrain.core.reduced_body.truncate`) it lacks only
the dynamic part of the other modes. The error here is |H_m − H|/C; above 1 % the truncated body fails.

Theory: a uniform shaft, free at both ends and loaded by a torque at one, has ω_n = n ω_1 and equal φ_n² there, so that
with x = ω/ω_1, the omitted S(x) = Σ_{n>m} 1/(n² − x²) = [ψ(m+1+x) − ψ(m+1−x)]/2x and the sums S₂ = ζ(2, m+1),
S₄ = ζ(4, m+1) of 1/n² and 1/n⁴

    error without = S(x)/ζ(2),   error with = |S(x) − S₂/(1 − x² S₄/S₂)|/ζ(2),

because the attachment is itself a mode with the Rayleigh quotient S₂/S₄. Statics and the term of first power in ω² are
then exact (Rubin 1975). The modes of the truncated shaft come from Ritz's method on Legendre polynomials, not from
these sums.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import eigh
from scipy.special import digamma, zeta

from cranktrain.core.reduced_body import Array, ReducedBody, truncate
from cranktrain.engine.file import load_engine
from cranktrain_lab.stability.stability_map import Axis, Onset, Progress, StabilityMap, curve, deviation, onset

ALLOWED = 0.01
"""Relative error of the receptance above which a truncated body fails."""
POLYNOMIALS = 240
"""Number of Ritz functions of the uniform shaft. Some two thirds of the resulting modes are accurate."""
DIAMETER, LENGTH, SHEAR_MODULUS, DENSITY = 0.06, 0.8, 80.8e9, 7850.0
COARSE = 0.025
"""Mesh size of the six's crankshaft in a quick map, m."""
LEAST, NEAR_RESONANCE = 1.0e-3, 1.0e-6
"""Search range of usable frequencies, relative to the first omitted frequency: LEAST to 1 − NEAR_RESONANCE."""
BESIDE = 1.0e-7
"""Relative distance from a modal frequency within which the receptance is evaluated next to the frequency."""
Loads = Sequence[tuple[str, int]]
TORQUE: Loads = (("pulley", 5),)


def uniform_shaft() -> ReducedBody:
    """Return a uniform steel shaft in torsion, free at both ends, in Ritz modes, with interfaces at both ends.

    The Ritz functions are Legendre polynomials of the axial position. Their mass is diagonal, 2/(2k+1), and their
    stiffness i (i+1) for i ≤ k of the same parity, so no numerical integration is needed.
    """
    k = np.arange(POLYNOMIALS)
    polar = math.pi * DIAMETER**4 / 32.0
    mass = 0.5 * LENGTH * DENSITY * polar * np.diag(2.0 / (2.0 * k + 1.0))
    least = np.minimum.outer(k, k)
    even = np.add.outer(k, k) % 2 == 0
    stiffness = SHEAR_MODULUS * polar * (2.0 / LENGTH) * np.where(even, least * (least + 1.0), 0.0)
    _, modes = eigh(stiffness[1:, 1:], mass[1:, 1:])
    # Frequencies are Rayleigh quotients of the modes' twist (sums of squares), free of rounding errors of fast modes.
    rate = np.where(np.triu(np.subtract.outer(k, k) % 2), 2.0 * k[:, None] + 1.0, 0.0)[:, 1:] @ modes
    squares = SHEAR_MODULUS * polar * (2.0 / LENGTH) * (2.0 / (2.0 * k + 1.0) @ rate**2)
    n = 6 + squares.size
    places = np.array([[0.0, 0.0, -0.5 * LENGTH], [0.0, 0.0, 0.5 * LENGTH]])
    total, inertia = DENSITY * LENGTH * math.pi * DIAMETER**2 / 4.0, DENSITY * LENGTH * polar
    diametral = 0.5 * inertia + total * LENGTH**2 / 12.0
    shapes = np.zeros((2, 6, n))
    for row, sign in enumerate((-1.0, 1.0)):
        z = places[row, 2]
        motion = np.eye(6)
        motion[:3, 3:] = [[0.0, z, 0.0], [-z, 0.0, 0.0], [0.0, 0.0, 0.0]]
        shapes[row, :, :6] = motion * np.array([total, total, total, diametral, diametral, inertia]) ** -0.5
        shapes[row, 5, 6:] = sign ** k[1:] @ modes
    # Twist about the axis: e_z×φ points inwards, so G is zero and spin softening cancels stress stiffening.
    twisting = np.zeros((n, n))
    twisting[range(5, n), range(5, n)] = 1.0
    along = (total * LENGTH**2 / 12.0) / diametral
    gyroscopic, centrifugal, stress = np.zeros((n, n)), twisting.copy(), twisting.copy()
    gyroscopic[0, 1], gyroscopic[1, 0] = -1.0, 1.0
    gyroscopic[3, 4], gyroscopic[4, 3] = -along, along
    centrifugal[range(5), range(5)] = [1.0, 1.0, 0.0, along, along]
    stress[range(3, 5), range(3, 5)] = 1.0 - along
    euler, translation = np.zeros(n), np.zeros((3, n))
    euler[5] = math.sqrt(inertia)
    translation[range(3), range(3)] = math.sqrt(total)
    return ReducedBody(
        name="uniform shaft", omega=np.concatenate((np.zeros(6), np.sqrt(squares))),
        interfaces=("pulley", "flywheel"), positions=places, shapes=shapes, gyroscopic=gyroscopic,
        centrifugal=centrifugal, stress_stiffness=stress, centrifugal_load=np.zeros(n), euler_load=euler,
        translation=translation, mass=total, centre=np.zeros(3), inertia=np.diag([diametral, diametral, inertia]),
    )  # fmt: skip


def receptances(body: ReducedBody, loads: Loads, answers: Loads, omega: float) -> Array:
    """Return elastic receptances (answers, loads), displacement or rotation per force or moment, at ``omega``."""
    at, seen = (
        np.array([body.shapes[body.index(name), component, 6:] for name, component in where])
        for where in (loads, answers)
    )
    return np.asarray(seen / (body.omega[6:] ** 2 - omega**2) @ at.T)


def cut(body: ReducedBody, modes: int, loads: Loads, complete: bool) -> ReducedBody:
    """Return a body in its first elastic modes, with static completeness for the loads if ``complete``."""
    frequencies = body.frequencies_hz
    cutoff = math.sqrt(frequencies[5 + modes] * frequencies[6 + modes])
    return truncate(body, cutoff, loads if complete else ())


def truncation_error(
    body: ReducedBody, short: ReducedBody, loads: Loads, answers: Loads | None
) -> Callable[[float], float]:
    """Return the error of the truncated body as a function of ω (rad/s).

    By default it is the largest error of the loads' own compliances. With ``answers`` it is the error of the responses
    at these to the loads, relative to the largest static response.
    """
    own = answers is None
    seen = loads if answers is None else answers
    static = receptances(body, loads, seen, 0.0)
    scale = np.diag(static) if own else np.abs(static).max(axis=1, keepdims=True)

    def error(omega: float) -> float:
        # Retained modes cancel in the difference; at a resonance the receptance is evaluated next to it.
        if np.abs(body.omega[6:] - omega).min() < BESIDE * omega:
            omega *= 1.0 + 2.0 * BESIDE
        missing = receptances(short, loads, seen, omega) - receptances(body, loads, seen, omega)
        return float(np.max(np.abs(np.diag(missing) if own else missing) / scale))

    return error


def usable_share(error: Callable[[float], float], tolerance: float) -> Onset:
    """Return the fraction of the first omitted frequency up to which ``error(fraction)`` is at most ``ALLOWED``."""
    places = np.array([LEAST, 1.0 - NEAR_RESONANCE])
    return onset(lambda share: error(share) > ALLOWED, places, tolerance, LEAST)


def shaft_error(modes: int, x: float, complete: bool) -> float:
    """Return the truncated uniform shaft's error in closed form, at x times the shaft's first frequency."""
    omitted = (digamma(modes + 1 + x) - digamma(modes + 1 - x)) / (2.0 * x)
    if not complete:
        return float(omitted / zeta(2))
    s2, s4 = zeta(2, modes + 1), zeta(4, modes + 1)
    return float(abs(omitted - s2 / (1.0 - x * x * s4 / s2)) / zeta(2))


def shaft_limit(modes: int, complete: bool) -> Onset:
    """Return the usable fraction of the first omitted frequency for the uniform shaft, in closed form."""
    return usable_share(lambda share: shaft_error(modes, share * (modes + 1), complete), 1.0e-9)


def limits(body: ReducedBody, counts: Array, loads: Loads, answers: Loads | None, complete: bool) -> list[Onset]:
    """Return usable fractions of the first omitted frequency for each of k numbers of retained elastic modes."""
    found = []
    for count in counts.astype(int):
        short = cut(body, count, loads, complete)
        error, omitted = truncation_error(body, short, loads, answers), float(body.omega[6 + count])
        found.append(usable_share(lambda share, e=error, w=omitted: e(share * w), 1.0e-6))  # type: ignore[misc]
    return found


def crankshaft(quick: bool, progress: Progress) -> tuple[ReducedBody, Loads]:
    """Return the six's crankshaft with flywheel and pulley in all its modes, and the loads of the running model."""
    from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft, running_loads

    engine = load_engine("diesel_i6")
    if quick:
        engine = replace(engine, crankshaft=replace(engine.crankshaft, mesh_size=COARSE))
    bare = reduced_crankshaft(engine, progress=lambda stage: progress(f"crankshaft: {stage}", 0.3))
    return complete_crankshaft(engine, bare), running_loads(engine)


def compute(quick: bool, progress: Progress) -> StabilityMap:
    """Compute the map of the usable fraction of the cut-off over the number of retained elastic modes."""
    shaft = uniform_shaft()
    counts = np.unique(np.geomspace(1.0, 120.0, 16 if quick else 40).round())
    shares = np.linspace(0.013, 0.987, 25 if quick else 65)
    progress("uniform shaft", 0.0)
    exact = {complete: [shaft_limit(int(m), complete) for m in counts] for complete in (True, False)}
    found = {complete: limits(shaft, counts, TORQUE, None, complete) for complete in (True, False)}
    measure = np.zeros((shares.size, counts.size))
    for column, count in enumerate(counts.astype(int)):
        error = truncation_error(shaft, cut(shaft, count, TORQUE, True), TORQUE, None)
        measure[:, column] = [error(share * shaft.omega[6 + count]) for share in shares]
    progress("crankshaft of the six", 0.2)
    crank, loads = crankshaft(quick, progress)
    kept = counts[counts < crank.n_modes - 7]
    pins = tuple(load for load in loads if load[0].startswith("pin"))
    progress("crankshaft of the six: interfaces", 0.6)
    interfaces = limits(crank, kept, loads, None, True)
    progress("crankshaft of the six: pulley", 0.8)
    pulley = {complete: limits(crank, kept, pins, TORQUE, complete) for complete in (True, False)}
    static = {m: truncation_error(crank, cut(crank, m, loads, False), loads, None)(0.0) for m in (20, int(kept[-1]))}
    source = "body cut by reduced_body.truncate against all its modes"
    closed = "closed form, sums over the omitted modes"
    return StabilityMap(
        name="mode_truncation",
        title="Mode truncation: share of the cut-off with less than 1 % error, by number of elastic modes",
        rows=Axis("frequency over that of the first omitted mode", "", shares),
        columns=Axis("elastic modes kept", "", counts, log=True),
        stable=measure <= ALLOWED,
        measure=np.log10(np.clip(measure, 1.0e-8, 1.0)),
        measure_label="log10 of the error, uniform shaft with static completeness",
        theory=(
            curve("uniform shaft, statically complete", counts, exact[True], closed),
            curve("uniform shaft, without", counts, exact[False], closed),
        ),
        numerical=(
            curve("uniform shaft, statically complete", counts, found[True], source),
            curve("uniform shaft, without", counts, found[False], source),
            curve("six, mains' and pins' own compliance, complete", kept, interfaces, source),
            curve("six, pulley's twist by loads on pins, complete", kept, pulley[True], source),
            curve("six, pulley's twist by loads on pins, without", kept, pulley[False], source),
        ),
        max_deviation=max(
            deviation(np.array(found[complete]), np.array(exact[complete])) for complete in (True, False)
        ),
        explanation=_explanation(static, kept, np.fmin(interfaces, pulley[True]).astype(float)),
        failure="error beyond 1 %",
    )


def _explanation(static: dict[int, float], kept: Array, usable: Array) -> str:
    """Return the explanation of the map, with its numbers."""
    needed = next(m for m in range(1, 1000) if zeta(2, m + 1) < ALLOWED * zeta(2))
    (few, error), (many, less) = static.items()
    some = kept >= 10
    return (
        "A body cut to its first modes is too stiff where it is loaded: every omitted mode would have given way a "
        f"little, at rest too. The end of a uniform shaft needs {needed} modes for statics within 1 %.\n"
        f"The six's mains and pins are local: with {few} modes the worst is {100.0 * error:.0f} % too stiff, with "
        f"{many} still {100.0 * less:.1f} %; such a model moves bearing loads.\n"
        "One attachment a load (static completeness) has statics and the first power of ω² right: what is left falls "
        f"with the fourth power of frequency. The six then serves to {100.0 * float(usable[some].min()):.0f} % of the "
        f"cut-off or more with ten modes, to {100.0 * float(np.nanmin(usable)):.0f} % at the worst with fewer.\n"
        "What to do: keep the attachments, and cut at twice the highest frequency asked for; modes alone converge "
        "slowly."
    )
