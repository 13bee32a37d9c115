r"""Resultant of the rough contact between a tilted journal and its bearing.

Every slice z of the film has a circular gap c + g − e cos φ, with the relief g(ζ) of the shell and the eccentricity
e = |(x + aζ, y + bζ)| of the slice, where (a, b) is the displacement by tilt at the end ζ = 1. The normal force per
width of a slice

    N(m, e) = R ∫ p(m + e (1 − cos φ)) cos φ dφ,    m = c + g − e,

is that of a straight shell with the same least gap m, times √((c − m)/e) = √(1 − g/e), because the contact arc is short
and scales with 1/√e (0.3 % at a relief of a seventh of the clearance). N, the load ∫ p R dφ and the contact length of
the straight shell are sampled once per bearing over m. Slices are summed by Lobatto's rule over parts of the width that
become finer towards the edges, which are points of the rule. The points do not move with the journal, so tangents are
exact derivatives of the sum. Beyond a depth of 20 σ, N is continued as the cube of the depth; if the lining yields, N
approaches the hardness over the whole diameter. Boundary friction opposes sliding with the shear stress τ₀ on the real
contact and the coefficient μ on the pressure; it acts on the journal as a torque and as a force across the line of
centres.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.lanes import four, plus, put_four
from cranktrain.engine.parts import PlainBearing
from cranktrain.film.contact import asperity as rough
from cranktrain.film.contact.asperity import (
    Array,
    bearing_contact_constants,
    contact_integrals,
    contact_pressure,
    contact_table,
    fading,
    log_spline,
    spline_place,
    spline_value,
    yielding,
)
from cranktrain.film.contact.gap import STRAIGHT, over, relief

SLICES = 16
"""Number of Lobatto points on each part of the width."""
PARTS = (0.0, 0.5, 0.85, 1.0)
"""Borders of the parts of half the width, over the relieved width; over half the width if the shell is straight."""

# Indices of a bearing's constants; the constants of its rough contact come first.
RADIUS, CLEARANCE, WIDTH, DEEP = range(rough.CONSTANTS, rough.CONSTANTS + 4)
# Rows of JournalContact.line: ζ, weight (m), relief (m) and squared eccentricity at first contact (m²) of each slice.
ZETA, WEIGHT, RELIEF, REACH2 = range(4)
# Columns of JournalContact.slices: logarithms of N, load, contact length and ∫ s cos φ R dφ, see JournalContact.
NORMAL, SLICE_LOAD, SLICE_TOUCHING, SLICE_SHEAR, N_COLUMNS = range(5)
# Indices of the result of journal_contact: force (4), stiffness (4 × 4), friction torque and its derivative, totals.
FORCE, STIFFNESS, TORQUE, TORQUE_BY_SLIDING, LOAD, TOUCHING, PRESSURE_MAX = 0, 4, 20, 21, 22, 23, 24
N_OUT = 25


class JournalContact(NamedTuple):
    """Data of the rough contact of one journal bearing, for :func:`journal_contact`.

    ``constants`` (10,): those of the contact, then radius, clearance, width (m) and the limit of the growth of N beyond
    its table, over its last value (0: no limit). ``table``: the integrals; contact constants and table are those of
    :mod:`cranktrain.film.contact.asperity`. ``slices`` (n, 4): spline coefficients over m/σ of the logarithms of N,
    ∫ p R dφ (N/m), contact length ∫ s R dφ and ∫ s cos φ R dφ (m; s is the fraction of area in contact). ``line``
    (4, k): ζ, weight (m) and relief (m) of each slice, and the squared eccentricity at which its contact begins (m²).
    """

    constants: Array
    table: Array
    slices: Array
    line: Array


def bearing_contact(bearing: PlainBearing, table: Array | None = None) -> JournalContact:
    """Make the rough contact of ``bearing``; ``table`` is a result of ``contact_table``, made here if not given."""
    constants = bearing_contact_constants(bearing)
    dimensions = 0.5 * bearing.diameter, bearing.clearance, bearing.width
    if table is not None:
        return journal_contact_data(*dimensions, constants, table, over(bearing.relief))
    made = _usual_contact(*dimensions, tuple(constants.tolist()), over(bearing.relief))
    return JournalContact(*(array.copy() for array in made))


@cache
def _usual_contact(
    radius: float, clearance: float, width: float, constants: tuple[float, ...], profile: tuple[float, float, float]
) -> JournalContact:
    """Return the contact of a bearing on the default table; cached, because an FMU build repeats it for each level."""
    return journal_contact_data(radius, clearance, width, np.array(constants), None, profile)


def journal_contact_data(
    radius: float,
    clearance: float,
    width: float,
    constants: Array,
    table: Array | None = None,
    profile: tuple[float, float, float] = STRAIGHT,
) -> JournalContact:
    """Sample the resultants of a slice over its eccentricity, once per bearing.

    Parameters
    ----------
    radius, clearance, width : of the bearing, m
    constants : of :func:`cranktrain.film.contact.asperity.contact_constants`
    table : of :func:`cranktrain.film.contact.asperity.contact_table`, made here if not given
    profile : depth (m), width fraction and exponent of the shell's relief, see :mod:`cranktrain.film.contact.gap`

    Raises
    ------
    InputError
        if the clearance is not larger than the range of contact of both surfaces
    """
    sigma = float(constants[rough.SIGMA])
    if not clearance > rough.HIGHEST * sigma:
        raise InputError(
            f"asperity contact: clearance {1e6 * clearance:.4g} um is not wider than {rough.HIGHEST:g} times the "
            f"roughness, {1e6 * rough.HIGHEST * sigma:.4g} um; check both units"
        )
    table = contact_table() if table is None else table
    of_bearing, values = slice_resultants(radius, clearance, width, constants, table)
    return JournalContact(of_bearing, table, log_spline(values), _line(of_bearing, profile))


def slice_resultants(
    radius: float, clearance: float, width: float, constants: Array, table: Array
) -> tuple[Array, Array]:
    """Return the constants of a bearing (10,), and the resultants of a slice at n least gaps m/σ, (n, N_COLUMNS).

    :func:`journal_contact_data` fits splines to the logarithms of the resultants and describes the arguments.
    """
    sigma = float(constants[rough.SIGMA])
    points, weights = _gauss_points()
    values = np.empty((round((rough.HIGHEST - rough.LOWEST) / rough.GAP_STEP) + 1, N_COLUMNS))
    # Half angle φ of the contact arc at the end of the table, from cos φ = c/(c + 20 σ).
    arc = math.sqrt(1.0 - (clearance / (clearance - rough.LOWEST * sigma)) ** 2)
    deep = 1.0 / arc - 1.0 if constants[rough.PER_HARDNESS] > 0.0 else 0.0
    of_bearing = np.concatenate([constants, [radius, clearance, width, deep]])
    _sample_slices(of_bearing, table, points, weights, values)
    return of_bearing, values


@cache
def _gauss_points() -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(200)


def _line(constants: Array, profile: tuple[float, float, float]) -> Array:
    """Return ζ, weight, relief and squared eccentricity at first contact of k slices over the width, (4, k)."""
    ends = 1.0 - profile[1] + profile[1] * np.array(PARTS)
    ends = np.unique(np.concatenate([-ends, [0.0], ends]))
    inner = np.polynomial.legendre.Legendre.basis(SLICES - 1)
    points = np.concatenate([[-1.0], np.sort(inner.deriv().roots().real), [1.0]])
    weights = 2.0 / (SLICES * (SLICES - 1) * inner(points) ** 2)
    lengths = np.diff(ends)[:, None]
    zeta = (ends[:-1, None] + 0.5 * lengths * (points + 1.0)).ravel()
    g = np.array([relief(place, profile) for place in zeta])
    reach = constants[CLEARANCE] + g - rough.HIGHEST * constants[rough.SIGMA]
    return np.array([zeta, (0.25 * constants[WIDTH] * lengths * weights).ravel(), g, reach**2])


# Kernels --------------------------------------------------------------------------------------------------------------


@kernel
def _sample_slices(constants, table, points, weights, values):
    """Compute four resultants of a slice at n values of (c − e)/σ, (n, 4). :func:`_slice` applies the fading."""
    sigma = constants[rough.SIGMA]
    radius = constants[RADIUS]
    for k in range(values.shape[0]):
        least = rough.LOWEST + rough.GAP_STEP * k
        eccentricity = constants[CLEARANCE] - least * sigma
        top = (least if least > 0.0 else 0.0) + rough.TABLE_TOP - rough.HIGHEST
        # The gap over roughness is least + (e/σ)(1 − cos φ).
        cos_end = 1.0 - (top - least) * sigma / eccentricity
        end = math.acos(cos_end if cos_end > -1.0 else -1.0)
        values[k, :] = 0.0
        for i in range(points.shape[0]):
            # The factor 2 is for both sides of the line of centres.
            phi = 0.5 * end * (points[i] + 1.0)
            weight = end * weights[i] * radius
            half = math.sin(0.5 * phi)
            f, _, f2 = contact_integrals(least + 2.0 * eccentricity / sigma * half * half, table, False)
            share = constants[rough.AREA] * f2
            share = share if share < 1.0 else 1.0
            cos = math.cos(phi)
            p, _ = yielding(constants[rough.PRESSURE] * f, constants[rough.PER_HARDNESS])
            values[k, NORMAL] += weight * p * cos
            values[k, SLICE_LOAD] += weight * p
            values[k, SLICE_TOUCHING] += weight * share
            values[k, SLICE_SHEAR] += weight * share * cos


@kernel
def _slice(gap_ratio, deep, slices, column):
    """Return a resultant of a straight shell's slice and its derivative by m/σ; ``deep`` limits it beyond the table."""
    if gap_ratio >= rough.HIGHEST:
        return 0.0, 0.0
    n = slices.shape[0]
    if gap_ratio < rough.LOWEST:
        value, slope = spline_value(slices, column, 0, 0.0)
        # Both 1 + x/(1 + x/deep) and (1 + x/3)³ continue value and slope of the table.
        value = math.exp(value)
        x = slope * (gap_ratio - rough.LOWEST)
        if deep > 0.0:
            rest = 1.0 / (1.0 + x / deep)
            return value * (1.0 + x * rest), value * slope * rest * rest
        depth = 1.0 + x / 3.0
        return value * depth * depth * depth, value * slope * depth * depth
    i, t = spline_place(gap_ratio, n)
    value, slope = spline_value(slices, column, i, t)
    value = math.exp(value)
    slope *= value
    if gap_ratio > rough.FADING:
        weight, by_gap = fading(gap_ratio)
        slope = slope * weight + value * by_gap
        value *= weight
    return value, slope


@kernel
def journal_contact(x, y, a, b, sliding, contact, out):
    """Compute the contact of a journal at (x, y) with the tilt (a, b) at its end ζ = 1 (m), in any axes.

    ``sliding`` is the surface speed of the journal relative to the bore (m/s, + in the sense of rotation); 0 means no
    friction. ``contact`` is a :class:`JournalContact`.

    Fills ``out`` (N_OUT,): from FORCE on the forces on the journal (F_x, F_y, Q_x, Q_y), Q = ∫ ζ dF conjugate to the
    displacement of the end (all N); from STIFFNESS on their derivatives by (x, y, a, b), row-major (N/m); TORQUE of
    friction on it (N m, + in the sense of rotation), TORQUE_BY_SLIDING (N s); LOAD ∫ p dA (N); TOUCHING, the real
    contact area (m²); PRESSURE_MAX (Pa).
    """
    out[:N_OUT] = 0.0
    constants = contact.constants
    line = contact.line
    reach = constants[CLEARANCE] - rough.HIGHEST * constants[rough.SIGMA]
    end2 = x * x + y * y + (a * a + b * b) + 2.0 * abs(x * a + y * b)
    if end2 <= reach * reach:
        return
    speed = math.sqrt(sliding * sliding + rough.SMOOTH_SPEED * rough.SMOOTH_SPEED)
    sign = sliding / speed
    friction = 0.0
    least = rough.HIGHEST * constants[rough.SIGMA]
    for first in range(0, line.shape[1], SLICES):
        if _apart(x, y, a, b, line, first):
            continue
        for k in range(first, first + SLICES):
            zeta = line[ZETA, k]
            ux = x + a * zeta
            uy = y + b * zeta
            e2 = ux * ux + uy * uy
            if e2 > line[REACH2, k]:
                least = min(least, constants[CLEARANCE] + line[RELIEF, k] - math.sqrt(e2))
                friction += _add_slice(ux, uy, line[:, k], sign, contact, out)
    out[PRESSURE_MAX] = contact_pressure(least, constants, contact.table)[0]
    out[TORQUE] = -sign * constants[RADIUS] * friction
    out[TORQUE_BY_SLIDING] = (
        -constants[RADIUS] * friction * rough.SMOOTH_SPEED * rough.SMOOTH_SPEED / (speed * speed * speed)
    )


@inlined_kernel
def _apart(x, y, a, b, line, first):
    """True if the part of the width that starts at slice ``first`` has no contact.

    The square of a slice's eccentricity is convex along the width, and the relief grows towards one end of a part.
    """
    last = first + SLICES - 1
    x0 = x + a * line[ZETA, first]
    y0 = y + b * line[ZETA, first]
    x1 = x + a * line[ZETA, last]
    y1 = y + b * line[ZETA, last]
    return max(x0 * x0 + y0 * y0, x1 * x1 + y1 * y1) <= min(line[REACH2, first], line[REACH2, last])


@kernel
def _add_slice(ux, uy, place, sign, contact, out):
    """Add a slice at (ux, uy) to the result of ``journal_contact``. Return its friction force at full sliding, N.

    ``place`` is its column of ``JournalContact.line``.
    """
    constants = contact.constants
    slices = contact.slices
    sigma = constants[rough.SIGMA]
    e = math.sqrt(ux * ux + uy * uy)
    zeta = place[ZETA]
    g = place[RELIEF]
    gap_ratio = (constants[CLEARANCE] + g - e) / sigma
    nx = ux / e
    ny = uy / e
    # Factor √(1 − g/e) of the contact arc against that of a straight shell, and its derivative by e.
    arc = math.sqrt(1.0 - g / e)
    weight = place[WEIGHT] * arc
    arc_slope = 0.5 * g / (e * e * arc * arc)
    deep = constants[DEEP]
    normal, slope = _slice(gap_ratio, deep, slices, NORMAL)
    load, _ = _slice(gap_ratio, deep, slices, SLICE_LOAD)
    touching, _ = _slice(gap_ratio, deep, slices, SLICE_TOUCHING)
    normal *= weight
    slope = normal * arc_slope - weight / sigma * slope
    mu = constants[rough.FRICTION] * sign
    tau = constants[rough.SHEAR] * sign
    across = mu * normal
    across_slope = mu * slope
    if tau != 0.0:
        shear, shear_slope = _slice(gap_ratio, deep, slices, SLICE_SHEAR)
        across += tau * weight * shear
        across_slope += tau * weight * (shear * arc_slope - shear_slope / sigma)
    out[LOAD] += weight * load
    out[TOUCHING] += weight * touching
    # Force f = −N n − T t, with t perpendicular to the line of centres, in the sense of rotation.
    fx = -normal * nx + across * ny
    fy = -normal * ny - across * nx
    # Derivatives by a radial and by a tangential displacement of the slice.
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
    return weight * (constants[rough.FRICTION] * load + constants[rough.SHEAR] * touching)
