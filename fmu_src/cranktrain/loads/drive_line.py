"""The driven end: the speed that is given, smoothed, and the frame that follows the crank.

A speed that arrives in steps is followed by a critically damped second-order filter, Ω̈ = ω_f² (Ω_in − Ω) − 2ω_f Ω̇,
solved exactly for an input that is linear in time. The crank hangs on that shaft by a torsional spring and damper. The
frame in which the crank's motion is small turns at Ω + w; its lead δ = ∫w dt over the shaft is re-centred on the crank's
mean rotation φ within some revolutions, τ₂ ẇ = φ/τ_c − w with τ_c = 4τ₂ (critically damped). ẇ is held over a step, so
the frame's motion is known to every stage: any smooth frame gives the same physics, this one keeps φ small.
"""

from __future__ import annotations

import math

from cranktrain.kernel import kernel

RECENTRING_REVOLUTIONS = 2.0


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
def recentring_rate(rotation, lead_rate, speed):
    """ẇ of the frame for the crank's mean rotation against it (rad), its lead rate w and the shaft's speed."""
    time = RECENTRING_REVOLUTIONS * 2.0 * math.pi
    # 1/τ_c = Ω/(2π·revolutions); 1/τ₂ = 4/τ_c; at standstill the frame stands.
    inverse = speed / time
    return (rotation * inverse - lead_rate) * 4.0 * inverse
