r"""Contact of the rough surfaces of a journal bearing: its resultant over the film of a tilted journal.

In a bearing every slice z of the film sees a circular gap c − e cos φ, so that its normal force per width

    N(e) = R ∫ p(c − e cos φ) cos φ dφ

depends on its eccentricity e = |(x + aζ, y + bζ)| alone, (a, b) being the displacement by tilt at the end ζ = 1. N, the
load ∫ p R dφ and the touching length are sampled once per bearing and kept in the same way; slices are then summed by
Gauss's rule over the parts of the width that touch. Pressed in deeper than 20 σ, N goes on as the cube of the depth.
Boundary friction opposes sliding with the shear stress τ₀ on the real contact and the coefficient μ on the pressure; it
acts on the journal as a torque and as a force across the line of centres.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import four, plus, put_four
from cranktrain.engine.parts import PlainBearing
from cranktrain.film.contact.asperity import (
    AREA,
    FADING,
    FRICTION,
    GAP_STEP,
    HIGHEST,
    LOWEST,
    PRESSURE,
    SHEAR,
    SIGMA,
    SMOOTH_SPEED,
    TABLE_TOP,
    Array,
    bearing_contact_constants,
    contact_integrals,
    contact_pressure,
    contact_table,
    fading,
    log_spline,
    spline_place,
    spline_value,
)

SLICES = 12
"""Gauss points on each part of the width that touches."""

# Constants of the bearing, behind those of its contact.
RADIUS, CLEARANCE, WIDTH = 5, 6, 7
# Columns of JournalContact.slices.
NORMAL, SLICE_LOAD, SLICE_TOUCHING, SLICE_SHEAR, N_COLUMNS = range(5)
# What journal_contact writes.
FORCE, STIFFNESS, TORQUE, TORQUE_BY_SLIDING, LOAD, TOUCHING, PRESSURE_MAX = 0, 4, 20, 21, 22, 23, 24
N_OUT = 25


class JournalContact(NamedTuple):
    """Rough contact of one journal bearing, for :func:`journal_contact`.

    ``constants`` (8,) are those of the contact with radius, clearance and width (m), ``table`` the integrals
    (both of :mod:`cranktrain.film.contact.asperity`), ``slices`` (n, 4) spline coefficients over (c − e)/σ of the
    logarithms of N, ∫ p R dφ (N/m), touching length ∫ s R dφ and ∫ s cos φ R dφ (m; s the share of the area that
    touches), ``gauss`` (2, SLICES) points and weights.
    """

    constants: Array
    table: Array
    slices: Array
    gauss: Array


def bearing_contact(bearing: PlainBearing, table: Array | None = None) -> JournalContact:
    """Rough contact of ``bearing``; ``table`` as for :func:`journal_contact_data`."""
    constants = bearing_contact_constants(bearing)
    return journal_contact_data(0.5 * bearing.diameter, bearing.clearance, bearing.width, constants, table)


def journal_contact_data(
    radius: float, clearance: float, width: float, constants: Array, table: Array | None = None
) -> JournalContact:
    """Sample the resultants of a slice over its eccentricity, once per bearing.

    Parameters
    ----------
    radius, clearance, width : of the bearing, m
    constants : of :func:`cranktrain.film.contact.asperity.contact_constants`
    table : of :func:`cranktrain.film.contact.asperity.contact_table`, made here where not given

    Raises
    ------
    InputError
        a clearance that the roughness of both surfaces bridges
    """
    sigma = float(constants[SIGMA])
    if not clearance > HIGHEST * sigma:
        raise InputError(
            f"asperity contact: clearance {1e6 * clearance:.4g} um is not wider than {HIGHEST:g} times the roughness, "
            f"{1e6 * HIGHEST * sigma:.4g} um; check both units"
        )
    table = contact_table() if table is None else table
    points, weights = np.polynomial.legendre.leggauss(200)
    values = np.empty((round((HIGHEST - LOWEST) / GAP_STEP) + 1, N_COLUMNS))
    of_bearing = np.concatenate([constants, [radius, clearance, width]])
    _sample_slices(of_bearing, table, points, weights, values)
    return JournalContact(of_bearing, table, log_spline(values), np.array(np.polynomial.legendre.leggauss(SLICES)))


# Kernels --------------------------------------------------------------------------------------------------------------


@kernel
def _sample_slices(constants, table, points, weights, values):
    """Resultants of a slice on the grid of (c − e)/σ, (n, 4); contact is not faded here but by :func:`_slice`."""
    sigma = constants[SIGMA]
    radius = constants[RADIUS]
    for k in range(values.shape[0]):
        least = LOWEST + GAP_STEP * k
        eccentricity = constants[CLEARANCE] - least * sigma
        top = (least if least > 0.0 else 0.0) + TABLE_TOP - HIGHEST
        # Gap over roughness: least + (e/σ)(1 − cos φ).
        cos_end = 1.0 - (top - least) * sigma / eccentricity
        end = math.acos(cos_end if cos_end > -1.0 else -1.0)
        values[k, :] = 0.0
        for i in range(points.shape[0]):
            # Both sides of the line of centres.
            phi = 0.5 * end * (points[i] + 1.0)
            weight = end * weights[i] * radius
            half = math.sin(0.5 * phi)
            f, _, f2 = contact_integrals(least + 2.0 * eccentricity / sigma * half * half, table, False)
            share = constants[AREA] * f2
            share = share if share < 1.0 else 1.0
            cos = math.cos(phi)
            values[k, NORMAL] += weight * constants[PRESSURE] * f * cos
            values[k, SLICE_LOAD] += weight * constants[PRESSURE] * f
            values[k, SLICE_TOUCHING] += weight * share
            values[k, SLICE_SHEAR] += weight * share * cos


@kernel
def _slice(gap_ratio, slices, column):
    """One resultant of a slice and its derivative by (c − e)/σ."""
    if gap_ratio >= HIGHEST:
        return 0.0, 0.0
    n = slices.shape[0]
    if gap_ratio < LOWEST:
        value, slope = spline_value(slices, column, 0, 0.0)
        # (1 + x)³ continues value and slope.
        depth = 1.0 + slope / 3.0 * (gap_ratio - LOWEST)
        value = math.exp(value)
        return value * depth * depth * depth, value * slope * depth * depth
    i, t = spline_place(gap_ratio, n)
    value, slope = spline_value(slices, column, i, t)
    value = math.exp(value)
    slope *= value
    if gap_ratio > FADING:
        weight, by_gap = fading(gap_ratio)
        slope = slope * weight + value * by_gap
        value *= weight
    return value, slope


@kernel
def journal_contact(x, y, a, b, sliding, contact, out):
    """Contact in the whole film of a journal at (x, y), tilted by (a, b) at its end ζ = 1 (m), in any axes.

    ``sliding`` is the journal's surface speed against the bore's (m/s, + in the sense of rotation); 0 leaves friction
    out. ``contact`` is a :class:`JournalContact`.

    Fills ``out`` (N_OUT,): from FORCE on the forces on the journal (F_x, F_y, Q_x, Q_y), Q = ∫ ζ dF conjugate to the
    displacement of the end (all N); from STIFFNESS on their derivatives by (x, y, a, b), row-major (N/m); TORQUE of
    friction on it (N m, + in the sense of rotation), TORQUE_BY_SLIDING (N s); LOAD ∫ p dA (N); TOUCHING, the area that
    truly touches (m²); PRESSURE_MAX (Pa).
    """
    out[:N_OUT] = 0.0
    constants = contact.constants
    reach = constants[CLEARANCE] - HIGHEST * constants[SIGMA]
    end2 = x * x + y * y + (a * a + b * b) + 2.0 * abs(x * a + y * b)
    if end2 <= reach * reach:
        return
    out[PRESSURE_MAX] = contact_pressure(constants[CLEARANCE] - math.sqrt(end2), constants, contact.table)[0]
    speed = math.sqrt(sliding * sliding + SMOOTH_SPEED * SMOOTH_SPEED)
    sign = sliding / speed
    near, far = _untouched((x, y, a, b), reach, constants[CLEARANCE])
    friction = 0.0
    for side in range(2):
        begin = -1.0 if side == 0 else far
        end = near if side == 0 else 1.0
        if end <= begin:
            continue
        for i in range(contact.gauss.shape[1]):
            zeta = begin + 0.5 * (end - begin) * (contact.gauss[0, i] + 1.0)
            # dz = ½ L dζ
            weight = 0.25 * constants[WIDTH] * (end - begin) * contact.gauss[1, i]
            friction += _add_slice(x + a * zeta, y + b * zeta, zeta, weight, sign, contact, out)
    out[TORQUE] = -sign * constants[RADIUS] * friction
    out[TORQUE_BY_SLIDING] = -constants[RADIUS] * friction * SMOOTH_SPEED * SMOOTH_SPEED / (speed * speed * speed)


@kernel
def _untouched(place, reach, c):
    """Between which ζ nothing touches: each side of the place nearest to the centre touches from some ζ to its end."""
    x, y, a, b = place
    tilt2 = a * a + b * b
    if not tilt2 > 1.0e-18 * c * c:
        return 1.0, 1.0
    cross = x * a + y * b
    middle = -cross / tilt2
    middle = -1.0 if middle < -1.0 else (1.0 if middle > 1.0 else middle)
    root = cross * cross - tilt2 * (x * x + y * y - reach * reach)
    if not root > 0.0:
        return middle, middle
    root = math.sqrt(root)
    return min(middle, (-cross - root) / tilt2), max(middle, (-cross + root) / tilt2)


@kernel
def _add_slice(ux, uy, zeta, weight, sign, contact, out):
    """Add a slice at (ux, uy) to what ``journal_contact`` writes; returns its friction force at a full speed, N."""
    constants = contact.constants
    slices = contact.slices
    sigma = constants[SIGMA]
    e = math.sqrt(ux * ux + uy * uy)
    gap_ratio = (constants[CLEARANCE] - e) / sigma
    if gap_ratio >= HIGHEST:
        return 0.0
    nx = ux / e
    ny = uy / e
    normal, slope = _slice(gap_ratio, slices, NORMAL)
    load, _ = _slice(gap_ratio, slices, SLICE_LOAD)
    touching, _ = _slice(gap_ratio, slices, SLICE_TOUCHING)
    normal *= weight
    slope *= -weight / sigma
    mu = constants[FRICTION] * sign
    tau = constants[SHEAR] * sign
    across = mu * normal
    across_slope = mu * slope
    if tau != 0.0:
        shear, shear_slope = _slice(gap_ratio, slices, SLICE_SHEAR)
        across += tau * weight * shear
        across_slope -= tau * weight / sigma * shear_slope
    out[LOAD] += weight * load
    out[TOUCHING] += weight * touching
    # f = −N n − T t with t across the line of centres, in the sense of rotation.
    fx = -normal * nx + across * ny
    fy = -normal * ny - across * nx
    # By a radial and by a tangential displacement of the slice.
    rx = -slope * nx + across_slope * ny
    ry = -slope * ny - across_slope * nx
    tx = (normal * ny + across * nx) / e
    ty = (-normal * nx + across * ny) / e
    put_four(out, FORCE, plus(four(out, FORCE), (fx, fy, zeta * fx, zeta * fy)))
    for row in range(2):
        for column in range(2):
            by = zeta if row != column else (zeta * zeta if row == 1 else 1.0)
            place = STIFFNESS + 8 * row + 2 * column
            out[place] += by * (rx * nx - tx * ny)
            out[place + 1] += by * (rx * ny + tx * nx)
            out[place + 4] += by * (ry * nx - ty * ny)
            out[place + 5] += by * (ry * ny + ty * nx)
    return weight * (constants[FRICTION] * load + constants[SHEAR] * touching)
