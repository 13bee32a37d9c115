"""Fast plain-bearing film: Reynolds' equation around the circumference with a parabolic axial profile.

With p(ψ, z) = P(ψ) [1 − (2z/L)²] Galerkin's method over the width turns Reynolds' equation for the film
h = c (1 − ε cos ψ) into one line,

    −(H³ Π')' + κ² H³ Π = v_r cos ψ + v_t sin ψ,   Π ≥ 0,   κ² = 10 (R/L)²,   P = 15 η (R/c)² Π,

ψ counted from the line of centres (least film) in the sense of rotation, H = h/c, v = ė* / c the velocity of pure
squeeze, i.e. the journal centre's velocity seen from a frame turning at half the sum of the surface speeds. Rupture and
reformation follow Reynolds' condition (linear complementarity, solved exactly by an active set on a tridiagonal
matrix). The force on the journal is F = −10 η R L (R/c)² ∫ Π (cos ψ, sin ψ) dψ.

Assumptions: aligned journal, no groove, ambient pressure at both ends, constant viscosity. Against the two-dimensional
equation the force is within 1 % up to ε = 0.95 for L/D ≤ 0.5 (tests/literature/test_impedance_film.py). The nodes are
graded towards the least film by Sommerfeld's substitution cos ψ = (cos γ + m)/(1 + m cos γ) with m = 0.8 ε, so that
few suffice. Source of the axial profile: the classical short-to-finite Galerkin approximation (Warner 1963 uses its
exact axial mode).

Below a film of ``contact_height`` the surfaces carry by contact: N = ½ p_c L D [(h_c − h)/h_c]², a stand-in that keeps
a journal at rest or overloaded in its bore.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.kernel import kernel

N_NODES = 48
"""Circumferential nodes; 48 graded nodes are within 0.1 % of 384 (benchmarks/film_nodes.py)."""
GRADING = 0.8
ECCENTRICITY_MAX = 0.999
"""The film is frozen beyond this eccentricity; contact carries there."""
WORK_SIZE = 14 * N_NODES + 2


def film_geometry(diameter: float, width: float, clearance: float, viscosity: float) -> tuple[float, float, float]:
    """Return the constants of one film: clearance c (m), κ² and force factor 10 η R L (R/c)² (N s)."""
    radius = 0.5 * diameter
    kappa2 = 10.0 * (radius / width) ** 2
    return clearance, kappa2, 10.0 * viscosity * radius * width * (radius / clearance) ** 2


def node_table() -> np.ndarray:
    """Cosines and sines of the N nodes and N faces on the unit circle, (4, N): the grid before grading."""
    gamma = 2.0 * math.pi * np.arange(N_NODES) / N_NODES
    half = math.pi / N_NODES
    return np.ascontiguousarray([np.cos(gamma), np.sin(gamma), np.cos(gamma + half), np.sin(gamma + half)])


@kernel
def _solve_zone(first, count, v_r, v_t, work):
    """Solve both unit problems on one zone of nodes; returns whether the zone stands: 0 yes, else a changed zone."""
    n = N_NODES
    delta = 2.0 * math.pi / n
    o_cos, o_sin, o_jac, o_face, o_mass = 0, n, 2 * n, 4 * n, 6 * n
    o_c, o_s, o_up = 8 * n, 9 * n, 10 * n
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
    # Shrink at ends that carry tension, else grow where a neighbour would be pushed to positive pressure.
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
    """Solve the film; ``zone[0:2]`` is the first guess and then the result (first node, number of nodes).

    Leaves in ``work``: cos ψ, sin ψ, dψ/dγ at nodes (0, N, 2N), h³/J at faces (4N), 3H²-factors, and the two unit
    solutions λ_c, λ_s (8N, 9N); Π = v_r λ_c + v_t λ_s inside the zone. Returns the number of active-set passes.
    """
    n = N_NODES
    m = GRADING * eps
    root = math.sqrt(1.0 - m * m)
    o_sin, o_jac, o_film, o_face, o_facefilm, o_mass, o_fcos = n, 2 * n, 3 * n, 4 * n, 5 * n, 6 * n, 7 * n
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
        d = 1.0 / (1.0 + m * nodes[2, i])
        cos_psi = (nodes[2, i] + m) * d
        film = 1.0 - eps * cos_psi
        work[o_fcos + i] = cos_psi
        work[o_facefilm + i] = film
        work[o_face + i] = film * film * film / (root * d)
    first = int(zone[0])
    count = int(zone[1])
    if count < 1 or count >= n or first < 0 or first >= n:
        # Cold start: the half circle that the surfaces approach, found in ψ = direction of the velocity ± 90°.
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
    """Dimensionless film force ∫Π(cos ψ, sin ψ)dψ with tangents, on axes along and across the line of centres.

    ``out[0:2]`` force; ``out[2:6]`` derivatives by (v_r, v_t), row-major; ``out[6:10]`` by (ε_r, ε_t), row-major.
    """
    n = N_NODES
    film_pressure(eps, v_r, v_t, kappa2, nodes, work, zone)
    delta = 2.0 * math.pi / n
    o_sin, o_jac, o_film, o_facefilm, o_fcos = n, 2 * n, 3 * n, 5 * n, 7 * n
    o_c, o_s = 8 * n, 9 * n
    first = int(zone[0])
    count = int(zone[1])
    root = math.sqrt(1.0 - (GRADING * eps) ** 2)
    d_cc = 0.0
    d_cs = 0.0
    d_ss = 0.0
    k_cr = 0.0
    k_ct = 0.0
    k_sr = 0.0
    k_st = 0.0
    c_before = 0.0
    s_before = 0.0
    for k in range(count + 1):
        i = first + k
        if i >= n:
            i -= n
        if k < count:
            c = work[o_c + i]
            s = work[o_s + i]
        else:
            c = 0.0
            s = 0.0
        # Face between the node before and this one.
        f = i - 1 if i > 0 else n - 1
        film = work[o_facefilm + f]
        d = 1.0 + GRADING * eps * nodes[2, f]
        factor = 3.0 * film * film * d / root / delta
        g_c = c - c_before
        g_s = s - s_before
        g_p = (v_r * g_c + v_t * g_s) * factor
        cos_psi = work[o_fcos + f]
        sin_psi = root * nodes[3, f] / d
        k_cr += g_p * g_c * cos_psi
        k_ct += g_p * g_c * sin_psi
        k_sr += g_p * g_s * cos_psi
        k_st += g_p * g_s * sin_psi
        if k < count:
            cos_psi = work[i]
            sin_psi = work[o_sin + i]
            jacobian = work[o_jac + i]
            film = work[o_film + i]
            weight = jacobian * delta
            d_cc += c * cos_psi * weight
            d_cs += s * cos_psi * weight
            d_ss += s * sin_psi * weight
            p = (v_r * c + v_t * s) * 3.0 * kappa2 * film * film * weight
            k_cr += p * c * cos_psi
            k_ct += p * c * sin_psi
            k_sr += p * s * cos_psi
            k_st += p * s * sin_psi
        c_before = c
        s_before = s
    out[0] = v_r * d_cc + v_t * d_cs
    out[1] = v_r * d_cs + v_t * d_ss
    out[2] = d_cc
    out[3] = d_cs
    out[4] = d_cs
    out[5] = d_ss
    out[6] = k_cr
    out[7] = k_ct
    out[8] = k_sr
    out[9] = k_st


@kernel
def journal_force(x, y, vx, vy, half_speed, c, kappa2, factor, contact_height, contact_load, nodes, work, zone, out):
    """Force on a journal at (x, y) moving at (vx, vy) in axes at rest with the bore, with its tangents.

    ``half_speed`` is half the sum of the surface speeds (rad/s); ``factor`` 10 η R L (R/c)²; ``contact_load`` ½ p_c L D.
    ``out[0:2]`` force (N); ``out[2:6]`` ∂F/∂(x, y); ``out[6:10]`` ∂F/∂(vx, vy), row-major; ``out[10]`` eccentricity.
    """
    # The velocity of pure squeeze, as the film sees it.
    sx = vx + half_speed * y
    sy = vy - half_speed * x
    e = math.sqrt(x * x + y * y)
    if e > 1.0e-12 * c:
        nx = x / e
        ny = y / e
    else:
        nx = 1.0
        ny = 0.0
    eps = e / c
    frozen = eps > ECCENTRICITY_MAX
    film_eps = ECCENTRICITY_MAX if frozen else eps
    v_r = (sx * nx + sy * ny) / c
    v_t = (-sx * ny + sy * nx) / c
    moving = v_r * v_r + v_t * v_t > 0.0
    if not moving:
        v_r = 1.0
    film_force(film_eps, v_r, v_t, kappa2, nodes, work, zone, out)
    f_r = -factor * out[0]
    f_t = -factor * out[1]
    if not moving:
        f_r = 0.0
        f_t = 0.0
        out[6] = 0.0
        out[7] = 0.0
        out[8] = 0.0
        out[9] = 0.0
    g = -factor / c
    c_rr = g * out[2]
    c_rt = g * out[3]
    c_tt = g * out[5]
    if frozen:
        k_rr = 0.0
        k_rt = 0.0
        k_tr = 0.0
        k_tt = 0.0
    else:
        k_rr = g * out[6]
        k_rt = g * out[7]
        k_tr = g * out[8]
        k_tt = g * out[9]
    gap = c - e
    if gap < contact_height:
        depth = (contact_height - gap) / contact_height
        normal = contact_load * depth * depth
        f_r -= normal
        k_rr -= 2.0 * contact_load * depth / contact_height
        k_tt -= normal / e
    out[0] = f_r * nx - f_t * ny
    out[1] = f_r * ny + f_t * nx
    # Turn the tangents from (radial, tangential) to (x, y).
    d_xx = nx * nx * c_rr - 2.0 * nx * ny * c_rt + ny * ny * c_tt
    d_xy = nx * ny * (c_rr - c_tt) + (nx * nx - ny * ny) * c_rt
    d_yy = ny * ny * c_rr + 2.0 * nx * ny * c_rt + nx * nx * c_tt
    p_xx = nx * nx * k_rr - nx * ny * (k_rt + k_tr) + ny * ny * k_tt
    p_xy = nx * ny * (k_rr - k_tt) + nx * nx * k_rt - ny * ny * k_tr
    p_yx = nx * ny * (k_rr - k_tt) - ny * ny * k_rt + nx * nx * k_tr
    p_yy = ny * ny * k_rr + nx * ny * (k_rt + k_tr) + nx * nx * k_tt
    # The velocity of pure squeeze depends on the position through the surface speeds.
    out[2] = p_xx - half_speed * d_xy
    out[3] = p_xy + half_speed * d_xx
    out[4] = p_yx - half_speed * d_yy
    out[5] = p_yy + half_speed * d_xy
    out[6] = d_xx
    out[7] = d_xy
    out[8] = d_xy
    out[9] = d_yy
    out[10] = eps


@kernel
def friction_torque(eps, fx, fy, x, y, viscosity, radius, width, c, speed):
    """Friction torque on the journal (N m, negative: it brakes): shear of the full annulus, and half of e × F.

    The torques on journal and shell differ by e × F; the formula is the classical one for a film that stays filled.
    """
    limited = eps if eps < ECCENTRICITY_MAX else ECCENTRICITY_MAX
    shear = 2.0 * math.pi * viscosity * radius * radius * radius * width * speed / (c * math.sqrt(1.0 - limited * limited))
    return -shear - 0.5 * (x * fy - y * fx)


@kernel
def film_observables(eps, v_r, v_t, viscosity, radius, width, c, nodes, work, zone):
    """Side flow (m³/s, both ends together) and highest pressure (Pa) of the film that ``film_pressure`` last solved."""
    n = N_NODES
    scale = 15.0 * viscosity * (radius / c) ** 2
    highest = 0.0
    flow = 0.0
    first = int(zone[0])
    for k in range(int(zone[1])):
        i = first + k
        if i >= n:
            i -= n
        p = scale * (v_r * work[8 * n + i] + v_t * work[9 * n + i])
        if p > highest:
            highest = p
        h = c * work[3 * n + i]
        # The axial gradient at either end is 4P/L.
        flow += h * h * h / (12.0 * viscosity) * (8.0 * p / width) * radius * work[2 * n + i] * (2.0 * math.pi / n)
    return flow, highest
