"""Integrators as tables of coefficients; the stage solver does the work.

Every method here reads, for a stage, q = Q + c_q a and v = V + c_v a with the true acceleration a unknown:

* diagonally implicit Runge–Kutta methods with equal diagonal γ (c_q = (hγ)², c_v = hγ), all stiffly accurate and
  L-stable: ``backward-euler`` (order 1, 1 stage), ``tr-bdf2`` (2, first stage explicit; Bank et al. 1985), ``sdirk2``
  (2 stages; Alexander 1977), ``sdirk3`` (3 stages; Alexander 1977), ``sdirk4`` (4, 5 stages; Hairer & Wanner II, table
  IV.6.5), and with an explicit first stage and stages of order two, which keep their order where films are stiff,
  ``esdirk3``, ``esdirk4`` and ``esdirk5`` (3, 5 and 7 implicit stages; Kennedy & Carpenter 2003, the implicit halves of
  their ARK3(2)4L[2]SA, ARK4(3)6L[2]SA and ARK5(4)8L[2]SA);
* methods with one implicit stage, of Newmark's form q₁ = q₀ + h v₀ + h² [(½−β) ā₀ + β ā₁], v₁ likewise with γ:
  generalised-α in the form of Arnold & Brüls (2007) with an auxiliary acceleration ā beside the true one,
  (1−α_m) ā₁ + α_m ā₀ = (1−α_f) v̇₁ + α_f v̇₀, so that a mass matrix which varies with the state keeps second order;
  c_q = βκh², c_v = γκh, κ = (1−α_f)/(1−α_m). ``generalised-alpha`` takes ρ∞ in [0, 1]. With α_m = 0 it is ``hht``,
  which takes α in [−1/3, 0] (Hilber, Hughes & Taylor 1977), with both zero the ``trapezoidal`` rule;
* ``bdf2``, two steps: c_q = (2h/3)², c_v = 2h/3. Where the step changes, the step before is made anew from the series.

A table is one float64 array: row 0 holds kind, number of stages, γ, whether the first stage is explicit, for
generalised-α α_m, α_f, β, γ; the rows after it a_ij (strictly lower part used) with c_i in the last column; where the
method has an embedded one, a last row holds the differences of the weights, b − b̂.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array

DIRK, GENERALISED_ALPHA, BDF2 = 0, 1, 2
_WIDTH = 9
RHO_INFINITY = 0.6
"""Spectral radius at infinity of ``generalised-alpha`` where none is given."""
ALPHA = -0.1
"""α of ``hht`` where none is given."""


def _dirk(matrix: list[list[float]], embedded: list[float] | None = None, explicit_first: bool = False) -> Array:
    """Table of a stiffly accurate method; ``embedded`` are the weights of its second solution."""
    s = len(matrix)
    a = np.zeros((s, s))
    for row, values in zip(a, matrix, strict=True):
        row[: len(values)] = values
    table = np.zeros((s + 1 + (embedded is not None), _WIDTH))
    table[0, :4] = [DIRK, s, a[-1, -1], float(explicit_first)]
    table[1 : s + 1, :s] = a
    table[1 : s + 1, -1] = a.sum(axis=1)
    if embedded is not None:
        table[s + 1, :s] = a[-1] - embedded
    return table


def _esdirk(gamma: float, below: list[list[float]], embedded: list[float]) -> Array:
    """Table of a method with explicit first stage, from what stands below its diagonal."""
    return _dirk([[0.0]] + [[*row, gamma] for row in below], embedded, explicit_first=True)


def _sdirk3_gamma() -> float:
    # The root of γ³ − 3γ² + 3γ/2 − 1/6 between 1/6 and 1/2: L-stability of the three-stage method of order three.
    roots = np.roots([1.0, -3.0, 1.5, -1.0 / 6.0]).real
    return float(next(r for r in roots if 1.0 / 6.0 < r < 0.5))


def generalised_alpha(rho: float) -> Array:
    """Table of generalised-α with spectral radius ``rho`` at infinite frequency (Chung & Hulbert 1993)."""
    if not 0.0 <= rho <= 1.0:
        raise InputError(f"generalised-alpha needs 0 <= rho <= 1, got {rho:g}; 0.6 is a good start")
    alpha_f, alpha_m = rho / (rho + 1.0), (2.0 * rho - 1.0) / (rho + 1.0)
    gamma = 0.5 - alpha_m + alpha_f
    return _newmark(alpha_m, alpha_f, 0.25 * (gamma + 0.5) ** 2, gamma)


def hht(alpha: float) -> Array:
    """Table of the method of Hilber, Hughes and Taylor, −1/3 ≤ ``alpha`` ≤ 0."""
    if not -1.0 / 3.0 - 1e-12 <= alpha <= 0.0:
        raise InputError(f"hht needs -1/3 <= alpha <= 0, got {alpha:g}; -0.1 is a good start")
    return _newmark(0.0, -alpha, 0.25 * (1.0 - alpha) ** 2, 0.5 - alpha)


def _newmark(alpha_m: float, alpha_f: float, beta: float, gamma: float) -> Array:
    table = np.zeros((2, _WIDTH))
    table[0, :8] = [GENERALISED_ALPHA, 1, 0.0, 0.0, alpha_m, alpha_f, beta, gamma]
    table[1, -1] = 1.0
    return table


def _bdf2() -> Array:
    table = np.zeros((2, _WIDTH))
    table[0, :3] = [BDF2, 1, 2.0 / 3.0]
    table[1, -1] = 1.0
    return table


def _tables() -> dict[str, Array]:
    g2 = 1.0 - 0.5 * math.sqrt(2.0)
    g3 = _sdirk3_gamma()
    w = 0.25 * math.sqrt(2.0)
    b1, b2 = -0.25 * (6 * g3 * g3 - 16 * g3 + 1), 0.25 * (6 * g3 * g3 - 20 * g3 + 5)
    return {
        "backward-euler": _dirk([[1.0]]),
        "trapezoidal": _newmark(0.0, 0.0, 0.25, 0.5),
        "hht": hht(ALPHA),
        "generalised-alpha": generalised_alpha(RHO_INFINITY),
        "bdf2": _bdf2(),
        "tr-bdf2": _dirk([[0.0], [g2, g2], [w, w, g2]], explicit_first=True),
        "sdirk2": _dirk([[g2], [1 - g2, g2]]),
        "sdirk3": _dirk([[g3], [0.5 * (1 - g3), g3], [b1, b2, g3]]),
        "sdirk4": _dirk(
            [
                [1 / 4],
                [1 / 2, 1 / 4],
                [17 / 50, -1 / 25, 1 / 4],
                [371 / 1360, -137 / 2720, 15 / 544, 1 / 4],
                [25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4],
            ],
            [59 / 48, -17 / 96, 225 / 32, -85 / 12, 0.0],
        ),
        "esdirk3": _esdirk(
            1767732205903 / 4055673282236,
            [
                [1767732205903 / 4055673282236],
                [2746238789719 / 10658868560708, -640167445237 / 6845629431997],
                [1471266399579 / 7840856788654, -4482444167858 / 7529755066697, 11266239266428 / 11593286722821],
            ],
            [
                2756255671327 / 12835298489170,
                -10771552573575 / 22201958757719,
                9247589265047 / 10645013368117,
                2193209047091 / 5459859503100,
            ],
        ),
        "esdirk4": _esdirk(
            1 / 4,
            [
                [1 / 4],
                [8611 / 62500, -1743 / 31250],
                [5012029 / 34652500, -654441 / 2922500, 174375 / 388108],
                [15267082809 / 155376265600, -71443401 / 120774400, 730878875 / 902184768, 2285395 / 8070912],
                [82889 / 524892, 0.0, 15625 / 83664, 69875 / 102672, -2260 / 8211],
            ],
            [
                4586570599 / 29645900160,
                0.0,
                178811875 / 945068544,
                814220225 / 1159782912,
                -3700637 / 11593932,
                61727 / 225920,
            ],
        ),
        "esdirk5": _esdirk(
            41 / 200,
            [
                [41 / 200],
                [41 / 400, -567603406766 / 11931857230679],
                [683785636431 / 9252920307686, 0.0, -110385047103 / 1367015193373],
                [
                    3016520224154 / 10081342136671,
                    0.0,
                    30586259806659 / 12414158314087,
                    -22760509404356 / 11113319521817,
                ],
                [
                    218866479029 / 1489978393911,
                    0.0,
                    638256894668 / 5436446318841,
                    -1179710474555 / 5321154724896,
                    -60928119172 / 8023461067671,
                ],
                [
                    1020004230633 / 5715676835656,
                    0.0,
                    25762820946817 / 25263940353407,
                    -2161375909145 / 9755907335909,
                    -211217309593 / 5846859502534,
                    -4269925059573 / 7827059040749,
                ],
                [
                    -872700587467 / 9133579230613,
                    0.0,
                    0.0,
                    22348218063261 / 9555858737531,
                    -1143369518992 / 8141816002931,
                    -39379526789629 / 19018526304540,
                    32727382324388 / 42900044865799,
                ],
            ],
            [
                -975461918565 / 9796059967033,
                0.0,
                0.0,
                78070527104295 / 32432590147079,
                -548382580838 / 3424219808633,
                -33438840321285 / 15594753105479,
                3629800801594 / 4656183773603,
                4035322873751 / 18575991585200,
            ],
        ),
    }


INTEGRATORS = _tables()
ORDERS = {
    "backward-euler": 1, "trapezoidal": 2, "hht": 2, "generalised-alpha": 2, "bdf2": 2, "tr-bdf2": 2,
    "sdirk2": 2, "sdirk3": 3, "sdirk4": 4, "esdirk3": 3, "esdirk4": 4, "esdirk5": 5,
}  # fmt: skip
EMBEDDED = {"sdirk4": 3, "esdirk3": 2, "esdirk4": 3, "esdirk5": 4, "generalised-alpha": 1, "hht": 1}
"""Order of the second solution, whose difference estimates the error of a step; of methods of Newmark's form it is
that of constant acceleration (Zienkiewicz & Xie 1991)."""
_WITH_PARAMETER = {"generalised-alpha": (generalised_alpha, "rho", "0.8"), "hht": (hht, "alpha", "-0.1")}


def integrator_table(name: str) -> Array:
    """Coefficients by name; ``generalised-alpha:0.8`` gives ρ∞, ``hht:-0.2`` α. ``InputError`` for what is unknown."""
    base, _, parameter = name.partition(":")
    if base not in INTEGRATORS or (parameter and base not in _WITH_PARAMETER):
        raise InputError(f"integrator '{name}' does not exist; {nearest(base, INTEGRATORS)}")
    if not parameter:
        return INTEGRATORS[base]
    make, what, example = _WITH_PARAMETER[base]
    try:
        value = float(parameter)
    except ValueError:
        raise InputError(f"integrator '{name}': {what} must be a number, e.g. {base}:{example}") from None
    return make(value)


def amplification(name: str) -> float:
    """How much larger than a stage's own error its share in the step may be: the table's largest coefficient, or 1."""
    table = integrator_table(name)
    if table[0, 0] != DIRK:
        return 1.0
    stages = int(table[0, 1])
    return max(1.0, float(np.abs(table[1 : stages + 1, :stages]).max()))
