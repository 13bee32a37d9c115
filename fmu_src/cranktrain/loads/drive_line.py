"""Motion of the driven end at a given, smoothed speed, and of the frame that follows the crank.

A stepwise speed input is smoothed by a critically damped second-order filter, Ω̈ = ω_f² (Ω_in − Ω) − 2ω_f Ω̇, solved
exactly for an input that is linear in time. A torsional spring and damper connect the crank to this shaft. The frame,
in which the crank's motion is small, rotates at Ω + w. Its lead δ = ∫w dt over the shaft is re-centred on the crank's
mean rotation φ within some revolutions, τ₂ ẇ = φ/τ_c − w with τ_c = 4τ₂ (critically damped). Over a step φ is
extrapolated from its value and derivatives at the start, so that the motion of the frame is known at every stage. Any
smooth frame gives the same physics; this one keeps φ small.

If a load torque is given instead of a speed, the dynamometer's rotor is free, J ψ̈ = T_shaft − T_load, and the base of
the frame follows the crank, :func:`following_motion`. Modes describe small motions, so φ must stay small even if the
engine accelerates fast.
"""

import math

from cranktrain.core.kernel import kernel

RECENTRING_REVOLUTIONS = 2.0
FOLLOWING, KEEPING = 0.7, 0.15
SLOWEST_FOLLOWED = 60.0
"""Least speed (rad/s) used for the time constants of a frame that follows a free crank."""


@kernel
def shaft_motion(angle, speed, acceleration, target, rate, omega, t):
    """Return shaft angle, speed, acceleration after time t for input target + rate·t; no filter if ``omega`` ≤ 0."""
    if omega <= 0.0:
        return angle + target * t + 0.5 * rate * t * t, target + rate * t, rate
    # The particular solution is the ramp with a lag of 2/ω.
    lag = target - 2.0 * rate / omega
    a = speed - lag
    b = acceleration - rate + omega * a
    decay = math.exp(-omega * t)
    new_speed = lag + rate * t + (a + b * t) * decay
    new_acceleration = rate + (b - omega * (a + b * t)) * decay
    integral = (a / omega + b / (omega * omega)) * (1.0 - decay) - b / omega * t * decay
    return angle + lag * t + 0.5 * rate * t * t + integral, new_speed, new_acceleration


@kernel
def following_motion(angle, speed, kept, rotation, rotation_rate, rotation_acceleration, t):
    """Return angle, speed, acceleration and stored acceleration of the base of a frame that follows a free crank.

    Values are those after time t. Ω̇ = A + 0.7 φ/τ_c² with the stored Ȧ = 0.15 φ/τ_c³. Together with the law of the
    lead this is a well damped frame of fourth order (slowest roots −0.34/τ_c and (−0.54 ± 0.63i)/τ_c), which follows
    any steady acceleration with φ about 0. The Taylor series is that of :func:`frame_lead`.
    """
    inverse = max(speed, SLOWEST_FOLLOWED) / (2.0 * math.pi * RECENTRING_REVOLUTIONS)
    gain = FOLLOWING * inverse * inverse
    grow = KEEPING * inverse * inverse * inverse
    # Mean rotation φ after t, and its single, double and triple integral over t.
    phi = rotation + t * (rotation_rate + 0.5 * t * rotation_acceleration)
    once = t * (rotation + t / 2.0 * (rotation_rate + t / 3.0 * rotation_acceleration))
    twice = t * t / 2.0 * (rotation + t / 3.0 * (rotation_rate + t / 4.0 * rotation_acceleration))
    thrice = t * t * t / 6.0 * (rotation + t / 4.0 * (rotation_rate + t / 5.0 * rotation_acceleration))
    acceleration = kept + grow * once
    return (
        angle + speed * t + 0.5 * kept * t * t + gain * twice + grow * thrice,
        speed + kept * t + gain * once + grow * twice,
        acceleration + gain * phi,
        acceleration,
    )


@kernel
def frame_lead(lead, lead_rate, rotation, rotation_rate, rotation_acceleration, speed, t):
    """Return a frame's lead δ, its rate w and ẇ after time t, from δ, w and the crank's rotation φ, φ̇, φ̈ at the start.

    It is a Taylor series to the fourth power of t, whose error for κt ≪ 1 is far below that of any integrator.
    """
    # 1/τ_c = Ω/(2π·revolutions) and κ = 1/τ₂ = 4/τ_c, so the frame is at rest at standstill.
    inverse = speed / (2.0 * math.pi * RECENTRING_REVOLUTIONS)
    kappa = 4.0 * inverse
    w1 = kappa * (inverse * rotation - lead_rate)
    w2 = kappa * (inverse * rotation_rate - w1)
    w3 = kappa * (inverse * rotation_acceleration - w2)
    w4 = -kappa * w3
    rate = lead_rate + t * (w1 + t / 2.0 * (w2 + t / 3.0 * (w3 + t / 4.0 * w4)))
    angle = lead + t * (lead_rate + t / 2.0 * (w1 + t / 3.0 * (w2 + t / 4.0 * (w3 + t / 5.0 * w4))))
    return angle, rate, w1 + t * (w2 + t / 2.0 * (w3 + t / 3.0 * w4))
