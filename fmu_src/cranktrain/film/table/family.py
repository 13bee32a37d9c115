"""The velocities that the tilted film table samples, and how it represents all others.

A film answers to two velocities of pure squeeze: v of the journal's middle and w of its tilt (in axes along and across
the line of centres, over the clearance). The table has room for the direction of v alone. It samples a tilt that turns
with the line of centres,

    w_ref = ρ v_t e_z×t,    ρ = ε³/(ε⁴ + δ⁴),

which a journal keeps whose tilt is at rest while both surfaces turn (for ε ≫ δ; nearer to the centre the line of
centres may turn at any rate, and δ keeps the family finite). With the rest d = w − w_ref any velocity of the surface is

    v + ζ w = (v + λ d) + ζ w_ref + (ζ − λ) d :

λ is free. Where the pressure lies about ζ = λ the last term does little, so the film is that of the family at v + λ d
with a small, linear rest. The pressure lies on both sides of a lever ζ_c that a tilt moves to the narrow end. Two
points of the family, λ = ζ_c ± σ, also give what no linear term can: d at one end adds pressure and at the other cannot
take off more than there is, so the force grows with |d| whichever way it points.

    F = ½ Σ_± [F_family(v + λ_± d) + R(v + λ_± d) d],    R = ∂F/∂w − ζ_c ∂F_family/∂v,

ζ_c = LEVER ρ ε A with A the tilt along the line of centres as a share of the possible one. R is tabled, so damping is
exact on the family. For |d| ≪ |v| the two points merge: σ rises from zero between the rates |d|/|v| in ONE_POINT,
and one point is read below. R knows a direction of v + λ d only; it fades where |v + λ d| < FADED |d|.

LEVER and SPREAD are chosen for least error over states of a running six (``python benchmarks/film_table.py``).
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel

CENTRED_TURN = 0.15
"""δ: eccentricity below which the tilt of the sampled family no longer turns with the line of centres."""
LEVER = 0.35
SPREAD = (0.29, 0.12, 0.12)
"""σ = (s₀ + s₁ ε⁸) (1 − s₂ q/(1 + q)) with q = |d|²/|v|²."""
FADED = 0.1
ONE_POINT = (0.05, 0.1)


@kernel
def turning(eps):
    """ρ(ε) and its slope."""
    d4 = CENTRED_TURN * CENTRED_TURN * CENTRED_TURN * CENTRED_TURN
    e3 = eps * eps * eps
    inverse = 1.0 / (e3 * eps + d4)
    rate = e3 * inverse
    return rate, (3.0 * eps * eps - 4.0 * e3 * rate) * inverse


@kernel
def spread(eps, ratio2):
    """σ of the two points at ε and |d|²/|v|², and its slopes by both."""
    low = ONE_POINT[0] * ONE_POINT[0]
    span = ONE_POINT[1] * ONE_POINT[1] - low
    if ratio2 <= low:
        return 0.0, 0.0, 0.0
    e2 = eps * eps
    e4 = e2 * e2
    widest = SPREAD[0] + SPREAD[1] * e4 * e4
    steeper = 8.0 * SPREAD[1] * e4 * e2 * eps
    inverse = 1.0 / (1.0 + ratio2)
    narrowed = 1.0 - SPREAD[2] * ratio2 * inverse
    slope = -SPREAD[2] * inverse * inverse
    u = (ratio2 - low) / span
    if u < 1.0:
        merged = u * u * (3.0 - 2.0 * u)
        slope = slope * merged + narrowed * 6.0 * u * (1.0 - u) / span
        narrowed *= merged
    return widest * narrowed, steeper * narrowed, widest * slope
