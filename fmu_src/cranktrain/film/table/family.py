"""Family of velocities that the tilted film table samples, and representation of all other velocities by it.

A film's force depends on two velocities of pure squeeze, v of the journal's middle and w of its tilt (in axes along and
across the line of centres, over the clearance). The table has only the direction of v as a coordinate. It is sampled
for a tilt that rotates with the line of centres,

    w_ref = ρ v_t e_z×t,    ρ = ε³/(ε⁴ + δ⁴),

as for a journal whose tilt is at rest in space while the surfaces rotate (for ε ≫ δ; near the centre the line of
centres may rotate at any rate, and δ keeps the family finite). With the remainder d = w − w_ref any velocity of the
surface is

    v + ζ w = (v + λ d) + ζ w_ref + (ζ − λ) d :

for any λ. If the pressure is concentrated around ζ = λ, the last term is small, and the film is that of the family at
v + λ d with a small linear correction. The pressure is centred at a lever ζ_c, which a tilt moves to the narrow end.
Two points of the family, λ = ζ_c ± σ, also represent a nonlinear effect: d adds pressure at one end, but at the other
end it cannot remove more pressure than exists, so the force grows with |d| for either sign of d.

    F = ½ Σ_± [F_family(v + λ_± d) + R(v + λ_± d) d],    R = ∂F/∂w − ζ_c ∂F_family/∂v,

ζ_c = LEVER ρ ε A with the tilt A along the line of centres as a fraction of the possible tilt. R is tabled, so damping
is exact on the family. For |d| ≪ |v| the two points merge: σ rises from zero between the ratios |d|/|v| in ONE_POINT,
and below these only one point is evaluated. R depends on the direction of v + λ d only; it fades out for
|v + λ d| < FADED |d|.

LEVER and SPREAD are chosen for least error over states of a running six-cylinder engine from 1000 to 2600 rev/min, in
shells relieved by 0.15 clearances (``python benchmarks/film_table.py`` prints the remaining error).
"""

from cranktrain.core.kernel import kernel

CENTRED_TURN = 0.15
"""Eccentricity δ below which the tilt of the sampled family no longer rotates with the line of centres."""
LEVER = 0.35
SPREAD = (0.28, 0.12)
"""Constants (s₀, s₁) of the distance σ = s₀ (1 − s₁ q/(1 + q)) with q = |d|²/|v|²."""
FADED = 0.1
ONE_POINT = (0.05, 0.1)


@kernel
def turning(eps):
    """Return the tilt's rotation factor ρ(ε) of the sampled family, and dρ/dε."""
    d4 = CENTRED_TURN * CENTRED_TURN * CENTRED_TURN * CENTRED_TURN
    e3 = eps * eps * eps
    inverse = 1.0 / (e3 * eps + d4)
    rate = e3 * inverse
    return rate, (3.0 * eps * eps - 4.0 * e3 * rate) * inverse


@kernel
def spread(ratio2):
    """Return the distance σ of the two points at ``ratio2`` = |d|²/|v|², and its slope."""
    low = ONE_POINT[0] * ONE_POINT[0]
    span = ONE_POINT[1] * ONE_POINT[1] - low
    if ratio2 <= low:
        return 0.0, 0.0
    inverse = 1.0 / (1.0 + ratio2)
    narrowed = 1.0 - SPREAD[1] * ratio2 * inverse
    slope = -SPREAD[1] * inverse * inverse
    u = (ratio2 - low) / span
    if u < 1.0:
        merged = u * u * (3.0 - 2.0 * u)
        slope = slope * merged + narrowed * 6.0 * u * (1.0 - u) / span
        narrowed *= merged
    return SPREAD[0] * narrowed, SPREAD[0] * slope
