"""Axial (thrust) bearing with a film on each side of the collar, and contact at gaps below the roughness.

Each side has ``pads`` pads of length B (along the mean radius) and radial width L. The film of a pad narrows linearly
by the taper δ to the least film h at its end. Reynolds' equation of a pad has one right side for wedge and squeeze,

    ∂x(H³ ∂x p) + ∂y(H³ ∂y p) = −12 η V,     V = −ḣ + U δ/(2B) + ½ U ∂h/∂s,     p = 0 around the pad,

so the damping S(h) of the pad gives the force F = S V of both. The last term of V is the tilt of the collar, by which
the film slopes along the pad. S is solved once per bearing with a sine series across the pad and finite volumes along
it, and stored as a cubic spline of h² S over ln h. The position of the collar is evaluated at the middle of each pad.

The film of an opening gap ruptures, because absolute pressure cannot be negative. Its suction is F/√(1 + (F/F_a)²),
where F_a is ambient pressure times the area of the pad. At gaps below ``contact_height`` the collar touches. Contact is
a linear spring (stiffness of the bearing in series with the block) and a damper, distributed to the pads.
docs/decisions/0012-thrust-film.md lists the neglected effects and their size.

Main bearings without clearance go with a closed thrust bearing: a spring of its own stiffness and the same damper.
Source: Hamrock, Schmid & Jacobson, Fundamentals of Fluid Film Lubrication (2004), fixed-incline slider.
"""

import math
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import kernel, law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.core.spline import not_a_knot
from cranktrain.engine.parts import ThrustBearing
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, COS, OIL, RATE, SIN, SPEED, VISCOSITY

AMBIENT = 101325.0
FILM_FLOOR = 0.2
"""Least film at which a pad is evaluated, as a fraction of the contact height; contact carries below it."""
N_FILMS = 32
"""Number of films at which a pad's damping is solved, even in ln h from the least film to twice the clearance."""

# Indices of the parameters of a thrust bearing. The N_FILMS + 2 coefficients of the damping spline begin at SPLINE.
# Two lever arms (m) for each pad begin at ARMS: axial displacement of its middle by collar rotations about x and y.
HALF, CONTACT_HEIGHT, STIFFNESS, DAMPING, PADS, SUCTION, WEDGE, LOG_FILM, LOG_STEP, SPLINE = range(10)
ARMS = SPLINE + N_FILMS + 2

# Indices of the result of :func:`thrust_force_tilted`: forces (3), tangents by position and by velocity (3 × 3 each).
TILTED_BY_PLACE, TILTED_BY_VELOCITY = 3, 12


def closed_stiffness(thrust: ThrustBearing) -> float:
    """Return the stiffness of the closed bearing, N/m: collar and shells in series with the block."""
    return 1.0 / (1.0 / thrust.closed + 1.0 / thrust.block_stiffness)


def touching_stiffness(thrust: ThrustBearing) -> float:
    """Return the contact stiffness of a run, N/m: collar and shells in series with the block."""
    return 1.0 / (1.0 / thrust.contact_stiffness + 1.0 / thrust.block_stiffness)


def pad_size(thrust: ThrustBearing) -> tuple[float, float, float]:
    """Return the mean radius, length along this radius and radial width of a pad, m."""
    radius = 0.25 * (thrust.inner_diameter + thrust.outer_diameter)
    width = 0.5 * (thrust.outer_diameter - thrust.inner_diameter)
    return radius, 2.0 * math.pi * radius * thrust.pad_fraction / thrust.pads, width


def pad_damping(films: np.ndarray, taper: float, length: float, width: float) -> np.ndarray:
    """Return the damping of a pad per viscosity, S/η (m), at each of n least film thicknesses ``films`` (m), (n,)."""
    # A shorter pad has a flatter pressure profile across its width, which needs more sine terms.
    waves = np.arange(1, 40 * math.ceil(max(1.0, width / length)), 2)[:, None]
    cells = 400
    # Pressure changes fast in a thin film, so cells are even in ln h for a large taper, and in x for a small one.
    spread = math.log1p(taper / float(np.min(films)))
    face = np.linspace(0.0, 1.0, cells + 1)
    if taper > 0.0:
        face = np.expm1(spread * face) / math.expm1(spread)
    # x starts at the least film and points against the sliding; nodes lie between the faces, p = 0 at both ends.
    node = 0.5 * (face[1:] + face[:-1])
    gap = np.diff(np.concatenate(([0.0], node, [1.0]))) * length
    film = (films[:, None] + taper * node) ** 3
    face_film = (films[:, None] + taper * face) ** 3
    along = face_film / gap
    volume = np.diff(face) * length
    across = (waves * math.pi / width)[:, :, None] ** 2 * film * volume
    diagonal = along[:, :-1] + along[:, 1:] + across
    source = 12.0 * 4.0 / (waves[:, :, None] * math.pi) * volume * np.ones_like(diagonal)
    for i in range(1, cells):
        share = along[:, i] / diagonal[:, :, i - 1]
        diagonal[:, :, i] -= share * along[:, i]
        source[:, :, i] += share * source[:, :, i - 1]
    pressure = source / diagonal
    for i in range(cells - 2, -1, -1):
        pressure[:, :, i] += along[:, i + 1] / diagonal[:, :, i] * pressure[:, :, i + 1]
    return np.asarray(((pressure @ volume) * 2.0 * width / (waves * math.pi)).sum(axis=0))


def thrust_parameters(thrust: ThrustBearing, viscosity: float) -> Array:
    """Return the parameters of one thrust bearing as the kernels read them, (ARMS + 2 pads,)."""
    radius, length, width = pad_size(thrust)
    start, step = _film_steps(thrust)
    angles = 2.0 * math.pi * (np.arange(thrust.pads) + 0.5) / thrust.pads
    return np.array(
        [
            0.5 * thrust.clearance,
            thrust.contact_height,
            touching_stiffness(thrust),
            thrust.damping,
            thrust.pads,
            AMBIENT * length * width,
            0.5 * thrust.taper * radius / length,
            start,
            step,
            *(viscosity * _damping_by_film(thrust)),
            *(radius * np.stack([np.sin(angles), -np.cos(angles)], axis=1)).ravel(),
        ]
    )


def _film_steps(thrust: ThrustBearing) -> tuple[float, float]:
    """Return the logarithm of the spline's least film (m), and the step to the next film."""
    start = math.log(FILM_FLOOR * thrust.contact_height)
    return start, (math.log(2.0 * thrust.clearance) - start) / (N_FILMS - 1)


@cache
def _damping_by_film(thrust: ThrustBearing) -> Array:
    """Return spline coefficients of h² S/η, (N_FILMS + 2,) m³, which are independent of temperature."""
    start, step = _film_steps(thrust)
    films = np.exp(start + step * np.arange(N_FILMS))
    _, length, width = pad_size(thrust)
    values = films**2 * pad_damping(films, thrust.taper, length, width)
    return np.asarray(np.linalg.solve(not_a_knot(values.size), np.append(values, (0.0, 0.0))))


class ThrustPads(NamedTuple):
    """Data of the thrust bearing."""

    parameters: Array  # (ARMS + 2 pads,) see :func:`thrust_parameters`
    tilted: Array  # (21,) result of :func:`thrust_force_tilted`
    spline: Array  # (N_FILMS + 2,) coefficients of h² S/η, m³


def closed_pads(thrust: ThrustBearing, viscosity: float) -> ThrustPads:
    """Make the closed thrust bearing: a spring of ``closed_stiffness``."""
    return thrust_pads(replace(thrust, contact_stiffness=thrust.closed), viscosity)


def thrust_pads(thrust: ThrustBearing, viscosity: float) -> ThrustPads:
    """Make the thrust bearing with oil of ``viscosity``, Pa s."""
    return ThrustPads(thrust_parameters(thrust, viscosity), np.zeros(21), _damping_by_film(thrust).copy())


@kernel
def damping_of_film(h, parameters):
    """Return the damping S (N s/m) of a pad at its least film h, and dS/dh; h² S is constant beyond the spline."""
    x = (math.log(h) - parameters[LOG_FILM]) / parameters[LOG_STEP]
    beyond = x - (N_FILMS - 1)
    if beyond < 0.0:
        beyond = 0.0
    x -= beyond
    i = int(x)
    if i > N_FILMS - 2:
        i = N_FILMS - 2
    if i < 0:
        i = 0
    t = x - i
    r = 1.0 - t
    c0 = parameters[SPLINE + i]
    c1 = parameters[SPLINE + i + 1]
    c2 = parameters[SPLINE + i + 2]
    c3 = parameters[SPLINE + i + 3]
    value = (
        r * r * r * c0 + (4.0 - 6.0 * t * t + 3.0 * t * t * t) * c1 + (4.0 - 6.0 * r * r + 3.0 * r * r * r) * c2
        + t * t * t * c3
    ) / 6.0  # fmt: skip
    slope = 0.5 * (-r * r * c0 + t * (3.0 * t - 4.0) * c1 + r * (4.0 - 3.0 * r) * c2 + t * t * c3)
    if beyond > 0.0:
        slope = 0.0
    per_h = 1.0 / h
    return value * per_h * per_h, (slope / parameters[LOG_STEP] - 2.0 * value) * per_h * per_h * per_h


@kernel
def pad_force(gap, closing, wedge, parameters):
    """Return the opening force of one pad (N, ≥ −suction) and its derivatives by gap, closing velocity and wedge.

    ``closing`` is −ḣ; ``wedge`` is the velocity that the slopes of the film add to ``closing``, m/s.
    """
    contact_height = parameters[CONTACT_HEIGHT]
    floor = FILM_FLOOR * contact_height
    h = gap if gap > floor else floor
    by_wedge, by_gap = damping_of_film(h, parameters)
    force = by_wedge * (closing + wedge)
    by_gap = by_gap * (closing + wedge) if gap > floor else 0.0
    by_closing = by_wedge
    depth = contact_height - gap
    if depth > 0.0:
        stiffness = parameters[STIFFNESS] / parameters[PADS]
        damping = parameters[DAMPING] / parameters[PADS]
        # The damping grows with the approach over the roughness height, so the force has no jump at first contact.
        share = depth / contact_height if depth < contact_height else 1.0
        force += stiffness * depth + damping * share * closing
        by_gap -= stiffness
        if share < 1.0:
            by_gap -= damping * closing / contact_height
        by_closing += damping * share
    if force < 0.0:
        ratio = force / parameters[SUCTION]
        left = 1.0 / math.sqrt(1.0 + ratio * ratio)
        force *= left
        left = left * left * left
        by_gap *= left
        by_closing *= left
        by_wedge *= left
    return force, by_gap, by_closing, by_wedge


@kernel
def thrust_force(z, vz, speed, parameters):
    """Return the axial force on a collar without tilt at z (m, from the middle of the clearance), ∂F/∂z and ∂F/∂ż."""
    half = parameters[HALF]
    wedge = parameters[WEDGE] * speed
    f1, k1, c1, _ = pad_force(half - z, vz, wedge, parameters)
    f2, k2, c2, _ = pad_force(half + z, -vz, wedge, parameters)
    pads = parameters[PADS]
    return pads * (f2 - f1), pads * (k1 + k2), -pads * (c1 + c2)


@kernel
def thrust_force_tilted(z, tx, ty, vz, vtx, vty, speed, parameters, out):
    """Compute force and moments on a tilted collar, with their tangents.

    The collar is at z (m) from the middle of the clearance and rotated by the small angles tx, ty (rad) about the axes
    x and y, which are at rest with the pads; vz, vtx, vty are the rates, ``speed`` is that of the crank (rad/s).
    ``out[0:3]`` F_z (N), M_x, M_y (N m); ``out[3:12]`` derivatives by (z, tx, ty), ``out[12:21]`` by (vz, vtx, vty).
    """
    half = parameters[HALF]
    wedge = parameters[WEDGE] * speed
    # Sums over the pads, in local variables for speed: force and both moments, stiffness, damping.
    fz = fx = fy = 0.0
    zz = zx = zy = xz = xx = xy = yz = yx = yy = 0.0
    czz = czx = czy = cxx = cxy = cyy = 0.0
    for k in range(int(parameters[PADS])):
        # Displacement of the collar at the pad is z + ax tx + ay ty; its slope along the pad adds to the wedge.
        ax = parameters[ARMS + 2 * k]
        ay = parameters[ARMS + 2 * k + 1]
        place = z + ax * tx + ay * ty
        rate = vz + ax * vtx + ay * vty
        sx = -0.5 * speed * ay
        sy = 0.5 * speed * ax
        tilt = sx * tx + sy * ty
        f1, k1, c1, w1 = pad_force(half - place, rate, wedge + tilt, parameters)
        f2, k2, c2, w2 = pad_force(half + place, -rate, wedge - tilt, parameters)
        force = f2 - f1
        stiffness = k1 + k2
        damping = -c1 - c2
        slope = -w1 - w2
        by_x = stiffness * ax + slope * sx
        by_y = stiffness * ay + slope * sy
        fz += force
        fx += ax * force
        fy += ay * force
        zz += stiffness
        zx += by_x
        zy += by_y
        xz += ax * stiffness
        xx += ax * by_x
        xy += ax * by_y
        yz += ay * stiffness
        yx += ay * by_x
        yy += ay * by_y
        czz += damping
        czx += damping * ax
        czy += damping * ay
        cxx += damping * ax * ax
        cxy += damping * ax * ay
        cyy += damping * ay * ay
    sums = (
        fz, fx, fy, zz, zx, zy, xz, xx, xy, yz, yx, yy, czz, czx, czy, czx, cxx, cxy, czy, cxy, cyy,
    )  # fmt: skip
    for i in range(len(sums)):
        out[i] = sums[i]


# Kernels for the running model, in the axes of the frame, see :mod:`cranktrain.film.laws.films`. The argument ``place``
# is the motion (z, θ_x, θ_y) of the collar from the middle of the clearance; forces on the collar are (F_z, M_x, M_y).

_read = record_reader(ThrustPads(np.zeros(1), np.zeros(1), np.zeros(1)))


@kernel
def _axial(force, stiffness, damping, out):
    """Write an axial force and its derivatives to ``out``, with zero moments."""
    for k in range(BY_VELOCITY + 16):
        out[k] = 0.0
    out[0] = force
    out[BY_PLACE] = stiffness
    out[BY_VELOCITY] = damping


@law_kernel
def closed_thrust(record, action, i, place, velocity, numbers, memory, out):
    """Kernel of the closed bearing: axial spring and damper, with zero closing rate."""
    own = _read(record).parameters
    if action == RATE:
        out[0] = 0.0
        return 0
    stiffness = own[STIFFNESS]
    damping = own[DAMPING]
    _axial(-stiffness * place[0] - damping * velocity[0], -stiffness, -damping, out)
    return 0


@kernel
def _take_oil(bearing, viscosity):
    """Set the viscosity of the pads, Pa s. Return 0."""
    for k in range(bearing.spline.shape[0]):
        bearing.parameters[SPLINE + k] = viscosity * bearing.spline[k]
    return 0


@law_kernel
def axial_thrust(record, action, i, place, velocity, numbers, memory, out):
    """Kernel of films and contact with a collar that stays square to its axis."""
    if action == OIL:
        return _take_oil(_read(record), numbers[VISCOSITY])
    own = _read(record).parameters
    if action == RATE:
        out[0] = abs(velocity[0]) / max(own[HALF] - abs(place[0]), own[CONTACT_HEIGHT])
        return 0
    force, stiffness, damping = thrust_force(place[0], velocity[0], numbers[SPEED], own)
    _axial(force, stiffness, damping, out)
    return 0


@law_kernel
def tilting_thrust(record, action, i, place, velocity, numbers, memory, out):
    """Kernel of films and contact with a collar that tilts."""
    if action in (RATE, OIL):
        return axial_thrust(record, action, i, place, velocity, numbers, memory, out)
    bearing = _read(record)
    result = bearing.tilted
    cos = numbers[COS]
    sin = numbers[SIN]
    thrust_force_tilted(
        place[0], cos * place[1] - sin * place[2], sin * place[1] + cos * place[2],
        velocity[0], cos * velocity[1] - sin * velocity[2], sin * velocity[1] + cos * velocity[2],
        numbers[SPEED], bearing.parameters, result,
    )  # fmt: skip
    out[0] = result[0]
    out[1] = cos * result[1] + sin * result[2]
    out[2] = cos * result[2] - sin * result[1]
    # The pads are at rest, so the tangents are rotated to the axes of the frame.
    for part in range(2):
        o = TILTED_BY_PLACE if part == 0 else TILTED_BY_VELOCITY
        for r in range(3):
            x = result[o + 3 * r + 1]
            y = result[o + 3 * r + 2]
            result[o + 3 * r + 1] = cos * x + sin * y
            result[o + 3 * r + 2] = cos * y - sin * x
        for c in range(3):
            x = result[o + 3 + c]
            y = result[o + 6 + c]
            result[o + 3 + c] = cos * x + sin * y
            result[o + 6 + c] = cos * y - sin * x
        first = BY_PLACE if part == 0 else BY_VELOCITY
        for r in range(3):
            for c in range(3):
                out[first + 4 * r + c] = result[o + 3 * r + c]
    return 0
