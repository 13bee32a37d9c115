"""Impedance map of a plain bearing: the film force as a smooth function of eccentricity and direction of squeeze.

The force of an ungrooved film is homogeneous in the velocity of pure squeeze v = ė − ½(ω_j + ω_b) e_z×e, so that its
dimensionless impedance depends on two numbers only: the eccentricity ε and the angle γ of v to the line of centres,

    F = −10 η R L (R/c)² (|v|/c) M(ε, γ) [cos(φ_v + β(ε, γ)), sin(φ_v + β(ε, γ))]

    p_max = 15 η (R/c)² (|v|/c) exp(p̂),   side flow = 10 R³/L |v| exp(q̂)

(the mobility and impedance methods of Booker and of Childs, Moes & van Leeuwen, J. Lubr. Technol. 99, 1977). ln M, β, p̂
and q̂ are sampled from the film of :mod:`cranktrain.film.laws.parabolic` for one width-to-diameter ratio and
interpolated by bicubic B-splines, twice continuously differentiable, over x = −ln(1 − 0.97 ε) and γ. Tangents are the
exact derivatives of that interpolation. tests/properties/test_film_impedance.py states its error against the film
solved online.

Below a film of ``contact_height`` the surfaces carry by contact: N = ½ p_c L D [(h_c − h)/h_c]², a stand-in that keeps
a journal at rest or overloaded in its bore.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cranktrain.core.kernel import kernel, law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.film.laws.films import FLOW, FRICTION, GAP, OBSERVE, P_MAX, PLANE_ECCENTRICITY, RUBBING, SPEED, widen
from cranktrain.film.laws.parabolic import (
    ECCENTRICITY_MAX,
    WORK_SIZE,
    film_force,
    film_observables,
    friction_torque,
    node_table,
)
from cranktrain.film.laws.parameters import (
    CLEARANCE,
    CONTACT_HEIGHT,
    CONTACT_LOAD,
    FACTOR,
    KAPPA2,
    RADIUS,
    VISCOSITY,
    WIDTH,
)

if TYPE_CHECKING:
    from cranktrain.film.laws.bearings import Bearings

STRETCH = 0.97
N_ECCENTRICITY = 48
N_ANGLE = 96
_X_MAX = -math.log(1.0 - STRETCH * ECCENTRICITY_MAX)
_DX = _X_MAX / (N_ECCENTRICITY - 1)
_DG = 2.0 * math.pi / N_ANGLE
CENTRED = 1.0e-3
"""Below this eccentricity the line of centres has no direction to speak of: its turning is taken at this radius."""


class ImpedanceFilms(NamedTuple):
    """Data of b films, alike but for their viscosity."""

    parameters: Array  # (b, COLUMNS)
    table: Array  # see :func:`impedance_map`
    plane: Array  # (16,) scratch


def impedance_films(bearings: Bearings) -> ImpedanceFilms:
    """Films of main bearings or big ends, with their map."""
    parameters = bearings.parameters
    return ImpedanceFilms(parameters, impedance_map(float(parameters[0, KAPPA2])), np.zeros(16))


def impedance_map(kappa2: float) -> Array:
    """Spline coefficients of ln M, β, p̂ and q̂, (4, N_ECCENTRICITY + 2, N_ANGLE + 3), for κ² = 10 (R/L)²."""
    eps = (1.0 - np.exp(-_DX * np.arange(N_ECCENTRICITY))) / STRETCH
    values = np.empty((4, N_ECCENTRICITY, N_ANGLE))
    _sample(np.minimum(eps, ECCENTRICITY_MAX), kappa2, node_table(), np.zeros(WORK_SIZE), np.zeros(12), values)
    return np.ascontiguousarray([_spline(v) for v in values])


def _spline(values: Array) -> Array:
    """B-spline coefficients of samples: not-a-knot along the first axis, periodic (wrapped by 3) along the second."""
    n, periodic = values.shape
    rows = np.zeros((n + 2, n + 2))
    for i in range(n):
        rows[i, i : i + 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]
    # The third derivative has no jump at the second and the last but one sample.
    jump = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
    rows[n, :5] = jump
    rows[n + 1, -5:] = jump
    along = np.linalg.solve(rows, np.concatenate([values, np.zeros((2, periodic))]))
    row = np.zeros(periodic)
    row[[0, 1, -1]] = [4.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0]
    circulant = np.array([np.roll(row, i) for i in range(periodic)])
    around = np.linalg.solve(circulant, along.T).T
    return np.concatenate([around[:, -1:], around, around[:, :2]], axis=1)


@kernel
def _sample(eccentricities, kappa2, nodes, work, force, values):
    """Fill the four functions at every eccentricity and angle; mirrored about the line of centres."""
    n = values.shape[2]
    for i in range(eccentricities.shape[0]):
        for j in range(n // 2 + 1):
            gamma = j * _DG
            force[10] = 0.0
            force[11] = 0.0
            film_force(eccentricities[i], math.cos(gamma), math.sin(gamma), kappa2, nodes, work, force[10:12], force)
            beta = math.atan2(force[1], force[0]) - gamma
            if j == 0 or 2 * j == n:
                beta = 0.0
            values[0, i, j] = 0.5 * math.log(force[0] * force[0] + force[1] * force[1])
            values[1, i, j] = beta
            values[0, i, (n - j) % n] = values[0, i, j]
            values[1, i, (n - j) % n] = -beta
            highest, flow = film_observables(math.cos(gamma), math.sin(gamma), work, force[10:12])
            values[2, i, j] = math.log(highest)
            values[3, i, j] = math.log(flow)
            values[2, i, (n - j) % n] = values[2, i, j]
            values[3, i, (n - j) % n] = values[3, i, j]


@kernel
def impedance(eps, gamma, table, first, out):
    """Two functions of the map from ``first`` on, with derivatives by ε and γ: ``out[0:6]`` = f, ∂ε, ∂γ, g, ∂ε, ∂γ."""
    x = -math.log(1.0 - STRETCH * eps) / _DX
    i = int(x)
    if i > N_ECCENTRICITY - 2:
        i = N_ECCENTRICITY - 2
    t = x - i
    y = gamma / _DG
    y -= N_ANGLE * math.floor(y / N_ANGLE)
    j = int(y)
    if j > N_ANGLE - 1:
        j = N_ANGLE - 1
    s = y - j
    r = 1.0 - t
    a0 = r * r * r / 6.0
    a1 = (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0
    a3 = t * t * t / 6.0
    a2 = 1.0 - a0 - a1 - a3
    d0 = -0.5 * r * r
    d1 = t * (1.5 * t - 2.0)
    d3 = 0.5 * t * t
    d2 = -d0 - d1 - d3
    r = 1.0 - s
    b0 = r * r * r / 6.0
    b1 = (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0
    b3 = s * s * s / 6.0
    b2 = 1.0 - b0 - b1 - b3
    e0 = -0.5 * r * r
    e1 = s * (1.5 * s - 2.0)
    e3 = 0.5 * s * s
    e2 = -e0 - e1 - e3
    slope = STRETCH / (1.0 - STRETCH * eps) / _DX
    for k in range(2):
        value = 0.0
        by_x = 0.0
        by_y = 0.0
        for m in range(4):
            a = a0 if m == 0 else (a1 if m == 1 else (a2 if m == 2 else a3))
            d = d0 if m == 0 else (d1 if m == 1 else (d2 if m == 2 else d3))
            c0 = table[first + k, i + m, j]
            c1 = table[first + k, i + m, j + 1]
            c2 = table[first + k, i + m, j + 2]
            c3 = table[first + k, i + m, j + 3]
            line = b0 * c0 + b1 * c1 + b2 * c2 + b3 * c3
            value += a * line
            by_x += d * line
            by_y += a * (e0 * c0 + e1 * c1 + e2 * c2 + e3 * c3)
        out[3 * k] = value
        out[3 * k + 1] = by_x * slope
        out[3 * k + 2] = by_y / _DG


@kernel
def journal_force(x, y, vx, vy, half_speed, c, factor, contact_height, contact_load, table, out):
    """Force on a journal at (x, y) moving at (vx, vy) in axes at rest with the bore, with its tangents.

    ``half_speed`` is half the sum of the surface speeds (rad/s); ``factor`` 10 η R L (R/c)²; ``contact_load``
    ½ p_c L D. ``out[0:2]`` force (N); ``out[2:6]`` ∂F/∂(x, y); ``out[6:10]`` ∂F/∂(vx, vy), row-major; ``out[10]``
    eccentricity.
    """
    # The velocity of pure squeeze, as the film sees it.
    sx = vx + half_speed * y
    sy = vy - half_speed * x
    e = math.sqrt(x * x + y * y)
    nx = 1.0
    ny = 0.0
    if e > 0.0:
        nx = x / e
        ny = y / e
    eps = e / c
    size = math.sqrt(sx * sx + sy * sy)
    wx = 1.0
    wy = 0.0
    if size > 0.0:
        wx = sx / size
        wy = sy / size
    gamma = math.atan2(nx * wy - ny * wx, nx * wx + ny * wy)
    frozen = eps > ECCENTRICITY_MAX
    impedance(ECCENTRICITY_MAX if frozen else eps, gamma, table, 0, out)
    magnitude = factor / c * math.exp(out[0])
    cos = math.cos(out[3])
    sin = math.sin(out[3])
    # Direction of −F and the one across it.
    rx = cos * wx - sin * wy
    ry = sin * wx + cos * wy
    f = -size * magnitude
    fx = f * rx
    fy = f * ry
    # By the velocity: its length and its turning.
    ax = -magnitude * rx
    ay = -magnitude * ry
    turn = 1.0 + out[5]
    bx = -magnitude * (out[2] * rx - turn * ry)
    by = -magnitude * (out[2] * ry + turn * rx)
    d_xx = ax * wx - bx * wy
    d_xy = ax * wy + bx * wx
    d_yx = ay * wx - by * wy
    d_yy = ay * wy + by * wx
    # By the position: eccentricity and turning of the line of centres.
    px = 0.0
    py = 0.0
    if not frozen:
        px = f / c * (out[1] * rx - out[4] * ry)
        py = f / c * (out[1] * ry + out[4] * rx)
    arm = e if eps > CENTRED else CENTRED * c
    qx = -f / arm * (out[2] * rx - out[5] * ry)
    qy = -f / arm * (out[2] * ry + out[5] * rx)
    k_xx = px * nx - qx * ny
    k_xy = px * ny + qx * nx
    k_yx = py * nx - qy * ny
    k_yy = py * ny + qy * nx
    gap = c - e
    if gap < contact_height:
        depth = (contact_height - gap) / contact_height
        normal = contact_load * depth * depth
        fx -= normal * nx
        fy -= normal * ny
        radial = -2.0 * contact_load * depth / contact_height
        across = -normal / e
        k_xx += radial * nx * nx + across * ny * ny
        k_xy += (radial - across) * nx * ny
        k_yx += (radial - across) * nx * ny
        k_yy += radial * ny * ny + across * nx * nx
    out[0] = fx
    out[1] = fy
    # The velocity of pure squeeze depends on the position through the surface speeds.
    out[2] = k_xx - half_speed * d_xy
    out[3] = k_xy + half_speed * d_xx
    out[4] = k_yx - half_speed * d_yy
    out[5] = k_yy + half_speed * d_yx
    out[6] = d_xx
    out[7] = d_xy
    out[8] = d_yx
    out[9] = d_yy
    out[10] = eps


@kernel
def pressure_and_flow(x, y, vx, vy, half_speed, c, viscosity, radius, width, table, out):
    """Largest pressure (Pa) and side flow (m³/s, both ends together) of the film of :func:`journal_force`."""
    sx = vx + half_speed * y
    sy = vy - half_speed * x
    size = math.sqrt(sx * sx + sy * sy)
    eps = math.sqrt(x * x + y * y) / c
    gamma = math.atan2(x * sy - y * sx, x * sx + y * sy)
    impedance(ECCENTRICITY_MAX if eps > ECCENTRICITY_MAX else eps, gamma, table, 2, out)
    highest = 15.0 * viscosity * (radius / c) ** 2 * size / c * math.exp(out[0])
    return highest, 10.0 * radius**3 / width * size * math.exp(out[3])


_read = record_reader(ImpedanceFilms(np.zeros((1, 1)), np.zeros((1, 1, 1)), np.zeros(1)))


@law_kernel
def impedance_law(record, action, i, place, velocity, numbers, memory, out):
    """The law of the map, see :mod:`cranktrain.film.laws.films`: a round bore looks the same from every side."""
    films = _read(record)
    own = films.parameters[i]
    x = place[0]
    y = place[1]
    vx = velocity[0]
    vy = velocity[1]
    c = own[CLEARANCE]
    radius = own[RADIUS]
    width = own[WIDTH]
    viscosity = own[VISCOSITY]
    half = 0.5 * numbers[SPEED]
    plane = films.plane
    journal_force(
        x, y, vx, vy, half, c, own[FACTOR], own[CONTACT_HEIGHT], own[CONTACT_LOAD], films.table, plane,
    )  # fmt: skip
    widen(plane, out)
    out[FRICTION] = friction_torque(
        plane[PLANE_ECCENTRICITY], out[0], out[1], x, y, viscosity, radius, width, c, numbers[RUBBING]
    )
    if action == OBSERVE:
        out[P_MAX], out[FLOW] = pressure_and_flow(x, y, vx, vy, half, c, viscosity, radius, width, films.table, plane)
        out[GAP] = -1.0
    return 0
