"""The driven end: the speed that is given, smoothed, and the frame that follows the crank.

A speed that arrives in steps is followed by a critically damped second-order filter, Ω̈ = ω_f² (Ω_in − Ω) − 2ω_f Ω̇,
solved exactly for an input that is linear in time. The crank hangs on that shaft by a torsional spring and damper.
The frame in which the crank's motion is small turns at Ω + w; its lead δ = ∫w dt over the shaft is re-centred on the
crank's mean rotation φ within some revolutions, τ₂ ẇ = φ/τ_c − w with τ_c = 4τ₂ (critically damped). Over a step φ is
extrapolated from its value and derivatives at the start, so every stage knows the frame's motion: any smooth frame
gives the same physics, this one keeps φ small.

Where a torque loads the shaft's end instead of a given speed, the dynamometer's rotor is free, J ψ̈ = T_shaft − T_load,
and the frame's base follows the crank, :func:`following_motion`: modes are small motions, so φ must stay small however
fast the engine speeds up.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel

RECENTRING_REVOLUTIONS = 2.0
FOLLOWING, KEEPING = 0.7, 0.15
SLOWEST_FOLLOWED = 60.0
"""rad/s below which a frame that follows a free crank keeps the time constants of this speed."""


@kernel
def shaft_motion(angle, speed, acceleration, target, rate, omega, t):
    """Shaft angle, speed and acceleration after t for the input target + rate·t; ``omega`` ≤ 0 follows it at once."""
    if omega <= 0.0:
        return angle + target * t + 0.5 * rate * t * t, target + rate * t, rate
    # Particular solution: the ramp, lagging by 2/ω.
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
    """Base angle, speed, acceleration and kept acceleration of a frame that follows a free crank, after t.

    Ω̇ = A + 0.7 φ/τ_c² with the kept Ȧ = 0.15 φ/τ_c³: with the lead's own law a frame of fourth order, damped well
    (its slowest roots are −0.34/τ_c and (−0.54 ± 0.63i)/τ_c), that follows any steady acceleration with φ about 0.
    Taylor's series as in :func:`frame_lead`.
    """
    inverse = max(speed, SLOWEST_FOLLOWED) / (2.0 * math.pi * RECENTRING_REVOLUTIONS)
    gain = FOLLOWING * inverse * inverse
    grow = KEEPING * inverse * inverse * inverse
    # φ and its integrals over t, one to three times.
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
    """Lead δ, its rate w and ẇ after t, from δ, w and the crank's mean rotation φ with φ̇, φ̈ (rad) at the start.

    Taylor's series of the law to the fourth power of t; with κt ≪ 1 its error is far below any integrator's.
    """
    # 1/τ_c = Ω/(2π·revolutions) and κ = 1/τ₂ = 4/τ_c; at standstill the frame is at rest.
    inverse = speed / (2.0 * math.pi * RECENTRING_REVOLUTIONS)
    kappa = 4.0 * inverse
    w1 = kappa * (inverse * rotation - lead_rate)
    w2 = kappa * (inverse * rotation_rate - w1)
    w3 = kappa * (inverse * rotation_acceleration - w2)
    w4 = -kappa * w3
    rate = lead_rate + t * (w1 + t / 2.0 * (w2 + t / 3.0 * (w3 + t / 4.0 * w4)))
    angle = lead + t * (lead_rate + t / 2.0 * (w1 + t / 3.0 * (w2 + t / 4.0 * (w3 + t / 5.0 * w4))))
    return angle, rate, w1 + t * (w2 + t / 2.0 * (w3 + t / 3.0 * w4))
