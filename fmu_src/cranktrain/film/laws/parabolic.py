"""Plain-bearing film with a parabolic axial pressure profile: Reynolds' equation around the circumference.

With p(ψ, z) = P(ψ) [1 − (2z/L)²] Galerkin's method over the width turns Reynolds' equation for the film
h = c (1 − ε cos ψ) into one line,

    −(H³ Π')' + κ² H³ Π = v_r cos ψ + v_t sin ψ,   Π ≥ 0,   κ² = 10 (R/L)²,   P = 15 η (R/c)² Π,

ψ counted from the line of centres (least film) in the sense of rotation, H = h/c, v = ė* / c the velocity of pure
squeeze, i.e. the journal centre's velocity seen from a frame turning at half the sum of the surface speeds. Rupture and
reformation follow Reynolds' condition (linear complementarity, solved exactly by an active set on a tridiagonal
matrix). The force on the journal is F = −10 η R L (R/c)² ∫ Π (cos ψ, sin ψ) dψ.

Assumptions: aligned journal, no groove, ambient pressure at both ends, constant viscosity. Against the two-dimensional
equation the force is within 1 % up to ε = 0.95 for L/D ≤ 0.5 (tests/literature/test_impedance_film.py). The nodes are
graded towards the least film by Sommerfeld's substitution cos ψ = (cos γ + m)/(1 + m cos γ) with m = 0.8 ε.
Source of the axial profile: the classical short-to-finite Galerkin approximation (Warner 1963 uses its exact axial
mode).
"""

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.film.laws.parameters import CLEARANCE, RADIUS, VISCOSITY, WIDTH

N_NODES = 96
"""Number of circumferential nodes; it may be large, because the film is solved only for the map and for outputs."""
GRADING = 0.8
ECCENTRICITY_MAX = 0.999
"""Largest eccentricity at which the film is evaluated; beyond it the film is frozen and contact carries the load."""
WORK_SIZE = 9 * N_NODES
FACE_COS = 2
"""Row of the node table that holds the cosines of the faces."""


def film_geometry(diameter: float, width: float, clearance: float, viscosity: float) -> tuple[float, float, float]:
    """Return the constants of one film: clearance c (m), κ² and force factor 10 η R L (R/c)² (N s)."""
    radius = 0.5 * diameter
    kappa2 = 10.0 * (radius / width) ** 2
    return clearance, kappa2, 10.0 * viscosity * radius * width * (radius / clearance) ** 2


def node_table() -> np.ndarray:
    """Return cosines and sines of the N nodes and cosines of the N faces at even spacing, before grading, (3, N)."""
    gamma = 2.0 * math.pi * np.arange(N_NODES) / N_NODES
    return np.ascontiguousarray([np.cos(gamma), np.sin(gamma), np.cos(gamma + math.pi / N_NODES)])


@kernel
def _solve_zone(first, count, v_r, v_t, work):
    """Solve both unit problems on one zone of nodes. Return the zone, corrected if it is not the pressure zone."""
    n = N_NODES
    delta = 2.0 * math.pi / n
    o_cos, o_sin, o_jac, o_face, o_mass = 0, n, 2 * n, 4 * n, 5 * n
    o_c, o_s, o_up = 6 * n, 7 * n, 8 * n
    inverse = 1.0 / (delta * delta)
    up = 0.0
    c = 0.0
    s = 0.0
    for k in range(count):
        i = first + k
        if i >= n:
            i -= n
        before = i - 1 if i > 0 else n - 1
        a_minus = work[o_face + before] * inverse
        a_plus = work[o_face + i] * inverse
        pivot = 1.0 / (a_minus + a_plus + work[o_mass + i] - a_minus * up)
        if k == 0:
            pivot = 1.0 / (a_minus + a_plus + work[o_mass + i])
        up = a_plus * pivot
        c = (work[o_cos + i] * work[o_jac + i] + a_minus * c) * pivot
        s = (work[o_sin + i] * work[o_jac + i] + a_minus * s) * pivot
        work[o_up + k] = up
        work[o_c + i] = c
        work[o_s + i] = s
    c = 0.0
    s = 0.0
    for k in range(count - 1, -1, -1):
        i = first + k
        if i >= n:
            i -= n
        c = work[o_c + i] + work[o_up + k] * c
        s = work[o_s + i] + work[o_up + k] * s
        work[o_c + i] = c
        work[o_s + i] = s
    # Shrink the zone at ends in tension; otherwise extend it to neighbours that would get positive pressure.
    lower = first
    kept = count
    while kept > 1:
        i = lower if lower < n else lower - n
        if v_r * work[o_c + i] + v_t * work[o_s + i] >= 0.0:
            break
        lower += 1
        kept -= 1
    while kept > 1:
        i = lower + kept - 1
        if i >= n:
            i -= n
        if v_r * work[o_c + i] + v_t * work[o_s + i] >= 0.0:
            break
        kept -= 1
    if kept < count:
        return lower if lower < n else lower - n, kept
    if count < n - 1:
        i = first
        j = i - 1 if i > 0 else n - 1
        push = work[o_jac + j] * (v_r * work[o_cos + j] + v_t * work[o_sin + j])
        if push + work[o_face + j] * inverse * (v_r * work[o_c + i] + v_t * work[o_s + i]) > 0.0:
            lower = j
            kept += 1
        i = first + count - 1
        if i >= n:
            i -= n
        j = i + 1 if i < n - 1 else 0
        push = work[o_jac + j] * (v_r * work[o_cos + j] + v_t * work[o_sin + j])
        if push + work[o_face + i] * inverse * (v_r * work[o_c + i] + v_t * work[o_s + i]) > 0.0 and kept < n - 1:
            kept += 1
    return lower, kept


@kernel
def film_pressure(eps, v_r, v_t, kappa2, nodes, work, zone):
    """Solve the film; ``zone[0:2]`` (first node, number of nodes) is the initial guess and then the result.

    Writes to ``work``: cos ψ, sin ψ, dψ/dγ, H at nodes (0, N, 2N, 3N), H³/J at faces (4N), and the two unit solutions
    λ_c, λ_s (6N, 7N); Π = v_r λ_c + v_t λ_s inside the zone. Returns the number of active-set passes.
    """
    n = N_NODES
    m = GRADING * eps
    root = math.sqrt(1.0 - m * m)
    o_sin, o_jac, o_film, o_face, o_mass = n, 2 * n, 3 * n, 4 * n, 5 * n
    for i in range(n):
        d = 1.0 / (1.0 + m * nodes[0, i])
        cos_psi = (nodes[0, i] + m) * d
        jacobian = root * d
        film = 1.0 - eps * cos_psi
        work[i] = cos_psi
        work[o_sin + i] = root * nodes[1, i] * d
        work[o_jac + i] = jacobian
        work[o_film + i] = film
        work[o_mass + i] = kappa2 * film * film * film * jacobian
    for i in range(n):
        d = 1.0 / (1.0 + m * nodes[FACE_COS, i])
        cos_psi = (nodes[FACE_COS, i] + m) * d
        film = 1.0 - eps * cos_psi
        work[o_face + i] = film * film * film / (root * d)
    first = int(zone[0])
    count = int(zone[1])
    if count < 1 or count >= n or first < 0 or first >= n:
        # Without a guess, start with the half circle of approaching surfaces, ψ = direction of the velocity ± 90°.
        best = -1.0
        first = 0
        for i in range(n):
            s = v_r * work[i] + v_t * work[o_sin + i]
            if s > best:
                best = s
                first = i
        count = 1
        while count < n - 2:
            j = first - 1 if first > 0 else n - 1
            if v_r * work[j] + v_t * work[o_sin + j] <= 0.0:
                break
            first = j
            count += 1
        while count < n - 2:
            j = first + count
            if j >= n:
                j -= n
            if v_r * work[j] + v_t * work[o_sin + j] <= 0.0:
                break
            count += 1
    passes = 0
    for _ in range(60):
        passes += 1
        new_first, new_count = _solve_zone(first, count, v_r, v_t, work)
        if new_first == first and new_count == count:
            break
        first = new_first
        count = new_count
    zone[0] = float(first)
    zone[1] = float(count)
    return passes


@kernel
def film_force(eps, v_r, v_t, kappa2, nodes, work, zone, out):
    """Compute the dimensionless force ∫Π(cos ψ, sin ψ)dψ, ``out`` (2,), along and across the line of centres."""
    n = N_NODES
    film_pressure(eps, v_r, v_t, kappa2, nodes, work, zone)
    delta = 2.0 * math.pi / n
    o_sin, o_jac, o_c, o_s = n, 2 * n, 6 * n, 7 * n
    first = int(zone[0])
    d_cc = 0.0
    d_cs = 0.0
    d_ss = 0.0
    for k in range(int(zone[1])):
        i = first + k
        if i >= n:
            i -= n
        c = work[o_c + i]
        s = work[o_s + i]
        weight = work[o_jac + i] * delta
        d_cc += c * work[i] * weight
        d_cs += s * work[i] * weight
        d_ss += s * work[o_sin + i] * weight
    out[0] = v_r * d_cc + v_t * d_cs
    out[1] = v_r * d_cs + v_t * d_ss


@kernel
def friction_torque(eps, force, place, bearing, speed):
    """Return the friction torque on the journal (N m, negative if braking): shear of the full annulus plus half e × F.

    Only the first two entries of ``force`` (N) and ``place`` (m) are used; ``bearing`` holds the parameters of
    :mod:`cranktrain.film.laws.parameters`; ``speed`` is the speed of the journal against the bore (rad/s).
    The torques on journal and shell differ by e × F; the formula is the classical one for a film that stays filled.
    """
    radius = bearing[RADIUS]
    limited = eps if eps < ECCENTRICITY_MAX else ECCENTRICITY_MAX
    petroff = 2.0 * math.pi * bearing[VISCOSITY] * radius * radius * radius * bearing[WIDTH] * speed
    shear = petroff / bearing[CLEARANCE] / math.sqrt(1.0 - limited * limited)
    return -shear - 0.5 * (place[0] * force[1] - place[1] * force[0])


@kernel
def film_observables(v_r, v_t, work, zone):
    """Return the dimensionless largest pressure max Π and side flow ∫H³ Π dψ of the last ``film_pressure`` solution."""
    n = N_NODES
    highest = 0.0
    flow = 0.0
    first = int(zone[0])
    for k in range(int(zone[1])):
        i = first + k
        if i >= n:
            i -= n
        p = v_r * work[6 * n + i] + v_t * work[7 * n + i]
        if p > highest:
            highest = p
        h = work[3 * n + i]
        flow += h * h * h * p * work[2 * n + i] * (2.0 * math.pi / n)
    return highest, flow
