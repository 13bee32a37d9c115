"""Impedance map of a plain bearing: film force as a smooth function of eccentricity and squeeze direction.

The force of an ungrooved film is homogeneous in the velocity of pure squeeze v = ė − ½(ω_j + ω_b) e_z×e, so that its
dimensionless impedance depends on two numbers only: the eccentricity ε and the angle γ of v to the line of centres,

    F = −10 η R L (R/c)² (|v|/c) M(ε, γ) [cos(φ_v + β(ε, γ)), sin(φ_v + β(ε, γ))]

    p_max = 15 η (R/c)² (|v|/c) exp(p̂),   side flow = 10 R³/L |v| exp(q̂)

(the mobility and impedance methods of Booker and of Childs, Moes & van Leeuwen, J. Lubr. Technol. 99, 1977). ln M, β, p̂
and q̂ are sampled from the film of :mod:`cranktrain.film.laws.parabolic` for one width-to-diameter ratio and
interpolated by bicubic B-splines, twice continuously differentiable, over x = −ln(1 − 0.97 ε) and γ. Tangents are the
exact derivatives of that interpolation. tests/properties/test_film_impedance.py states its error against the film
solved online.

If the film is thinner than ``contact_height`` the surfaces carry load by contact: N = ½ p_c L D [(h_c − h)/h_c]². This
simplified contact keeps a journal at rest or under overload in its bore.
"""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cranktrain.core.kernel import inlined_kernel, kernel, law_kernel, record_reader
from cranktrain.core.lanes import put_four
from cranktrain.core.reduced_body import Array
from cranktrain.core.spline import (
    BY_ALONG,
    BY_AROUND,
    SECOND,
    SECOND_BY_ALONG,
    SECOND_BY_AROUND,
    VALUE,
    circulant,
    cubic,
    not_a_knot,
    wrapped,
)
from cranktrain.core.vectors import load, pack, unpack
from cranktrain.film.laws.films import (
    FLOW,
    FRICTION,
    GAP,
    OBSERVE,
    P_MAX,
    PLANE_BY_PLACE,
    PLANE_BY_VELOCITY,
    PLANE_ECCENTRICITY,
    RUBBING,
    SPEED,
    widen,
)
from cranktrain.film.laws.parabolic import (
    ECCENTRICITY_MAX,
    WORK_SIZE,
    film_force,
    film_geometry,
    film_observables,
    friction_torque,
    node_table,
)
from cranktrain.film.laws.parameters import (
    CLEARANCE,
    CONTACT_HEIGHT,
    CONTACT_LOAD,
    FACTOR,
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
"""Least eccentricity used in the angular rate of the line of centres, which is singular for a centred journal."""
LN_FORCE, TURN, LN_PRESSURE, LN_FLOW, N_FUNCTIONS = range(5)
"""Indices of the functions of the map: ln M (force), β (direction), ln of pressure p̂ and of side flow q̂."""


class MapFilm(NamedTuple):
    """Constants of one film whose force is read from the impedance map."""

    clearance: float  # m, radial
    factor: float  # 10 η R L (R/c)², N s
    contact_height: float  # m
    contact_load: float  # ½ p_c L D, N
    table: Array  # spline coefficients, see :func:`impedance_map`


class ImpedanceFilms(NamedTuple):
    """Data of b films that differ in viscosity only."""

    parameters: Array  # (b, COLUMNS) see film.laws.parameters
    table: Array  # spline coefficients, see :func:`impedance_map`
    plane: Array  # (16,) scratch for the result of a film without tilt


def impedance_films(bearings: Bearings) -> ImpedanceFilms:
    """Make films of main bearings or big ends, with their impedance map."""
    plain = bearings.plain
    _, kappa2, _ = film_geometry(plain.diameter, plain.width, plain.clearance, 1.0)
    return ImpedanceFilms(bearings.parameters, impedance_map(kappa2), np.zeros(16))


@cache
def impedance_map(kappa2: float) -> Array:
    """Return spline coefficients of ln M, β, p̂ and q̂, (4, N_ECCENTRICITY + 2, N_ANGLE + 3), for κ² = 10 (R/L)².

    The map is computed once per process; later calls return the same array.
    """
    eps = (1.0 - np.exp(-_DX * np.arange(N_ECCENTRICITY))) / STRETCH
    values = np.empty((N_FUNCTIONS, N_ECCENTRICITY, N_ANGLE))
    eps = np.minimum(eps, ECCENTRICITY_MAX)
    _sample(eps, kappa2, node_table(), np.zeros(WORK_SIZE), np.zeros(2), np.zeros(2), values)
    return np.ascontiguousarray([_spline(v) for v in values])


def _spline(values: Array) -> Array:
    """Return B-spline coefficients of samples: not-a-knot on the first axis, periodic (wrapped by 3) on the second."""
    n, periodic = values.shape
    along = np.linalg.solve(not_a_knot(n), np.concatenate([values, np.zeros((2, periodic))]))
    return np.asarray(np.linalg.solve(circulant(periodic), along.T).T[:, wrapped(periodic)])


@kernel
def _sample(eccentricities, kappa2, nodes, work, zone, force, values):
    """Fill ``values`` (N_FUNCTIONS, n_ε, n_γ) at every eccentricity and angle; mirrored about the line of centres."""
    n = values.shape[2]
    for i in range(eccentricities.shape[0]):
        for j in range(n // 2 + 1):
            gamma = j * _DG
            zone[:] = 0.0
            film_force(eccentricities[i], math.cos(gamma), math.sin(gamma), kappa2, nodes, work, zone, force)
            beta = math.atan2(force[1], force[0]) - gamma
            if j == 0 or 2 * j == n:
                beta = 0.0
            highest, flow = film_observables(math.cos(gamma), math.sin(gamma), work, zone)
            back = (n - j) % n
            values[TURN, i, j] = beta
            values[TURN, i, back] = -beta
            for at in (j, back):
                values[LN_FORCE, i, at] = 0.5 * math.log(force[0] * force[0] + force[1] * force[1])
                values[LN_PRESSURE, i, at] = math.log(highest)
                values[LN_FLOW, i, at] = math.log(flow)


@kernel
def impedance(eps, gamma, table, first, out):
    """Evaluate map functions ``first``, ``first + 1`` and derivatives by ε and γ, ``out[0:6]`` as in ``bicubic``."""
    x = -math.log(1.0 - STRETCH * eps) / _DX
    i = int(x)
    if i > N_ECCENTRICITY - 2:
        i = N_ECCENTRICITY - 2
    y = gamma / _DG
    y -= N_ANGLE * math.floor(y / N_ANGLE)
    j = int(y)
    if j > N_ANGLE - 1:
        j = N_ANGLE - 1
    read_two(table, first, i, j, cubic(x - i, 1.0), cubic(y - j, 1.0), out)
    slope = STRETCH / (1.0 - STRETCH * eps) / _DX
    out[BY_ALONG] *= slope
    out[BY_AROUND] /= _DG
    out[SECOND_BY_ALONG] *= slope
    out[SECOND_BY_AROUND] /= _DG


@kernel
def read_two(table, first, i, j, along, around, out):
    """Evaluate two splines like :func:`~cranktrain.core.spline.bicubic`, with sums vectorised along γ."""
    a0, a1, a2, a3, d0, d1, d2, d3 = along
    b0, b1, b2, b3, e0, e1, e2, e3 = around
    weights = pack(b0, b1, b2, b3)
    slopes = pack(e0, e1, e2, e3)
    for k in range(2):
        c0 = load(table, (first + k, i, j))
        c1 = load(table, (first + k, i + 1, j))
        c2 = load(table, (first + k, i + 2, j))
        c3 = load(table, (first + k, i + 3, j))
        line = a0 * c0 + a1 * c1 + (a2 * c2 + a3 * c3)
        steep = d0 * c0 + d1 * c1 + (d2 * c2 + d3 * c3)
        out[3 * k] = lane_sum(weights * line)
        out[3 * k + 1] = lane_sum(weights * steep)
        out[3 * k + 2] = lane_sum(slopes * line)


@inlined_kernel
def lane_sum(vector):
    """Return the sum of the four entries of a vector."""
    a, b, c, d = unpack(vector)
    return a + b + (c + d)


@kernel
def journal_force(x, y, vx, vy, half_speed, film, out):
    """Compute force and tangents of a journal at (x, y) with velocity (vx, vy), in axes fixed to the bore.

    ``half_speed`` is half the sum of the surface speeds (rad/s); ``film`` a MapFilm. ``out`` (≥ 11,): force (N), and
    from PLANE_BY_PLACE and PLANE_BY_VELOCITY on ∂F/∂(x, y) and ∂F/∂(vx, vy), row-major; PLANE_ECCENTRICITY.
    """
    c, factor, contact_height, contact_load, table = film
    # Velocity of pure squeeze.
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
    impedance(ECCENTRICITY_MAX if frozen else eps, gamma, table, LN_FORCE, out)
    magnitude = factor / c * math.exp(out[VALUE])
    cos = math.cos(out[SECOND])
    sin = math.sin(out[SECOND])
    # Direction of −F and the direction perpendicular to it.
    rx = cos * wx - sin * wy
    ry = sin * wx + cos * wy
    f = -size * magnitude
    fx = f * rx
    fy = f * ry
    # Derivatives by the velocity, through its magnitude and direction.
    ax = -magnitude * rx
    ay = -magnitude * ry
    turn = 1.0 + out[SECOND_BY_AROUND]
    bx = -magnitude * (out[BY_AROUND] * rx - turn * ry)
    by = -magnitude * (out[BY_AROUND] * ry + turn * rx)
    d_xx = ax * wx - bx * wy
    d_xy = ax * wy + bx * wx
    d_yx = ay * wx - by * wy
    d_yy = ay * wy + by * wx
    # Derivatives by the position, through eccentricity and direction of the line of centres.
    px = 0.0
    py = 0.0
    if not frozen:
        px = f / c * (out[BY_ALONG] * rx - out[SECOND_BY_ALONG] * ry)
        py = f / c * (out[BY_ALONG] * ry + out[SECOND_BY_ALONG] * rx)
    arm = e if eps > CENTRED else CENTRED * c
    qx = -f / arm * (out[BY_AROUND] * rx - out[SECOND_BY_AROUND] * ry)
    qy = -f / arm * (out[BY_AROUND] * ry + out[SECOND_BY_AROUND] * rx)
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
    by_place = k_xx - half_speed * d_xy, k_xy + half_speed * d_xx, k_yx - half_speed * d_yy, k_yy + half_speed * d_yx
    put_four(out, PLANE_BY_PLACE, by_place)
    put_four(out, PLANE_BY_VELOCITY, (d_xx, d_xy, d_yx, d_yy))
    out[PLANE_ECCENTRICITY] = eps


@kernel
def pressure_and_flow(place, velocity, half_speed, bearing, table, out):
    """Return the largest pressure (Pa) and side flow (m³/s, both ends together) of a film read from the map.

    ``bearing`` are the parameters of :mod:`cranktrain.film.laws.parameters`; ``out`` (6,) is scratch.
    """
    x = place[0]
    y = place[1]
    c = bearing[CLEARANCE]
    radius = bearing[RADIUS]
    sx = velocity[0] + half_speed * y
    sy = velocity[1] - half_speed * x
    size = math.sqrt(sx * sx + sy * sy)
    eps = math.sqrt(x * x + y * y) / c
    gamma = math.atan2(x * sy - y * sx, x * sx + y * sy)
    impedance(ECCENTRICITY_MAX if eps > ECCENTRICITY_MAX else eps, gamma, table, LN_PRESSURE, out)
    highest = 15.0 * bearing[VISCOSITY] * (radius / c) ** 2 * size / c * math.exp(out[VALUE])
    return highest, 10.0 * radius**3 / bearing[WIDTH] * size * math.exp(out[SECOND])


_read = record_reader(ImpedanceFilms(np.zeros((1, 1)), np.zeros((1, 1, 1)), np.zeros(1)))


@law_kernel
def impedance_law(record, action, i, place, velocity, numbers, memory, out):
    """Kernel of level ``impedance``, see :mod:`cranktrain.film.laws.films`; a round bore needs no rotation of axes."""
    films = _read(record)
    own = films.parameters[i]
    half = 0.5 * numbers[SPEED]
    plane = films.plane
    film = MapFilm(own[CLEARANCE], own[FACTOR], own[CONTACT_HEIGHT], own[CONTACT_LOAD], films.table)
    journal_force(place[0], place[1], velocity[0], velocity[1], half, film, plane)
    widen(plane, out)
    out[FRICTION] = friction_torque(plane[PLANE_ECCENTRICITY], out, place, own, numbers[RUBBING])
    if action == OBSERVE:
        out[P_MAX], out[FLOW] = pressure_and_flow(place, velocity, half, own, films.table, plane)
        out[GAP] = -1.0
    return 0
