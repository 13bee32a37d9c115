r"""Gap between a journal and a shell with an axial profile, and the mean gap of the oil between rough surfaces.

A shell that has run in is relieved at its edges: over the fraction w of each half width its radius grows by

    g(ζ) = d ((|ζ| − 1 + w)/w)^p    for |ζ| > 1 − w,    0 elsewhere,

ζ = 2z/L. The profile is uniform around the shell, so the film depends on half the sum of the surface speeds only.

The oil between surfaces of the combined standard deviation σ has the mean gap h_T of Gaussian heights, even if the mean
planes of the surfaces touch or overlap. With the distance H of the mean planes, u = H/σ, the normal distribution Φ and
its density φ

    h = √(h_T² + (0.1 σ)²),    h_T = σ (u Φ(u) + φ(u)),    dh/dH = h_T Φ(u)/h.

The second term is chosen so that a fully closed gap does not seal. It fades out between u = 5 and 6, as contact does,
so h = H for surfaces without contact. The film is squeezed by dh/dt, and its pressure does work on dh, so
source and pressure are both weighted by dh/dH, the fraction of the area that is not in contact. With a weight on only
one of the two, surfaces in contact would pump oil without limit.

Source of h_T: N. Patir, H. S. Cheng, J. Lubr. Technol. 100 (1978) 12.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.film.contact.asperity import FADING, HIGHEST

CLEAR = HIGHEST
"""H/σ above which the mean gap equals the distance H of the mean planes (to 2e-10 σ)."""
LEFT_OPEN = 0.1
"""Smallest mean gap of fully closed surfaces, over σ; chosen."""
SMOOTH = 5.0e-5
"""Roughness σ used for "smooth" surfaces, over the clearance; it changes the film only below 4e-4 of the clearance."""
STRAIGHT = (0.0, 0.5, 2.0)
"""Relief profile (depth, width fraction, exponent) of a straight shell."""
_SAMPLES, _STEPS = 8, 60
_NARROW = 1.0e-12
"""Tolerance in ζ of the position of the least gap on a relief."""


def over(profile: tuple[float, float, float], unit: float = 1.0) -> tuple[float, float, float]:
    """Return a relief profile (depth, width fraction, exponent) with its depth divided by ``unit``."""
    depth, share, exponent = profile
    return depth / unit, float(share), float(exponent)


@kernel
def relief(zeta, profile):
    """Return the relief g of a shell at ζ; ``profile`` holds depth d (any unit), width fraction w and exponent p."""
    depth, share, exponent = profile
    s = abs(zeta) - 1.0 + share
    if depth == 0.0 or s <= 0.0:
        return 0.0
    return depth * _power(s / share, exponent)


@inlined_kernel
def _power(s, exponent):
    """Return ``s`` to a power ≥ 0; integer powers use a loop, which is faster than a general power."""
    value = 1.0
    whole = int(exponent)
    if exponent == whole:
        for _ in range(whole):
            value *= s
    else:
        value = s**exponent
    return value


@kernel
def mean_gap(h, sigma):
    """Return the mean gap h_T of Gaussian surfaces whose mean planes are ``h`` apart, in the unit of ``sigma``."""
    u = h / sigma
    return 0.5 * h * math.erfc(-math.sqrt(0.5) * u) + sigma * math.exp(-0.5 * u * u) / math.sqrt(2.0 * math.pi)


@kernel
def open_gap(h, sigma):
    """Return the film gap of rough surfaces ``h`` apart, in the unit of ``sigma``, and two derivatives by h."""
    u = h / sigma
    if u >= CLEAR:
        return h, 1.0, 0.0
    tail = 0.5 * math.erfc(-math.sqrt(0.5) * u)
    density = math.exp(-0.5 * u * u) / math.sqrt(2.0 * math.pi)
    mean = max(u * tail + density, 0.0)
    floor2 = LEFT_OPEN * LEFT_OPEN
    first = mean * tail
    second = tail * tail + mean * density
    if u > FADING:
        t = (CLEAR - u) / (CLEAR - FADING)
        first -= 15.0 * floor2 * t * t * (1.0 - t) * (1.0 - t) / (CLEAR - FADING)
        second += 30.0 * floor2 * t * (1.0 - t) * (1.0 - 2.0 * t) / ((CLEAR - FADING) * (CLEAR - FADING))
        floor2 *= t * t * t * (10.0 - t * (15.0 - 6.0 * t))
    root = math.sqrt(mean * mean + floor2)
    slope = first / root
    return sigma * root, slope, (second - slope * slope) / (root * sigma)


@kernel
def least_gap(place, clearance, profile):
    """Return the least gap between a journal at ``place`` (x, y, a, b) and the shell, and its ζ (0 without tilt).

    On the straight part the least gap lies at an end, because |e + ζ t| is convex. A relief is searched only if the
    displacement there is large enough for a smaller gap.
    """
    x, y, a, b = place
    depth, share, _ = profile
    if a == 0.0 and b == 0.0:
        return clearance - math.sqrt(x * x + y * y), 0.0
    side = 1.0 if x * a + y * b >= 0.0 else -1.0
    if depth == 0.0:
        return _gap(side, place, clearance, profile), side
    best = side * (1.0 - share)
    least = _gap(best, place, clearance, profile)
    for end in (side, -side):
        if clearance - max(_reach(end * (1.0 - share), place), _reach(end, place)) >= least:
            continue
        nearest = 0
        lowest = _gap(end * (1.0 - share), place, clearance, profile)
        for k in range(1, _SAMPLES + 1):
            h = _gap(end * (1.0 - share + share * k / _SAMPLES), place, clearance, profile)
            if h < lowest:
                lowest = h
                nearest = k
        near = 1.0 - share + share * max(nearest - 1, 0) / _SAMPLES
        far = 1.0 - share + share * min(nearest + 1, _SAMPLES) / _SAMPLES
        zeta = end * _flattest(near, far, end, place, profile)
        h = _gap(zeta, place, clearance, profile)
        if h < least:
            least = h
            best = zeta
    return least, best


@kernel
def _flattest(near, far, end, place, profile):
    """Return |ζ| where the gap is stationary on the relief of one ``end``, or the bound with the smaller gap.

    Newton's method on the slope, with bisection if a step would leave the interval that encloses the root.
    """
    first, bend = _slope(near, end, place, profile)
    if first >= 0.0:
        return near
    last, bend = _slope(far, end, place, profile)
    if last <= 0.0:
        return far
    s = near - first * (far - near) / (last - first)
    for _ in range(_STEPS):
        slope, bend = _slope(s, end, place, profile)
        if slope > 0.0:
            far = s
        else:
            near = s
        before = s
        s = 0.5 * (near + far)
        if bend > 0.0 and near < before - slope / bend < far:
            s = before - slope / bend
        if abs(s - before) < _NARROW:
            break
    return s


@kernel
def _slope(s, end, place, profile):
    """Return the first and second derivative of the gap by |ζ| at |ζ| = ``s``."""
    x, y, a, b = place
    depth, share, exponent = profile
    px = x + end * s * a
    py = y + end * s * b
    far = math.sqrt(px * px + py * py)
    slope = 0.0
    bend = 0.0
    if far > 0.0:
        slope = -end * (px * a + py * b) / far
        bend = -(a * a + b * b - slope * slope) / far
    on = s - 1.0 + share
    if on > 0.0:
        rise = depth * exponent * _power(on / share, exponent - 1.0) / share
        slope += rise
        bend += rise * (exponent - 1.0) / on
    return slope, bend


@kernel
def _reach(zeta, place):
    """Return the distance between the axes of journal and bore at ζ."""
    x, y, a, b = place
    px = x + zeta * a
    py = y + zeta * b
    return math.sqrt(px * px + py * py)


@kernel
def _gap(zeta, place, clearance, profile):
    """Return the least gap of the slice at ζ."""
    return clearance + relief(zeta, profile) - _reach(zeta, place)
