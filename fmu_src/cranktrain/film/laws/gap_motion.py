"""Kinematics of the gap between a journal and its bore, as listed by classic bearing tools.

A journal with a straight axis is in a rigid round bore of radial clearance c. Its middle is at e = (x, y) and its ends
are at e ± t, where t = (a, b) is the displacement of the end ζ = +1 against the middle. At ζ the film is
h(φ, ζ) = c + g(ζ) − (e + ζ t)·(cos φ, sin φ) with the relief g of the shell.

* *Eccentric velocity* ė: velocity of the journal's middle against the bore, in space.
* *Effective eccentric velocity* |v|, v = ė − ω̄ e_z×e with ω̄ = (ω_J + ω_B)/2: the velocity seen from a frame that turns
  at the mean of both surface speeds. It is the one velocity that drives Reynolds' equation, as if by squeeze alone.
* *Relative speed* ω_J − ω_B of journal against bore: it shears the film.
* *Speed of the gap* δ̇ = (x ẏ − y ẋ)/e²: angular speed of the line of centres, and so of the wedge; 0 for a centred
  journal, whose line of centres has no direction.
* *Hydrodynamically effective speed* ω_J + ω_B − 2δ̇: speed of the surfaces relative to the wedge, twice their mean. The
  film loses its wedge action at half-speed whirl, δ̇ = ω̄. In these terms |v|² = ė_r² + (e (ω_J + ω_B − 2δ̇)/2)².
* *Least gap* min (c + g(ζ) − |e + ζ t|): in a straight shell at one of the ends, because |e + ζ t| is convex; a relief
  moves it inwards. It lies where p = e + ζ t points, and changes at the rate −p·ṗ/|p|.

Sources: the reference's list of component outputs (its chapter 5.1.2), which names the quantities; v after Booker's
mobility method (Booker 1965; Childs, Moes, van Leeuwen 1977); ω_J + ω_B − 2δ̇ after Holland (1959) and Butenschön
(1976).
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.film.contact.gap import least_gap

VELOCITY_EFFECTIVE, SPEED_RELATIVE, SPEED_GAP, SPEED_EFFECTIVE = range(4)
LEAST_GAP, LEAST_ANGLE, LEAST_SIDE, LEAST_RATE = range(4, 8)
SIZE = 8


@kernel
def gap_motion(x, y, a, b, vx, vy, va, vb, shell, journal_speed, bore_speed, out):
    """Compute the kinematics of one gap; the module docstring defines each quantity.

    Parameters
    ----------
    x, y, a, b : position of the middle and displacement of the end ζ = +1 against it, m, in any axes
    vx, vy, va, vb : their velocities in space along these axes, m/s, relative to the motion of the bore
    shell : radial clearance, m, and (depth, share, exponent) of the relief, see :mod:`cranktrain.film.contact.gap`
    journal_speed, bore_speed : rad/s, in the sense in which angles count
    out : (8,) VELOCITY_EFFECTIVE m/s; SPEED_RELATIVE, SPEED_GAP, SPEED_EFFECTIVE rad/s; LEAST_GAP m, negative where
        the end reaches into the bore; LEAST_ANGLE rad in (−π, π] from the x axis; LEAST_SIDE ζ of the least gap, 0
        if the gap is uniform along the axis; LEAST_RATE m/s, negative while the gap closes
    """
    both = journal_speed + bore_speed
    square = x * x + y * y
    turning = 0.0
    if square > 0.0:
        turning = (x * vy - y * vx) / square
    sx = vx + 0.5 * both * y
    sy = vy - 0.5 * both * x
    out[VELOCITY_EFFECTIVE] = math.sqrt(sx * sx + sy * sy)
    out[SPEED_RELATIVE] = journal_speed - bore_speed
    out[SPEED_GAP] = turning
    out[SPEED_EFFECTIVE] = both - 2.0 * turning
    clearance, profile = shell
    least, side = least_gap((x, y, a, b), clearance, profile)
    px = x + side * a
    py = y + side * b
    wx = vx + side * va
    wy = vy + side * vb
    far = math.sqrt(px * px + py * py)
    out[LEAST_GAP] = least
    out[LEAST_ANGLE] = math.atan2(py, px) if far > 0.0 else 0.0
    out[LEAST_SIDE] = side
    # A centred journal reduces the least gap in whichever direction it moves.
    out[LEAST_RATE] = -(px * wx + py * wy) / far if far > 0.0 else -math.sqrt(wx * wx + wy * wy)
