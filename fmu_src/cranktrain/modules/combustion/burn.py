"""Ignition and burning of a cylinder's charge.

Ignition: the delay τ(p, T) of a charge of changing state ends when ∫ dt/τ = 1 since the start of injection
(Livengood and Wu), with

    τ = A φ^−k p^−n exp(T_A/T)            p in bar

From there the charge burns as two Wiebe functions, premixed and by diffusion,

    x(θ) = β w(θ; Δ_p, m_p) + (1 − β) w(θ; Δ_d, m_d),   w = (1 − exp(−a ξ^(m+1)))/(1 − exp(−a)),  ξ = (θ − θ_ign)/Δ

The premixed fraction β = 1 − a φ^b/τ^c depends on the delay (τ in ms) and is kept within [0, 0.9]. The duration of the
diffusion burn is Δ_d = Δ_ref (φ/φ_ref)^0.6 (n/n_ref)^0.5. φ is the equivalence ratio of the cylinder's fuel and air at
ignition.

Sources: D. N. Assanis, Z. S. Filipi, S. B. Fiveland, M. Syrimis, J. Eng. Gas Turbines Power 125 (2003) 450 (delay);
N. Watson, A. D. Pilley, M. Marzouk, SAE 800029 (fraction); G. Woschni, F. Anisits, MTZ 34 (1973) 106 (duration);
J. C. Livengood, P. C. Wu, Proc. Combust. Inst. 5 (1955) 347.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel

WIEBE = 6.908
"""Constant a of the Wiebe function, which reaches 99.9 % at the burn's end and is therefore divided by 0.999."""
DURATION_BY_RATIO, DURATION_BY_SPEED = 0.6, 0.5
LEANEST = 0.02
"""Smallest equivalence ratio used in the formulas of delay and duration."""
MOST_PREMIXED = 0.9


@inlined_kernel
def ignition_rate(pressure, temperature, ratio, factor, exponent, activation, by_ratio):
    """Rate 1/τ, 1/s, at a pressure (Pa), temperature (K) and equivalence ratio; the factor A is in s."""
    delay = factor * max(ratio, LEANEST) ** -by_ratio * (1.0e-5 * pressure) ** -exponent
    return math.exp(-activation / temperature) / delay


@kernel
def premixed_share(ratio, delay, factor, by_ratio, by_delay):
    """Premixed fraction β by Watson, from the equivalence ratio and the delay, s."""
    share = 1.0 - factor * max(ratio, LEANEST) ** by_ratio / max(1.0e3 * delay, 1.0e-3) ** by_delay
    return min(max(share, 0.0), MOST_PREMIXED)


@inlined_kernel
def wiebe_rate(angle, duration, exponent):
    """Wiebe rate dw/dθ, 1/rad, at an angle (rad) after ignition; 0 after the end of the burn."""
    x = angle / duration
    if x <= 0.0 or x > 1.0:
        return 0.0
    power = x**exponent
    return WIEBE * (exponent + 1.0) * power * math.exp(-WIEBE * power * x) / (duration * -math.expm1(-WIEBE))
