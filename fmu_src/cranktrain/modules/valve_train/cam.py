"""A cam: three times continuously differentiable lift from a few numbers, and the contact with its follower.

The cam is symmetric about its nose. It rises from the base circle on a ramp and then follows a polynomial in
u = |ψ|/half:

    s = lift + u² (c₁ + d (c₂ + d (c₃ + d c₄))),   d = u^(p−2),

with the exponents 2, p, 2p − 2, 3p − 4 of a polydyne cam. Its four coefficients make lift, slope, curvature and third
derivative continuous with the ramp at u = 1. Over the ramp's first half its slope rises by 10 t³ − 15 t⁴ + 6 t⁵, then
it is constant.

Source: D. A. Stoddart, Polydyne cam design, Machine Design 25 (1953), January to March; R. L. Norton, Cam Design and
Manufacturing Handbook (2002), chapters 4, 7 and 12 (radii of curvature and line contact).
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.modules.valve_train import slots as at

STRAIGHT = 0.75
"""Height of a ramp over the product of its final slope and its angle."""
TERMS = 4
"""Number of powers of a cam's polynomial."""
SAMPLES = 2001
"""Number of angles at which a cam's slope and curvature are evaluated."""


@kernel
def wrapped(angle):
    """Cam angle reduced to (−π, π], rad."""
    return angle - 2.0 * math.pi * math.ceil((angle - math.pi) / (2.0 * math.pi))


@kernel
def set_cam(cam, half, ramp, ramp_height, lift, power):
    """Fill a cam's numbers, in the slots of ``CAM``, except for the mass.

    Parameters
    ----------
    half, ramp : angle from the cam's nose to the end of a ramp, and angle of the ramp, rad
    ramp_height, lift : lift of the follower on the ramp, and its largest lift, m
    power : exponent p
    """
    cam[at.HALF] = half
    cam[at.RAMP] = ramp
    cam[at.RAMP_SPEED] = ramp_height / (STRAIGHT * ramp)
    cam[at.STEP_POWER] = power - 2.0
    cam[at.LIFT] = lift
    # With x the exponents, Σ c = a, Σ x c = Σ x² c = Σ x³ c = b: Lagrange's polynomials at 0 and 1.
    a, b = ramp_height - lift, -cam[at.RAMP_SPEED] * half
    for i in range(TERMS):
        at_0, at_1 = 1.0, 1.0
        for j in range(TERMS):
            if j != i:
                other, apart = 2.0 + cam[at.STEP_POWER] * j, cam[at.STEP_POWER] * (i - j)
                at_0 *= -other / apart
                at_1 *= (1.0 - other) / apart
        cam[at.C_1 + i] = at_0 * (a - b) + at_1 * b


@kernel
def cam_lift(cam, psi):
    """Lift of the follower, m, and its first two derivatives by the cam angle, at an angle after the nose, rad."""
    a = abs(psi)
    half, ramp = cam[at.HALF], cam[at.RAMP]
    if a >= half + ramp:
        return 0.0, 0.0, 0.0
    if a >= half:
        r, v = (half + ramp - a) / ramp, cam[at.RAMP_SPEED]
        if r >= 0.5:
            lift, slope, curve = v * ramp * (r - 0.25), v, 0.0
        else:
            t = 2.0 * r
            lift = 0.5 * v * ramp * t**4 * (2.5 + t * (t - 3.0))
            slope = v * t**3 * (10.0 + t * (6.0 * t - 15.0))
            curve = 60.0 * v / ramp * (t * (1.0 - t)) ** 2
    else:
        u, n = a / half, cam[at.STEP_POWER]
        d = u**n
        c1, c2, c3, c4 = cam[at.C_1], cam[at.C_2] * d, cam[at.C_3] * d * d, cam[at.C_4] * d * d * d
        lift = cam[at.LIFT] + u * u * (c1 + c2 + c3 + c4)
        e2, e3, e4 = 2.0 + n, 2.0 + 2.0 * n, 2.0 + 3.0 * n
        slope = -u / half * (2.0 * c1 + e2 * c2 + e3 * c3 + e4 * c4)
        curve = (2.0 * c1 + e2 * (e2 - 1.0) * c2 + e3 * (e3 - 1.0) * c3 + e4 * (e4 - 1.0) * c4) / (half * half)
    return lift, slope if psi < 0.0 else -slope, curve


@kernel
def cam_radius(base_radius, roller_radius, lift, slope, curve):
    """Radius of curvature of the cam's flank, m, under a flat follower (``roller_radius`` 0) or a roller in line."""
    if roller_radius == 0.0:
        return base_radius + lift + curve
    pitch = base_radius + roller_radius + lift
    square = pitch * pitch + slope * slope
    turning = square + slope * slope - pitch * curve
    return square * math.sqrt(square) / turning - roller_radius


@kernel
def line_pressure(force, width, modulus, cam_radius, roller_radius):
    """Largest Hertzian pressure of a line contact, Pa, √(F E*/(π b R)); ``roller_radius`` 0 is a plane."""
    bend = 1.0 / cam_radius + (1.0 / roller_radius if roller_radius > 0.0 else 0.0)
    return math.sqrt(max(force * modulus / (math.pi * width) * bend, 0.0))


@kernel
def steepest(cam):
    """Largest slope of a cam's lift between its ramps, m/rad, at ``SAMPLES`` angles."""
    found, step = 0.0, cam[at.HALF] / (SAMPLES - 1)
    for k in range(SAMPLES):
        psi = -cam[at.HALF] + k * step if k < SAMPLES - 1 else 0.0
        found = max(found, abs(cam_lift(cam, psi)[1]))
    return found


@kernel
def smallest_radius(cam, base_radius, roller_radius):
    """Smallest convex radius of curvature of a cam, m; 0 or less if the follower would undercut it."""
    found, span = math.inf, cam[at.HALF] + cam[at.RAMP]
    for k in range(SAMPLES):
        psi = -span + k * (span / (SAMPLES - 1)) if k < SAMPLES - 1 else 0.0
        lift, slope, curve = cam_lift(cam, psi)
        radius = cam_radius(base_radius, roller_radius, lift, slope, curve)
        # A hollow flank under a roller has a radius below −roller_radius.
        if not (roller_radius > 0.0 and radius < -roller_radius) and radius < found:
            found = radius
    return found
