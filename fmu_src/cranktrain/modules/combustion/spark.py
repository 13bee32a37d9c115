"""Spark ignition: laminar flame speed of the charge at the spark, and duration of the burn from it.

The charge burns from the spark by two Wiebe functions, or by one (fraction 1). Their durations hold at a reference: a
speed n_r, and a charge of λ = 1 with pressure p_r, temperature T_r and burnt fraction x_r at the spark. Elsewhere they
are multiplied by

    f = (n/n_r)^(1/3) (ν/ν_r)^(1/3) (S_r/S)^(2/3),   ν ~ T^1.7/p
    S = (B_M + B_φ (φ − φ_M)²) (T/298 K)^α (p/1 atm)^β (1 − 2.06 x^0.77)
    α = 2.4 − 0.271 φ^3.51,   β = −0.357 + 0.14 φ^2.77

for gasoline, with φ_M = 1.21, B_M = 0.305 m/s, B_φ = −0.549 m/s. The speed's part is that of mean piston speed in one
engine. The height of the chamber at the spark and the density ratio of the later burn count as unchanged.

Sources: S. D. Hires, R. J. Tabaczynski, J. M. Novak, SAE 780232 (durations over S, ν and piston speed); D. B. Rhodes,
J. C. Keck, SAE 850047 (gasoline and residual gas); M. Metghalchi, J. C. Keck, Combust. Flame 48 (1982) 191; all in
J. B. Heywood, Internal Combustion Engine Fundamentals (1988), section 9.3.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.modules.combustion import slots as at

RICHEST_BEST, FASTEST, BY_RATIO = 1.21, 0.305, -0.549
"""φ_M of the fastest flame, its speed B_M, m/s, and B_φ, m/s."""
BY_RESIDUAL, RESIDUAL_EXPONENT = 2.06, 0.77
ROOM_TEMPERATURE, ATMOSPHERE = 298.0, 101325.0
BY_SPEED, BY_FLAME, VISCOUS = 1.0 / 3.0, 2.0 / 3.0, 1.7
SLOWEST = 0.02
"""Smallest laminar flame speed used, m/s, for charges that hardly burn."""


@kernel
def flame_speed(ratio, temperature, pressure, residual):
    """Laminar flame speed, m/s, of gasoline, from equivalence ratio, temperature (K), pressure (Pa), burnt fraction."""
    ratio = min(max(ratio, 0.5), 1.7)
    still = FASTEST + BY_RATIO * (ratio - RICHEST_BEST) ** 2
    hotter = (temperature / ROOM_TEMPERATURE) ** (2.4 - 0.271 * ratio**3.51)
    denser = (pressure / ATMOSPHERE) ** (-0.357 + 0.14 * ratio**2.77)
    clean = 1.0 - BY_RESIDUAL * max(residual, 0.0) ** RESIDUAL_EXPONENT
    return max(max(still, SLOWEST) * hotter * denser * max(clean, SLOWEST), SLOWEST)


@inlined_kernel
def duration_factor(numbers, ratio, temperature, pressure, residual, speed):
    """Factor f on the durations, of a charge at the spark and a speed, rad/s."""
    own = flame_speed(ratio, temperature, pressure, residual)
    reference_t, reference_p = numbers[at.BURN_TEMPERATURE], numbers[at.BURN_PRESSURE]
    usual = flame_speed(1.0, reference_t, reference_p, numbers[at.BURN_RESIDUAL])
    viscous = (temperature / reference_t) ** VISCOUS * reference_p / pressure
    return (viscous * speed / numbers[at.REFERENCE_SPEED]) ** BY_SPEED * (usual / own) ** BY_FLAME
